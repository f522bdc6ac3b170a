//! What the pointing is found from, and its buffers.

use crate::detect::Detections;
use crate::identify::{Choices, StarField};

/// Stars that are measured: first so many that an attitude of all stars would not be much better, then so many that
/// parts of the frame have enough, for lenses that are no pinhole over all of it.
pub(super) const TRIED_STARS: [usize; 2] = [100, 1000];
/// What is searched of them.
pub(super) const TRIED_CHOICES: [Choices; 2] = [Choices::AtOnce, Choices::PartsAtOnce];

/// The brightest stars of a frame; holds the buffers.
#[derive(Debug, Default)]
pub(super) struct PointingBuffers {
    pub detections: Detections,
    pub field: Option<StarField>,
}
