//! Completeness: the fraction of the stars of each magnitude that a detector finds.
//!
//! (scenario, budget) → [`Detector`]: threshold, false alarms and completeness
//!
//! A linear detector compares `T = F a + √v w₁ + √F w₂` with a threshold at every pixel, and finds
//! a star where the largest `T` around it exceeds the threshold. F is the star's flux, a the
//! response of the filter to a spot of one electron, v the variance of a pixel without a star, and
//! w₁ and w₂ are the filtered noise of the background and of the star's own light. For one
//! realisation of the noise and one position of the star within its pixel there is a *critical
//! flux* at which it is just detected, the root of a quadratic. The distribution of the critical
//! flux over noise and positions is the completeness at all magnitudes, and its median is the
//! limit. Unlike the textbook formula `Φ(SNR − u)` this includes positions off the pixel centre,
//! the choice of the highest of several pixels, and the star's own shot noise.
//!
//! Caveats: noise is Gaussian, except that the threshold allows for the skewness of photon noise.
//! Stars do not overlap. Spots have the size that the filter expects; a spot smeared by motion is
//! filtered with the round one that fits it best.

use super::budget::Budget;
use super::scenario::Scenario;
use crate::base::size::Size;
use crate::base::statistics::normal_cdf;
use crate::detect::{DetectConfig, FilterModel};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;
use std::f64::consts::SQRT_2;

/// Detection rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// The brightest pixel has the required SNR (eq. 11).
    PeakPixel,
    /// The matched filter exceeds its threshold, as in [`detect`](crate::detect::detect).
    MatchedFilter,
}

/// A detector under a scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct Detector {
    /// Detection rule.
    pub rule: Rule,
    /// Threshold in standard deviations of the (filtered) background noise.
    pub threshold_sigma: f64,
    /// False detections per million pixels; for a matched filter, the configured number, even if
    /// the threshold is set explicitly.
    pub false_alarms_per_mpx: f64,
    /// Magnitude at which the star of each draw is just detected, faintest first.
    critical_vmag: Vec<f64>,
}

/// Number of draws of noise and position, each used with all four signs of both kinds of noise: the
/// limit is then known to 0.003 mag.
const DRAWS: usize = 2048;
/// With at least this number of pixels a quarter of the draws is used: 0.006 mag, but fast.
const WIDE_PX: usize = 2500;
const SIGNS: [[f64; 2]; 4] = [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]];
/// Seed of the draws, constant so that results repeat.
const SEED: u64 = 1;

impl Detector {
    /// The detector with this rule, and the false alarms and SNR of the scenario.
    pub fn new(rule: Rule, scenario: &Scenario, budget: &Budget) -> Self {
        let config = DetectConfig {
            false_alarms_per_mpx: scenario.conditions.false_alarms_per_mpx,
            ..DetectConfig::default()
        };
        match rule {
            Rule::PeakPixel => Self::peak_pixel(scenario, budget),
            Rule::MatchedFilter => Self::matched_filter(&config, scenario, budget),
        }
    }

    /// The paper's rule.
    fn peak_pixel(scenario: &Scenario, budget: &Budget) -> Self {
        let threshold_e = budget.star_e;
        let spot = SmearedSpot::from_scenario(scenario);
        let filter = Filter {
            half_kernel: vec![1.0],
            threshold_e,
            noise_e: budget.background_noise_e,
            // The brightest pixel is within two standard deviations of the centre.
            reach_px: (2.0 * spot.sigma_px).ceil() as usize,
        };
        let threshold_sigma = threshold_e / budget.background_noise_e;
        Self {
            rule: Rule::PeakPixel,
            threshold_sigma,
            false_alarms_per_mpx: 1e6 * normal_cdf(-threshold_sigma),
            critical_vmag: critical_vmag(&filter, &spot, scenario, budget),
        }
    }

