//! The filter and the threshold that a frame would get, to predict detection without a frame.

use crate::base::size::Size;
use crate::detect::config::DetectConfig;
use crate::detect::filter::Kernel;
use crate::detect::threshold::{FilterWeights, gaussian_threshold, threshold_for_photons};

/// The matched filter and the threshold of [`detect`](super::detect), for photon noise and Gaussian
/// noise.
#[derive(Debug, Clone, PartialEq)]
pub struct FilterModel {
    /// The filter's weights along either axis at distances 0, 1, … pixels. The sum of their
    /// squares, both sides counted, is 1, so filtered white noise keeps its standard deviation.
    pub half_kernel: Vec<f64>,
    /// The threshold in standard deviations of the noise.
    pub threshold_sigma: f64,
}

impl FilterModel {
    /// The model for a frame size, a spot's standard deviation in pixels, and the skewness
    /// of the noise of a pixel: λ/n³ for λ photoelectrons and a total noise of n electrons.
    pub fn new(config: &DetectConfig, size: Size, spot_sigma_px: f64, skewness: f64) -> Self {
        let kernel = Kernel::for_spot(spot_sigma_px);
        let threshold_sigma = config.threshold_sigma.unwrap_or_else(|| {
            let u = gaussian_threshold(config, size, config.cell_px, spot_sigma_px, &kernel);
            let weights = FilterWeights::for_spot(spot_sigma_px, kernel.radius(), size);
            threshold_for_photons(u, skewness, &weights)
        });
        Self {
            half_kernel: kernel.half().iter().map(|&w| f64::from(w)).collect(),
            threshold_sigma,
        }
    }
}
