//! The peaks near a peak, found by a grid of cells.

use crate::detect::candidates::Peak;

/// Peaks sorted into the cells of a grid, for queries of the peaks near one of them.
#[derive(Debug, Clone, Default)]
pub(super) struct NeighborGrid {
    reach_px: f64,
    cell_px: f64,
    columns: usize,
    rows: usize,
    /// Where in `members` each cell starts, and the number of members.
    starts: Vec<u32>,
    members: Vec<u32>,
    /// Result of the last query: indices of the peaks within reach without the peak itself,
    /// strongest first.
    pub found: Vec<u32>,
}

impl NeighborGrid {
    /// Maximum number of cells along a side; few peaks far apart need no more.
    const MAX_CELLS: f64 = 512.0;

    /// Sorts the peaks into cells, for queries out to `reach_px`.
    pub fn sort(&mut self, peaks: &[Peak], reach_px: f64) {
        let largest = |side: fn(&Peak) -> usize| peaks.iter().map(side).max().unwrap_or(0) as f64;
        let (right, bottom) = (largest(|p| p.x), largest(|p| p.y));
        self.reach_px = reach_px.max(1.0);
        self.cell_px = self.reach_px.max(right.max(bottom) / Self::MAX_CELLS);
        self.columns = (right / self.cell_px) as usize + 1;
        self.rows = (bottom / self.cell_px) as usize + 1;
        self.starts.clear();
        self.starts.resize(self.columns * self.rows + 1, 0);
        self.members.resize(peaks.len(), 0);
        let cell_of = |grid: &Self, peak: &Peak| {
            let (column, row) = grid.cell(peak);
            row * grid.columns + column
        };
        for peak in peaks {
            let cell = cell_of(self, peak);
            self.starts[cell] += 1;
        }
        // Counting sort: counts become ends, and ends become starts while filling from the back.
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        for (index, peak) in peaks.iter().enumerate().rev() {
            let cell = cell_of(self, peak);
            self.starts[cell] -= 1;
            self.members[self.starts[cell] as usize] = index as u32;
        }
    }

    /// Column and row of the cell of a peak.
    fn cell(&self, peak: &Peak) -> (usize, usize) {
        (
            (peak.x as f64 / self.cell_px) as usize,
            (peak.y as f64 / self.cell_px) as usize,
        )
    }

    /// Finds the peaks within reach of peak `index`.
    pub fn find(&mut self, peaks: &[Peak], index: usize) {
        let (cx, cy) = self.cell(&peaks[index]);
        self.found.clear();
        for row in cy.saturating_sub(1)..(cy + 2).min(self.rows) {
            let first = row * self.columns + cx.saturating_sub(1);
            let end = row * self.columns + (cx + 2).min(self.columns);
            let members = self.starts[first] as usize..self.starts[end] as usize;
            for &other in &self.members[members] {
                let (a, b) = (&peaks[other as usize], &peaks[index]);
                let (dx, dy) = (a.x as f64 - b.x as f64, a.y as f64 - b.y as f64);
                let is_near = dx * dx + dy * dy <= self.reach_px * self.reach_px;
                if is_near && other as usize != index {
                    self.found.push(other);
                }
            }
        }
        self.found.sort_unstable();
    }
}
