//! Clusters, nebulae and galaxies; the radiants of meteor showers.

use super::view::PictureView;
use crate::annotate::{Annotation, AnnotationKind, Scene};
use crate::report::figure::Rgb;
use crate::report::overlay::canvas::Canvas;
use crate::report::overlay::labels::Room;

const COLOR: Rgb = Rgb([150, 220, 150]);
const RADIANT_COLOR: Rgb = Rgb([240, 150, 120]);
/// Size of the letters, in units of strokes.
const LETTERS: f32 = 11.5;
/// Smallest radius of a circle, in units of strokes.
const MIN_RADIUS: f32 = 7.0;
/// Rays of a radiant: where they begin and end, in units of strokes.
const RAYS: [f32; 2] = [5.0, 11.0];

/// Draws the objects that have room for their names, brightest first, as dashed circles of their size, and
/// radiants as rays.
pub(super) fn draw(
    canvas: &mut Canvas,
    view: &PictureView<'_>,
    scene: &Scene,
    room: &mut Room<'_>,
) {
    let mut last_name = "";
    for shown in &scene.annotations {
        match shown.kind {
            AnnotationKind::DeepSky { designation } => {
                // The Double Cluster has two numbers.
                let name = if shown.name == last_name {
                    designation
                } else {
                    &shown.name
                };
                draw_object(canvas, view, shown, [name, designation], room);
                last_name = &shown.name;
            }
            AnnotationKind::Radiant => draw_radiant(canvas, view, shown, room),
            _ => {}
        }
    }
}

/// Draws an object with the first of these names that has room.
fn draw_object(
    canvas: &mut Canvas,
    view: &PictureView<'_>,
    shown: &Annotation,
    names: [&str; 2],
    room: &mut Room<'_>,
) {
    let center = view.picture.position_of(&shown.position);
    let radius = (shown.radius_px as f32 * view.picture.scale()).max(MIN_RADIUS * canvas.unit);
    let mut places = names.iter().filter_map(|name| {
        let at = room.beside(name, center, radius, LETTERS)?;
        Some((name, at))
    });
    if let Some((name, at)) = places.next() {
        canvas.dashed_ring(center, radius, 1.1, COLOR);
        canvas.text(name, at, LETTERS, COLOR);
    }
}

fn draw_radiant(
    canvas: &mut Canvas,
    view: &PictureView<'_>,
    shown: &Annotation,
    room: &mut Room<'_>,
) {
    let [x, y] = view.picture.position_of(&shown.position);
    let [from, to] = RAYS.map(|along| along * canvas.unit);
    let Some(at) = room.beside(&shown.label, [x, y], to, LETTERS) else {
        return;
    };
    for ray in 0..8_u8 {
        let (sin, cos) = libm::sincosf(f32::from(ray) * std::f32::consts::FRAC_PI_4);
        let ends = [from, to].map(|along| [x + along * cos, y + along * sin]);
        canvas.line(&ends, 1.1, RADIANT_COLOR);
    }
    canvas.text(&shown.label, at, LETTERS, RADIANT_COLOR);
}
