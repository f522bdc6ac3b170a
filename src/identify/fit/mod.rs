//! Fits of attitude and camera to stars.
//!
//! [`fit_camera`] fits attitude, focal length and lens distortion to star positions in pixels.
//! `lens_choice` chooses the lens that `refine` fits, which pairs stars and fits in turn, until a
//! hypothesis has all of its stars. `growth` follows a lens from a part of the frame over all of it.

mod adjustment;
mod camera_fit;
mod growth;
mod joint_fit;
mod lens_choice;
mod predictions;
mod refine;

pub use adjustment::{MeasuredStar, POSE_PARAMETERS};
pub(crate) use adjustment::{PositionPredictor, PredictedPosition};
pub use camera_fit::{CameraFit, fit_camera, fit_known_lens};
pub(crate) use growth::{Growth, Seed};
pub(crate) use joint_fit::{
    JointFit, JointFrame, fit_jointly, fit_scale, lens_pulls, residuals_px,
};
pub(crate) use lens_choice::{WIDE_RAD, is_affordable, least_gain, worth_a_projection};
pub use predictions::{Predictions, predictions_by_terms};
pub(crate) use refine::{NamingStart, Refined, Refiner, Start};
