//! What do many frames show? Tables of frames and stars in Parquet, made in parts.
//!
//! names of frames and a configuration → [`Plan`] → for each [`Part`] its rows → [`Archive`] →
//! [`status()`], [`merge()`], [`summary`]
//!
//! 1. The names are sorted, and cut into parts of a fixed number of frames. A worker takes every
//!    n-th part ([`Plan::shard`]), so the parts do not depend on the number of workers.
//! 2. A part is written whole: its name has a hash of its frames and of the configuration. A part that
//!    is there is done, unless its checksums tell that it was changed since.
//! 3. A directory belongs to one list of frames and one configuration ([`Archive::claim`]). Another
//!    one is refused, and told what differs.
//!
//! Both tables have VOTable metadata: unit, UCD and description of every column.

mod configuration;
mod directory;
mod error;
mod frame_row;
mod frames;
mod guard;
mod identity;
mod merge;
mod nights;
mod plan;
mod read;
mod status;
mod votable;
mod write;

pub use configuration::{CatalogIdentity, Configuration, FileHash, NightConfiguration};
pub use directory::checksums;
pub use directory::{Archive, PartState, PartWriter, claim_file};
pub use error::ArchiveError;
pub use frame_row::FrameRow;
pub use frames::{FrameSummary, frames};
pub use identity::{Identity, SCHEMA};
pub use merge::merge;
pub use nights::{CameraNight, Nights, summary};
pub use plan::{DEFAULT_FRAMES_PER_PART, Part, Plan, Shard};
pub use read::names_in;
pub use status::{ArchiveStatus, UnreadFrame, status};
pub use write::TableWriter;
