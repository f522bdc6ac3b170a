//! Why the frame in a file could not be examined.

use crate::base::panics::Panicked;
use crate::calibration::CalibrationError;
use crate::detect::DetectError;
use crate::frame::FrameError;
use std::path::PathBuf;

/// Why the frame in a file could not be examined. A frame whose stars are not identified is no
/// error but an [`Outcome`](super::Outcome).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file cannot be read or understood.
    #[error("reading {0}")]
    Read(#[from] FrameError),
    /// Stars cannot be detected in the frame.
    #[error("detecting stars in {}", path.display())]
    Detect {
        /// The file.
        path: PathBuf,
        /// What is wrong with the frame.
        source: DetectError,
    },
    /// The calibration does not fit the frame.
    #[error("calibrating {}", path.display())]
    Calibrate {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        source: CalibrationError,
    },
    /// Something that works on the frame has a bug.
    #[error("solving {}", path.display())]
    Panicked {
        /// The file.
        path: PathBuf,
        /// What panicked.
        source: Panicked,
    },
}
