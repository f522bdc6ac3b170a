//! Distribution functions, medians and means.

use std::f64::consts::{FRAC_1_SQRT_2, PI};
use std::sync::LazyLock;

/// Full width at half maximum of a Gaussian, in standard deviations.
pub(crate) const GAUSSIAN_FWHM: f64 = 2.354_820_045_030_949;

/// A value and its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error.
    pub sigma: f64,
}

/// The probability that a normal deviate is below `z` standard deviations.
pub fn normal_cdf(z: f64) -> f64 {
    0.5 * libm::erfc(-z * FRAC_1_SQRT_2)
}

/// Numbers from 0 to 1 that are even over any part of their row, by the golden ratio.
pub fn even_part(index: usize) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    ((index as f64 + 0.5) * GOLDEN).fract()
}

/// The number of standard deviations below which a normal deviate is with `probability`; within ±8.
pub fn normal_quantile(probability: f64) -> f64 {
    const END: f64 = 8.0;
    const BISECTIONS: usize = 30;
    let (mut low, mut high) = (-END, END);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if normal_cdf(middle) < probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The quantile of Student's distribution with the tail probability of the normal quantile `z`.
///
/// # Reference
/// Abramowitz & Stegun 1964, eq. 26.7.5, to the second order: within 2 % from 10 degrees of
/// freedom.
pub(crate) fn student_quantile(z: f64, degrees_of_freedom: f64) -> f64 {
    let first = (z.powi(3) + z) / 4.0;
    let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
    z + first / degrees_of_freedom + second / degrees_of_freedom.powi(2)
}

/// The density of the normal distribution at `z` standard deviations.
pub fn normal_density(z: f64) -> f64 {
    libm::exp(-0.5 * z * z) / (2.0 * PI).sqrt()
}

/// [`normal_cdf`] and [`normal_density`] from a table, to 1e-13, in a tenth of the time.
pub fn normal_cdf_and_density(z: f64) -> (f64, f64) {
    /// Entries of the table per standard deviation.
    const TABLE_STEPS: f64 = 32.0;
    /// The table covers ± this many standard deviations.
    const TABLE_END: f64 = 6.0;
    /// 1 / n, which is faster than to divide.
    const RECIPROCALS: [f64; 7] = [
        1.0,
        1.0 / 2.0,
        1.0 / 3.0,
        1.0 / 4.0,
        1.0 / 5.0,
        1.0 / 6.0,
        1.0 / 7.0,
    ];
    static TABLE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| {
        let entries = 0..=(2.0 * TABLE_END * TABLE_STEPS) as usize;
        let z = entries.map(|entry| entry as f64 / TABLE_STEPS - TABLE_END);
        z.map(|z| (normal_cdf(z), normal_density(z))).collect()
    });
    // False for NaN, too.
    let is_within = z.abs() <= TABLE_END;
    let nearest = ((z + TABLE_END) * TABLE_STEPS + 0.5) as usize;
    let Some((cdf, density)) = TABLE.get(nearest).filter(|_| is_within) else {
        return (normal_cdf(z), normal_density(z));
    };
    // Taylor series about the nearest entry; its coefficients are Hermite polynomials.
    let z0 = nearest as f64 / TABLE_STEPS - TABLE_END;
    let d = z - z0;
    let z0_sq = z0 * z0;
    let he = [
        1.0,
        z0,
        z0_sq - 1.0,
        z0 * (z0_sq - 3.0),
        (z0_sq - 6.0) * z0_sq + 3.0,
        z0 * ((z0_sq - 10.0) * z0_sq + 15.0),
        ((z0_sq - 15.0) * z0_sq + 45.0) * z0_sq - 15.0,
    ];
    let (mut in_cdf, mut in_density, mut power) = (0.0, 0.0, 1.0);
    for (he, one_over_n) in he.into_iter().zip(RECIPROCALS) {
        in_density += he * power;
        power *= -d * one_over_n;
        in_cdf -= he * power;
    }
    (cdf + density * in_cdf, density * in_density)
}

