//! One run: its frames, as many as are not there yet, and what they say together.

use super::figures;
use super::tables::{Lines, Tables};
use super::{Shared, identity};
use crate::cli::batch::for_each_ordered;
use crate::cli::exit::CommandError;
use crate::cli::output::files::write_whole;
use crate::cli::plot::FigureForm;
use anyhow::Context;
use serde::Serialize;
use starpipe::pipeline::Workspace;
use starpipe::study::validation::{
    Accumulator, Protocol, RunFacts, Summary, ValidationError, Validator,
};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Frames are handed out in portions of so many: those of a part of the Parquet tables.
const PORTION: u64 = super::parquet::FRAMES_PER_PART;

/// What an earlier, shorter run may have left, and what says that a run has ended.
const RESULTS: [&str; 2] = ["summary.json", "summary.txt"];

/// How long the frames of this start took. It differs from run to run, and is kept apart from what does not.
#[derive(Debug, Default, Serialize)]
struct Timing {
    frames: u64,
    threads: usize,
    wall_s: f64,
    frames_per_s: f64,
    /// On one thread, on average over the frames.
    simulate_ms: f64,
    process_ms: f64,
}

/// Does what is left to do of a run of so many frames in `directory`, and sums it up.
pub(super) fn run(
    directory: &Path,
    protocol: &Protocol,
    shared: &Shared,
) -> Result<Summary, CommandError> {
    let validator = Validator::new(shared.indexed, protocol).map_err(|error| match error {
        ValidationError::Scenario(_) | ValidationError::NoLimit => {
            CommandError::Usage(error.to_string())
        }
        other => CommandError::Failed(other.into()),
    })?;
    identity::claim(directory, protocol, shared.indexed.catalog())?;
    let mut tables = Tables::open(directory, |number| validator.draw(number).0)?;
    let done = tables.done();
    if done > shared.frames {
        return Err(CommandError::Usage(format!(
            "{} already holds {done} frames; --frames {} would be fewer",
            directory.display(),
            shared.frames
        )));
    }
    shared.progress.inc(done);
    shared.progress.reset_eta();
    if done < shared.frames {
        if done > 0 {
            shared.tell(format_args!(
                "going on in {} after {done} frames",
                directory.display()
            ));
        }
        remove_results(directory)?;
        tables.remove_unfinished_part()?;
        let timing = simulate(&validator, &mut tables, shared)?;
        let text = serde_json::to_string_pretty(&timing).context("writing JSON")? + "\n";
        write_whole(&[(directory.join("timing.json"), text.into_bytes())])?;
        shared.tell(format_args!(
            "{} frames in {:.1} s, {:.1} frames a second; {:.1} ms to simulate one, {:.1} ms to process it",
            timing.frames,
            timing.wall_s,
            timing.frames_per_s,
            timing.simulate_ms,
            timing.process_ms
        ));
    }
    tables.write_parts(true)?;
    let summary = summed_up(&validator, protocol, &tables)?;
    save(directory, &summary, shared.figures)?;
    Ok(summary)
}

/// Simulates and processes the frames that are left, and adds them to the tables.
fn simulate(validator: &Validator, tables: &mut Tables, shared: &Shared) -> anyhow::Result<Timing> {
    let start = Instant::now();
    let mut timing = Timing {
        threads: shared.pool.current_num_threads(),
        ..Timing::default()
    };
    while tables.done() < shared.frames {
        let from = tables.done();
        let to = ((from / PORTION + 1) * PORTION).min(shared.frames);
        let numbers: Vec<u64> = (from..to).collect();
        let work = |number: &u64, workspace: &mut Workspace| -> anyhow::Result<_> {
            let trial = validator.run_one(*number, workspace)?;
            let lines = Lines::new(&trial.frame, &trial.stars)?;
            Ok((lines, trial.simulate_ms, trial.process_ms))
        };
        let mut failed = None;
        for_each_ordered(shared.pool, &numbers, Workspace::new, work, |_, done| {
            let added = done.and_then(|(lines, simulate_ms, process_ms)| {
                timing.simulate_ms += simulate_ms;
                timing.process_ms += process_ms;
                timing.frames += 1;
                tables.add(&lines)
            });
            shared.progress.inc(1);
            match added {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    failed = Some(error);
                    ControlFlow::Break(())
                }
            }
        });
        if let Some(error) = failed {
            return Err(error);
        }
        tables.write_parts(false)?;
    }
    let frames = timing.frames as f64;
    timing.wall_s = start.elapsed().as_secs_f64();
    timing.frames_per_s = frames / timing.wall_s;
    timing.simulate_ms /= frames;
    timing.process_ms /= frames;
    Ok(timing)
}

/// What all rows say together: read again from the tables, so that it cannot depend on how often the run was interrupted.
fn summed_up(
    validator: &Validator,
    protocol: &Protocol,
    tables: &Tables,
) -> anyhow::Result<Summary> {
    let sheet = &protocol.setup.scenario.camera;
    let facts = RunFacts {
        camera: sheet.name.clone(),
        width_px: sheet.width_px,
        height_px: sheet.height_px,
        seed: protocol.seed,
        scale_known: protocol.scale_known,
        false_alarms_per_mpx: protocol.setup.scenario.conditions.false_alarms_per_mpx,
    };
    let mut accumulator = Accumulator::new(facts, validator.limit_vmag());
    for frame in tables.frames()? {
        accumulator.add_frame(&frame?);
    }
    for star in tables.stars()? {
        accumulator.add_star(&star?);
    }
    Ok(accumulator.finish())
}

fn remove_results(directory: &Path) -> anyhow::Result<()> {
    for name in RESULTS {
        let path = directory.join(name);
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(error)
                    .with_context(|| format!("removing {}, which is out of date", path.display()));
            }
            _ => (),
        }
    }
    Ok(())
}

/// Writes the summary, for programs and for people, and its figures.
fn save(directory: &Path, summary: &Summary, form: FigureForm) -> anyhow::Result<()> {
    let json = serde_json::to_string_pretty(summary).context("writing JSON")? + "\n";
    let [for_programs, for_people] = RESULTS.map(|name| directory.join(name));
    let mut files: Vec<(PathBuf, Vec<u8>)> = figures::of_run(summary, form)?
        .into_iter()
        .map(|(name, content)| (directory.join(name), content))
        .collect();
    files.push((for_programs, json.into_bytes()));
    files.push((for_people, summary.to_text().into_bytes()));
    write_whole(&files)
}
