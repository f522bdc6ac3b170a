//! Theoretical SNR, saturation and error bounds of a star.

use crate::base::coords::PixelPoint;
use crate::base::statistics::normal_cdf;
use crate::predict::{Budget, CramerRao, Scenario};

/// Spots of a scenario and their noise.
pub(super) struct SpotTheory {
    sigma_px: f64,
    has_smear: bool,
    noise_e: f64,
    /// Electrons of sky and dark current per pixel.
    background_e: f64,
    /// Electrons at saturation: full well or end of the scale.
    full_e: f64,
}

/// Theoretical performance for one star.
pub(super) struct StarTheory {
    /// Signal-to-noise ratio of the matched filter, without the star's own shot noise.
    pub snr: f64,
    /// Whether its brightest pixel may be saturated.
    pub saturated: bool,
    /// Cramér-Rao bounds; none for a smeared spot.
    pub bound: Option<CramerRao>,
}

impl SpotTheory {
    pub(super) fn of(scenario: &Scenario, budget: &Budget) -> Self {
        let sheet = &scenario.camera;
        let end_e = (sheet.full_scale_adu() - sheet.bias_adu) * sheet.gain_e_per_adu;
        Self {
            sigma_px: sheet.spot_sigma_px,
            has_smear: scenario.conditions.motion_px > 0.0,
            noise_e: budget.background_noise_e,
            background_e: budget.background_e + budget.dark_e,
            full_e: sheet.full_well_e.min(end_e),
        }
    }

    pub(super) fn of_star(&self, place: &PixelPoint, electrons: f64) -> StarTheory {
        /// Standard deviations below saturation at which a pixel may be saturated by noise.
        const FULL_SIGMAS: f64 = 4.0;
        let offset_px = [place.x, place.y].map(|at| at - at.round());
        let [columns, rows] = offset_px.map(|offset| self.shares(offset));
        let squares = |shares: &[f64]| shares.iter().map(|share| share * share).sum::<f64>();
        let most = |shares: &[f64]| shares.iter().copied().fold(0.0, f64::max);
        let peak_e = electrons * most(&columns) * most(&rows) + self.background_e;
        let bound = || {
            let variance_e2 = self.noise_e.powi(2);
            CramerRao::of_spot(self.sigma_px, offset_px, electrons, variance_e2)
        };
        StarTheory {
            snr: electrons * (squares(&columns) * squares(&rows)).sqrt() / self.noise_e,
            saturated: peak_e + FULL_SIGMAS * peak_e.sqrt() >= self.full_e,
            bound: (!self.has_smear).then(bound),
        }
    }

    /// Fractions of the light in the pixels along one axis, for a spot at `offset_px` from the
    /// centre of a pixel.
    fn shares(&self, offset_px: f64) -> Vec<f64> {
        /// Radius of a spot, in standard deviations plus one pixel.
        const REACH_SIGMAS: f64 = 6.0;
        let reach = (REACH_SIGMAS * self.sigma_px).ceil() as i32 + 1;
        let before = |pixel: i32| normal_cdf((f64::from(pixel) - 0.5 - offset_px) / self.sigma_px);
        (-reach..=reach)
            .map(|pixel| before(pixel + 1) - before(pixel))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;

    #[test]
    fn the_filter_adds_up_the_pixels_of_a_spot() {
        let mut scenario = Scenario::of(Preset::NanosatTracker);
        scenario.camera.spot_sigma_px = 1.0;
        let budget = Budget::new(&scenario);
        let theory = SpotTheory::of(&scenario, &budget);
        // 13.6 pixels on average over positions, from an independent computation.
        let places = (0..100).map(|i| [i % 10, i / 10].map(|n| 0.05 + 0.1 * f64::from(n)));
        let pixels = places.map(|[x, y]| {
            let snr = theory.of_star(&PixelPoint::new(x, y), 1e3).snr;
            (1e3 / (snr * budget.background_noise_e)).powi(2)
        });
        let mean = pixels.sum::<f64>() / 100.0;
        assert!((mean - 13.6).abs() < 0.1, "{mean}");
    }

    #[test]
    fn a_bright_star_fills_its_pixel_and_a_smeared_one_has_no_bound() {
        let mut scenario = Scenario::of(Preset::Experiment1);
        let theory = |scenario: &Scenario, electrons| {
            let theory = SpotTheory::of(scenario, &Budget::new(scenario));
            theory.of_star(&PixelPoint::new(3.2, 7.9), electrons)
        };
        let full_e = scenario.camera.full_well_e;
        assert!(theory(&scenario, 100.0 * full_e).saturated);
        assert!(!theory(&scenario, 0.1 * full_e).saturated);
        assert!(theory(&scenario, 1e4).bound.is_some());
        scenario.conditions.motion_px = 2.0;
        assert!(theory(&scenario, 1e4).bound.is_none());
    }
}
