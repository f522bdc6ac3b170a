//! Tables of frames and stars in Parquet, made in parts.

mod frame_row;
mod frames;
mod merge;
mod nights;
mod parts;
mod read;
mod status;
mod votable;
mod write;

pub use frame_row::FrameRow;
pub use frames::{FrameSummary, frames};
pub use merge::merge;
pub use nights::{CameraNight, Nights, summary};
pub use parts::{Archive, PartState, PartTables, PartWriter, checksums};
pub use read::names_in;
pub use status::{ArchiveStatus, UnreadFrame, status};
pub use write::TableWriter;
