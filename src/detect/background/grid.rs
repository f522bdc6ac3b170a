//! The cells of a frame.

use crate::base::size::Size;
use std::ops::Range;

/// Row sampling stride in large cells.
const ROW_STRIDE: usize = 4;
/// Cells with fewer pixels than this are sampled in full.
const SMALL_CELL_PX: usize = 1024;

/// How a frame is divided into cells.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct CellGrid {
    /// Cells across.
    pub columns: usize,
    /// Cells down.
    pub rows: usize,
    /// Pixels across.
    pub width_px: usize,
    /// Pixels down.
    pub height_px: usize,
}

impl CellGrid {
    /// Cells of about `cell_px` pixels a side in a frame of this size.
    pub fn new(size: Size, cell_px: usize) -> Self {
        let cells = |side: usize| ((side as f32 / cell_px as f32).round() as usize).max(1);
        Self {
            columns: cells(size.width),
            rows: cells(size.height),
            width_px: size.width,
            height_px: size.height,
        }
    }

    /// The columns of pixels in a column of cells.
    pub fn columns_of(&self, column: usize) -> Range<usize> {
        column * self.width_px / self.columns..(column + 1) * self.width_px / self.columns
    }

    /// The rows of pixels in a row of cells.
    pub fn rows_of(&self, row: usize) -> Range<usize> {
        row * self.height_px / self.rows..(row + 1) * self.height_px / self.rows
    }

    /// The cell that holds a pixel, or one next to it, row by row.
    pub fn cell_at(&self, x: usize, y: usize) -> usize {
        let (column, row) = (
            x * self.columns / self.width_px,
            y * self.rows / self.height_px,
        );
        row * self.columns + column
    }

    /// Row sampling stride: every this many rows of pixels are measured.
    pub fn row_stride(&self) -> usize {
        let cell_px = (self.width_px / self.columns) * (self.height_px / self.rows);
        if cell_px >= SMALL_CELL_PX {
            ROW_STRIDE
        } else {
            1
        }
    }
}
