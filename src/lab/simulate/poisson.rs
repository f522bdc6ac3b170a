//! Poisson random numbers.
//!
//! Mathematical functions are those of [`libm`], the same on every machine.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Largest mean that is tabulated, in electrons.
const MAX_TABLE_E: f64 = 1e6;
/// Number of guide entries into the table: equal parts of the interval from 0 to 1.
const GUIDES: usize = 1 << 10;

/// A Poisson random number of this non-negative `mean`; a mean beyond 2⁵³ is returned itself.
pub(super) fn poisson(mean: f64, random: &mut ChaCha8Rng) -> f64 {
    /// Largest mean for which inversion is faster than rejection.
    const SMALL_MEAN: f64 = 12.0;
    const EXACT: f64 = (1u64 << 53) as f64;
    if mean < SMALL_MEAN {
        return by_inversion(mean, random);
    }
    if mean < EXACT {
        return by_rejection(mean, random);
    }
    mean
}

/// Inversion: adds up probabilities until they exceed a uniform random number.
fn by_inversion(mean: f64, random: &mut ChaCha8Rng) -> f64 {
    // Probabilities beyond are below 10⁻¹⁶ for a mean of 12.
    const LAST: u32 = 80;
    let mut term = libm::exp(-mean);
    let mut rest: f64 = random.random();
    for count in 0..LAST {
        if rest < term {
            return f64::from(count);
        }
        rest -= term;
        term *= mean / f64::from(count + 1);
    }
    f64::from(LAST)
}

/// Transformed rejection with squeeze.
///
/// # Reference
/// Hörmann 1993, Insurance: Mathematics and Economics 12, 39: algorithm PTRS.
fn by_rejection(mean: f64, random: &mut ChaCha8Rng) -> f64 {
    let b = 0.931 + 2.53 * mean.sqrt();
    let a = -0.059 + 0.02483 * b;
    let squeeze = 0.9277 - 3.6224 / (b - 2.0);
    loop {
        let u = random.random::<f64>() - 0.5;
        let v: f64 = random.random();
        let us = 0.5 - u.abs();
        let count = ((2.0 * a / us + b) * u + mean + 0.43).floor();
        if us >= 0.07 && v <= squeeze {
            return count;
        }
        if count < 0.0 || (us < 0.013 && v > us) {
            continue;
        }
        let inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
        let log_v = libm::log(v * inverse_alpha / (a / (us * us) + b));
        if log_v <= count * libm::log(mean) - mean - libm::lgamma(count + 1.0) {
            return count;
        }
    }
}

/// A tabulated Poisson distribution, for many pixels of the same mean.
#[derive(Debug, Clone)]
pub(super) struct PoissonTable {
    mean: f64,
    /// The count of the first element of `cumulative`.
    first: u32,
    /// Probability of at most each count.
    cumulative: Vec<f64>,
    /// Start of the search in `cumulative`, by part of the interval.
    guides: Vec<u32>,
}

impl PoissonTable {
    /// The table; none for a mean of 0 or one that is too large.
    pub(super) fn new(mean: f64) -> Option<Self> {
        if !(mean > 0.0 && mean < MAX_TABLE_E) {
            return None;
        }
        // Probabilities beyond are below the resolution of a random number.
        let reach = 10.0 * mean.sqrt() + 40.0;
        let first = (mean - reach).max(0.0) as u32;
        let last = (mean + reach) as u32;
        let log_mean = libm::log(mean);
        let probability = |count: u32| {
            let count = f64::from(count);
            libm::exp(count * log_mean - mean - libm::lgamma(count + 1.0))
        };
        let mut sum = 0.0;
        let cumulative: Vec<f64> = (first..=last)
            .map(|count| {
                sum += probability(count);
                sum
            })
            .collect();
        let guide = |part: usize| {
            let below = part as f64 / GUIDES as f64;
            cumulative.partition_point(|p| *p <= below) as u32
        };
        Some(Self {
            mean,
            first,
            guides: (0..GUIDES).map(guide).collect(),
            cumulative,
        })
    }

    /// The mean.
    pub(super) fn mean(&self) -> f64 {
        self.mean
    }

    /// A random number.
    pub(super) fn sample(&self, random: &mut ChaCha8Rng) -> f64 {
        let uniform: f64 = random.random();
        let last = self.cumulative.len() - 1;
        let mut place = self.guides[(uniform * GUIDES as f64) as usize] as usize;
        while place < last && self.cumulative[place] <= uniform {
            place += 1;
        }
        f64::from(self.first) + place as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// Mean, variance and third central moment of `samples`.
    fn moments(samples: &[f64]) -> [f64; 3] {
        let count = samples.len() as f64;
        let mean = samples.iter().sum::<f64>() / count;
        let central = |power| {
            let powers = samples.iter().map(|sample| (sample - mean).powi(power));
            powers.sum::<f64>() / count
        };
        [mean, central(2), central(3)]
    }

    /// All three moments of a Poisson distribution equal its mean.
    fn check(mean: f64, samples: &[f64]) {
        let n = samples.len() as f64;
        let found = moments(samples);
        // Standard errors of the three, from the distribution's moments up to the sixth; five of
        // them.
        let errors = [
            (mean / n).sqrt(),
            ((mean + 2.0 * mean * mean) / n).sqrt(),
            ((mean + 24.0 * mean.powi(2) + 6.0 * mean.powi(3)) / n).sqrt(),
        ];
        for (moment, error) in found.into_iter().zip(errors) {
            assert!((moment - mean).abs() <= 5.0 * error, "{mean}: {found:?}");
        }
        assert!(samples.iter().all(|s| *s >= 0.0 && s.fract() == 0.0));
    }

    #[test]
    fn numbers_have_the_moments_of_a_poisson_distribution() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for mean in [0.0, 1e-3, 0.3, 5.0, 11.9, 12.0, 30.0, 80.0, 4e4] {
            let samples: Vec<f64> = (0..200_000).map(|_| poisson(mean, &mut random)).collect();
            check(mean, &samples);
        }
        assert_eq!(poisson(1e20, &mut random), 1e20);
    }

    #[test]
    fn a_table_gives_the_same_distribution() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        for mean in [1e-3, 0.3, 5.0, 60.0, 4e4] {
            let table = PoissonTable::new(mean).unwrap();
            let samples: Vec<f64> = (0..200_000).map(|_| table.sample(&mut random)).collect();
            check(mean, &samples);
            assert!((table.cumulative[table.cumulative.len() - 1] - 1.0).abs() < 1e-9);
        }
        assert!(PoissonTable::new(0.0).is_none() && PoissonTable::new(1e9).is_none());
        assert!(PoissonTable::new(f64::NAN).is_none());
    }

    #[test]
    fn each_number_is_as_frequent_as_it_should_be() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let (mean, draws) = (15.0, 400_000);
        let table = PoissonTable::new(mean).unwrap();
        let mut counts = [[0u32; 41]; 2];
        for _ in 0..draws {
            for (kind, number) in [poisson(mean, &mut random), table.sample(&mut random)]
                .into_iter()
                .enumerate()
            {
                counts[kind][number.min(40.0) as usize] += 1;
            }
        }
        let mut probability = (-mean).exp();
        for number in 0..40 {
            let expected = probability * f64::from(draws);
            for count in counts {
                let off = (f64::from(count[number]) - expected).abs();
                assert!(off < 5.0 * expected.sqrt() + 3.0, "{number}: {count:?}");
            }
            probability *= mean / (number + 1) as f64;
        }
    }
}
