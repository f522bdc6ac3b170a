//! The matched filter: the frame in units of its noise, correlated with the spot.
//!
//! For a faint star in white noise the best statistic is `Σ P_p r_p / √ΣP²`, with `r` the frame above
//! its background over its noise and `P` the spot; it has unit variance. The spot is separable, so
//! each row is filtered once along x and the result along y, in one pass over the frame. At the
//! borders the sum runs over the pixels that exist, and so does ΣP²: the variance stays one.
//! Pixels without a value count as background.

use super::background::{Mesh, Piece};
use super::psf::{PIXEL_VARIANCE_PX2, centered_profile};
use super::view::View;
use multiversion::multiversion;

/// Pixels treated together; rows are padded to a multiple of it.
const LANES: usize = 32;
/// Width of the blocks whose maxima are kept.
pub(super) const BLOCK_PX: usize = 64;
/// The most weights of one half of a kernel: spots up to σ = 13 px.
const MAX_TAPS: usize = 32;
/// The kernel ends at this many standard deviations: the rest holds under 0.1 % of ΣP².
const KERNEL_EXTENT_SIGMA: f64 = 2.4;

/// A symmetric kernel along one axis, normalised to a sum of squares of one.
#[derive(Debug, Clone, Default)]
pub(super) struct Kernel {
    /// Weights at distances 0, 1, … pixels.
    half: Vec<f32>,
    /// `ΣP²` of the spot in both axes: a star of flux F centred on a pixel of noise n has the
    /// signal-to-noise ratio `F √ΣP² / n`.
    pub sum_of_squares: f64,
    /// Correlation of filtered white noise between neighbours.
    pub rho: f64,
}

impl Kernel {
    /// The kernel for a spot with standard deviation `sigma_px`.
    pub fn for_spot(sigma_px: f64) -> Self {
        let width_px = (sigma_px * sigma_px + PIXEL_VARIANCE_PX2).sqrt();
        let radius = ((KERNEL_EXTENT_SIGMA * width_px).ceil() as usize).clamp(1, MAX_TAPS - 1);
        let profile = centered_profile(sigma_px, radius);
        let at = |i: usize| profile.get(i).copied().unwrap_or(0.0);
        let span = -(radius as isize)..=radius as isize;
        let lagged = |lag: usize| -> f64 {
            span.clone()
                .map(|i| at(i.unsigned_abs()) * at((i + lag as isize).unsigned_abs()))
                .sum()
        };
        let squares = lagged(0);
        Self {
            half: profile
                .iter()
                .map(|p| (p / squares.sqrt()) as f32)
                .collect(),
            sum_of_squares: squares * squares,
            rho: lagged(1) / squares,
        }
    }

    /// Signal-to-noise ratio of a star whose flux equals the noise of a pixel: √ΣP².
    pub fn matched_gain(&self) -> f64 {
        self.sum_of_squares.sqrt()
    }

    /// The weights at distances 0, 1, … pixels.
    pub fn half(&self) -> &[f32] {
        &self.half
    }

    /// Distance from the centre to the last weight, in pixels.
    pub fn radius(&self) -> usize {
        self.half.len() - 1
    }

    /// What the filtered values at distance `edge` from the border must be multiplied by.
    fn border_factor(&self, to_start: usize, to_end: usize) -> f32 {
        let radius = self.radius();
        let side =
            |reach: usize| -> f32 { (1..=reach.min(radius)).map(|i| self.half[i].powi(2)).sum() };
        let inside = self.half[0].powi(2) + side(to_start) + side(to_end);
        1.0 / inside.sqrt()
    }
}

/// The filtered frame, in units of the noise, and the buffers to make it.
#[derive(Debug, Clone, Default)]
pub(super) struct Filtered {
    /// Columns between rows, at least `width`.
    stride: usize,
    width: usize,
    height: usize,
    values: Vec<f32>,
    /// Maxima of blocks of [`BLOCK_PX`] columns, row by row.
    block_maxima: Vec<f32>,
    blocks_per_row: usize,
    padded: Vec<f32>,
    ring: Vec<Vec<f32>>,
    zeros: Vec<f32>,
    pieces: Vec<Piece>,
}

