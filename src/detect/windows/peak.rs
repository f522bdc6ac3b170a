//! The highest peak of the matched filter near a place.

use super::square::Square;
use crate::detect::psf::{MAX_TAPS, centered_profile};
use arrayvec::ArrayVec;
use multiversion::multiversion;

/// Signal-to-noise ratio from which on a peak is no noise: one in three million pixels of noise is
/// above it.
pub(super) const MIN_SNR: f32 = 5.0;

/// Pixels beyond the last row that the lanes may read.
pub(super) const PADDING: usize = LANES;
/// Pixels that are filtered together.
const LANES: usize = 8;

/// A peak of the matched filter.
#[derive(Debug, Clone, Copy)]
pub(super) struct WindowPeak {
    /// Column and row in the square, with their fractions.
    pub at: [f64; 2],
    /// Signal-to-noise ratio.
    pub snr: f32,
    /// Flux, in units of the noise.
    pub flux: f32,
}

/// The peaks within a search radius.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Peaks {
    /// The highest.
    pub highest: Option<WindowPeak>,
    /// Number of further ones.
    pub others: usize,
}

/// The matched filter for spots of one size. Its buffers are reused.
#[derive(Debug, Clone, Default)]
pub(super) struct MatchedFilter {
    /// Weights from −radius to radius; their sum is one.
    taps: ArrayVec<f32, { 2 * MAX_TAPS }>,
    /// √Σ of the squared weights of both axes.
    norm: f32,
    width_px: f64,
    rows: Vec<f32>,
    filtered: Vec<f32>,
}

impl MatchedFilter {
    /// Prepares the filter for spots of this standard deviation, in pixels.
    pub fn set_size(&mut self, spot_px: f64) {
        if self.width_px == spot_px {
            return;
        }
        self.width_px = spot_px;
        let half = centered_profile(spot_px, filter_radius(spot_px));
        let sum = 2.0 * half.iter().sum::<f64>() - half[0];
        let weight = |share: &f64| (share / sum) as f32;
        self.taps.clear();
        self.taps.extend(half.iter().skip(1).rev().map(weight));
        self.taps.extend(half.iter().map(weight));
        self.norm = self.taps.iter().map(|tap| tap * tap).sum();
    }

    /// The peaks within `radius_px` of a place in `square`, which is as large as the radius, that of
    /// the filter, and one pixel. Its pixels are followed by at least [`PADDING`] others.
    pub fn peaks(
        &mut self,
        square: &Square,
        pixels: &[f32],
        place: [f64; 2],
        radius_px: f64,
    ) -> Peaks {
        let reach = radius_px.ceil() as usize + 1;
        let (middle, taps) = (square.side / 2, self.taps.len() / 2);
        let side = 2 * reach + 1;
        let Some(first) = middle.checked_sub(reach + taps) else {
            return Peaks::default();
        };
        let stride = self.filter(square, pixels, first, side);
        let filtered = &self.filtered;
        let corner = middle - reach;
        let per_noise = 1.0 / (square.noise_adu * self.norm);
        let offset = [place[0] - square.x0 as f64, place[1] - square.y0 as f64];
        let mut peaks = Peaks::default();
        for y in 1..side - 1 {
            for x in 1..side - 1 {
                let value = filtered[y * stride + x];
                let snr = value * per_noise;
                if snr < MIN_SNR || !is_peak(filtered, stride, [x, y]) {
                    continue;
                }
                let dx = (corner + x) as f64 - offset[0];
                let dy = (corner + y) as f64 - offset[1];
                if dx * dx + dy * dy > radius_px * radius_px {
                    continue;
                }
                let is_highest = peaks.highest.is_none_or(|other| other.snr < snr);
                peaks.others += usize::from(peaks.highest.is_some());
                if is_highest {
                    let vertex = |step: usize| {
                        let at = y * stride + x;
                        vertex(filtered[at - step], value, filtered[at + step])
                    };
                    peaks.highest = Some(WindowPeak {
                        at: [
                            (corner + x) as f64 + vertex(1),
                            (corner + y) as f64 + vertex(stride),
                        ],
                        snr,
                        flux: snr / self.norm,
                    });
                }
            }
        }
        peaks
    }

