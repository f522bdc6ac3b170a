//! The effective PSF in a table: samples along both axes, several in a pixel, between which cubic
//! B-splines interpolate.
//!
//! [`EffectivePsf`] → [`FieldTables`], a table at each node of a grid over the field → [`PsfTable`]
//! at a star's place, mixed from the four nodes around it → the light in each pixel of a window, and
//! its derivatives.
//!
//! All pixels of a window are at the same fraction of a pixel from the nearest samples: they share
//! the weights of the splines. The time that a window takes does not depend on how many lobes the
//! PSF has.
//!
//! # Reference
//! Anderson & King 2000, PASP 112, 1360, doi 10.1086/316632, for a PSF that is tabulated with the
//! pixels' integration in it; Unser, Aldroubi & Eden 1993, IEEE Trans. Signal Process. 41, 821, doi
//! 10.1109/78.193220, for interpolation with B-splines.

use super::effective_psf::{EffectivePsf, FieldForm, Lobe, LocalPsf};
use super::lanes::each_of;
use super::psf::{CumulativeProfile, GROUP_PX, MAX_WINDOW_PX, PIXEL_VARIANCE_PX2, PixelGroup};
use multiversion::multiversion;
use std::sync::OnceLock;

/// Samples that the spline at a point takes along an axis.
const TAPS: usize = 4;
/// Light of a lobe farther from its centre than this, in its standard deviations, is left out.
const REACH_SIGMAS: f64 = 4.5;

/// The fraction of the light in a group of pixels, and its derivatives with respect to x, y and
/// size, per px.
pub(crate) type ShareGroup = [PixelGroup; 4];

/// How a table is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Layout {
    /// Samples in a pixel along each axis.
    per_px: usize,
    /// Pixels along each side, from one more than the reach of the light on.
    side: usize,
    /// Numbers in a row: the side in whole groups.
    stride: usize,
}

