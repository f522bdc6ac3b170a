//! The input of the photometry.

use crate::detect::Detections;
use crate::identify::Identification;
use crate::sky::places::StarPlaces;

/// An identified frame.
#[derive(Debug, Clone, Copy)]
pub struct IdentifiedFrame<'a> {
    /// The detections.
    pub detections: &'a Detections,
    /// Camera, attitude and matches; the matches are indices into the detections.
    pub identification: &'a Identification,
    /// Date of the frame, in Julian years since J2000.0.
    pub places: StarPlaces,
    /// Exposure in seconds, where known.
    pub exposure_s: Option<f64>,
    /// Share of the light lost in the corners, as far as it is known.
    pub vignetting: f64,
}
