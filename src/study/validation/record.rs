//! What is kept of each simulated frame, and of each star on it: rows of tables.
//!
//! Lengths are in pixels, light in electrons, angles in the unit of their name. What there is none of is empty.

use crate::study::robustness::Answer;
use serde::{Deserialize, Serialize};

/// The table of stars goes so far beyond the predicted limit.
pub const BEYOND_LIMIT_MAG: f64 = 1.5;

/// A simulated frame, and what the pipeline made of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameRecord {
    /// Its number, from 0.
    pub frame: u64,
    /// Seed of the random numbers in its pixels.
    pub seed: u64,
    /// True right ascension of the centre.
    pub ra_deg: f64,
    /// True declination of the centre.
    pub dec_deg: f64,
    /// True position angle of image-up.
    pub up_pa_deg: f64,
    /// Whether it was identified, and rightly.
    pub status: Answer,
    /// Why it was not, as a word for programs.
    pub reason: Option<String>,
    /// True stars on it that are brighter than the predicted limit.
    pub stars_above_limit: u64,
    /// Detections that may be stars.
    pub detected: u64,
    /// Detections that were taken for no stars: hot pixels, trails, extended light.
    pub rejected: u64,
    /// Detections that were named.
    pub named: u64,
    /// Those of them that are another star, or none.
    pub misnamed: u64,
    /// Those of these that have the name of a star that stands there as well: of the fainter one of a pair, or of one of
    /// several, that the frame does not resolve.
    pub misnamed_companions: u64,
    /// Detections that may be stars to which no star's light belongs.
    pub false_detections: u64,
    /// Detections that may be stars with the light of several, none of which has more than half of it.
    pub blends: u64,
    /// Rows of the table of stars.
    pub star_rows: u64,
    /// The turn about the camera's x axis from the true attitude to the one found; only of right answers, as what follows.
    pub error_x_arcsec: Option<f64>,
    /// The same about the y axis.
    pub error_y_arcsec: Option<f64>,
    /// The same about the boresight.
    pub error_roll_arcsec: Option<f64>,
    /// The stated standard error of the turn about x.
    pub sigma_x_arcsec: Option<f64>,
    /// The same about y.
    pub sigma_y_arcsec: Option<f64>,
    /// The same about the boresight.
    pub sigma_roll_arcsec: Option<f64>,
    /// The error squared in units of its stated covariance (normalised estimation error squared): 3 on average where that is true.
    pub nees: Option<f64>,
    /// Focal length found minus the true one.
    pub focal_error_px: Option<f64>,
    /// Its stated standard error.
    pub focal_sigma_px: Option<f64>,
    /// Root mean square of the residuals.
    pub rms_px: Option<f64>,
    /// V magnitude of the faintest star that was named.
    pub faintest_vmag: Option<f64>,
    /// V magnitude of the faintest star to be expected among the true ones.
    pub expected_faintest_vmag: Option<f64>,
    /// How far it is off that by chance.
    pub expected_faintest_sigma_mag: Option<f64>,
    /// V magnitude at which half of the stars should be detected.
    pub predicted_limit_vmag: f64,
    /// The same as the pipeline measured it on this frame.
    pub measured_limit_vmag: Option<f64>,
    /// Its stated standard error.
    pub measured_limit_sigma_mag: Option<f64>,
    /// Median level of the background as measured.
    pub background_adu: Option<f64>,
    /// The true one.
    pub true_background_adu: f64,
    /// Noise of a pixel as measured.
    pub noise_adu: Option<f64>,
    /// The true one.
    pub true_noise_adu: f64,
}

/// What a row of the table of stars is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RowKind {
    /// A true star, detected or not.
    Star,
    /// A detection with the light of several stars, none of which has more than half of it.
    Blend,
    /// A detection to which no star's light belongs.
    False,
}

/// Whether a detection was named.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Named {
    /// As the star that it is.
    Right,
    /// As another star.
    Wrong,
    /// It was not.
    No,
}

/// A true star brighter than the predicted limit and [`BEYOND_LIMIT_MAG`]; or a detection that is no
/// such star.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StarRecord {
    /// The frame.
    pub frame: u64,
    /// What it is.
    pub kind: RowKind,
    /// The catalogue's identifier.
    pub id: Option<String>,
    /// True Johnson V.
    pub vmag: Option<f64>,
    /// True B−V.
    pub bv_mag: Option<f64>,
    /// True column.
    pub true_x_px: Option<f64>,
    /// True row.
    pub true_y_px: Option<f64>,
    /// Electrons to be expected of it.
    pub true_flux_e: Option<f64>,
    /// Whether it is whole on the frame, and no other star's light near it matters.
    pub isolated: Option<bool>,
    /// Whether its brightest pixel may be full.
    pub saturated: Option<bool>,
    /// Predicted probability of its detection.
    pub probability: Option<f64>,
    /// Its light over the noise of the matched filter at its place, its own light's not counted.
    pub snr: Option<f64>,
    /// The least standard error of its column that an unbiased estimate can have (Cramér-Rao).
    pub bound_x_px: Option<f64>,
    /// The same of its row.
    pub bound_y_px: Option<f64>,
    /// The same of its light.
    pub bound_flux_e: Option<f64>,
    /// Whether there is a detection that may be a star, more than half of whose light is its own.
    pub detected: bool,
    /// Column found.
    pub x_px: Option<f64>,
    /// Row found.
    pub y_px: Option<f64>,
    /// The stated standard error of the column.
    pub sigma_x_px: Option<f64>,
    /// The same of the row.
    pub sigma_y_px: Option<f64>,
    /// LightMap found.
    pub flux_e: Option<f64>,
    /// Its stated standard error.
    pub sigma_flux_e: Option<f64>,
    /// Whether it was named.
    pub named: Named,
}

impl StarRecord {
    /// A row of this frame without any measurement.
    pub fn empty(frame: u64, kind: RowKind) -> Self {
        Self {
            frame,
            kind,
            id: None,
            vmag: None,
            bv_mag: None,
            true_x_px: None,
            true_y_px: None,
            true_flux_e: None,
            isolated: None,
            saturated: None,
            probability: None,
            snr: None,
            bound_x_px: None,
            bound_y_px: None,
            bound_flux_e: None,
            detected: false,
            x_px: None,
            y_px: None,
            sigma_x_px: None,
            sigma_y_px: None,
            flux_e: None,
            sigma_flux_e: None,
            named: Named::No,
        }
    }
}
