//! What detection will do in a frame that is only described: for those who predict it.

use super::matched_filter::Kernel;
use super::{DetectConfig, gaussian_threshold};

/// The matched filter and the threshold of [`detect`](super::detect) in a frame with Gaussian noise.
#[derive(Debug, Clone, PartialEq)]
pub struct FilterModel {
    /// The weights along either axis at distances 0, 1, … pixels; the sum of their squares, both sides counted, is 1. So
    /// filtered white noise keeps its standard deviation.
    pub half_kernel: Vec<f64>,
    /// The threshold in standard deviations of the noise.
    pub threshold_sigma: f64,
}

impl FilterModel {
    /// For frames of this size in pixels whose spots have this standard deviation.
    pub fn new(config: &DetectConfig, size_px: (usize, usize), spot_sigma_px: f64) -> Self {
        let kernel = Kernel::for_spot(spot_sigma_px);
        let threshold_sigma = config
            .threshold_sigma
            .unwrap_or_else(|| gaussian_threshold(config, size_px, spot_sigma_px, &kernel));
        Self {
            half_kernel: kernel.half().iter().map(|&w| f64::from(w)).collect(),
            threshold_sigma,
        }
    }
}
