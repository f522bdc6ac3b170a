//! The light of the clear sky and of clouds, and which cells have it.

use super::lit_cell::{Hidden, LitCell, STEPS, fraction_of};
use super::per_share::{CloudLightRatio, CloudyCell};
use crate::base::statistics::median;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Share of cells whose light tells nothing: lamps, trees.
const UNTRUE: f64 = 0.02;
/// Their light, over that of the clear sky, is anything in a range as broad as this.
const UNTRUE_RANGE: f64 = 2.0;
/// Least scatter of a cell's light about the clear sky's.
const MIN_SIGMA: f64 = 0.005;

/// The light of the clear sky and of clouds.
pub(super) struct CloudLightFit {
    /// Coefficients of the terms of the clear sky.
    clear: DVector<f64>,
    /// Light that clouds add where they take all light of stars, over that of the clear sky.
    of_cloud: f64,
    /// Its relative error.
    of_cloud_sigma: f64,
    /// Scatter of the light of a cell, over that of the clear sky.
    sigma: f64,
    /// Part of the cells that is not clear.
    clouded: f64,
}

/// What is expected of a cell.
#[derive(Debug, Clone, Copy, Default)]
struct ExpectedCloud {
    /// Share of a star's light that clouds take, and its variance.
    fraction: f64,
    fraction_variance: f64,
    /// Probability that its light tells something.
    weight: f64,
    /// Probability that it is not part of the clear sky.
    cloud: f64,
}

impl CloudLightFit {
    /// The fit to `cells`, whose light is scaled to a median of 1; `None` if they are too few.
    pub(super) fn of(cells: &mut [LitCell], clouded: f64) -> Option<Self> {
        /// Least number of cells for each unknown.
        const CELLS: usize = 4;
        const FIRST_ROUNDS: usize = 10;
        const ROUNDS: usize = 40;
        const SETTLED: f64 = 1e-4;
        let terms = cells.first()?.terms.len();
        if cells.len() < CELLS * (terms + 1) {
            return None;
        }
        let middle = median(&mut cells.iter().map(|lit| lit.light).collect::<Vec<_>>());
        for lit in &mut *cells {
            lit.light /= middle;
        }
        let mut clear = DVector::zeros(terms);
        clear[0] = 1.0;
        let mut fit = Self {
            clear,
            of_cloud: 0.0,
            of_cloud_sigma: 0.0,
            sigma: f64::INFINITY,
            clouded,
        };
        for _ in 0..FIRST_ROUNDS {
            let expected: Vec<_> = cells.iter().map(|lit| fit.expected_by_stars(lit)).collect();
            fit = fit.next(cells, &expected)?;
            fit.clouded = clouded;
        }
        for _ in 0..ROUNDS {
            let expected: Vec<_> = cells.iter().map(|lit| fit.expected(lit)).collect();
            let next = fit.next(cells, &expected)?;
            let is_settled = (next.of_cloud - fit.of_cloud).abs() < SETTLED
                && (next.clouded - fit.clouded).abs() < SETTLED;
            fit = next;
            if is_settled {
                break;
            }
        }
        Some(fit)
    }

    /// Light of a cell beyond that of the clear sky, over it.
    pub(super) fn excess(&self, lit: &LitCell) -> f64 {
        lit.light / self.clear_light(lit) - 1.0
    }

    fn clear_light(&self, lit: &LitCell) -> f64 {
        self.clear.iter().zip(&lit.terms).map(|(a, b)| a * b).sum()
    }

    /// The likelihood of the light of a cell if clouds take this share of a star's light.
    pub(super) fn likelihood(&self, excess: f64, share: f64) -> f64 {
        let cloud = self.of_cloud * share;
        let sigma = libm::hypot(self.sigma, self.of_cloud_sigma * cloud);
        let off = (excess - cloud) / sigma;
        let agrees = libm::exp(-0.5 * off * off) / (sigma * TAU.sqrt());
        (1.0 - UNTRUE) * agrees + UNTRUE / UNTRUE_RANGE
    }

    /// Sets how much light clouds add to what the stars of `cells` tell, and its error.
    pub(super) fn set_light_by_stars(&mut self, cells: &[LitCell]) {
        /// Cells with more than this many standard deviations of light have clouds.
        const SIGMAS: f64 = 2.0;
        /// How clouds differ in the light that they add: by height, thickness, and what lights them.
        const DIFFERS: f64 = 0.15;
        let sigma = self.sigma / self.of_cloud.abs();
        let cloudy = cells.iter().filter_map(|lit| {
            let share = self.excess(lit) / self.of_cloud;
            (share > SIGMAS * sigma).then_some(CloudyCell {
                fraction: share,
                sigma,
                lit,
            })
        });
        let CloudLightRatio { ln_ratio, sigma } = CloudLightRatio::of(&cloudy.collect::<Vec<_>>());
        self.of_cloud *= libm::exp(ln_ratio);
        self.of_cloud_sigma = libm::hypot(sigma, DIFFERS);
    }

    /// The probability that light tells something, by its likelihood.
    fn true_part(likelihood: f64) -> f64 {
        1.0 - UNTRUE / UNTRUE_RANGE / likelihood
    }

