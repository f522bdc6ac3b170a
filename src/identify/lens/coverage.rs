//! Where in the frame a lens is known, and what it misses there.

use super::frames::LensFrame;
use crate::camera::CameraModel;
use serde::Serialize;

/// Cells along the longer side of the frame.
const CELLS: usize = 12;

/// Where in the frame stars are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// Number of columns of cells.
    pub columns: usize,
    /// Number of rows of cells.
    pub rows: usize,
    /// The cells, row by row.
    pub cells: Vec<CoverageCell>,
}

/// A part of the frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct CoverageCell {
    /// Its centre, in pixels.
    pub centre_px: [f64; 2],
    /// Stars in it, of all frames.
    pub stars: usize,
    /// Their mean residual, observed minus predicted, in pixels along the frame.
    pub mean_px: [f64; 2],
}

impl Coverage {
    /// The stars of frames with their residuals along the camera's axes.
    pub(super) fn new(
        camera: &CameraModel,
        frames: &[LensFrame],
        residuals_px: &[Vec<[f64; 2]>],
    ) -> Self {
        let side_px = camera.width_px.max(camera.height_px) / CELLS as f64;
        let [columns, rows] = [camera.width_px, camera.height_px]
            .map(|side| ((side / side_px).round() as usize).max(1));
        let [width_px, height_px] = [
            camera.width_px / columns as f64,
            camera.height_px / rows as f64,
        ];
        let mut cells = vec![CoverageCell::default(); columns * rows];
        for (number, cell) in cells.iter_mut().enumerate() {
            let [column, row] =
                [number % columns, number / columns].map(|place| place as f64 + 0.5);
            cell.centre_px = [column * width_px - 0.5, row * height_px - 0.5];
        }
        let mirror = if camera.mirrored { -1.0 } else { 1.0 };
        for (frame, residuals) in frames.iter().zip(residuals_px) {
            for (star, [x, y]) in frame.joint.stars.iter().zip(residuals) {
                let place = |along: f64, side: f64, count: usize| {
                    (((along + 0.5) / side) as usize).min(count - 1)
                };
                let column = place(star.pixel.x, width_px, columns);
                let row = place(star.pixel.y, height_px, rows);
                let cell = &mut cells[row * columns + column];
                cell.stars += 1;
                cell.mean_px[0] += mirror * x;
                cell.mean_px[1] += y;
            }
        }
        for cell in &mut cells {
            let stars = cell.stars.max(1) as f64;
            cell.mean_px = cell.mean_px.map(|sum| sum / stars);
        }
        Self {
            columns,
            rows,
            cells,
        }
    }

    /// Share of the cells that have stars.
    pub fn share(&self) -> f64 {
        let filled = self.cells.iter().filter(|cell| cell.stars > 0).count();
        filled as f64 / self.cells.len().max(1) as f64
    }
}