    /// The matched filter with the threshold of `config`; the spot is the scenario's.
    pub fn matched_filter(config: &DetectConfig, scenario: &Scenario, budget: &Budget) -> Self {
        let spot = SmearedSpot::from_scenario(scenario);
        let size = Size::new(scenario.camera.width_px, scenario.camera.height_px);
        let electrons = budget.background_e + budget.dark_e;
        let skewness = electrons / budget.background_noise_e.powi(3);
        let model = FilterModel::new(config, size, spot.round_sigma_px(), skewness);
        Self::filtering(model, budget.background_noise_e, config, scenario, budget)
    }

    /// The matched filter on a frame, where threshold and noise were measured: the threshold in
    /// standard deviations that white noise of `noise_e` electrons a pixel has after the filter.
    pub fn on_frame(
        threshold_sigma: f64,
        noise_e: f64,
        config: &DetectConfig,
        scenario: &Scenario,
        budget: &Budget,
    ) -> Self {
        let size = Size::new(scenario.camera.width_px, scenario.camera.height_px);
        let spot_px = SmearedSpot::from_scenario(scenario).round_sigma_px();
        let model = FilterModel {
            threshold_sigma,
            ..FilterModel::new(config, size, spot_px, 0.0)
        };
        Self::filtering(model, noise_e, config, scenario, budget)
    }

    /// The detector on average over places whose limits differ by `differences_mag`.
    pub fn over(mut self, differences_mag: &[f64]) -> Self {
        // Sorted as they are, the draws are shared evenly among the places.
        let places = differences_mag.iter().cycle();
        for (critical, difference_mag) in self.critical_vmag.iter_mut().zip(places) {
            *critical += difference_mag;
        }
        self.critical_vmag.sort_by(|a, b| b.total_cmp(a));
        self
    }

    fn filtering(
        model: FilterModel,
        noise_e: f64,
        config: &DetectConfig,
        scenario: &Scenario,
        budget: &Budget,
    ) -> Self {
        let spot = SmearedSpot::from_scenario(scenario);
        let filter = Filter {
            half_kernel: model.half_kernel,
            threshold_e: model.threshold_sigma * noise_e,
            noise_e,
            // Filtered noise moves the maximum by a fraction of the spot.
            reach_px: (1.2 * spot.sigma_px).ceil() as usize,
        };
        Self {
            rule: Rule::MatchedFilter,
            threshold_sigma: model.threshold_sigma,
            false_alarms_per_mpx: config.false_alarms_per_mpx,
            critical_vmag: critical_vmag(&filter, &spot, scenario, budget),
        }
    }

    /// Probability that a star of this V magnitude is detected.
    pub fn probability(&self, v_mag: f64) -> f64 {
        let trials = &self.critical_vmag;
        // Draws with a limit at least as faint; linear between two of them.
        let found = trials.partition_point(|limit| *limit >= v_mag);
        let between = match (found.checked_sub(1).map(|i| trials[i]), trials.get(found)) {
            (Some(fainter), Some(_)) if fainter.is_infinite() => 1.0,
            (Some(fainter), Some(brighter)) if fainter > *brighter => {
                (fainter - v_mag) / (fainter - brighter)
            }
            _ => 0.5,
        };
        let count = found as f64 - 0.5 + between;
        (count / trials.len() as f64).clamp(0.0, 1.0)
    }

    /// V magnitude at which a star is detected with this probability; 0.5 gives the limit. Not
    /// finite where noise alone is detected more often.
    pub fn vmag_at(&self, probability: f64) -> f64 {
        let last = self.critical_vmag.len() - 1;
        let place = probability * self.critical_vmag.len() as f64 - 0.5;
        let place = place.clamp(0.0, last as f64);
        let (below, part) = (place.floor() as usize, place.fract());
        let above = (below + 1).min(last);
        self.critical_vmag[below] * (1.0 - part) + self.critical_vmag[above] * part
    }
}

/// A star's spot, smeared by motion along the rows.
struct SmearedSpot {
    sigma_px: f64,
    smear_px: f64,
}

impl SmearedSpot {
    fn from_scenario(scenario: &Scenario) -> Self {
        Self {
            sigma_px: scenario.camera.spot_sigma_px,
            smear_px: scenario.conditions.motion_px,
        }
    }

    /// Width of the most similar round spot: the geometric mean of both widths.
    fn round_sigma_px(&self) -> f64 {
        let along = libm::hypot(self.sigma_px, self.smear_px / 12f64.sqrt());
        (along * self.sigma_px).sqrt()
    }

