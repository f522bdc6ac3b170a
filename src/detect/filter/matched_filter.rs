//! The matched filter: the frame in units of its noise, correlated with the spot.
//!
//! For a faint star in white noise the best statistic is `Σ P_p r_p / √ΣP²`, with `r` the frame above
//! its background over its noise and `P` the spot; it has unit variance. The spot is separable, so
//! each row is filtered once along x and the result along y. At the borders the sum runs over the
//! pixels that exist, and so does ΣP²: the variance stays one. Pixels without a value count as background.
//!
//! The filtered frame is never whole in memory: it is made and looked at in bands of rows that stay in cache.

use crate::detect::background::{Mesh, Piece};
use crate::detect::pixels::{Aligned, LINE, Rows, View};
use crate::detect::psf::{PIXEL_VARIANCE_PX2, centered_profile};
use arrayvec::ArrayVec;
use multiversion::multiversion;
use std::ops::Range;

/// Pixels treated together.
const LANES: usize = 32;
/// Room between rows, in whole lines of the cache.
const ROW_GAP_PX: usize = 5 * LINE;
/// The most weights of one half of a kernel: spots up to σ = 13 px.
pub(crate) const MAX_TAPS: usize = 32;
/// The kernel ends at this many standard deviations: the rest holds under 0.1 % of ΣP².
const KERNEL_EXTENT_SIGMA: f64 = 2.4;

/// A symmetric kernel along one axis, normalised to a sum of squares of one.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kernel {
    /// Weights at distances 0, 1, … pixels.
    half: ArrayVec<f32, MAX_TAPS>,
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

/// A band of rows of the filtered frame, in units of the noise, and the buffers to make it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Band {
    /// The width in whole vectors.
    whole_width: usize,
    /// Columns between rows: more than that, for rows a power of two apart would compete for the same places in the cache.
    stride: usize,
    width: usize,
    /// Rows of the frame that the band holds.
    rows: Range<usize>,
    values: Aligned,
    /// A row less the background and over the noise, from `lead` on; at least the kernel's reach on either side is 0.
    padded: Aligned,
    lead: usize,
    /// Rows filtered along x: that of row y is at y modulo their number.
    ring: Aligned,
    /// The row of the frame after the last one in the ring.
    next_row: usize,
    zeros: Aligned,
    /// Columns whose values are scaled, for the filter is cut off there.
    at_border: Vec<(usize, f32)>,
    pieces: Vec<Piece>,
}

impl Band {
    /// Makes room for bands of a frame of `width` columns.
    pub fn prepare(&mut self, width: usize, kernel: &Kernel) {
        let radius = kernel.radius();
        self.rows = 0..0;
        self.width = width;
        self.whole_width = width.next_multiple_of(LANES);
        self.stride = self.whole_width + ROW_GAP_PX;
        self.lead = radius.next_multiple_of(LINE);
        for (buffer, size) in [
            (&mut self.padded, self.whole_width + 2 * self.lead),
            (&mut self.zeros, self.whole_width),
            (&mut self.ring, (2 * radius + 1) * self.stride),
        ] {
            buffer.grow(size);
            buffer.fill(0.0);
        }
        let inner = radius.min(width)..width.saturating_sub(radius).max(radius.min(width));
        self.at_border.clear();
        let outer = (0..inner.start).chain(inner.end..width);
        self.at_border
            .extend(outer.map(|x| (x, kernel.border_factor(x, width - 1 - x))));
    }

    /// Filters `rows` of `view`, less the background and over the noise in `mesh`, with `kernel`. Where they begin among
    /// those that the band holds, it goes on from these.
    pub fn filter(&mut self, view: &View<'_>, mesh: &Mesh, kernel: &Kernel, rows: Range<usize>) {
        let radius = kernel.radius();
        let goes_on = self.rows.contains(&rows.start) && rows.end >= self.rows.end;
        let held = if goes_on {
            let first = (rows.start - self.rows.start) * self.stride;
            let end = self.rows.len() * self.stride;
            self.values.copy_within(first..end, 0);
            self.rows.end
        } else {
            self.next_row = rows.start.saturating_sub(radius);
            rows.start
        };
        self.rows = rows.clone();
        self.values.grow(rows.len() * self.stride);
        for y in held..rows.end {
            while self.next_row < (y + radius + 1).min(view.height) {
                self.filter_along_row(view, mesh, kernel, self.next_row);
                self.next_row += 1;
            }
            self.filter_along_columns(kernel, y, view.height);
        }
    }

