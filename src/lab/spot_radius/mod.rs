//! How wide should a star's spot be, and how far out of focus does the lens make it?
//!
//! [`DefocusPlan`] → [`DefocusPlan::run`]: a [`StarStudy`] for each star → [`DefocusReport`]
//!
//! 1. [`Noise`]: the noise of a pixel without light, from the camera, from dark frames or from the
//!    paper. The radii are reported for this noise.
//! 2. [`StarStudy`]: the errors of the star's centroids over the grid of radii and noises and, with
//!    more trials, over the radii at the noise of step 1; curves, lines and a surface through them.
//! 3. [`DefocusReport`]: the best radius, the radii that meet each required error, and all tables,
//!    for JSON, CSV and text.
//!
//! [`crate::lab::defocus`] defines radius, error and noise, and the two kinds of stars.

mod caller;
mod error;
mod noise;
mod plan;
mod report;
mod star;
mod surface;
mod text;

pub use caller::Caller;
pub use error::{DefocusError, NoiseError};
pub use noise::{DarkNoise, Noise};
pub use plan::DefocusPlan;
pub use report::{
    BestAtNoise, BestRadius, CurveRow, DefocusReport, DefocusStarReport, GridRow, RequiredError,
    SpotRadius,
};
pub use star::{
    BRIGHTER_THAN_LIMIT_MAG, DefocusStar, PredictedError, RadiusPoint, StarStudy, default_v_mag,
};
pub use surface::{ClosedFormReport, PaperSurface, SurfaceReport};
