//! The point spread function: a Gaussian integrated over the pixels, called the spot.
//!
//! Along one axis, the fraction of the light of a spot at `x` with standard deviation σ that falls
//! on pixel `i` is `½[erf((i+½−x)/√2σ) − erf((i−½−x)/√2σ)]`; the spot is the product of both axes.
//!
//! # Reference
//! Wang et al. 2019, Laser & Optoelectronics Progress 56, 101101, Eqs. (1) and (2).

use crate::base::exponential::{rough_exp_of_negative, rough_exp_of_negative_f32};
use crate::base::size::Size;
use arrayvec::ArrayVec;
use multiversion::multiversion;

/// Variance of a pixel's own width, in px²: an integrated spot has the variance σ² + 1/12.
pub(crate) const PIXEL_VARIANCE_PX2: f64 = 1.0 / 12.0;

/// Maximum length of a [`centered_profile`], in pixels: enough for spots up to σ = 13 px.
pub(crate) const MAX_TAPS: usize = 32;

/// Maximum side of a fitting window, in pixels.
pub(crate) const MAX_WINDOW_PX: usize = 49;

/// Adjacent pixels of a row treated together.
pub(crate) const GROUP_PX: usize = 8;
/// Part of a spot: a round Gaussian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GaussianComponent {
    /// Position relative to the spot's centre of light, along x and y, in pixels.
    pub offset_px: [f64; 2],
    /// Standard deviation, in pixels.
    pub sigma_px: f64,
    /// Share of the light.
    pub share: f64,
}

/// Values of a group of adjacent pixels.
pub(crate) type PixelGroup = [f32; GROUP_PX];
/// Groups in the longest side of a window.
const GROUPS: usize = MAX_WINDOW_PX.div_ceil(GROUP_PX);

/// Light per pixel along one axis, and its derivatives.
#[derive(Debug, Clone, Default)]
pub(crate) struct AxisProfile {
    /// Fraction of the light in each pixel.
    value: [PixelGroup; GROUPS],
    /// Its derivative with respect to the centre, per px.
    by_center: [PixelGroup; GROUPS],
    /// Its derivative with respect to σ, per px.
    by_sigma: [PixelGroup; GROUPS],
}

/// An [`AxisProfile`] in one or several pixels, as `T` has it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ProfilePart<T> {
    /// Fraction of the light.
    pub value: T,
    /// Its derivative with respect to the centre, per px.
    pub by_center: T,
    /// Its derivative with respect to σ, per px.
    pub by_sigma: T,
}

impl<const N: usize> ProfilePart<[f32; N]> {
    /// The values in one lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> ProfilePart<f32> {
        ProfilePart {
            value: self.value[lane],
            by_center: self.by_center[lane],
            by_sigma: self.by_sigma[lane],
        }
    }
}

/// The part of a window that a narrow spot has light in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LitPart {
    /// First group of a row, and the one after the last.
    pub groups: [usize; 2],
    /// First row, and the one after the last.
    pub rows: [usize; 2],
}

/// Profiles of a narrow spot along both axes, in the part of a window that it has light in.
#[derive(Debug, Clone, Default)]
pub(crate) struct NarrowProfiles {
    across: AxisProfile,
    down: AxisProfile,
}

impl NarrowProfiles {
    /// Computes the profiles of a spot at a place in a window of this size.
    ///
    /// Part of the loop over the components, so that the processor computes several at once.
    #[inline(always)]
    pub fn fill(&mut self, [x_px, y_px]: [f64; 2], sigma_px: f64, size: Size) -> LitPart {
        /// Less than 10⁻⁵ of the light is beyond this many standard deviations of a pixel's edge.
        const REACH_SIGMAS: f64 = 4.5;
        let reach_px = REACH_SIGMAS * sigma_px + 0.5;
        let range = |at: f64, side: usize| {
            let bound = |pixel: f64| pixel.clamp(0.0, side as f64) as usize;
            [
                bound((at - reach_px).ceil()),
                bound((at + reach_px).floor() + 1.0),
            ]
        };
        let [columns, rows] = [range(x_px, size.width), range(y_px, size.height)];
        let groups = [columns[0] / GROUP_PX, columns[1].div_ceil(GROUP_PX)];
        let first = groups[0] * GROUP_PX;
        let cumulative = Cumulative::of_spot(sigma_px);
        let count = columns[1].saturating_sub(first);
        fill_narrow(&mut self.across, x_px - first as f64, &cumulative, count);
        let count = rows[1].saturating_sub(rows[0]);
        fill_narrow(&mut self.down, y_px - rows[0] as f64, &cumulative, count);
        LitPart { groups, rows }
    }

