//! Errors of calibration.

use crate::base::format::excerpt;
use crate::frame::Frame;
use std::io;
use std::path::PathBuf;

/// Maximum share of unusable pixels in a master or a list of hot pixels. With more, the file is
/// assumed to be wrong.
pub const MAX_BAD_FRACTION: f64 = 0.1;

/// Error of calibrating a frame.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// A master has another size than the frame or the other master.
    #[error(
        "{what} {name} has {width} x {height} pixels: expected {expected_width} x {expected_height}, as {of}"
    )]
    SizesDiffer {
        /// `the dark`, `the flat`, `the mask`.
        what: &'static str,
        /// Its file.
        name: String,
        /// Its width.
        width: usize,
        /// Its height.
        height: usize,
        /// The width required.
        expected_width: usize,
        /// The height required.
        expected_height: usize,
        /// The frame or master with the required size.
        of: String,
    },
    /// Too many pixels of a master are unusable.
    #[error("{what} {name}: found {bad} of {pixels} pixels {found}, expected at most {} %", MAX_BAD_FRACTION * 100.0)]
    TooManyBad {
        /// `the dark`, `the flat`, `the hot pixels`.
        what: &'static str,
        /// The file.
        name: String,
        /// Number of unusable pixels.
        bad: usize,
        /// Number of pixels.
        pixels: usize,
        /// What is wrong with them.
        found: &'static str,
    },
    /// A hot pixel outside the frame.
    #[error("{}, line {line}: found the pixel ({x}, {y}), expected x below {width} and y below {height}", path.display())]
    Outside {
        /// The list.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// Width of the frame.
        width: usize,
        /// Height of the frame.
        height: usize,
    },
    /// The list of hot pixels cannot be read.
    #[error("{}: {source}", path.display())]
    List {
        /// The list.
        path: PathBuf,
        /// The error.
        source: io::Error,
    },
    /// The list of hot pixels has an invalid line.
    #[error("{}, line {line}: found {}, expected {expected}", path.display(), excerpt(.found))]
    Malformed {
        /// The list.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// The content.
        found: String,
        /// What is valid.
        expected: &'static str,
    },
    /// No pixel of a frame has a value after calibration.
    #[error("no pixel of the frame has a value after calibration")]
    NothingLeft,
}

/// Refuses a master with more than [`MAX_BAD_FRACTION`] unusable pixels.
pub(super) fn check_bad(
    what: &'static str,
    name: &str,
    bad: usize,
    frame: &Frame,
    found: &'static str,
) -> Result<(), CalibrationError> {
    let pixels = frame.width * frame.height;
    if bad as f64 <= MAX_BAD_FRACTION * pixels as f64 {
        return Ok(());
    }
    Err(CalibrationError::TooManyBad {
        what,
        name: name.to_owned(),
        bad,
        pixels,
        found,
    })
}
