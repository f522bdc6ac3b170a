//! Short blocks of columns and their maxima: most hold nothing of interest, and need no second look.

use multiversion::multiversion;

/// Width of the blocks whose maxima are kept.
pub(super) const BLOCK_PX: usize = 64;

/// The maxima of all blocks of a frame.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockMaxima {
    /// Blocks in a row.
    pub per_row: usize,
    /// Row by row.
    pub values: Vec<f32>,
}

impl BlockMaxima {
    /// Makes room for a frame of `width` times `height` pixels.
    pub fn prepare(&mut self, (width, height): (usize, usize)) {
        self.per_row = width.div_ceil(BLOCK_PX);
        self.values.resize(self.per_row * height, 0.0);
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

/// The maximum of each block of [`BLOCK_PX`] values; the last may be shorter. NaN is left out.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(super) fn block_maxima(row: &[f32], maxima: &mut [f32]) {
    const LANES: usize = 16;
    let higher = |a: f32, b: f32| if a > b { a } else { b };
    for (maximum, block) in maxima.iter_mut().zip(row.chunks(BLOCK_PX)) {
        let mut lanes = [f32::MIN; LANES];
        let (chunks, rest) = block.as_chunks::<LANES>();
        for chunk in chunks {
            for lane in 0..LANES {
                lanes[lane] = higher(chunk[lane], lanes[lane]);
            }
        }
        for (lane, &value) in lanes.iter_mut().zip(rest) {
            *lane = higher(value, *lane);
        }
        // By halves: one after the other, each would wait for the one before.
        let mut half = LANES / 2;
        while half > 0 {
            for lane in 0..half {
                lanes[lane] = higher(lanes[lane + half], lanes[lane]);
            }
            half /= 2;
        }
        *maximum = lanes[0];
    }
}