impl Layout {
    /// For lobes of this size that reach this far from the centre, in pixels.
    fn of(sigma_px: f64, reach_px: f64) -> Self {
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
    fn len(&self) -> usize {
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
    layout: Layout,
    /// Coefficients of the splines, phase by phase, each row by row; empty without a table.
    coefficients: Vec<f32>,
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
    fn fill(&mut self, lobes: &[Lobe], layout: Layout) {
        self.layout = layout;
        self.coefficients.clear();
        self.coefficients.resize(layout.len(), 0.0);
        let mut profiles = [SplineProfile::default(), SplineProfile::default()];
        for lobe in lobes {
            for (profile, offset_px) in profiles.iter_mut().zip(lobe.offset_px) {
                profile.fill(layout, offset_px, lobe.sigma_px);
            }
            add_lobe(layout, &profiles, lobe.share as f32, &mut self.coefficients);
        }
    }

    /// Draws a spot at (x, y) in a window of `width` times `height` pixels; `spot_px` is its size.
    /// `lines` is a buffer.
    pub fn draw(
        &self,
        [x_px, y_px]: [f64; 2],
        [width, height]: [usize; 2],
        spot_px: f64,
        (lines, into): (&mut Vec<f32>, &mut [ShareGroup]),
    ) {
        let across = Taps::of(self.layout, x_px, width);
        let down = Taps::of(self.layout, y_px, height);
        let length = line_length(self.layout);
        lines.clear();
        lines.resize(LINES * self.layout.per_px * length, 0.0);
        let window = Drawn {
            centre_px: [x_px as f32, y_px as f32],
            per_spot: (1.0 / spot_px) as f32,
            groups: width.div_ceil(GROUP_PX),
        };
        draw_rows(self, [&across, &down], &window, (lines, into));
    }
}

/// Numbers in a row of samples that are combined from the rows of a table: zeros stand on both
/// sides.
fn line_length(layout: Layout) -> usize {
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
    fn of(layout: Layout, at_px: f64, side: usize) -> Self {
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
    (lines, into): (&mut [f32], &mut [ShareGroup]),
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
            let parts = combine_columns(across, (lines, length), group);
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
fn combine_columns(taps: &Taps, (lines, length): (&[f32], usize), group: usize) -> [PixelGroup; 5] {
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
    fn fill(&mut self, layout: Layout, offset_px: f64, sigma_px: f64) {
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
            .fill([first_px, step_px], sigma_px, places + per_px);
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
fn add_lobe(layout: Layout, profiles: &[SplineProfile; 2], share: f32, table: &mut [f32]) {
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

/// The tables of a PSF over the field of a frame, each computed when it is first needed.
#[derive(Debug)]
pub(crate) struct FieldTables<'a> {
    /// The PSF.
    pub psf: &'a EffectivePsf,
    layout: Layout,
    /// Whether the lobes are too sharp for a table: they are summed instead.
    is_sharp: bool,
    /// Distance of the nodes along x and y, in pixels.
    cell_px: [f64; 2],
    /// Cells along x and y: one fewer than nodes.
    cells: [usize; 2],
    /// Row by row; empty where there are fewer stars, each of which has a table of its own.
    nodes: Vec<OnceLock<PsfTable>>,
}

impl<'a> FieldTables<'a> {
    /// For so many stars in a frame of this width and height.
    pub fn new(psf: &'a EffectivePsf, (width, height): (usize, usize), stars: usize) -> Self {
        let diagonal_px = (width as f64).hypot(height as f64);
        let along = cells_along_diagonal(psf) as f64;
        let cells = [width, height].map(|side| (along * side as f64 / diagonal_px).ceil() as usize);
        let spacing = |side: usize, cells: usize| (side - 1) as f64 / cells.max(1) as f64;
        let mut tables = Self {
            psf,
            layout: Layout::default(),
            is_sharp: false,
            cell_px: [spacing(width, cells[0]), spacing(height, cells[1])],
            cells,
            nodes: Vec::new(),
        };
        let count = (cells[0] + 1) * (cells[1] + 1);
        if count <= stars {
            tables.nodes.resize_with(count, OnceLock::new);
        }
        tables.set_layout();
        tables
    }

    /// Half of the side of the window of a spot of this size, in pixels.
    pub fn window_radius(&self, spot_px: f64) -> usize {
        self.psf.window_radius(spot_px)
    }

    /// The spot at a pixel: its lobes, and their table.
    pub fn at(&self, x_px: f64, y_px: f64, local: &mut LocalPsf) {
        self.psf.at(x_px, y_px, local);
        let LocalPsf { table, lobes, .. } = local;
        if self.is_sharp {
            table.clear();
            return;
        }
        if self.nodes.is_empty() {
            table.fill(lobes, self.layout);
            return;
        }
        table.layout = self.layout;
        let [(column, right), (row, below)] = [(0, x_px), (1, y_px)].map(|(axis, at_px)| {
            let cells = self.cells[axis];
            if cells == 0 {
                return (0, 0.0);
            }
            let place = (at_px / self.cell_px[axis]).clamp(0.0, cells as f64);
            let cell = (place as usize).min(cells - 1);
            (cell, place - cell as f64)
        });
        let columns = [(column, 1.0 - right), (column + 1, right)];
        let rows = [(row, 1.0 - below), (row + 1, below)];
        let parts = rows.map(|(row, of_row)| {
            columns.map(|(column, of_column)| {
                let part = of_row * of_column;
                // Beyond the last node there is none, and no part of it.
                let node = if part > 0.0 {
                    [column, row]
                } else {
                    [columns[0].0, rows[0].0]
                };
                (&self.node(node).coefficients[..], part as f32)
            })
        });
        let [[a, b], [c, d]] = parts;
        table.coefficients.resize(self.layout.len(), 0.0);
        if a.1 == 1.0 {
            table.coefficients.copy_from_slice(a.0);
        } else {
            mix([a, b, c, d], &mut table.coefficients);
        }
    }

    /// The table at a node.
    fn node(&self, [column, row]: [usize; 2]) -> &PsfTable {
        self.nodes[row * (self.cells[0] + 1) + column].get_or_init(|| {
            let mut local = LocalPsf::default();
            self.lobes_at([column, row], &mut local);
            let mut table = PsfTable::default();
            table.fill(&local.lobes, self.layout);
            table
        })
    }

    /// The lobes at a node.
    fn lobes_at(&self, node: [usize; 2], local: &mut LocalPsf) {
        let [x, y] = [0, 1].map(|axis| node[axis] as f64 * self.cell_px[axis]);
        self.psf.at(x, y, local);
    }

    /// Sets the layout that suits the spots at all nodes.
    fn set_layout(&mut self) {
        /// Of sharper lobes, in pixels, the derivative by the size is not known well enough.
        const MIN_LOBE_PX: f64 = 0.4;
        let mut local = LocalPsf::default();
        let (mut least_px, mut reach_px) = (f64::INFINITY, 0.0f64);
        for row in 0..self.cells[1] + 1 {
            for column in 0..self.cells[0] + 1 {
                self.lobes_at([column, row], &mut local);
                for lobe in &local.lobes {
                    let [dx, dy] = lobe.offset_px.map(f64::abs);
                    least_px = least_px.min(lobe.sigma_px);
                    reach_px = reach_px.max(dx.max(dy) + REACH_SIGMAS * lobe.sigma_px + 0.5);
                }
            }
        }
        self.layout = Layout::of(least_px, reach_px);
        self.is_sharp = least_px < MIN_LOBE_PX;
    }
}

/// Cells along the diagonal of a frame: so many that the PSF is linear in each.
fn cells_along_diagonal(psf: &EffectivePsf) -> usize {
    /// Largest change of a moment over a cell: that of the light differs from a linear one by a
    /// part of an eighth of its square.
    const MAX_CHANGE: f64 = 0.07;
    /// The moments change this much faster at the corners than on average from the centre.
    const FASTEST: f64 = 2.0;
    const MAX_CELLS: f64 = 32.0;
    /// Where spots point outward, they turn by a quarter of a right angle in the cells that are a
    /// sixth of the way to the corner.
    const CELLS_OF_RADIAL: f64 = MAX_CELLS;
    let ranges = psf.moments.range.map(|[least, most]| most - least);
    let range = ranges.into_iter().fold(0.0, f64::max);
    let of_moments = (2.0 * FASTEST * range / MAX_CHANGE).ceil();
    let of_form = match psf.form {
        FieldForm::Symmetric | FieldForm::Fixed => 0.0,
        FieldForm::Radial => CELLS_OF_RADIAL,
    };
    of_moments.max(of_form).min(MAX_CELLS) as usize
}

/// The sum of parts of four tables.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn mix(parts: [(&[f32], f32); 4], into: &mut [f32]) {
    let [(a, of_a), (b, of_b), (c, of_c), (d, of_d)] = parts;
    let tables = a.iter().zip(b).zip(c.iter().zip(d));
    for (into, ((a, b), (c, d))) in into.iter_mut().zip(tables) {
        *into = (of_a * a + of_b * b) + (of_c * c + of_d * d);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::effective_psf::{FieldFrame, FieldLobe, FieldMoments};
    use crate::detect::psf::NarrowProfiles;

    /// Largest error of the light, and of its derivatives along an axis, over the light in the
    /// brightest pixel.
    const MAX_ERRORS: [f32; 3] = [2e-3, 2e-2, 2e-2];
    /// Sizes of lobes, and the largest error of the derivative by the size, on which only flags
    /// depend: its series in the width of the pixels has two terms.
    const SIZES: [(f64, f32); 3] = [(0.4, 0.2), (0.65, 0.06), (1.4, 0.03)];

    /// A lopsided spot of lobes of this size.
    fn lobes(sigma_px: f64) -> Vec<Lobe> {
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
            let part = profiles.fill(at, lobe.sigma_px, [side; 2]);
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
                Layout::of(sigma_px, 4.0 * sigma_px + 7.0 * sigma_px),
            );
            for place in [[10.0, 10.0], [9.63, 10.21], [10.5, 9.5], [2.2, 19.8]] {
                let groups = SIDE.div_ceil(GROUP_PX);
                let mut drawn = vec![[[0.0; GROUP_PX]; 4]; groups * SIDE];
                table.draw(place, [SIDE; 2], 1.0, (&mut Vec::new(), &mut drawn));
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

    #[test]
    fn tables_between_nodes_agree_with_the_spot_there() {
        let size = (1200, 900);
        let mut moments = FieldMoments::constant(FieldFrame::of(size), [0.0; 3]);
        // Twice as wide in the corners, and elongated.
        moments.coefficients[0][3] = 0.69;
        moments.coefficients[0][5] = 0.69;
        moments.coefficients[1][3] = 0.4;
        moments.range = [[0.0, 0.69], [0.0, 0.4], [0.0, 0.0]];
        let lobe = |lobe: Lobe| FieldLobe {
            lobe,
            corner_share: lobe.share,
        };
        let psf = EffectivePsf {
            lobes: lobes(0.6).into_iter().map(lobe).collect(),
            form: FieldForm::Fixed,
            typical: [0.0; 3],
            moments,
            spot_px: 1.0,
            radius_px: 6,
        };
        let tables = FieldTables::new(&psf, size, 10_000);
        let alone = FieldTables::new(&psf, size, 1);
        let [mut mixed, mut exact] = [LocalPsf::default(), LocalPsf::default()];
        for [x, y] in [[600.0, 450.0], [1180.0, 20.0], [333.0, 777.0], [0.0, 0.0]] {
            tables.at(x, y, &mut mixed);
            alone.at(x, y, &mut exact);
            let [mixed, exact] = [&mixed, &exact].map(|local| &local.table.coefficients);
            let brightest = exact.iter().copied().fold(0.0, f32::max);
            for (a, b) in mixed.iter().zip(exact) {
                assert!((a - b).abs() < 1e-2 * brightest, "{x} {y}: {a} {b}");
            }
        }
    }
}
