//! Parameters, settings and result of a fit.

use crate::detect::psf::PIXEL_VARIANCE_PX2;
use arrayvec::ArrayVec;

/// Maximum number of spots fitted together.
pub(crate) const MAX_SPOTS: usize = 6;
/// Parameters of the largest fit: three for each spot, the background and the size.
pub(super) const MAX_PARAMETERS: usize = 3 * MAX_SPOTS + 2;
/// Parameters of one spot: x, y, flux, background, size.
pub(crate) const ONE_SPOT: usize = 5;
/// Parameters of two spots, by far the most frequent group.
pub(super) const TWO_SPOTS: usize = 3 * 2 + 2;
/// Range of free spot sizes, in pixels.
pub(crate) const SPOT_RANGE_PX: (f64, f64) = (0.2, 12.0);

/// Variance of a pixel as a function of the light of the spots in it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct NoiseModel {
    /// Variance per ADU of light (the inverse gain), in ADU.
    pub shot_adu: f64,
    /// Squared relative error of the spot model.
    pub model_error2: f64,
}

/// Position and flux of one spot with their standard errors: an initial guess, or fitted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct SpotEstimate {
    /// Column, in pixels.
    pub x: f64,
    /// Row, in pixels.
    pub y: f64,
    /// Flux, in ADU.
    pub flux: f64,
    /// Standard error of x, in pixels.
    pub sigma_x: f64,
    /// Standard error of y, in pixels.
    pub sigma_y: f64,
    /// Standard error of the flux, in ADU.
    pub sigma_flux: f64,
    /// The same from noise alone, without the errors of the spot model and of the halo, in ADU.
    pub noise_flux: f64,
}

impl SpotEstimate {
    /// Whether its standard errors, which may be infinite or NaN, are within the width of a spot of
    /// this size: else the pixels do not fix the position.
    pub fn has_position(&self, spot_px: f64) -> bool {
        let width_px = (spot_px.powi(2) + PIXEL_VARIANCE_PX2).sqrt();
        self.sigma_x <= width_px && self.sigma_y <= width_px
    }
}

/// Spots that are fitted together.
pub(crate) type SpotGroup = ArrayVec<SpotEstimate, MAX_SPOTS>;

/// Settings of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FitConfig {
    /// Standard deviation of the spot, in pixels; the initial value where it is free.
    pub spot_px: f64,
    /// Whether the size of the spot is fitted.
    pub free_size: bool,
    /// Variance of the pixels.
    pub noise: NoiseModel,
}

impl FitConfig {
    /// Number of parameters fitted: three for each spot, the background, and the size where free.
    pub(super) fn parameter_count(&self, spots: usize) -> usize {
        3 * spots + 1 + usize::from(self.free_size)
    }
}

/// Result of a fit.
#[derive(Debug, Clone, Default)]
pub(crate) struct SpotFit {
    /// In the order of the initial guesses.
    pub spots: SpotGroup,
    /// Background above the map, in ADU.
    pub background: f64,
    /// Standard deviation of the spot, in pixels.
    pub spot_px: f64,
    /// Its standard error where it was free, in pixels; else 0.
    pub sigma_spot_px: f64,
    /// How much larger the spot would be if its size were free (one linear step), in pixels.
    pub size_excess_px: f64,
    /// Standard error of `size_excess_px`, in pixels.
    pub size_error_px: f64,
    /// Sum of squared residuals over their variance.
    pub chi2: f64,
    /// Number of pixels less number of parameters.
    pub degrees_of_freedom: f64,
    /// Whether the steps became small, and the spots stayed close to their initial positions.
    pub converged: bool,
}
