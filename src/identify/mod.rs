//! Which stars are these, and where does the camera point?
//!
//! [`StarField`] (positions and magnitudes) and [`Priors`] → [`Identification`]: catalogue stars,
//! attitude and scale, or the [`SearchFailure`].
//!
//! 1. `search`: triangles of bright observed stars are looked up in an index of catalogue
//!    triangles. Each similar triangle is a hypothesis, which further stars confirm or refute. Where
//!    none of the brightest agree, those of each part of the frame are tried, and those below a
//!    number of brighter detections. The probability that chance gives as good an answer decides.
//! 2. `fit`: the hypothesis is fitted to the bright stars that agree, with as much lens
//!    distortion as they support.
//! 3. `naming`: each star gets its name and the probability that the name is chance. Camera and
//!    attitude are fitted to the sure names alone.
//! 4. [`diagnosis`]: where nothing is identified, why.
//!
//! [`lens`]: the lens of a camera, measured in several of its frames.
//!
//! Caveats: fields from about 1.5° to 80°, a pinhole camera with the optical axis at the frame's
//! centre and a distortion up to seventh order (radial) or fifth order (any), at least [`MIN_STARS`]
//! stars of the catalogue.

pub mod diagnosis;
mod effort;
mod field;
#[doc(hidden)]
pub mod fit;
mod grid;
mod hypothesis;
mod identification;
mod index;
pub mod lens;
mod naming;
mod pairing;
#[cfg(debug_assertions)]
mod planted;
mod predict;
mod priors;
mod search;
mod workspace;

pub use effort::Effort;
pub(crate) use field::OtherFields;
pub use field::{ObservedStar, Photometry, SourceIndex, StarField};
pub use identification::MIN_STARS;
pub(crate) use identification::UnknownCentre;
pub use identification::{Identification, SearchFailure, StarMatch};
pub use index::IndexedCatalog;
pub(crate) use index::SearchedPart;
pub use index::{CacheError, cache_directory};
pub use predict::{PredictedStar, SkyView};
pub use priors::{
    DateSource, DateZone, FrameDate, Priors, Scale, ScalePrior, ScaleSource, SkyRegion,
};
pub use search::LOG10_FALSE_ALARM_LIMIT;
pub(crate) use workspace::Choices;
pub use workspace::{NAME_ODDS, PointedField};
pub use workspace::{Workspace, identify};