    /// Fractions of the light in pixels −`half` to `half` along one axis, for a spot at
    /// `center_px`.
    fn profile(&self, center_px: f64, smear_px: f64, half: usize, into: &mut Vec<f64>) {
        let half = half as isize;
        into.clear();
        let edge = |at: f64| self.light_before(at - center_px, smear_px);
        let mut before = edge(-half as f64 - 0.5);
        for i in -half..=half {
            let after = edge(i as f64 + 0.5);
            into.push(after - before);
            before = after;
        }
    }

    /// Fraction of the light at offsets below `at_px`: a Gaussian's, averaged over the smear.
    fn light_before(&self, at_px: f64, smear_px: f64) -> f64 {
        let t = |distance: f64| distance / (SQRT_2 * self.sigma_px);
        if smear_px < 1e-3 * self.sigma_px {
            return 0.5 * (1.0 + libm::erf(t(at_px)));
        }
        // The integral of erf is t erf t + exp(−t²)/√π.
        let integral = |t: f64| t * libm::erf(t) + libm::exp(-t * t) / std::f64::consts::PI.sqrt();
        let (high, low) = (at_px + smear_px / 2.0, at_px - smear_px / 2.0);
        let scale = SQRT_2 * self.sigma_px / smear_px;
        0.5 + 0.5 * scale * (integral(t(high)) - integral(t(low)))
    }
}

/// A separable filter and its threshold.
struct Filter {
    half_kernel: Vec<f64>,
    threshold_e: f64,
    noise_e: f64,
    /// Radius within which the maximum is searched.
    reach_px: usize,
}

impl Filter {
    /// Response at `middle` along one axis of `values`.
    fn at(&self, middle: usize, values: impl Fn(usize) -> f64) -> f64 {
        let weighted = |(distance, weight): (usize, &f64)| {
            let both = match distance {
                0 => values(middle),
                _ => values(middle - distance) + values(middle + distance),
            };
            weight * both
        };
        self.half_kernel.iter().enumerate().map(weighted).sum()
    }
}

/// Magnitudes at which the star of each draw is just detected, faintest first.
fn critical_vmag(
    filter: &Filter,
    spot: &SmearedSpot,
    scenario: &Scenario,
    budget: &Budget,
) -> Vec<f64> {
    let exposure_s = scenario.conditions.exposure_s;
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut draw = NoiseDraw::new(filter, spot);
    let pixels: usize = draw.half.iter().map(|half| 2 * half + 1).product();
    let draws = if pixels < WIDE_PX { DRAWS } else { DRAWS / 4 };
    let mut critical: Vec<f64> = (0..draws)
        .flat_map(|i| draw.critical_fluxes_e(i, &mut random))
        .map(|flux_e| budget.vmag_of(flux_e, exposure_s))
        .collect();
    critical.sort_by(|a, b| b.total_cmp(a));
    critical
}

/// One star and one draw of noise, with reused buffers.
struct NoiseDraw<'a> {
    filter: &'a Filter,
    spot: &'a SmearedSpot,
    /// Pixels from the star's pixel to the last whose response is evaluated, along x and y.
    reach: [usize; 2],
    /// Pixels to the last that these responses depend on.
    half: [usize; 2],
    profiles: [Vec<f64>; 2],
    /// Noise of the background and of the star's light, row-major.
    noise: [Vec<f64>; 2],
    /// The noise filtered along x.
    rows: [Vec<f64>; 2],
}

impl<'a> NoiseDraw<'a> {
    fn new(filter: &'a Filter, spot: &'a SmearedSpot) -> Self {
        let smear = (spot.smear_px / 2.0).ceil() as usize;
        let reach = [filter.reach_px + smear, filter.reach_px];
        let radius = filter.half_kernel.len() - 1;
        Self {
            filter,
            spot,
            reach,
            half: reach.map(|reach| reach + radius),
            profiles: [Vec::new(), Vec::new()],
            noise: [Vec::new(), Vec::new()],
            rows: [Vec::new(), Vec::new()],
        }
    }

