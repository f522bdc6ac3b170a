//! Short blocks of columns: most hold nothing of interest, and need no second look.

use multiversion::multiversion;
use std::ops::Range;

/// Width of the blocks.
pub(crate) const BLOCK_PX: usize = 64;

/// The maximum of a block without anything of interest.
const NOTHING: f32 = f32::MIN;

/// The maxima of those blocks of a frame that hold something of interest.
#[derive(Debug, Clone, Default)]
pub(crate) struct BlockMaxima {
    /// Blocks in a row.
    pub per_row: usize,
    /// Row by row; [`NOTHING`] for the others.
    pub values: Vec<f32>,
}

impl BlockMaxima {
    /// Makes room for a frame of `width` times `height` pixels.
    pub fn prepare(&mut self, (width, height): (usize, usize)) {
        self.per_row = width.div_ceil(BLOCK_PX);
        self.values.clear();
        self.values.resize(self.per_row * height, NOTHING);
    }

    /// The maxima of the blocks in `rows`, row by row.
    pub fn rows_mut(&mut self, rows: Range<usize>) -> &mut [f32] {
        &mut self.values[rows.start * self.per_row..rows.end * self.per_row]
    }

    /// The maxima of the blocks in row `y`.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.per_row..(y + 1) * self.per_row]
    }
}

/// A block of a row with values that reach some level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Reached {
    /// Its number in the row.
    pub block: usize,
    /// A bit for each of its columns, the first one lowest.
    bits: u64,
}

impl Reached {
    /// The columns of the row whose values reach the level.
    pub fn columns(&self) -> impl Iterator<Item = usize> + use<> {
        let Self { block, mut bits } = *self;
        std::iter::from_fn(move || {
            let column = block * BLOCK_PX + bits.trailing_zeros() as usize;
            (bits != 0).then(|| {
                bits &= bits - 1;
                column
            })
        })
    }
}

/// Finds the blocks of `row` with values that reach the level of their block; NaN reaches none.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn find_reaching(row: &[f32], levels: &[f32], found: &mut Vec<Reached>) {
    found.clear();
    let (blocks, rest) = row.as_chunks::<BLOCK_PX>();
    for (block, (values, &level)) in blocks.iter().zip(levels).enumerate() {
        if values.iter().fold(false, |any, &v| any | (v >= level)) {
            let bits = bits_of(values, level);
            found.push(Reached { block, bits });
        }
    }
    if let Some(&level) = levels.get(blocks.len()) {
        let bits = bits_of(rest, level);
        if bits != 0 {
            let block = blocks.len();
            found.push(Reached { block, bits });
        }
    }
}

/// A bit for each value, at most 64, that reaches the level.
#[inline(always)]
fn bits_of(values: &[f32], level: f32) -> u64 {
    let bits = values.iter().enumerate();
    bits.fold(0, |bits, (i, &v)| bits | (u64::from(v >= level) << i))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_found_with_the_columns_that_reach_their_level() {
        let mut row = vec![0.0; 2 * BLOCK_PX + 10];
        let high = [0, 63, 64 + 20, 128 + 9];
        for x in high {
            row[x] = 5.0;
        }
        (row[3], row[100]) = (f32::NAN, 4.0);
        let mut found = Vec::new();
        find_reaching(&row, &[5.0; 3], &mut found);
        let columns: Vec<usize> = found.iter().flat_map(Reached::columns).collect();
        assert_eq!(columns, high);
        assert_eq!(found.iter().map(|f| f.block).collect::<Vec<_>>(), [0, 1, 2]);
        find_reaching(&row, &[6.0, 3.0, f32::NAN], &mut found);
        let columns: Vec<usize> = found.iter().flat_map(Reached::columns).collect();
        assert_eq!(columns, [64 + 20, 100]);
    }
}
