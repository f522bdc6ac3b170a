//! Square cells over a frame, for what is counted place by place.

use super::field::StarField;

/// A division of the frame into square cells.
pub struct Grid {
    columns: usize,
    rows: usize,
    /// Side of a cell, in pixels.
    pub cell_px: f64,
    per_px: f64,
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
            per_px: 1.0 / cell_px,
        }
    }

    /// Column and row of the cell at a position.
    fn column_and_row(&self, x: f64, y: f64) -> (usize, usize) {
        let cell = |at: f64, count: usize| ((at * self.per_px).max(0.0) as usize).min(count - 1);
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

    /// Replaces each of `values` by its sum with those of the neighbouring cells. `scratch` is a
    /// buffer.
    pub fn sum_with_neighbours(&self, values: &mut [f64], scratch: &mut Vec<f64>) {
        scratch.clear();
        for row in values.chunks_exact(self.columns) {
            let at = |column: usize| row.get(column).copied().unwrap_or(0.0);
            let sums = (0..self.columns).map(|c| at(c.wrapping_sub(1)) + at(c) + at(c + 1));
            scratch.extend(sums);
        }
        for (cell, value) in values.iter_mut().enumerate() {
            let at = |cell: usize| scratch.get(cell).copied().unwrap_or(0.0);
            *value = at(cell.wrapping_sub(self.columns)) + at(cell) + at(cell + self.columns);
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::Photometry;

    #[test]
    fn sums_with_neighbours_are_those_around_each_cell() {
        let field = StarField {
            width_px: 700.0,
            height_px: 400.0,
            photometry: Photometry::Instrumental,
            years_since_j2000: 0.0,
            spot_sigma_px: None,
            stars: Vec::new(),
        };
        let grid = Grid::new(&field, 7);
        let values: Vec<f64> = (0..grid.cells()).map(|i| ((i * 37) % 11) as f64).collect();
        let mut sums = values.clone();
        grid.sum_with_neighbours(&mut sums, &mut Vec::new());
        for (x, y) in [
            (50.0, 50.0),
            (650.0, 350.0),
            (350.0, 150.0),
            (50.0, 350.0),
            (650.0, 50.0),
        ] {
            let around = grid.around(x, y, &values).0;
            assert_eq!(sums[grid.cell_of(x, y)], around, "{x} {y}");
        }
    }
}
