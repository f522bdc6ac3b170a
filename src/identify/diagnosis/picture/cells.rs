//! The levels of a picture in few large cells, and their colors.

use crate::base::statistics::median;
use crate::frame::{Frame, LUMINANCE_WEIGHTS};

/// Cells along the longer side.
const CELLS: usize = 40;
/// Each has the median of so many pixels on each axis.
const SAMPLED: usize = 8;

/// The median levels of a picture in square cells.
pub(super) struct Cells {
    pub columns: usize,
    pub rows: usize,
    /// Pixels on a side.
    pub side_px: usize,
    /// Row by row.
    pub levels: Vec<f32>,
}

impl Cells {
    pub fn of(frame: &Frame) -> Self {
        let side_px = frame.width.max(frame.height).div_ceil(CELLS);
        let [columns, rows] = [frame.width, frame.height].map(|side| (side / side_px).max(1));
        let level = |index: usize| {
            let [left, top] = [index % columns, index / columns].map(|cell| cell * side_px);
            let mut values = Vec::with_capacity(SAMPLED * SAMPLED);
            for place in 0..SAMPLED * SAMPLED {
                let [dx, dy] = [place % SAMPLED, place / SAMPLED].map(|at| at * side_px / SAMPLED);
                let x = (left + dx).min(frame.width - 1);
                values.push(frame.at(x, (top + dy).min(frame.height - 1)));
            }
            values.retain(|value| value.is_finite());
            median(&mut values)
        };
        Self {
            columns,
            rows,
            side_px,
            levels: (0..columns * rows).map(level).collect(),
        }
    }

    /// The middle of a cell, in pixels.
    pub fn middle_px(&self, index: usize) -> [f64; 2] {
        [index % self.columns, index / self.columns]
            .map(|cell| (cell as f64 + 0.5) * self.side_px as f64)
    }

    /// The cell of a pixel.
    pub fn at(&self, x: f64, y: f64) -> usize {
        let cell =
            |at: f64, count: usize| ((at.max(0.0) / self.side_px as f64) as usize).min(count - 1);
        cell(y, self.rows) * self.columns + cell(x, self.columns)
    }
}

/// Red, green and blue of cells.
pub(super) fn colors(luminance: &Cells, [red, blue]: &[Frame<'static>; 2]) -> Vec<[f32; 3]> {
    let [red, blue] = [red, blue].map(Cells::of);
    let [of_red, of_green, of_blue] = LUMINANCE_WEIGHTS;
    let levels = luminance
        .levels
        .iter()
        .zip(red.levels.iter().zip(&blue.levels));
    levels
        .map(|(light, (&red, &blue))| {
            let green = (light - of_red * red - of_blue * blue) / of_green;
            [red, green, blue]
        })
        .collect()
}
