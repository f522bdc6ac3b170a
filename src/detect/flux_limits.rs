//! How bright a star must be to be detected, by place.

use super::background::Mesh;
use super::pixels::View;
use crate::base::coords::PixelPoint;

/// The flux at which half of the stars are detected, in parts of the frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct FluxLimits {
    /// Columns and rows of parts.
    parts: [usize; 2],
    /// Row by row, in ADU.
    adu: Vec<f32>,
    /// That of the frame's stated noise and threshold.
    typical_adu: f64,
}

impl FluxLimits {
    /// Sets those of a frame that was searched with a `threshold` over the noise of the filtered frame, which
    /// edges, clouds and crowds of faint stars raise. A star whose flux is the noise of a pixel has the
    /// signal-to-noise ratio `gain`; `typical_adu` is that of the frame's stated noise and threshold.
    pub(super) fn set(
        &mut self,
        view: &View,
        [background, filtered]: [&Mesh; 2],
        threshold: f64,
        gain: f64,
        typical_adu: f64,
    ) {
        self.typical_adu = typical_adu;
        let grid = &background.grid;
        self.parts = [grid.columns, grid.rows];
        self.adu.clear();
        let middle = |part: usize, parts: usize, side: usize| {
            (part as f32 + 0.5) * side as f32 / parts as f32 - 0.5
        };
        for row in 0..grid.rows {
            let y = middle(row, grid.rows, view.height);
            for column in 0..grid.columns {
                let x = middle(column, grid.columns, view.width);
                let (_, noise_adu) = background.at(x, y);
                // The threshold is above the local mean of the filtered frame, and so is the star.
                let (_, sigma) = filtered.at(x, y);
                self.adu
                    .push(threshold as f32 * sigma * noise_adu / gain as f32);
            }
        }
    }

    /// Multiplies all by `factor`.
    pub(crate) fn scale(&mut self, factor: f64) {
        self.typical_adu *= factor;
        for limit in &mut self.adu {
            *limit *= factor as f32;
        }
    }

    /// Forgets them.
    pub(super) fn clear(&mut self) {
        self.parts = [0; 2];
        self.adu.clear();
    }

    /// That of the noise and the threshold that are stated for the frame; `None` where nothing was searched.
    pub(crate) fn typical(&self) -> Option<f64> {
        (!self.adu.is_empty()).then_some(self.typical_adu)
    }

    /// The flux at a place of a frame of this size, in ADU; `None` where nothing was searched.
    pub(crate) fn at(&self, pixel: &PixelPoint, size_px: [f64; 2]) -> Option<f64> {
        let [columns, rows] = self.parts;
        let part = |at: f64, side: f64, parts: usize| {
            (((at + 0.5) / side * parts as f64).max(0.0) as usize).min(parts.saturating_sub(1))
        };
        let index = part(pixel.y, size_px[1], rows) * columns + part(pixel.x, size_px[0], columns);
        self.adu.get(index).map(|adu| f64::from(*adu))
    }
}
