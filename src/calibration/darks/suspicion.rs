//! Frames that do not look as if they were taken without light.

use super::{FrameStatistics, is_same_exposure};
use crate::base::statistics::median;

/// Bright pixels that may look like stars in any dark frame, such as clusters of hot ones and cosmic rays: so many, and this
/// part of all bright ones.
const STAR_LIKE_ANYWHERE: f64 = 5.0;
const STAR_LIKE_PART: f64 = 0.01;
/// A level so many typical deviations from the others' is another, if it also differs by this part of the noise.
const LEVEL_SIGMA: f64 = 8.0;
const LEVEL_PART_OF_NOISE: f64 = 0.5;
/// The part of full scale above which no dark frame is.
const BRIGHT_PART: f64 = 0.5;
/// The fewest frames among which one can differ from the others.
const FEWEST: usize = 4;

/// What speaks against it that `frames` are dark, a sentence each that names the frame.
pub(super) fn warnings(frames: &[FrameStatistics], full_scale_adu: Option<f64>) -> Vec<String> {
    let warning = |frame: &FrameStatistics| {
        let reason = stars(frame)
            .or_else(|| bright(frame, full_scale_adu))
            .or_else(|| other_level(frame, frames))?;
        Some(format!(
            "{} does not look like a dark frame: {reason}",
            frame.frame
        ))
    };
    frames.iter().filter_map(warning).collect()
}

fn stars(frame: &FrameStatistics) -> Option<String> {
    let most = STAR_LIKE_ANYWHERE + STAR_LIKE_PART * frame.bright as f64;
    (frame.star_like as f64 > most)
        .then(|| format!("{} spots in it look like stars", frame.star_like))
}

fn bright(frame: &FrameStatistics, full_scale_adu: Option<f64>) -> Option<String> {
    let part = frame.mean_adu / full_scale_adu?;
    (part > BRIGHT_PART).then(|| format!("its mean level is {:.0} % of full scale", part * 100.0))
}

fn other_level(frame: &FrameStatistics, frames: &[FrameStatistics]) -> Option<String> {
    let alike = frames
        .iter()
        .filter(|other| is_same_exposure(other.exposure_s, frame.exposure_s));
    let mut means: Vec<f64> = alike.clone().map(|other| other.mean_adu).collect();
    if means.len() < FEWEST {
        return None;
    }
    let middle = median(&mut means);
    means
        .iter_mut()
        .for_each(|mean| *mean = (*mean - middle).abs());
    let scale = 1.4826 * median(&mut means);
    let mut sigmas: Vec<f64> = alike.map(|other| other.sigma_adu).collect();
    let least = (LEVEL_SIGMA * scale).max(LEVEL_PART_OF_NOISE * median(&mut sigmas));
    ((frame.mean_adu - middle).abs() > least).then(|| {
        format!(
            "its mean level is {:.2}, that of the others of its exposure {middle:.2}",
            frame.mean_adu
        )
    })
}
