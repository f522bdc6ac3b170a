//! The effective PSF in a table: samples along both axes, several in a pixel, between which cubic
//! B-splines interpolate.
//!
//! lobes → [`PsfTable`] → the light in each pixel of a window, and its derivatives.
//!
//! All pixels of a window are at the same fraction of a pixel from the nearest samples: they share
//! the weights of the splines. The time that a window takes does not depend on how many lobes the
//! PSF has.
//!
//! # Reference
//! Anderson & King 2000, PASP 112, 1360, doi 10.1086/316632, for a PSF that is tabulated with the
//! pixels' integration in it; Unser, Aldroubi & Eden 1993, IEEE Trans. Signal Process. 41, 821, doi
//! 10.1109/78.193220, for interpolation with B-splines.

use super::gaussian::{
    CumulativeProfile, GROUP_PX, Lobe, MAX_WINDOW_PX, PIXEL_VARIANCE_PX2, PixelGroup,
};
use super::lanes::each_of;
use crate::base::size::Size;
use multiversion::multiversion;

/// Samples that the spline at a point takes along an axis.
const TAPS: usize = 4;
/// Light of a lobe farther from its centre than this, in its standard deviations, is left out.
pub(super) const REACH_SIGMAS: f64 = 4.5;

/// The fraction of the light in a group of pixels, and its derivatives with respect to x, y and
/// size, per px.
pub(crate) type ShareGroup = [PixelGroup; 4];

/// How a table is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct TableLayout {
    /// Samples in a pixel along each axis.
    per_px: usize,
    /// Pixels along each side, from one more than the reach of the light on.
    side: usize,
    /// Numbers in a row: the side in whole groups.
    stride: usize,
}

impl TableLayout {
    /// For lobes of this size that reach this far from the centre, in pixels.
    pub fn of(sigma_px: f64, reach_px: f64) -> Self {
        /// Largest distance of the samples over the width of a lobe, pixel included: the error of
        /// the interpolation is then below two thousandths of the lobe's peak.
        const MAX_STEP: f64 = 0.5;
        const MAX_PER_PX: usize = 6;
        let width_px = (sigma_px.powi(2) + PIXEL_VARIANCE_PX2).sqrt();
        let per_px = (1.0 / (MAX_STEP * width_px)).ceil() as usize;
        let radius = (reach_px.ceil() as usize).clamp(1, MAX_WINDOW_PX);
        let side = 2 * radius + 3;
        Self {
            per_px: per_px.clamp(2, MAX_PER_PX),
            side,
            stride: side.next_multiple_of(GROUP_PX),
        }
    }

    /// Where in a table the centre of the spot is, in pixels.
    fn centre_px(&self) -> f64 {
        0.5 * (self.side - 1) as f64
    }

    /// Numbers in a table.
    pub fn len(&self) -> usize {
        self.per_px * self.per_px * self.side * self.stride
    }

    /// Where a row of the samples of a phase begins: those with the same place in their pixels.
    fn row(&self, [across, down]: [usize; 2], row: usize) -> usize {
        ((down * self.per_px + across) * self.side + row) * self.stride
    }
}

/// The PSF at one place.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct PsfTable {
    pub(super) layout: TableLayout,
    /// Coefficients of the splines, phase by phase, each row by row; empty without a table.
    pub(super) coefficients: Vec<f32>,
}

impl PsfTable {
    /// Whether there is no table.
    pub fn is_empty(&self) -> bool {
        self.coefficients.is_empty()
    }

    /// Leaves no table.
    pub fn clear(&mut self) {
        self.coefficients.clear();
    }

    /// Becomes a copy of another table, without a new allocation where it fits.
    pub fn copy_from(&mut self, other: &Self) {
        self.layout = other.layout;
        self.coefficients.clone_from(&other.coefficients);
    }

    /// Tabulates lobes.
    pub(super) fn fill(&mut self, lobes: &[Lobe], layout: TableLayout) {
        self.layout = layout;
        self.coefficients.clear();
        self.coefficients.resize(layout.len(), 0.0);
        let mut profiles = [SplineProfile::default(), SplineProfile::default()];
        for lobe in lobes {
            for (profile, offset_px) in profiles.iter_mut().zip(lobe.offset_px) {
                profile.fill(layout, offset_px, lobe.sigma_px);
            }
            add_lobe_samples(layout, &profiles, lobe.share as f32, &mut self.coefficients);
        }
    }

