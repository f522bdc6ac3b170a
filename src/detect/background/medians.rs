//! Medians of many small sets side by side: vectors compared, without branches.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over lanes, which become vectors"
)]

use multiversion::multiversion;

/// Sets treated side by side.
pub(crate) const LANES: usize = 16;
/// The values of one place in each set.
pub(crate) type Lanes = [f32; LANES];
/// The size of the sets that are sorted whole.
pub(crate) const SORTED: usize = 32;

/// Levels stick out where they deviate by more than so many standard deviations of their neighbours,
const OUTLIER_SIGMA: f32 = 3.0;
/// which are so many median deviations,
const SIGMA_PER_MEDIAN_DEVIATION: f32 = 1.4826;
/// and this part of the spread.
const OUTLIER_SPREAD: f32 = 0.5;

/// Puts the lower values of two places into the first.
#[inline(always)]
fn exchange<const N: usize>(values: &mut [Lanes; N], i: usize, j: usize) {
    let (a, b) = (values[i], values[j]);
    for lane in 0..LANES {
        values[i][lane] = if b[lane] < a[lane] { b[lane] } else { a[lane] };
        values[j][lane] = if b[lane] < a[lane] { a[lane] } else { b[lane] };
    }
}

/// Sorts each lane, the lowest values first; there must be no NaN in a lane whose result is used.
///
/// # Reference
/// Batcher 1968, doi 10.1145/1468075.1468121: sorting by merging odd and even places.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn sort_lanes(values: &mut [Lanes; SORTED]) {
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

/// The medians of nine values each.
///
/// # Reference
/// Paeth 1990, "Median finding on a 3x3 grid", Graphics Gems, 171.
#[inline(always)]
fn median_of_nine(mut v: [Lanes; 9]) -> Lanes {
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

/// The 3x3 values about up to [`LANES`] places from `start` on, which is the first column of these.
#[inline(always)]
fn squares(rows: [&[f32]; 3], start: usize, count: usize) -> [Lanes; 9] {
    std::array::from_fn(|i| {
        let from = start + i % 3;
        let row = rows[i / 3];
        if let Some(whole) = row[from..].first_chunk::<LANES>() {
            return *whole;
        }
        let mut lanes = [0.0; LANES];
        lanes[..count].copy_from_slice(&row[from..from + count]);
        lanes
    })
}

/// The medians of 3x3 values, from rows that are two longer than `medians`.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn of_squares(rows: [&[f32]; 3], medians: &mut [f32]) {
    for (block, out) in medians.chunks_mut(LANES).enumerate() {
        let middle = median_of_nine(squares(rows, block * LANES, out.len()));
        out.copy_from_slice(&middle[..out.len()]);
    }
}

/// Replaces the levels that stick out from the 3x3 about them by the median of these; `rows` are two longer than `levels`.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn replace_outliers(rows: [&[f32]; 3], spreads: &[f32], levels: &mut [f32]) {
    let blocks = levels.chunks_mut(LANES).zip(spreads.chunks(LANES));
    for (block, (out, spread)) in blocks.enumerate() {
        let around = squares(rows, block * LANES, out.len());
        let middle = median_of_nine(around);
        let deviations = around.map(|lanes| -> Lanes {
            std::array::from_fn(|lane| (lanes[lane] - middle[lane]).abs())
        });
        let deviation = median_of_nine(deviations);
        for (lane, (level, spread)) in out.iter_mut().zip(spread).enumerate() {
            // A plane has the same deviations as its own gradient: only what exceeds them sticks out.
            let allowed = OUTLIER_SIGMA * SIGMA_PER_MEDIAN_DEVIATION * deviation[lane]
                + OUTLIER_SPREAD * spread;
            if (*level - middle[lane]).abs() > allowed {
                *level = middle[lane];
            }
        }
    }
}

/// The sum, by halves: one after the other, each would wait for the one before.
#[inline(always)]
pub(crate) fn sum_of<const N: usize>(mut lanes: [f32; N]) -> f32 {
    let mut half = N / 2;
    while half > 0 {
        for lane in 0..half {
            lanes[lane] += lanes[lane + half];
        }
        half /= 2;
    }
    lanes[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    fn random_lanes<const N: usize>() -> [Lanes; N] {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        std::array::from_fn(|_| std::array::from_fn(|_| rng.random_range(0..20) as f32))
    }

    fn sorted_lane<const N: usize>(values: &[Lanes; N], lane: usize) -> Vec<f32> {
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
        for lane in 0..LANES {
            let column: Vec<f32> = sorted.iter().map(|v| v[lane]).collect();
            assert_eq!(column, sorted_lane(&values, lane));
            assert_eq!(medians[lane], sorted_lane(&nine, lane)[4]);
        }
    }

    #[test]
    fn a_level_that_sticks_out_is_replaced_and_a_plane_is_not() {
        let row = |y: f32| -> Vec<f32> { (0..22).map(|x| x as f32 + 10.0 * y).collect() };
        let (top, mut middle, bottom) = (row(0.0), row(1.0), row(2.0));
        middle[8] = 500.0;
        let mut levels = middle[1..21].to_vec();
        let rows = [top.as_slice(), &middle, &bottom];
        replace_outliers(rows, &[1.0; 20], &mut levels);
        assert!((levels[7] - 18.0).abs() <= 2.0, "{}", levels[7]);
        levels[7] = middle[8];
        assert_eq!(levels, middle[1..21]);
        assert_eq!(sum_of([1.0, 2.0, 3.0, 4.0]), 10.0);
    }
}
