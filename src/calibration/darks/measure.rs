//! From the stack to what it tells.

use super::current::frame_to_frame_adu;
use super::hot::Evidence;
use super::robust::{Typical, typical_variance};
use super::{
    DarkCurrent, DarkStack, DarksError, FrameStatistics, HOT_SIGMA, HotPixel, Pattern,
    is_same_exposure, pooled_variances,
    suspicion::{self, NotDark},
};
use std::fmt;

/// A noise of fewer steps between grey levels than this leaves most values on one level, and what is measured is chance.
const LEAST_NOISE_STEPS: f64 = 0.5;
/// The variance of rounding to whole steps, in steps.
const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;

/// What is known of the detector, and what counts as hot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DarkConfig {
    /// Bits of the grey level, and who says so; else they are those of the file's format.
    pub bits: Option<(u32, FullScaleSource)>,
    /// Electrons for a step of the grey level.
    pub gain_e_per_adu: Option<f64>,
    /// Standard deviations from which on a pixel is hot.
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

/// Who says how many bits a grey level has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FullScaleSource {
    /// An option.
    Option,
    /// The camera's description.
    Camera,
    /// The format of the file, which may have more than the detector.
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

/// What levels are relative to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FullScale {
    /// The number of grey levels as levels in the file, in ADU: 2^bits, and so many times the step between levels.
    pub levels_adu: f64,
    /// Who says so.
    pub source: FullScaleSource,
}

/// The frames of one exposure.
#[derive(Debug, Clone, PartialEq)]
pub struct ExposureGroup {
    /// The exposure, in seconds, where it is known.
    pub exposure_s: Option<f64>,
    /// Its frames.
    pub frames: usize,
    /// The mean of their means, in ADU.
    pub level_adu: f64,
    /// Standard deviation of a pixel from frame to frame, without rounding, in ADU.
    pub temporal_noise_adu: Option<f64>,
    /// Standard deviation of the level of the whole frame from frame to frame, in ADU.
    pub frame_to_frame_adu: Option<f64>,
    /// The mean of every pixel; NaN where it has no value.
    pub means: Vec<f32>,
    /// The variance of an ordinary pixel from frame to frame, rounding included, in ADU².
    pixel_variance: Option<f64>,
}

/// Something that could not be measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Missing {
    /// What.
    pub what: &'static str,
    /// Why.
    pub reason: String,
}

/// What dark frames tell.
#[derive(Debug, Clone, PartialEq)]
pub struct Darks {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Of each frame.
    pub frames: Vec<FrameStatistics>,
    /// The mean of the frames' means, in ADU.
    pub mean_adu: f64,
    /// The root of the mean of their variances, in ADU.
    pub sigma_adu: f64,
    /// What that is relative to, where it is known.
    pub full_scale: Option<FullScale>,
    /// Electrons for a step of the grey level, where they are known.
    pub gain_e_per_adu: Option<f64>,
    /// By exposure, the shortest first.
    pub groups: Vec<ExposureGroup>,
    /// Noise of reading a pixel, in ADU: temporal noise at the shortest exposure that has two frames; without that of the dark
    /// current where that and the gain are known.
    pub read_noise_adu: Option<f64>,
    /// What is the same on every frame, at [`Self::pattern_exposure_s`].
    pub pattern: Option<Pattern>,
    /// The exposure with the most frames, of several the longest.
    pub pattern_exposure_s: Option<f64>,
    /// With two exposures or more.
    pub dark_current: Option<DarkCurrent>,
    /// Pixels that stand out, row by row.
    pub hot_pixels: Vec<HotPixel>,
    /// The standard deviations from which on they do.
    pub hot_sigma: f64,
    /// Standard deviation of every pixel from frame to frame, in ADU; NaN where it has too few values.
    pub noise_adu: Option<Vec<f32>>,
    /// What could not be measured.
    pub missing: Vec<Missing>,
    /// Frames that do not look like dark frames.
    pub warnings: Vec<NotDark>,
}

