//! Measured and predicted completeness by magnitude.

use crate::base::format::{to_decimals, to_significant};
use crate::base::least_squares::solve_pair;
use crate::base::statistics::{Estimate, normal_cdf, normal_density};
use crate::lab::robustness::Interval;
use crate::lab::validation::record::BEYOND_LIMIT_MAG;
use serde::Serialize;

/// Width of a bin, in magnitudes.
const BIN_MAG: f64 = 0.1;

/// Completeness of isolated stars by magnitude.
///
/// The limits are those of a normal distribution function, fitted to the detections and, in the
/// same way, to the predicted probabilities. Deviations from that form cancel in the difference.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct CompletenessSummary {
    pub predicted_limit_vmag: f64,
    pub predicted_fit_vmag: Option<f64>,
    pub measured_limit_vmag: Option<f64>,
    pub measured_limit_sigma_mag: Option<f64>,
    pub difference_mag: Option<f64>,
    pub bins: Vec<CompletenessBin>,
}

/// A bin of magnitudes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct CompletenessBin {
    pub vmag: f64,
    pub stars: usize,
    pub detected: usize,
    pub measured: f64,
    pub low: f64,
    pub high: f64,
    pub predicted: f64,
}

/// Sums of one bin.
#[derive(Clone, Copy, Default)]
struct CompletenessSums {
    stars: usize,
    vmag: f64,
    detected: usize,
    predicted: f64,
}

pub(super) struct CompletenessTable {
    limit_vmag: f64,
    /// Lower edge of the second bin.
    from_vmag: f64,
    bins: Vec<CompletenessSums>,
}

impl CompletenessTable {
    pub(super) fn around(limit_vmag: f64) -> Self {
        /// Magnitudes brighter than the predicted limit at which the bins begin; all brighter stars
        /// share one bin.
        const BRIGHTER_MAG: f64 = 2.0;
        /// Magnitudes fainter than the limit at which they end, with the table of stars.
        const FAINTER_MAG: f64 = BEYOND_LIMIT_MAG;
        let whole = |vmag: f64| (vmag / BIN_MAG).floor();
        let (from, to) = (
            whole(limit_vmag - BRIGHTER_MAG),
            whole(limit_vmag + FAINTER_MAG),
        );
        Self {
            limit_vmag,
            from_vmag: from * BIN_MAG,
            bins: vec![CompletenessSums::default(); (to - from) as usize + 2],
        }
    }

    pub(super) fn add(&mut self, vmag: f64, probability: f64, detected: bool) {
        let bin = ((vmag - self.from_vmag) / BIN_MAG).floor() + 1.0;
        let last = self.bins.len() - 1;
        let sums = &mut self.bins[(bin.max(0.0) as usize).min(last)];
        sums.stars += 1;
        sums.vmag += vmag;
        sums.predicted += probability;
        sums.detected += usize::from(detected);
    }

    pub(super) fn finish(self) -> CompletenessSummary {
        let bins: Vec<CompletenessBin> = self
            .bins
            .iter()
            .filter(|sums| sums.stars > 0)
            .map(CompletenessSums::bin)
            .collect();
        let fit = |part: fn(&CompletenessBin) -> f64| fitted_limit(&bins, part, self.limit_vmag);
        let measured = fit(|bin| bin.measured);
        let predicted = fit(|bin| bin.predicted);
        let difference = measured.zip(predicted);
        CompletenessSummary {
            predicted_limit_vmag: to_decimals(self.limit_vmag, 4),
            predicted_fit_vmag: predicted.map(|p| to_decimals(p.value, 4)),
            measured_limit_vmag: measured.map(|m| to_decimals(m.value, 4)),
            measured_limit_sigma_mag: measured.map(|m| to_decimals(m.sigma, 4)),
            difference_mag: difference.map(|(m, p)| to_decimals(m.value - p.value, 4)),
            bins,
        }
    }
}

impl CompletenessSums {
    fn bin(&self) -> CompletenessBin {
        let stars = self.stars as f64;
        let interval = Interval::of(self.detected, self.stars);
        CompletenessBin {
            vmag: to_decimals(self.vmag / stars, 4),
            stars: self.stars,
            detected: self.detected,
            measured: to_significant(self.detected as f64 / stars, 6),
            low: to_decimals(interval.low, 6),
            high: to_decimals(interval.high, 6),
            predicted: to_significant(self.predicted / stars, 6),
        }
    }
}

