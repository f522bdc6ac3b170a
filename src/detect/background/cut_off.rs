//! Noise that is cut off: a dark sky with a black level so high that many pixels have the lowest
//! value of the frame.
//!
//! There the mean and the scatter of the pixels say little, and clipping at ±3σ nothing at all:
//! once most pixels are equal, all others are outliers. But the share of pixels at the lowest
//! value and a quantile of the others determine the Gaussian noise that was cut off. Background
//! and noise of the mesh are first those of that Gaussian, which change smoothly over the frame;
//! once smoothed, they become the mean and the standard deviation of what is left of it.
//!
//! # Reference
//! Cohen 1959, "Simplified estimators for the normal distribution when samples are singly censored
//! or truncated", Technometrics 1, 217, doi 10.2307/1266443, for the problem; quantiles are used
//! here instead of moments since stars change these little.

use super::censored_noise::CensoredNoise;
use super::grid::CellGrid;
use super::mesh::Mesh;
use crate::base::statistics::{median, normal_quantile};
use crate::detect::pixels::{Samples, View};
use multiversion::multiversion;
use std::ops::Range;

/// Noise whose background is more than this many standard deviations above the lowest value is not
/// cut off.
pub(crate) const REACH_SIGMA: f32 = 2.5;
/// Of noise that is cut off, at least this part of the pixels has the lowest value: noise that is
/// not is so low, relative to its background, in under one pixel of a hundred.
const MIN_AT_LOWEST: f64 = 0.02;
/// Where more pixels than this part have the lowest value, those next to lit ones are left out.
const MOSTLY_LOWEST: f64 = 0.5;
/// Distance of the two pixels beside one that must have the lowest value, in columns: most of a
/// star's pixels have light there, and noise is hardly correlated so far.
const ASIDE_PX: usize = 2;
/// The quantile that gives the noise: this part of the pixels that are not at the lowest value is
/// below it. The pixels of stars are above.
const QUANTILE_OF_REST: f64 = 0.6;
/// Fewer pixels above the lowest value than this do not determine the noise.
const MIN_ABOVE: usize = 20;

/// Where the noise of a frame is cut off, and how far.
#[derive(Debug, Clone, Default)]
pub(crate) struct CutOff {
    /// For each cell how far the cut is above the background beneath, in standard deviations of
    /// the noise; negative infinity where nothing is cut off. Empty where no cell is cut off.
    pub depth: Vec<f32>,
    /// The step between the lowest two values, over the noise that was cut off.
    pub step_sigma: f64,
    /// The level below which pixels got the lowest value, in ADU.
    edge_adu: f32,
    /// The lowest value, in ADU.
    lowest_adu: f32,
    cells: Vec<Option<CutCell>>,
    above: Vec<f32>,
    row: Vec<f32>,
    sorted: Vec<f32>,
}

/// What the pixels of a cell tell about noise that is cut off.
#[derive(Debug, Clone, Copy)]
enum CutCell {
    /// Nearly all pixels have the lowest value.
    Dark,
    /// The Gaussian beneath is known.
    Known {
        /// How far the cut is above the background, in standard deviations.
        depth: f32,
        sigma: f32,
        /// The level of the cut, in ADU.
        edge: f32,
    },
}

impl CutOff {
    /// Whether any cell is cut off.
    pub fn is_any(&self) -> bool {
        !self.depth.is_empty()
    }

    /// Finds the cells that are cut off at `lowest_adu`, and sets background and noise of these, in
    /// a mesh that is not smoothed yet, to those of the Gaussian beneath. Noise below `coarse_adu`
    /// is left as it is: a few steps do not determine a Gaussian.
    pub fn find(&mut self, view: &View<'_>, mesh: &mut Mesh, lowest_adu: f32, coarse_adu: f32) {
        let grid = mesh.grid;
        self.depth.clear();
        self.lowest_adu = lowest_adu;
        self.cells.clear();
        for (cell, (&background, &sigma)) in mesh.background.iter().zip(&mesh.sigma).enumerate() {
            let reaches = background - lowest_adu < REACH_SIGMA * sigma.max(coarse_adu);
            let cut = if reaches {
                let Self { above, row, .. } = &mut *self;
                measure_cell(view, &grid, cell, lowest_adu, above, row)
            } else {
                None
            };
            self.cells.push(cut);
        }
        let known = || {
            self.cells.iter().filter_map(|cell| match cell {
                Some(CutCell::Known { sigma, edge, .. }) => Some((*sigma, *edge)),
                _ => None,
            })
        };
        let mut median_of = |values: &mut dyn Iterator<Item = f32>| {
            self.sorted.clear();
            self.sorted.extend(values);
            (!self.sorted.is_empty()).then(|| median(&mut self.sorted))
        };
        let sigma = median_of(&mut known().map(|(sigma, _)| sigma));
        let edge = median_of(&mut known().map(|(_, edge)| edge));
        let (Some(sigma), Some(edge)) = (sigma, edge) else {
            return;
        };
        if sigma < coarse_adu {
            return;
        }
        self.edge_adu = edge;
        self.step_sigma = f64::from(2.0 * (edge - lowest_adu) / sigma);
        self.depth.resize(self.cells.len(), f32::NEG_INFINITY);
        for (cell, cut) in self.cells.iter().enumerate() {
            (mesh.background[cell], mesh.sigma[cell]) = match *cut {
                None => continue,
                // Will get the mean of the neighbors.
                Some(CutCell::Dark) => (f32::NAN, f32::NAN),
                Some(CutCell::Known {
                    depth, sigma, edge, ..
                }) => (edge - depth * sigma, sigma),
            };
        }
    }

