//! Magnitudes of stars in a frame.

use super::association::FrameStar;
use super::identified_frame::IdentifiedFrame;
use crate::detect::Detection;

/// Magnitudes per relative error: 2.5 / ln 10.
pub(crate) const MAG_PER_RELATIVE: f64 = 1.085_736_204_758_13;

/// A star's brightness in a frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MeasuredMagnitude {
    /// −2.5 log10 of its flux, in ADU/s where the exposure is known, without its neighbors' light and what the
    /// lens takes.
    pub instrumental_mag: f64,
    /// Its standard error.
    pub sigma_mag: f64,
}

impl MeasuredMagnitude {
    /// That of a detection.
    pub fn of(frame: &IdentifiedFrame, star: &FrameStar, detection: &Detection) -> Self {
        let flux_adu = detection.flux_adu
            / (1.0 + star.neighbors_light)
            / frame.lens_transmission(&detection.position);
        Self {
            instrumental_mag: instrumental_mag(flux_adu / frame.exposure_s.unwrap_or(1.0)),
            sigma_mag: MAG_PER_RELATIVE / detection.snr,
        }
    }
}

/// −2.5 log10(`flux`): the magnitude without zero point.
pub fn instrumental_mag(flux: f64) -> f64 {
    -2.5 * libm::log10(flux)
}
