//! How much light clouds add for the share of a star's light that they take, by the stars alone.
//!
//! What is usual of clouds tells which cells have some, but not how thick those of this frame are: clouds of an
//! even thickness would pass for thicker or thinner ones. The stars behind them tell.

use super::lit_cell::{LitCell, STEPS, fraction_of};
use crate::sky::grid::CELLS_OF_A_STAR;
use std::f64::consts::TAU;

/// Share of cells whose light tells nothing.
const UNTRUE: f64 = 0.02;

/// Light of clouds for the share of a star's light that they take, over what was assumed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CloudLightRatio {
    /// The logarithm of the ratio.
    pub ln_ratio: f64,
    /// Its standard error.
    pub sigma: f64,
}

/// A cell with clouds, by its light.
pub(super) struct CloudyCell<'a> {
    /// The share that its light tells by what was assumed, and the standard error of that.
    pub fraction: f64,
    pub sigma: f64,
    /// The cell.
    pub lit: &'a LitCell,
}

impl CloudLightRatio {
    /// By the stars of `cells`.
    pub(super) fn of(cells: &[CloudyCell]) -> Self {
        /// Standard deviation of the logarithm beforehand.
        const BEFORE: f64 = 1.0;
        const TRIALS: i32 = 40;
        const STEP: f64 = 0.05;
        let trials = (-TRIALS..=TRIALS).map(|trial| f64::from(trial) * STEP);
        let rated: Vec<(f64, f64)> = trials
            .map(|ln_ratio| {
                let factor = libm::exp(-ln_ratio);
                let of_cell = |cell: &CloudyCell| libm::log(cell.likelihood(factor));
                let by_stars: f64 = cells.iter().map(of_cell).sum();
                // Neighbours share stars.
                let before = -0.5 * (ln_ratio / BEFORE).powi(2);
                (ln_ratio, by_stars / CELLS_OF_A_STAR + before)
            })
            .collect();
        let largest = rated.iter().map(|rated| rated.1).fold(f64::MIN, f64::max);
        let [mut all, mut first, mut second] = [0.0; 3];
        for (ln_ratio, rating) in rated {
            let weight = libm::exp(rating - largest);
            all += weight;
            first += weight * ln_ratio;
            second += weight * ln_ratio * ln_ratio;
        }
        let ln_ratio = first / all;
        let variance = second / all - ln_ratio * ln_ratio;
        Self {
            ln_ratio,
            sigma: variance.max(STEP * STEP / 12.0).sqrt(),
        }
    }
}

impl CloudyCell<'_> {
    /// The likelihood of its stars, if its light tells `factor` times the share.
    fn likelihood(&self, factor: f64) -> f64 {
        const FAR_SIGMAS: f64 = 4.0;
        let (share, sigma) = (factor * self.fraction, factor * self.sigma);
        let step_of = |share: f64| (share * STEPS as f64).clamp(0.0, STEPS as f64);
        let first = step_of(share - FAR_SIGMAS * sigma).floor() as usize;
        let last = step_of(share + FAR_SIGMAS * sigma).ceil() as usize;
        let width = sigma.max(fraction_of(1));
        let weighted = (first..=last).map(|step| {
            let off = (fraction_of(step) - share) / width;
            libm::exp(-0.5 * off * off) * self.lit.by_stars[step]
        });
        // The weights of all steps, also of shares that there are not: of these no star tells.
        let all = width * STEPS as f64 * TAU.sqrt();
        let predicted: f64 = weighted.sum();
        let any = self.lit.by_stars.iter().sum::<f64>() / (STEPS + 1) as f64;
        (1.0 - UNTRUE) * predicted / all + UNTRUE * any
    }
}

#[cfg(test)]
mod tests {
    use super::super::lit_cell::{Hidden, for_each_fraction};
    use super::*;

    /// A cell whose stars tell that clouds take `share` of their light, to within `sigma`.
    fn lit(share: f64, sigma: f64) -> LitCell {
        LitCell {
            cell: 0,
            hidden: Hidden::NONE,
            by_stars: for_each_fraction(|at| libm::exp(-0.5 * ((at - share) / sigma).powi(2))),
            light: 1.0,
            terms: Vec::new(),
        }
    }

    #[test]
    fn stars_tell_how_much_light_clouds_add() {
        let found = |sigma: f64, count: usize| {
            let lit = lit(0.4, sigma);
            let cells = (0..count).map(|_| CloudyCell {
                fraction: 0.8,
                sigma: 0.02,
                lit: &lit,
            });
            CloudLightRatio::of(&cells.collect::<Vec<_>>())
        };
        // They take half of what their light was thought to tell: it is twice as much for what they take.
        let well_measured = found(0.05, 40);
        assert!(
            (well_measured.ln_ratio - 0.69).abs() < 0.05,
            "{well_measured:?}"
        );
        assert!(well_measured.sigma < 0.05, "{well_measured:?}");
        let poorly_measured = found(10.0, 40);
        // Shares above one are ruled out, and nothing else.
        assert!(poorly_measured.sigma > 0.4, "{poorly_measured:?}");
    }
}
