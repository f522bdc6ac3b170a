//! The rows of cells of a frame, shared among threads.
//!
//! Each row of cells is worked on by itself, with its own part of every result: so nothing depends on
//! how many threads there are.

use super::mesh::{Grid, Mesh};
use crate::detect::pixels::BlockMaxima;
use std::ops::Range;

/// Rows of cells and their parts of the results; `T` is what is kept of a row of cells beside these.
pub(crate) struct Strips<'a, T> {
    grid: Grid,
    blocks_per_row: usize,
    /// The rows of cells.
    rows: Range<usize>,
    level: &'a mut [f32],
    spread: &'a mut [f32],
    maxima: &'a mut [f32],
    others: &'a mut [T],
}

/// One row of cells.
pub(crate) struct Strip<'a, T> {
    /// The rows of pixels in it.
    pub rows: Range<usize>,
    /// A level for each cell.
    pub level: &'a mut [f32],
    /// A spread for each cell.
    pub spread: &'a mut [f32],
    /// The maxima of the blocks in its rows of pixels.
    pub maxima: &'a mut [f32],
    /// What else is kept.
    pub other: &'a mut T,
}

impl<'a, T: Send> Strips<'a, T> {
    /// All rows of cells of the mesh, with as many `others`.
    pub fn of(mesh: &'a mut Mesh, maxima: &'a mut BlockMaxima, others: &'a mut [T]) -> Self {
        Self {
            grid: mesh.grid,
            blocks_per_row: maxima.per_row,
            rows: 0..mesh.grid.rows,
            level: &mut mesh.level,
            spread: &mut mesh.spread,
            maxima: &mut maxima.values,
            others,
        }
    }

    /// The first `count` rows of cells, and the rest.
    fn split(self, count: usize) -> (Self, Self) {
        let (grid, blocks_per_row) = (self.grid, self.blocks_per_row);
        let middle = self.rows.start + count;
        let pixel_rows = grid.rows_of(middle - 1).end - grid.rows_of(self.rows.start).start;
        let (level, level_rest) = self.level.split_at_mut(count * grid.columns);
        let (spread, spread_rest) = self.spread.split_at_mut(count * grid.columns);
        let (maxima, maxima_rest) = self.maxima.split_at_mut(pixel_rows * blocks_per_row);
        let (others, others_rest) = self.others.split_at_mut(count);
        let first = Self {
            grid,
            blocks_per_row,
            rows: self.rows.start..middle,
            level,
            spread,
            maxima,
            others,
        };
        let rest = Self {
            grid,
            blocks_per_row,
            rows: middle..self.rows.end,
            level: level_rest,
            spread: spread_rest,
            maxima: maxima_rest,
            others: others_rest,
        };
        (first, rest)
    }

    /// Does `work` for each row of cells, with one of the `workers` on a thread of its own.
    pub fn share<W: Send>(self, workers: &mut [W], work: &(impl Fn(&mut W, Strip<'_, T>) + Sync)) {
        let threads = workers.len().min(self.rows.len());
        if threads > 1 {
            let half = threads / 2;
            let count = self.rows.len() * half / threads;
            let (first, rest) = self.split(count);
            let (some, others) = workers.split_at_mut(half);
            rayon::join(|| first.share(some, work), || rest.share(others, work));
        } else if let Some(worker) = workers.first_mut() {
            self.each(|strip| work(worker, strip));
        }
    }

    /// Does `work` for each row of cells, one after the other.
    pub fn each(self, mut work: impl FnMut(Strip<'_, T>)) {
        let columns = self.grid.columns;
        let levels = self.level.chunks_mut(columns);
        let spreads = self.spread.chunks_mut(columns);
        let mut maxima = self.maxima;
        let cells = levels.zip(spreads).zip(self.others);
        for (row, ((level, spread), other)) in self.rows.zip(cells) {
            let rows = self.grid.rows_of(row);
            let (of_row, rest) = maxima.split_at_mut(rows.len() * self.blocks_per_row);
            maxima = rest;
            work(Strip {
                rows,
                level,
                spread,
                maxima: of_row,
                other,
            });
        }
    }
}

/// Does `work` with each of the workers, on a thread of its own; it is told which of them it is.
pub(crate) fn on_each<W: Send>(workers: &mut [W], work: &(impl Fn(&mut W, usize) + Sync)) {
    fn from<W: Send>(first: usize, workers: &mut [W], work: &(impl Fn(&mut W, usize) + Sync)) {
        if let [worker] = workers {
            return work(worker, first);
        }
        let half = workers.len() / 2;
        let (some, others) = workers.split_at_mut(half);
        rayon::join(
            || from(first, some, work),
            || from(first + half, others, work),
        );
    }
    if !workers.is_empty() {
        from(0, workers, work);
    }
}
