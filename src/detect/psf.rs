//! The spot of a star: a Gaussian integrated over the pixels (IPSF).
//!
//! Along one axis, the part of the light in pixel `i` of a spot at `x` with standard deviation σ is
//! `½[erf((i+½−x)/√2σ) − erf((i−½−x)/√2σ)]`; the spot is the product of the two axes.
//!
//! # Reference
//! Wang et al. 2019, Laser & Optoelectronics Progress 56, 101101, Eqs. (1) and (2).

use std::f64::consts::PI;

/// The variance of a pixel's own width, in px²: a spot spreads over σ² + 1/12.
pub(super) const PIXEL_VARIANCE_PX2: f64 = 1.0 / 12.0;

/// The longest side of a fitting window, in pixels.
pub(super) const MAX_WINDOW_PX: usize = 49;

/// Light per pixel along one axis, and its derivatives.
#[derive(Debug, Clone)]
pub(super) struct AxisProfile {
    /// Part of the light in each pixel.
    pub value: [f64; MAX_WINDOW_PX],
    /// Its derivative with respect to the centre, per px.
    pub by_center: [f64; MAX_WINDOW_PX],
    /// Its derivative with respect to σ, per px.
    pub by_sigma: [f64; MAX_WINDOW_PX],
}

impl Default for AxisProfile {
    fn default() -> Self {
        Self {
            value: [0.0; MAX_WINDOW_PX],
            by_center: [0.0; MAX_WINDOW_PX],
            by_sigma: [0.0; MAX_WINDOW_PX],
        }
    }
}

impl AxisProfile {
    /// Fills the first `count` pixels for a spot at `center_px` (0 is the centre of the first) with `sigma_px`.
    pub fn fill(&mut self, center_px: f64, sigma_px: f64, count: usize) {
        let scale = 1.0 / (std::f64::consts::SQRT_2 * sigma_px);
        let density = 1.0 / ((2.0 * PI).sqrt() * sigma_px);
        let edge = |i: usize| {
            let distance = i as f64 - 0.5 - center_px;
            let (erf, gauss) = erf_and_gauss(distance * scale);
            (erf, gauss * density, distance)
        };
        let mut left = edge(0);
        for i in 0..count.min(MAX_WINDOW_PX) {
            let right = edge(i + 1);
            self.value[i] = 0.5 * (right.0 - left.0);
            self.by_center[i] = left.1 - right.1;
            self.by_sigma[i] = (left.2 * left.1 - right.2 * right.1) / sigma_px;
            left = right;
        }
    }
}

/// Beyond this, erf is ±1 and the exponential 0 to one part in 10¹¹.
const ERF_RANGE: f64 = 5.0;

/// `erf(x)` and `exp(−x²)`; the error of erf is below 1.5e-7.
///
/// # Reference
/// Abramowitz & Stegun 1964, 7.1.26: it needs the exponential that the derivatives need anyway.
pub(super) fn erf_and_gauss(x: f64) -> (f64, f64) {
    const A: [f64; 5] = [
        0.254_829_592,
        -0.284_496_736,
        1.421_413_741,
        -1.453_152_027,
        1.061_405_429,
    ];
    if x.abs() > ERF_RANGE {
        return (x.signum(), 0.0);
    }
    let gauss = (-x * x).exp();
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let polynomial = t * (A[0] + t * (A[1] + t * (A[2] + t * (A[3] + t * A[4]))));
    ((1.0 - polynomial * gauss).copysign(x), gauss)
}

/// The spot's profile centred on a pixel: parts of the light at distances 0, 1, … `radius` pixels.
pub(super) fn centered_profile(sigma_px: f64, radius: usize) -> Vec<f64> {
    let scale = 1.0 / (std::f64::consts::SQRT_2 * sigma_px);
    let edge = |distance: f64| erf_and_gauss(distance * scale).0;
    (0..=radius)
        .map(|i| 0.5 * (edge(i as f64 + 0.5) - edge(i as f64 - 0.5)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_light_is_counted_and_its_mean_is_the_centre() {
        for sigma in [0.3, 0.5, 1.0, 2.0] {
            let mut profile = AxisProfile::default();
            profile.fill(12.3, sigma, 25);
            let sum: f64 = profile.value.iter().sum();
            let mean: f64 = profile
                .value
                .iter()
                .enumerate()
                .map(|(i, v)| i as f64 * v)
                .sum();
            assert!((sum - 1.0).abs() < 1e-6, "{sum}");
            // Below σ = 0.5 the mean of the pixels is not that of the spot: undersampling.
            assert!(
                (mean - 12.3).abs() < if sigma < 0.6 { 0.06 } else { 1e-3 },
                "{mean}"
            );
        }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let (mut low, mut high, mut mid) = Default::default();
        let fill = |p: &mut AxisProfile, c, s| p.fill(c, s, 9);
        fill(&mut mid, 4.2, 0.8);
        fill(&mut low, 4.2 - 1e-3, 0.8);
        fill(&mut high, 4.2 + 1e-3, 0.8);
        for i in 0..9 {
            assert!(((high.value[i] - low.value[i]) / 2e-3 - mid.by_center[i]).abs() < 2e-4);
        }
        fill(&mut low, 4.2, 0.8 - 1e-3);
        fill(&mut high, 4.2, 0.8 + 1e-3);
        for i in 0..9 {
            assert!(((high.value[i] - low.value[i]) / 2e-3 - mid.by_sigma[i]).abs() < 2e-4);
        }
    }
}