    /// Draws a spot at (x, y) in a window of this size; `spot_px` is that of the spot.
    /// `lines` is a buffer.
    pub fn draw(
        &self,
        [x_px, y_px]: [f64; 2],
        size: Size,
        spot_px: f64,
        lines: &mut Vec<f32>,
        into: &mut [ShareGroup],
    ) {
        let across = Taps::of(self.layout, x_px, size.width);
        let down = Taps::of(self.layout, y_px, size.height);
        let length = line_length(self.layout);
        lines.clear();
        lines.resize(LINES * self.layout.per_px * length, 0.0);
        let window = Drawn {
            centre_px: [x_px as f32, y_px as f32],
            per_spot: (1.0 / spot_px) as f32,
            groups: size.width.div_ceil(GROUP_PX),
        };
        draw_rows(self, [&across, &down], &window, lines, into);
    }
}

/// Numbers in a row of samples that are combined from the rows of a table: zeros stand on both
/// sides.
fn line_length(layout: TableLayout) -> usize {
    GROUP_PX + layout.stride + GROUP_PX
}

/// Rows for each phase: the light, and its first and second derivative along y.
const LINES: usize = 3;

/// A spot in a window.
#[derive(Debug, Clone, Copy)]
struct Drawn {
    centre_px: [f32; 2],
    /// Inverse of the size of the spot, in px⁻¹.
    per_spot: f32,
    /// Groups in a row of the window.
    groups: usize,
}

/// The samples that the pixels of a window take along an axis.
#[derive(Debug, Clone, Copy)]
struct Taps {
    /// Weights of the samples for the light, and for its first and second derivative with respect
    /// to the pixel's place.
    weights: [[f32; TAPS]; 3],
    /// Phases of the samples.
    phases: [usize; TAPS],
    /// Pixel of the table for the first pixel of the window.
    shifts: [isize; TAPS],
    /// First pixel of the window with light, and the one after the last.
    lit: [usize; 2],
}

impl Taps {
    /// For a spot at `at_px` in a window of `side` pixels.
    fn of(layout: TableLayout, at_px: f64, side: usize) -> Self {
        // Farther away there is no light.
        let far_px = (layout.side + MAX_WINDOW_PX) as f64;
        let per_px = layout.per_px as f64;
        let sample = (layout.centre_px() - at_px.clamp(-far_px, far_px)) * per_px;
        let (base, f) = (sample.floor(), sample - sample.floor());
        let g = 1.0 - f;
        let value = [
            g.powi(3) / 6.0,
            (3.0 * f.powi(3) - 6.0 * f.powi(2) + 4.0) / 6.0,
            (3.0 * g.powi(3) - 6.0 * g.powi(2) + 4.0) / 6.0,
            f.powi(3) / 6.0,
        ];
        let slope = [
            -0.5 * g * g,
            (1.5 * f - 2.0) * f,
            -(1.5 * g - 2.0) * g,
            0.5 * f * f,
        ];
        let curvature = [g, 3.0 * f - 2.0, 3.0 * g - 2.0, f];
        let weights = [(value, 1.0), (slope, per_px), (curvature, per_px * per_px)];
        let per_px = layout.per_px as isize;
        let number = |tap: usize| base as isize - 1 + tap as isize;
        let shifts: [isize; TAPS] = std::array::from_fn(|tap| number(tap).div_euclid(per_px));
        let [lowest, .., highest] = shifts;
        let bound = |pixel: isize| pixel.clamp(0, side as isize) as usize;
        let end = bound(layout.side as isize - highest);
        Self {
            weights: weights.map(|(row, scale)| row.map(|weight| (weight * scale) as f32)),
            phases: std::array::from_fn(|tap| number(tap).rem_euclid(per_px) as usize),
            shifts,
            lit: [bound(-lowest).min(end), end],
        }
    }
}

