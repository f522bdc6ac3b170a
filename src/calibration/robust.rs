//! Mean and standard deviation of many values without outliers.

use crate::base::statistics::{median, median_and_sigma};

/// Values beyond this number of standard deviations are outliers. A normal distribution has 6 in
/// ten million there; clipping them lowers its standard deviation by less than 10⁻⁵ of it.
const CLIP_SIGMA: f64 = 5.0;
/// Maximum number of iterations of clipping. It usually converges in the third.
const MAX_ROUNDS: usize = 20;

/// Mean and standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RobustMoments {
    /// The mean.
    pub mean: f64,
    /// The standard deviation.
    pub sigma: f64,
}

impl RobustMoments {
    /// Mean and standard deviation of `values` without outliers, by iterative clipping. NaN is
    /// ignored.
    ///
    /// It starts from the median and the median absolute deviation. `floor` is the smallest sigma
    /// used for clipping, since the deviation of coarse grey levels may be 0. `None` if there is no
    /// value.
    pub(super) fn clipped(values: &[f32], floor: f64) -> Option<Self> {
        let mut sorted: Vec<f64> = valid(values).collect();
        if sorted.is_empty() {
            return None;
        }
        let (mean, sigma) = median_and_sigma(&mut sorted);
        let sigma = sigma.max(floor);
        let mut current = Self { mean, sigma };
        for _ in 0..MAX_ROUNDS {
            let kept = valid(values).filter(|&value| current.includes(value, floor));
            let next = Self::of(kept);
            let converged = (next.sigma - current.sigma).abs() <= 1e-9 * current.sigma
                && (next.mean - current.mean).abs() <= 1e-9 * current.sigma;
            current = next;
            if converged {
                break;
            }
        }
        Some(current)
    }

    /// Whether `value` is no outlier.
    pub(super) fn includes(&self, value: f64, floor: f64) -> bool {
        (value - self.mean).abs() <= CLIP_SIGMA * self.sigma.max(floor)
    }

    /// Mean and standard deviation (n − 1) in one pass (Welford 1962).
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let (mut count, mut mean, mut squares) = (0.0, 0.0, 0.0);
        for value in values {
            count += 1.0;
            let off = value - mean;
            mean += off / count;
            squares += off * (value - mean);
        }
        let variance: f64 = if count > 1.0 {
            squares / (count - 1.0)
        } else {
            0.0
        };
        Self {
            mean,
            sigma: variance.sqrt(),
        }
    }
}

fn valid(values: &[f32]) -> impl Iterator<Item = f64> {
    values.iter().filter(|v| !v.is_nan()).map(|&v| f64::from(v))
}

/// Approximate number of standard deviations by which a variance, measured with `freedom` degrees
/// of freedom, exceeds the expected variance `typical`.
///
/// # Reference
/// Wilson & Hilferty 1931, doi 10.1073/pnas.17.12.684: the cube root of χ²/ν is nearly normal.
pub(super) fn variance_deviate(variance: f64, typical: f64, freedom: f64) -> f64 {
    let width = 2.0 / (9.0 * freedom);
    (libm::cbrt(variance / typical) - (1.0 - width)) / width.sqrt()
}

/// The mean of variances with `freedom` degrees of freedom each, without outliers.
///
/// Values beyond four standard deviations of [`variance_deviate`] are cut off, which lowers the
/// mean by 0.05 % with one degree of freedom and by less with more.
pub(super) fn typical_variance(variances: &[f32], freedom: f64) -> Option<f64> {
    const CUT: f64 = 4.0;
    let mut sorted: Vec<f64> = valid(variances).collect();
    if sorted.is_empty() {
        return None;
    }
    let mean = |limit: f64| {
        let (mut sum, mut count) = (0.0, 0_u64);
        for value in valid(variances).filter(|&v| v <= limit) {
            sum += value;
            count += 1;
        }
        sum / count as f64
    };
    let width = 2.0 / (9.0 * freedom);
    let quantile = |deviate: f64| (1.0 - width + deviate * width.sqrt()).powi(3);
    let mut typical = median(&mut sorted) / quantile(0.0);
    if typical <= 0.0 {
        // With coarse grey levels, most pixels never change.
        typical = mean(f64::INFINITY);
    }
    for _ in 0..MAX_ROUNDS {
        let next = mean(typical * quantile(CUT));
        let converged = (next - typical).abs() <= 1e-9 * typical;
        typical = next;
        if converged {
            break;
        }
    }
    Some(typical)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn normal(count: usize, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        (0..count)
            .map(|_| StandardNormal.sample(&mut random))
            .collect()
    }

    #[test]
    fn outliers_do_not_count() {
        let mut values: Vec<f32> = normal(100_000, 1)
            .iter()
            .map(|v| (100.0 + 3.0 * v) as f32)
            .collect();
        values[..500].fill(4000.0);
        values[500] = f32::NAN;
        let found = RobustMoments::clipped(&values, 0.0).unwrap();
        // Five standard errors: 3/√n and 3/√(2n).
        assert!((found.mean - 100.0).abs() < 5.0 * 0.0095, "{found:?}");
        assert!((found.sigma - 3.0).abs() < 5.0 * 0.0067, "{found:?}");
        assert_eq!(RobustMoments::clipped(&[f32::NAN; 3], 1.0), None);
    }

    #[test]
    fn coarse_levels_have_a_sigma_too() {
        let values: Vec<f32> = normal(100_000, 2)
            .iter()
            .map(|v| (0.3 * v).round() as f32)
            .collect();
        let found = RobustMoments::clipped(&values, 0.5).unwrap();
        let share = values.iter().filter(|v| **v != 0.0).count() as f64 / 1e5;
        assert!(
            (found.sigma - share.sqrt()).abs() < 0.01,
            "{found:?} {share}"
        );
    }

    #[test]
    fn a_typical_variance_is_that_of_ordinary_pixels_for_any_number_of_frames() {
        for freedom in [1, 2, 5, 19] {
            let normal = normal(200_000 * freedom, 3);
            let mut variances: Vec<f32> = normal
                .chunks(freedom)
                .map(|c| (4.0 * c.iter().map(|v| v * v).sum::<f64>() / freedom as f64) as f32)
                .collect();
            variances[..200].fill(1e4);
            let found = typical_variance(&variances, freedom as f64).unwrap();
            // Five standard errors of the mean, √(2/νn) of it, and what is cut off.
            let error = 4.0 * (5.0 * (2.0 / (freedom as f64 * 2e5)).sqrt() + 6e-4);
            assert!((found - 4.0).abs() < error, "{freedom}: {found}");
            let beyond = variances[200..]
                .iter()
                .filter(|v| variance_deviate(f64::from(**v), 4.0, freedom as f64) > 6.0);
            assert_eq!(beyond.count(), 0, "{freedom}");
        }
    }
}
