//! Draws satellites, aeroplanes and meteors: a line on each side.

use super::canvas::Canvas;
use super::picture::Picture;
use crate::report::figure::Rgb;
use crate::solve::Solution;

const COLOR: Rgb = Rgb([140, 235, 150]);
/// Distance of a line from the edge of the light, and its width, in strokes.
const GAP: f32 = 3.0;
const STROKE: f32 = 1.2;

/// Draws the trails of a frame.
pub(super) fn draw(canvas: &mut Canvas, picture: &Picture, solution: &Solution) {
    for trail in solution.trails.iter().flatten() {
        let [begin, end] = [trail.begin, trail.end].map(|end| picture.position_of(&end));
        let along = [end[0] - begin[0], end[1] - begin[1]];
        let length = libm::hypotf(along[0], along[1]).max(1.0);
        let away = 2.0 * trail.width_sigma_px as f32 * picture.scale() + GAP * canvas.unit;
        let across = [-along[1], along[0]].map(|part| part / length * away);
        for side in [-1.0, 1.0] {
            let shifted = |[x, y]: [f32; 2]| [x + side * across[0], y + side * across[1]];
            canvas.line(&[shifted(begin), shifted(end)], STROKE, COLOR);
        }
    }
}
