//! The directory of a run: which run it is, and its tables, which a later start continues.
//!
//! (directory, [`ValidationProtocol`](super::ValidationProtocol), [`Catalog`](crate::catalog::Catalog)) →
//! [`claim_directory`] → [`RunTables`]
//!
//! 1. `run.json` has all that the tables depend on. A directory with another run is refused.
//! 2. `frames.csv` and `stars.csv` get the rows of one frame after the other, in order. After an
//!    interruption they are cut back to the last frame that both have whole.
//! 3. [`TableRow`](super::TableRow) describes the columns, so that other formats can have the same tables; a
//!    [part](FRAMES_PER_PART) has the rows of a fixed number of frames.

mod error;
mod identity;
mod rows;
mod table;
mod tables;

pub use error::StoreError;
pub use identity::claim_directory;
pub use rows::RowReader;
pub use tables::{FRAMES_PER_PART, FrameLines, RunTables};
