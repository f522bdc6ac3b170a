//! Recognises frames that were not taken without light.

use super::frame_statistics::{FrameStatistics, is_same_exposure};
use crate::base::statistics::{median, median_and_sigma};
use std::fmt;

/// A frame that does not look like a dark frame.
#[derive(Debug, Clone, PartialEq)]
pub struct NotDark {
    /// Name of the frame.
    pub frame: String,
    /// What is unusual.
    pub reason: NotDarkReason,
}

/// Why a frame does not look like a dark frame.
#[derive(Debug, Clone, PartialEq)]
pub enum NotDarkReason {
    /// Spots that look like stars.
    Stars {
        /// Number of spots.
        spots: usize,
    },
    /// The mean level is high.
    Bright {
        /// Mean, as a share of full scale.
        share: f64,
    },
    /// The mean level differs from that of the other frames of the same exposure.
    OtherLevel {
        /// Its mean level, in ADU.
        mean_adu: f64,
        /// Median of the mean levels, in ADU.
        median_adu: f64,
    },
}

impl NotDarkReason {
    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::Stars { .. } => "stars_in_dark",
            Self::Bright { .. } => "bright_dark",
            Self::OtherLevel { .. } => "dark_level_differs",
        }
    }
}

impl fmt::Display for NotDark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} does not look like a dark frame: ", self.frame)?;
        match &self.reason {
            NotDarkReason::Stars { spots } => write!(f, "{spots} spots in it look like stars"),
            NotDarkReason::Bright { share } => {
                write!(f, "its mean level is {:.0} % of full scale", share * 100.0)
            }
            NotDarkReason::OtherLevel {
                mean_adu,
                median_adu,
            } => write!(
                f,
                "its mean level is {mean_adu:.2}, but the median of the frames with the same exposure is \
                 {median_adu:.2}"
            ),
        }
    }
}

/// The frames among `frames` that do not look like dark frames, in their order.
pub(super) fn warnings(frames: &[FrameStatistics], full_scale_adu: Option<f64>) -> Vec<NotDark> {
    let warning = |frame: &FrameStatistics| {
        let reason = stars(frame)
            .or_else(|| bright(frame, full_scale_adu))
            .or_else(|| other_level(frame, frames))?;
        Some(NotDark {
            frame: frame.frame.clone(),
            reason,
        })
    };
    frames.iter().filter_map(warning).collect()
}

fn stars(frame: &FrameStatistics) -> Option<NotDarkReason> {
    /// Star-like spots expected in any dark frame (clusters of hot pixels, cosmic rays): a number,
    /// and a share of the bright pixels.
    const EXPECTED: f64 = 5.0;
    const EXPECTED_FRACTION: f64 = 0.01;
    let most = EXPECTED + EXPECTED_FRACTION * frame.bright as f64;
    (frame.star_like as f64 > most).then_some(NotDarkReason::Stars {
        spots: frame.star_like,
    })
}

fn bright(frame: &FrameStatistics, full_scale_adu: Option<f64>) -> Option<NotDarkReason> {
    /// Maximum mean of a dark frame, as a share of full scale.
    const MAX_FRACTION: f64 = 0.5;
    let share = frame.mean_adu / full_scale_adu?;
    (share > MAX_FRACTION).then_some(NotDarkReason::Bright { share })
}

fn other_level(frame: &FrameStatistics, frames: &[FrameStatistics]) -> Option<NotDarkReason> {
    /// Minimum number of frames of one exposure for a comparison.
    const MIN_FRAMES: usize = 4;
    /// Minimum difference from the median: in robust standard deviations, and as a share of the
    /// noise.
    const LEVEL_SIGMA: f64 = 8.0;
    const LEVEL_NOISE_FRACTION: f64 = 0.5;
    let alike = frames
        .iter()
        .filter(|other| is_same_exposure(other.exposure_s, frame.exposure_s));
    let mut means: Vec<f64> = alike.clone().map(|other| other.mean_adu).collect();
    if means.len() < MIN_FRAMES {
        return None;
    }
    let (median_adu, scale) = median_and_sigma(&mut means);
    let mut sigmas: Vec<f64> = alike.map(|other| other.sigma_adu).collect();
    let least = (LEVEL_SIGMA * scale).max(LEVEL_NOISE_FRACTION * median(&mut sigmas));
    ((frame.mean_adu - median_adu).abs() > least).then_some(NotDarkReason::OtherLevel {
        mean_adu: frame.mean_adu,
        median_adu,
    })
}