    /// What the stars alone tell of a cell. Light goes with the share that they expect; that this is uncertain
    /// makes it scatter.
    fn expected_by_stars(&self, lit: &LitCell) -> ExpectedCloud {
        let [mut all, mut first] = [0.0; 2];
        for step in 0..=STEPS {
            let probability = lit.hidden.mixed(step, self.clouded);
            all += probability;
            first += probability * fraction_of(step);
        }
        let share = first / all;
        let weight = if self.sigma.is_finite() {
            Self::true_part(self.likelihood(self.excess(lit), share))
        } else {
            1.0
        };
        ExpectedCloud {
            fraction: share,
            weight,
            ..ExpectedCloud::default()
        }
    }

    /// What stars and light tell of a cell.
    fn expected(&self, lit: &LitCell) -> ExpectedCloud {
        let excess = self.excess(lit);
        let [mut all, mut cloud, mut true_sum, mut first, mut second] = [0.0; 5];
        for step in 0..=STEPS {
            let share = fraction_of(step);
            let light = self.likelihood(excess, share);
            let both = lit.hidden.mixed(step, self.clouded) * light;
            let true_part = Self::true_part(light);
            all += both;
            cloud += self.clouded * lit.hidden.cloud[step] * light;
            true_sum += both * true_part;
            first += both * true_part * share;
            second += both * true_part * share * share;
        }
        let cloud = cloud / all;
        if true_sum < f64::EPSILON * all {
            return ExpectedCloud {
                cloud,
                ..ExpectedCloud::default()
            };
        }
        let share = first / true_sum;
        ExpectedCloud {
            fraction: share,
            fraction_variance: (second / true_sum - share * share).max(0.0),
            weight: true_sum / all,
            cloud,
        }
    }

    /// The fit to the light of the cells, relative to that of the clear sky so far.
    fn next(&self, cells: &[LitCell], expected: &[ExpectedCloud]) -> Option<Self> {
        /// Cells that are clear, and that are not, which a sky has beforehand.
        const BEFOREHAND: f64 = 0.5;
        let terms = self.clear.len();
        let mut normal = DMatrix::<f64>::zeros(terms + 1, terms + 1);
        let mut right = DVector::<f64>::zeros(terms + 1);
        let mut row = DVector::zeros(terms + 1);
        for (lit, expected) in cells.iter().zip(expected) {
            let clear_light = self.clear_light(lit);
            if clear_light <= 0.0 {
                continue;
            }
            for (at, term) in row.iter_mut().zip(&lit.terms) {
                *at = term / clear_light;
            }
            row[terms] = expected.fraction;
            normal.ger(expected.weight, &row, &row, 1.0);
            normal[(terms, terms)] += expected.weight * expected.fraction_variance;
            right.axpy(expected.weight * lit.light / clear_light, &row, 1.0);
        }
        let solved = normal.cholesky()?.solve(&right);
        let cloudy: f64 = expected.iter().map(|expected| expected.cloud).sum();
        let count = cells.len() as f64;
        let mut next = Self {
            clear: solved.rows(0, terms).into_owned(),
            of_cloud: solved[terms],
            of_cloud_sigma: 0.0,
            sigma: MIN_SIGMA,
            clouded: (BEFOREHAND + cloudy) / (2.0 * BEFOREHAND + count),
        };
        let square = |(lit, expected): (&LitCell, &ExpectedCloud)| {
            let off = next.excess(lit) - next.of_cloud * expected.fraction;
            expected.weight * (off * off + next.of_cloud.powi(2) * expected.fraction_variance)
        };
        let squares: f64 = cells.iter().zip(expected).map(square).sum();
        let weights: f64 = expected.iter().map(|expected| expected.weight).sum();
        let freedom = (weights - terms as f64 - 1.0).max(1.0);
        next.sigma = (squares / freedom).sqrt().max(MIN_SIGMA);
        Some(next)
    }

    /// By how much the logarithm of the likelihood of a cell's stars is larger if its light foretells the
    /// clouds: than with a part `clouded` of the sky for all cells, than with that of this fit, and, where
    /// light tells of clouds, than if it were clear.
    pub(super) fn gains(&self, lit: &LitCell, before: &Hidden, clouded: f64) -> [f64; 3] {
        let excess = self.excess(lit);
        let [mut predicted, mut light_all, mut cloudy] = [0.0; 3];
        let [mut by_part, mut by_part_here, mut if_clear] = [0.0; 3];
        for step in 0..=STEPS {
            let light = self.likelihood(excess, fraction_of(step));
            predicted += light * lit.hidden.mixed(step, self.clouded);
            light_all += light * before.mixed(step, self.clouded);
            cloudy += light * self.clouded * before.cloud[step];
            by_part += lit.hidden.mixed(step, clouded);
            by_part_here += lit.hidden.mixed(step, self.clouded);
            if_clear += lit.hidden.clear[step];
        }
        let predicted = libm::log(predicted / light_all);
        [
            predicted - libm::log(by_part),
            predicted - libm::log(by_part_here),
            cloudy / light_all * (predicted - libm::log(if_clear)),
        ]
    }
}
