//! Why a lens is not converted.

use crate::base::format::excerpt;
use crate::camera::ImplausibleLens;

/// The largest error of a converted lens, in pixels, unless the caller allows more.
pub const TOLERANCE_PX: f64 = 0.01;

/// Why a lens cannot be written in a format, or a file is not a lens.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    /// The lens is fitted too badly.
    #[error(
        "{format} cannot represent the lens: errors of up to {found_px:.3} px; expected at most {expected_px} px"
    )]
    TooFarOff {
        /// What it was to become.
        format: &'static str,
        /// The largest error in pixels.
        found_px: f64,
        /// The largest that was allowed.
        expected_px: f64,
    },
    /// The format is not for such cameras.
    #[error("{format} only supports {expected}; this {found}")]
    Unsuitable {
        /// The format.
        format: &'static str,
        /// What is wrong with the camera.
        found: &'static str,
        /// Which cameras the format is for.
        expected: &'static str,
    },
    /// A line of the file cannot be read.
    #[error("line {line} is '{}'; expected {expected}", excerpt(.found))]
    Syntax {
        /// The line, from 1.
        line: usize,
        /// What it holds.
        found: String,
        /// What was expected.
        expected: &'static str,
    },
    /// The file is not JSON.
    #[error("expected JSON: {}", excerpt(.found))]
    NotJson {
        /// What the JSON reader found.
        found: String,
    },
    /// No camera has such a lens.
    #[error(transparent)]
    Implausible(#[from] ImplausibleLens),
    /// An entry is missing.
    #[error("'{key}' is missing; expected {expected}")]
    Missing {
        /// The name of the entry.
        key: &'static str,
        /// What it should hold.
        expected: &'static str,
    },
    /// An entry has a value that it cannot have.
    #[error("'{key}' is {}; expected {expected}", excerpt(.found))]
    Value {
        /// The name of the entry.
        key: &'static str,
        /// What it holds.
        found: String,
        /// What was expected.
        expected: &'static str,
    },
}