    /// Smallest flux, in electrons, at which the star of draw `i` is detected, for each of
    /// [`SIGNS`] of the noise.
    fn critical_fluxes_e(&mut self, i: usize, random: &mut ChaCha8Rng) -> [f64; 4] {
        let [x, y] = place_in_pixel(i);
        let [half_x, half_y] = self.half;
        let smear = self.spot.smear_px;
        self.spot.profile(x, smear, half_x, &mut self.profiles[0]);
        self.spot.profile(y, 0.0, half_y, &mut self.profiles[1]);
        self.draw_noise(random);
        self.filter_rows();
        let [reach_x, reach_y] = self.reach.map(|reach| reach as isize);
        let answers = |axis: usize, reach: isize| -> Vec<f64> {
            (-reach..=reach)
                .map(|at| self.filtered(&self.profiles[axis], self.half[axis], at))
                .collect()
        };
        let (along_x, along_y) = (answers(0, reach_x), answers(1, reach_y));
        let mut least = [f64::INFINITY; 4];
        for (row, ay) in (-reach_y..=reach_y).zip(&along_y) {
            for (column, ax) in along_x.iter().enumerate() {
                let [background, own] = [0, 1].map(|kind| self.column_sum(kind, column, row));
                for (least, [sign, own_sign]) in least.iter_mut().zip(SIGNS) {
                    let missing_e =
                        self.filter.threshold_e - self.filter.noise_e * sign * background;
                    let flux_e = flux_at_threshold(ax * ay, own_sign * own, missing_e);
                    *least = least.min(flux_e);
                }
            }
        }
        least
    }

    fn draw_noise(&mut self, random: &mut ChaCha8Rng) {
        let [background, own] = &mut self.noise;
        background.clear();
        own.clear();
        for py in &self.profiles[1] {
            for px in &self.profiles[0] {
                let [first, second]: [f64; 2] = [0, 1].map(|_| StandardNormal.sample(random));
                background.push(first);
                own.push(second * (px * py).max(0.0).sqrt());
            }
        }
    }

    /// Filters both kinds of noise along x at the evaluated columns.
    fn filter_rows(&mut self) {
        let width = 2 * self.half[0] + 1;
        let reach = self.reach[0] as isize;
        for kind in 0..2 {
            let mut rows = std::mem::take(&mut self.rows[kind]);
            rows.clear();
            for row in self.noise[kind].chunks_exact(width) {
                rows.extend((-reach..=reach).map(|at| self.filtered(row, self.half[0], at)));
            }
            self.rows[kind] = rows;
        }
    }

    /// Response at `at` pixels from element `half` of `values`.
    fn filtered(&self, values: &[f64], half: usize, at: isize) -> f64 {
        self.filter
            .at(half.wrapping_add_signed(at), |place| values[place])
    }

    /// Filters the rows along y.
    fn column_sum(&self, kind: usize, column: usize, row: isize) -> f64 {
        let width = 2 * self.reach[0] + 1;
        let middle = self.half[1].wrapping_add_signed(row);
        self.filter
            .at(middle, |row| self.rows[kind][row * width + column])
    }
}

/// The flux F for which `answer` F + `own` √F = `missing_e`.
fn flux_at_threshold(answer: f64, own: f64, missing_e: f64) -> f64 {
    if missing_e <= 0.0 {
        return f64::MIN_POSITIVE;
    }
    let root = (own * own + 4.0 * answer * missing_e).sqrt();
    ((root - own) / (2.0 * answer)).powi(2)
}

