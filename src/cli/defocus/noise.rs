//! The noise of a pixel in the dark: the camera's, that of the user's dark frames, or the paper's.

use super::args::DefocusArgs;
use crate::cli::exit::CommandError;
use crate::cli::input::frames::{self as input, for_each_frame};
use crate::cli::output::messages::{one_line, report_error, report_warning};
use anyhow::{Context, anyhow, bail};
use serde::Serialize;
use starpipe::calibration::darks::{
    DarkConfig, DarkStack, Darks, ExposureGroup, FrameStatistics, FullScaleSource,
};
use starpipe::camera::data_sheet::DataSheet;
use starpipe::frame::Buffers;
use starpipe::model::defocus::PAPER_RELATIVE_NOISE;
use starpipe::model::sensitivity::{Budget, Scenario};
use std::path::PathBuf;

/// Exposures that differ by more than this part of them give other dark currents.
const SAME_EXPOSURE: f64 = 0.05;

/// The noise for which radii are told.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Noise {
    /// As a part of full scale, where that is known.
    pub(super) relative: Option<f64>,
    /// In electrons, where the gain is known.
    pub(super) e: Option<f64>,
    /// Whose it is.
    pub(super) source: String,
    /// What the dark frames tell.
    pub(super) darks: Option<DarkNoise>,
}

/// What dark frames tell of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct DarkNoise {
    frames: usize,
    exposure_s: Option<f64>,
    /// Spread of a frame's pixels, all of them (eq. 3).
    pub(super) sigma_adu: f64,
    /// The same over full scale (eq. 4).
    pub(super) relative_sigma: Option<f64>,
    /// Standard deviation of a pixel from frame to frame.
    pub(super) temporal_adu: Option<f64>,
    /// Standard deviation from pixel to pixel of what is the same on every frame, hot ones left out.
    pub(super) pattern_adu: Option<f64>,
}

impl Noise {
    /// What a centroid by `peak` is disturbed by.
    pub(super) fn of_peak(
        arguments: &DefocusArgs,
        darks: Option<DarkNoise>,
    ) -> Result<Self, CommandError> {
        let (relative, source) = match (darks, arguments.at_noise) {
            (Some(dark), _) => {
                let relative = dark.relative_sigma.filter(|sigma| *sigma > 0.0);
                let sigma = relative.ok_or_else(|| {
                    anyhow!("the dark frames have no noise, or no full scale; --camera gives the bits of a grey level")
                })?;
                (sigma, "the dark frames, all pixels")
            }
            (None, Some(relative)) => (relative, "--at-noise"),
            (None, None) => (PAPER_RELATIVE_NOISE, "the paper's dark frames"),
        };
        Ok(Self {
            relative: Some(relative),
            e: None,
            source: source.to_owned(),
            darks,
        })
    }

    /// What a star of a camera is disturbed by besides the photons of star and sky.
    pub(super) fn of_energy(
        scenario: &mut Scenario,
        darks: Option<DarkNoise>,
    ) -> anyhow::Result<Self> {
        let gain = scenario.camera.gain_e_per_adu;
        let (e, source) = match darks {
            None => {
                let budget = Budget::new(scenario);
                (
                    budget.read_noise_e.hypot(budget.dark_e.sqrt()),
                    "the camera",
                )
            }
            Some(dark) => {
                let temporal = dark.temporal_adu.context(
                    "the dark frames tell no temporal noise: expected two or more of one exposure, with a noise above half a grey level",
                )?;
                (
                    temporal.hypot(dark.pattern_adu.unwrap_or(0.0)) * gain,
                    "the dark frames: from frame to frame and from pixel to pixel, hot pixels left out",
                )
            }
        };
        if e <= 0.0 {
            bail!(
                "the noise of a pixel in the dark is 0 e, expected more: --read-noise-e or --darks gives it"
            );
        }
        // It stands for both from here on.
        scenario.camera.dark_current_e_s = 0.0;
        scenario.camera.read_noise_e = e;
        Ok(Self {
            relative: Some(e / gain / (scenario.camera.full_scale_adu() + 1.0)),
            e: Some(e),
            source: source.to_owned(),
            darks,
        })
    }
}