/// Maximum-likelihood magnitude m₅₀ of Φ((m₅₀ − m) / w) for this `part` of the stars in each bin,
/// by Fisher scoring in a = m₅₀ / w and b = 1 / w.
///
/// # Reference
/// Bliss 1935, Ann. Appl. Biol. 22, 134 (probit analysis).
fn fitted_limit(
    bins: &[CompletenessBin],
    part: fn(&CompletenessBin) -> f64,
    start_vmag: f64,
) -> Option<Estimate> {
    const MAX_ROUNDS: usize = 50;
    /// Convergence limit of a step, in magnitudes.
    const SETTLED_MAG: f64 = 1e-7;
    /// Initial width of the fit, in magnitudes.
    const TYPICAL_WIDTH_MAG: f64 = 0.3;
    /// Valid widths of the transition, in magnitudes.
    const WIDTHS_MAG: std::ops::Range<f64> = 0.01..3.0;
    /// Clamp for probabilities far from the limit.
    const MIN_PROBABILITY: f64 = 1e-9;
    // Magnitudes are relative to the start, so that a and b are nearly uncorrelated.
    let (mut a, mut b) = (0.0, 1.0 / TYPICAL_WIDTH_MAG);
    for _ in 0..MAX_ROUNDS {
        let (mut information, mut slope) = ([0.0; 3], [0.0; 2]);
        for bin in bins {
            let m = bin.vmag - start_vmag;
            let z = a - b * m;
            let p = normal_cdf(z).clamp(MIN_PROBABILITY, 1.0 - MIN_PROBABILITY);
            let weight = bin.stars as f64 / (p * (1.0 - p));
            let density = normal_density(z);
            let (by_a, by_b) = (density, -density * m);
            information[0] += weight * by_a * by_a;
            information[1] += weight * by_a * by_b;
            information[2] += weight * by_b * by_b;
            slope[0] += weight * by_a * (part(bin) - p);
            slope[1] += weight * by_b * (part(bin) - p);
        }
        let [aa, ab, bb] = information;
        let ([step_a, step_b], determinant) = solve_pair([[aa, ab], [ab, bb]], slope);
        if determinant.is_nan() || determinant <= 0.0 {
            return None;
        }
        // A step that would change the sign of b is shortened.
        let shorter = (0.5 * b / step_b.abs()).min(1.0);
        a += shorter * step_a;
        b += shorter * step_b;
        if !WIDTHS_MAG.contains(&(1.0 / b)) {
            return None;
        }
        if (step_a / b).abs() < SETTLED_MAG && (step_b / (b * b)).abs() < SETTLED_MAG {
            // Variance of a / b, linearised.
            let m50 = a / b;
            let variance = (bb + 2.0 * m50 * ab + m50 * m50 * aa) / (determinant * b * b);
            return Some(Estimate {
                value: start_vmag + m50,
                sigma: variance.sqrt(),
            });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_of_a_known_curve_is_found_again() {
        let mut completeness = CompletenessTable::around(7.05);
        let (limit, width) = (6.9, 0.25);
        for step in 0..3000 {
            let vmag = 5.5 + 0.001 * f64::from(step);
            let found = 1000.0 * normal_cdf((limit - vmag) / width);
            for star in 0..1000 {
                let predicted = normal_cdf((7.05 - vmag) / width);
                completeness.add(vmag, predicted, f64::from(star) + 0.5 < found);
            }
        }
        let summary = completeness.finish();
        let measured = summary.measured_limit_vmag.unwrap();
        assert!((measured - limit).abs() < 0.002, "{measured}");
        assert!((summary.difference_mag.unwrap() + 0.15).abs() < 0.002);
        assert!(summary.measured_limit_sigma_mag.unwrap() < 0.002);
        let total: usize = summary.bins.iter().map(|bin| bin.stars).sum();
        assert_eq!(total, 3_000_000);
    }

    #[test]
    fn the_standard_error_of_the_limit_is_that_of_repetitions() {
        use rand::{Rng, SeedableRng};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let (mut pulls, count) = (Vec::new(), 300);
        for _ in 0..count {
            let mut completeness = CompletenessTable::around(7.0);
            for _ in 0..400 {
                let vmag = random.random_range(6.0..8.2);
                let p = normal_cdf((7.1 - vmag) / 0.3);
                completeness.add(vmag, p, random.random::<f64>() < p);
            }
            let summary = completeness.finish();
            let off = summary.measured_limit_vmag.unwrap() - 7.1;
            pulls.push(off / summary.measured_limit_sigma_mag.unwrap());
        }
        let variance = pulls.iter().map(|pull| pull * pull).sum::<f64>() / f64::from(count);
        // The standard error of a variance from 300 values is 8 %; three of them.
        assert!((variance - 1.0).abs() < 0.25, "{variance}");
    }

    #[test]
    fn where_all_stars_are_found_there_is_no_limit() {
        let mut completeness = CompletenessTable::around(7.0);
        for step in 0..100 {
            completeness.add(5.0 + 0.01 * f64::from(step), 1.0, true);
        }
        let summary = completeness.finish();
        assert_eq!(summary.measured_limit_vmag, None);
        assert!(CompletenessTable::around(7.0).finish().bins.is_empty());
    }
}
