//! Gathers the pixels of the filtered frame that may lie above the threshold, one row of cells at a
//! time.
//!
//! The noise of the filtered frame is not known everywhere until all rows of cells are filtered. So
//! pixels are gathered down to a lower cut first, and compared with the threshold later.

use crate::detect::filter::FilteredBand;
use crate::detect::pixels::{ReachedBlock, find_reaching};
use std::ops::Range;

/// The pixels of a row of cells that may lie above the threshold.
#[derive(Debug, Clone, Default)]
pub(crate) struct Candidates {
    /// All pixels of the filtered frame at or above `cut`, in reading order.
    pub(super) pixels: Vec<CandidatePixel>,
    /// The local maxima among them, in reading order.
    pub(super) maxima: Vec<LocalMaximum>,
    /// In units of the background noise.
    cut: f32,
    /// The cut for each block of columns.
    block_cuts: Vec<f32>,
    /// The blocks of the current row that reach the cut.
    blocks: Vec<ReachedBlock>,
}

/// A pixel of the filtered frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct CandidatePixel {
    pub x: u32,
    pub y: u32,
    pub value: f32,
}

/// A local maximum of the filtered frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct LocalMaximum {
    /// Index of its pixel among the candidates.
    pub pixel: u32,
    /// Values to the left, to the right, above and below; `None` at the border.
    pub adjacent: Option<[f32; 4]>,
}

impl Candidates {
    /// Gathers the pixels at or above `cut` in `rows` of `band`, and raises the `maxima` of the
    /// blocks that hold any, row by row. Ends after the row in which they become more than `most`.
    ///
    /// The band holds one more row on either side, where the frame has it.
    pub fn gather(
        &mut self,
        band: &FilteredBand,
        rows: Range<usize>,
        cut: f32,
        most: usize,
        maxima: &mut [f32],
    ) {
        self.pixels.clear();
        self.maxima.clear();
        self.cut = cut;
        let blocks_per_row = maxima.len() / rows.len().max(1);
        self.block_cuts.clear();
        self.block_cuts.resize(blocks_per_row, cut);
        for (y, maxima) in rows.zip(maxima.chunks_mut(blocks_per_row)) {
            if self.pixels.len() > most {
                break;
            }
            let Some(row) = band.row(y) else { continue };
            let adjacent_rows = [y.checked_sub(1).and_then(|y| band.row(y)), band.row(y + 1)];
            find_reaching(row, &self.block_cuts, &mut self.blocks);
            for block in &self.blocks {
                let highest = &mut maxima[block.block];
                for x in block.columns() {
                    *highest = highest.max(row[x]);
                    if is_local_maximum(row, adjacent_rows, x) {
                        self.maxima.push(LocalMaximum {
                            pixel: self.pixels.len() as u32,
                            adjacent: adjacent_values(row, adjacent_rows, x),
                        });
                    }
                    self.pixels.push(CandidatePixel {
                        x: x as u32,
                        y: y as u32,
                        value: row[x],
                    });
                }
            }
        }
    }

    /// How many were gathered.
    pub fn len(&self) -> usize {
        self.pixels.len()
    }

    /// Whether all pixels at or above `lowest` were gathered.
    pub fn reach_down_to(&self, lowest: f32) -> bool {
        self.cut <= lowest
    }
}

/// Whether no neighbor is higher; of equal pixels the first in reading order counts.
fn is_local_maximum(row: &[f32], [above, below]: [Option<&[f32]>; 2], x: usize) -> bool {
    let value = row[x];
    let columns = x.saturating_sub(1)..(x + 2).min(row.len());
    // Without early exit: a branch for each neighbor would cost more.
    let are_lower = |values: &[f32]| values.iter().fold(true, |all, v| all & (*v < value));
    let are_no_higher = |values: &[f32]| values.iter().fold(true, |all, v| all & (*v <= value));
    are_lower(&row[columns.start..x])
        & are_no_higher(&row[x..columns.end])
        & above.is_none_or(|row| are_lower(&row[columns.clone()]))
        & below.is_none_or(|row| are_no_higher(&row[columns.clone()]))
}

/// The values to the left, to the right, above and below; `None` at the border.
fn adjacent_values(row: &[f32], [above, below]: [Option<&[f32]>; 2], x: usize) -> Option<[f32; 4]> {
    let inside = x > 0 && x + 1 < row.len();
    inside.then_some([
        row[x.max(1) - 1],
        row[(x + 1).min(row.len() - 1)],
        above?[x],
        below?[x],
    ])
}
