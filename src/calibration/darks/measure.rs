//! Measures a detector from a stack of dark frames.

use super::current::DarkCurrent;
use super::error::DarksError;
use super::frame_statistics::FrameStatistics;
use super::hot::{HOT_SIGMA, HotPixel, PixelData};
use super::noise::{ExposureGroup, TemporalNoise, read_noise_adu};
use super::not_dark::{self, NotDark};
use super::pattern::Pattern;
use super::stack::DarkStack;
use std::fmt;

/// What is known of the detector, and the threshold of hot pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DarkConfig {
    /// Bits of a grey level, and the source; if `None`, those of the file format.
    pub bits: Option<(u32, FullScaleSource)>,
    /// Gain, in electrons per grey level.
    pub gain_e_per_adu: Option<f64>,
    /// Threshold of hot pixels, in standard deviations.
    pub hot_sigma: f64,
}

impl Default for DarkConfig {
    fn default() -> Self {
        Self {
            bits: None,
            gain_e_per_adu: None,
            hot_sigma: HOT_SIGMA,
        }
    }
}

/// Source of the number of bits of a grey level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FullScaleSource {
    /// A command-line option.
    Option,
    /// The data sheet of the camera.
    Camera,
    /// The file format, which may have more bits than the detector.
    FileFormat,
}

impl fmt::Display for FullScaleSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Option => "option",
            Self::Camera => "camera",
            Self::FileFormat => "file format",
        })
    }
}

/// The full scale of grey levels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FullScale {
    /// The number of grey levels times the step between them, in ADU: 2^bits for a step of 1.
    pub levels_adu: f64,
    /// Its source.
    pub source: FullScaleSource,
}

/// A quantity that could not be measured.
#[derive(Debug, Clone, PartialEq)]
pub struct MissingQuantity {
    /// Name of the quantity.
    pub what: &'static str,
    /// Reason.
    pub reason: String,
}

/// Properties of a detector, measured from dark frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Darks {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Statistics of each frame.
    pub frames: Vec<FrameStatistics>,
    /// Mean of the frames' means, in ADU.
    pub mean_adu: f64,
    /// Root of the mean of the frames' variances, in ADU.
    pub sigma_adu: f64,
    /// Full scale, if known.
    pub full_scale: Option<FullScale>,
    /// Gain in electrons per grey level, if known.
    pub gain_e_per_adu: Option<f64>,
    /// The frames by exposure, shortest first.
    pub groups: Vec<ExposureGroup>,
    /// Read noise of a pixel, in ADU: temporal noise at the shortest exposure with two frames,
    /// without the noise of the dark current if current and gain are known.
    pub read_noise_adu: Option<f64>,
    /// Fixed pattern at [`Self::pattern_exposure_s`].
    pub pattern: Option<Pattern>,
    /// The exposure with the most frames, the longest of several, in seconds.
    pub pattern_exposure_s: Option<f64>,
    /// Dark current, if there are two or more exposures.
    pub dark_current: Option<DarkCurrent>,
    /// Hot pixels, row by row.
    pub hot_pixels: Vec<HotPixel>,
    /// Threshold of hot pixels, in standard deviations.
    pub hot_sigma: f64,
    /// Standard deviation of every pixel from frame to frame, in ADU; NaN if it has too few values.
    pub noise_adu: Option<Vec<f32>>,
    /// Quantities that could not be measured.
    pub missing: Vec<MissingQuantity>,
    /// Frames that do not look like dark frames.
    pub warnings: Vec<NotDark>,
}

