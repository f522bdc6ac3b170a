//! What the pointing is found from, and its buffers.

use crate::detect::Detections;
use crate::identify::StarField;

/// Stars that are measured: enough for an attitude that all stars would not make much better.
pub(super) const POINTING_STARS: usize = 100;

/// The brightest stars of a frame; holds the buffers.
#[derive(Debug, Default)]
pub(super) struct PointingBuffers {
    pub detections: Detections,
    pub field: Option<StarField>,
}
