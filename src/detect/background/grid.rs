//! The cells of a frame.

use crate::base::size::Size;
use std::ops::Range;

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
    /// Every this many rows of pixels are measured.
    pub row_stride: usize,
}

impl CellGrid {
    /// Cells of about `cell_px` pixels a side in a frame of this size. Of large ones every `row_stride` rows of
    /// pixels are measured, of small ones all.
    pub fn new(size: Size, cell_px: usize, row_stride: usize) -> Self {
        let cells = |side: usize| ((side as f32 / cell_px as f32).round() as usize).max(1);
        let (columns, rows) = (cells(size.width), cells(size.height));
        let is_large = (size.width / columns) * (size.height / rows) >= SMALL_CELL_PX;
        Self {
            columns,
            rows,
            width_px: size.width,
            height_px: size.height,
            row_stride: if is_large { row_stride } else { 1 },
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
}
