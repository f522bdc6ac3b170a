//! The background of a whole frame, to draw the frame or to subtract its gradients.

use crate::detect::background::{Mesh, MeshConfig, Piece, sigma_floor};
use crate::detect::pixels::View;
use crate::frame::{Frame, MIN_SIDE_PX};

/// The background at every pixel of a frame, without the stars.
#[derive(Debug, Clone)]
pub struct BackgroundMap {
    mesh: Mesh,
    /// First column and row of the part that was measured.
    first: [usize; 2],
    /// Its columns and rows; 0 for a frame without light.
    size: [usize; 2],
}

impl BackgroundMap {
    /// Measures the background of `frame` in cells of about `cell_px` pixels a side.
    /// The background of a frame without light is 0.
    pub fn measure(frame: &Frame, cell_px: usize) -> Self {
        let view = View::of_live_pixels(frame);
        let mut map = Self {
            mesh: Mesh::default(),
            first: [view.x0, view.y0],
            size: [view.width, view.height],
        };
        if view.width < MIN_SIDE_PX || view.height < MIN_SIDE_PX {
            map.size = [0, 0];
            return map;
        }
        let config = MeshConfig::of_pixels(cell_px, sigma_floor(&view, 0.0, &mut Vec::new()));
        map.mesh.measure(&view, &config);
        map
    }

    /// Writes the background of the frame's row `y` into `row`, in ADU. Dead borders take the
    /// values next to them.
    pub fn row(&self, y: usize, row: &mut [f32]) {
        let ([x0, y0], [width, height]) = (self.first, self.size);
        if width == 0 {
            return row.fill(0.0);
        }
        let mut pieces: Vec<Piece> = Vec::new();
        let y = y.saturating_sub(y0).min(height - 1);
        self.mesh.row_pieces(y, &mut pieces);
        for piece in &pieces {
            for x in piece.start..piece.end {
                let background =
                    piece.background + (x - piece.start) as f32 * piece.background_slope;
                if let Some(pixel) = row.get_mut(x0 + x) {
                    *pixel = background;
                }
            }
        }
        let (left, right) = (row[x0], row[x0 + width - 1]);
        row[..x0].fill(left);
        row[x0 + width..].fill(right);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gradient_is_followed_and_a_dead_border_left_out() {
        let (width, height) = (300, 200);
        let noise = |i: usize| ((i * 7919) % 101) as f32 * 0.02 - 1.0;
        let level = |x: usize, y: usize| 100.0 + 0.5 * x as f32 + 0.2 * y as f32;
        let pixels = (0..width * height).map(|i| match (i % width, i / width) {
            (x, _) if x < 20 => 0.0,
            (x, y) => level(x, y) + noise(i),
        });
        let frame = Frame::new(width, height, pixels.collect()).unwrap();
        let map = BackgroundMap::measure(&frame, 64);
        let mut levels = vec![0.0; width];
        for y in [0, 77, 199] {
            map.row(y, &mut levels);
            for x in [20, 150, 299] {
                assert!(
                    (levels[x] - level(x, y)).abs() < 1.0,
                    "({x}, {y}): {}",
                    levels[x]
                );
            }
            assert_eq!(levels[0], levels[20]);
        }
    }

    #[test]
    fn the_background_of_a_frame_without_light_is_zero() {
        let frame = Frame::new(10, 10, vec![7.0; 100]).unwrap();
        let mut levels = vec![1.0; 10];
        BackgroundMap::measure(&frame, 64).row(3, &mut levels);
        assert_eq!(levels, vec![0.0; 10]);
    }
}
