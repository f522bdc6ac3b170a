//! What the trails of a frame have in common.

/// Direction, length and breadth that the trails of a frame share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TrailShape {
    /// Cosine and sine of the direction, in coordinates of the view.
    pub direction: [f64; 2],
    /// Length, in pixels.
    pub length_px: f64,
    /// Pixels within this distance of the line hold the light.
    pub half_breadth_px: f64,
}
