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
        Self::EquatorialGrid,
        Self::HorizontalGrid,
        Self::DeepSky,
        Self::Constellations,
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
        picture: &Picture,
        found: &Identification,
        room: &mut Room<'_>,
    ) {
        let view = PictureView { picture, found };
        match self {
            Self::Horizon => horizon::draw(canvas, &view),
            Self::EquatorialGrid => grid::equatorial(canvas, &view, room),
            Self::HorizontalGrid => grid::horizontal(canvas, &view, room),
            Self::DeepSky => deep_sky::draw(canvas, &view, room),
            Self::Constellations => figures::draw(canvas, &view, room),
        }
    }
}

/// Draws the layers that are wanted. Marks and names of stars are to be drawn over them.
pub(super) fn draw(
    canvas: &mut Canvas,
    picture: &Picture,
    found: &Identification,
    layers: SkyLayers,
    room: &mut Room<'_>,
) {
    for layer in OverlayLayer::ALL
        .into_iter()
        .filter(|layer| layer.is_in(layers))
    {
        layer.draw(canvas, picture, found, room);
    }
}
