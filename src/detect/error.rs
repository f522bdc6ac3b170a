//! Errors of detection.

use crate::frame::MIN_SIDE_PX;

/// Why stars could not be looked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DetectError {
    /// A side is shorter than [`MIN_SIDE_PX`].
    #[error(
        "frame of {width} x {height} pixels is too small: expected at least {MIN_SIDE_PX} on each side"
    )]
    FrameTooSmall {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The frame's pixels are not `width * height`.
    #[error("frame holds {found} pixels, expected {expected} (width times height)")]
    WrongLength {
        /// Width times height.
        expected: usize,
        /// The pixels there are.
        found: usize,
    },
    /// An option has a value without meaning.
    #[error("{name} is {found}, expected {expected}")]
    Config {
        /// The option.
        name: &'static str,
        /// Its value.
        found: f64,
        /// What it may be.
        expected: &'static str,
    },
}
