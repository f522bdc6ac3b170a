//! The threshold for coarse noise that is correlated, as JPEG leaves it: most of the noise below
//! the steps of the compression is gone, and what is left stands out in patterns that look like
//! stars.
//!
//! The tail of such noise is measured on the negative of the filtered frame, where no star is. The
//! positive side has the same tail on another scale: the ratio of the heights where either side has
//! a thousand extrema in a million pixels. Stars among these are left out, as many as the positive
//! side has above the threshold, on the assumption that their number falls as one over their flux.
//!
//! Foliage and roofs have tails of their own: the frame is divided into parts, and the median of
//! the parts' thresholds holds. Where the background bends, as at the circle of an all-sky frame, nothing is
//! measured: on both sides of an edge the filtered frame is far off.

use crate::base::size::Size;
use crate::base::statistics::median_of;
use crate::detect::background::{CellGrid, Mesh};
use crate::detect::pixels::{BLOCK_PX, Widened, packed, with_widened};
use multiversion::multiversion;

/// Parts of a frame have at least this many pixels, so that the tail is measured on some ten
/// extrema.
const MIN_PART_PX: usize = 200_000;
/// Most parts across and down.
const MAX_PARTS: usize = 4;
/// Extrema in a million pixels where the scale of the two sides is compared: so many that stars are
/// few among them.
const SCALE_PER_MPX: f64 = 1000.0;
/// Extrema in a million pixels from which the tail is extrapolated, together with those above.
const TAIL_PER_MPX: f64 = 50.0;
/// A threshold is raised by the negative from this much on, in standard deviations: about twice the
/// error of a threshold that is measured on one part.
const MIN_RAISE: f64 = 0.3;
/// Extrema that are lower than this, in standard deviations, are not kept.
const MIN_HEIGHT: f32 = 0.25;

/// Local extrema of a filtered frame, by part of the frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct Extrema {
    size: Size,
    /// Parts across, and down.
    parts: usize,
    heights: Vec<Sides>,
    grid: CellGrid,
    /// By cell, whether the background bends there.
    is_bent: Vec<bool>,
    /// By column of pixels, the column of cells and of parts: divisions take long.
    columns: Vec<[u32; 2]>,
    /// The mesh interpolated to a row.
    nodes: Vec<[f32; 2]>,
    /// A row in standard deviations.
    row: Vec<f32>,
}

/// The heights of the extrema of a part, in standard deviations.
#[derive(Debug, Clone, Default)]
struct Sides {
    /// Pixels that were searched.
    pixels: usize,
    /// Of maxima.
    positive: Vec<f32>,
    /// Of minima, with the sign turned.
    negative: Vec<f32>,
}

impl Extrema {
    /// Clears what was measured, for a frame of this size with this background.
    pub fn prepare(&mut self, size: Size, background: &Mesh) {
        let grid = background.grid;
        self.grid = grid;
        self.is_bent.clear();
        for row in 0..grid.rows {
            let y = grid.rows_of(row).start as f32;
            let of_row = (0..grid.columns).map(|column| grid.columns_of(column).start as f32);
            let is_bent = of_row.map(|x| background.is_bent_at(x, y));
            self.is_bent.extend(is_bent);
        }
        let most = ((size.pixels() / MIN_PART_PX) as f64).sqrt() as usize;
        let parts = most.clamp(1, MAX_PARTS);
        self.size = size;
        self.parts = parts;
        let column_of = |x: usize| [grid.cell_at(x, 0), x * parts / size.width].map(|at| at as u32);
        self.columns.clear();
        self.columns.extend((0..size.width).map(column_of));
        self.heights.resize_with(parts * parts, Sides::default);
        for sides in &mut self.heights {
            sides.pixels = 0;
            sides.positive.clear();
            sides.negative.clear();
        }
    }