impl DarkStack {
    /// What the frames tell.
    /// # Errors
    /// [`DarksError::NoFrames`].
    #[doc(alias = "gamma_sigma_g")]
    #[doc(alias = "gamma_eg")]
    pub fn measure(mut self, config: &DarkConfig) -> Result<Darks, DarksError> {
        let Some(first) = self.frames.first() else {
            return Err(DarksError::NoFrames);
        };
        let (width, height) = (first.width, first.height);
        self.groups.sort_by(|a, b| {
            let seconds = |g: Option<f64>| g.unwrap_or(f64::NEG_INFINITY);
            seconds(a.0).total_cmp(&seconds(b.0))
        });
        let step = f64::from(self.step_adu.unwrap_or(0.0));
        let noise = self.temporal_noise(width * height);
        let groups: Vec<_> = (0..self.groups.len())
            .map(|i| self.group(i, step))
            .collect();
        let dark_current = self.dark_current(&groups);
        let reference = groups.iter().max_by(|a, b| {
            a.frames
                .cmp(&b.frames)
                .then(seconds(a).total_cmp(&seconds(b)))
        });
        let pattern = reference.and_then(|group| {
            let noise_left = group.pixel_variance.map(|v| v / group.frames as f64);
            Pattern::of(&group.means, width, noise_left, step)
        });
        let longest = groups.last();
        let evidence = Evidence {
            width,
            levels: longest.map_or(&[], |group| &group.means),
            variances: noise
                .as_ref()
                .map(|noise| (noise.variances.as_slice(), noise.freedom, noise.typical)),
            dark_current: dark_current.as_ref(),
            step_adu: step,
            longest_s: longest.and_then(|group| group.exposure_s),
        };
        let hot_pixels = evidence.hot_pixels(config.hot_sigma);
        let full_scale = self.full_scale(config, step);
        let read_noise_adu = read_noise(&groups, dark_current.as_ref(), config.gain_e_per_adu);
        let missing = missing(
            &groups,
            read_noise_adu,
            dark_current.as_ref(),
            full_scale,
            config,
        );
        let count = self.frames.len() as f64;
        let warnings = suspicion::warnings(&self.frames, full_scale.map(|full| full.levels_adu));
        Ok(Darks {
            width,
            height,
            mean_adu: self.frames.iter().map(|f| f.mean_adu).sum::<f64>() / count,
            sigma_adu: (self.frames.iter().map(|f| f.sigma_adu.powi(2)).sum::<f64>() / count)
                .sqrt(),
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
            warnings,
            groups,
            frames: self.frames,
        })
    }

    /// The variance of every pixel, pooled over the exposures; nothing where no exposure has two frames.
    fn temporal_noise(&self, pixels: usize) -> Option<PixelNoise> {
        let stacks = self.groups.iter().map(|group| &group.1);
        let freedom: usize = stacks.clone().map(|stack| stack.frames() - 1).sum();
        if freedom == 0 {
            return None;
        }
        let variances = pooled_variances(stacks, pixels);
        let typical = typical_variance(&variances, freedom as f64)?;
        Some(PixelNoise {
            variances,
            typical,
            freedom: freedom as f64,
        })
    }

    fn group(&self, index: usize, step: f64) -> ExposureGroup {
        let (exposure_s, stack) = &self.groups[index];
        let frames = self.frames_of(*exposure_s).map(|f| f.mean_adu);
        let (count, means) = (stack.frames(), stack.means());
        let many = count > 1;
        let drift = many.then(|| frame_to_frame_adu(frames.clone()));
        let variance = many
            .then(|| {
                typical_variance(
                    &pooled_variances([stack].into_iter(), means.len()),
                    (count - 1) as f64,
                )
            })
            .flatten();
        // What all pixels do together is in every variance.
        let alone = variance
            .zip(drift)
            .map(|(variance, drift)| (variance - drift * drift).max(0.0));
        let resolved = alone.filter(|&v| v > 0.0 && v >= (LEAST_NOISE_STEPS * step).powi(2));
        ExposureGroup {
            exposure_s: *exposure_s,
            frames: count,
            level_adu: frames.sum::<f64>() / count as f64,
            temporal_noise_adu: resolved.map(|v| (v - ROUNDING_VARIANCE * step * step).sqrt()),
            frame_to_frame_adu: drift,
            means,
            pixel_variance: alone,
        }
    }

