//! The level of a pixel without light, by frames of different exposure.

use crate::base::statistics::{Estimate, median, median_and_sigma};
use crate::frame::Frame;
use crate::sky::{DarkLevel, DarkSource};

/// The level of a frame's background, and how long it was exposed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameLevel {
    mjd: f64,
    exposure_s: f64,
    level_adu: f64,
}

impl FrameLevel {
    /// That of a frame whose date and exposure are known, and whose background is well below saturation.
    pub fn measure(frame: &Frame) -> Option<Self> {
        /// Pixels that are looked at, about.
        const SAMPLES: usize = 20_000;
        /// Largest level over that of saturation.
        const MAX: f64 = 0.8;
        let step = (frame.size().pixels() / SAMPLES).max(1) | 1;
        let values = frame.pixels.values().step_by(step).map(f64::from);
        let mut values: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
        let found = Self {
            mjd: frame.metadata.date?.modified_julian_date()?,
            exposure_s: frame.metadata.exposure_s?,
            level_adu: median(&mut values),
        };
        let full_adu = frame
            .saturation_level_adu()
            .map_or(f64::INFINITY, f64::from);
        (found.level_adu < MAX * full_adu).then_some(found)
    }
}

/// The level of a pixel without light by the frames of a night in the order of their dates: it is what is left where
/// the light of neighbors is as their exposures. `None` where too few neighbors have different exposures.
pub fn dark_level(levels: &[FrameLevel]) -> Option<DarkLevel> {
    const MIN_PAIRS: usize = 3;
    /// Error of a median over that of a mean.
    const OF_MEDIAN: f64 = 1.253;
    /// How much the sky changes between neighbors, over its light.
    const CHANGE: f64 = 0.01;
    let pairs = levels
        .windows(2)
        .filter_map(|pair| level_of_pair(pair[0], pair[1]));
    let (mut dark_adu, mut sky_adu): (Vec<f64>, Vec<f64>) = pairs.unzip();
    let pairs = dark_adu.len();
    if pairs < MIN_PAIRS {
        return None;
    }
    let (value, scatter) = median_and_sigma(&mut dark_adu);
    let by_scatter = OF_MEDIAN * scatter / (pairs as f64).sqrt();
    let by_change = CHANGE * median(&mut sky_adu);
    Some(DarkLevel {
        adu: Estimate {
            value,
            sigma: libm::hypot(by_scatter, by_change),
        },
        source: DarkSource::Exposures,
    })
}

/// The level without light by two neighbors, and the light in the shorter exposure.
fn level_of_pair(first: FrameLevel, second: FrameLevel) -> Option<(f64, f64)> {
    const MIN_RATIO: f64 = 1.5;
    /// Time between them at most, in days.
    const MAX_D: f64 = 10.0 / 1440.0;
    let (short, long) = if first.exposure_s < second.exposure_s {
        (first, second)
    } else {
        (second, first)
    };
    let is_near = (second.mjd - first.mjd).abs() < MAX_D;
    if !is_near || long.exposure_s < MIN_RATIO * short.exposure_s {
        return None;
    }
    let per_s = (long.level_adu - short.level_adu) / (long.exposure_s - short.exposure_s);
    let light_adu = per_s * short.exposure_s;
    (per_s > 0.0).then_some((short.level_adu - light_adu, light_adu))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames each minute, of a sky that grows brighter by 0.3 % from one to the next.
    fn levels(exposures_s: impl Fn(usize) -> f64) -> Vec<FrameLevel> {
        let level = |number: usize| {
            let exposure_s = exposures_s(number);
            let noise_adu = (number * 7919 % 11) as f64 * 0.1 - 0.5;
            FrameLevel {
                mjd: 60_000.0 + number as f64 / 1440.0,
                exposure_s,
                level_adu: 100.0 + 20.0 * exposure_s * 1.003_f64.powi(number as i32) + noise_adu,
            }
        };
        (0..40).map(level).collect()
    }

    #[test]
    fn exposures_that_alternate_tell_the_level() {
        let alternating = |number| [10.0, 20.0][number % 2];
        let found = dark_level(&levels(alternating)).unwrap().adu;
        assert!((found.value - 100.0).abs() < 2.0 * found.sigma, "{found:?}");
        assert!(found.sigma < 5.0, "{found:?}");
    }

    #[test]
    fn one_exposure_and_few_changes_tell_nothing() {
        assert_eq!(dark_level(&levels(|_| 20.0)), None);
        let two_changes = |number| {
            if (10..20).contains(&number) {
                5.0
            } else {
                20.0
            }
        };
        assert_eq!(dark_level(&levels(two_changes)), None);
        let slow = |number: usize| 10.0 * 1.2_f64.powi(number as i32 / 4);
        assert_eq!(dark_level(&levels(slow)), None);
    }
}