    /// Sets background and noise of a smoothed mesh to those of what is left where the noise is cut
    /// off.
    pub fn apply(&mut self, mesh: &mut Mesh) {
        if !self.is_any() {
            return;
        }
        for (cell, depth) in self.depth.iter_mut().enumerate() {
            let sigma = mesh.sigma[cell];
            // The share of the lowest value is known better than the noise of a single cell.
            let at = match self.cells[cell] {
                Some(CutCell::Dark) => f32::INFINITY,
                Some(CutCell::Known { depth, .. }) => depth,
                None => (self.edge_adu - mesh.background[cell]) / sigma,
            };
            if at < -REACH_SIGMA {
                continue;
            }
            let left = CensoredNoise::new(f64::from(at), self.step_sigma);
            *depth = left.depth as f32;
            mesh.background[cell] = self.lowest_adu + sigma * left.mean as f32;
            mesh.sigma[cell] = sigma * left.sigma as f32;
        }
        mesh.set_pieces();
    }
}

/// What the pixels of a cell tell about noise that is cut off at `lowest`; `None` where it is not.
fn measure_cell(
    view: &View<'_>,
    grid: &CellGrid,
    cell: usize,
    lowest: f32,
    above: &mut Vec<f32>,
    buffer: &mut Vec<f32>,
) -> Option<CutCell> {
    let rows = grid.rows_of(cell / grid.columns);
    let columns = grid.columns_of(cell % grid.columns);
    let (mut total, mut at_lowest) = (0, 0);
    for y in rows.clone() {
        let row = view.row(y).span(columns.clone()).as_floats(buffer);
        let [known, lowest] = count_in_row(row, lowest);
        total += known;
        at_lowest += lowest;
    }
    if total == 0 || (at_lowest as f64) < MIN_AT_LOWEST * total as f64 {
        return None;
    }
    let is_sparse = at_lowest as f64 > MOSTLY_LOWEST * total as f64;
    let is_inside = columns.start >= ASIDE_PX && columns.end + ASIDE_PX <= view.width;
    if is_inside && !is_sparse {
        let levels = Levels::of_bytes(view, rows.clone(), columns.clone());
        if let Some(levels) = levels {
            return levels.cut_cell(lowest, total);
        }
    }
    let columns = columns.start.max(ASIDE_PX)..columns.end.min(view.width - ASIDE_PX);
    let with_aside = columns.start - ASIDE_PX..columns.end + ASIDE_PX;
    above.clear();
    above.resize(rows.len() * columns.len() + 1, 0.0);
    let mut count = 0;
    total = 0;
    for y in rows {
        let row = view.row(y).span(with_aside.clone()).as_floats(buffer);
        let after = |px: usize| row.get(px..).unwrap_or_default();
        let pixels = row.iter().zip(after(ASIDE_PX)).zip(after(2 * ASIDE_PX));
        // Without branches, which nobody can predict in noise.
        for ((left, value), right) in pixels {
            let is_beside_light = is_sparse & ((*left > lowest) | (*right > lowest));
            let is_counted = !value.is_nan() & !is_beside_light;
            total += usize::from(is_counted);
            above[count] = *value;
            count += usize::from(is_counted & (*value > lowest));
        }
    }
    above.truncate(count);
    at_lowest = total - count;
    if above.len() < MIN_ABOVE || at_lowest == 0 {
        return (above.len() < MIN_ABOVE).then_some(CutCell::Dark);
    }
    let rest = Rest::of(above)?;
    gaussian_beneath(lowest, at_lowest, total, &rest)
}

/// How many pixels of a row have a value, and how many the lowest.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn count_in_row(row: &[f32], lowest: f32) -> [usize; 2] {
    let [mut known, mut at_lowest] = [0u32; 2];
    for value in row {
        known += u32::from(!value.is_nan());
        at_lowest += u32::from(*value == lowest);
    }
    [known, at_lowest].map(|count| count as usize)
}

/// The pixels above the lowest value.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rest {
    /// The lowest of them.
    next: f32,
    /// A quantile of them.
    level: f32,
    /// How many are at most that.
    up_to: usize,
    /// The lowest above that; infinite where there is none.
    beyond: f32,
}

