//! What detection will do in a frame that is only described: for those who predict it.

use crate::detect::config::DetectConfig;
use crate::detect::filter::Kernel;
use crate::detect::gaussian_threshold;
use crate::detect::threshold::{Weights, threshold_for_photons};

/// The matched filter and the threshold of [`detect`](super::detect) in a frame with photon and Gaussian noise.
#[derive(Debug, Clone, PartialEq)]
pub struct FilterModel {
    /// The weights along either axis at distances 0, 1, … pixels; the sum of their squares, both sides counted, is 1. So
    /// filtered white noise keeps its standard deviation.
    pub half_kernel: Vec<f64>,
    /// The threshold in standard deviations of the noise.
    pub threshold_sigma: f64,
}

impl FilterModel {
    /// For frames of this size in pixels, spots of this standard deviation, and pixels whose noise has this skewness: of λ
    /// photoelectrons and noise of n electrons in all, λ/n³.
    pub fn new(
        config: &DetectConfig,
        size_px: (usize, usize),
        spot_sigma_px: f64,
        skewness: f64,
    ) -> Self {
        let kernel = Kernel::for_spot(spot_sigma_px);
        let threshold_sigma = config.threshold_sigma.unwrap_or_else(|| {
            let u = gaussian_threshold(config, size_px, spot_sigma_px, &kernel);
            let weights = Weights::for_spot(spot_sigma_px, kernel.radius(), size_px);
            threshold_for_photons(u, skewness, &weights)
        });
        Self {
            half_kernel: kernel.half().iter().map(|&w| f64::from(w)).collect(),
            threshold_sigma,
        }
    }
}
