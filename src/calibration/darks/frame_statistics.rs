//! Statistics of a single dark frame.

use crate::calibration::robust::RobustMoments;
use crate::frame::Frame;

/// Statistics of one dark frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameStatistics {
    /// Name of the frame.
    pub frame: String,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Exposure in seconds, if known.
    pub exposure_s: Option<f64>,
    /// Mean of the pixels, in ADU.
    pub mean_adu: f64,
    /// Standard deviation of the pixels, in ADU.
    pub sigma_adu: f64,
    /// Number of pixels without a value.
    pub without_value: usize,
    /// Number of pixels at full scale.
    pub saturated: usize,
    /// Number of local maxima far above the noise.
    pub bright: usize,
    /// Number of these that look like stars: their neighbors along both axes are bright, too.
    pub star_like: usize,
}

impl FrameStatistics {
    /// Measures `frame`. Without `exposure_s`, the exposure is that of its header.
    #[doc(alias = "E_i")]
    #[doc(alias = "sigma_gi")]
    pub fn measure(name: &str, frame: &Frame, exposure_s: Option<f64>) -> Self {
        let pixels = frame.values();
        let values = pixels.iter().filter(|p| !p.is_nan());
        let moments = RobustMoments::of(values.clone().map(|&p| f64::from(p)));
        let full_adu = frame.saturation_adu.unwrap_or(f32::INFINITY);
        let maxima = Maxima::count(frame);
        Self {
            frame: name.to_owned(),
            width: frame.width,
            height: frame.height,
            exposure_s: exposure_s.or(frame.metadata.exposure_s),
            mean_adu: moments.mean,
            sigma_adu: moments.sigma,
            without_value: frame.pixels.len() - values.clone().count(),
            saturated: values.filter(|p| **p >= full_adu).count(),
            star_like: maxima.star_like,
            bright: maxima.bright,
        }
    }
}

/// Whether two exposures are the same, up to rounding in a header.
pub(super) fn is_same_exposure(one: Option<f64>, other: Option<f64>) -> bool {
    /// Relative difference up to which exposures are the same.
    const TOLERANCE: f64 = 1e-3;
    match (one, other) {
        (Some(one), Some(other)) => (one - other).abs() <= TOLERANCE * one.max(other),
        (None, None) => true,
        _ => false,
    }
}

/// Numbers of local maxima.
#[derive(Default)]
struct Maxima {
    bright: usize,
    star_like: usize,
}

impl Maxima {
    /// Counts the bright local maxima of `frame`. A hot pixel is isolated, and pairs of them or a
    /// bright column extend along one axis only; a star extends along both.
    fn count(frame: &Frame) -> Self {
        /// Minimum height of a bright pixel, in sigmas.
        const BRIGHT_SIGMA: f64 = 8.0;
        /// Minimum light of a star on two opposite neighbors of its peak: in sigmas, and as a
        /// share of the peak. A Gaussian spot with a sigma of half a pixel has a third there.
        const NEIGHBORS_SIGMA: f64 = 4.0;
        const NEIGHBORS_FRACTION: f64 = 0.15;
        let mut maxima = Self::default();
        let floor = f64::from(frame.step_adu) / 2.0;
        let pixels = frame.values();
        let Some(moments) = RobustMoments::clipped(&pixels, floor) else {
            return maxima;
        };
        let sigma = moments.sigma.max(floor);
        let width = frame.width;
        let above = |i: usize| f64::from(pixels[i]) - moments.mean;
        for y in 1..frame.height - 1 {
            for i in y * width + 1..(y + 1) * width - 1 {
                let peak = above(i);
                if peak.is_nan() || peak <= BRIGHT_SIGMA * sigma {
                    continue;
                }
                let [left, right, up, down] = [i - 1, i + 1, i - width, i + width].map(above);
                if peak < left.max(up) || peak <= right.max(down) {
                    continue;
                }
                let least = (NEIGHBORS_SIGMA * sigma).max(NEIGHBORS_FRACTION * peak);
                maxima.bright += 1;
                maxima.star_like += usize::from(left + right > least && up + down > least);
            }
        }
        maxima
    }
}
