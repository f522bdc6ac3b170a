//! The stages in order.

use super::camera_check::Solved;
use super::context::{Context, Workspace};
use super::error::Error;
use super::identification::{identified, observation, search, star_field};
use super::note::Note;
use super::solution::{Background, Solution, Source};
use super::stopwatch::{Stage, Stopwatch};
use crate::calibration::Calibration;
use crate::detect::{self, DetectError};
use crate::frame::{self, Frame, FrameError};
use crate::photometry::{self, MeasuredFrame};
use std::num::NonZeroUsize;
use std::path::Path;

/// Solves the frame in a file, or its image number `page`, counted from 1.
///
/// # Errors
/// [`Error::Read`] if there is no frame in the file, [`Error::Calibrate`] if the calibration is of another
/// camera, [`Error::Detect`] if stars cannot be detected in it.
pub fn solve_file(
    path: impl AsRef<Path>,
    page: Option<NonZeroUsize>,
    context: &Context,
    workspace: &mut Workspace,
) -> Result<Solution, Error> {
    let path = path.as_ref();
    let read = |buffers: &mut frame::Buffers| frame::read_page_with(path, page, buffers);
    let (solution, frame) = solve_read(path, read, context, workspace)?;
    workspace.frames.recycle(frame);
    Ok(solution)
}

/// Solves the frame that `read` returns, and returns it with the solution. Give it back to the workspace once
/// it is no longer needed ([`frame::Buffers::recycle`]). `name` is the file's name, or stands for one.
///
/// # Errors
/// As [`solve_file`].
pub fn solve_read(
    name: &Path,
    read: impl FnOnce(&mut frame::Buffers) -> Result<Frame, FrameError>,
    context: &Context,
    workspace: &mut Workspace,
) -> Result<(Solution, Frame), Error> {
    let mut clock = Stopwatch::start();
    let mut frame = read(&mut workspace.frames)?;
    let calibration = context.calibration;
    if let Some(calibration) = calibration {
        calibration
            .apply(&mut frame)
            .map_err(|source| Error::Calibrate {
                path: name.to_owned(),
                source,
            })?;
    }
    clock.lap(Stage::Read);
    let input = Input {
        frame: &frame,
        name: Some(name),
        calibration,
        clock,
    };
    let solution = solve(input, context, workspace).map_err(|source| Error::Detect {
        path: name.to_owned(),
        source,
    })?;
    Ok((solution, frame))
}

/// Solves a frame in memory. It is not calibrated.
///
/// # Errors
/// [`DetectError`] if stars cannot be detected in it.
pub fn solve_frame(
    frame: &Frame,
    context: &Context,
    workspace: &mut Workspace,
) -> Result<Solution, DetectError> {
    let input = Input {
        frame,
        name: None,
        calibration: None,
        clock: Stopwatch::start(),
    };
    solve(input, context, workspace)
}

/// A frame, and what is known of its origin.
struct Input<'a> {
    frame: &'a Frame,
    name: Option<&'a Path>,
    /// The calibration that was applied.
    calibration: Option<&'a Calibration>,
    clock: Stopwatch,
}

/// The spine: every stage once, in order.
fn solve(
    input: Input,
    context: &Context,
    workspace: &mut Workspace,
) -> Result<Solution, DetectError> {
    let Input {
        frame, mut clock, ..
    } = input;
    let (sky, camera) = (context.sky, context.camera.as_ref());

    let priors = context.priors_of(frame, input.name);
    let config = context.detect_config(frame);
    let detections = detect::detect(frame, &config, &mut workspace.detect)?;
    clock.lap(Stage::Detect);

    let field = star_field(frame, &detections, priors.years_since_j2000());
    let (found, dropped_scale) = search(&field, &priors, sky, &mut workspace.identify);
    let image = Some((frame, &detections));
    let outcome = identified(found, image, &field, &priors.binding(), sky);
    clock.lap(Stage::Identify);

    let photometry = outcome.identification().map(|identification| {
        let measured = MeasuredFrame {
            detections: &detections,
            identification,
            years_since_j2000: priors.years_since_j2000(),
            exposure_s: priors.exposure_s,
        };
        photometry::measure(&measured, sky)
    });
    let observation = observation(&outcome, &priors);
    let background = Background {
        level_adu: detections.background_adu,
        noise_adu: detections.noise_adu,
    };
    let solved = Solved {
        context,
        frame,
        priors: &priors,
        background,
        spot_sigma_px: detections.spot_sigma_px,
        outcome: &outcome,
        photometry: photometry.as_ref(),
        observation: observation.as_ref(),
    };
    let comparison = camera.and_then(|camera| solved.compare_with(camera));
    clock.lap(Stage::Photometry);

    let ignored = frame.metadata.ignored.iter().cloned();
    let mismatch = input
        .calibration
        .and_then(|calibration| calibration.exposure_mismatch(priors.exposure_s));
    let mut notes: Vec<Note> = ignored.map(Note::IgnoredHeader).collect();
    notes.extend(Note::of_scale(dropped_scale, &outcome));
    notes.extend(Note::of_observation(
        observation.as_ref(),
        &priors,
        &outcome,
    ));
    notes.extend(Note::of_camera(camera, comparison.as_ref()));
    notes.extend(Note::of_photometry(photometry.as_ref()));
    notes.extend(mismatch.map(Note::DarkExposure));
    Ok(Solution {
        width: frame.width,
        height: frame.height,
        date: priors.date,
        observation,
        exposure_s: priors.exposure_s,
        notes,
        sources: detections.sources.iter().map(Source::from).collect(),
        background: Some(background),
        outcome,
        photometry,
        comparison,
        gain_e_per_adu: camera.map(|camera| camera.sensor.gain_e_per_adu),
        calibration: input.calibration.map(Calibration::applied),
        timing: clock.timing(),
    })
}