/// Computes the logarithm of a product of many numbers from 1e-100 to 1 with few logarithms.
#[derive(Debug, Clone, Copy)]
pub struct LnProduct {
    ln: f64,
    /// The product of the numbers not yet in `ln`.
    factor: f64,
}

impl LnProduct {
    /// The empty product.
    pub const ONE: Self = Self {
        ln: 0.0,
        factor: 1.0,
    };

    /// Multiplies the product by `number`.
    #[inline]
    pub fn multiply(&mut self, number: f64) {
        self.factor *= number;
        if self.factor < 1e-200 {
            self.ln += libm::log(self.factor);
            self.factor = 1.0;
        }
    }

    /// The natural logarithm of the product.
    pub fn ln(&self) -> f64 {
        self.ln + libm::log(self.factor)
    }
}

/// Standard deviation per median absolute deviation, for a normal distribution.
pub const SIGMA_PER_MAD: f64 = 1.482_6;

/// The median of `values`: the upper one if their number is even, 0 if there are none.
///
/// Reorders `values`.
pub fn median<T: Copy + Default + Into<f64>>(values: &mut [T]) -> T {
    if values.is_empty() {
        return T::default();
    }
    let order = |a: &T, b: &T| (*a).into().total_cmp(&(*b).into());
    *values.select_nth_unstable_by(values.len() / 2, order).1
}

/// The [`median`] of values; `None` if there are none.
pub fn median_of<T: Copy + Default + Into<f64>>(values: impl Iterator<Item = T>) -> Option<T> {
    let mut values: Vec<T> = values.collect();
    (!values.is_empty()).then(|| median(&mut values))
}

/// The quantile `share` of ascending values: one of them, and `None` if there are none.
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    sorted.get((share * last as f64).round() as usize).copied()
}

/// The mean of `values`, and the sum of the squares of their deviations from it.
pub(crate) fn mean_and_squares(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares = values.iter().map(|value| (value - mean).powi(2));
    (mean, squares.sum())
}

/// Median and standard deviation of normally distributed values with outliers: the latter from the
/// median absolute deviation. Reorders and changes the values.
pub(crate) fn median_and_sigma(values: &mut [f64]) -> (f64, f64) {
    let center = median(values);
    values.iter_mut().for_each(|v| *v = (*v - center).abs());
    (center, SIGMA_PER_MAD * median(values))
}

/// Leaves out what is farther from the median than three standard deviations by [`median_and_sigma`], which are at
/// least `least_sigma`.
pub(crate) fn clip(values: &mut Vec<f64>, least_sigma: f64) {
    const SIGMAS: f64 = 3.0;
    let (center, sigma) = median_and_sigma(&mut values.clone());
    values.retain(|value| (value - center).abs() <= SIGMAS * sigma.max(least_sigma));
}

/// The median of values that were rounded to a `step`, to a part of it. What is cut off at either end does not
/// change it. Reorders the values.
pub(crate) fn median_of_rounded(values: &mut [f64], step: f64) -> f64 {
    let middle = median(values);
    let below = values.iter().filter(|value| **value < middle).count() as f64;
    let same = values.iter().filter(|value| **value == middle).count() as f64;
    let part = (0.5 * values.len() as f64 - below) / same.max(1.0);
    middle + step * (part - 0.5)
}

