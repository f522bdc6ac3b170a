//! From a camera, a sky and an exposure to the faintest star that can be detected.
//!
//! [`Scenario`] → [`Budget`]: every quantity between the star and the limiting magnitude, each with its unit.
//!
//! 1. [`Atmosphere`](Conditions): what is left of the light at each wavelength and zenith distance.
//! 2. The star's electrons on its brightest pixel, and those of the sky, for a star of magnitude 0.
//! 3. The noise, and the signal that stands above it by the wanted ratio: the limiting magnitude of the peak-pixel rule.
//! 4. [`Detector`]: what a detector makes of it, the peak-pixel rule and the matched filter as built: completeness.
//! 5. [`Faintest`]: the faintest star to be expected among so many.
//! 6. [`StarLight`]: the electrons of stars of all colours.
//! 7. [`CramerRao`]: how well a star's place and light can be known at best.
//!
//! [`Prediction`] is what is told of a scenario, [`Sweep`] and [`curves`] follow its limit over one parameter, and [`Figure`]
//! has those of the paper.
//!
//! There are two readings. [`Reading::Paper`] is the paper's equations (1) to (12) as its authors used them.
//! [`Reading::Physical`] is the same budget with the physics put right.
//!
//! # Reference
//! Tong, Li & Wang 2014, Acta Optica Sinica 34, 1004003, doi 10.3788/AOS201434.1004003.

mod budget;
mod check;
mod completeness;
mod conditions;
mod cramer_rao;
mod faintest;
mod figures;
mod light;
mod parameters;
mod prediction;
mod rows;
mod scenario;
mod star_light;
mod sweep;
mod text;

pub use budget::{Band, Budget};
pub use check::ScenarioError;
pub use completeness::{Detector, Rule};
pub use conditions::{Conditions, Extinction, REFERENCE_NM, SkyBrightness};
pub use cramer_rao::CramerRao;
pub use faintest::Faintest;
pub use figures::Figure;
pub use light::temperature_k_of;
pub use parameters::{CONDITION_KEYS, Parameter, UnknownParameter, title_of};
pub use prediction::{CompletenessPoint, DetectorReport, Prediction};
pub use rows::{PredictionError, PredictionRow, PredictionTableRow, SweptValue};
pub use scenario::{Reading, Scenario};
pub use star_light::StarLight;
pub use sweep::{Curve, Series, Spacing, Sweep, SweepError, curves};
