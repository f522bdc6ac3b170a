//! Which stars are these, and where does the camera point?
//!
//! [`StarField`] (positions and magnitudes) and [`Priors`] → [`Identification`]: catalogue stars,
//! attitude and scale, or the [`SearchFailure`].
//!
//! 1. `search`: triangles of bright observed stars are looked up in an index of catalogue
//!    triangles. Each similar triangle is a hypothesis, which further stars confirm or refute. Where
//!    none of the brightest agree, those of each part of the frame are tried, and those below a
//!    number of brighter detections (`thinning`, `tiers`).
//! 2. `refine`: the hypothesis is fitted to the bright stars that agree, with as much lens
//!    distortion as they support.
//! 3. `naming`: each star gets its name and the probability that the name is chance. Camera and
//!    attitude are fitted to the sure names alone.
//! 4. `false_alarm`: the probability that chance gives as good an answer decides.
//! 5. [`diagnosis`]: where nothing is identified, why.
//!
//! Caveats: fields from about 1.5° to 80°, a pinhole camera with the optical axis at the frame's
//! centre and a distortion up to fifth order, at least [`MIN_STARS`] stars of the catalogue.

pub mod attitude;
mod blends;
mod cache;
mod cache_directory;
mod cells;
mod confirmation;
pub mod diagnosis;
mod false_alarm;
mod field;
mod grid;
mod hypothesis;
mod identification;
pub mod index;
mod indexed_catalog;
mod listing;
mod naming;
mod pairing;
mod plan;
#[cfg(debug_assertions)]
mod planted;
mod predict;
mod priors;
mod refine;
mod search;
mod table;
mod thinning;
mod tiers;
pub mod triangle;
mod workspace;

pub use cache::CacheError;
pub use cache_directory::cache_directory;
pub use field::{ObservedStar, Photometry, SourceIndex, StarField};
pub use identification::{Identification, MIN_STARS, SearchFailure, StarMatch};
pub use indexed_catalog::IndexedCatalog;
pub use predict::{PredictedStar, View};
pub use priors::{DateSource, FrameDate, Priors, Scale, ScalePrior, ScaleSource, SkyRegion};
pub use search::LOG10_FALSE_ALARM_LIMIT;
pub use workspace::{NAME_ODDS, Pointing, Workspace, identify};
