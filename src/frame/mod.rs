//! The image as the detector gave it.

/// One image of light intensities.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row-major, `height * width`, in the file's own units (ADU); colour has become luminance.
    /// NaN marks a pixel without a value.
    pub pixels: Vec<f32>,
    /// The difference between neighbouring levels that the file can express (1 for integers, 0 for floats), in ADU.
    pub step_adu: f32,
    /// The level from which on a pixel is saturated, in ADU, where the format has one.
    pub saturation_adu: Option<f32>,
}