    /// The values along x in a group of the part.
    #[inline(always)]
    pub fn across(&self, group: usize, part: &LitPart) -> ProfilePart<PixelGroup> {
        self.across.group(group - part.groups[0])
    }

    /// The values along y in a row of the part.
    #[inline(always)]
    pub fn down(&self, row: usize, part: &LitPart) -> ProfilePart<f32> {
        self.down.pixel(row - part.rows[0])
    }
}

impl AxisProfile {
    /// Fills the first `count` pixels for a spot of `sigma_px` at `center_px`, where 0 is the
    /// centre of the first pixel.
    pub fn fill(&mut self, center_px: f64, sigma_px: f64, count: usize) {
        fill(self, center_px, sigma_px, count.min(MAX_WINDOW_PX));
    }

    /// Fraction of the light in each pixel; only those that [`Self::fill`] counted are valid.
    pub fn values(&self) -> &[f32] {
        self.value.as_flattened()
    }

    /// The values in a group of pixels.
    #[inline(always)]
    pub fn group(&self, group: usize) -> ProfilePart<PixelGroup> {
        ProfilePart {
            value: self.value[group],
            by_center: self.by_center[group],
            by_sigma: self.by_sigma[group],
        }
    }

    /// The values in one pixel.
    #[inline(always)]
    pub fn pixel(&self, pixel: usize) -> ProfilePart<f32> {
        ProfilePart {
            value: self.value.as_flattened()[pixel],
            by_center: self.by_center.as_flattened()[pixel],
            by_sigma: self.by_sigma.as_flattened()[pixel],
        }
    }
}

/// Pixel edges treated together: those of one pixel less.
const EDGES: usize = 8;

/// Cumulative light along an axis: the fraction that falls before a point, and its derivatives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cumulative {
    scale: f64,
    density: f64,
    by_sigma: f64,
}

impl Cumulative {
    /// For a spot of `sigma_px`.
    pub fn of_spot(sigma_px: f64) -> Self {
        let scale = 1.0 / (std::f64::consts::SQRT_2 * sigma_px);
        let density = std::f64::consts::FRAC_2_SQRT_PI * 0.5 * scale;
        Self {
            scale,
            density,
            by_sigma: density / sigma_px,
        }
    }

    /// The fraction less one half, and its derivatives with respect to the centre and to σ, per px,
    /// at a distance from the centre in pixels.
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
        // May write beyond `count`, as far as the profile is long.
        let part = start..start + EDGES - 1;
        for (result, edges) in results.iter_mut().zip(&edges) {
            for (pixel, edge) in result[part.clone()].iter_mut().zip(edges.windows(2)) {
                *pixel = (edge[1] - edge[0]) as f32;
            }
        }
    }
}

/// The same as [`fill`] in single precision, for the components of a mixture: an error of 10⁻⁶ of a component's
/// light. The pixels that fill the last group are there as well, the last of them roughly.
#[inline(always)]
fn fill_narrow(profile: &mut AxisProfile, center_px: f64, cumulative: &Cumulative, count: usize) {
    /// Pixels of nearly all components: two groups, whose edges take no decisions.
    const FEW: usize = 2 * GROUP_PX;
    let first_px = -0.5 - center_px as f32;
    if count < FEW {
        let edges = edges_from::<FEW>(cumulative, first_px);
        set_pixels(profile, 0, &edges, [0.5, 0.0, 0.0]);
        return;
    }
    let mut edges = edges_from::<GROUP_PX>(cumulative, first_px);
    for start in (0..count.min(MAX_WINDOW_PX)).step_by(GROUP_PX) {
        let next_px = first_px + (start + GROUP_PX) as f32;
        let after = edges_from::<GROUP_PX>(cumulative, next_px);
        set_pixels(profile, start, &edges, after.map(|after| after[0]));
        edges = after;
    }
}

/// [`Cumulative::at`] in single precision at edges of pixels, the first of which is at a distance from
/// the centre in pixels.
#[allow(
    clippy::needless_range_loop,
    reason = "lanes of several arrays read best as indices"
)]
#[inline(always)]
fn edges_from<const N: usize>(cumulative: &Cumulative, first_px: f32) -> [[f32; N]; 3] {
    let [scale, density, by_sigma] =
        [cumulative.scale, cumulative.density, cumulative.by_sigma].map(|v| v as f32);
    let mut at = [[0.0f32; N]; 3];
    for lane in 0..N {
        let distance_px = first_px + lane as i32 as f32;
        let (erf, gauss) = erf_and_gauss_single(distance_px * scale);
        at[0][lane] = 0.5 * erf;
        at[1][lane] = -gauss * density;
        at[2][lane] = -distance_px * gauss * by_sigma;
    }
    at
}

