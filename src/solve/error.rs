//! Why the frame in a file could not be examined.

use crate::base::panics::Panicked;
use crate::base::remedy::Remedy;
use crate::calibration::CalibrationError;
use crate::centroids::CentroidListError;
use crate::detect::DetectError;
use crate::frame::FrameError;
use std::path::PathBuf;

/// The options that may help against an error, or one of its causes.
pub fn remedies_of(error: &(dyn std::error::Error + 'static)) -> Vec<Remedy> {
    let causes = std::iter::successors(Some(error), |error| error.source());
    let of_cause = |cause: &(dyn std::error::Error + 'static)| {
        let of_frame = cause.downcast_ref().map(FrameError::remedies);
        let of_detection = cause.downcast_ref().map(DetectError::remedies);
        let of_list = cause.downcast_ref().map(CentroidListError::remedies);
        of_frame.or(of_detection).or(of_list).unwrap_or_default()
    };
    let mut remedies: Vec<Remedy> = causes.flat_map(of_cause).copied().collect();
    // A cause that is wrapped tells the same again.
    remedies.dedup();
    remedies
}

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
    /// A list of centroids cannot be understood.
    #[error("reading the centroids")]
    List(#[from] CentroidListError),
    /// Something that works on the frame has a bug.
    #[error("solving {}", path.display())]
    Panicked {
        /// The file.
        path: PathBuf,
        /// What panicked.
        source: Panicked,
    },
}
