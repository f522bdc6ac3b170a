//! Medians of many small sets side by side, by vector comparisons without branches.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over lanes, which become vectors"
)]

use crate::base::statistics::SIGMA_PER_MAD;
use multiversion::multiversion;

/// Cells treated side by side.
pub(crate) const CELL_LANES: usize = 16;
/// One value of each of [`CELL_LANES`] cells.
pub(crate) type CellLanes = [f32; CELL_LANES];
/// The number of values that [`sort_lanes`] sorts.
pub(crate) const SORTED: usize = 32;

/// Orders values `i` and `j` of each lane.
#[inline(always)]
fn exchange<const N: usize>(values: &mut [CellLanes; N], i: usize, j: usize) {
    let (a, b) = (values[i], values[j]);
    for lane in 0..CELL_LANES {
        values[i][lane] = if b[lane] < a[lane] { b[lane] } else { a[lane] };
        values[j][lane] = if b[lane] < a[lane] { a[lane] } else { b[lane] };
    }
}

/// Sorts each lane, lowest value first. CellLanes with NaN end in no defined order.
///
/// # Reference
/// Batcher 1968, doi 10.1145/1468075.1468121: odd-even merge sort.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn sort_lanes(values: &mut [CellLanes; SORTED]) {
    let mut part = 1;
    while part < SORTED {
        let mut step = part;
        while step > 0 {
            for start in (step % part..SORTED - step).step_by(2 * step) {
                for i in start..(start + step).min(SORTED - step) {
                    if i / (2 * part) == (i + step) / (2 * part) {
                        exchange(values, i, i + step);
                    }
                }
            }
            step /= 2;
        }
        part *= 2;
    }
}

/// The median of nine values in each lane.
///
/// # Reference
/// Paeth 1990, "Median finding on a 3x3 grid", Graphics Gems, 171.
#[inline(always)]
fn median_of_nine(mut v: [CellLanes; 9]) -> CellLanes {
    const EXCHANGES: [(usize, usize); 19] = [
        (1, 2),
        (4, 5),
        (7, 8),
        (0, 1),
        (3, 4),
        (6, 7),
        (1, 2),
        (4, 5),
        (7, 8),
        (0, 3),
        (5, 8),
        (4, 7),
        (3, 6),
        (1, 4),
        (2, 5),
        (4, 7),
        (4, 2),
        (6, 4),
        (4, 2),
    ];
    for (i, j) in EXCHANGES {
        exchange(&mut v, i, j);
    }
    v[4]
}

/// The 3x3 values around up to [`CELL_LANES`] cells; `start` is the left column of the first
/// square.
#[inline(always)]
fn squares(rows: [&[f32]; 3], start: usize, count: usize) -> [CellLanes; 9] {
    std::array::from_fn(|i| {
        let from = start + i % 3;
        let row = rows[i / 3];
        if let Some(whole) = row[from..].first_chunk::<CELL_LANES>() {
            return *whole;
        }
        let mut lanes = [0.0; CELL_LANES];
        lanes[..count].copy_from_slice(&row[from..from + count]);
        lanes
    })
}

/// The medians of 3x3 values; the rows are two longer than `medians`.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn of_squares(rows: [&[f32]; 3], medians: &mut [f32]) {
    for (block, out) in medians.chunks_mut(CELL_LANES).enumerate() {
        let median = median_of_nine(squares(rows, block * CELL_LANES, out.len()));
        out.copy_from_slice(&median[..out.len()]);
    }
}

/// Replaces backgrounds that are outliers among the 3x3 around them by the median of these; the
/// rows are two longer than `backgrounds`.
///
/// An outlier deviates from the median by more than three standard deviations of its neighbors, by
/// their median deviation, and half the noise of a pixel.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn replace_outliers(rows: [&[f32]; 3], sigmas: &[f32], backgrounds: &mut [f32]) {
    const OUTLIER_SIGMA: f32 = 3.0;
    const OUTLIER_NOISE: f32 = 0.5;
    let blocks = backgrounds
        .chunks_mut(CELL_LANES)
        .zip(sigmas.chunks(CELL_LANES));
    for (block, (out, sigma)) in blocks.enumerate() {
        let around = squares(rows, block * CELL_LANES, out.len());
        let median = median_of_nine(around);
        let deviations = around.map(|lanes| -> CellLanes {
            std::array::from_fn(|lane| (lanes[lane] - median[lane]).abs())
        });
        let deviation = median_of_nine(deviations);
        for (lane, (background, sigma)) in out.iter_mut().zip(sigma).enumerate() {
            // Cells on a plane deviate by its gradient: an outlier exceeds that.
            let allowed =
                OUTLIER_SIGMA * SIGMA_PER_MAD as f32 * deviation[lane] + OUTLIER_NOISE * sigma;
            if (*background - median[lane]).abs() > allowed {
                *background = median[lane];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    fn random_lanes<const N: usize>() -> [CellLanes; N] {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        std::array::from_fn(|_| std::array::from_fn(|_| rng.random_range(0..20) as f32))
    }

    fn sorted_lane<const N: usize>(values: &[CellLanes; N], lane: usize) -> Vec<f32> {
        let mut column: Vec<f32> = values.iter().map(|v| v[lane]).collect();
        column.sort_unstable_by(f32::total_cmp);
        column
    }

    #[test]
    fn lanes_are_sorted_and_have_their_medians() {
        let values = random_lanes::<SORTED>();
        let mut sorted = values;
        sort_lanes(&mut sorted);
        let nine = random_lanes::<9>();
        let medians = median_of_nine(nine);
        for lane in 0..CELL_LANES {
            let column: Vec<f32> = sorted.iter().map(|v| v[lane]).collect();
            assert_eq!(column, sorted_lane(&values, lane));
            assert_eq!(medians[lane], sorted_lane(&nine, lane)[4]);
        }
    }

    #[test]
    fn an_outlier_is_replaced_and_a_plane_is_not() {
        let row = |y: f32| -> Vec<f32> { (0..22).map(|x| x as f32 + 10.0 * y).collect() };
        let (top, mut middle, bottom) = (row(0.0), row(1.0), row(2.0));
        middle[8] = 500.0;
        let mut backgrounds = middle[1..21].to_vec();
        let rows = [top.as_slice(), &middle, &bottom];
        replace_outliers(rows, &[1.0; 20], &mut backgrounds);
        assert!((backgrounds[7] - 18.0).abs() <= 2.0, "{}", backgrounds[7]);
        backgrounds[7] = middle[8];
        assert_eq!(backgrounds, middle[1..21]);
    }
}