impl Rest {
    /// That of these pixels; `None` where there are none.
    fn of(above: &mut [f32]) -> Option<Self> {
        let next = above.iter().copied().fold(f32::INFINITY, f32::min);
        let middle = (QUANTILE_OF_REST * above.len() as f64) as usize;
        if middle >= above.len() {
            return None;
        }
        let level = *above.select_nth_unstable_by(middle, f32::total_cmp).1;
        let higher = above.iter().copied().filter(|&v| v > level);
        Some(Self {
            next,
            level,
            up_to: above.iter().filter(|&&v| v <= level).count(),
            beyond: higher.fold(f32::INFINITY, f32::min),
        })
    }
}

/// How many pixels have each level, where they are bytes: counting takes a fraction of the time of sorting.
struct Levels([u32; 256]);

impl Levels {
    /// Those of some rows and columns; `None` where they are no bytes.
    fn of_bytes(view: &View<'_>, rows: Range<usize>, columns: Range<usize>) -> Option<Self> {
        let mut counts = [0; 256];
        for y in rows {
            let Samples::U8(row) = view.row(y).span(columns.clone()) else {
                return None;
            };
            for &level in row {
                counts[usize::from(level)] += 1;
            }
        }
        Some(Self(counts))
    }

    /// What [`measure_cell`] finds in them: `total` pixels, whose lowest level is `lowest`.
    fn cut_cell(&self, lowest: f32, total: usize) -> Option<CutCell> {
        let above = || {
            let levels = self.0.iter().enumerate();
            let levels = levels.map(|(level, count)| (level as f32, *count as usize));
            levels.filter(move |(level, count)| *level > lowest && *count > 0)
        };
        let count: usize = above().map(|(_, count)| count).sum();
        let at_lowest = total - count;
        if count < MIN_ABOVE || at_lowest == 0 {
            return (count < MIN_ABOVE).then_some(CutCell::Dark);
        }
        let middle = (QUANTILE_OF_REST * count as f64) as usize;
        let mut up_to = 0;
        let (level, _) = above().find(|(_, count)| {
            up_to += count;
            up_to > middle
        })?;
        let rest = Rest {
            next: above().next()?.0,
            level,
            up_to,
            beyond: above()
                .map(|(higher, _)| higher)
                .find(|higher| *higher > level)
                .unwrap_or(f32::INFINITY),
        };
        gaussian_beneath(lowest, at_lowest, total, &rest)
    }
}

/// The Gaussian of which `at_lowest` of `total` pixels are cut off; the others are the `rest`.
fn gaussian_beneath(lowest: f32, at_lowest: usize, total: usize, rest: &Rest) -> Option<CutCell> {
    let Rest {
        next,
        level,
        beyond,
        ..
    } = *rest;
    let edge = 0.5 * (lowest + next);
    let up_to = at_lowest + rest.up_to;
    // Half a pixel short of all: the highest value is not the end of the distribution.
    let below = (up_to as f64).min(total as f64 - 0.5) / total as f64;
    let step = if beyond.is_finite() {
        beyond - level
    } else {
        next - lowest
    };
    let at_edge = normal_quantile(at_lowest as f64 / total as f64);
    let at_level = normal_quantile(below);
    let sigma = (level + 0.5 * step - edge) / (at_level - at_edge) as f32;
    (sigma > 0.0 && sigma.is_finite()).then_some(CutCell::Known {
        depth: at_edge as f32,
        sigma,
        edge,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::size::Size;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    proptest! {
        #[test]
        fn bytes_are_counted_as_floats_are_sorted(
            levels in prop::collection::vec((0..90_u8).prop_map(|v| v.saturating_sub(30)), 64 * 64),
        ) {
            const SIDE: usize = 64;
            let grid = CellGrid::new(Size::new(SIDE, SIDE), SIDE / 4, 4);
            let floats: Vec<f32> = levels.iter().copied().map(f32::from).collect();
            let cells = [Samples::U8(&levels), Samples::F32(&floats)].map(|pixels| {
                let view = View::new(pixels, SIDE, SIDE);
                let cell = measure_cell(&view, &grid, 5, 0.0, &mut Vec::new(), &mut Vec::new());
                format!("{cell:?}")
            });
            prop_assert_eq!(&cells[0], &cells[1]);
        }
    }

    #[test]
    fn the_gaussian_beneath_is_found_from_a_few_to_most_pixels_cut_off() {
        const SIDE: usize = 64;
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let grid = CellGrid::new(Size::new(SIDE, SIDE), SIDE, 4);
        for background in [6.0f32, 3.0, 0.0, -3.0, -4.5] {
            let pixels: Vec<f32> = (0..SIDE * SIDE)
                .map(|_| {
                    let z: f32 = StandardNormal.sample(&mut rng);
                    (background + 3.0 * z).round().max(0.0)
                })
                .collect();
            let view = View::new(&pixels, SIDE, SIDE);
            let Some(CutCell::Known { depth, sigma, edge }) =
                measure_cell(&view, &grid, 0, 0.0, &mut Vec::new(), &mut Vec::new())
            else {
                panic!("{background} is cut off");
            };
            let found = edge - depth * sigma;
            // About four standard errors of the least certain one.
            assert!((sigma / 3.0 - 1.0).abs() < 0.25, "{background}: {sigma}");
            assert!((found - background).abs() < 1.2, "{background}: {found}");
        }
    }
}
