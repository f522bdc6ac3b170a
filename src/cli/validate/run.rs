//! One run: simulates and processes the missing frames, and summarizes all of them.

use super::figures;
use super::frames::RunFrames;
use super::parquet::{remove_unfinished, write_parts};
use super::shared::Shared;
use crate::cli::batch::try_for_each_ordered;
use crate::cli::exit::CommandError;
use crate::cli::output::files::remove_outdated;
use crate::cli::output::rows::json_indented;
use serde::Serialize;
use starpipe::lab::StudyError;
use starpipe::lab::validation::{
    FRAMES_PER_PART, FrameLines, RunTables, ValidationProtocol, ValidationSummary, Validator,
    claim_directory,
};
use starpipe::solve::Workspace;
use std::path::Path;
use std::time::Instant;

/// Files of a complete run. An incomplete one has none of them.
const RESULTS: [&str; 2] = ["summary.json", "summary.txt"];

/// Time that the frames of this start took. It differs each time, so it has a file of its own.
#[derive(Debug, Default, Serialize)]
struct RunTiming {
    frames: u64,
    threads: usize,
    wall_s: f64,
    frames_per_s: f64,
    /// On one thread, mean over the frames.
    simulate_ms: f64,
    process_ms: f64,
}

/// A complete run.
pub(super) struct ValidationRun {
    pub(super) summary: ValidationSummary,
    /// What a page shows of its frames.
    pub(super) frames: RunFrames,
}

/// Completes the run in `directory` and summarizes it.
pub(super) fn run(
    directory: &Path,
    protocol: &ValidationProtocol,
    shared: &Shared,
) -> Result<ValidationRun, CommandError> {
    let validator = Validator::new(shared.indexed, protocol).map_err(|error| match error {
        StudyError::Scenario(_) | StudyError::NoLimit => CommandError::usage(error),
        other => CommandError::Failed(other.into()),
    })?;
    claim_directory(directory, protocol, shared.indexed.catalog())
        .map_err(|error| CommandError::of_store(error, "--out"))?;
    let mut tables = RunTables::open(directory, |number| validator.draw(number).0)?;
    let done = tables.done();
    if done > shared.frames {
        return Err(CommandError::Usage(format!(
            "{} already holds {done} frames; --count {} would be fewer",
            directory.display(),
            shared.frames
        )));
    }
    shared.progress.inc(done);
    shared.progress.reset_eta();
    if done < shared.frames {
        complete(directory, &validator, &mut tables, shared)?;
    }
    write_parts(directory, &tables)?;
    let summary = tables.summary(validator.facts(), validator.limit_vmag())?;
    save(directory, &summary, shared)?;
    let frames = match shared.pictures {
        Some(most) => RunFrames::of(&tables, &validator, most)?,
        None => RunFrames::default(),
    };
    Ok(ValidationRun { summary, frames })
}

/// Simulates and processes the missing frames, and reports how long it took.
fn complete(
    directory: &Path,
    validator: &Validator,
    tables: &mut RunTables,
    shared: &Shared,
) -> anyhow::Result<()> {
    let done = tables.done();
    if done > 0 {
        let directory = directory.display();
        shared.report(format_args!(
            "continuing in {directory} after {done} frames"
        ));
    }
    for name in RESULTS {
        remove_outdated(&directory.join(name))?;
    }
    remove_unfinished(directory, tables)?;
    let timing = simulate(directory, validator, tables, shared)?;
    let text = json_indented(&timing)?;
    shared.write(directory, [("timing.json", text)], Vec::new());
    shared.report(format_args!(
        "{} frames in {:.1} s, {:.1} frames a second; {:.1} ms to simulate one, {:.1} ms to process it",
        timing.frames, timing.wall_s, timing.frames_per_s, timing.simulate_ms, timing.process_ms
    ));
    Ok(())
}

/// Simulates and processes the missing frames, part by part, and adds them to the tables.
fn simulate(
    directory: &Path,
    validator: &Validator,
    tables: &mut RunTables,
    shared: &Shared,
) -> anyhow::Result<RunTiming> {
    let start = Instant::now();
    let mut timing = RunTiming {
        threads: shared.pool.current_num_threads(),
        ..RunTiming::default()
    };
    while tables.done() < shared.frames {
        simulate_part(validator, tables, shared, &mut timing)?;
        write_parts(directory, tables)?;
    }
    let frames = timing.frames as f64;
    timing.wall_s = start.elapsed().as_secs_f64();
    timing.frames_per_s = frames / timing.wall_s;
    timing.simulate_ms /= frames;
    timing.process_ms /= frames;
    Ok(timing)
}

/// Simulates and processes the missing frames of one part.
fn simulate_part(
    validator: &Validator,
    tables: &mut RunTables,
    shared: &Shared,
    timing: &mut RunTiming,
) -> anyhow::Result<()> {
    let first = tables.done();
    let end = ((first / FRAMES_PER_PART + 1) * FRAMES_PER_PART).min(shared.frames);
    let numbers: Vec<u64> = (first..end).collect();
    let work = |number: &u64, workspace: &mut Workspace| -> anyhow::Result<_> {
        let trial = validator.run_one(*number, workspace)?;
        let lines = FrameLines::new(&trial.frame, &trial.stars)?;
        Ok((lines, trial.simulate_ms, trial.process_ms))
    };
    try_for_each_ordered(shared.pool, &numbers, Workspace::new, work, |_, done| {
        shared.progress.inc(1);
        let (lines, simulate_ms, process_ms) = done?;
        timing.simulate_ms += simulate_ms;
        timing.process_ms += process_ms;
        timing.frames += 1;
        Ok(tables.add(&lines)?)
    })
}

/// Writes the summary as JSON and text, and its figures.
fn save(directory: &Path, summary: &ValidationSummary, shared: &Shared) -> anyhow::Result<()> {
    let texts = [json_indented(summary)?, summary.to_text()];
    let sheets = figures::of_run(summary);
    shared.write(directory, RESULTS.into_iter().zip(texts), sheets);
    Ok(())
}