    /// Normalises row `y` and filters it along x, into the ring.
    fn filter_along_row(&mut self, view: &View<'_>, mesh: &Mesh, kernel: &Kernel, y: usize) {
        let radius = kernel.radius();
        mesh.row_pieces(y, &mut self.pieces);
        let target = &mut self.padded[self.lead..self.lead + self.width];
        normalise(view.row(y), &self.pieces, target);
        let slot = y % (2 * radius + 1);
        let out = &mut self.ring[slot * self.stride..][..self.whole_width];
        sum_along_row(&kernel.half, &self.padded[self.lead - radius..], out);
        for &(x, factor) in &self.at_border {
            out[x] *= factor;
        }
        out[self.width..].fill(0.0);
    }

    /// Filters the ring's rows around row `y` along y, into the band.
    fn filter_along_columns(&mut self, kernel: &Kernel, y: usize, height: usize) {
        let radius = kernel.radius();
        let slots = 2 * radius + 1;
        let row = |at: Option<usize>| match at {
            Some(r) if r < height => {
                let slot = r % slots;
                &self.ring[slot * self.stride..][..self.whole_width]
            }
            _ => &self.zeros[..self.whole_width],
        };
        let mut pairs: ArrayVec<[&[f32]; 2], MAX_TAPS> = ArrayVec::new();
        pairs.extend((0..=radius).map(|j| [row(y.checked_sub(j)), row(Some(y + j))]));
        let factor = if y < radius || y + radius >= height {
            kernel.border_factor(y, height - 1 - y)
        } else {
            1.0
        };
        let i = y - self.rows.start;
        let out = &mut self.values[i * self.stride..][..self.whole_width];
        sum_along_columns(&kernel.half, &pairs, factor, out);
    }

    /// Some of the rows of the filtered frame that the band holds.
    pub fn rows(&self, rows: Range<usize>) -> Rows<'_> {
        Rows {
            values: &self.values[rows.start.saturating_sub(self.rows.start) * self.stride..],
            stride: self.stride,
            width: self.width,
            height: rows.len(),
        }
    }

    /// Row `y` of the filtered frame, if the band holds it.
    pub fn row(&self, y: usize) -> Option<&[f32]> {
        self.rows.contains(&y).then(|| {
            let start = (y - self.rows.start) * self.stride;
            &self.values[start..start + self.width]
        })
    }
}

/// `target = (row − level) / spread` along the pieces of a row, 0 where the pixel has no value.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn normalise(row: &[f32], pieces: &[Piece], target: &mut [f32]) {
    for piece in pieces {
        let (row, target) = (
            &row[piece.start..piece.end],
            &mut target[piece.start..piece.end],
        );
        let piece = *piece;
        for (i, (out, &pixel)) in target.iter_mut().zip(row).enumerate() {
            let t = i as i32 as f32;
            let value = (pixel - (piece.level + t * piece.level_slope))
                * (piece.inverse + t * piece.inverse_slope);
            *out = if value.is_nan() { 0.0 } else { value };
        }
    }
}

/// Pixels side by side.
type Lanes = [f32; LANES];

/// Calls `$sum::<N>`, N the number `$count` of weights, where it is a usual one, else `$sum::<MAX_TAPS>`: loops of
/// known length need not be loops.
macro_rules! with_known_length {
    ($count:expr, $sum:ident $arguments:tt, $($length:literal)*) => {
        match $count {
            $($length => $sum::<$length> $arguments,)*
            _ => $sum::<MAX_TAPS> $arguments,
        }
    };
}

/// `out[x] = half[0]·padded[x+r] + Σ half[j]·(padded[x+r−j] + padded[x+r+j])`, r the kernel's reach.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn sum_along_row(half: &[f32], padded: &[f32], out: &mut [f32]) {
    with_known_length!(half.len(), sum_along_row_of(half, padded, out), 2 3 4 5 6 7);
}

#[inline(always)]
fn sum_along_row_of<const N: usize>(half: &[f32], padded: &[f32], out: &mut [f32]) {
    let half = if N < MAX_TAPS { &half[..N] } else { half };
    let radius = half.len() - 1;
    for (block, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
        let near = &padded[block * LANES..][..LANES + 2 * radius];
        let mut sum: Lanes = [0.0; LANES];
        for lane in 0..LANES {
            sum[lane] = half[0] * near[radius + lane];
        }
        for j in 1..=radius {
            let (left, right) = (&near[radius - j..][..LANES], &near[radius + j..][..LANES]);
            for lane in 0..LANES {
                sum[lane] += half[j] * (left[lane] + right[lane]);
            }
        }
        *out = sum;
    }
}