/// Draws the rows of a window.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn draw_rows(
    table: &PsfTable,
    [across, down]: [&Taps; 2],
    window: &Drawn,
    lines: &mut [f32],
    into: &mut [ShareGroup],
) {
    let layout = table.layout;
    let length = line_length(layout);
    let [first, end] = across.lit;
    if first == end {
        return;
    }
    let groups = first / GROUP_PX..end.div_ceil(GROUP_PX);
    for row in down.lit[0]..down.lit[1] {
        for (phase, lines) in lines.chunks_exact_mut(LINES * length).enumerate() {
            let sources: [&[f32]; TAPS] = std::array::from_fn(|tap| {
                let of_table = row.wrapping_add_signed(down.shifts[tap]);
                let start = layout.row([phase, down.phases[tap]], of_table);
                &table.coefficients[start..start + layout.stride]
            });
            combine_rows(sources, &down.weights, lines);
        }
        let dy = row as f32 - window.centre_px[1];
        let into = &mut into[row * window.groups..(row + 1) * window.groups];
        for group in groups.clone() {
            let dx = (group * GROUP_PX) as f32 - window.centre_px[0];
            let parts = combine_columns(across, lines, length, group);
            into[group] = shares_of(parts, [dx, dy], window.per_spot);
        }
    }
}

/// The samples of one phase along x in a row of the window: the light and its derivatives along y.
#[inline(always)]
fn combine_rows(sources: [&[f32]; TAPS], weights: &[[f32; TAPS]; 3], lines: &mut [f32]) {
    let sources = sources.map(|source| source.as_chunks::<GROUP_PX>().0);
    let [of_value, of_slope, of_curvature] = *weights;
    let length = lines.len() / LINES / GROUP_PX;
    let lines = lines.as_chunks_mut::<GROUP_PX>().0;
    for group in 0..sources[0].len() {
        // Copied so that the compiler need not assume aliasing.
        let samples: [PixelGroup; TAPS] = std::array::from_fn(|tap| sources[tap][group]);
        let [mut value, mut slope, mut curvature] = [[0.0f32; GROUP_PX]; LINES];
        for tap in 0..TAPS {
            for lane in 0..GROUP_PX {
                value[lane] += of_value[tap] * samples[tap][lane];
                slope[lane] += of_slope[tap] * samples[tap][lane];
                curvature[lane] += of_curvature[tap] * samples[tap][lane];
            }
        }
        lines[1 + group] = value;
        lines[1 + group + length] = slope;
        lines[1 + group + 2 * length] = curvature;
    }
}

/// The light in a group of pixels; its derivatives along x and y, and the second ones.
#[inline(always)]
fn combine_columns(taps: &Taps, lines: &[f32], length: usize, group: usize) -> [PixelGroup; 5] {
    let mut parts = [[0.0f32; GROUP_PX]; 5];
    for tap in 0..TAPS {
        let start = (2 * GROUP_PX + group * GROUP_PX).wrapping_add_signed(taps.shifts[tap]);
        let start = start - GROUP_PX + LINES * length * taps.phases[tap];
        let line = |number: usize| {
            let line = lines[start + number * length..].first_chunk::<GROUP_PX>();
            line.copied().unwrap_or_default()
        };
        let [value, slope, curvature] = [line(0), line(1), line(2)];
        let [weight, by_x, by_xx] = taps.weights.map(|weights| weights[tap]);
        for lane in 0..GROUP_PX {
            parts[0][lane] += weight * value[lane];
            parts[1][lane] += by_x * value[lane];
            parts[2][lane] += weight * slope[lane];
            parts[3][lane] += by_xx * value[lane];
            parts[4][lane] += weight * curvature[lane];
        }
    }
    parts
}

/// The light, and its derivatives with respect to the spot's place and size, where the first of the
/// pixels is `from_centre` of the spot.
///
/// A spot P without pixels that is scaled by s changes by `s ∂P/∂s = −2P − r·∇P`. Integrated over
/// the pixels, which are not scaled, the light F changes by `−2F − r·∇F − ∇²F/12`, to the second
/// order in the width of the pixels.
#[inline(always)]
fn shares_of(parts: [PixelGroup; 5], from_centre: [f32; 2], per_spot: f32) -> ShareGroup {
    let [value, along_x, along_y, xx, yy] = parts;
    let [first, dy] = from_centre;
    let mut shares = [value, [0.0; GROUP_PX], [0.0; GROUP_PX], [0.0; GROUP_PX]];
    for lane in 0..GROUP_PX {
        let dx = first + lane as i32 as f32;
        let scaled = 2.0 * value[lane] + dx * along_x[lane] + dy * along_y[lane];
        let of_pixel = (xx[lane] + yy[lane]) * PIXEL_VARIANCE_PX2 as f32;
        shares[1][lane] = -along_x[lane];
        shares[2][lane] = -along_y[lane];
        shares[3][lane] = -(scaled + of_pixel) * per_spot;
    }
    shares
}

