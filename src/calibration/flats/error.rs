//! Errors of measuring flats.

use crate::calibration::pixel_stack::OutOfMemory;

/// Maximum share of saturated pixels in a flat.
pub const MAX_SATURATED_FRACTION: f64 = 0.01;

/// Error of measuring flats.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FlatsError {
    /// A frame of another size.
    #[error(
        "{frame} has {width} x {height} pixels: expected {expected_width} x {expected_height}, as {of}"
    )]
    SizesDiffer {
        /// The frame.
        frame: String,
        /// Its width.
        width: usize,
        /// Its height.
        height: usize,
        /// The width required.
        expected_width: usize,
        /// The height required.
        expected_height: usize,
        /// The frame with the required size.
        of: String,
    },
    /// An overexposed frame.
    #[error(
        "{frame} is overexposed: found {:.1} % of its pixels saturated, expected at most {} %",
        share * 100.0,
        MAX_SATURATED_FRACTION * 100.0
    )]
    Overexposed {
        /// The frame.
        frame: String,
        /// Share of saturated pixels.
        share: f64,
    },
    /// A frame that is no brighter than the dark.
    #[error(
        "{frame} shows no light: found a mean of {level_adu} ADU above the dark, expected more than 0"
    )]
    NoLight {
        /// The frame.
        frame: String,
        /// Its mean level above the dark.
        level_adu: f64,
    },
    /// No frame.
    #[error("found no frame, expected at least one")]
    NoFrames,
    /// Not enough memory.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
}
