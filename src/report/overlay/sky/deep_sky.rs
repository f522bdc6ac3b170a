//! Clusters, nebulae and galaxies.

use super::view::PictureView;
use crate::catalog::objects::deep_sky;
use crate::report::figure::Rgb;
use crate::report::overlay::canvas::Canvas;
use crate::report::overlay::labels::Room;

const COLOR: Rgb = Rgb([150, 220, 150]);
/// Size of the letters, in units of strokes.
const LETTERS: f32 = 11.5;
/// Smallest radius of a circle, in units of strokes.
const MIN_RADIUS: f32 = 7.0;

/// Draws the objects that have room for their names, brightest first, as dashed circles of their size.
pub(super) fn draw(canvas: &mut Canvas, view: &PictureView<'_>, room: &mut Room<'_>) {
    let px_per_rad = view.found.camera.focal_length_px() as f32 * view.picture.scale();
    for object in deep_sky() {
        let Some(center) = view.of_catalog(&object.direction) else {
            continue;
        };
        let radius = (object.radius_rad as f32 * px_per_rad).max(MIN_RADIUS * canvas.unit);
        if let Some(at) = room.beside(object.designation, center, radius, LETTERS) {
            canvas.dashed_ring(center, radius, 1.1, COLOR);
            canvas.text(object.designation, at, LETTERS, COLOR);
        }
    }
}
