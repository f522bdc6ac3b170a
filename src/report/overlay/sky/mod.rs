//! What of the sky is drawn beside its stars: horizon, grids, constellations, deep-sky objects.

mod deep_sky;
mod figures;
mod grid;
mod horizon;
mod view;

use super::canvas::Canvas;
use super::labels::Room;
use super::options::SkyLayers;
use super::picture::Picture;
use crate::identify::Identification;
use view::View;

/// Draws the lines that are wanted, and writes their names where there is room. Marks and names of stars
/// are to be drawn over them.
pub(super) fn draw(
    canvas: &mut Canvas,
    picture: &Picture,
    found: &Identification,
    layers: SkyLayers,
    room: &mut Room<'_>,
) {
    let view = View { picture, found };
    horizon::draw(canvas, &view);
    if layers.equatorial_grid {
        grid::equatorial(canvas, &view, room);
    }
    if layers.horizontal_grid {
        grid::horizontal(canvas, &view, room);
    }
    if layers.deep_sky {
        deep_sky::draw(canvas, &view, room);
    }
    if layers.constellations {
        figures::draw(canvas, &view, room);
    }
}
