//! The middle and the spread of many values, of which some stand out.

use crate::base::statistics::median;

/// From a median absolute deviation to the standard deviation of a normal distribution.
const SIGMA_PER_MAD: f64 = 1.4826;
/// Values farther off than so many standard deviations stand out. A normal distribution has 6 in ten million there:
/// leaving them out lowers its standard deviation by less than 10⁻⁵ of it.
const CLIP_SIGMA: f64 = 5.0;
/// Rounds of clipping; mostly the third changes nothing.
const ROUNDS: usize = 20;

/// What most values are like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Typical {
    /// Their mean.
    pub level: f64,
    /// Their standard deviation.
    pub spread: f64,
}

impl Typical {
    /// Mean and standard deviation of the values in `values` that do not stand out; NaN is no value. The first guess is the
    /// median and the median absolute deviation, and that at least `floor`: coarse grey levels can have none.
    ///
    /// Nothing where there is no value at all.
    pub(crate) fn of(values: &[f32], floor: f64) -> Option<Self> {
        let mut sorted: Vec<f64> = valid(values).collect();
        if sorted.is_empty() {
            return None;
        }
        let middle = median(&mut sorted);
        sorted.iter_mut().for_each(|v| *v = (*v - middle).abs());
        let spread = (SIGMA_PER_MAD * median(&mut sorted)).max(floor);
        let mut typical = Self {
            level: middle,
            spread,
        };
        for _ in 0..ROUNDS {
            let kept = valid(values).filter(|&value| typical.holds(value, floor));
            let next = mean_and_sigma(kept);
            let settled = (next.spread - typical.spread).abs() <= 1e-9 * typical.spread
                && (next.level - typical.level).abs() <= 1e-9 * typical.spread;
            typical = next;
            if settled {
                break;
            }
        }
        Some(typical)
    }

    /// Whether `value` does not stand out.
    pub(crate) fn holds(&self, value: f64, floor: f64) -> bool {
        (value - self.level).abs() <= CLIP_SIGMA * self.spread.max(floor)
    }
}

fn valid(values: &[f32]) -> impl Iterator<Item = f64> {
    values.iter().filter(|v| !v.is_nan()).map(|&v| f64::from(v))
}

/// Mean and standard deviation (n − 1) in one pass (Welford 1962).
pub(crate) fn mean_and_sigma(values: impl Iterator<Item = f64>) -> Typical {
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
    Typical {
        level: mean,
        spread: variance.sqrt(),
    }
}

/// How many standard deviations a variance, measured with so many degrees of freedom, lies above the one to be expected
/// of `typical`, about.
///
/// # Reference
/// Wilson & Hilferty 1931, doi 10.1073/pnas.17.12.684: the cube root of χ²/ν is nearly normal.
pub(crate) fn variance_deviate(variance: f64, typical: f64, freedom: f64) -> f64 {
    let width = 2.0 / (9.0 * freedom);
    ((variance / typical).cbrt() - (1.0 - width)) / width.sqrt()
}

/// The mean of variances of so many degrees of freedom each, without those that stand out.
///
/// What is cut off is beyond four standard deviations of [`variance_deviate`]: with one degree of freedom that lowers the
/// mean by 0.05 %, with more by less.
pub(crate) fn typical_variance(variances: &[f32], freedom: f64) -> Option<f64> {
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
        // Grey levels so coarse that most pixels never change.
        typical = mean(f64::INFINITY);
    }
    for _ in 0..ROUNDS {
        let next = mean(typical * quantile(CUT));
        let settled = (next - typical).abs() <= 1e-9 * typical;
        typical = next;
        if settled {
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
    fn values_that_stand_out_do_not_count() {
        let mut values: Vec<f32> = normal(100_000, 1)
            .iter()
            .map(|v| (100.0 + 3.0 * v) as f32)
            .collect();
        values[..500].fill(4000.0);
        values[500] = f32::NAN;
        let found = Typical::of(&values, 0.0).unwrap();
        // Five standard errors: 3/√n and 3/√(2n).
        assert!((found.level - 100.0).abs() < 5.0 * 0.0095, "{found:?}");
        assert!((found.spread - 3.0).abs() < 5.0 * 0.0067, "{found:?}");
        assert_eq!(Typical::of(&[f32::NAN; 3], 1.0), None);
    }

    #[test]
    fn coarse_levels_have_a_spread_all_the_same() {
        let values: Vec<f32> = normal(100_000, 2)
            .iter()
            .map(|v| (0.3 * v).round() as f32)
            .collect();
        let found = Typical::of(&values, 0.5).unwrap();
        let share = values.iter().filter(|v| **v != 0.0).count() as f64 / 1e5;
        assert!(
            (found.spread - share.sqrt()).abs() < 0.01,
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