/// Coefficients along one axis of a lobe.
#[derive(Debug, Clone, Default)]
struct SplineProfile {
    /// Phase by phase, each in whole groups of pixels.
    coefficients: Vec<f32>,
    /// First pixel with light, and the one after the last.
    lit: [usize; 2],
    cumulative: CumulativeProfile,
    light: Vec<f32>,
}

impl SplineProfile {
    /// Coefficients from samples: those of the spline through them, to the sixth order in the
    /// distance of the samples.
    const FILTER: [f32; 5] = [
        1.0 / 36.0,
        -10.0 / 36.0,
        54.0 / 36.0,
        -10.0 / 36.0,
        1.0 / 36.0,
    ];

    /// For a lobe this far from the spot's centre.
    fn fill(&mut self, layout: TableLayout, offset_px: f64, sigma_px: f64) {
        /// Samples on each side that the filter takes.
        const MARGIN: usize = SplineProfile::FILTER.len() / 2;
        let per_px = layout.per_px;
        let step_px = 1.0 / per_px as f64;
        let reach_px = REACH_SIGMAS * sigma_px + 0.5;
        let place_px = offset_px + layout.centre_px();
        let bound = |pixel: f64| pixel.clamp(0.0, layout.side as f64) as usize;
        self.lit = [bound(place_px - reach_px), bound(place_px + reach_px + 1.0)];
        let [first, end] = self.lit;
        let samples = (end - first) * per_px;
        let first_px = first as f64 - MARGIN as f64 * step_px - 0.5 - place_px;
        let places = samples + 2 * MARGIN;
        // A pixel has two edges.
        self.cumulative
            .fill(first_px, step_px, sigma_px, places + per_px);
        self.light.resize(places, 0.0);
        self.coefficients.clear();
        self.coefficients.resize(per_px * layout.stride, 0.0);
        let edges = self.cumulative.values();
        for (number, light) in self.light.iter_mut().enumerate() {
            *light = edges[number + per_px] - edges[number];
        }
        for (number, light) in self.light.windows(2 * MARGIN + 1).take(samples).enumerate() {
            let [a, b, c, d, e] = std::array::from_fn(|tap| Self::FILTER[tap] * light[tap]);
            let (pixel, phase) = (first + number / per_px, number % per_px);
            self.coefficients[phase * layout.stride + pixel] = a + b + c + d + e;
        }
    }
}

