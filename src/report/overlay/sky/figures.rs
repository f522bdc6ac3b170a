//! The figures of the constellations, and their names.

use super::view::PictureView;
use crate::annotate::{AnnotationKind, Scene};
use crate::base::coords::{Icrs, UnitVector};
use crate::catalog::objects::constellations;
use crate::report::figure::Rgb;
use crate::report::overlay::canvas::Canvas;
use crate::report::overlay::labels::Room;

const COLOR: Rgb = Rgb([120, 135, 190]);
/// Size of the letters, in units of strokes.
const LETTERS: f32 = 15.0;
/// Part of a line that is left out at each of its stars.
const GAP: f64 = 0.06;

/// Draws the figures, and writes the name of each constellation near the middle of what is seen of it.
pub(super) fn draw(
    canvas: &mut Canvas,
    view: &PictureView<'_>,
    scene: &Scene,
    room: &mut Room<'_>,
) {
    let pairs = constellations().iter().flat_map(|known| &known.lines);
    for pair in pairs.flat_map(|line| line.windows(2)) {
        let places: Vec<_> = points(&pair[0], &pair[1], view.step_rad())
            .map(|point| view.of_catalog(&point))
            .collect();
        PictureView::draw_line(canvas, &places, 1.0, COLOR);
    }
    let shown = scene.annotations.iter();
    for seen in shown.filter(|shown| shown.kind == AnnotationKind::Constellation) {
        let middle = view.picture.position_of(&seen.position);
        if let Some(at) = room.near(&seen.label, middle, LETTERS) {
            canvas.text(&seen.label, at, LETTERS, COLOR.lighter());
        }
    }
}

/// Points between two stars.
fn points(
    from: &UnitVector<Icrs>,
    to: &UnitVector<Icrs>,
    step_rad: f64,
) -> impl Iterator<Item = UnitVector<Icrs>> {
    let (from, to) = (*from.as_vector(), *to.as_vector());
    let steps = ((from - to).norm() / step_rad).ceil().max(1.0) as u32;
    (0..=steps).map(move |step| {
        let share = GAP + (1.0 - 2.0 * GAP) * f64::from(step) / f64::from(steps);
        UnitVector::from_vector(from * (1.0 - share) + to * share)
    })
}
