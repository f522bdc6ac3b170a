//! Rows of the tables: results of each simulated frame and of each star on it.
//!
//! Lengths are in pixels, light in electrons, angles in the unit in their name. Missing values are
//! empty.

use crate::study::robustness::Answer;
use serde::{Deserialize, Serialize};

/// Magnitudes beyond the predicted limit down to which the table of stars goes.
pub const BEYOND_LIMIT_MAG: f64 = 1.5;

/// A simulated frame, and the result of the pipeline.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FrameRecord {
    /// Number of the frame, from 0.
    pub frame: u64,
    /// Seed of the random numbers in its pixels.
    pub seed: u64,
    /// True right ascension of the centre.
    pub ra_deg: f64,
    /// True declination of the centre.
    pub dec_deg: f64,
    /// True position angle of image-up.
    pub up_pa_deg: f64,
    /// Whether it was identified correctly.
    pub status: Answer,
    /// Code of the reason why not.
    pub reason: Option<String>,
    /// True stars on the frame that are brighter than the predicted limit.
    pub stars_above_limit: u64,
    /// Star-like detections.
    pub detected: u64,
    /// Detections rejected as hot pixels, trails or extended light.
    pub rejected: u64,
    /// Named detections.
    pub named: u64,
    /// Named detections that are another star, or none.
    pub misnamed: u64,
    /// Misnamed detections whose name is that of another star at the same position, such as the
    /// fainter one of an unresolved pair.
    pub misnamed_companions: u64,
    /// Star-like detections without the light of any star.
    pub false_detections: u64,
    /// Star-like detections with the light of several stars, none of which contributes more than
    /// half.
    pub blends: u64,
    /// Rows of the table of stars.
    pub star_rows: u64,
    /// Rotation about the camera's x axis from the true to the measured attitude; this and the
    /// following for right answers only.
    pub error_x_arcsec: Option<f64>,
    /// Rotation about the y axis.
    pub error_y_arcsec: Option<f64>,
    /// Rotation about the boresight.
    pub error_roll_arcsec: Option<f64>,
    /// Stated standard error of the rotation about x.
    pub sigma_x_arcsec: Option<f64>,
    /// Stated standard error of the rotation about y.
    pub sigma_y_arcsec: Option<f64>,
    /// Stated standard error of the rotation about the boresight.
    pub sigma_roll_arcsec: Option<f64>,
    /// Normalised squared attitude error, in units of its stated covariance (NEES): 3 on average if
    /// the covariance is right.
    pub nees: Option<f64>,
    /// Measured minus true focal length.
    pub focal_error_px: Option<f64>,
    /// Stated standard error of the focal length.
    pub focal_sigma_px: Option<f64>,
    /// RMS residual.
    pub rms_px: Option<f64>,
    /// V magnitude of the faintest named star.
    pub faintest_vmag: Option<f64>,
    /// Expected V magnitude of the faintest detected star, for the stars on the frame.
    pub expected_faintest_vmag: Option<f64>,
    /// Standard deviation of that magnitude by chance.
    pub expected_faintest_sigma_mag: Option<f64>,
    /// V magnitude of predicted 50 % completeness, for stars of the color for which the measured one
    /// holds.
    pub predicted_limit_vmag: f64,
    /// V magnitude of 50 % completeness measured on this frame.
    pub measured_limit_vmag: Option<f64>,
    /// Its stated standard error.
    pub measured_limit_sigma_mag: Option<f64>,
    /// Measured background level (median).
    pub background_adu: Option<f64>,
    /// True background level.
    pub true_background_adu: f64,
    /// Measured noise of a pixel.
    pub noise_adu: Option<f64>,
    /// True noise of a pixel.
    pub true_noise_adu: f64,
    /// True stars that were detected as several.
    pub split: u64,
    /// Measured minus true photometric zero point.
    pub zero_point_error_mag: Option<f64>,
    /// Stated standard error of the zero point.
    pub zero_point_sigma_mag: Option<f64>,
    /// Measured instrumental magnitudes per magnitude of V; 1 is true.
    pub linearity: Option<f64>,
    /// Its stated standard error.
    pub linearity_sigma: Option<f64>,
    /// Codes of the frame's notes, separated by spaces.
    pub notes: Option<String>,
}

/// Type of a row in the table of stars.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RowKind {
    /// A true star, detected or not.
    #[default]
    Star,
    /// A detection with the light of several stars, none of which contributes more than half.
    Blend,
    /// A detection without the light of any star.
    False,
}

/// Whether a detection was named correctly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Named {
    /// Named as the true star.
    Right,
    /// Named as another star.
    Wrong,
    /// Not named.
    #[default]
    No,
}

/// A true star, down to [`BEYOND_LIMIT_MAG`] below the predicted limit; or a detection that is no
/// such star.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StarRecord {
    /// Number of the frame.
    pub frame: u64,
    /// Type of the row.
    pub kind: RowKind,
    /// The catalogue's identifier.
    pub id: Option<String>,
    /// True Johnson V.
    pub vmag: Option<f64>,
    /// True B−V.
    pub bv_mag: Option<f64>,
    /// True x.
    pub true_x_px: Option<f64>,
    /// True y.
    pub true_y_px: Option<f64>,
    /// Expected electrons.
    pub true_flux_e: Option<f64>,
    /// Whether it is entirely on the frame and the light of other stars is negligible.
    pub isolated: Option<bool>,
    /// Whether its brightest pixel may be saturated.
    pub saturated: Option<bool>,
    /// Predicted detection probability.
    pub probability: Option<f64>,
    /// Signal-to-noise ratio of the matched filter at its position, without its own shot noise.
    pub predicted_snr: Option<f64>,
    /// Cramér-Rao bound of the standard error of x.
    pub bound_x_px: Option<f64>,
    /// Cramér-Rao bound of y.
    pub bound_y_px: Option<f64>,
    /// Cramér-Rao bound of the flux.
    pub bound_flux_e: Option<f64>,
    /// Whether there is a star-like detection to which it contributes more than half of the light.
    pub detected: bool,
    /// Measured x.
    pub x: Option<f64>,
    /// Measured y.
    pub y: Option<f64>,
    /// Stated standard error of x.
    pub sigma_x: Option<f64>,
    /// Stated standard error of y.
    pub sigma_y: Option<f64>,
    /// Measured flux.
    pub flux_e: Option<f64>,
    /// Stated standard error of the flux.
    pub sigma_flux_e: Option<f64>,
    /// Whether it was named correctly.
    pub named: Named,
}

impl StarRecord {
    /// A row of this frame without any measurement.
    pub fn empty(frame: u64, kind: RowKind) -> Self {
        Self {
            frame,
            kind,
            ..Self::default()
        }
    }
}
