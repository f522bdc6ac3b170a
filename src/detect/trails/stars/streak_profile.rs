//! A star that is drawn out evenly along a straight line, fitted to the light along it.

use super::light::{FittedTrail, Template};
use super::profile::TrailProfile;
use super::shape::TrailShape;

/// A bar fitted to a profile.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct StreakProfile {
    /// Distance of its middle along the profile, in pixels,
    pub along_px: f64,
    /// its standard error,
    pub sigma_along_px: f64,
    /// and that across.
    pub across_px: f64,
    pub sigma_across_px: f64,
    /// Light, in ADU, and its standard error.
    pub flux_adu: f64,
    pub sigma_flux_adu: f64,
    /// Half of the decrease of chi² by it.
    pub gain: f64,
}

/// Distance between the places that are tried, in pixels, …
const STEP_PX: f64 = 0.25;
/// … and over the length of long bars.
const STEP_FRACTION: f64 = 1.0 / 400.0;
/// Error of the place that even bright trails have, in pixels: the motion is not even.
const MIN_ERROR_PX: f64 = 0.1;

impl StreakProfile {
    /// The bar of this shape that explains the profile best, among those that cover its middle to
    /// within `margin_px`; its light is that of the template, or even. Its place is the mean over all
    /// places, each as likely as it explains the light: where an end is not seen, the error tells.
    pub fn fit(
        profile: &TrailProfile,
        shape: &TrailShape,
        template: Option<&Template>,
        margin_px: f64,
    ) -> Option<Self> {
        let even = ProfileSums::of(profile);
        let range_px = 0.5 * shape.length_px + margin_px;
        let step_px = STEP_PX.max(STEP_FRACTION * shape.length_px);
        let tries = (2.0 * range_px / step_px).floor() as usize;
        let along_px = |i: usize| -range_px + i as f64 * step_px;
        let step = |i: usize| along_px(i) + profile.middle as f64;
        let fitted = |i: usize| match template {
            Some(template) => template.fitted(profile, step(i)),
            None => even.streak(step(i), shape.length_px),
        };
        let gains: Vec<f64> = (0..=tries).map(|i| fitted(i).gain()).collect();
        let best = (0..=tries)
            .max_by(|&i, &j| gains[i].total_cmp(&gains[j]))
            .filter(|&i| gains[i] > 0.0)?;
        let top = fitted(best);
        let excess = match template {
            Some(template) => template.excess(profile, step(best), top.flux()),
            None => even.excess(profile, step(best), shape.length_px, top),
        };
        let excess = excess.max(1.0);
        let (mut total, mut mean, mut square) = (0.0, 0.0, 0.0);
        for i in 0..=tries {
            let likelihood = libm::exp((gains[i] - gains[best]) / excess);
            total += likelihood;
            mean += likelihood * along_px(i);
            square += likelihood * along_px(i) * along_px(i);
        }
        let mean = mean / total;
        let spread = (square / total - mean * mean).max(0.0);
        let [across_px, sigma_across_px] = across(profile, mean, shape);
        let least2 = MIN_ERROR_PX * MIN_ERROR_PX;
        Some(Self {
            along_px: mean,
            sigma_along_px: (spread + least2).sqrt(),
            across_px,
            sigma_across_px: (sigma_across_px * sigma_across_px + least2).sqrt(),
            flux_adu: top.flux(),
            sigma_flux_adu: (excess / top.weight).sqrt(),
            gain: top.gain(),
        })
    }
}

/// Sums over the steps of a profile before each of them.
struct ProfileSums {
    /// Of light × weight.
    light: Vec<f64>,
    /// Of the weights.
    weight: Vec<f64>,
}

impl ProfileSums {
    fn of(profile: &TrailProfile) -> Self {
        let terms = || profile.light.iter().zip(&profile.weight);
        let before = |term: &dyn Fn(f64, f64) -> f64| {
            let running = terms().scan(0.0, |sum, (&light, &weight)| {
                *sum += term(light, weight);
                Some(*sum)
            });
            std::iter::once(0.0).chain(running).collect()
        };
        Self {
            light: before(&|light, weight| light * weight),
            weight: before(&|_, weight| weight),
        }
    }

    /// The bar of this length around a place, counted in steps from the first one's middle.
    fn streak(&self, middle: f64, length_px: f64) -> FittedTrail {
        // Step i is from i − ½ to i + ½.
        let ends = [
            middle - 0.5 * length_px + 0.5,
            middle + 0.5 * length_px + 0.5,
        ];
        let between = |sums: &[f64]| Self::at(sums, ends[1]) - Self::at(sums, ends[0]);
        // Of a flux of 1, each step has an equal part.
        FittedTrail {
            light: between(&self.light) / length_px,
            weight: between(&self.weight) / (length_px * length_px),
        }
    }

    /// The sum up to a place, linear within each step.
    fn at(sums: &[f64], place: f64) -> f64 {
        let place = place.clamp(0.0, (sums.len() - 1) as f64);
        let below = (place as usize).min(sums.len() - 2);
        sums[below] + (place - below as f64) * (sums[below + 1] - sums[below])
    }

    /// Chi² over its degrees of freedom under the bar: above 1 where the light is uneven.
    fn excess(&self, profile: &TrailProfile, middle: f64, length_px: f64, bar: FittedTrail) -> f64 {
        let level = bar.flux() / length_px;
        // The first and the last step are filled in part.
        let first = (middle - 0.5 * length_px + 1.0).ceil().max(0.0) as usize;
        let end = (middle + 0.5 * length_px).floor().max(0.0) as usize;
        let steps = first..end.min(profile.light.len());
        let terms = steps.filter(|&i| profile.weight[i] > 0.0);
        let (count, chi2) = terms.fold((0, 0.0), |(count, sum), i| {
            let rest = profile.light[i] - level;
            (count + 1, sum + rest * rest * profile.weight[i])
        });
        chi2 / f64::from((count - 1).max(1))
    }
}

/// Centre of the light across the bar, and its standard error from noise, in pixels.
fn across(profile: &TrailProfile, along_px: f64, shape: &TrailShape) -> [f64; 2] {
    let middle = along_px + profile.middle as f64;
    let first = (middle - 0.5 * shape.length_px).round().max(0.0) as usize;
    let end = (middle + 0.5 * shape.length_px).round().max(0.0) as usize + 1;
    let known = (first..end.min(profile.light.len())).filter(|&i| profile.weight[i] > 0.0);
    let sums = known.fold([0.0; 3], |[light, moment, variance], i| {
        [
            light + profile.light[i],
            moment + profile.across[i],
            variance + 1.0 / profile.weight[i],
        ]
    });
    let [light, moment, variance] = sums;
    let limit = shape.half_breadth_px;
    if light <= 0.0 {
        return [0.0, limit];
    }
    // The mean square of the distances in the strip.
    let distance2 = limit * limit / 3.0;
    [
        (moment / light).clamp(-limit, limit),
        (variance * distance2).sqrt() / light,
    ]
}
