//! Exact confidence intervals of a probability.

use crate::base::statistics::log10_binomial_tail;

/// The level of confidence.
const CONFIDENCE: f64 = 0.95;

/// A 95 % confidence interval; both tails have the same probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// The interval after `hits` in `trials` (Clopper & Pearson 1934, Biometrika 26, 404); [0, 1]
    /// without trials.
    pub fn of(hits: usize, trials: usize) -> Self {
        let log10_tail = libm::log10((1.0 - CONFIDENCE) / 2.0);
        // The probability at which `count` or more become likely enough.
        let low = |count: usize| {
            if count == 0 {
                return 0.0;
            }
            bisect(|p| log10_binomial_tail(trials, count, p) < log10_tail)
        };
        Self {
            low: low(hits),
            high: 1.0 - low(trials - hits),
        }
    }
}

/// The point in [0, 1] where `below` becomes false.
fn bisect(below: impl Fn(f64) -> bool) -> f64 {
    /// To better than 10⁻⁹.
    const BISECTIONS: usize = 32;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(interval: Interval, low: f64, high: f64) {
        assert!((interval.low - low).abs() < 2e-4, "{interval:?}");
        assert!((interval.high - high).abs() < 2e-4, "{interval:?}");
    }

    #[test]
    fn the_ends_are_those_of_published_tables() {
        close(Interval::of(0, 10), 0.0, 0.3085);
        close(Interval::of(5, 10), 0.1871, 0.8129);
        close(Interval::of(10, 10), 0.6915, 1.0);
        // None in n: 1 − 0.025^(1/n).
        close(Interval::of(0, 10_000), 0.0, 3.688e-4);
        close(Interval::of(1990, 2000), 0.9908, 0.9976);
    }

    #[test]
    fn without_trials_the_interval_is_everything() {
        close(Interval::of(0, 0), 0.0, 1.0);
    }
}
