//! Dark areas with a sharp edge and few stars.

use super::levels::CellMedians;
use image::{GrayImage, ImageBuffer, Luma};
use imageproc::distance_transform::Norm;
use imageproc::morphology::{dilate, open};
use imageproc::region_labelling::{Connectivity, connected_components};

/// Number of levels at which the picture is cut into dark and bright areas.
const CUTS: usize = 8;
/// Share of the cells at either end of the levels that does not count for the cuts.
const TAIL: f64 = 0.01;
/// Cells at an edge across which the brightness changes.
const EDGE_CELLS: isize = 3;
/// Least change across a sharp edge, over the brightness of the brighter side.
const MIN_CONTRAST: f32 = 0.25;
/// Share of the range of levels, below which the brightness of the brighter side counts as that.
const MIN_FRACTION: f32 = 0.5;
/// Largest density of stars in a hidden area, over that in the rest of the frame.
const MAX_STARS: f64 = 0.2;
/// Least number of stars that a sky of this size should show for their absence to count.
const MIN_EXPECTED_STARS: f64 = 8.0;

/// What a cell of a frame shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CellContent {
    Sky,
    /// Something dark in front of the sky, the border around a lens's circle, or nothing.
    Dark,
    /// A lamp, or the Moon.
    Lit,
}

/// The number of its region for each cell.
type Labels = ImageBuffer<Luma<u32>, Vec<u32>>;

const INSIDE: Luma<u8> = Luma([255]);
const OUTSIDE: Luma<u8> = Luma([0]);

/// A dark area.
#[derive(Debug, Clone, Default)]
struct DarkArea {
    cells: usize,
    stars: u32,
    /// Relative changes of brightness across its edge.
    contrasts: Vec<f32>,
}

/// What each cell shows.
pub(super) fn cells(levels: &CellMedians, stars: &[u32]) -> Vec<CellContent> {
    // Saturated stars are smaller.
    let lit = image_of(levels, |cell| levels.is_saturated(cell));
    let lit = dilate(&open(&lit, Norm::LInf, 1), Norm::LInf, 1);
    let dark = dark(levels, stars);
    let cell = |((level, lit), dark): ((&f32, &Luma<u8>), &Luma<u8>)| {
        if level.is_nan() || *dark == INSIDE {
            CellContent::Dark
        } else if *lit == INSIDE {
            CellContent::Lit
        } else {
            CellContent::Sky
        }
    };
    let sides = levels.adu.iter().zip(lit.pixels()).zip(dark.pixels());
    sides.map(cell).collect()
}

/// The dark areas that do not show the sky.
fn dark(levels: &CellMedians, stars: &[u32]) -> GrayImage {
    let mut hidden = image_of(levels, |_| false);
    let seen = levels.adu.iter().copied().filter(|level| !level.is_nan());
    let mut sorted: Vec<f32> = seen.collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else {
        return hidden;
    };
    let end = |share: f64| sorted[(share * last as f64) as usize];
    let [lowest, highest] = [TAIL, 1.0 - TAIL].map(end);
    let all_stars: u32 = stars.iter().sum();
    for cut in 1..=CUTS {
        // Even steps of the square root, as eyes and noise have them.
        let part = cut as f32 / (CUTS + 1) as f32;
        let cut_adu = lowest + (highest - lowest) * part * part;
        let dark = image_of(levels, |cell| levels.adu[cell] < cut_adu);
        let dark = open(&dark, Norm::LInf, 1);
        let labels = connected_components(&dark, Connectivity::Four, OUTSIDE);
        let regions = measure(levels, stars, &labels, [sorted[0], highest]);
        let is_hidden = |region: &DarkArea| region.is_hidden(levels, all_stars);
        let are_hidden: Vec<bool> = regions.iter().map(is_hidden).collect();
        for (pixel, label) in hidden.pixels_mut().zip(labels.pixels()) {
            if are_hidden[label.0[0] as usize] {
                *pixel = INSIDE;
            }
        }
    }
    hidden
}

fn image_of(levels: &CellMedians, is_inside: impl Fn(usize) -> bool) -> GrayImage {
    let [columns, rows] = [levels.cells.columns, levels.cells.rows].map(|cells| cells as u32);
    GrayImage::from_fn(columns, rows, |x, y| {
        if is_inside((y * columns + x) as usize) {
            INSIDE
        } else {
            OUTSIDE
        }
    })
}

/// The regions by label; number 0 is what lies outside all.
fn measure(
    levels: &CellMedians,
    stars: &[u32],
    labels: &Labels,
    [darkest_adu, highest_adu]: [f32; 2],
) -> Vec<DarkArea> {
    let labels: Vec<usize> = labels.pixels().map(|label| label.0[0] as usize).collect();
    let count = labels.iter().max().map_or(0, |most| most + 1);
    let mut regions = vec![DarkArea::default(); count];
    let inside = labels.iter().enumerate().filter(|(_, label)| **label > 0);
    for (cell, &label) in inside {
        let region = &mut regions[label];
        region.cells += 1;
        region.stars += stars[cell];
        for way in [[1, 0], [-1, 0], [0, 1], [0, -1]] {
            let at = |steps| levels.neighbor(cell, way, steps);
            let is_at_edge = at(1).is_some_and(|next| labels[next] != label);
            if let (true, Some(outer)) = (is_at_edge, at(EDGE_CELLS)) {
                let dark = levels.adu[at(-1).unwrap_or(cell)];
                let bright = levels.adu[outer];
                // What is hardly brighter than the darkest cell has no edge, either.
                let least = MIN_FRACTION * (highest_adu - darkest_adu);
                let scale = (bright - darkest_adu).max(least).max(f32::MIN_POSITIVE);
                region.contrasts.push((bright - dark) / scale);
            }
        }
    }
    regions
}

impl DarkArea {
    /// Whether it does not show the sky: it has a sharp edge, and fewer stars than the rest.
    fn is_hidden(&self, levels: &CellMedians, all_stars: u32) -> bool {
        let others = all_stars - self.stars;
        let other_cells = levels.adu.len() - self.cells;
        let expected = f64::from(others) * self.cells as f64 / other_cells.max(1) as f64;
        let has_few = f64::from(self.stars) <= MAX_STARS * expected;
        let lacks_stars = has_few && (expected >= MIN_EXPECTED_STARS || self.stars == 0);
        let sharp = self
            .contrasts
            .iter()
            .filter(|contrast| **contrast >= MIN_CONTRAST);
        self.cells > 0 && lacks_stars && 2 * sharp.count() > self.contrasts.len()
    }
}
