//! The threshold that gives a wanted number of false detections in pure noise.
//!
//! Noise filtered by a separable kernel is a Gaussian field on a grid, correlated by ρx and ρy
//! between neighbors in a row and in a column. The chance that a pixel is a local maximum above u
//! is `∫_u^∞ φ(z) Q(ρx,z) Q(ρy,z) dz`, where Q is the chance that both neighbors on an axis lie
//! lower: `Q(ρ,z) = 1 − 2Φ̄(hz) + (1/π)∫₀^α exp(−½h²z²/sin²θ) dθ`, `h = √((1−ρ)/(1+ρ))`,
//! `α = arcsin √((1−ρ²)/2)`.
//!
//! # Reference
//! Taylor, Worsley & Gosselin 2007, "Maxima of discretely sampled random fields", Biometrika 94, 1,
//! doi 10.1093/biomet/asm004, for a field whose correlation is Gaussian in shape.

use crate::base::exponential::{MIN_EXPONENT, rough_exp_of_negative};
use crate::detect::psf::erf_and_gauss;
use multiversion::multiversion;
use std::f64::consts::{PI, SQRT_2};

/// Range of thresholds, in standard deviations.
const RANGE: (f64, f64) = (1.0, 12.0);
/// Steps of the inner integral.
const PARTS: usize = 8;

/// The probability Q that both neighbors on an axis are lower, for one correlation ρ.
#[derive(Debug, Clone, Copy, PartialEq)]
struct BothLower {
    h: f64,
    /// Step of θ.
    step: f64,
    /// `½h²/sin²θ` in the middle of each step of θ.
    exponents: [f64; PARTS],
}

impl BothLower {
    fn new(rho: f64) -> Self {
        let h = ((1.0 - rho) / (1.0 + rho)).sqrt();
        let alpha = libm::asin(((1.0 - rho * rho) / 2.0).sqrt());
        // Midpoint rule: the integrand vanishes with all its derivatives at 0.
        let step = alpha / PARTS as f64;
        let exponent = |i: usize| 0.5 * (h / libm::sin((i as f64 + 0.5) * step)).powi(2);
        Self {
            h,
            step,
            exponents: std::array::from_fn(exponent),
        }
    }

    /// Q(ρ, z), for a pixel of value z.
    #[inline(always)]
    fn probability(&self, z: f64) -> f64 {
        let tail = 1.0 - erf_and_gauss(self.h * z / SQRT_2).0;
        let mut parts = [0.0; PARTS];
        for (part, exponent) in parts.iter_mut().zip(&self.exponents) {
            *part = rough_exp_of_negative((-exponent * z * z).max(MIN_EXPONENT)) * self.step;
        }
        let both: f64 = parts.iter().sum();
        (1.0 - tail + both / PI).max(0.0)
    }
}

/// The probability that a pixel of filtered noise is a local maximum above `u` standard deviations.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn false_alarm_probability(u: f64, across: &BothLower, down: &BothLower) -> f64 {
    /// The integral runs from u to u + `SPAN`.
    const SPAN: f64 = 3.0;
    const STEPS: usize = 24;
    let step = SPAN / STEPS as f64;
    let density = |z: f64| {
        let phi = rough_exp_of_negative(-0.5 * z * z) / (2.0 * PI).sqrt();
        let of_row = across.probability(z);
        let of_column = if across == down {
            of_row
        } else {
            down.probability(z)
        };
        phi * of_row * of_column
    };
    // Simpson's rule.
    let inner: f64 = (1..STEPS)
        .map(|i| density(u + i as f64 * step) * if i % 2 == 1 { 4.0 } else { 2.0 })
        .sum();
    (density(u) + inner + density(u + SPAN)) * step / 3.0
}

/// The threshold, in standard deviations of the filtered noise, above which pure noise has
/// `per_mpx` local maxima in a million pixels.
pub(crate) fn threshold_for_rate(per_mpx: f64, rho_x: f64, rho_y: f64) -> f64 {
    /// Some three are needed.
    const MAX_SECANTS: usize = 60;
    /// Tolerance of the logarithm of the rate.
    const TOLERANCE: f64 = 1e-4;
    /// The logarithm of the rate falls at least this much with u².
    const MIN_SLOPE: f64 = -0.1;
    let wanted = libm::log(per_mpx * 1e-6);
    let (across, down) = (BothLower::new(rho_x), BothLower::new(rho_y));
    let excess = |u: f64| {
        libm::log(false_alarm_probability(u, &across, &down).max(f64::MIN_POSITIVE)) - wanted
    };
    // The rate falls about as exp(−u²/2): its logarithm is nearly linear in u², and secants
    // converge fast.
    let within = |square: f64| square.clamp(RANGE.0 * RANGE.0, RANGE.1 * RANGE.1);
    let mut square = within(-2.0 * wanted);
    let mut slope = -0.5;
    let mut at = excess(square.sqrt());
    for _ in 0..MAX_SECANTS {
        let next = within(square - at / slope);
        if at.abs() < TOLERANCE || next == square {
            break;
        }
        let at_next = excess(next.sqrt());
        slope = ((at_next - at) / (next - square)).min(MIN_SLOPE);
        (square, at) = (next, at_next);
    }
    square.sqrt()
}

/// The threshold raised for noise that is itself estimated, with `degrees` of freedom: the same
/// tail probability for Student's t as `u` has for a Gaussian, to leading order
/// `t² = ν(exp(u²/ν) − 1)`.
pub(crate) fn for_estimated_noise(u: f64, degrees: f64) -> f64 {
    let exponent = (u * u / degrees).min(20.0);
    (degrees * libm::expm1(exponent)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rate_above(u: f64, rho: f64) -> f64 {
        false_alarm_probability(u, &BothLower::new(rho), &BothLower::new(rho))
    }

    #[test]
    fn independent_pixels_have_the_textbook_rate() {
        // Four independent neighbors all lower, far in the tail: Φ̄(u).
        let tail = 0.5 * (1.0 - erf_and_gauss(4.0 / SQRT_2).0);
        let rate = rate_above(4.0, 0.0);
        assert!((rate / tail - 1.0).abs() < 0.01, "{rate} vs {tail}");
    }

    #[test]
    fn thresholds_invert_rates_from_many_false_alarms_to_hardly_any() {
        for (per_mpx, rho) in [
            (1e5, 0.0),
            (1e4, 0.5),
            (10.0, 0.2),
            (0.1, 0.78),
            (1e-6, 0.95),
        ] {
            let u = threshold_for_rate(per_mpx, rho, rho);
            let found = rate_above(u, rho) * 1e6;
            assert!(
                (found / per_mpx - 1.0).abs() < 1e-3,
                "{per_mpx}: {found} at {u}"
            );
        }
        assert_eq!(threshold_for_rate(1e6, 0.5, 0.5), RANGE.0);
    }

    #[test]
    fn full_correlation_leaves_no_maxima_and_thresholds_invert_rates() {
        assert!(BothLower::new(0.999_999).probability(3.0) < 0.01);
        let u = threshold_for_rate(1.0, 0.78, 0.78);
        assert!((rate_above(u, 0.78) * 1e6 - 1.0).abs() < 1e-3);
        // Simulated for a spot of σ = 1 px at one per megapixel: 4.71 (80 Mpx, ±0.05).
        assert!((u - 4.71).abs() < 0.08, "{u}");
        assert!(for_estimated_noise(5.0, 1e9) - 5.0 < 1e-6);
    }
}
