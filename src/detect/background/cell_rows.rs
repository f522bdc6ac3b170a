//! The rows of cells of a frame, shared among threads.
//!
//! Each row of cells is processed by itself and writes its own part of every result, so results do
//! not depend on the number of threads.

use super::grid::CellGrid;
use super::mesh::Mesh;
use crate::detect::pixels::BlockMaxima;
use std::ops::Range;

/// Rows of cells, and their parts of the results; each row has an output of type `T`, too.
pub(crate) struct CellRows<'a, T> {
    grid: CellGrid,
    blocks_per_row: usize,
    /// The rows of cells.
    rows: Range<usize>,
    background: &'a mut [f32],
    sigma: &'a mut [f32],
    slope_sigma: [&'a mut [f32]; 2],
    maxima: &'a mut [f32],
    outputs: &'a mut [T],
}

/// One row of cells.
pub(crate) struct CellRow<'a, T> {
    /// The rows of pixels in it.
    pub rows: Range<usize>,
    /// The background of each cell.
    pub background: &'a mut [f32],
    /// The noise of each cell.
    pub sigma: &'a mut [f32],
    /// The noise of each cell from slopes, along x and along y.
    pub slope_sigma: [&'a mut [f32]; 2],
    /// The maxima of the blocks in its rows of pixels.
    pub maxima: &'a mut [f32],
    /// The row's further output.
    pub output: &'a mut T,
}

impl<'a, T: Send> CellRows<'a, T> {
    /// All rows of cells of the mesh, with an output for each.
    pub fn new(mesh: &'a mut Mesh, maxima: &'a mut BlockMaxima, outputs: &'a mut [T]) -> Self {
        Self {
            grid: mesh.grid,
            blocks_per_row: maxima.per_row,
            rows: 0..mesh.grid.rows,
            background: &mut mesh.background,
            sigma: &mut mesh.sigma,
            slope_sigma: mesh.slope_sigma.each_mut().map(Vec::as_mut_slice),
            maxima: &mut maxima.values,
            outputs,
        }
    }

    /// The first `count` rows of cells, and the rest.
    fn split(self, count: usize) -> (Self, Self) {
        let (grid, blocks_per_row) = (self.grid, self.blocks_per_row);
        let middle = self.rows.start + count;
        let pixel_rows = grid.rows_of(middle - 1).end - grid.rows_of(self.rows.start).start;
        let (background, background_rest) = self.background.split_at_mut(count * grid.columns);
        let (sigma, sigma_rest) = self.sigma.split_at_mut(count * grid.columns);
        let [(along_x, along_x_rest), (along_y, along_y_rest)] = self
            .slope_sigma
            .map(|sigma| sigma.split_at_mut(count * grid.columns));
        let (maxima, maxima_rest) = self.maxima.split_at_mut(pixel_rows * blocks_per_row);
        let (outputs, outputs_rest) = self.outputs.split_at_mut(count);
        let first = Self {
            grid,
            blocks_per_row,
            rows: self.rows.start..middle,
            background,
            sigma,
            slope_sigma: [along_x, along_y],
            maxima,
            outputs,
        };
        let rest = Self {
            grid,
            blocks_per_row,
            rows: middle..self.rows.end,
            background: background_rest,
            sigma: sigma_rest,
            slope_sigma: [along_x_rest, along_y_rest],
            maxima: maxima_rest,
            outputs: outputs_rest,
        };
        (first, rest)
    }

    /// Calls `work` for each row of cells, on one thread for each of the `workers`.
    pub fn distribute<W: Send>(
        self,
        workers: &mut [W],
        work: &(impl Fn(&mut W, CellRow<'_, T>) + Sync),
    ) {
        let threads = workers.len().min(self.rows.len());
        if threads > 1 {
            let half = threads / 2;
            let count = self.rows.len() * half / threads;
            let (first, rest) = self.split(count);
            let (some, others) = workers.split_at_mut(half);
            rayon::join(
                || first.distribute(some, work),
                || rest.distribute(others, work),
            );
        } else if let Some(worker) = workers.first_mut() {
            self.each(|row| work(worker, row));
        }
    }

    /// Calls `work` for each row of cells, one after the other.
    fn each(self, mut work: impl FnMut(CellRow<'_, T>)) {
        let columns = self.grid.columns;
        let backgrounds = self.background.chunks_mut(columns);
        let sigmas = self.sigma.chunks_mut(columns);
        let [along_x, along_y] = self.slope_sigma.map(|sigma| sigma.chunks_mut(columns));
        let mut maxima = self.maxima;
        let cells = backgrounds
            .zip(sigmas)
            .zip(along_x.zip(along_y))
            .zip(self.outputs);
        for (row, (((background, sigma), (along_x, along_y)), output)) in self.rows.zip(cells) {
            let rows = self.grid.rows_of(row);
            let (of_row, rest) = maxima.split_at_mut(rows.len() * self.blocks_per_row);
            maxima = rest;
            work(CellRow {
                rows,
                background,
                sigma,
                slope_sigma: [along_x, along_y],
                maxima: of_row,
                output,
            });
        }
    }
}
