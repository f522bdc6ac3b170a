//! Settings of the search for peaks.

/// Settings of the search for peaks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SearchConfig {
    /// Threshold in units of the local noise.
    pub threshold: f32,
    /// The spot's standard deviation, pixel included, in pixels.
    pub spot_width_px: f32,
    /// Level at and above which a pixel is saturated, in ADU.
    pub saturation_adu: f32,
    /// Maximum number of peaks to keep.
    pub max_peaks: usize,
    /// Most pixels that may be above the threshold.
    pub max_pixels: usize,
}
