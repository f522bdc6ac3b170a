//! Electrons of stars by magnitude and color.

use super::light::{BV_RANGE_MAG, temperature_k_of};
use super::{Budget, Reading, Scenario};

/// Step of the color table, in magnitudes: linear interpolation is accurate to 10⁻⁵.
const STEP_MAG: f64 = 0.01;

/// Electrons that stars of any color leave on a detector.
#[derive(Debug, Clone)]
pub struct StarLight {
    budget: Budget,
    exposure_s: f64,
    /// Light of a star of V = 0 at colors in steps of [`STEP_MAG`], relative to that of the
    /// scenario's star; empty for [`Reading::Paper`], which has no colors.
    relative: Vec<f64>,
}

impl StarLight {
    /// The light of stars in a scenario that passes [`Scenario::check`]. Only [`Reading::Physical`]
    /// distinguishes colors.
    pub fn new(scenario: &Scenario) -> Self {
        let budget = Budget::new(scenario);
        let (bluest, reddest) = BV_RANGE_MAG;
        let steps = ((reddest - bluest) / STEP_MAG).ceil() as usize;
        let mut colored = scenario.clone();
        let mut relative_at = |step: usize| {
            let bv_mag = bluest + STEP_MAG * step as f64;
            colored.conditions.star_temperature_k = temperature_k_of(bv_mag);
            Budget::new(&colored).mag_0_e_s / budget.mag_0_e_s
        };
        let relative = match scenario.reading {
            Reading::Paper => Vec::new(),
            Reading::Physical => (0..=steps).map(&mut relative_at).collect(),
        };
        Self {
            budget,
            exposure_s: scenario.conditions.exposure_s,
            relative,
        }
    }

    /// The budget of the scenario.
    pub fn budget(&self) -> &Budget {
        &self.budget
    }

    /// Electrons, on all its pixels, of a star of this V magnitude and B−V; without B−V, of the
    /// scenario's temperature.
    pub fn electrons(&self, v_mag: f64, bv_mag: Option<f64>) -> f64 {
        let of_scenario = self.budget.electrons_of(v_mag, self.exposure_s);
        of_scenario * bv_mag.map_or(1.0, |bv_mag| self.relative(bv_mag))
    }

    /// Magnitude offset in V at which a star of this B−V leaves as many electrons as one of the
    /// scenario's temperature; positive if fainter.
    pub fn color_effect_mag(&self, bv_mag: f64) -> f64 {
        2.5 * libm::log10(self.relative(bv_mag))
    }

    /// V magnitude at which a star of the scenario's temperature leaves this number of electrons.
    pub fn vmag_of(&self, electrons: f64) -> f64 {
        self.budget.vmag_of(electrons, self.exposure_s)
    }

    fn relative(&self, bv_mag: f64) -> f64 {
        if self.relative.len() < 2 {
            return 1.0;
        }
        let place = ((bv_mag - BV_RANGE_MAG.0) / STEP_MAG).max(0.0);
        let left = (place as usize).min(self.relative.len() - 2);
        let part = (place - left as f64).min(1.0);
        self.relative[left] * (1.0 - part) + self.relative[left + 1] * part
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;

    #[test]
    fn a_star_of_each_color_has_the_light_of_its_temperature() {
        let mut scenario = Scenario::of(Preset::NanosatTracker);
        let light = StarLight::new(&scenario);
        for bv_mag in [-0.35, -0.113, 0.0, 0.31, 0.777, 1.5, 1.999, 2.0] {
            scenario.conditions.star_temperature_k = temperature_k_of(bv_mag);
            let exposure_s = scenario.conditions.exposure_s;
            let expected = Budget::new(&scenario).electrons_of(5.5, exposure_s);
            let found = light.electrons(5.5, Some(bv_mag));
            assert!(
                (found / expected - 1.0).abs() < 1e-5,
                "{bv_mag}: {found} {expected}"
            );
        }
        // Colors beyond the range are clamped.
        assert_eq!(
            light.electrons(5.0, Some(9.0)),
            light.electrons(5.0, Some(2.0))
        );
        assert!(light.electrons(5.0, Some(1.5)) > 1.2 * light.electrons(5.0, Some(0.0)));
    }

    #[test]
    fn without_a_color_or_in_the_papers_reading_it_is_the_budgets() {
        let scenario = Scenario::of(Preset::NanosatTracker);
        let light = StarLight::new(&scenario);
        let budget = Budget::new(&scenario);
        let expected = budget.electrons_of(6.0, scenario.conditions.exposure_s);
        assert_eq!(light.electrons(6.0, None), expected);
        assert!((light.vmag_of(expected) - 6.0).abs() < 1e-12);
        let paper = StarLight::new(&Scenario::of(Preset::Experiment1));
        assert_eq!(paper.electrons(6.0, Some(1.5)), paper.electrons(6.0, None));
    }
}
