//! The brightness of a frame in cells.

use crate::base::coords::PixelPoint;
use crate::frame::Frame;

/// Cells along the longer side of a frame.
const CELLS: usize = 192;
/// Smallest cell, in pixels.
const MIN_CELL_PX: usize = 4;
/// Pixels along a side of a cell that are looked at.
const SAMPLES: usize = 3;

/// The brightness of a frame in cells: the medians of some of their pixels.
pub(super) struct Levels {
    pub cell_px: usize,
    pub columns: usize,
    /// Row by row, in ADU; NaN where a cell has no value.
    pub adu: Vec<f32>,
    saturation_adu: f32,
}

impl Levels {
    /// Measures the cells of a frame; what is at the right and at the bottom and fills no cell belongs to
    /// the last.
    pub fn of(frame: &Frame, saturation_adu: f32) -> Self {
        let longer_px = frame.width.max(frame.height);
        let cell_px = longer_px.div_ceil(CELLS).max(MIN_CELL_PX);
        let [columns, rows] = [frame.width, frame.height].map(|side| (side / cell_px).max(1));
        let mut samples = Vec::with_capacity(SAMPLES * SAMPLES);
        let mut median = |cell: usize| {
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
            let middle = samples.len() / 2;
            match samples.is_empty() {
                true => f32::NAN,
                false => *samples.select_nth_unstable_by(middle, f32::total_cmp).1,
            }
        };
        let adu: Vec<f32> = (0..columns * rows).map(&mut median).collect();
        Self {
            cell_px,
            columns,
            adu,
            saturation_adu,
        }
    }

    /// Whether most of a cell is saturated.
    pub fn is_saturated(&self, cell: usize) -> bool {
        self.adu[cell] >= self.saturation_adu
    }

    pub fn rows(&self) -> usize {
        self.adu.len() / self.columns
    }

    /// The cell so many steps away; `None` outside the frame.
    pub fn neighbor(&self, cell: usize, way: [isize; 2], steps: isize) -> Option<usize> {
        let along = |at: usize, way: isize, cells: usize| {
            let at = at.checked_add_signed(way * steps)?;
            (at < cells).then_some(at)
        };
        let x = along(cell % self.columns, way[0], self.columns)?;
        let y = along(cell / self.columns, way[1], self.rows())?;
        Some(y * self.columns + x)
    }

    /// The number of stars in each cell.
    pub fn count(&self, stars: impl Iterator<Item = PixelPoint>) -> Vec<u32> {
        let mut counts = vec![0; self.adu.len()];
        let cell = |at: f64, cells: usize| (at.max(0.0) as usize / self.cell_px).min(cells - 1);
        for PixelPoint { x, y } in stars {
            counts[cell(y, self.rows()) * self.columns + cell(x, self.columns)] += 1;
        }
        counts
    }
}