/// log10 of the probability of `hits` or more successes in `trials` at `chance` each.
pub fn log10_binomial_tail(trials: usize, hits: usize, chance: f64) -> f64 {
    /// With more hits than this, factorials are taken from the gamma function.
    const MANY_HITS: usize = 1000;
    /// With more trials than this, a likely tail is computed from the complementary one.
    const MANY_TRIALS: usize = 10_000;
    if hits == 0 || chance >= 1.0 {
        return 0.0;
    }
    if hits > trials || chance <= 0.0 {
        return f64::NEG_INFINITY;
    }
    if trials > MANY_TRIALS && (hits as f64) < trials as f64 * chance {
        // Below the mean the terms rise, and up to `trials` of them matter.
        let too_few = log10_binomial_tail(trials, trials - hits + 1, 1.0 - chance);
        return libm::log1p(-libm::pow(10f64, too_few)) / std::f64::consts::LN_10;
    }
    let (log_p, log_q) = (libm::log(chance), libm::log1p(-chance));
    let mut log_term = hits as f64 * log_p + (trials - hits) as f64 * log_q;
    if hits > MANY_HITS {
        let log_factorial = |n: usize| libm::lgamma(n as f64 + 1.0);
        log_term += log_factorial(trials) - log_factorial(hits) - log_factorial(trials - hits);
    } else {
        for i in 0..hits {
            log_term += libm::log((trials - i) as f64) - libm::log((i + 1) as f64);
        }
    }
    // The further terms, relative to the first.
    let odds = chance / (1.0 - chance);
    let (mut ratio, mut sum) = (1.0, 1.0);
    for k in hits..trials {
        ratio *= (trials - k) as f64 / (k + 1) as f64 * odds;
        sum += ratio;
        if ratio < 1e-12 * sum {
            break;
        }
    }
    ((log_term + libm::log(sum)) / std::f64::consts::LN_10).min(0.0)
}

