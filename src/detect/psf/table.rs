//! The effective PSF in a table: samples along both axes, several in a pixel, between which cubic
//! B-splines interpolate.
//!
//! components → [`PsfTable`] → the light in each pixel of a window, and its derivatives.
//!
//! All pixels of a window are at the same fraction of a pixel from the nearest samples: they share
//! the weights of the splines. The time that a window takes does not depend on how many components the
//! PSF has.
//!
//! # Reference
//! Anderson & King 2000, PASP 112, 1360, doi 10.1086/316632, for a PSF that is tabulated with the
//! pixels' integration in it; Unser, Aldroubi & Eden 1993, IEEE Trans. Signal Process. 41, 821, doi
//! 10.1109/78.193220, for interpolation with B-splines.

use super::gaussian::{
    CumulativeProfile, GROUP_PX, GaussianComponent, PIXEL_VARIANCE_PX2, PixelGroup,
};
use super::lanes::{each_of, plus, times};
use super::taps::{AxisTaps, PixelTaps, TAPS, TableLayout, TapWeights, fill_axes};
use crate::base::size::Size;
use multiversion::multiversion;

/// Light of a component farther from its centre than this, in its standard deviations, is left out.
const REACH_SIGMAS: f64 = 4.5;

/// The fraction of the light in a group of pixels, and its derivatives with respect to x, y and
/// size, per px.
pub(crate) type ShareGroup = [PixelGroup; 4];
/// The first parts of a [`ShareGroup`] that are drawn: the light alone,
pub(crate) const LIGHT: usize = 1;
/// that and its derivatives with respect to x and y,
pub(crate) const LIGHT_BY_PLACE: usize = 3;
/// or all.
pub(crate) const LIGHT_BY_ALL: usize = 4;

/// How sharp components are, and how far they reach.
#[derive(Debug, Clone, Copy)]
pub(super) struct ComponentExtent {
    least_px: f64,
    reach_px: f64,
}

impl Default for ComponentExtent {
    /// Of no components.
    fn default() -> Self {
        Self {
            least_px: f64::INFINITY,
            reach_px: 0.0,
        }
    }
}

impl ComponentExtent {
    /// Adds components.
    pub fn add(&mut self, components: &[GaussianComponent]) {
        for component in components {
            let [dx, dy] = component.offset_px.map(f64::abs);
            let reach_px = dx.max(dy) + REACH_SIGMAS * component.sigma_px + 0.5;
            self.least_px = self.least_px.min(component.sigma_px);
            self.reach_px = self.reach_px.max(reach_px);
        }
    }

