//! Reductions of rows of pixels, many columns side by side: one after the other, each step would
//! wait for the one before.

use multiversion::multiversion;

/// The lower of two values; `a` where `b` is NaN.
#[inline(always)]
pub(crate) fn lower(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// The lowest of `start` and the pixels of a row; NaN pixels are ignored.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn lowest_in_row(start: f32, row: &[f32]) -> f32 {
    fold_row::<32>(start, row, lower)
}

/// The highest of `start` and the pixels of a few columns; NaN pixels are ignored.
pub(crate) fn highest_in_columns(start: f32, row: &[f32]) -> f32 {
    fold_row::<8>(start, row, |m, p| if p > m { p } else { m })
}

/// The larger of `start` and the absolute values in a row; NaN pixels are ignored.
pub(crate) fn largest_magnitude_in_row(start: f32, row: &[f32]) -> f32 {
    fold_row::<32>(start, row, |m, p| if p.abs() > m { p.abs() } else { m })
}

/// Folds a row into `start`, in any order.
#[inline(always)]
fn fold_row<const LANES: usize>(start: f32, row: &[f32], fold: impl Fn(f32, f32) -> f32) -> f32 {
    let (chunks, rest) = row.as_chunks::<LANES>();
    let mut lanes = [start; LANES];
    for chunk in chunks {
        for (lane, &value) in lanes.iter_mut().zip(chunk) {
            *lane = fold(*lane, value);
        }
    }
    lanes.iter().chain(rest).copied().fold(start, fold)
}

/// The sum of the lanes, by halves.
#[inline(always)]
pub(crate) fn pairwise_sum<const N: usize>(mut lanes: [f32; N]) -> f32 {
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

    #[test]
    fn rows_are_reduced_without_their_nan_pixels() {
        let mut row: Vec<f32> = (0..70).map(|i| 10.0 - i as f32).collect();
        (row[3], row[69]) = (f32::NAN, f32::NAN);
        assert_eq!(lowest_in_row(f32::INFINITY, &row), -58.0);
        assert_eq!(lowest_in_row(-60.0, &row), -60.0);
        assert_eq!(highest_in_columns(f32::MIN, &row), 10.0);
        assert_eq!(largest_magnitude_in_row(0.0, &row), 58.0);
        assert_eq!(pairwise_sum([1.0, 2.0, 3.0, 4.0]), 10.0);
    }
}