    fn frames_of(&self, exposure_s: Option<f64>) -> impl Iterator<Item = &FrameStatistics> + Clone {
        self.frames
            .iter()
            .filter(move |frame| is_same_exposure(frame.exposure_s, exposure_s))
    }

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
        DarkCurrent::of(&frames.collect::<Vec<_>>(), &timed)
    }

    fn full_scale(&self, config: &DarkConfig, step: f64) -> Option<FullScale> {
        let of_format = self.saturation_adu.map(|full| f64::from(full) + step);
        let Some((bits, source)) = config.bits else {
            return of_format.map(|levels_adu| FullScale {
                levels_adu,
                source: FullScaleSource::FileFormat,
            });
        };
        let levels = 2f64.powi(bits as i32);
        // Twelve bits may stand in the upper part of sixteen.
        let shifted = levels * step;
        let levels_adu = match of_format {
            Some(format) if step > 1.0 && shifted <= format => shifted,
            _ => levels,
        };
        Some(FullScale { levels_adu, source })
    }
}

/// The noise of the pixels over the frames.
struct PixelNoise {
    variances: Vec<f32>,
    typical: f64,
    freedom: f64,
}

/// The exposure, for an order in which none comes first.
fn seconds(group: &ExposureGroup) -> f64 {
    group.exposure_s.unwrap_or(f64::NEG_INFINITY)
}

fn read_noise(
    groups: &[ExposureGroup],
    current: Option<&DarkCurrent>,
    gain_e_per_adu: Option<f64>,
) -> Option<f64> {
    let shortest = groups
        .iter()
        .find(|group| group.temporal_noise_adu.is_some())?;
    let variance = shortest.temporal_noise_adu?.powi(2);
    // The mean current of the pixels whose variances were averaged, and not that of the median one.
    let ordinary = current.and_then(|current| Typical::of(&current.of_pixels_adu_s, 0.0));
    let shot_variance = match (ordinary, gain_e_per_adu, shortest.exposure_s) {
        (Some(current), Some(gain), Some(exposure_s)) => current.level.max(0.0) * exposure_s / gain,
        _ => 0.0,
    };
    Some((variance - shot_variance).max(0.0).sqrt())
}

fn missing(
    groups: &[ExposureGroup],
    read_noise_adu: Option<f64>,
    dark_current: Option<&DarkCurrent>,
    full_scale: Option<FullScale>,
    config: &DarkConfig,
) -> Vec<Missing> {
    let mut missing = Vec::new();
    let mut add = |what, reason: String| missing.push(Missing { what, reason });
    if groups.iter().all(|group| group.frames < 2) {
        let reason = "no two frames of one exposure: noise and pattern cannot be told apart";
        for what in [
            "temporal_noise",
            "read_noise",
            "fixed_pattern",
            "frame_to_frame",
        ] {
            add(what, reason.to_owned());
        }
    } else if read_noise_adu.is_none() {
        let reason = "the noise is less than half of the step between grey levels";
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
            format!("{found}: two different ones are needed"),
        );
    }
    if full_scale.is_none() {
        let reason = "the file's levels have no full scale; --bits or --camera gives one";
        add("relative", reason.to_owned());
    }
    if config.gain_e_per_adu.is_none() {
        add(
            "electrons",
            "the gain is not known; --camera gives it".to_owned(),
        );
    }
    missing
}
