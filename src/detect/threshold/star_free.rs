//! Which pixels of a frame are free of stars, so that its noise can be measured on them. Where much
//! of the noise is cut off, it is known otherwise.

use crate::detect::background::{CutOff, Mesh, Piece};
use crate::detect::pixels::{BLOCK_PX, BlockMaxima, View};
use std::ops::Range;

/// Rows above and below that must be free of stars as well: their wings.
const WING_ROWS: [usize; 2] = [4, 9];
/// Noise of which more is cut off is another distribution than that of the rest of the frame: the
/// cut is farther above the background than this, in standard deviations.
const MAX_DEPTH: f32 = -1.0;
/// Fewer samples than this do not determine the tails of the noise.
pub(crate) const MIN_SAMPLES: f64 = 2000.0;

/// Buffers of the measurement of noise.
#[derive(Debug, Clone, Default)]
pub(crate) struct NoiseBuffers {
    /// The histogram bin of each pixel of a row.
    pub bins: Vec<u16>,
    /// The pixels of a row.
    pub row: Vec<f32>,
    /// A row in units of its noise.
    pub standardised: Vec<f32>,
    /// Background and noise along a row.
    pub pieces: Vec<Piece>,
    /// Mean and noise of the filtered frame along a row.
    pub nodes: Vec<[f32; 2]>,
    /// Values that are sorted for their median.
    pub sorted: Vec<f32>,
}

/// The part of a frame without stars, of whose noise little is cut off: where the filtered frame stays
/// below a limit.
pub(crate) struct StarFree<'a> {
    /// The maxima of the blocks of the filtered frame that hold candidates.
    pub maxima: &'a BlockMaxima,
    /// The mesh of the filtered frame.
    pub filtered_mesh: &'a Mesh,
    /// Where the noise is cut off.
    pub cut_off: &'a CutOff,
    /// The limit, in standard deviations of the filtered noise.
    pub limit: f32,
}

impl StarFree<'_> {
    /// Calls `each` with the columns of row `y` without stars and their wings, as spans of whole
    /// blocks.
    pub fn spans(
        &self,
        y: usize,
        view: &View<'_>,
        nodes: &mut Vec<[f32; 2]>,
        mut each: impl FnMut(Range<usize>),
    ) {
        let rows = [
            y,
            y.saturating_sub(WING_ROWS[0]),
            y.saturating_sub(WING_ROWS[1]),
            (y + WING_ROWS[0]).min(view.height - 1),
            (y + WING_ROWS[1]).min(view.height - 1),
        ]
        .map(|row| self.maxima.row(row));
        self.filtered_mesh.across_row(y, nodes);
        let grid = &self.filtered_mesh.grid;
        let depth_at = |x: usize| self.cut_off.depth.get(grid.cell_at(x, y));
        let is_cut_off = |x: usize| depth_at(x).is_some_and(|&depth| depth > MAX_DEPTH);
        let mut free = 0..0;
        for block in 0..rows[0].len() {
            let start = block * BLOCK_PX;
            let end = (start + BLOCK_PX).min(view.width);
            let middle = (start + end) as f32 * 0.5;
            let (mean, sigma) = self.filtered_mesh.at_column(nodes, middle);
            let limit = mean + self.limit * sigma;
            if rows.iter().all(|r| r[block] < limit) && !is_cut_off(start) {
                free.end = end;
            } else {
                if !free.is_empty() {
                    each(free);
                }
                free = end..end;
            }
        }
        if !free.is_empty() {
            each(free);
        }
    }
}
