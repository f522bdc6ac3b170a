//! The search for a hypothesis about pointing, roll and scale.
//!
//! `triangle_search` looks triangles up (`queries`) and confirms what they suggest (`confirmation`), as
//! far as a `plan` goes, and counts `votes` for poses (`aligned`, `pose_cells`); `false_alarm` decides.
//! `thinning` and `tiers` leave detections out that hide the stars. In `windows` any lens
//! is like a pinhole.

mod aligned;
mod confirmation;
mod false_alarm;
mod plan;
mod pose_cells;
mod queries;
mod thinning;
mod tiers;
mod triangle_search;
mod unseen;
mod votes;
mod windows;

pub use plan::SearchPlan;
pub use thinning::Thinning;
pub use tiers::Tiers;
pub use triangle_search::{
    FoundHypothesis, LOG10_FALSE_ALARM_LIMIT, LOG10_SURE, SearchBuffers, TriangleSearch,
};
pub use windows::{SearchWindow, Windows};
