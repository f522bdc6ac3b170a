//! Square cells over a frame, for what is counted place by place.

use crate::identify::field::StarField;

/// A division of the frame into square cells. Around it is a border of cells that stay empty, so
/// that each cell of the frame has eight neighbors.
#[derive(Debug, Clone, Copy)]
pub struct FrameGrid {
    /// Without the border.
    columns: usize,
    rows: usize,
    cell_px: f64,
    per_px: f64,
}

impl FrameGrid {
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
        let cell =
            |at: f64, count: usize| ((at * self.per_px).max(0.0) as u32 as usize).min(count - 1);
        (cell(x, self.columns), cell(y, self.rows))
    }

    /// Cells from one to that below it.
    fn stride(&self) -> usize {
        self.columns + 2
    }

    /// The number of cells, with the border.
    pub fn cells(&self) -> usize {
        self.stride() * (self.rows + 2)
    }

    /// The cell at a position; outside the frame, the nearest.
    pub fn cell_of(&self, x: f64, y: f64) -> usize {
        let (column, row) = self.column_and_row(x, y);
        (row + 1) * self.stride() + column + 1
    }

    /// The area of the cell at a position and of its neighbors in the frame, in square pixels.
    pub fn area_around_px2(&self, x: f64, y: f64) -> f64 {
        let (column, row) = self.column_and_row(x, y);
        let along = |at: usize, count: usize| (at + 2).min(count) - at.saturating_sub(1);
        let cells = along(column, self.columns) * along(row, self.rows);
        cells as f64 * self.cell_px.powi(2)
    }

    /// The sum of `values` of a cell of the frame and its neighbors.
    pub fn sum_around(&self, cell: usize, values: &[f64]) -> f64 {
        let of_row = |middle: usize| -> f64 { values[middle - 1..middle + 2].iter().sum() };
        of_row(cell - self.stride()) + of_row(cell) + of_row(cell + self.stride())
    }

    /// Replaces each of `values` within the frame by its sum with those of the neighboring cells;
    /// those of the border become meaningless. `scratch` is a buffer.
    pub fn sum_with_neighbors(&self, values: &mut [f64], scratch: &mut Vec<f64>) {
        let (count, stride) = (self.cells(), self.stride());
        scratch.clear();
        scratch.resize(count, 0.0);
        let of_rows = scratch[1..].iter_mut().zip(values.windows(3));
        for (sum, near) in of_rows {
            *sum = near[0] + near[1] + near[2];
        }
        let rows = scratch.iter().zip(&scratch[stride..]);
        let rows = rows.zip(&scratch[2 * stride..]);
        for (value, ((above, own), below)) in values[stride..].iter_mut().zip(rows) {
            *value = above + own + below;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> FrameGrid {
        let field = StarField::of_places([700.0, 400.0], &[]);
        FrameGrid::new(&field, 7)
    }

    /// The middles of the cells, as column and row.
    fn middles() -> impl Iterator<Item = (usize, usize)> + Clone {
        (0..4).flat_map(|row| (0..7).map(move |column| (column, row)))
    }

    fn at((column, row): (usize, usize)) -> (f64, f64) {
        (100.0 * column as f64 + 50.0, 100.0 * row as f64 + 50.0)
    }

    #[test]
    fn sums_are_those_of_the_neighbors_in_the_frame() {
        let grid = grid();
        let mut values = vec![0.0; grid.cells()];
        let value = |(column, row): (usize, usize)| ((column * 37 + row * 101) % 11) as f64;
        for place in middles() {
            let (x, y) = at(place);
            values[grid.cell_of(x, y)] = value(place);
        }
        let mut sums = values.clone();
        grid.sum_with_neighbors(&mut sums, &mut Vec::new());
        for place in middles() {
            let (x, y) = at(place);
            let near = middles()
                .filter(|near| near.0.abs_diff(place.0) <= 1 && near.1.abs_diff(place.1) <= 1);
            let expected: f64 = near.clone().map(value).sum();
            let cell = grid.cell_of(x, y);
            assert_eq!(grid.sum_around(cell, &values), expected, "{place:?}");
            assert_eq!(sums[cell], expected, "{place:?}");
            let area_px2 = near.count() as f64 * 1e4;
            assert_eq!(grid.area_around_px2(x, y), area_px2, "{place:?}");
        }
    }

    #[test]
    fn outside_the_frame_is_the_nearest_cell() {
        let grid = grid();
        assert_eq!(grid.cell_of(-30.0, 950.0), grid.cell_of(10.0, 390.0));
    }
}