    /// The layout that suits the components; `None` where they are too sharp for a table.
    pub fn layout(&self) -> Option<TableLayout> {
        /// Of sharper components, in pixels, the derivative by the size is not known well enough.
        const MIN_COMPONENT_PX: f64 = 0.4;
        let is_sharp = self.least_px < MIN_COMPONENT_PX;
        (!is_sharp).then(|| TableLayout::new(self.least_px, self.reach_px))
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

    /// Tabulates components.
    pub(super) fn fill(&mut self, components: &[GaussianComponent], layout: TableLayout) {
        self.layout = layout;
        // Summed in the order of their places, in which a component has them all together.
        let stride = (layout.samples() + GROUP_PX).next_multiple_of(GROUP_PX);
        let mut samples = vec![0.0; layout.samples() * stride];
        let mut profiles = [SplineProfile::default(), SplineProfile::default()];
        for component in components {
            for (profile, offset_px) in profiles.iter_mut().zip(component.offset_px) {
                profile.fill(layout, offset_px, component.sigma_px);
            }
            let share = component.share as f32;
            add_component_samples(stride, &profiles, share, &mut samples);
        }
        self.coefficients.clear();
        self.coefficients.resize(layout.len(), 0.0);
        sort_by_phase(layout, &samples, stride, &mut self.coefficients);
    }

    /// Draws a spot at (x, y) in a window of this size: that of the table, of the size `spot_px`,
    /// `scale` times as large; of the shares only the first `PARTS`.
    ///
    /// The pixels are not scaled with the spot: the light F in scaled ones is corrected by
    /// `(1 − scale²)/24 ∇²F`, to the second order in their width: to three hundredths of the peak of
    /// sharp spots. Its derivatives are those in scaled pixels, which is enough to find the place
    /// where the light fits.
    pub fn draw<const PARTS: usize>(
        &self,
        place_px: [f64; 2],
        size: Size,
        [spot_px, scale]: [f64; 2],
        buffers: &mut DrawBuffers,
        into: &mut [ShareGroup],
    ) {
        let layout = self.layout;
        // How far the next phases and the next pixels along each axis are in the table, or along x in
        // the lines that are combined from its rows.
        let of_phase = layout.side * layout.stride;
        let across = if scale == 1.0 {
            of_phase
        } else {
            layout.stride
        };
        let steps = [[across, 1], [layout.per_px * of_phase, layout.stride]];
        let sides = size.sides();
        fill_axes(&mut buffers.axes, layout, steps, place_px, scale, sides);
        let window = Drawn {
            centre_px: place_px.map(|at| at as f32),
            per_spot: (1.0 / (scale * spot_px)) as f32,
            of_pixel: (0.5 * PIXEL_VARIANCE_PX2 * (1.0 - scale * scale)) as f32,
            groups: size.width.div_ceil(GROUP_PX),
        };
        if scale == 1.0 {
            draw_rows::<PARTS, false>(self, buffers, &window, into);
        } else {
            draw_rows::<PARTS, true>(self, buffers, &window, into);
        }
    }
}

/// A spot in a window.
#[derive(Debug, Clone, Copy)]
struct Drawn {
    centre_px: [f32; 2],
    /// Inverse of the size of the spot, in px⁻¹.
    per_spot: f32,
    /// Part of ∇²F by which the light is corrected for pixels that are not scaled, in px².
    of_pixel: f32,
    /// Groups in a row of the window.
    groups: usize,
}

/// Buffers of [`PsfTable::draw`].
#[derive(Debug, Clone, Default)]
pub(crate) struct DrawBuffers {
    axes: [AxisTaps; 2],
    /// Phase by phase, samples in a row of the window: the light, and its first and second derivative
    /// along y.
    lines: [Vec<f32>; 3],
}

/// Draws the rows of a window.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn draw_rows<const PARTS: usize, const IS_SCALED: bool>(
    table: &PsfTable,
    DrawBuffers { axes, lines }: &mut DrawBuffers,
    window: &Drawn,
    into: &mut [ShareGroup],
) {
    let [across, down] = &*axes;
    let [first, end] = across.lit;
    if first == end {
        return;
    }
    // The same for all pixels where these are not scaled.
    let of_columns = in_lanes(across.at(first).0);
    for row in down.lit[0]..down.lit[1] {
        if IS_SCALED {
            combine_rows(table, down.at(row), across.samples, lines);
        }
        let dy = row as f32 - window.centre_px[1];
        let into = &mut into[row * window.groups..(row + 1) * window.groups];
        let lit = into.iter_mut().enumerate().take(end.div_ceil(GROUP_PX));
        for (group, into) in lit.skip(first / GROUP_PX) {
            let start = group * GROUP_PX;
            let mut parts = [[0.0; GROUP_PX]; 5];
            if IS_SCALED {
                for pixel in start.max(first)..(start + GROUP_PX).min(end) {
                    let of_pixel = combine_columns(lines, across.by_tap(pixel));
                    for (part, of_pixel) in parts.iter_mut().zip(of_pixel) {
                        part[pixel - start] = of_pixel;
                    }
                }
            } else {
                let columns = (&of_columns, across.at(start).1);
                parts = combine_samples::<PARTS>(&table.coefficients, columns, down.at(row));
            }
            let dx = start as f32 - window.centre_px[0];
            *into = fractions_of::<PARTS, IS_SCALED>(parts, [dx, dy], window);
        }
    }
}

