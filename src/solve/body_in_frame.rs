//! The Moon or a planet within a frame.

use crate::base::coords::PixelPoint;
use crate::ephemeris::solar_system::{Body, BodyKind};
use crate::identify::{Identification, SourceIndex};

/// The Moon or a planet within a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct BodyInFrame {
    /// Which one, where on the sky, and how bright.
    pub body: Body,
    /// Where it is expected in the frame.
    pub position: PixelPoint,
    /// Its position may be off by this much, in pixels.
    pub uncertainty_px: f64,
    /// The source that it is; `None` where none is, or where none can be told from stars.
    pub source: Option<SourceIndex>,
}

impl BodyInFrame {
    /// Where `body` is expected; `None` outside the frame.
    pub(super) fn expected(body: Body, found: &Identification) -> Option<Self> {
        let camera = &found.camera;
        let position = found.pixel_of(&found.places.apparent(&body.direction))?;
        let disc_px = body.radius_rad * camera.focal_length_px();
        camera.nearly_contains(&position, disc_px).then_some(Self {
            body,
            position,
            uncertainty_px: body.uncertainty_rad * camera.focal_length_px(),
            source: None,
        })
    }

    /// Whether the body's disc covers `position`: known only where the disc is larger than the
    /// uncertainty.
    pub(super) fn hides(&self, position: &PixelPoint, focal_length_px: f64) -> bool {
        let disc_px = self.body.radius_rad * focal_length_px;
        self.uncertainty_px < disc_px && self.position.distance_to(position) < disc_px
    }

    /// Whether people look for it in a frame with stars as faint as this.
    pub(super) fn is_notable(&self, faintest_v_mag: Option<f64>) -> bool {
        self.source.is_some()
            || self.body.kind == BodyKind::Moon
            || faintest_v_mag.is_some_and(|faintest| self.body.v_mag < faintest)
    }
}