/// `out = factor·(half[0]·pairs[0][0] + Σ half[j]·(pairs[j][0] + pairs[j][1]))`, rows as long as `out`.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn sum_along_columns(half: &[f32], pairs: &[[&[f32]; 2]], factor: f32, out: &mut [f32]) {
    with_known_length!(half.len(), sum_along_columns_of(half, pairs, factor, out), 2 3 4 5 6 7);
}

#[inline(always)]
fn sum_along_columns_of<const N: usize>(
    half: &[f32],
    pairs: &[[&[f32]; 2]],
    factor: f32,
    out: &mut [f32],
) {
    let half = if N < MAX_TAPS { &half[..N] } else { half };
    let out = out.as_chunks_mut::<LANES>().0;
    let chunks = |row| -> &[Lanes] {
        let row: &[f32] = row;
        &row.as_chunks().0[..out.len()]
    };
    let none: [&[Lanes]; 2] = [&[]; 2];
    let rows: [[&[Lanes]; 2]; N] =
        std::array::from_fn(|j| pairs.get(j).map_or(none, |pair| pair.map(chunks)));
    for (part, out) in out.iter_mut().enumerate() {
        let mut sum = rows[0][0][part];
        for value in &mut sum {
            *value *= half[0];
        }
        for j in 1..half.len() {
            let (above, below) = (&rows[j][0][part], &rows[j][1][part]);
            for lane in 0..LANES {
                sum[lane] += half[j] * (above[lane] + below[lane]);
            }
        }
        for value in &mut sum {
            *value *= factor;
        }
        *out = sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::background::MeshConfig;

    /// Level 0 and spread 1, of a frame of zeros.
    fn even_mesh(zeros: &View<'_>) -> Mesh {
        let mut mesh = Mesh::default();
        let config = MeshConfig {
            cell_px: 64,
            spread_of_differences: false,
            spread_floor: 1.0,
            is_normalised: false,
        };
        mesh.measure(zeros, &config);
        mesh
    }

    /// A frame of zeros but for one pixel, on a mesh of level 0 and spread 1.
    fn impulse_response(side: usize, x: usize, y: usize, sigma: f64) -> (Band, Kernel) {
        let mut pixels = vec![0.0f32; side * side];
        let mesh = even_mesh(&View::new(&pixels, side, side));
        pixels[y * side + x] = 1.0;
        let kernel = Kernel::for_spot(sigma);
        let mut band = Band::default();
        band.prepare(side, &kernel);
        band.filter(&View::new(&pixels, side, side), &mesh, &kernel, 0..side);
        (band, kernel)
    }

    #[test]
    fn the_response_to_one_pixel_is_the_spot_with_unit_norm() {
        for sigma in [0.4, 1.0, 3.5] {
            let (filtered, kernel) = impulse_response(40, 20, 17, sigma);
            let at = |x: usize, y: usize| filtered.row(y).unwrap()[x];
            let squares: f64 = (0..40)
                .flat_map(|y| {
                    filtered
                        .row(y)
                        .unwrap()
                        .iter()
                        .map(|v| f64::from(*v).powi(2))
                })
                .sum();
            assert!((squares - 1.0).abs() < 1e-5, "{squares}");
            let profile = centered_profile(sigma, 2);
            let expected = profile[1] * profile[2] / kernel.sum_of_squares.sqrt();
            assert!((f64::from(at(21, 19)) - expected).abs() < 1e-6 || kernel.radius() < 2);
        }
    }

    #[test]
    fn a_band_is_the_same_as_that_part_of_the_whole() {
        let (whole, kernel) = impulse_response(40, 20, 17, 1.3);
        let mut pixels = vec![0.0f32; 1600];
        let mesh = even_mesh(&View::new(&pixels, 40, 40));
        pixels[17 * 40 + 20] = 1.0;
        let mut band = Band::default();
        band.prepare(40, &kernel);
        for rows in [15..20, 0..3, 30..40] {
            band.filter(&View::new(&pixels, 40, 40), &mesh, &kernel, rows.clone());
            for y in rows {
                assert_eq!(band.row(y), whole.row(y));
            }
        }
    }

    #[test]
    fn filtered_noise_keeps_unit_variance_at_borders_and_corners() {
        // The variance at a pixel is the sum over all impulses of their squared response there.
        let side = 12;
        for (x, y) in [(0, 0), (0, 6), (1, 11), (6, 6)] {
            let mut variance = 0.0;
            for i in 0..side * side {
                let (filtered, _) = impulse_response(side, i % side, i / side, 1.3);
                variance += f64::from(filtered.row(y).unwrap()[x]).powi(2);
            }
            assert!((variance - 1.0).abs() < 1e-4, "{variance} at {x},{y}");
        }
    }
}
