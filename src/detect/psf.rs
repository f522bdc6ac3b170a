//! The spot of a star: a Gaussian integrated over the pixels (IPSF).
//!
//! Along one axis, the part of the light in pixel `i` of a spot at `x` with standard deviation σ is
//! `½[erf((i+½−x)/√2σ) − erf((i−½−x)/√2σ)]`; the spot is the product of the two axes.
//!
//! # Reference
//! Wang et al. 2019, Laser & Optoelectronics Progress 56, 101101, Eqs. (1) and (2).

use crate::detect::filter::MAX_TAPS;
use arrayvec::ArrayVec;
use multiversion::multiversion;

/// The variance of a pixel's own width, in px²: a spot spreads over σ² + 1/12.
pub(crate) const PIXEL_VARIANCE_PX2: f64 = 1.0 / 12.0;

/// The longest side of a fitting window, in pixels.
pub(crate) const MAX_WINDOW_PX: usize = 49;

/// Pixels of a row treated together.
pub(crate) const LANES: usize = 8;
/// Values of such pixels.
pub(crate) type Lanes = [f32; LANES];
/// Groups that make up the longest side.
const GROUPS: usize = MAX_WINDOW_PX.div_ceil(LANES);

/// Light per pixel along one axis, and its derivatives.
#[derive(Debug, Clone, Default)]
pub(crate) struct AxisProfile {
    /// Part of the light in each pixel.
    value: [Lanes; GROUPS],
    /// Its derivative with respect to the centre, per px.
    by_center: [Lanes; GROUPS],
    /// Its derivative with respect to σ, per px.
    by_sigma: [Lanes; GROUPS],
}

/// The same in some of the pixels.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ProfilePart<T> {
    /// Part of the light in a pixel.
    pub value: T,
    /// Its derivative with respect to the centre, per px.
    pub by_center: T,
    /// Its derivative with respect to σ, per px.
    pub by_sigma: T,
}

impl<const N: usize> ProfilePart<[f32; N]> {
    /// All in one of them.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> ProfilePart<f32> {
        ProfilePart {
            value: self.value[lane],
            by_center: self.by_center[lane],
            by_sigma: self.by_sigma[lane],
        }
    }
}

impl AxisProfile {
    /// Fills the first `count` pixels for a spot at `center_px` (0 is the centre of the first) with `sigma_px`.
    pub fn fill(&mut self, center_px: f64, sigma_px: f64, count: usize) {
        fill(self, center_px, sigma_px, count.min(MAX_WINDOW_PX));
    }

    /// The light in the pixels, of which the first `count` were filled.
    pub fn values(&self) -> &[f32] {
        self.value.as_flattened()
    }

    /// All of a group of pixels.
    #[inline(always)]
    pub fn group(&self, group: usize) -> ProfilePart<Lanes> {
        ProfilePart {
            value: self.value[group],
            by_center: self.by_center[group],
            by_sigma: self.by_sigma[group],
        }
    }

    /// All of one pixel.
    #[inline(always)]
    pub fn pixel(&self, pixel: usize) -> ProfilePart<f32> {
        ProfilePart {
            value: self.value.as_flattened()[pixel],
            by_center: self.by_center.as_flattened()[pixel],
            by_sigma: self.by_sigma.as_flattened()[pixel],
        }
    }
}

/// Edges of pixels treated together: of one pixel less.
const EDGES: usize = 8;

/// The light before a place along an axis, in parts of all, and how it changes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cumulative {
    scale: f64,
    density: f64,
    by_sigma: f64,
}

impl Cumulative {
    /// That of a spot with `sigma_px`.
    pub fn of_spot(sigma_px: f64) -> Self {
        let scale = 1.0 / (std::f64::consts::SQRT_2 * sigma_px);
        let density = std::f64::consts::FRAC_2_SQRT_PI * 0.5 * scale;
        Self {
            scale,
            density,
            by_sigma: density / sigma_px,
        }
    }