impl Filtered {
    /// Filters `view`, less the background and over the noise in `mesh`, with `kernel`.
    pub fn compute(&mut self, view: &View<'_>, mesh: &Mesh, kernel: &Kernel) {
        self.prepare(view, kernel);
        let radius = kernel.radius();
        for y in 0..view.height + radius {
            if y < view.height {
                self.filter_along_row(view, mesh, kernel, y);
            }
            if y >= radius {
                self.filter_along_columns(kernel, y - radius);
            }
        }
    }

    fn prepare(&mut self, view: &View<'_>, kernel: &Kernel) {
        self.width = view.width;
        self.height = view.height;
        self.stride = view.width.next_multiple_of(LANES);
        self.blocks_per_row = view.width.div_ceil(BLOCK_PX);
        self.values.resize(self.stride * view.height, 0.0);
        self.block_maxima
            .resize(self.blocks_per_row * view.height, 0.0);
        self.padded.clear();
        self.padded.resize(self.stride + 2 * kernel.radius(), 0.0);
        self.zeros.clear();
        self.zeros.resize(self.stride, 0.0);
        self.ring.resize(2 * kernel.radius() + 1, Vec::new());
        for row in &mut self.ring {
            row.clear();
            row.resize(self.stride, 0.0);
        }
    }

    /// Normalises row `y` and filters it along x, into the ring.
    fn filter_along_row(&mut self, view: &View<'_>, mesh: &Mesh, kernel: &Kernel, y: usize) {
        let radius = kernel.radius();
        mesh.row_pieces(y, view.width, &mut self.pieces);
        let row = view.row(y);
        for piece in &self.pieces {
            let target = &mut self.padded[radius + piece.start..radius + piece.end];
            normalise(&row[piece.start..piece.end], piece, target);
        }
        let slots = self.ring.len();
        let out = &mut self.ring[y % slots];
        let padded = &self.padded;
        let shifted = |offset: usize| &padded[offset..offset + self.stride];
        let mut left: [&[f32]; MAX_TAPS] = [&[]; MAX_TAPS];
        let mut right = left;
        for j in 0..=radius {
            left[j] = shifted(radius - j);
            right[j] = shifted(radius + j);
        }
        symmetric_sum(&kernel.half, &left, &right, out);
        let last = view.width - 1;
        let inner = radius.min(view.width)
            ..view
                .width
                .saturating_sub(radius)
                .max(radius.min(view.width));
        for x in (0..inner.start).chain(inner.end..view.width) {
            out[x] *= kernel.border_factor(x, last - x);
        }
    }

    /// Filters the ring's rows around row `y` along y, into the result.
    fn filter_along_columns(&mut self, kernel: &Kernel, y: usize) {
        let radius = kernel.radius();
        let slots = self.ring.len();
        let row = |at: Option<usize>| match at {
            Some(r) if r < self.height => self.ring[r % slots].as_slice(),
            _ => self.zeros.as_slice(),
        };
        let mut above: [&[f32]; MAX_TAPS] = [&[]; MAX_TAPS];
        let mut below = above;
        for j in 0..=radius {
            above[j] = row(y.checked_sub(j));
            below[j] = row(Some(y + j));
        }
        let out = &mut self.values[y * self.stride..(y + 1) * self.stride];
        symmetric_sum(&kernel.half, &above, &below, out);
        if y < radius || y + radius >= self.height {
            let factor = kernel.border_factor(y, self.height - 1 - y);
            out.iter_mut().for_each(|v| *v *= factor);
        }
        let maxima = &mut self.block_maxima[y * self.blocks_per_row..(y + 1) * self.blocks_per_row];
        block_maxima(&out[..self.width], maxima);
    }

    /// The filtered values as an image.
    pub fn view(&self) -> View<'_> {
        View::with_stride(&self.values, self.stride, self.width, self.height)
    }

    /// The maxima of the blocks in row `y`.
    pub fn block_maxima(&self, y: usize) -> &[f32] {
        &self.block_maxima[y * self.blocks_per_row..(y + 1) * self.blocks_per_row]
    }
}

/// `target = (row − level) / spread`, 0 where the pixel has no value.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(super) fn normalise(row: &[f32], piece: &Piece, target: &mut [f32]) {
    let piece = *piece;
    for (i, (out, &pixel)) in target.iter_mut().zip(row).enumerate() {
        let t = i as i32 as f32;
        let value = (pixel - (piece.level + t * piece.level_slope))
            * (piece.inverse + t * piece.inverse_slope);
        *out = if value.is_nan() { 0.0 } else { value };
    }
}

