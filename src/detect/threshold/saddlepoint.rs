//! Tails of filtered noise that is not Gaussian, by the saddlepoint approximation.
//!
//! A filtered value is a sum `Σ W_p x_p` of independent pixels, so its cumulant generating function
//! (the logarithm of the moment-generating function) is `Σ K(t W_p)`, with the K of a pixel. The
//! tail follows: `P(> K'(t)) = Φ̄(w + ln(v/w)/w)`, `w = √(2(tK' − K))`, `v = t √K''`. To leading
//! order this is the Cornish–Fisher correction; it stays accurate for strong skews and far tails.
//!
//! # Reference
//! Lugannani & Rice 1980, doi 10.2307/1426607; Barndorff-Nielsen 1986, doi 10.1093/biomet/73.2.307,
//! for the form used here.

use super::filter_weights::FilterWeights;

/// The range of t that is searched for a quantile.
const T_RANGE: (f64, f64) = (0.3, 9.0);
/// Steps of a table of K.
const STEPS: usize = 48;
/// The threshold is raised by no more than this part of it.
pub(crate) const MAX_RAISE: f64 = 1.0;
/// Change of σ by clipping at ±3σ, per excess kurtosis.
pub(crate) const SIGMA_PER_KURTOSIS: f64 = -0.0425;

/// K and its first two derivatives.
pub(crate) type Cumulants = [f64; 3];

/// K of a pixel in equal steps from t = 0 on.
#[derive(Debug, Clone)]
pub(crate) struct CumulantTable {
    step: f64,
    values: [Cumulants; STEPS + 1],
}

impl CumulantTable {
    /// The step that covers all t times the filter's weights.
    pub fn step_for(weights: &FilterWeights) -> f64 {
        T_RANGE.1 * weights.largest / STEPS as f64
    }

    /// The table of K at 0, `step`, 2 `step`, …, which `next` returns one after the other.
    pub fn new(step: f64, next: impl FnMut(usize) -> Cumulants) -> Self {
        Self {
            step,
            values: std::array::from_fn(next),
        }
    }

    /// K at `t`, by cubics through values and slopes.
    fn at(&self, t: f64) -> Cumulants {
        let Self { step, values } = self;
        let position = t / step;
        let lower = (position as usize).min(values.len() - 2);
        let f = position - lower as f64;
        let (a, b) = (values[lower], values[lower + 1]);
        let (rest, square, rest_square) = (1.0 - f, f * f, (1.0 - f).powi(2));
        let cubic = |i: usize| {
            rest_square * (1.0 + 2.0 * f) * a[i]
                + square * (3.0 - 2.0 * f) * b[i]
                + step * (f * rest_square * a[i + 1] - square * rest * b[i + 1])
        };
        [cubic(0), cubic(1), a[2] + f * (b[2] - a[2])]
    }
}

/// Mean and standard deviation of a nearly Gaussian sample of mean 0 and variance 1, after clipping
/// at ±3σ until it settles, by Edgeworth's series.
pub(crate) fn after_clipping(skewness: f64, excess_kurtosis: f64) -> (f64, f64) {
    const MEAN_PER_SKEWNESS: f64 = -0.041;
    const SIGMA_PER_SQUARED_SKEWNESS: f64 = -0.0265;
    /// Below this the series does not hold.
    const MIN_CLIPPED_SIGMA: f64 = 0.85;
    let change =
        SIGMA_PER_KURTOSIS * excess_kurtosis + SIGMA_PER_SQUARED_SKEWNESS * skewness.powi(2);
    (
        MEAN_PER_SKEWNESS * skewness,
        (1.0 + change).max(MIN_CLIPPED_SIGMA),
    )
}

/// The quantile of a skewed distribution that has the tail probability of `u` in a Gaussian, by
/// Cornish and Fisher.
pub(crate) fn quantile_for_skewness(u: f64, skewness: f64) -> f64 {
    u + (u * u - 1.0) / 6.0 * skewness - (2.0 * u.powi(3) - 5.0 * u) / 36.0 * skewness.powi(2)
}

/// The value that a weighted sum of standardised pixels exceeds as often as a Gaussian exceeds `u`;
/// `None` where the tail ends before.
pub(crate) fn saddlepoint_quantile(
    table: &CumulantTable,
    weights: &[(f64, f64)],
    u: f64,
) -> Option<f64> {
    /// They settle t to 0.002.
    const BISECTIONS: usize = 12;
    let filtered = |t: f64| -> Cumulants {
        let mut sum = [0.0; 3];
        for &(times, weight) in weights {
            let k = table.at(t * weight);
            sum[0] += times * k[0];
            sum[1] += times * weight * k[1];
            sum[2] += times * weight * weight * k[2];
        }
        sum
    };
    // The Gaussian quantile of the tail beyond K'(t).
    let quantile = |t: f64| {
        let [k, slope, curvature] = filtered(t);
        let w = (2.0 * (t * slope - k)).max(1e-9).sqrt();
        w + libm::log(t * curvature.max(1e-9).sqrt() / w) / w
    };
    let (mut low, mut high) = T_RANGE;
    if quantile(high) < u {
        return None;
    }
    // The quantile of coarse noise means nothing at small t: a bisection stays away from there.
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if quantile(middle) < u {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(filtered(high)[1])
}
