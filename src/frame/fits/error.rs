//! Errors of reading FITS.

use crate::frame::{FrameError, FrameFormat};

/// The data violate the standard.
pub(super) fn malformed(detail: String) -> FrameError {
    let format = FrameFormat::Fits;
    FrameError::Malformed { format, detail }
}

/// The data end too early.
pub(super) fn truncated(found_bytes: usize, detail: String) -> FrameError {
    FrameError::Truncated {
        format: FrameFormat::Fits,
        found_bytes,
        detail,
    }
}

/// A feature that is not supported.
pub(super) fn unsupported(found: String, expected: &'static str) -> FrameError {
    FrameError::Unsupported {
        format: FrameFormat::Fits,
        found,
        expected,
    }
}
