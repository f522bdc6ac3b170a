//! Gaps and outliers of a mesh.
//!
//! Cells without a value take the mean of their neighbors. The noise is smoothed by a median of
//! 3x3 cells; the background is replaced by it only where it is an outlier. Beyond the border the
//! background goes on as a plane does.

use super::grid::CellGrid;
use super::medians;

/// Fills gaps and replaces outliers; holds the buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Smoother {
    /// The background as measured, with a border of one cell in which it is extrapolated.
    padded_background: Vec<f32>,
    measured_sigma: Vec<f32>,
}

impl Smoother {
    /// Gives cells without a value the mean of their neighbors that have one, until all have.
    pub fn fill_gaps(&mut self, grid: &CellGrid, background: &mut [f32], sigma: &mut [f32]) {
        if background.iter().all(|v| v.is_nan()) {
            background.fill(0.0);
            sigma.fill(0.0);
            return;
        }
        let measured_background = &mut self.padded_background;
        while background.iter().any(|v| v.is_nan()) {
            measured_background.clear();
            measured_background.extend_from_slice(background);
            self.measured_sigma.clear();
            self.measured_sigma.extend_from_slice(sigma);
            for i in (0..background.len()).filter(|&i| measured_background[i].is_nan()) {
                let known = |j: &usize| !measured_background[*j].is_nan();
                let [mut count, mut background_sum, mut sigma_sum] = [0.0; 3];
                for j in neighbors(grid, i).filter(known) {
                    count += 1.0;
                    background_sum += measured_background[j];
                    sigma_sum += self.measured_sigma[j];
                }
                if count > 0.0 {
                    background[i] = background_sum / count;
                    sigma[i] = sigma_sum / count;
                }
            }
        }
    }

    /// Replaces each noise by the median of 3x3 cells, and the backgrounds that are outliers.
    pub fn smooth(&mut self, grid: &CellGrid, background: &mut [f32], sigma: &mut [f32]) {
        self.smooth_noise(grid, sigma);
        self.pad(grid, background);
        let CellGrid { columns, rows, .. } = *grid;
        let stride = columns + 2;
        for row in 0..rows {
            let cells = row * columns..(row + 1) * columns;
            let around = [row, row + 1, row + 2]
                .map(|r| &self.padded_background[r * stride..(r + 1) * stride]);
            medians::replace_outliers(around, &sigma[cells.clone()], &mut background[cells]);
        }
    }

    /// Replaces each noise by the median of 3x3 cells.
    pub fn smooth_noise(&mut self, grid: &CellGrid, sigma: &mut [f32]) {
        let CellGrid { columns, rows, .. } = *grid;
        self.measured_sigma.clear();
        self.measured_sigma.extend_from_slice(sigma);
        for row in 0..rows {
            let cells = row * columns..(row + 1) * columns;
            if row > 0 && row + 1 < rows && columns > 2 {
                let around = [cells.start - columns, cells.start, cells.start + columns]
                    .map(|start| &self.measured_sigma[start..start + columns]);
                medians::of_squares(around, &mut sigma[cells.start + 1..cells.end - 1]);
                for cell in [cells.start, cells.end - 1] {
                    sigma[cell] = self.median_at_border(grid, cell);
                }
            } else {
                for cell in cells {
                    sigma[cell] = self.median_at_border(grid, cell);
                }
            }
        }
    }

    /// The median noise about a cell at the border: of an even number of cells, the lower middle
    /// one.
    fn median_at_border(&self, grid: &CellGrid, cell: usize) -> f32 {
        let mut around = [f32::INFINITY; 9];
        let mut count = 0;
        for (value, other) in around.iter_mut().zip(neighbors(grid, cell)) {
            *value = self.measured_sigma[other];
            count += 1;
        }
        around.sort_unstable_by(f32::total_cmp);
        around[(count - 1) / 2]
    }

    /// Copies the background into a border of one cell, in which it is extrapolated linearly: so a
    /// gradient lies about a border cell as about any other.
    fn pad(&mut self, grid: &CellGrid, background: &[f32]) {
        let CellGrid { columns, rows, .. } = *grid;
        let stride = columns + 2;
        // Along one axis: the cell next to the border, and as far inside it as the wanted one is
        // outside.
        let mirror = |at: usize, count: usize| {
            let inside = at.clamp(1, count) - 1;
            let mirrored = (2 * inside + 1).saturating_sub(at).min(count - 1);
            (inside, mirrored)
        };
        self.padded_background.resize(stride * (rows + 2), 0.0);
        for (i, value) in self.padded_background.iter_mut().enumerate() {
            let (row, mirrored_row) = mirror(i / stride, rows);
            let (column, mirrored_column) = mirror(i % stride, columns);
            let at = |r: usize, c: usize| background[r * columns + c];
            *value = 2.0 * at(row, column) - at(mirrored_row, mirrored_column);
        }
    }
}

/// The indices of the 3x3 cells around cell `index`, itself among them.
fn neighbors(grid: &CellGrid, index: usize) -> impl Iterator<Item = usize> + use<> {
    let columns = grid.columns;
    let (row, column) = (index / columns, index % columns);
    let rows = row.saturating_sub(1)..(row + 2).min(grid.rows);
    let span = column.saturating_sub(1)..(column + 2).min(columns);
    rows.flat_map(move |r| span.clone().map(move |c| r * columns + c))
}
