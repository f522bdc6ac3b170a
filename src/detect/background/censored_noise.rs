//! Gaussian noise of which all below some level has the lowest value: what is left of it.

use crate::base::statistics::{normal_cdf, normal_density};

/// Deeper cuts count as this one, in standard deviations: 1 pixel in 44 is left there, and the few
/// that are left deeper do not determine how deep.
pub(crate) const MAX_DEPTH: f64 = 2.0;

/// Rounded Gaussian noise that is cut off, in units of its own standard deviation; values are
/// counted from the lowest one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CensoredNoise {
    /// How far the cut is above the mean of the Gaussian.
    pub depth: f64,
    /// The step between values.
    step: f64,
    /// Mean of what is left.
    pub mean: f64,
    /// Standard deviation of what is left.
    pub sigma: f64,
}

impl CensoredNoise {
    /// Noise that is cut off `depth` above its mean, and rounded to multiples of `step`.
    pub fn new(depth: f64, step: f64) -> Self {
        let cut = Self {
            depth: depth.min(MAX_DEPTH),
            step,
            mean: 0.0,
            sigma: 1.0,
        };
        let [_, mean, variance] = cut.raw_cumulants(0.0);
        Self {
            mean,
            sigma: variance.sqrt(),
            ..cut
        }
    }

    /// The cumulant generating function K of the noise at `t`, and its first two derivatives, once
    /// the noise has mean 0 and standard deviation 1.
    pub fn cumulants(&self, t: f64) -> [f64; 3] {
        let [k, slope, curvature] = self.raw_cumulants(t / self.sigma);
        [
            k - t * self.mean / self.sigma,
            (slope - self.mean) / self.sigma,
            curvature / self.sigma.powi(2),
        ]
    }

    /// The same of the noise as it is. A part Φ(depth) has the lowest value; the rest contributes
    /// `exp(dt + t²/2) Φ̄(depth − t)`, d being its mean, times `exp(s²t²/24)` for rounding to steps
    /// of s.
    fn raw_cumulants(&self, t: f64) -> [f64; 3] {
        let Self { depth, step, .. } = *self;
        let mean = 0.5 * step - depth;
        let rounding = step * step / 24.0;
        let beyond = normal_cdf(t - depth);
        let hazard = normal_density(depth - t) / beyond;
        // Logarithmic derivatives of the rest, without rounding and with it.
        let slope = mean + t + hazard;
        let curvature = 1.0 + (mean + t) * slope + 0.5 * step * hazard;
        let rounded_slope = slope + 2.0 * rounding * t;
        let rounded_curvature = curvature
            + 4.0 * rounding * t * slope
            + 2.0 * rounding * (1.0 + 2.0 * rounding * t * t);
        let log_rest = mean * t + (0.5 + rounding) * t * t + libm::log(beyond);
        let log_lowest = libm::log(normal_cdf(depth));
        let highest = log_rest.max(log_lowest);
        let sum = libm::exp(log_rest - highest) + libm::exp(log_lowest - highest);
        let part = libm::exp(log_rest - highest) / sum;
        let first = part * rounded_slope;
        [
            highest + libm::log(sum),
            first,
            (part * rounded_curvature - first * first).max(f64::MIN_POSITIVE),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_cut_off_at_its_mean_is_a_half_normal_distribution() {
        let noise = CensoredNoise::new(0.0, 0.0);
        let mean = (2.0 * std::f64::consts::PI).sqrt().recip();
        assert!((noise.mean - mean).abs() < 1e-12);
        assert!((noise.sigma - (0.5 - mean * mean).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn cumulants_are_standardised_and_agree_with_differences() {
        for (depth, step) in [(-2.0, 0.3), (0.0, 1.0), (1.5, 0.5)] {
            let noise = CensoredNoise::new(depth, step);
            let [k, slope, curvature] = noise.cumulants(0.0);
            assert!(k.abs() < 1e-12 && slope.abs() < 1e-12 && (curvature - 1.0).abs() < 1e-9);
            let (low, high) = (noise.cumulants(0.999), noise.cumulants(1.001));
            let [_, slope, curvature] = noise.cumulants(1.0);
            assert!(((high[0] - low[0]) / 2e-3 / slope - 1.0).abs() < 1e-4);
            assert!(((high[1] - low[1]) / 2e-3 / curvature - 1.0).abs() < 1e-4);
        }
    }
}
