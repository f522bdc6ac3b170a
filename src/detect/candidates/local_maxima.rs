//! Local maxima of the filtered frame, a block of columns at a time.

use crate::detect::pixels::{BLOCK_PX, packed};
use multiversion::multiversion;

/// The values to the left, to the right, above and below a pixel.
pub(super) type Adjacent = [f32; 4];
/// A block of columns, and one on either side.
type Widened = [f32; BLOCK_PX + 2];

/// The local maxima in the block of columns that begins with `first`, given its row between those
/// above and below: one bit for each column, the lowest for the first. No neighbor of a maximum is
/// higher; of equal pixels the first in reading order counts.
pub(super) fn local_maxima(rows: [Option<&[f32]>; 3], first: usize) -> u64 {
    let widened = rows.map(|row| row?.get(first.checked_sub(1)?..)?.first_chunk());
    if let [Some(above), Some(row), Some(below)] = widened {
        return mark_maxima([above, row, below]);
    }
    let from = first.saturating_sub(1);
    let copies = rows.map(|row| {
        // Beyond the border all is lower than any pixel.
        let mut copy: Widened = [f32::NEG_INFINITY; BLOCK_PX + 2];
        let values = row.and_then(|row| row.get(from..)).unwrap_or_default();
        let target = copy[from + 1 - first..].iter_mut();
        target.zip(values).for_each(|(to, &value)| *to = value);
        copy
    });
    mark_maxima(copies.each_ref())
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn mark_maxima([above, row, below]: [&Widened; 3]) -> u64 {
    let mut marks = [0u8; BLOCK_PX];
    for (x, mark) in marks.iter_mut().enumerate() {
        let value = row[x + 1];
        // Without early exit: a branch for each neighbor would cost more.
        let is_over = (above[x] < value) & (above[x + 1] < value) & (above[x + 2] < value);
        let is_over = is_over & (row[x] < value) & (row[x + 2] <= value);
        let is_maximum = (below[x] <= value) & (below[x + 1] <= value) & (below[x + 2] <= value);
        *mark = u8::from(is_over & is_maximum);
    }
    packed(&marks)
}

/// The values next to a pixel of the middle row; `None` at the border.
pub(super) fn adjacent_values(
    [above, row, below]: [Option<&[f32]>; 3],
    x: usize,
) -> Option<Adjacent> {
    let [left, _, right] = *row?.get(x.checked_sub(1)?..)?.first_chunk()?;
    Some([left, right, above?[x], below?[x]])
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
                other < value || (other == value && (row, column) >= (y, x))
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
                for (x, value) in row.iter().enumerate() {
                    let first = x / BLOCK_PX * BLOCK_PX;
                    let found = local_maxima(rows, first) >> (x - first) & 1 == 1;
                    prop_assert_eq!(found, is_maximum(values, width, x, y), "{} {} {}", x, y, value);
                    let inside = x > 0 && x + 1 < width && rows.iter().all(Option::is_some);
                    prop_assert_eq!(adjacent_values(rows, x).is_some(), inside);
                }
            }
        }
    }
}
