//! SKY2000, version 4 or 5 (CDS V/109 or V/145), as its makers distribute it.
//!
//! A file of 520-byte records, one star a line → stars, or a CSV of the bright ones.
//!
//! Parsing is strict, because columns are adjacent: a record of any other length, or without
//! `SKY2000` at its beginning, is unreadable. Only blanks at the end of a line may be missing,
//! which some tools cut off.

mod bright;
mod columns;
mod fixed_width;
mod record;

pub use bright::write_bright_csv;
pub(super) use columns::{COLUMN_COUNT, FIXED_COLUMNS, POSITION, StarColumn, required_columns};
pub(super) use fixed_width::FixedWidth;
pub use fixed_width::RECORD_BYTES;
pub(super) use record::Sky2000Record;