/// The light in a group of pixels, which are at the same fraction of a pixel of the table; its
/// derivatives along x and y, and the second ones.
#[inline(always)]
fn combine_samples<const PARTS: usize>(
    table: &[f32],
    (of_columns, columns): (&[[PixelGroup; TAPS]; 3], [isize; TAPS]),
    (of_rows, rows): PixelTaps<'_>,
) -> [PixelGroup; 5] {
    let mut parts = [[0.0f32; GROUP_PX]; 5];
    let [weights, by_x, by_xx] = of_columns;
    for down in 0..TAPS {
        let [mut value, mut slope, mut curvature] = [[0.0f32; GROUP_PX]; 3];
        for tap in 0..TAPS {
            let start = (GROUP_PX as isize + columns[tap] + rows[down]) as usize;
            let Some(samples) = table.get(start..).and_then(<[f32]>::first_chunk) else {
                continue;
            };
            value = plus(&value, &times(&weights[tap], samples));
            if PARTS > LIGHT {
                slope = plus(&slope, &times(&by_x[tap], samples));
            }
            if PARTS > LIGHT_BY_PLACE {
                curvature = plus(&curvature, &times(&by_xx[tap], samples));
            }
        }
        let [weights, by_y, by_yy] = of_rows;
        parts[0] = plus_times(&parts[0], weights[down], &value);
        if PARTS > LIGHT {
            parts[1] = plus_times(&parts[1], weights[down], &slope);
            parts[2] = plus_times(&parts[2], by_y[down], &value);
        }
        if PARTS > LIGHT_BY_PLACE {
            parts[3] = plus_times(&parts[3], weights[down], &curvature);
            parts[4] = plus_times(&parts[4], by_yy[down], &value);
        }
    }
    parts
}

/// Each weight in all lanes of a group.
#[inline(always)]
fn in_lanes(weights: &[[f32; TAPS]; 3]) -> [[PixelGroup; TAPS]; 3] {
    let mut groups = [[[0.0; GROUP_PX]; TAPS]; 3];
    for (groups, weights) in groups.iter_mut().zip(weights) {
        for (group, weight) in groups.iter_mut().zip(weights) {
            *group = [*weight; GROUP_PX];
        }
    }
    groups
}

/// The sum and `factor` times the values.
#[inline(always)]
fn plus_times(sum: &PixelGroup, factor: f32, values: &PixelGroup) -> PixelGroup {
    each_of(sum, values, |sum, value| sum + factor * value)
}

/// The samples of all phases along x in a row of the window, those in the pixels that are needed: the
/// light and its derivatives along y.
#[inline(always)]
fn combine_rows(
    table: &PsfTable,
    (weights, rows): PixelTaps<'_>,
    [first, end]: [usize; 2],
    lines: &mut [Vec<f32>; 3],
) {
    let TableLayout { per_px, stride, .. } = table.layout;
    // In whole groups, which rows have.
    let first = first / GROUP_PX * GROUP_PX;
    let end = end.next_multiple_of(GROUP_PX);
    let groups = (end - first) / GROUP_PX;
    for line in &mut *lines {
        line.resize(per_px * stride, 0.0);
    }
    let [values, slopes, curvatures] = lines;
    for phase in 0..per_px {
        let start = table.layout.row([phase, 0], 0) + first;
        let mut samples: [&[PixelGroup]; TAPS] = [&[]; TAPS];
        // Loops, as what `map` calls is not compiled for the processor.
        for (samples, row) in samples.iter_mut().zip(rows) {
            let row = &table.coefficients[start.wrapping_add_signed(row)..][..end - first];
            *samples = &row.as_chunks::<GROUP_PX>().0[..groups];
        }
        let of_phase = phase * stride + first..phase * stride + end;
        let values = values[of_phase.clone()].as_chunks_mut::<GROUP_PX>().0;
        let slopes = slopes[of_phase.clone()].as_chunks_mut::<GROUP_PX>().0;
        let curvatures = curvatures[of_phase].as_chunks_mut::<GROUP_PX>().0;
        let sums = values.iter_mut().zip(slopes).zip(curvatures);
        for (group, ((value, slope), curvature)) in sums.enumerate().take(groups) {
            let mut parts = [[0.0f32; GROUP_PX]; 3];
            for tap in 0..TAPS {
                let samples = &samples[tap][group];
                for (part, weights) in parts.iter_mut().zip(weights) {
                    *part = plus_times(part, weights[tap], samples);
                }
            }
            (*value, *slope, *curvature) = (parts[0], parts[1], parts[2]);
        }
    }
}

