//! Spot size and noise model of a camera's stars, learned once and kept.

use crate::detect::fit::NoiseModel;
use crate::detect::psf::PIXEL_VARIANCE_PX2;

/// Smallest standard deviation of a spot, in pixels.
const MIN_SPOT_PX: f64 = 0.3;

/// What the stars of a camera look like, and how their noise grows with their light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpotModel {
    /// Standard deviation of the spot of a star that does not move, before pixel integration, in
    /// pixels.
    pub spot_sigma_px: f64,
    /// Variance per ADU of light (the inverse gain), in ADU.
    pub shot_adu: f64,
    /// Squared relative error of the spot model.
    pub model_error2: f64,
}

impl SpotModel {
    pub(super) fn noise(&self) -> NoiseModel {
        NoiseModel {
            shot_adu: self.shot_adu,
            model_error2: self.model_error2,
        }
    }

    /// Standard deviation of the spot of a star that is smeared over `smear_px`, in pixels: of a
    /// round one with the same variance.
    pub fn smeared_sigma_px(&self, smear_px: [f64; 2]) -> f64 {
        (self.spot_sigma_px.powi(2) + smear_variance_px2(smear_px)).sqrt()
    }

    /// Standard deviation of that spot with the pixel, in pixels.
    pub fn width_px(&self, smear_px: [f64; 2]) -> f64 {
        (self.smeared_sigma_px(smear_px).powi(2) + PIXEL_VARIANCE_PX2).sqrt()
    }

    /// Fraction of the light of a star that does not move on its brightest pixel, at most.
    pub fn peak_fraction(&self) -> f64 {
        let half = 0.5 / (std::f64::consts::SQRT_2 * self.spot_sigma_px);
        libm::erf(half).powi(2)
    }
}

/// Mean of the variances along and across the path of a star.
pub(super) fn smear_variance_px2([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y) / 24.0
}

/// The size of a spot that has the variance `spot_px`² when it is smeared.
pub(super) fn without_smear(spot_px: f64, smear_variance_px2: f64) -> f64 {
    (spot_px * spot_px - smear_variance_px2)
        .max(MIN_SPOT_PX * MIN_SPOT_PX)
        .sqrt()
}
