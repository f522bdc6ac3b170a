//! Short blocks of columns: most hold nothing of interest, and need no second look.

use multiversion::multiversion;
use std::ops::Range;

/// Width of the blocks.
pub(super) const BLOCK_PX: usize = 64;

/// The maximum of a block without anything of interest.
const NOTHING: f32 = f32::MIN;

/// The maxima of those blocks of a frame that hold something of interest.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockMaxima {
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

/// Columns of the values of `block` in `row` that reach `lowest`.
pub(super) fn columns_from(row: &[f32], block: usize, lowest: f32) -> impl Iterator<Item = usize> {
    /// Values compared together: most hold none.
    const GROUP: usize = 16;
    let start = block * BLOCK_PX;
    let values = &row[start..(start + BLOCK_PX).min(row.len())];
    let groups = values.chunks(GROUP).enumerate();
    groups
        .filter(move |(_, group)| group.iter().fold(false, |any, &v| any | (v >= lowest)))
        .flat_map(move |(g, group)| {
            let columns = (start + g * GROUP..).zip(group);
            columns.filter_map(move |(x, &v)| (v >= lowest).then_some(x))
        })
}

/// Finds the blocks of `row` with a value that reaches the level of its block; NaN reaches none.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(super) fn find_reaching(row: &[f32], levels: &[f32], found: &mut Vec<usize>) {
    found.clear();
    let (blocks, rest) = row.as_chunks::<BLOCK_PX>();
    for (block, (values, &level)) in blocks.iter().zip(levels).enumerate() {
        if values.iter().fold(false, |any, &v| any | (v >= level)) {
            found.push(block);
        }
    }
    let is_reached = |level: &f32| rest.iter().any(|v| v >= level);
    if levels.get(blocks.len()).is_some_and(is_reached) {
        found.push(blocks.len());
    }
}