/// Adds a lobe to a table.
#[allow(
    clippy::needless_range_loop,
    reason = "rows of several arrays read best as indices"
)]
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn add_lobe_samples(
    layout: TableLayout,
    profiles: &[SplineProfile; 2],
    share: f32,
    table: &mut [f32],
) {
    let [across, down] = profiles;
    let first = across.lit[0] / GROUP_PX * GROUP_PX;
    let end = across.lit[1].next_multiple_of(GROUP_PX);
    for down_phase in 0..layout.per_px {
        let of_rows = &down.coefficients[down_phase * layout.stride..];
        for (phase, columns) in across.coefficients.chunks_exact(layout.stride).enumerate() {
            let columns = columns[first..end].as_chunks::<GROUP_PX>().0;
            for row in down.lit[0]..down.lit[1] {
                let light = share * of_rows[row];
                let start = layout.row([phase, down_phase], row);
                let into = &mut table[start + first..start + end];
                for (into, columns) in into.as_chunks_mut::<GROUP_PX>().0.iter_mut().zip(columns) {
                    *into = each_of(into, columns, |sum, column| sum + light * column);
                }
            }
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::detect::psf::NarrowProfiles;

    /// Largest error of the light, and of its derivatives along an axis, over the light in the
    /// brightest pixel.
    const MAX_ERRORS: [f32; 3] = [2e-3, 2e-2, 2e-2];
    /// Sizes of lobes, and the largest error of the derivative by the size, on which only flags
    /// depend: its series in the width of the pixels has two terms.
    const SIZES: [(f64, f32); 3] = [(0.4, 0.2), (0.65, 0.06), (1.4, 0.03)];

    /// A lopsided spot of lobes of this size.
    pub fn lobes(sigma_px: f64) -> Vec<Lobe> {
        let offsets = [[-1.2, 0.1], [0.3, -0.6], [0.5, 0.4]];
        let shares = [0.25, 0.35, 0.4];
        let lobe = |(offset, share): ([f64; 2], f64)| Lobe {
            offset_px: offset.map(|at| 2.0 * sigma_px * at),
            sigma_px,
            share,
        };
        let mut lobes: Vec<Lobe> = offsets.into_iter().zip(shares).map(lobe).collect();
        for axis in 0..2 {
            let centre: f64 = lobes.iter().map(|l| l.share * l.offset_px[axis]).sum();
            lobes.iter_mut().for_each(|l| l.offset_px[axis] -= centre);
        }
        lobes
    }

    /// The light and its derivatives in a pixel of a window of this side, from the lobes.
    fn expected(lobes: &[Lobe], place: [f64; 2], side: usize, [x, y]: [usize; 2]) -> [f64; 4] {
        let mut profiles = NarrowProfiles::default();
        let mut sums = [0.0; 4];
        for lobe in lobes {
            let at = [0, 1].map(|axis| place[axis] + lobe.offset_px[axis]);
            let part = profiles.fill(at, lobe.sigma_px, Size::new(side, side));
            let group = x / GROUP_PX;
            let is_lit = (part.rows[0]..part.rows[1]).contains(&y)
                && (part.groups[0]..part.groups[1]).contains(&group);
            if !is_lit {
                continue;
            }
            let across = profiles.across(group, &part).lane(x % GROUP_PX);
            let down = profiles.down(y, &part);
            let [value, by_x, by_y, by_sigma] = [
                across.value * down.value,
                across.by_center * down.value,
                across.value * down.by_center,
                across.by_sigma * down.value + across.value * down.by_sigma,
            ]
            .map(f64::from);
            let [dx, dy] = lobe.offset_px;
            let by_size = by_x * dx + by_y * dy + by_sigma * lobe.sigma_px;
            for (sum, part) in sums.iter_mut().zip([value, by_x, by_y, by_size]) {
                *sum += lobe.share * part;
            }
        }
        sums
    }

    #[test]
    fn a_table_agrees_with_the_sum_over_the_lobes() {
        const SIDE: usize = 21;
        for (sigma_px, of_size) in SIZES {
            let [light, by_x, by_y] = MAX_ERRORS;
            let most = [light, by_x, by_y, of_size];
            let lobes = lobes(sigma_px);
            let mut table = PsfTable::default();
            table.fill(
                &lobes,
                TableLayout::of(sigma_px, 4.0 * sigma_px + 7.0 * sigma_px),
            );
            for place in [[10.0, 10.0], [9.63, 10.21], [10.5, 9.5], [2.2, 19.8]] {
                let groups = SIDE.div_ceil(GROUP_PX);
                let mut drawn = vec![[[0.0; GROUP_PX]; 4]; groups * SIDE];
                table.draw(
                    place,
                    Size::new(SIDE, SIDE),
                    1.0,
                    &mut Vec::new(),
                    &mut drawn,
                );
                let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| [x, y]));
                let exact: Vec<_> = pixels
                    .map(|pixel| (pixel, expected(&lobes, place, SIDE, pixel)))
                    .collect();
                let brightest = exact.iter().fold(0.0f64, |most, (_, e)| most.max(e[0]));
                for ([x, y], exact) in exact {
                    let found = drawn[y * groups + x / GROUP_PX].map(|part| part[x % GROUP_PX]);
                    for ((found, exact), most) in found.iter().zip(exact).zip(most) {
                        let error = (found - exact as f32).abs() / brightest as f32;
                        assert!(
                            error < most,
                            "{sigma_px} {place:?} {x} {y}: {error} of {most}"
                        );
                    }
                }
            }
        }
    }
}
