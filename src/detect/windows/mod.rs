//! Stars at known places: windows of a frame are measured, and nothing else of it is read.
//!
//! [`ExpectedStar`] (place, search radius, smear) and [`SpotModel`] → [`FoundStar`]
//!
//! 1. `square`: the pixels around each place are copied, and background and noise measured in the
//!    ring around them, which the star does not reach.
//! 2. `peak`: the highest peak of the matched filter within the search radius.
//! 3. The fit of [`detect`](super::detect()) at the peak, with the spot size and the noise model
//!    that were learned before. Where the star is smeared by a known motion, its spot is a row of
//!    Gaussians along the path.
//!
//! [`WindowDetector::learn`] measures spot size and noise model on stars at known positions.
//!
//! Caveats: the background is flat within a window. Noise is taken as independent from pixel to
//! pixel. Stars with saturated pixels are fitted without these, and flagged.

mod peak;
mod spot_model;
mod square;
mod window_detector;

pub use spot_model::SpotModel;
pub use window_detector::{ExpectedStar, FoundStar, Surplus, WindowDetector};
