//! The sky between the stars, for who wants to draw a frame or to look at it without its gradients.

use crate::detect::background::{Mesh, MeshConfig, Piece};
use crate::detect::least_noise;
use crate::detect::pixels::View;
use crate::frame::{Frame, MIN_SIDE_PX};

/// The level of the background everywhere in a frame, without the stars.
#[derive(Debug, Clone)]
pub struct BackgroundMap {
    mesh: Mesh,
    /// The part of the frame that was measured: first column and row, columns and rows.
    first: [usize; 2],
    size: [usize; 2],
}

impl BackgroundMap {
    /// Measures the background of `frame` in cells of about `cell_px` pixels a side.
    /// A frame without light has the level 0.
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
        let config = MeshConfig {
            cell_px,
            spread_of_differences: true,
            spread_floor: least_noise(&view),
            is_normalised: false,
        };
        map.mesh.measure(&view, &config);
        map
    }

    /// Writes the levels of the frame's row `y` into `levels`, in ADU; beyond dead borders they are held.
    pub fn row(&self, y: usize, levels: &mut [f32]) {
        let ([x0, y0], [width, height]) = (self.first, self.size);
        if width == 0 {
            return levels.fill(0.0);
        }
        let mut pieces: Vec<Piece> = Vec::new();
        let y = y.saturating_sub(y0).min(height - 1);
        self.mesh.row_pieces(y, &mut pieces);
        for piece in &pieces {
            for x in piece.start..piece.end {
                let level = piece.level + (x - piece.start) as f32 * piece.level_slope;
                if let Some(place) = levels.get_mut(x0 + x) {
                    *place = level;
                }
            }
        }
        let (left, right) = (levels[x0], levels[x0 + width - 1]);
        levels[..x0].fill(left);
        levels[x0 + width..].fill(right);
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
    fn a_frame_of_one_level_has_no_background_to_speak_of() {
        let frame = Frame::new(10, 10, vec![7.0; 100]).unwrap();
        let mut levels = vec![1.0; 10];
        BackgroundMap::measure(&frame, 64).row(3, &mut levels);
        assert_eq!(levels, vec![0.0; 10]);
    }
}
