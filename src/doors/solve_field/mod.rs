//! What does `solve-field` of astrometry.net print?
//!
//! [`Solution`](crate::solve::Solution) → the [`lines()`] that its callers read. Its tables are those of
//! [`tables`](crate::report::tables).
//!
//! # Reference
//! astrometry.net 0.93: `solve-field.c`.

mod c_format;
mod lines;

pub use lines::{Names, lines};
