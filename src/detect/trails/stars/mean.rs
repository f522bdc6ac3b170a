//! The mean light along the trails of a frame.
//!
//! It begins and ends where it falls to half, which is what fixes the middle: clouds, wind and the
//! motion itself make it uneven, and a bar of uneven light is not centred on its trail.

use super::largest::LargeRegion;
use super::light::Template;
use super::profile::{Strip, TrailProfile};
use super::shape::TrailShape;
use super::streak_profile::StreakProfile;
use crate::detect::fit::FrameMaps;

/// Part of the trail at each end whose mean light is the level there,
const END_FRACTION: f64 = 0.25;
/// and the pixels before the end that have it, once it is known where that is about.
const END_PX: f64 = 6.0;
/// Least and most that the light changes from their middle to the end, over the light there.
const MIN_CHANGE: f64 = 0.2;
const MAX_CHANGE: f64 = 0.5;
/// Light farther than this beyond the ends is none, in pixels.
const MARGIN_PX: f64 = 4.0;
/// Brighter trails count no more than this signal-to-noise ratio.
const MAX_SNR: f64 = 30.0;

/// The mean light of the trails in some regions, of which most have nearly this `shape`; better than
/// `template`, if there is one.
pub(super) fn measure_template(
    maps: &FrameMaps<'_>,
    regions: &[&LargeRegion<'_>],
    shape: &TrailShape,
    template: Option<&Template>,
) -> Option<Template> {
    let mut mean = MeanProfile::default();
    for_each_trail(maps, regions, shape, template, |profile, bar| {
        mean.add(profile, bar);
    });
    mean.template(shape.length_px)
}

/// Calls `use_trail` with the profile around the star in each region, and its bar.
pub(super) fn for_each_trail(
    maps: &FrameMaps<'_>,
    regions: &[&LargeRegion<'_>],
    shape: &TrailShape,
    template: Option<&Template>,
    mut use_trail: impl FnMut(&TrailProfile, &StreakProfile),
) {
    let mut profile = TrailProfile::default();
    for large in regions {
        let mut strip = Strip {
            x: large.region.x,
            y: large.region.y,
            shape: *shape,
            reach_px: 1.2 * shape.length_px,
        };
        profile.measure(maps, &strip);
        if let Some(bar) = StreakProfile::fit(&profile, shape, template, 0.0) {
            strip.shift(bar.along_px, bar.across_px);
            profile.measure(maps, &strip);
            use_trail(&profile, &bar);
        }
    }
}

/// The mean light of some trails.
#[derive(Debug, Clone, Default)]
struct MeanProfile {
    /// Sum of light and of its weight, of each step.
    sums: Vec<[f64; 2]>,
}

impl MeanProfile {
    fn add(&mut self, profile: &TrailProfile, bar: &StreakProfile) {
        let snr = (bar.flux_adu / bar.sigma_flux_adu).min(MAX_SNR);
        let weight = snr * snr;
        self.sums.resize(profile.light.len(), [0.0; 2]);
        for (step, [light, weights]) in self.sums.iter_mut().enumerate() {
            if profile.weight[step] > 0.0 {
                *light += weight * profile.light[step] / bar.flux_adu;
                *weights += weight;
            }
        }
    }

    /// The template, of about this length; `None` where the light has no ends.
    fn template(&self, length_px: f64) -> Option<Template> {
        /// Where the light is even, ends are found to within this, in pixels.
        const MIN_SIGMA_PX: f64 = 0.06;
        let ([sharp_left, left], [sharp_right, right]) =
            (self.end(-1.0, length_px)?, self.end(1.0, length_px)?);
        // How far the middle depends on how ends are told.
        let moved_px = 0.5 * ((right - left) - (sharp_right - sharp_left));
        let middle = (self.sums.len() / 2) as f64;
        let first = (middle - left - MARGIN_PX).ceil().max(0.0) as usize;
        let end = (middle + right + MARGIN_PX) as usize + 1;
        let steps = &self.sums[first..end.min(self.sums.len())];
        let mean = |&[light, weight]: &[f64; 2]| if weight > 0.0 { light / weight } else { 0.0 };
        let mut light: Vec<f64> = steps.iter().map(mean).map(|light| light.max(0.0)).collect();
        let sum: f64 = light.iter().sum();
        if sum <= 0.0 {
            return None;
        }
        light.iter_mut().for_each(|light| *light /= sum);
        Some(Template {
            light,
            middle: middle + 0.5 * (right - left) - first as f64,
            length_px: left + right,
            middle_sigma_px: libm::hypot(MIN_SIGMA_PX, 0.5 * moved_px),
        })
    }

    /// Distance from the middle to the end on one `side`, in pixels, as if the light did not change
    /// towards it, and as it does.
    fn end(&self, side: f64, length_px: f64) -> Option<[f64; 2]> {
        let half = 0.5 * length_px;
        let inner = half * (1.0 - 2.0 * END_FRACTION);
        // Noise that falls below the level before the end would be one.
        let smooth = (length_px / 20.0).round().max(1.0);
        let level = self.mean(side, inner, half - 2.0)?;
        let about = self.fall(side, inner, 0.5 * level, smooth)?;
        // Where light is uneven the smoothed end is elsewhere.
        let near = self.mean(side, (about - END_PX).max(inner), about - 2.0)?;
        let sharp = self.fall(side, (about - smooth - 1.0).max(0.0), 0.5 * near, 0.0)?;
        // The level at the end itself, where it changes towards it.
        let near = self.mean(side, sharp - END_PX / 2.0, sharp - 1.5)?;
        let before = self.mean(side, sharp - END_PX, sharp - END_PX / 2.0 - 1.0)?;
        let change = near - before;
        let most = MAX_CHANGE * near.abs();
        let level = if change.abs() > MIN_CHANGE * near {
            near + change.clamp(-most, most)
        } else {
            0.5 * (near + before)
        };
        let end = self.fall(side, sharp - 2.0, 0.5 * level, 0.0)?;
        Some([sharp, end])
    }

    /// The mean light between two distances from the middle on one side; `None` beyond what was measured.
    fn mean(&self, side: f64, from: f64, to: f64) -> Option<f64> {
        let step = |distance: f64| (self.sums.len() / 2) as f64 + side * distance;
        let (from, to) = (step(from).min(step(to)), step(from).max(step(to)));
        if to.round() < 0.0 {
            return None;
        }
        let steps = from.round().max(0.0) as usize..to.round() as usize + 1;
        let steps = self.sums.get(steps.start..steps.end.min(self.sums.len()))?;
        let sums = steps
            .iter()
            .fold([0.0; 2], |s, v| [s[0] + v[0], s[1] + v[1]]);
        (sums[1] > 0.0).then(|| sums[0] / sums[1])
    }

    /// The distance from the middle, beyond `inner`, where the light falls below `limit`, in the mean of
    /// the steps within `smooth`.
    fn fall(&self, side: f64, inner: f64, limit: f64, smooth: f64) -> Option<f64> {
        let light = |distance: f64| self.mean(side, distance - smooth, distance + smooth);
        let mut distance = inner.round();
        let mut before = light(distance)?;
        loop {
            distance += 1.0;
            let here = light(distance)?;
            if here < limit && before > here {
                let part = (before - limit) / (before - here);
                return Some(distance - 1.0 + part.clamp(0.0, 1.0));
            }
            before = here;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_that_never_falls_has_no_end_on_either_side() {
        let mean = MeanProfile {
            sums: vec![[1.0, 1.0]; 41],
        };
        for side in [-1.0, 1.0] {
            assert_eq!(mean.fall(side, 5.0, 0.5, 1.0), None);
        }
    }
}
