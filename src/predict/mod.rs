//! How faint a star can a camera detect?
//!
//! [`Scenario`] (camera, sky, exposure) → [`Budget`] (every quantity up to the limiting magnitude)
//! → [`Prediction`]
//!
//! 1. Transmission of the atmosphere by wavelength and zenith distance ([`Extinction`]).
//! 2. Electrons of a star of magnitude 0 on its brightest pixel, and of the sky in a pixel.
//! 3. Noise, and the limiting magnitude of the peak-pixel rule: the star with the required SNR in
//!    its brightest pixel ([`Budget`]).
//! 4. Threshold, false alarms and completeness of two detectors: the peak-pixel rule and the
//!    matched filter of [`detect`](crate::detect::detect) ([`Detector`]).
//! 5. Expected magnitude of the faintest detected star of a field ([`Faintest`]).
//! 6. Electrons of stars by color ([`StarLight`]).
//! 7. Lower bounds of the errors of position and flux ([`CramerRao`]).
//!
//! [`Prediction`] is the result for one scenario, [`Sweep`] and [`curves`] vary one parameter, and
//! [`PaperFigure`] has the figures of the paper.
//!
//! There are two sets of equations. [`Reading::Paper`] has equations (1) to (12) of the paper as
//! its authors used them. [`Reading::Physical`] corrects their physics.
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
pub(crate) use conditions::REFERENCE_NM;
pub use conditions::{Conditions, Extinction, SkyBrightness};
pub use cramer_rao::CramerRao;
pub use faintest::Faintest;
pub use figures::PaperFigure;
pub use parameters::{CONDITION_KEYS, Parameter, UnknownParameter, title_of};
pub use prediction::{CompletenessPoint, DetectorReport, Prediction};
pub use rows::PredictionError;
pub use rows::{PredictionRow, PredictionTableRow, SweptValue};
pub use scenario::{Reading, Scenario};
pub use star_light::StarLight;
pub use sweep::{CurveValues, Spacing, Sweep, SweepCurve, SweepError, curves};
pub use text::BudgetRow;