/// As [`combine_samples`] in one pixel, from the samples of its row.
#[inline(always)]
fn combine_columns(
    [values, slopes, curvatures]: &[Vec<f32>; 3],
    (weights, places): (&[TapWeights; TAPS], [isize; TAPS]),
) -> [f32; 5] {
    // Of one length, so that places are checked once.
    let count = values.len();
    let (slopes, curvatures) = (&slopes[..count], &curvatures[..count]);
    let mut along_x = [0.0f32; 4];
    let [mut slope, mut curvature] = [0.0f32; 2];
    for (weights, place) in weights.iter().zip(places) {
        let place = place as usize;
        let value = values[place];
        for (sum, weight) in along_x.iter_mut().zip(weights) {
            *sum += weight * value;
        }
        slope += weights[0] * slopes[place];
        curvature += weights[0] * curvatures[place];
    }
    let [light, by_x, by_xx, _] = along_x;
    [light, by_x, slope, by_xx, curvature]
}

/// The light, and its derivatives with respect to the spot's place and size, where the first of the
/// pixels is `from_centre` of the spot.
///
/// A spot P without pixels that is scaled by s changes by `s ∂P/∂s = −2P − r·∇P`. Integrated over
/// the pixels, which are not scaled, the light F changes by `−2F − r·∇F − ∇²F/12`, to the second
/// order in the width of the pixels.
#[inline(always)]
fn fractions_of<const PARTS: usize, const IS_SCALED: bool>(
    parts: [PixelGroup; 5],
    from_centre: [f32; 2],
    window: &Drawn,
) -> ShareGroup {
    let [mut value, along_x, along_y, xx, yy] = parts;
    let (per_spot, of_pixel) = (window.per_spot, window.of_pixel);
    let [first, dy] = from_centre;
    if IS_SCALED {
        for lane in 0..GROUP_PX {
            value[lane] += of_pixel * (xx[lane] + yy[lane]);
        }
    }
    let mut shares = [value, [0.0; GROUP_PX], [0.0; GROUP_PX], [0.0; GROUP_PX]];
    for lane in 0..GROUP_PX {
        if PARTS > LIGHT {
            shares[1][lane] = -along_x[lane];
            shares[2][lane] = -along_y[lane];
        }
        if PARTS > LIGHT_BY_PLACE {
            let dx = first + lane as i32 as f32;
            let scaled = 2.0 * value[lane] + dx * along_x[lane] + dy * along_y[lane];
            let of_pixel = (xx[lane] + yy[lane]) * PIXEL_VARIANCE_PX2 as f32;
            shares[3][lane] = -(scaled + of_pixel) * per_spot;
        }
    }
    shares
}

/// Coefficients along one axis of a component.
#[derive(Debug, Clone, Default)]
struct SplineProfile {
    /// Those of the samples with light, and zeros that fill the last group.
    coefficients: Vec<PixelGroup>,
    /// The first of these samples.
    first: usize,
    cumulative: CumulativeProfile,
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

