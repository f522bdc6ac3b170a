//! The noise of a pixel without light: of the camera, of the user's dark frames, or of the paper.

use super::error::NoiseError;
use crate::calibration::darks::{Darks, ExposureGroup};
use crate::lab::defocus::PAPER_RELATIVE_NOISE;
use crate::predict::{Budget, Scenario};
use serde::Serialize;

/// The noise of a pixel without light.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Noise {
    /// As a part of full scale, if known.
    pub relative: Option<f64>,
    /// In electrons, if the gain is known.
    pub e: Option<f64>,
    /// Where it comes from, in words.
    pub source: String,
    /// The measurements of the dark frames, if it comes from these.
    pub darks: Option<DarkNoise>,
}

/// The noise of a set of dark frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DarkNoise {
    /// Number of frames.
    pub frames: usize,
    /// Exposure of the frames with which `temporal_adu` was measured, in seconds.
    pub exposure_s: Option<f64>,
    /// Standard deviation of all pixels of a frame (eq. 3).
    pub sigma_adu: f64,
    /// The same over full scale (eq. 4).
    pub relative_sigma: Option<f64>,
    /// Standard deviation of a pixel from frame to frame.
    pub temporal_adu: Option<f64>,
    /// Standard deviation of the fixed pattern from pixel to pixel, without hot pixels.
    pub pattern_adu: Option<f64>,
}

impl DarkNoise {
    /// The noise of `darks` at the exposure that is nearest to `exposure_s`, if that is given.
    pub fn at_exposure(darks: &Darks, exposure_s: Option<f64>) -> Self {
        let group = nearest_group(darks, exposure_s);
        Self {
            frames: darks.frames.len(),
            exposure_s: group.and_then(|group| group.exposure_s),
            sigma_adu: darks.sigma_adu,
            relative_sigma: darks
                .full_scale
                .map(|full| darks.sigma_adu / full.levels_adu),
            temporal_adu: group.and_then(|group| group.temporal_noise_adu),
            pattern_adu: darks.pattern.as_ref().and_then(|pattern| pattern.fixed_adu),
        }
    }
}

/// Among the groups of several frames that with the exposure nearest to `exposure_s`, as a ratio.
fn nearest_group(darks: &Darks, exposure_s: Option<f64>) -> Option<&ExposureGroup> {
    let log_ratio = |group: &ExposureGroup| match (group.exposure_s, exposure_s) {
        (Some(found_s), Some(wanted_s)) => libm::log(found_s / wanted_s).abs(),
        _ => 0.0,
    };
    let measured = darks.groups.iter().filter(|group| group.frames > 1);
    measured
        .min_by(|a, b| log_ratio(a).total_cmp(&log_ratio(b)))
        .or(darks.groups.first())
}

impl Noise {
    /// The paper's dark frames.
    pub fn of_paper() -> Self {
        Self::of_relative(PAPER_RELATIVE_NOISE, "the paper's dark frames")
    }

    /// A part of full scale.
    pub fn of_relative(relative: f64, source: &str) -> Self {
        Self {
            relative: Some(relative),
            e: None,
            source: source.to_owned(),
            darks: None,
        }
    }

    /// The standard deviation of all pixels of dark frames, as the paper has it (eq. 4).
    ///
    /// # Errors
    /// [`NoiseError::NoRelativeNoise`].
    pub fn of_all_pixels(darks: DarkNoise) -> Result<Self, NoiseError> {
        let relative = darks.relative_sigma.filter(|sigma| *sigma > 0.0);
        let relative = relative.ok_or(NoiseError::NoRelativeNoise)?;
        Ok(Self {
            darks: Some(darks),
            ..Self::of_relative(relative, "the dark frames, all pixels")
        })
    }

    /// Read noise and dark current of the camera.
    ///
    /// # Errors
    /// [`NoiseError::Zero`].
    pub fn of_camera(scenario: &Scenario) -> Result<Self, NoiseError> {
        let budget = Budget::new(scenario);
        let e = libm::hypot(budget.read_noise_e, budget.dark_e.sqrt());
        Self::of_electrons(e, scenario, "the camera")
    }

    /// The noise of dark frames from frame to frame and from pixel to pixel, with the gain and the
    /// full scale of the camera.
    ///
    /// # Errors
    /// [`NoiseError::NoTemporalNoise`], [`NoiseError::Zero`].
    pub fn of_good_pixels(darks: DarkNoise, scenario: &Scenario) -> Result<Self, NoiseError> {
        let temporal_adu = darks.temporal_adu.ok_or(NoiseError::NoTemporalNoise)?;
        let noise_adu = libm::hypot(temporal_adu, darks.pattern_adu.unwrap_or(0.0));
        let source = "the dark frames: temporal and fixed-pattern noise, without hot pixels";
        Ok(Self {
            darks: Some(darks),
            ..Self::of_electrons(noise_adu * scenario.camera.gain_e_per_adu, scenario, source)?
        })
    }

    fn of_electrons(e: f64, scenario: &Scenario, source: &str) -> Result<Self, NoiseError> {
        let sheet = &scenario.camera;
        if e <= 0.0 {
            return Err(NoiseError::Zero);
        }
        Ok(Self {
            relative: Some(e / sheet.gain_e_per_adu / (sheet.full_scale_adu() + 1.0)),
            e: Some(e),
            source: source.to_owned(),
            darks: None,
        })
    }

    /// In electrons if known, else as a part of full scale.
    pub fn value(&self) -> f64 {
        self.e.or(self.relative).unwrap_or_default()
    }

    /// `scenario` with this noise in place of its read noise and dark current.
    pub fn replacing_in(&self, mut scenario: Scenario) -> Scenario {
        scenario.camera.dark_current_e_s = 0.0;
        scenario.camera.read_noise_e = self.value();
        scenario
    }
}
