//! The brightness of a frame in cells.

use crate::base::coords::PixelPoint;
use crate::base::statistics::median;
use crate::frame::Frame;

/// Cells along the longer side of a frame.
const CELLS: usize = 192;
/// Smallest cell, in pixels.
const MIN_CELL_PX: usize = 4;
/// Pixels along a side of a cell that are looked at.
const SAMPLES: usize = 3;

/// Square cells of a frame, row by row; what is at the right and at the bottom and fills no cell belongs to
/// the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SquareCells {
    pub side_px: usize,
    pub columns: usize,
    pub rows: usize,
}

impl SquareCells {
    fn of(frame: &Frame) -> Self {
        let longer_px = frame.width.max(frame.height);
        let side_px = longer_px.div_ceil(CELLS).max(MIN_CELL_PX);
        let [columns, rows] = [frame.width, frame.height].map(|side| (side / side_px).max(1));
        Self {
            side_px,
            columns,
            rows,
        }
    }

    /// The cell at a place, or the one nearest to it.
    pub fn at(&self, place: &PixelPoint) -> usize {
        let cell =
            |at: f64, cells: usize| ((at + 0.5).max(0.0) as usize / self.side_px).min(cells - 1);
        cell(place.y, self.rows) * self.columns + cell(place.x, self.columns)
    }
}

/// The brightness of a frame in cells: the medians of some of their pixels.
pub(super) struct CellMedians {
    pub cells: SquareCells,
    /// Row by row, in ADU; NaN where a cell has no value.
    pub adu: Vec<f32>,
    saturation_adu: f32,
}

impl CellMedians {
    /// Measures the cells of a frame.
    pub fn of(frame: &Frame, saturation_adu: f32) -> Self {
        let cells = SquareCells::of(frame);
        let (cell_px, columns) = (cells.side_px, cells.columns);
        let mut samples = Vec::with_capacity(SAMPLES * SAMPLES);
        let mut level = |cell: usize| {
            let [x, y] = [cell % columns, cell / columns].map(|at| at * cell_px);
            samples.clear();
            for step in 0..SAMPLES * SAMPLES {
                let at =
                    |first: usize, step: usize| first + (2 * step + 1) * cell_px / (2 * SAMPLES);
                let (x, y) = (at(x, step % SAMPLES), at(y, step / SAMPLES));
                if x < frame.width && y < frame.height {
                    samples.push(frame.at(x, y));
                }
            }
            samples.retain(|value| value.is_finite());
            match samples.is_empty() {
                true => f32::NAN,
                false => median(&mut samples),
            }
        };
        let adu: Vec<f32> = (0..columns * cells.rows).map(&mut level).collect();
        Self {
            cells,
            adu,
            saturation_adu,
        }
    }

    /// Whether most of a cell is saturated.
    pub fn is_saturated(&self, cell: usize) -> bool {
        self.adu[cell] >= self.saturation_adu
    }

    /// The cell so many steps away; `None` outside the frame.
    pub fn neighbor(&self, cell: usize, way: [isize; 2], steps: isize) -> Option<usize> {
        let along = |at: usize, way: isize, cells: usize| {
            let at = at.checked_add_signed(way * steps)?;
            (at < cells).then_some(at)
        };
        let SquareCells { columns, rows, .. } = self.cells;
        let x = along(cell % columns, way[0], columns)?;
        let y = along(cell / columns, way[1], rows)?;
        Some(y * columns + x)
    }

    /// The number of stars in each cell.
    pub fn count(&self, stars: impl Iterator<Item = PixelPoint>) -> Vec<u32> {
        let mut counts = vec![0; self.adu.len()];
        for place in stars {
            counts[self.cells.at(&place)] += 1;
        }
        counts
    }
}