/// Low-discrepancy positions within a pixel.
///
/// # Reference
/// Roberts 2018, "The unreasonable effectiveness of quasirandom sequences": additive recurrence
/// with powers of 1/1.3247…
fn place_in_pixel(i: usize) -> [f64; 2] {
    const STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_2];
    STEPS.map(|step| (0.5 + (i + 1) as f64 * step).fract() - 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use crate::predict::Parameter;

    fn scenario(changes: &[(&str, f64)]) -> Scenario {
        let mut scenario = Scenario::of(Preset::Experiment1);
        scenario.camera.peak_share = None;
        for (name, value) in changes {
            Parameter::named(name).unwrap().set(&mut scenario, *value);
        }
        scenario
    }

    #[test]
    fn completeness_falls_from_one_to_nothing_through_its_limit() {
        let scenario = scenario(&[]);
        let budget = Budget::new(&scenario);
        for detector in [
            Detector::new(Rule::PeakPixel, &scenario, &budget),
            Detector::new(Rule::MatchedFilter, &scenario, &budget),
        ] {
            let limit = detector.vmag_at(0.5);
            assert!((detector.probability(limit) - 0.5).abs() < 1e-3);
            assert!(detector.probability(limit - 2.0) > 0.999);
            assert!(detector.probability(limit + 2.0) < 0.01);
            let steps = (0..100).map(|i| detector.probability(limit - 2.0 + 0.04 * f64::from(i)));
            assert!(steps.collect::<Vec<_>>().is_sorted_by(|a, b| a >= b));
            let back = detector.probability(detector.vmag_at(0.9));
            assert!((back - 0.9).abs() < 1e-3, "{back}");
        }
    }

    #[test]
    fn the_matched_filter_is_near_the_textbook_formula() {
        // SNR = F √ΣP² / n at the threshold u; the largest of several pixels is some 0.05 to 0.1
        // mag better.
        let scenario = scenario(&[("spot_sigma_px", 1.5), ("sky_mag_arcsec2", 14.0)]);
        let budget = Budget::new(&scenario);
        let detector = Detector::new(Rule::MatchedFilter, &scenario, &budget);
        // ΣP² ≈ 1/(4π(σ² + 1/12)), see Mortensen et al. 2010.
        let neff = 4.0 * std::f64::consts::PI * (1.5f64.powi(2) + 1.0 / 12.0);
        let flux_e = detector.threshold_sigma * budget.background_noise_e * neff.sqrt();
        let textbook = budget.vmag_of(flux_e, scenario.conditions.exposure_s);
        let gain = detector.vmag_at(0.5) - textbook;
        assert!((-0.02..0.12).contains(&gain), "{gain}");
    }

    #[test]
    fn the_filter_sees_fainter_stars_than_the_brightest_pixel() {
        let scenario = scenario(&[]);
        let budget = Budget::new(&scenario);
        let peak = Detector::new(Rule::PeakPixel, &scenario, &budget);
        let filter = Detector::new(Rule::MatchedFilter, &scenario, &budget);
        assert!(filter.vmag_at(0.5) > peak.vmag_at(0.5) + 0.5);
        // Threshold and false alarms of the peak rule are one number.
        let again = 1e6 * normal_cdf(-peak.threshold_sigma);
        assert_eq!(peak.false_alarms_per_mpx, again);
    }

    #[test]
    fn smear_costs_light_where_it_is_longer_than_the_spot() {
        let limit = |smear: f64| {
            let scenario = scenario(&[("motion_px", smear)]);
            let budget = Budget::new(&scenario);
            Detector::new(Rule::MatchedFilter, &scenario, &budget).vmag_at(0.5)
        };
        let [still, short, long] = [0.0, 1.0, 6.0].map(limit);
        assert!(still - short < 0.1 && still > short, "{still} {short}");
        assert!(still - long > 0.25, "{still} {long}");
    }

    #[test]
    fn a_smeared_spot_keeps_its_light_and_its_width() {
        let spot = SmearedSpot {
            sigma_px: 0.8,
            smear_px: 3.0,
        };
        let mut profile = Vec::new();
        spot.profile(0.3, 3.0, 12, &mut profile);
        let moment = |power: i32| -> f64 {
            let at = |(i, p): (usize, &f64)| p * (i as f64 - 12.3).powi(power);
            profile.iter().enumerate().map(at).sum()
        };
        assert!((moment(0) - 1.0).abs() < 1e-9);
        assert!(moment(1).abs() < 1e-6);
        // σ² of the Gaussian, L²/12 of the smear, 1/12 of the pixels.
        assert!((moment(2) - (0.64 + 0.75 + 1.0 / 12.0)).abs() < 1e-3);
    }
}
