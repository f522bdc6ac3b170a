//! The sums of a map along straight lines: the fast Radon transform.
//!
//! In a strip of 2ᵏ rows, a line is given by the column in its first row and by how many columns it goes
//! to the right down to the last one. It is a line of the upper half of the strip followed by one of the lower half, so
//! all sums of N × N cells take N² log₂ N additions. The map mirrored and turned gives the other lines.

use crate::base::coords::PixelPoint;
use std::f64::consts::{LN_10, PI};

/// Fewest cells of a line.
pub(super) const MIN_CELLS: usize = 16;

/// A straight line of cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RadonLine {
    /// Column and row of the first cell and of the last one.
    pub ends: [[usize; 2]; 2],
    /// Sum of the cells over its standard deviation in noise.
    pub snr: f64,
}

impl RadonLine {
    /// The middles of its outer cells.
    pub fn in_pixels(&self, side_px: usize) -> [PixelPoint; 2] {
        let middle = |cell: usize| (cell as f64 + 0.5) * side_px as f64 - 0.5;
        self.ends
            .map(|[x, y]| PixelPoint::new(middle(x), middle(y)))
    }
}

/// Number of sums that [`significant_lines`] tries.
pub(super) fn lines_of(columns: usize, rows: usize) -> usize {
    let of = |rows: usize, columns: usize| {
        let padded = rows.next_power_of_two();
        let levels = (padded / MIN_CELLS).max(1).ilog2() as usize + 1;
        2 * levels * padded * columns
    };
    of(rows, columns) + of(columns, rows)
}

/// An upper bound of the decimal logarithm of the probability that a standard normal variable exceeds
/// `snr`.
///
/// # Reference
/// Abramowitz & Stegun 1964, 7.1.13: Q(x) < φ(x) / x.
pub(super) fn log10_tail(snr: f64) -> f64 {
    if snr < 1.0 {
        return 0.0;
    }
    -(0.5 * snr * snr + libm::log(snr * (2.0 * PI).sqrt())) / LN_10
}

/// The lines that stand out: of each strip of rows or columns the strongest, strongest first. In a map of
/// noise there are `false_alarms`.
pub(super) fn significant_lines(
    [columns, rows]: [usize; 2],
    values: &[f32],
    false_alarms: f64,
) -> Vec<RadonLine> {
    let log10_limit = libm::log10(false_alarms / lines_of(columns, rows) as f64);
    let mut lines = Vec::new();
    for is_turned in [false, true] {
        for is_mirrored in [false, true] {
            let (width, height) = match is_turned {
                false => (columns, rows),
                true => (rows, columns),
            };
            let place = |x: usize, y: usize| {
                let x = if is_mirrored { width - 1 - x } else { x };
                if is_turned { [y, x] } else { [x, y] }
            };
            let cell = |x: usize, y: usize| {
                let [column, row] = place(x, y);
                values[row * columns + column]
            };
            for found in strongest_in_strips([width, height], cell) {
                // Lines may go into the padding below the map; their sums do not.
                let [x, y] = found.first;
                let rows = found.rows.min(height.saturating_sub(y));
                if rows <= MIN_CELLS / 2 || log10_tail(found.snr) > log10_limit {
                    continue;
                }
                let last = rows - 1;
                let right = (found.right * last + (found.rows - 1) / 2) / (found.rows - 1);
                lines.push(RadonLine {
                    ends: [place(x, y), place((x + right).min(width - 1), y + last)],
                    snr: found.snr,
                });
            }
        }
    }
    lines.sort_by(|a, b| b.snr.total_cmp(&a.snr).then(a.ends.cmp(&b.ends)));
    lines
}

/// The strongest line of a strip.
struct StripLine {
    /// Its first column and row.
    first: [usize; 2],
    /// Rows of the strip.
    rows: usize,
    /// By how many columns its end is to the right.
    right: usize,
    snr: f64,
}

/// The strongest line that goes down and to the right, of each strip of 2ᵏ rows.
fn strongest_in_strips(
    [width, height]: [usize; 2],
    cell: impl Fn(usize, usize) -> f32,
) -> Vec<StripLine> {
    let padded = height.next_power_of_two();
    let mut sums = vec![0.0_f32; width * padded];
    for (y, row) in sums.chunks_exact_mut(width).take(height).enumerate() {
        for (x, value) in row.iter_mut().enumerate() {
            *value = cell(x, y);
        }
    }
    let mut longer = vec![0.0_f32; width * padded];
    let mut found = Vec::new();
    let mut rows = 1;
    while rows < padded {
        let strips = sums.chunks_exact(2 * rows * width);
        for (upper_and_lower, strip) in strips.zip(longer.chunks_exact_mut(2 * rows * width)) {
            let (upper, lower) = upper_and_lower.split_at(rows * width);
            for (right, target) in strip.chunks_exact_mut(width).enumerate() {
                let half = right / 2 * width;
                let shift = right.div_ceil(2).min(width);
                let (upper, lower) = (&upper[half..half + width], &lower[half..half + width]);
                let inside = width - shift;
                for ((target, a), b) in target.iter_mut().zip(&upper[..inside]).zip(&lower[shift..])
                {
                    *target = a + b;
                }
                target[inside..].copy_from_slice(&upper[inside..]);
            }
        }
        std::mem::swap(&mut sums, &mut longer);
        rows *= 2;
        if rows >= MIN_CELLS {
            let strips = sums.chunks_exact(rows * width).enumerate();
            found.extend(strips.map(|(strip, sums)| strongest_of(strip, sums, [width, rows])));
        }
    }
    found
}

/// The largest of some values, in lanes that are compared at once.
fn largest(values: &[f32]) -> f32 {
    const LANES: usize = 16;
    let more = |a: f32, b: f32| if a > b { a } else { b };
    let mut lanes = [f32::NEG_INFINITY; LANES];
    let (chunks, rest) = values.as_chunks::<LANES>();
    for chunk in chunks {
        for (lane, &value) in lanes.iter_mut().zip(chunk) {
            *lane = more(*lane, value);
        }
    }
    lanes
        .into_iter()
        .chain(rest.iter().copied())
        .fold(f32::NEG_INFINITY, more)
}

fn strongest_of(strip: usize, sums: &[f32], [width, rows]: [usize; 2]) -> StripLine {
    let mut strongest = (f32::NEG_INFINITY, 0);
    for (right, row) in sums.chunks_exact(width).enumerate() {
        let sum = largest(row);
        if sum > strongest.0 {
            strongest = (sum, right);
        }
    }
    let (sum, right) = strongest;
    let row = &sums[right * width..(right + 1) * width];
    let x = row.iter().position(|&value| value == sum).unwrap_or(0);
    StripLine {
        first: [x, strip * rows],
        rows,
        right,
        snr: f64::from(sum) / (rows as f64).sqrt(),
    }
}
