//! Errors of detection.

use super::config::DetectConfig;
use crate::base::interrupt::Interrupted;
use crate::base::remedy::Remedy;
use crate::frame::{Frame, MIN_SIDE_PX};

/// Errors of [`detect`](super::detect).
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
        /// The number of pixels.
        found: usize,
    },
    /// The work was ended early.
    #[error("not finished within the time limit per frame")]
    Interrupted(#[from] Interrupted),
    /// More pixels stand out than fit the memory that the workspace allows.
    #[error(
        "more than {most} pixels are above the detection threshold, and measuring them needs too much \
         memory: use a higher threshold"
    )]
    TooCrowded {
        /// How many may stand out.
        most: usize,
    },
    /// The frame and the copies of it that are needed do not fit the memory that is allowed.
    #[error(
        "the frame and its copies need {} MB of memory, expected at most {} MB",
        .needed_bytes.div_ceil(1_000_000), .limit_bytes / 1_000_000
    )]
    TooMuchMemory {
        /// What they take.
        needed_bytes: u64,
        /// What they may take.
        limit_bytes: u64,
    },
    /// An option is out of range.
    #[error("{name} is {found}, expected {expected}")]
    Config {
        /// The option.
        name: &'static str,
        /// Its value.
        found: f64,
        /// Its range.
        expected: &'static str,
    },
}

impl DetectError {
    /// The options that may help.
    pub const fn remedies(&self) -> &'static [Remedy] {
        match self {
            Self::Interrupted(_) => &[Remedy::TimeLimit],
            Self::TooCrowded { .. } => &[Remedy::Sigma, Remedy::MaxMemory],
            Self::TooMuchMemory { .. } => &[Remedy::MaxMemory],
            _ => &[],
        }
    }
}

/// Checks size and length of the frame, and the range of the options.
pub(crate) fn check(frame: &Frame, config: &DetectConfig) -> Result<(), DetectError> {
    let (width, height) = (frame.width, frame.height);
    if width < MIN_SIDE_PX || height < MIN_SIDE_PX {
        return Err(DetectError::FrameTooSmall { width, height });
    }
    if frame.pixels.len() != width * height {
        return Err(DetectError::WrongLength {
            expected: width * height,
            found: frame.pixels.len(),
        });
    }
    let positive = [
        ("false_alarms_per_mpx", config.false_alarms_per_mpx),
        ("threshold_sigma", config.threshold_sigma.unwrap_or(1.0)),
        ("spot_sigma_px", config.spot_sigma_px.unwrap_or(1.0)),
        ("cell_px", config.cell_px as f64),
    ];
    for (name, found) in positive {
        if !(found > 0.0 && found.is_finite()) {
            return Err(DetectError::Config {
                name,
                found,
                expected: "a number above 0",
            });
        }
    }
    Ok(())
}