    /// For a component this far from the spot's centre.
    fn fill(&mut self, layout: TableLayout, offset_px: f64, sigma_px: f64) {
        /// Samples on each side that the filter takes.
        const MARGIN: usize = SplineProfile::FILTER.len() / 2;
        let per_px = layout.per_px;
        let step_px = 1.0 / per_px as f64;
        let reach_px = REACH_SIGMAS * sigma_px + 0.5;
        let place_px = offset_px + layout.centre_px();
        let bound = |pixel: f64| pixel.clamp(0.0, layout.side as f64) as usize;
        let [first, end] = [bound(place_px - reach_px), bound(place_px + reach_px + 1.0)];
        self.first = first * per_px;
        let samples = (end - first) * per_px;
        let first_px = first as f64 - MARGIN as f64 * step_px - 0.5 - place_px;
        let places = samples.next_multiple_of(GROUP_PX) + 2 * MARGIN;
        // A pixel has two edges.
        self.cumulative
            .fill(first_px, step_px, sigma_px, places + per_px);
        let groups = samples.div_ceil(GROUP_PX);
        self.coefficients.resize(groups, [0.0; GROUP_PX]);
        let edges = self.cumulative.values();
        filter(edges, per_px, &Self::FILTER, &mut self.coefficients);
        for rest in &mut self.coefficients.as_flattened_mut()[samples..] {
            *rest = 0.0;
        }
    }
}

/// Weighted sums of the light of each pixel and the next ones, from the cumulative light at their
/// edges, which are `per_px` samples apart.
#[allow(
    clippy::needless_range_loop,
    reason = "lanes of several arrays read best as indices"
)]
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn filter(edges: &[f32], per_px: usize, weights: &[f32; 5], into: &mut [PixelGroup]) {
    /// Edges that a group takes.
    const EDGES: usize = GROUP_PX + SplineProfile::FILTER.len() - 1;
    for (group, into) in into.iter_mut().enumerate() {
        let start = group * GROUP_PX;
        let edges_from = |at: usize| edges.get(at..).and_then(<[f32]>::first_chunk::<EDGES>);
        let mut sum = [0.0; GROUP_PX];
        if let (Some(before), Some(after)) = (edges_from(start), edges_from(start + per_px)) {
            for (next, weight) in weights.iter().enumerate() {
                for lane in 0..GROUP_PX {
                    sum[lane] += weight * (after[lane + next] - before[lane + next]);
                }
            }
        }
        *into = sum;
    }
}

/// Adds a component to samples in rows of `stride`.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn add_component_samples(
    stride: usize,
    [across, down]: &[SplineProfile; 2],
    share: f32,
    samples: &mut [f32],
) {
    let rows = samples.chunks_exact_mut(stride).skip(down.first);
    for (row, of_row) in rows.zip(down.coefficients.as_flattened()) {
        let light = share * of_row;
        let groups = row[across.first..].as_chunks_mut::<GROUP_PX>().0;
        for (sum, columns) in groups.iter_mut().zip(&across.coefficients) {
            *sum = plus_times(sum, light, columns);
        }
    }
}

/// Sorts samples in rows of `stride` by the phases of a table.
fn sort_by_phase(layout: TableLayout, samples: &[f32], stride: usize, table: &mut [f32]) {
    match layout.per_px {
        2 => sort_by_phase_of::<2>(layout, samples, stride, table),
        3 => sort_by_phase_of::<3>(layout, samples, stride, table),
        4 => sort_by_phase_of::<4>(layout, samples, stride, table),
        5 => sort_by_phase_of::<5>(layout, samples, stride, table),
        _ => sort_by_phase_of::<{ TableLayout::MAX_PER_PX }>(layout, samples, stride, table),
    }
}

