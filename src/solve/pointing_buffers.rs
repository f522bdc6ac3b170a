//! What the pointing is found from, and its buffers.

use crate::detect::Detections;
use crate::identify::StarField;

/// Stars that are measured: enough for an attitude that all stars would not make much better, …
pub(super) const POINTING_STARS: usize = 100;
/// … and where these do not tell it, enough for parts of the frame: lenses that are no pinhole over all of it.
pub(super) const STARS_OF_PARTS: usize = 1500;
/// The numbers of stars that are tried, one after the other.
pub(super) const TRIED_STARS: [usize; 2] = [POINTING_STARS, STARS_OF_PARTS];

/// The brightest stars of a frame; holds the buffers.
#[derive(Debug, Default)]
pub(super) struct PointingBuffers {
    pub detections: Detections,
    pub field: Option<StarField>,
}
