//! Pixels that stand out.

use super::DarkCurrent;
use super::robust::{Typical, variance_deviate};

/// How many standard deviations off a pixel counts as hot where nothing is said.
///
/// A normal distribution exceeds 6 once in a thousand million, so that of the largest detector no ordinary pixel is called hot;
/// at 5 it would be one in two frames of a megapixel, at 4 thirty a frame.
pub const HOT_SIGMA: f64 = 6.0;

/// What stands out of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HotReasons {
    /// Its level, above or below.
    pub level: bool,
    /// Its dark current, above or below.
    pub dark_current: bool,
    /// Its noise, above.
    pub noise: bool,
}

/// A pixel that stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HotPixel {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// Its mean level at the longest exposure, in ADU.
    pub level_adu: f64,
    /// That less the level of an ordinary pixel.
    pub excess_adu: f64,
    /// The standard deviation of its value from frame to frame, in ADU.
    pub noise_adu: Option<f64>,
    /// Its dark current, in ADU a second.
    pub dark_current_adu_s: Option<f64>,
    /// What stands out.
    pub reasons: HotReasons,
}

/// What pixels are judged by.
pub(super) struct Evidence<'a> {
    pub width: usize,
    /// Mean levels at the longest exposure.
    pub levels: &'a [f32],
    /// Variances over the frames, how many degrees of freedom they have, and what an ordinary one is.
    pub variances: Option<(&'a [f32], f64, f64)>,
    pub dark_current: Option<&'a DarkCurrent>,
    /// Half of it is the least spread of levels.
    pub step_adu: f64,
    /// The exposure that levels belong to, where there is a dark current: a step of a level is one of a current.
    pub longest_s: Option<f64>,
}

impl Evidence<'_> {
    /// The pixels that stand out by more than `hot_sigma`, row by row.
    pub(super) fn hot_pixels(&self, hot_sigma: f64) -> Vec<HotPixel> {
        let floor = self.step_adu / 2.0;
        let Some(level) = Typical::of(self.levels, floor) else {
            return Vec::new();
        };
        let currents = self.dark_current.map(|c| c.of_pixels_adu_s.as_slice());
        let current_floor = floor / self.longest_s.unwrap_or(1.0);
        let current = currents.and_then(|currents| Typical::of(currents, current_floor));
        let off = |value: f64, typical: &Typical, floor: f64| {
            (value - typical.level).abs() > hot_sigma * typical.spread.max(floor)
        };
        let judge = |(i, &mean): (usize, &f32)| {
            let level_adu = f64::from(mean);
            let dark_current_adu_s = currents.map(|currents| f64::from(currents[i]));
            let variance = self.variances.map(|(all, ..)| f64::from(all[i]));
            let reasons = HotReasons {
                level: off(level_adu, &level, floor),
                dark_current: dark_current_adu_s
                    .zip(current)
                    .is_some_and(|(value, typical)| off(value, &typical, current_floor)),
                noise: self.variances.is_some_and(|(all, freedom, typical)| {
                    // Rounding alone makes so much of a variance.
                    let typical = typical.max(floor * floor);
                    variance_deviate(f64::from(all[i]), typical, freedom) > hot_sigma
                }),
            };
            (reasons != HotReasons::default()).then(|| HotPixel {
                x: i % self.width,
                y: i / self.width,
                level_adu,
                excess_adu: level_adu - level.level,
                noise_adu: variance.map(f64::sqrt),
                dark_current_adu_s,
                reasons,
            })
        };
        self.levels.iter().enumerate().filter_map(judge).collect()
    }
}