/// `out = half[0]·left[0] + Σ half[j]·(left[j] + right[j])`; all rows as long as `out`.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn symmetric_sum(half: &[f32], left: &[&[f32]], right: &[&[f32]], out: &mut [f32]) {
    for (block, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
        let start = block * LANES;
        let mut sum = [0.0f32; LANES];
        if let Some(center) = left[0][start..].first_chunk::<LANES>() {
            for lane in 0..LANES {
                sum[lane] = half[0] * center[lane];
            }
        }
        for j in 1..half.len() {
            let (Some(a), Some(b)) = (
                left[j][start..].first_chunk::<LANES>(),
                right[j][start..].first_chunk::<LANES>(),
            ) else {
                continue;
            };
            for lane in 0..LANES {
                sum[lane] += half[j] * (a[lane] + b[lane]);
            }
        }
        *out = sum;
    }
}

/// The maximum of each block of [`BLOCK_PX`] values; the last may be shorter. NaN is left out.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(super) fn block_maxima(row: &[f32], maxima: &mut [f32]) {
    const LANES: usize = 16;
    let higher = |a: f32, b: f32| if a > b { a } else { b };
    for (maximum, block) in maxima.iter_mut().zip(row.chunks(BLOCK_PX)) {
        let mut lanes = [f32::MIN; LANES];
        let (chunks, rest) = block.as_chunks::<LANES>();
        for chunk in chunks {
            for lane in 0..LANES {
                lanes[lane] = higher(chunk[lane], lanes[lane]);
            }
        }
        for (lane, &value) in lanes.iter_mut().zip(rest) {
            *lane = higher(value, *lane);
        }
        // By halves: one after the other, each would wait for the one before.
        let mut half = LANES / 2;
        while half > 0 {
            for lane in 0..half {
                lanes[lane] = higher(lanes[lane + half], lanes[lane]);
            }
            half /= 2;
        }
        *maximum = lanes[0];
    }
}

#[cfg(test)]
mod tests {
    use super::super::background::MeshConfig;
    use super::*;

    /// A frame of zeros but for one pixel, on a mesh of level 0 and spread 1.
    fn impulse_response(side: usize, x: usize, y: usize, sigma: f64) -> (Filtered, Kernel) {
        let mut pixels = vec![0.0f32; side * side];
        let mut mesh = Mesh::default();
        let config = MeshConfig {
            cell_px: 64,
            spread_of_differences: false,
            spread_floor: 1.0,
            is_normalised: false,
        };
        mesh.measure(&View::new(&pixels, side, side), &config);
        pixels[y * side + x] = 1.0;
        let kernel = Kernel::for_spot(sigma);
        let mut filtered = Filtered::default();
        filtered.compute(&View::new(&pixels, side, side), &mesh, &kernel);
        (filtered, kernel)
    }

    #[test]
    fn the_response_to_one_pixel_is_the_spot_with_unit_norm() {
        let (filtered, kernel) = impulse_response(40, 20, 17, 1.0);
        let view = filtered.view();
        let squares: f64 = (0..40)
            .flat_map(|y| view.row(y).iter().map(|v| f64::from(*v).powi(2)))
            .sum();
        assert!((squares - 1.0).abs() < 1e-5, "{squares}");
        let profile = centered_profile(1.0, 2);
        let expected = profile[1] * profile[2] / kernel.sum_of_squares.sqrt();
        assert!((f64::from(view.at(21, 19)) - expected).abs() < 1e-6);
        assert_eq!(view.at(20, 17), filtered.block_maxima(17)[0]);
    }

    #[test]
    fn filtered_noise_keeps_unit_variance_at_borders_and_corners() {
        // The variance at a pixel is the sum over all impulses of their squared response there.
        let side = 12;
        for (x, y) in [(0, 0), (0, 6), (1, 11), (6, 6)] {
            let mut variance = 0.0;
            for i in 0..side * side {
                let (filtered, _) = impulse_response(side, i % side, i / side, 1.3);
                variance += f64::from(filtered.view().at(x, y)).powi(2);
            }
            assert!((variance - 1.0).abs() < 1e-4, "{variance} at {x},{y}");
        }
    }
}