    /// At a place so far from the centre, in pixels: the light, less the half; its derivatives with respect to the centre
    /// and to σ, per px.
    #[inline(always)]
    pub fn at(&self, distance_px: f64) -> [f64; 3] {
        let (erf, exp) = erf_and_gauss(distance_px * self.scale);
        [
            0.5 * erf,
            -exp * self.density,
            -distance_px * exp * self.by_sigma,
        ]
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn fill(profile: &mut AxisProfile, center_px: f64, sigma_px: f64, count: usize) {
    let cumulative = Cumulative::of_spot(sigma_px);
    let mut results = [
        &mut profile.value,
        &mut profile.by_center,
        &mut profile.by_sigma,
    ]
    .map(|part| part.as_flattened_mut());
    for start in (0..count).step_by(EDGES - 1) {
        let first = start as f64 - 0.5 - center_px;
        let mut edges = [[0.0f64; EDGES]; 3];
        for edge in 0..EDGES {
            let at = cumulative.at(first + edge as i32 as f64);
            for (edges, at) in edges.iter_mut().zip(at) {
                edges[edge] = at;
            }
        }
        // A whole group is written: the profiles have room for it.
        let part = start..start + EDGES - 1;
        for (result, edges) in results.iter_mut().zip(&edges) {
            for (pixel, edge) in result[part.clone()].iter_mut().zip(edges.windows(2)) {
                *pixel = (edge[1] - edge[0]) as f32;
            }
        }
    }
}

/// Beyond this, erf is ±1 and the exponential 0 to one part in 10¹¹.
const ERF_RANGE: f64 = 5.0;

/// `erf(x)` and `exp(−x²)`; the error of erf is below 1.5e-7. Without branches, for loops of vectors.
///
/// # Reference
/// Abramowitz & Stegun 1964, 7.1.26: it needs the exponential that the derivatives need anyway.
#[inline(always)]
pub(crate) fn erf_and_gauss(x: f64) -> (f64, f64) {
    const A: [f64; 5] = [
        0.254_829_592,
        -0.284_496_736,
        1.421_413_741,
        -1.453_152_027,
        1.061_405_429,
    ];
    let size = if x.abs() < ERF_RANGE {
        x.abs()
    } else {
        ERF_RANGE
    };
    let gauss = exp_of_negative(-size * size);
    let t = 1.0 / (1.0 + 0.327_591_1 * size);
    let polynomial = t * (A[0] + t * (A[1] + t * (A[2] + t * (A[3] + t * A[4]))));
    ((1.0 - polynomial * gauss).copysign(x), gauss)
}

/// What [`exp_of_negative`] is good down to.
pub(crate) const LEAST_EXPONENT: f64 = -700.0;

/// `exp(x)` for −700 ≤ x ≤ 0, to 1e-10 of its value: 2ⁿ times the series of what is left.
#[inline(always)]
pub(crate) fn exp_of_negative(x: f64) -> f64 {
    /// Added to a number, it leaves the nearest integer in the lowest bits of the sum.
    const ROUNDER: f64 = 6_755_399_441_055_744.0;
    const EXPONENT_BITS: u32 = 52;
    const EXPONENT_BIAS: u64 = 1023;
    /// 1/n!, from n = 9 down to 0: |rest| ≤ ln 2 / 2, so the next term is below 1e-11.
    const SERIES: [f64; 10] = [
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    let shifted = x * std::f64::consts::LOG2_E + ROUNDER;
    let power = shifted - ROUNDER;
    let rest = x - power * std::f64::consts::LN_2;
    let mut sum = 0.0;
    for term in SERIES {
        sum = sum * rest + term;
    }
    let bits = (shifted.to_bits() << EXPONENT_BITS).wrapping_add(EXPONENT_BIAS << EXPONENT_BITS);
    sum * f64::from_bits(bits)
}

/// The spot's profile centred on a pixel: parts of the light at distances 0, 1, … `radius` pixels.
///
/// At most [`MAX_TAPS`] of them.
pub(crate) fn centered_profile(sigma_px: f64, radius: usize) -> ArrayVec<f64, MAX_TAPS> {
    let scale = 1.0 / (std::f64::consts::SQRT_2 * sigma_px);
    let edge = |distance: f64| erf_and_gauss(distance * scale).0;
    (0..=radius.min(MAX_TAPS - 1))
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
            let values = || profile.values()[..25].iter().copied().map(f64::from);
            let sum: f64 = values().sum();
            let mean: f64 = values().enumerate().map(|(i, v)| i as f64 * v).sum();
            assert!((sum - 1.0).abs() < 1e-6, "{sum}");
            // Below σ = 0.5 the mean of the pixels is not that of the spot: undersampling.
            assert!(
                (mean - 12.3).abs() < if sigma < 0.6 { 0.06 } else { 1e-3 },
                "{mean}"
            );
        }
    }

    #[test]
    fn the_exponential_is_that_of_the_standard_library() {
        for i in 0..=2500 {
            let x = -0.01 * f64::from(i);
            assert!((exp_of_negative(x) / x.exp() - 1.0).abs() < 1e-10, "{x}");
        }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let mut low = AxisProfile::default();
        let (mut high, mut mid) = (low.clone(), low.clone());
        let fill = |p: &mut AxisProfile, c, s| p.fill(c, s, 9);
        fill(&mut mid, 4.2, 0.8);
        fill(&mut low, 4.2 - 1e-3, 0.8);
        fill(&mut high, 4.2 + 1e-3, 0.8);
        let slope = |i| (high.pixel(i).value - low.pixel(i).value) / 2e-3;
        for i in 0..9 {
            assert!((slope(i) - mid.pixel(i).by_center).abs() < 2e-4);
        }
        fill(&mut low, 4.2, 0.8 - 1e-3);
        fill(&mut high, 4.2, 0.8 + 1e-3);
        let slope = |i| (high.pixel(i).value - low.pixel(i).value) / 2e-3;
        for i in 0..9 {
            assert!((slope(i) - mid.pixel(i).by_sigma).abs() < 2e-4);
        }
    }
}