/// log10 of the probability of `hits` or more successes in trials with these `chances`.
///
/// `scaled` is a buffer that is reused.
pub fn log10_poisson_binomial_tail(chances: &[f64], hits: usize, scaled: &mut Vec<f64>) -> f64 {
    /// Factor per success that prevents underflow of products of small chances.
    const SUCCESS_SCALE: f64 = 1e4;
    if hits == 0 {
        return 0.0;
    }
    if hits > chances.len() {
        return f64::NEG_INFINITY;
    }
    // Scaled probabilities of each number of successes so far, in descending order; the first is
    // that of `hits` or more.
    scaled.clear();
    scaled.resize(hits + 1, 0.0);
    scaled[hits] = 1.0;
    for (tried, chance) in chances.iter().enumerate() {
        let success = chance * SUCCESS_SCALE;
        let first = hits.saturating_sub(tried + 1);
        if first == 0 {
            scaled[0] += scaled[1] * success;
        }
        for i in first.max(1)..hits {
            scaled[i] = scaled[i] * (1.0 - chance) + scaled[i + 1] * success;
        }
        scaled[hits] *= 1.0 - chance;
    }
    (libm::log10(scaled[0]) - hits as f64 * libm::log10(SUCCESS_SCALE)).min(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_the_normal_distribution_agrees_with_the_functions() {
        for step in -90_000..=90_000 {
            let z = f64::from(step) * 7.7e-5;
            let (cdf, density) = normal_cdf_and_density(z);
            assert!((cdf - normal_cdf(z)).abs() < 1e-13, "{z}: {cdf}");
            assert!(
                (density - normal_density(z)).abs() < 1e-12,
                "{z}: {density}"
            );
        }
        assert!(normal_cdf_and_density(f64::NAN).0.is_nan());
        assert_eq!(normal_cdf_and_density(f64::INFINITY).0, 1.0);
    }

    #[test]
    fn quantiles_of_student_are_those_of_the_tables() {
        // Two-sided 0.1 %, and 1 %.
        for (degrees_of_freedom, sigmas, expected) in [
            (10.0, 3.290_5, 4.587),
            (20.0, 3.290_5, 3.850),
            (60.0, 3.290_5, 3.460),
            (10.0, 2.575_8, 3.169),
            (30.0, 2.575_8, 2.750),
        ] {
            let found = student_quantile(sigmas, degrees_of_freedom);
            assert!((found / expected - 1.0).abs() < 0.02, "{found} {expected}");
        }
    }

    #[test]
    fn medians_quantiles_and_clipping_of_a_few_values() {
        assert_eq!(median(&mut [4.0_f32, 1.0, 3.0, 2.0]), 3.0);
        assert_eq!(median::<f64>(&mut []), 0.0);
        assert_eq!(median_of([2.0, 1.0, 3.0].into_iter()), Some(2.0));
        assert_eq!(median_of(std::iter::empty::<f32>()), None);
        let sorted = [1.0, 2.0, 3.0, 4.0];
        let found = [0.0, 0.5, 0.9, 1.0].map(|share| quantile(&sorted, share));
        assert_eq!(found, [1.0, 3.0, 4.0, 4.0].map(Some));
        assert_eq!(quantile(&[], 0.5), None);
        assert_eq!(mean_and_squares(&sorted), (2.5, 5.0));
        let mut values = vec![1.0, 2.0, 3.0, 90.0];
        clip(&mut values, 0.5);
        assert_eq!(values, [1.0, 2.0, 3.0]);
    }

    #[test]
    fn the_logarithm_of_a_product_is_the_sum_of_logarithms() {
        let numbers = || (1..2000).map(|i| 10f64.powf(-f64::from(i) / 20.0));
        let mut product = LnProduct::ONE;
        numbers().for_each(|number| product.multiply(number));
        let sum: f64 = numbers().map(libm::log).sum();
        assert!((product.ln() / sum - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_binomial_tail_agrees_with_direct_sums() {
        assert_eq!(log10_binomial_tail(10, 0, 0.3), 0.0);
        assert!((log10_binomial_tail(1, 1, 0.01) + 2.0).abs() < 1e-12);
        // 1 − 0.9³ for one or more of three.
        assert!((log10_binomial_tail(3, 1, 0.1) - 0.271f64.log10()).abs() < 1e-12);
        // Two or three of three: 3·0.1²·0.9 + 0.1³.
        assert!((log10_binomial_tail(3, 2, 0.1) - 0.028f64.log10()).abs() < 1e-12);
        assert!((log10_binomial_tail(60, 50, 0.01) + 89.166).abs() < 0.002);
        assert_eq!(log10_binomial_tail(3, 4, 0.1), f64::NEG_INFINITY);
        // Across the change of method for factorials: one more hit is slightly less likely.
        let at = |hits| log10_binomial_tail(20_000, hits, 0.05);
        let steps = [999, 1000, 1001].map(|hits| at(hits) - at(hits + 1));
        assert!(
            (steps[1] - 0.5 * (steps[0] + steps[2])).abs() < 1e-5,
            "{steps:?}"
        );
        // Below the mean (complementary tail) and above it.
        for hits in [1, 5, 9, 15] {
            let exact = log10_poisson_binomial_tail(&[1e-3; 10_001], hits, &mut Vec::new());
            let found = log10_binomial_tail(10_001, hits, 1e-3);
            assert!((found - exact).abs() < 1e-9, "{hits}: {found} {exact}");
        }
        // The middle of a binomial distribution of 10⁸.
        assert!((log10_binomial_tail(100_000_000, 50_000_000, 0.5) - 0.5f64.log10()).abs() < 1e-4);
    }

    #[test]
    fn equal_chances_give_the_binomial_tail() {
        for (trials, hits, chance) in [(3, 1, 0.1), (3, 2, 0.1), (60, 50, 0.01), (57, 57, 1e-6)] {
            let expected = log10_binomial_tail(trials, hits, chance);
            let found = log10_poisson_binomial_tail(&vec![chance; trials], hits, &mut Vec::new());
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn unequal_chances_agree_with_the_sum_over_all_outcomes() {
        let chances = [0.5, 0.2, 0.01, 0.9];
        for hits in 0..=5 {
            let outcomes = (0..16u32).filter(|outcome| outcome.count_ones() as usize >= hits);
            let probability = |outcome: u32| -> f64 {
                let of_trial =
                    |(i, p): (usize, &f64)| if outcome >> i & 1 == 1 { *p } else { 1.0 - p };
                chances.iter().enumerate().map(of_trial).product()
            };
            let expected = outcomes.map(probability).sum::<f64>();
            let found = 10f64.powf(log10_poisson_binomial_tail(&chances, hits, &mut Vec::new()));
            assert!(
                (found - expected).abs() < 1e-12,
                "{hits}: {found} {expected}"
            );
        }
    }
}