    /// Adds the extrema of row `y` of the filtered frame, given with the rows above and below; mean
    /// and noise of the filtered frame are in `mesh`.
    pub fn add_row(&mut self, rows: [&[f32]; 3], y: usize, mesh: &Mesh) {
        let Size { width, height } = self.size;
        let first_part = y * self.parts / height * self.parts;
        let first_cell = self.grid.cell_at(0, y);
        let is_bent = &self.is_bent[first_cell..first_cell + self.grid.columns];
        for (column, _) in is_bent.iter().enumerate().filter(|(_, is_bent)| !**is_bent) {
            let pixels = self.grid.columns_of(column);
            let part = first_part + pixels.start * self.parts / width;
            self.heights[part].pixels += pixels.len();
        }
        mesh.across_row(y, &mut self.nodes);
        self.row.resize(width, 0.0);
        mesh.heights(&self.nodes, 0, &rows[1][..width], &mut self.row);
        for first in (0..width).step_by(BLOCK_PX) {
            let extrema = with_widened(rows.map(Some), first, mark_extrema);
            let [maxima, minima] = extrema.map(|bits| bits & inner_columns(first, width));
            for (mut bits, is_above) in [(maxima, true), (minima, false)] {
                while bits != 0 {
                    let x = first + bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let [column, part] = self.columns[x].map(|at| at as usize);
                    if is_bent[column] {
                        continue;
                    }
                    let sides = &mut self.heights[first_part + part];
                    let (height, heights) = if is_above {
                        (self.row[x], &mut sides.positive)
                    } else {
                        (-self.row[x], &mut sides.negative)
                    };
                    if height > MIN_HEIGHT {
                        heights.push(height);
                    }
                }
            }
        }
    }

    /// The threshold `u` raised to where noise has `per_mpx` maxima in a million pixels, at most to
    /// `most`, in standard deviations.
    pub fn raised(&mut self, u: f64, per_mpx: f64, most: f64) -> f64 {
        let thresholds = self.heights.iter_mut();
        let found = thresholds.filter_map(|sides| sides.threshold(per_mpx));
        let middle = median_of(found);
        let error = MIN_RAISE / (self.heights.len() as f64).sqrt();
        match middle {
            Some(middle) if middle > u + error => middle.min(most).max(u),
            _ => u,
        }
    }
}

/// A bit for each column of the block that begins with `first` that is not at the border.
fn inner_columns(first: usize, width: usize) -> u64 {
    let all = u64::MAX << u32::from(first == 0);
    let right = width - 1 - first;
    if right < BLOCK_PX {
        all & !(u64::MAX << right)
    } else {
        all
    }
}

/// The pixels of the middle row that are above all around them, and those that are below, as bits.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn mark_extrema([above, row, below]: [&Widened<f32>; 3]) -> [u64; 2] {
    let [mut maxima, mut minima] = [[0u8; BLOCK_PX]; 2];
    // Not those of `f32`, which take care of NaN, of which a filtered frame has none.
    let higher = |a: f32, b: f32| if a > b { a } else { b };
    let lower = |a: f32, b: f32| if a < b { a } else { b };
    let marks = maxima.iter_mut().zip(&mut minima);
    for (x, (maximum, minimum)) in marks.enumerate() {
        let (value, right) = (row[x + 1], row[x + 2]);
        let [a, b, c, d] = [above[x], above[x + 1], above[x + 2], row[x]];
        let [e, f, g] = [below[x], below[x + 1], below[x + 2]];
        let highest = higher(higher(higher(a, b), higher(c, d)), higher(higher(e, f), g));
        let lowest = lower(lower(lower(a, b), lower(c, d)), lower(lower(e, f), g));
        // Of equal neighbors in a row, the first counts.
        *maximum = u8::from((value > highest) & (value >= right));
        *minimum = u8::from((value < lowest) & (value <= right));
    }
    [packed(&maxima), packed(&minima)]
}

