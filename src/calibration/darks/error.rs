//! Errors of measuring dark frames.

use crate::calibration::pixel_stack::OutOfMemory;

/// Maximum number of different exposures. Each needs three arrays of the frame's size.
pub const MAX_EXPOSURES: usize = 16;

/// Error of measuring dark frames.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DarksError {
    /// Two frames differ in size.
    #[error(
        "{frame} has {width} x {height} pixels, but {first} has {first_width} x {first_height}: expected frames of one size"
    )]
    SizesDiffer {
        /// The first frame.
        first: String,
        /// Its width.
        first_width: usize,
        /// Its height.
        first_height: usize,
        /// The other frame.
        frame: String,
        /// Its width.
        width: usize,
        /// Its height.
        height: usize,
    },
    /// Too many different exposures.
    #[error(
        "{frame}: too many different exposures: {exposure_s} s is one more than the maximum of \
         {MAX_EXPOSURES}"
    )]
    TooManyExposures {
        /// The frame with one exposure too many.
        frame: String,
        /// Its exposure.
        exposure_s: f64,
    },
    /// Not enough memory.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
    /// No frame.
    #[error("found no frame, expected at least one")]
    NoFrames,
}
