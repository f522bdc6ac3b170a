//! The filtered frame, in bands of rows that stay in cache: it is never whole in memory.

use super::convolution::{VECTOR_PX, normalise, sum_along_columns, sum_along_row};
use super::kernel::Kernel;
use crate::detect::background::{Mesh, Piece, SlopePixels};
use crate::detect::pixels::{AlignedBuffer, LINE, PixelRows, View};
use crate::detect::psf::MAX_TAPS;
use arrayvec::ArrayVec;
use std::ops::Range;

/// Gap between rows, in whole cache lines.
const ROW_GAP_PX: usize = 5 * LINE;

/// A band of rows of the filtered frame, in units of the noise, with its buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct FilteredBand {
    width: usize,
    /// The width rounded up to whole vectors.
    padded_width: usize,
    /// Columns from a row to the next: more than the width, since rows a power of two apart compete
    /// for the same cache lines.
    stride: usize,
    /// Rows of the frame that the band holds.
    rows: Range<usize>,
    values: AlignedBuffer,
    /// A normalised row from `lead` on, padded with zeros over at least the kernel's radius.
    padded_row: AlignedBuffer,
    lead: usize,
    /// Ring buffer of rows filtered along x: row y is in slot y modulo their number, a power of two.
    ring: AlignedBuffer,
    /// The row of the frame after the last one in the ring.
    next_row: usize,
    zeros: AlignedBuffer,
    /// Columns where the border cuts off the kernel, and the factor for each.
    border_factors: Vec<(usize, f32)>,
    pieces: Vec<Piece>,
}

impl FilteredBand {
    /// Prepares the buffers for a frame of `width` columns.
    pub fn prepare(&mut self, width: usize, kernel: &Kernel) {
        let radius = kernel.radius();
        self.rows = 0..0;
        self.width = width;
        self.padded_width = width.next_multiple_of(VECTOR_PX);
        self.stride = self.padded_width + ROW_GAP_PX;
        self.lead = radius.next_multiple_of(LINE);
        for (buffer, size) in [
            (&mut self.padded_row, self.padded_width + 2 * self.lead),
            (&mut self.zeros, self.padded_width),
            (&mut self.ring, slots_for(radius) * self.stride),
        ] {
            buffer.grow(size);
            buffer.fill(0.0);
        }
        let inner = radius.min(width)..width.saturating_sub(radius).max(radius.min(width));
        self.border_factors.clear();
        let outer = (0..inner.start).chain(inner.end..width);
        self.border_factors
            .extend(outer.map(|x| (x, kernel.border_factor(x, width - 1 - x))));
    }

    /// Filters `rows` of `view` with `kernel`, less the background and over the noise in `mesh`.
    ///
    /// Rows that the band already holds are reused where `rows` begin among them.
    pub fn filter(&mut self, view: &View<'_>, mesh: &Mesh, kernel: &Kernel, rows: Range<usize>) {
        let radius = kernel.radius();
        let continues = self.rows.contains(&rows.start) && rows.end >= self.rows.end;
        let held = if continues {
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
        let target = &mut self.padded_row[self.lead..self.lead + self.width];
        normalise(view.row(y), &self.pieces, target);
        let slot = y & (slots_for(radius) - 1);
        let out = &mut self.ring[slot * self.stride..][..self.padded_width];
        sum_along_row(kernel.half(), &self.padded_row[self.lead - radius..], out);
        for &(x, factor) in &self.border_factors {
            out[x] *= factor;
        }
        out[self.width..].fill(0.0);
    }

    /// Filters the ring's rows around row `y` along y, into the band's row.
    fn filter_along_columns(&mut self, kernel: &Kernel, y: usize, height: usize) {
        let radius = kernel.radius();
        let last_slot = slots_for(radius) - 1;
        let row = |at: Option<usize>| match at {
            Some(r) if r < height => {
                let slot = r & last_slot;
                &self.ring[slot * self.stride..][..self.padded_width]
            }
            _ => &self.zeros[..self.padded_width],
        };
        let mut pairs: ArrayVec<[&[f32]; 2], MAX_TAPS> = ArrayVec::new();
        pairs.extend((0..=radius).map(|j| [row(y.checked_sub(j)), row(Some(y + j))]));
        let factor = if y < radius || y + radius >= height {
            kernel.border_factor(y, height - 1 - y)
        } else {
            1.0
        };
        let i = y - self.rows.start;
        let out = &mut self.values[i * self.stride..][..self.padded_width];
        sum_along_columns(kernel.half(), &pairs, factor, out);
    }

    /// Every `step`th of some rows of the filtered frame that the band holds.
    pub fn sampled(&self, rows: Range<usize>, step: usize) -> PixelRows<'_> {
        PixelRows {
            values: &self.values[rows.start.saturating_sub(self.rows.start) * self.stride..],
            stride: step * self.stride,
            width: self.width,
            height: rows.len().div_ceil(step),
        }
    }

    /// Every `step`th of some rows of a frame of `height` rows, which the band holds with their neighbors, for
    /// differences.
    pub fn slope_pixels(&self, rows: &Range<usize>, step: usize, height: usize) -> SlopePixels<'_> {
        let inner = rows.start.max(1)..rows.end.min(height.saturating_sub(1));
        SlopePixels {
            rows: self.sampled(rows.clone(), step),
            above: self.sampled(inner.start - 1..inner.end.saturating_sub(1), step),
            below: self.sampled(inner.start + 1..inner.end + 1, step),
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

/// Rows in the ring for a kernel that reaches so far: a division for each row takes longer than some rows more.
fn slots_for(radius: usize) -> usize {
    (2 * radius + 1).next_power_of_two()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::background::MeshConfig;
    use crate::detect::psf::centered_profile;

    /// A mesh of background 0 and noise 1, from a frame of zeros.
    fn unit_mesh(zeros: &View<'_>) -> Mesh {
        let mut mesh = Mesh::default();
        mesh.measure(zeros, &MeshConfig::of_pixels(64, 1.0));
        mesh
    }

    /// The filtered frame of a single pixel of value 1.
    fn impulse_response(side: usize, x: usize, y: usize, sigma: f64) -> (FilteredBand, Kernel) {
        let mut pixels = vec![0.0f32; side * side];
        let mesh = unit_mesh(&View::new(&pixels, side, side));
        pixels[y * side + x] = 1.0;
        let kernel = Kernel::for_spot(sigma);
        let mut band = FilteredBand::default();
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
    fn a_band_equals_that_part_of_the_whole_frame() {
        let (whole, kernel) = impulse_response(40, 20, 17, 1.3);
        let mut pixels = vec![0.0f32; 1600];
        let mesh = unit_mesh(&View::new(&pixels, 40, 40));
        pixels[17 * 40 + 20] = 1.0;
        let mut band = FilteredBand::default();
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