    /// Filters the part of the square from `first` on so that `side` columns and rows result, and
    /// some more columns that are not used, to fill the lanes. Returns the number of columns.
    fn filter(&mut self, square: &Square, pixels: &[f32], first: usize, side: usize) -> usize {
        let Self {
            taps,
            rows,
            filtered,
            ..
        } = self;
        let stride = side.next_multiple_of(LANES);
        let start = square.start + first * square.side + first;
        let source = FilterInput {
            pixels: pixels.get(start..).unwrap_or_default(),
            row_px: square.side,
            background_adu: square.background_adu,
        };
        rows.clear();
        rows.resize((side + taps.len() - 1) * stride, 0.0);
        filtered.clear();
        filtered.resize(side * stride, 0.0);
        convolve(taps, &source, stride, rows, filtered);
        stride
    }
}

/// Pixels that are filtered, from the first on.
struct FilterInput<'a> {
    pixels: &'a [f32],
    /// Pixels from a row to the next.
    row_px: usize,
    background_adu: f32,
}

/// Filters along the rows to `rows`, and along the columns to `filtered`, both `stride` wide;
/// pixels without a value count as background.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn convolve(
    taps: &[f32],
    source: &FilterInput,
    stride: usize,
    rows: &mut [f32],
    filtered: &mut [f32],
) {
    for (y, to) in rows.chunks_exact_mut(stride).enumerate() {
        let from = source.pixels.get(y * source.row_px..).unwrap_or_default();
        for (chunk, to) in to.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            let from = from.get(chunk * LANES..).unwrap_or_default();
            let mut sums = [0.0f32; LANES];
            for (tap, pixels) in taps.iter().zip(from.windows(LANES)) {
                for (sum, pixel) in sums.iter_mut().zip(pixels) {
                    let above = pixel - source.background_adu;
                    *sum += tap * if above.is_nan() { 0.0 } else { above };
                }
            }
            *to = sums;
        }
    }
    for (y, to) in filtered.chunks_exact_mut(stride).enumerate() {
        for (chunk, to) in to.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            let mut sums = [0.0f32; LANES];
            for (i, tap) in taps.iter().enumerate() {
                let row = &rows[(y + i) * stride + chunk * LANES..][..LANES];
                for (sum, value) in sums.iter_mut().zip(row) {
                    *sum += tap * value;
                }
            }
            *to = sums;
        }
    }
}

/// Radius of the filter for spots of this standard deviation: beyond it there is 2 % of the light
/// along an axis.
fn filter_radius(spot_px: f64) -> usize {
    ((1.5 * spot_px + 0.5).ceil() as usize).clamp(1, MAX_TAPS - 1)
}

/// Whether a pixel is higher than its eight neighbors; of equal ones the first is.
fn is_peak(filtered: &[f32], stride: usize, [x, y]: [usize; 2]) -> bool {
    let at = y * stride + x;
    let value = filtered[at];
    let before = [at - stride - 1, at - stride, at - stride + 1, at - 1];
    let after = [at + 1, at + stride - 1, at + stride, at + stride + 1];
    before.iter().all(|&other| filtered[other] < value)
        && after.iter().all(|&other| filtered[other] <= value)
}

/// Where the parabola through three values at −1, 0, 1 is highest, within half a pixel.
fn vertex(before: f32, at: f32, after: f32) -> f64 {
    let curvature = before - 2.0 * at + after;
    let vertex = 0.5 * (before - after) / curvature;
    if vertex.is_finite() {
        f64::from(vertex).clamp(-0.5, 0.5)
    } else {
        0.0
    }
}
