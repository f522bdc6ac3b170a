//! Recognises frames that were not taken without light.

use super::{FrameStatistics, is_same_exposure};
use crate::base::statistics::median;
use std::fmt;

/// Star-like spots expected in any dark frame (clusters of hot pixels, cosmic rays): a number, and a
/// fraction of all bright pixels.
const STAR_LIKE_ANYWHERE: f64 = 5.0;
const STAR_LIKE_PART: f64 = 0.01;
/// A mean differs from the others' when it is this many robust deviations away, and by this fraction of
/// the noise.
const LEVEL_SIGMA: f64 = 8.0;
const LEVEL_PART_OF_NOISE: f64 = 0.5;
/// No dark frame has a mean above this fraction of full scale.
const BRIGHT_PART: f64 = 0.5;
/// Fewest frames of one exposure with which a frame can be compared.
const FEWEST: usize = 4;

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
        /// How many.
        spots: usize,
    },
    /// The mean level is high.
    Bright {
        /// Mean, as a fraction of full scale.
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
                "its mean level is {mean_adu:.2}, that of the others of its exposure {median_adu:.2}"
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
    let most = STAR_LIKE_ANYWHERE + STAR_LIKE_PART * frame.bright as f64;
    (frame.star_like as f64 > most).then_some(NotDarkReason::Stars {
        spots: frame.star_like,
    })
}

fn bright(frame: &FrameStatistics, full_scale_adu: Option<f64>) -> Option<NotDarkReason> {
    let share = frame.mean_adu / full_scale_adu?;
    (share > BRIGHT_PART).then_some(NotDarkReason::Bright { share })
}

fn other_level(frame: &FrameStatistics, frames: &[FrameStatistics]) -> Option<NotDarkReason> {
    let alike = frames
        .iter()
        .filter(|other| is_same_exposure(other.exposure_s, frame.exposure_s));
    let mut means: Vec<f64> = alike.clone().map(|other| other.mean_adu).collect();
    if means.len() < FEWEST {
        return None;
    }
    let median_adu = median(&mut means);
    means
        .iter_mut()
        .for_each(|mean| *mean = (*mean - median_adu).abs());
    let scale = 1.4826 * median(&mut means);
    let mut sigmas: Vec<f64> = alike.map(|other| other.sigma_adu).collect();
    let least = (LEVEL_SIGMA * scale).max(LEVEL_PART_OF_NOISE * median(&mut sigmas));
    ((frame.mean_adu - median_adu).abs() > least).then_some(NotDarkReason::OtherLevel {
        mean_adu: frame.mean_adu,
        median_adu,
    })
}
