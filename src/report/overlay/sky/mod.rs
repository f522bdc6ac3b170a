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
use crate::annotate::Scene;
use crate::identify::Identification;
use view::PictureView;

/// What is drawn together, or not at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OverlayLayer {
    Horizon,
    EquatorialGrid,
    HorizontalGrid,
    DeepSky,
    Constellations,
}

impl OverlayLayer {
    /// All layers, in the order in which they are drawn.
    pub(super) const ALL: [Self; 5] = [
        Self::Horizon,
        Self::Constellations,
        Self::DeepSky,
        Self::EquatorialGrid,
        Self::HorizontalGrid,
    ];

    /// Whether it is wanted; the horizon always is.
    fn is_in(self, layers: SkyLayers) -> bool {
        match self {
            Self::Horizon => true,
            Self::EquatorialGrid => layers.equatorial_grid,
            Self::HorizontalGrid => layers.horizontal_grid,
            Self::DeepSky => layers.deep_sky,
            Self::Constellations => layers.constellations,
        }
    }

    /// Draws its lines, and writes their names where there is room.
    pub(super) fn draw(
        self,
        canvas: &mut Canvas,
        drawn: (&Picture, &Identification),
        scene: &Scene,
        room: &mut Room<'_>,
    ) {
        let (picture, found) = drawn;
        let view = PictureView { picture, found };
        match self {
            Self::Horizon => horizon::draw(canvas, &view),
            Self::EquatorialGrid => grid::equatorial(canvas, &view, room),
            Self::HorizontalGrid => grid::horizontal(canvas, &view, room),
            Self::DeepSky => deep_sky::draw(canvas, &view, scene, room),
            Self::Constellations => figures::draw(canvas, &view, scene, room),
        }
    }
}

/// Draws the layers that are wanted. Names of stars are placed, and drawn, after those of constellations and
/// deep-sky objects; grids get what room is left.
pub(super) fn draw(
    canvas: &mut Canvas,
    drawn: (&Picture, &Identification),
    scene: &Scene,
    layers: SkyLayers,
    room: &mut Room<'_>,
) {
    let wanted = OverlayLayer::ALL
        .into_iter()
        .filter(|layer| layer.is_in(layers));
    for layer in wanted {
        layer.draw(canvas, drawn, scene, room);
    }
}
