//! The light along a star's trail, and the flux of a star by it.

use super::profile::TrailProfile;

/// The light along a trail, in steps of one pixel, with sum 1.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Template {
    pub light: Vec<f64>,
    /// The middle of its ends, counted in steps.
    pub middle: f64,
    /// Distance of its ends, in pixels.
    pub length_px: f64,
    /// Standard error of the middle, which all stars share, in pixels.
    pub middle_sigma_px: f64,
}

impl Template {
    /// The template around a place in a profile, counted in steps: its light per step of the profile,
    /// at step `i`.
    fn at(&self, i: usize, place: f64) -> f64 {
        let step = i as f64 - place + self.middle;
        if step < 0.0 {
            return 0.0;
        }
        let (below, part) = (step as usize, step.fract());
        let light = |i: usize| self.light.get(i).copied().unwrap_or(0.0);
        light(below) + part * (light(below + 1) - light(below))
    }

    /// The steps of a profile that a template around a place covers.
    fn steps(&self, profile: &TrailProfile, place: f64) -> std::ops::Range<usize> {
        let first = (place - self.middle).floor().max(0.0) as usize;
        let end = (place - self.middle + self.light.len() as f64).max(0.0) as usize + 1;
        first..end.min(profile.light.len())
    }

    /// The flux of a star whose trail is around a place.
    pub fn fitted(&self, profile: &TrailProfile, place: f64) -> FittedTrail {
        let mut sums = FittedTrail::default();
        for i in self.steps(profile, place) {
            let weighted = self.at(i, place) * profile.weight[i];
            sums.light += weighted * profile.light[i];
            sums.weight += weighted * self.at(i, place);
        }
        sums
    }

    /// Chi² over its degrees of freedom of a star of this flux there.
    pub fn excess(&self, profile: &TrailProfile, place: f64, flux: f64) -> f64 {
        let steps = self
            .steps(profile, place)
            .filter(|&i| profile.weight[i] > 0.0);
        let (count, chi2) = steps.fold((0, 0.0), |(count, sum), i| {
            let rest = profile.light[i] - flux * self.at(i, place);
            (count + 1, sum + rest * rest * profile.weight[i])
        });
        chi2 / f64::from((count - 1).max(1))
    }
}

/// The flux of a bar that is fitted, times `weight`, and its inverse variance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct FittedTrail {
    pub light: f64,
    pub weight: f64,
}

impl FittedTrail {
    /// The flux.
    pub fn flux(&self) -> f64 {
        self.light / self.weight
    }

    /// Half of the decrease of chi² by the bar: the logarithm of its likelihood.
    pub fn gain(&self) -> f64 {
        if self.weight <= 0.0 {
            return 0.0;
        }
        let light = self.light.max(0.0);
        0.5 * light * light / self.weight
    }
}
