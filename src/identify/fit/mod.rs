//! Fits of attitude and camera to stars.
//!
//! [`fit_camera`] fits attitude, focal length and lens distortion to star positions in pixels.
//! `refine` pairs stars and fits in turn, until a hypothesis has all of its stars.

mod adjustment;
mod camera_fit;
mod predictions;
mod refine;

pub use adjustment::{MeasuredStar, POSE_PARAMETERS};
pub use camera_fit::{CameraFit, fit_camera};
pub use predictions::{Predictions, predictions_by_lens_terms, predictions_by_polynomial};
pub(crate) use refine::{NamingStart, Refined, Refiner, Start};
