//! Where directions are in the picture.

use crate::base::coords::{Icrs, UnitVector};
use crate::identify::Identification;
use crate::report::figure::Rgb;
use crate::report::overlay::canvas::Canvas;
use crate::report::overlay::picture::Picture;

/// An identified frame's picture.
pub(super) struct PictureView<'a> {
    pub(super) picture: &'a Picture,
    pub(super) found: &'a Identification,
}

impl PictureView<'_> {
    /// Where an apparent direction is, if it is within the frame.
    pub(super) fn apparent(&self, direction: &UnitVector<Icrs>) -> Option<[f32; 2]> {
        let pixel = self.found.pixel_of(direction)?;
        let position = self.picture.position_of(&pixel);
        let is_within = self.found.camera.contains(&pixel) && self.picture.shows(position);
        is_within.then_some(position)
    }

    /// The same for a direction of the catalogue.
    pub(super) fn of_catalog(&self, direction: &UnitVector<Icrs>) -> Option<[f32; 2]> {
        self.apparent(&self.found.places.apparent(direction))
    }

    /// The parts of a line through these places that are within the frame.
    pub(super) fn visible(places: &[Option<[f32; 2]>]) -> Vec<Vec<[f32; 2]>> {
        let parts = places.split(Option::is_none);
        let parts = parts.map(|part| part.iter().copied().flatten().collect());
        parts
            .filter(|part: &Vec<[f32; 2]>| part.len() > 1)
            .collect()
    }

    /// Angle of the steps in which lines are drawn: short beside the frame.
    pub(super) fn step_rad(&self) -> f64 {
        /// Steps over the frame's half diagonal.
        const STEPS: f64 = 120.0;
        self.found.camera.radius_rad() / STEPS
    }

    /// Draws what is visible of a line.
    pub(super) fn draw_line(
        canvas: &mut Canvas,
        places: &[Option<[f32; 2]>],
        width: f32,
        color: Rgb,
    ) {
        for part in Self::visible(places) {
            canvas.line(&part, width, color);
        }
    }
}
