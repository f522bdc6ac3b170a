//! Square cells over a frame, for what is counted place by place.

use super::field::StarField;

/// A division of the frame into square cells.
pub struct Grid {
    columns: usize,
    rows: usize,
    /// Side of a cell, in pixels.
    pub cell_px: f64,
}

impl Grid {
    /// A grid with `cells` along the frame's longer side.
    pub fn new(field: &StarField, cells: usize) -> Self {
        let cell_px = field.width_px.max(field.height_px) / cells as f64;
        let count = |extent_px: f64| ((extent_px / cell_px).ceil() as usize).max(1);
        Self {
            columns: count(field.width_px),
            rows: count(field.height_px),
            cell_px,
        }
    }

    /// Column and row of the cell at a position.
    fn column_and_row(&self, x: f64, y: f64) -> (usize, usize) {
        let cell = |at: f64, count: usize| ((at / self.cell_px).max(0.0) as usize).min(count - 1);
        (cell(x, self.columns), cell(y, self.rows))
    }

    /// The number of cells.
    pub fn cells(&self) -> usize {
        self.columns * self.rows
    }

    /// The cell at a position; outside the frame, the nearest.
    pub fn cell_of(&self, x: f64, y: f64) -> usize {
        let (column, row) = self.column_and_row(x, y);
        row * self.columns + column
    }

    /// The sum of `values` of the cell at a position and its neighbours, and how many these are.
    pub fn around(&self, x: f64, y: f64, values: &[f64]) -> (f64, usize) {
        let (column, row) = self.column_and_row(x, y);
        let columns = column.saturating_sub(1)..(column + 2).min(self.columns);
        let rows = row.saturating_sub(1)..(row + 2).min(self.rows);
        let cells = columns.len() * rows.len();
        let of_row = |row: usize| {
            let start = row * self.columns;
            values[start + columns.start..start + columns.end]
                .iter()
                .sum::<f64>()
        };
        (rows.map(of_row).sum(), cells)
    }
}
