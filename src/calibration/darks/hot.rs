//! Hot pixels: outliers of level, dark current or noise.

use super::current::DarkCurrent;
use super::noise::TemporalNoise;
use crate::calibration::robust::{RobustMoments, variance_deviate};

/// Default threshold of hot pixels, in standard deviations.
///
/// A normal distribution exceeds 6 once in a thousand million, so no ordinary pixel of the largest
/// detector counts as hot. At 5 it would be one in two frames of a megapixel, at 4 thirty per
/// frame.
pub const HOT_SIGMA: f64 = 6.0;

/// Why a pixel is hot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HotReasons {
    /// Its level is too high or too low.
    pub level: bool,
    /// Its dark current is too high or too low.
    pub dark_current: bool,
    /// Its noise is too high.
    pub noise: bool,
}

/// A hot pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HotPixel {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// Mean level at the longest exposure, in ADU.
    pub level_adu: f64,
    /// Mean level minus that of ordinary pixels, in ADU.
    pub excess_adu: f64,
    /// Standard deviation from frame to frame, in ADU.
    pub noise_adu: Option<f64>,
    /// Dark current, in ADU per second.
    pub dark_current_adu_s: Option<f64>,
    /// Why it is hot.
    pub reasons: HotReasons,
}

/// What the search for hot pixels is based on.
pub(super) struct PixelData<'a> {
    pub width: usize,
    /// Mean levels at the longest exposure.
    pub levels: &'a [f32],
    pub noise: Option<&'a TemporalNoise>,
    pub dark_current: Option<&'a DarkCurrent>,
    /// Step between grey levels. Half of it is the smallest sigma of levels.
    pub step_adu: f64,
    /// The longest exposure, if known. It converts a step of level into one of dark current.
    pub longest_s: Option<f64>,
}

impl PixelData<'_> {
    /// The pixels that deviate by more than `hot_sigma` standard deviations, row by row.
    pub(super) fn hot_pixels(&self, hot_sigma: f64) -> Vec<HotPixel> {
        let floor = self.step_adu / 2.0;
        let Some(level) = RobustMoments::clipped(self.levels, floor) else {
            return Vec::new();
        };
        let currents = self.dark_current.map(|c| c.of_pixels_adu_s.as_slice());
        let current_floor = floor / self.longest_s.unwrap_or(1.0);
        let current = currents.and_then(|currents| RobustMoments::clipped(currents, current_floor));
        let is_outlier = |value: f64, moments: &RobustMoments, floor: f64| {
            (value - moments.mean).abs() > hot_sigma * moments.sigma.max(floor)
        };
        let judge = |(i, &mean): (usize, &f32)| {
            let level_adu = f64::from(mean);
            let dark_current_adu_s = currents.map(|currents| f64::from(currents[i]));
            let variance = self.noise.map(|noise| f64::from(noise.variances[i]));
            let reasons = HotReasons {
                level: is_outlier(level_adu, &level, floor),
                dark_current: dark_current_adu_s
                    .zip(current)
                    .is_some_and(|(value, moments)| is_outlier(value, &moments, current_floor)),
                noise: variance.zip(self.noise).is_some_and(|(variance, noise)| {
                    // Rounding alone may cause this variance.
                    let typical = noise.typical.max(floor * floor);
                    variance_deviate(variance, typical, noise.freedom) > hot_sigma
                }),
            };
            (reasons != HotReasons::default()).then(|| HotPixel {
                x: i % self.width,
                y: i / self.width,
                level_adu,
                excess_adu: level_adu - level.mean,
                noise_adu: variance.map(f64::sqrt),
                dark_current_adu_s,
                reasons,
            })
        };
        self.levels.iter().enumerate().filter_map(judge).collect()
    }
}