/// [`sort_by_phase`] of `N` samples in a pixel.
fn sort_by_phase_of<const N: usize>(
    layout: TableLayout,
    samples: &[f32],
    stride: usize,
    table: &mut [f32],
) {
    for (down, row) in samples.chunks_exact(stride).enumerate() {
        let pixels = &row.as_chunks::<N>().0[..layout.side];
        for phase in 0..N {
            let start = layout.row([phase, down % N], down / N);
            let into = &mut table[start..start + layout.side];
            for (into, of_pixel) in into.iter_mut().zip(pixels) {
                *into = of_pixel[phase];
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
    /// Sizes of components, and the largest error of the derivative by the size, on which only flags
    /// depend: its series in the width of the pixels has two terms.
    const SIZES: [(f64, f32); 3] = [(0.4, 0.2), (0.65, 0.06), (1.4, 0.03)];

    /// The same where the spot is scaled, and the pixels are not: their width is only in the light.
    const MAX_ERRORS_SCALED: [f32; 4] = [3e-2, 0.2, 0.2, 0.3];

    /// A lopsided spot of components of this size.
    pub fn components(sigma_px: f64) -> Vec<GaussianComponent> {
        let offsets = [[-1.2, 0.1], [0.3, -0.6], [0.5, 0.4]];
        let shares = [0.25, 0.35, 0.4];
        let component = |(offset, share): ([f64; 2], f64)| GaussianComponent {
            offset_px: offset.map(|at| 2.0 * sigma_px * at),
            sigma_px,
            share,
        };
        let mut components: Vec<GaussianComponent> =
            offsets.into_iter().zip(shares).map(component).collect();
        for axis in 0..2 {
            let centre: f64 = components.iter().map(|l| l.share * l.offset_px[axis]).sum();
            components
                .iter_mut()
                .for_each(|l| l.offset_px[axis] -= centre);
        }
        components
    }

    /// The light and its derivatives in a pixel of a window of this side, from the components.
    fn expected(
        components: &[GaussianComponent],
        scale: f64,
        place: [f64; 2],
        side: usize,
        [x, y]: [usize; 2],
    ) -> [f64; 4] {
        let mut profiles = NarrowProfiles::default();
        let mut sums = [0.0; 4];
        for component in components {
            let at = [0, 1].map(|axis| place[axis] + component.offset_px[axis]);
            let part = profiles.fill(at, component.sigma_px, Size::new(side, side));
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
            let [dx, dy] = component.offset_px;
            // By a size of which the scale is one.
            let by_size = (by_x * dx + by_y * dy + by_sigma * component.sigma_px) / scale;
            for (sum, part) in sums.iter_mut().zip([value, by_x, by_y, by_size]) {
                *sum += component.share * part;
            }
        }
        sums
    }

    #[test]
    fn a_table_agrees_with_the_sum_over_the_lobes() {
        for (sigma_px, of_size) in SIZES {
            let [light, by_x, by_y] = MAX_ERRORS;
            assert_agreement(sigma_px, 1.0, [light, by_x, by_y, of_size]);
        }
    }

    #[test]
    fn a_table_of_another_size_agrees_with_the_sum_over_the_lobes() {
        for scale in [0.8, 1.6, 3.0] {
            assert_agreement(0.65, scale, MAX_ERRORS_SCALED);
        }
    }

    /// The table of components of a size agrees with the sum over them, `scale` times as large, up to
    /// these errors over the brightest pixel.
    fn assert_agreement(sigma_px: f64, scale: f64, most: [f32; 4]) {
        const SIDE: usize = 21;
        let components = components(sigma_px);
        let mut table = PsfTable::default();
        table.fill(
            &components,
            TableLayout::new(sigma_px, 4.0 * sigma_px + 7.0 * sigma_px),
        );
        let scaled = |component: &GaussianComponent| GaussianComponent {
            offset_px: component.offset_px.map(|at| scale * at),
            sigma_px: scale * component.sigma_px,
            ..*component
        };
        let components: Vec<GaussianComponent> = components.iter().map(scaled).collect();
        for place in [[10.0, 10.0], [9.63, 10.21], [10.5, 9.5], [2.2, 19.8]] {
            let groups = SIDE.div_ceil(GROUP_PX);
            let mut drawn = vec![[[0.0; GROUP_PX]; 4]; groups * SIDE];
            table.draw::<LIGHT_BY_ALL>(
                place,
                Size::new(SIDE, SIDE),
                [1.0, scale],
                &mut Default::default(),
                &mut drawn,
            );
            let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| [x, y]));
            let exact: Vec<_> = pixels
                .map(|pixel| (pixel, expected(&components, scale, place, SIDE, pixel)))
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
