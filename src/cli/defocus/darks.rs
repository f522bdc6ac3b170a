//! The noise of the user's dark frames.

use crate::cli::exit::CommandError;
use crate::cli::input::frames::{FrameList, for_each_frame};
use crate::cli::input::stdin::is_stdin;
use crate::cli::output::messages::report_warning;
use anyhow::anyhow;
use starpipe::calibration::darks::{
    DarkConfig, DarkStack, Darks, FrameStatistics, FullScaleSource,
};
use starpipe::camera::data_sheet::DataSheet;
use starpipe::frame::Frame;
use starpipe::lab::spot_radius::DarkNoise;
use starpipe::predict::Scenario;
use std::path::{Path, PathBuf};

/// Exposures that differ by more than this part have different dark currents.
const SAME_EXPOSURE: f64 = 0.05;

/// The noise of the dark frames in `paths`, at the exposure nearest to that of the scenario.
pub(super) fn dark_noise(
    paths: &[PathBuf],
    scenario: Option<&Scenario>,
    pool: &rayon::ThreadPool,
) -> Result<DarkNoise, CommandError> {
    let frames = named_frames(paths)?;
    let darks = measure(&frames, scenario.map(|scenario| &scenario.camera), pool)?;
    let wanted_s = scenario.map(|scenario| scenario.conditions.exposure_s);
    let noise = DarkNoise::at_exposure(&darks, wanted_s);
    if let (Some(exposure_s), Some(wanted_s)) = (noise.exposure_s, wanted_s)
        && (exposure_s / wanted_s - 1.0).abs() > SAME_EXPOSURE
    {
        report_warning(format_args!(
            "the dark frames were exposed for {exposure_s} s, the star images for {wanted_s} s: the dark current differs"
        ));
    }
    Ok(noise)
}

/// Reads and measures dark frames. All must be readable and taken without light.
fn measure(
    frames: &[PathBuf],
    sheet: Option<&DataSheet>,
    pool: &rayon::ThreadPool,
) -> anyhow::Result<Darks> {
    let mut stack = DarkStack::new();
    let measure = |path: &Path, frame: Frame<'static>| {
        let statistics = FrameStatistics::measure(&path.display().to_string(), &frame, None);
        (frame, statistics)
    };
    let take = |(frame, statistics): (Frame, FrameStatistics)| Ok(stack.add(&frame, statistics)?);
    let unread = for_each_frame(pool, frames, None, measure, take)?;
    if unread > 0 {
        return Err(anyhow!(
            "{unread} of {} dark frames could not be read",
            frames.len()
        ));
    }
    let darks = stack.measure(&DarkConfig {
        bits: sheet.map(|sheet| (sheet.bits, FullScaleSource::Camera)),
        gain_e_per_adu: sheet.map(|sheet| sheet.gain_e_per_adu),
        ..DarkConfig::default()
    })?;
    let more = match &darks.warnings[..] {
        [] => return Ok(darks),
        [_] => String::new(),
        [_, others @ ..] => format!("; {} more warnings", others.len()),
    };
    let first = &darks.warnings[0];
    Err(anyhow!("{first}{more}: the dark noise cannot be measured"))
}

/// The files that paths, directories and patterns stand for.
fn named_frames(paths: &[PathBuf]) -> Result<Vec<PathBuf>, CommandError> {
    let mut inputs = Vec::new();
    for path in paths {
        let text = path.to_string_lossy();
        if path.exists() || is_stdin(path) || !text.contains(['*', '?', '[']) {
            inputs.push(path.clone());
        } else {
            inputs.extend(matching(&text)?);
        }
    }
    let mut list = FrameList::expand(inputs)?;
    let Some(last) = list.errors.pop() else {
        return Ok(list.paths);
    };
    list.reported();
    Err(last.into())
}

/// The files that match a pattern, at least one.
fn matching(pattern: &str) -> Result<Vec<PathBuf>, CommandError> {
    let found = glob::glob(pattern).map_err(|error| {
        CommandError::Usage(format!(
            "--darks '{pattern}' is not a valid pattern: {error}"
        ))
    })?;
    let found: Vec<_> = found.collect::<Result<_, _>>()?;
    if found.is_empty() {
        return Err(anyhow!("{pattern}: no file matches").into());
    }
    Ok(found)
}
