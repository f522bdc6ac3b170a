//! What trails are searched in.

use crate::detect::background::Mesh;
use crate::detect::detection::Detections;
use crate::detect::pixels::View;

/// The pixels of a frame and what is known of them.
pub(in crate::detect) struct TrailSearch<'a> {
    pub view: &'a View<'a>,
    pub mesh: &'a Mesh,
    pub found: &'a Detections,
    /// Standard deviation of a star in the pixels: of the largest spots of the frame.
    pub spot_px: f64,
}
