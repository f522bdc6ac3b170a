//! Local maxima of a row, a block of columns at a time.

use super::blocks::{BLOCK_PX, PixelLevel, packed};
use multiversion::multiversion;

/// The columns of a block, and one on either side.
pub(crate) type Widened<T> = [T; BLOCK_PX + 2];

/// The local maxima in the block of columns that begins with `first`, given its row between those
/// above and below: one bit for each column, the lowest for the first. No neighbor of a maximum is
/// higher; of equal pixels the first in reading order counts. Nothing is beyond the border, and NaN is
/// no neighbor. The bits of NaN pixels, and of columns beyond the row, mean nothing.
pub(crate) fn local_maxima<T: PixelLevel>(rows: [Option<&[T]>; 3], first: usize) -> u64 {
    with_widened(rows, first, |rows| mark_maxima(rows))
}

/// Calls `mark` with the columns of the block that begins with `first`, and one on either side; of
/// the lowest value where there are none.
pub(crate) fn with_widened<T: PixelLevel, R>(
    rows: [Option<&[T]>; 3],
    first: usize,
    mark: impl Fn([&Widened<T>; 3]) -> R,
) -> R {
    let widened = rows.map(|row| row?.get(first.checked_sub(1)?..)?.first_chunk());
    if let [Some(above), Some(row), Some(below)] = widened {
        return mark([above, row, below]);
    }
    let from = first.saturating_sub(1);
    let copies = rows.map(|row| {
        let mut copy: Widened<T> = [T::LOWEST; BLOCK_PX + 2];
        let values = row.and_then(|row| row.get(from..)).unwrap_or_default();
        let target = copy[from + 1 - first..].iter_mut();
        target.zip(values).for_each(|(to, &value)| *to = value);
        copy
    });
    mark(copies.each_ref())
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn mark_maxima<T: PixelLevel>([above, row, below]: [&Widened<T>; 3]) -> u64 {
    let mut marks = [0u8; BLOCK_PX];
    for (x, mark) in marks.iter_mut().enumerate() {
        let value = row[x + 1];
        // Without early exit: a branch for each neighbor would cost more.
        let is_reached = (above[x] >= value) | (above[x + 1] >= value) | (above[x + 2] >= value);
        let is_reached = is_reached | (row[x] >= value);
        let is_lower = (below[x] > value) | (below[x + 1] > value) | (below[x + 2] > value);
        let is_lower = is_lower | (row[x + 2] > value);
        *mark = u8::from(!(is_reached | is_lower));
    }
    packed(&marks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The rows above, at and below row `y`.
    fn rows_around(values: &[f32], width: usize, y: usize) -> [Option<&[f32]>; 3] {
        [y.checked_sub(1), Some(y), Some(y + 1)].map(|y| values.chunks_exact(width).nth(y?))
    }

    /// Whether no neighbor is higher; of equal pixels the first in reading order counts.
    fn is_maximum(values: &[f32], width: usize, x: usize, y: usize) -> bool {
        let height = values.len() / width;
        (y.saturating_sub(1)..(y + 2).min(height)).all(|row| {
            (x.saturating_sub(1)..(x + 2).min(width)).all(|column| {
                let (value, other) = (values[y * width + x], values[row * width + column]);
                other < value || other.is_nan() || (other == value && (row, column) >= (y, x))
            })
        })
    }

    proptest! {
        #[test]
        fn maxima_are_those_of_each_pixel_by_itself(
            width in 1..200_usize,
            values in prop::collection::vec(
                prop_oneof![9 => (0..6_u8).prop_map(f32::from), 1 => Just(f32::NAN)],
                200..700,
            ),
        ) {
            let values = &values[..values.len() / width * width];
            for (y, row) in values.chunks_exact(width).enumerate() {
                let rows = rows_around(values, width, y);
                let inner = row.iter().enumerate().filter(|(_, value)| !value.is_nan());
                for (x, value) in inner {
                    let first = x / BLOCK_PX * BLOCK_PX;
                    let found = local_maxima(rows, first) >> (x - first) & 1 == 1;
                    prop_assert_eq!(found, is_maximum(values, width, x, y), "{} {} {}", x, y, value);
                }
            }
        }
    }
}
