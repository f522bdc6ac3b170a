//! Temporal noise: how pixels and whole frames vary from frame to frame.

use super::current::DarkCurrent;
use super::frame_statistics::is_same_exposure;
use super::stack::{DarkStack, ExposureStack};
use crate::calibration::pixel_stack::pooled_variances;
use crate::calibration::robust::{RobustMoments, typical_variance};

/// The frames of one exposure.
#[derive(Debug, Clone, PartialEq)]
pub struct ExposureGroup {
    /// Exposure in seconds, if known.
    pub exposure_s: Option<f64>,
    /// Number of frames.
    pub frames: usize,
    /// Mean level, in ADU.
    pub level_adu: f64,
    /// Standard deviation of a pixel from frame to frame, without rounding, in ADU.
    pub temporal_noise_adu: Option<f64>,
    /// Standard deviation of the level of the whole frame from frame to frame, in ADU.
    pub frame_to_frame_adu: Option<f64>,
    /// Mean of every pixel; NaN if it has no value.
    pub means: Vec<f32>,
    /// Variance of a typical pixel from frame to frame, rounding included, in ADU².
    pub(super) pixel_variance: Option<f64>,
}

impl ExposureGroup {
    /// Measures the frames of one exposure; `step` is the step between grey levels.
    pub(super) fn measure(stack: &DarkStack, exposure: &ExposureStack, step: f64) -> Self {
        /// Minimum noise, in steps. With less, most values are on one level.
        const MIN_NOISE_STEPS: f64 = 0.5;
        /// Variance of rounding to whole steps, in steps².
        const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;
        let exposure_s = exposure.exposure_s;
        let of_exposure = stack
            .frames
            .iter()
            .filter(|frame| is_same_exposure(frame.exposure_s, exposure_s));
        let frame_means = of_exposure.map(|frame| frame.mean_adu);
        let (count, means) = (exposure.pixels.frames(), exposure.pixels.means());
        let frame_to_frame_adu = (count > 1).then(|| RobustMoments::of(frame_means.clone()).sigma);
        let variance = TemporalNoise::pooled([exposure].into_iter(), means.len());
        // The variance of the whole frame's level is part of every pixel's variance.
        let pixel_variance = variance
            .zip(frame_to_frame_adu)
            .map(|(noise, drift)| (noise.typical - drift * drift).max(0.0));
        let resolved = pixel_variance.filter(|&v| v > 0.0 && v >= (MIN_NOISE_STEPS * step).powi(2));
        Self {
            exposure_s,
            frames: count,
            level_adu: frame_means.sum::<f64>() / count as f64,
            temporal_noise_adu: resolved.map(|v| (v - ROUNDING_VARIANCE * step * step).sqrt()),
            frame_to_frame_adu,
            means,
            pixel_variance,
        }
    }
}

/// Variance of every pixel from frame to frame.
pub(super) struct TemporalNoise {
    /// In ADU²; NaN if the pixel has too few values.
    pub variances: Vec<f32>,
    /// The variance of a typical pixel, in ADU².
    pub typical: f64,
    /// Degrees of freedom of the variances.
    pub freedom: f64,
}

impl TemporalNoise {
    /// Pools the variances of `pixels` pixels over the exposures. `None` if no exposure has two
    /// frames.
    pub(super) fn pooled<'a>(
        exposures: impl Iterator<Item = &'a ExposureStack> + Clone,
        pixels: usize,
    ) -> Option<Self> {
        let stacks = exposures.map(|exposure| &exposure.pixels);
        let freedom: usize = stacks.clone().map(|stack| stack.frames() - 1).sum();
        if freedom == 0 {
            return None;
        }
        let freedom = freedom as f64;
        let variances = pooled_variances(stacks, pixels);
        let typical = typical_variance(&variances, freedom)?;
        Some(Self {
            variances,
            typical,
            freedom,
        })
    }
}

/// Read noise in ADU: the temporal noise at the shortest exposure with two frames, without the shot
/// noise of the dark current if current and gain are known. `groups` are sorted by exposure.
pub(super) fn read_noise_adu(
    groups: &[ExposureGroup],
    current: Option<&DarkCurrent>,
    gain_e_per_adu: Option<f64>,
) -> Option<f64> {
    let shortest = groups
        .iter()
        .find(|group| group.temporal_noise_adu.is_some())?;
    let variance = shortest.temporal_noise_adu?.powi(2);
    // The mean current of the same pixels over which the variance is averaged.
    let current = current.and_then(|current| RobustMoments::clipped(&current.of_pixels_adu_s, 0.0));
    let shot_variance = match (current, gain_e_per_adu, shortest.exposure_s) {
        (Some(current), Some(gain), Some(exposure_s)) => current.mean.max(0.0) * exposure_s / gain,
        _ => 0.0,
    };
    Some((variance - shot_variance).max(0.0).sqrt())
}