impl Sides {
    /// The threshold above which noise has `per_mpx` maxima in a million pixels, in standard
    /// deviations; `None` where there are too few extrema to tell.
    fn threshold(&mut self, per_mpx: f64) -> Option<f64> {
        let megapixels = self.pixels as f64 / 1e6;
        let mut negative_at = |per_mpx: f64| {
            let rank = (per_mpx * megapixels) as usize;
            let has_rank = rank < self.negative.len();
            has_rank.then(|| f64::from(highest(&mut self.negative, rank)[rank]))
        };
        let (near, far) = (negative_at(SCALE_PER_MPX)?, negative_at(TAIL_PER_MPX)?);
        // As a Gaussian has it: the logarithm of the number is linear in the square of the height.
        let slope = (far.powi(2) - near.powi(2)) / libm::log(SCALE_PER_MPX / TAIL_PER_MPX);
        let square = far.powi(2) + slope * libm::log(TAIL_PER_MPX / per_mpx);
        let tail = square.max(0.0).sqrt() / near;
        let count = SCALE_PER_MPX * megapixels;
        // Mostly, few maxima are stars. Else all are sorted, which takes long.
        let most = 4 * count as usize;
        let scale = if most < self.positive.len() {
            positive_scale(highest(&mut self.positive, most), count, tail)
        } else {
            None
        };
        let of_all = || positive_scale(highest(&mut self.positive, usize::MAX), count, tail);
        // Where stars are not few, both sides are taken to be alike.
        Some(tail * scale.or_else(of_all).unwrap_or(near))
    }
}

/// Sorts the highest to the front, highest first: those up to that of the given rank, from 0.
fn highest(heights: &mut [f32], rank: usize) -> &[f32] {
    let descending = |a: &f32, b: &f32| b.total_cmp(a);
    let end = if rank < heights.len() {
        heights.select_nth_unstable_by(rank, descending);
        rank + 1
    } else {
        heights.len()
    };
    heights[..end].sort_unstable_by(descending);
    &heights[..end]
}

/// The height at which `count` maxima that are not stars are higher, highest first; the threshold is
/// `tail` times as high. `None` where there are too few.
fn positive_scale(heights: &[f32], count: f64, tail: f64) -> Option<f64> {
    const ROUNDS: usize = 5;
    let mut scale = f64::from(*heights.get(count as usize)?);
    for _ in 0..ROUNDS {
        let threshold = tail * scale;
        let stars = heights.partition_point(|&h| f64::from(h) > threshold);
        if stars == heights.len() {
            return None;
        }
        let is_enough = |(index, &height): (usize, &f32)| {
            index as f64 - stars as f64 * threshold / f64::from(height) >= count
        };
        let at = heights.iter().enumerate().position(is_enough)?;
        scale = f64::from(heights[at]);
    }
    Some(scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    /// Extrema of a part of one megapixel, whose negative is Gaussian with standard deviation
    /// `negative` and whose positive side is so with `positive`, with `stars` above 1.
    fn sides(negative: f64, positive: f64, stars: usize) -> Sides {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut tail = |scale: f64| {
            let unit: f64 = random.random_range(1e-9..1.0);
            (scale * (-2.0 * unit.ln()).sqrt()) as f32
        };
        let mut sides = Sides {
            pixels: 1_000_000,
            negative: (0..60_000).map(|_| tail(negative)).collect(),
            positive: (0..60_000).map(|_| tail(positive)).collect(),
        };
        let star = |i: usize| stars as f32 / (i as f32 + 0.5);
        sides.positive.extend((0..stars).map(star));
        sides
    }

    #[test]
    fn the_tail_of_the_negative_holds_on_the_scale_of_the_positive() {
        let expected = (2.0 * (60_000.0_f64 / 0.1).ln()).sqrt();
        for (positive, stars) in [(1.0, 0), (1.5, 0), (0.7, 0), (1.5, 800)] {
            let found = sides(1.0, positive, stars).threshold(0.1).unwrap();
            let ratio = found / (expected * positive);
            assert!((ratio - 1.0).abs() < 0.06, "{positive} {stars}: {ratio}");
        }
    }

    #[test]
    fn too_few_extrema_tell_nothing() {
        let mut few = sides(1.0, 1.0, 0);
        few.negative.truncate(10);
        assert_eq!(few.threshold(0.1), None);
    }
}