/// The noise of the dark frames that are named, where any are.
pub(super) fn of_darks(
    arguments: &DefocusArgs,
    scenario: Option<&Scenario>,
    pool: &rayon::ThreadPool,
) -> Result<Option<DarkNoise>, CommandError> {
    if arguments.darks.is_empty() {
        return Ok(None);
    }
    let frames = named(&arguments.darks)?;
    let mut stack = DarkStack::new();
    let read = |path: &PathBuf| -> anyhow::Result<_> {
        let frame = input::read_frame(path, None, &mut Buffers::new()).context("reading")?;
        let statistics = FrameStatistics::of(&path.display().to_string(), &frame, None);
        Ok((frame, statistics))
    };
    let unread = for_each_frame(pool, &frames, read, |(frame, statistics)| {
        Ok(stack.add(&frame, statistics)?)
    })?;
    if unread > 0 {
        return Err(anyhow!("{unread} of {} dark frames could not be read", frames.len()).into());
    }
    let sheet = scenario.map(|scenario| &scenario.camera);
    let darks = stack.measure(&config(sheet)).map_err(anyhow::Error::from)?;
    if let [first, others @ ..] = &darks.warnings[..] {
        let others = match others.len() {
            0 => String::new(),
            others => format!("; {others} more do not either"),
        };
        return Err(
            anyhow!("{first}{others}: the noise of the dark cannot be told from it").into(),
        );
    }
    Ok(Some(of_exposure(&darks, scenario)))
}

fn config(sheet: Option<&DataSheet>) -> DarkConfig {
    DarkConfig {
        bits: sheet.map(|sheet| (sheet.bits, FullScaleSource::Camera)),
        gain_e_per_adu: sheet.map(|sheet| sheet.gain_e_per_adu),
        ..DarkConfig::default()
    }
}

/// The files that paths, directories and patterns stand for.
fn named(darks: &[PathBuf]) -> Result<Vec<PathBuf>, CommandError> {
    let mut inputs = Vec::new();
    for path in darks {
        let text = path.to_string_lossy();
        if path.exists() || input::is_stdin(path) || !text.contains(['*', '?', '[']) {
            inputs.push(path.clone());
            continue;
        }
        let found = glob::glob(&text).map_err(|error| {
            CommandError::Usage(format!("--darks '{text}' is no pattern: {error}"))
        })?;
        let before = inputs.len();
        for path in found {
            inputs.push(path.map_err(anyhow::Error::from)?);
        }
        if inputs.len() == before {
            return Err(anyhow!("{text}: no frame has such a name").into());
        }
    }
    input::check(&inputs)?;
    let (frames, troubles) = input::frames(inputs);
    match &troubles[..] {
        [] => Ok(frames),
        [.., last] => {
            for trouble in &troubles[..troubles.len() - 1] {
                report_error(one_line(trouble));
            }
            Err(anyhow!(one_line(last)).into())
        }
    }
}

/// What the frames tell, at the exposure that is nearest to the scenario's.
fn of_exposure(darks: &Darks, scenario: Option<&Scenario>) -> DarkNoise {
    let wanted_s = scenario.map(|scenario| scenario.conditions.exposure_s);
    let off = |group: &&ExposureGroup| match (group.exposure_s, wanted_s) {
        (Some(exposure_s), Some(wanted_s)) => (exposure_s / wanted_s).ln().abs(),
        _ => 0.0,
    };
    let measured = darks.groups.iter().filter(|group| group.frames > 1);
    let group = measured
        .min_by(|a, b| off(a).total_cmp(&off(b)))
        .or(darks.groups.first());
    let exposure_s = group.and_then(|group| group.exposure_s);
    if let (Some(exposure_s), Some(wanted_s)) = (exposure_s, wanted_s)
        && (exposure_s / wanted_s - 1.0).abs() > SAME_EXPOSURE
    {
        report_warning(format_args!(
            "the dark frames were exposed for {exposure_s} s, the stars for {wanted_s} s: the dark current differs"
        ));
    }
    DarkNoise {
        frames: darks.frames.len(),
        exposure_s,
        sigma_adu: darks.sigma_adu,
        relative_sigma: darks
            .full_scale
            .map(|full| darks.sigma_adu / full.levels_adu),
        temporal_adu: group.and_then(|group| group.temporal_noise_adu),
        pattern_adu: darks.pattern.as_ref().and_then(|pattern| pattern.fixed_adu),
    }
}