impl DarkStack {
    /// Measures the detector from the frames added.
    /// # Errors
    /// [`DarksError::NoFrames`].
    #[doc(alias = "gamma_sigma_g")]
    #[doc(alias = "gamma_eg")]
    pub fn measure(mut self, config: &DarkConfig) -> Result<Darks, DarksError> {
        let Some(first) = self.frames.first() else {
            return Err(DarksError::NoFrames);
        };
        let (width, height) = (first.width, first.height);
        self.exposures
            .sort_by(|a, b| seconds(a.exposure_s).total_cmp(&seconds(b.exposure_s)));
        let step_adu = f64::from(self.step_adu.unwrap_or(0.0));
        let noise = TemporalNoise::pooled(self.exposures.iter(), width * height);
        let groups: Vec<_> = self
            .exposures
            .iter()
            .map(|exposure| ExposureGroup::measure(&self, exposure, step_adu))
            .collect();
        let dark_current = self.dark_current(&groups);
        let reference = pattern_group(&groups);
        let pattern = reference.and_then(|group| {
            let noise_left = group.pixel_variance.map(|v| v / group.frames as f64);
            Pattern::measure(&group.means, width, noise_left, step_adu)
        });
        let longest = groups.last();
        let pixels = PixelData {
            width,
            levels: longest.map_or(&[], |group| &group.means),
            noise: noise.as_ref(),
            dark_current: dark_current.as_ref(),
            step_adu,
            longest_s: longest.and_then(|group| group.exposure_s),
        };
        let hot_pixels = pixels.hot_pixels(config.hot_sigma);
        let full_scale = self.full_scale(config, step_adu);
        let read_noise_adu = read_noise_adu(&groups, dark_current.as_ref(), config.gain_e_per_adu);
        let missing = missing(
            &groups,
            read_noise_adu,
            dark_current.as_ref(),
            full_scale,
            config,
        );
        let count = self.frames.len() as f64;
        let mean_variance = self.frames.iter().map(|f| f.sigma_adu.powi(2)).sum::<f64>() / count;
        let full_scale_adu = full_scale.map(|full| full.levels_adu);
        Ok(Darks {
            width,
            height,
            mean_adu: self.frames.iter().map(|f| f.mean_adu).sum::<f64>() / count,
            sigma_adu: mean_variance.sqrt(),
            full_scale,
            gain_e_per_adu: config.gain_e_per_adu,
            read_noise_adu,
            pattern,
            pattern_exposure_s: reference.and_then(|group| group.exposure_s),
            dark_current,
            hot_pixels,
            hot_sigma: config.hot_sigma,
            noise_adu: noise.map(|noise| noise.variances.iter().map(|v| v.sqrt()).collect()),
            missing,
            warnings: not_dark::warnings(&self.frames, full_scale_adu),
            groups,
            frames: self.frames,
        })
    }

    /// Dark current and bias; `None` unless there are two known exposures.
    fn dark_current(&self, groups: &[ExposureGroup]) -> Option<DarkCurrent> {
        let frames = self
            .frames
            .iter()
            .filter_map(|f| Some((f.exposure_s?, f.mean_adu)));
        let timed: Vec<_> = groups
            .iter()
            .filter_map(|g| Some((g.exposure_s?, g.frames, g.means.as_slice())))
            .collect();
        if timed.len() < 2 {
            return None;
        }
        DarkCurrent::fit(&frames.collect::<Vec<_>>(), &timed)
    }

    /// The full scale, from the bits in `config` or else from the file format.
    fn full_scale(&self, config: &DarkConfig, step: f64) -> Option<FullScale> {
        let of_format = self.saturation_adu.map(|full| f64::from(full) + step);
        let Some((bits, source)) = config.bits else {
            return of_format.map(|levels_adu| FullScale {
                levels_adu,
                source: FullScaleSource::FileFormat,
            });
        };
        let levels = 2f64.powi(bits as i32);
        // Twelve bits may be stored in the upper part of sixteen.
        let shifted = levels * step;
        let levels_adu = match of_format {
            Some(format) if step > 1.0 && shifted <= format => shifted,
            _ => levels,
        };
        Some(FullScale { levels_adu, source })
    }
}

/// The exposure for sorting: unknown exposures come first.
fn seconds(exposure_s: Option<f64>) -> f64 {
    exposure_s.unwrap_or(f64::NEG_INFINITY)
}

/// The exposure with the most frames, the longest of several.
fn pattern_group(groups: &[ExposureGroup]) -> Option<&ExposureGroup> {
    groups.iter().max_by(|a, b| {
        let longer = seconds(a.exposure_s).total_cmp(&seconds(b.exposure_s));
        a.frames.cmp(&b.frames).then(longer)
    })
}

/// What could not be measured, and why.
fn missing(
    groups: &[ExposureGroup],
    read_noise_adu: Option<f64>,
    dark_current: Option<&DarkCurrent>,
    full_scale: Option<FullScale>,
    config: &DarkConfig,
) -> Vec<MissingQuantity> {
    let mut missing = Vec::new();
    let mut add = |what, reason: String| missing.push(MissingQuantity { what, reason });
    if groups.iter().all(|group| group.frames < 2) {
        let reason =
            "no two frames have the same exposure: noise and fixed pattern cannot be separated";
        for what in [
            "temporal_noise",
            "read_noise",
            "fixed_pattern",
            "frame_to_frame",
        ] {
            add(what, reason.to_owned());
        }
    } else if read_noise_adu.is_none() {
        let reason = "the noise is less than half the step between gray levels";
        for what in ["temporal_noise", "read_noise"] {
            add(what, reason.to_owned());
        }
    }
    if dark_current.is_none() {
        let known = groups
            .iter()
            .filter(|group| group.exposure_s.is_some())
            .count();
        let found = match known {
            0 => "the exposure is not known",
            _ => "all frames have the same exposure",
        };
        add(
            "dark_current",
            format!("{found}: two different exposures are needed"),
        );
    }
    if full_scale.is_none() {
        let reason =
            "full scale is unknown: give the bit depth of the detector or a camera description";
        add("relative", reason.to_owned());
    }
    if config.gain_e_per_adu.is_none() {
        add(
            "electrons",
            "the gain is unknown: give a camera description".to_owned(),
        );
    }
    missing
}