/// Sets the pixels between edges from pixel `start` on, which begins a group; `after` are the values at
/// the edge that follows.
#[inline(always)]
fn set_pixels<const N: usize>(
    profile: &mut AxisProfile,
    start: usize,
    edges: &[[f32; N]; 3],
    after: [f32; 3],
) {
    let parts = [
        &mut profile.value,
        &mut profile.by_center,
        &mut profile.by_sigma,
    ];
    for ((part, edges), after) in parts.into_iter().zip(edges).zip(after) {
        let mut pixels: [f32; N] =
            std::array::from_fn(|i| if i + 1 < N { edges[i + 1] } else { after });
        for (pixel, edge) in pixels.iter_mut().zip(edges) {
            *pixel -= edge;
        }
        part.as_flattened_mut()[start..start + N].copy_from_slice(&pixels);
    }
}

/// Cumulative light along an axis at evenly spaced places, less one half, in single precision.
#[derive(Debug, Clone, Default)]
pub(crate) struct CumulativeProfile {
    values: Vec<PixelGroup>,
}

impl CumulativeProfile {
    /// Computes `count` values, the first at `first_px` from the centre, each `step_px` farther.
    pub fn fill(&mut self, first_px: f64, step_px: f64, sigma_px: f64, count: usize) {
        let scale = Cumulative::of_spot(sigma_px).scale;
        let groups = count.div_ceil(GROUP_PX);
        if self.values.len() < groups {
            self.values.resize(groups, [0.0; GROUP_PX]);
        }
        let [first, step] = [first_px, step_px].map(|px| (px * scale) as f32);
        fill_cumulative(first, step, &mut self.values[..groups]);
    }

    /// The values, and perhaps more than were asked for.
    pub fn values(&self) -> &[f32] {
        self.values.as_flattened()
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn fill_cumulative(first: f32, step: f32, values: &mut [PixelGroup]) {
    for (group, values) in values.iter_mut().enumerate() {
        let mut at = [0.0; GROUP_PX];
        for (lane, at) in at.iter_mut().enumerate() {
            let number = (group * GROUP_PX + lane) as i32 as f32;
            *at = 0.5 * erf_and_gauss_single(first + step * number).0;
        }
        *values = at;
    }
}

/// Beyond this, erf is ±1 and the exponential 0 to one part in 10¹¹.
const ERF_RANGE: f64 = 5.0;

/// `erf(x)`, with an error below 1.5e-7, and `exp(−x²)`. Without branches, so that loops vectorise.
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
    let gauss = rough_exp_of_negative(-size * size);
    let t = 1.0 / (1.0 + 0.327_591_1 * size);
    let polynomial = t * (A[0] + t * (A[1] + t * (A[2] + t * (A[3] + t * A[4]))));
    ((1.0 - polynomial * gauss).copysign(x), gauss)
}

/// [`erf_and_gauss`] in single precision, with an error below 10⁻⁶.
#[inline(always)]
fn erf_and_gauss_single(x: f32) -> (f32, f32) {
    const A: [f32; 5] = [
        0.254_829_6,
        -0.284_496_72,
        1.421_413_8,
        -1.453_152,
        1.061_405_4,
    ];
    let range = ERF_RANGE as f32;
    let size = if x.abs() < range { x.abs() } else { range };
    let gauss = rough_exp_of_negative_f32(-size * size);
    let t = 1.0 / (1.0 + 0.327_591_1 * size);
    let polynomial = t * (A[0] + t * (A[1] + t * (A[2] + t * (A[3] + t * A[4]))));
    ((1.0 - polynomial * gauss).copysign(x), gauss)
}

/// Profile of a spot centred on a pixel: fractions of the light at distances 0, 1, … `radius`
/// pixels, at most [`MAX_TAPS`] of them.
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
    fn fractions_sum_to_one_and_their_mean_is_the_centre() {
        for sigma in [0.3, 0.5, 1.0, 2.0] {
            let mut profile = AxisProfile::default();
            profile.fill(12.3, sigma, 25);
            let values = || profile.values()[..25].iter().copied().map(f64::from);
            let sum: f64 = values().sum();
            let mean: f64 = values().enumerate().map(|(i, v)| i as f64 * v).sum();
            assert!((sum - 1.0).abs() < 1e-6, "{sum}");
            // The mean of the pixels is off where the spot is undersampled.
            assert!(
                (mean - 12.3).abs() < if sigma < 0.6 { 0.06 } else { 1e-3 },
                "{mean}"
            );
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
