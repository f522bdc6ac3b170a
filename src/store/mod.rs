//! Results of many frames: runs that can be resumed after an interruption, and their tables.
//!
//! 1. A directory belongs to one run: an [`Identity`] in it has all that the results depend on ([`claim()`]). Another
//!    run is refused, with a list of what differs.
//! 2. Pieces that are written whole are not computed again:
//!    - the rows of one frame after the other, as lines of JSON with checksums ([`Journal`]) or as tables of CSV that
//!      are cut back to what is whole ([`RowReader`]);
//!    - parts of a fixed number of frames, as Parquet ([`Plan`], and `Archive` with the feature `archive`).
//!
//! # Archives
//! names of frames and a configuration → [`Plan`] → for each [`Part`] its rows → `Archive` → `status`, `merge`,
//! `summary`
//!
//! 1. The names are sorted, and cut into parts of a fixed number of frames. A worker takes every
//!    n-th part ([`Plan::shard`]), so the parts do not depend on the number of workers.
//! 2. A part is written whole: its name has a hash of its frames and of the configuration. A part that
//!    is there is done, unless its checksums tell that it was changed since.
//!
//! Tables in Parquet have VOTable metadata: unit, UCD and description of every column.

#[cfg(feature = "archive")]
mod archive;
mod claim;
mod configuration;
mod csv_rows;
mod csv_table;
mod error;
mod identity;
mod journal;
mod plan;

#[cfg(feature = "archive")]
pub use archive::{
    Archive, ArchiveStatus, CameraNight, FrameRow, FrameSummary, Nights, PartState, PartTables,
    PartWriter, TableWriter, UnreadFrame, checksums, frames, merge, names_in, status, summary,
};
pub(crate) use claim::lock;
pub use claim::{RunFiles, claim};
pub use configuration::{CatalogIdentity, Configuration, FileHash, NightConfiguration};
pub use csv_rows::RowReader;
pub(crate) use csv_table::CsvTable;
pub use error::StoreError;
pub use identity::Identity;
pub use journal::{Journal, has_row_of};
pub use plan::{DEFAULT_FRAMES_PER_PART, Part, Plan, Shard};
