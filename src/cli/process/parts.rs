//! `--out-parquet`: the frames of one worker, part by part, as rows of tables.

use super::args::ProcessArgs;
use crate::cli::exit::{CommandError, CommandOutput, OutcomeTally};
use crate::cli::input::names::frame_names;
use crate::cli::output::messages::{one_line, report_error, report_mended, report_warning};
use crate::cli::progress::frames_bar;
use crate::cli::solving::options::SolvingOptions;
use crate::cli::solving::{InputSolver, Inputs, Sink, SolvedImage};
use indicatif::ProgressBar;
use starpipe::base::format::counted;
use starpipe::catalog::Catalog;
use starpipe::frame::{Cameras, ImageName, PageChoice};
use starpipe::report::{FrameReport, StarRow};
use starpipe::store::{Archive, Configuration, FrameRow, Part, PartState, Plan, Shard, StoreError};
use std::ops::ControlFlow;
use std::path::Path;

/// Processes the frames of one worker.
pub(super) fn process_parts(
    arguments: &ProcessArgs,
    directory: &Path,
) -> Result<CommandOutput, CommandError> {
    let options = &arguments.parts;
    let solving = arguments.plan()?;
    let (names, _) = frame_names(&arguments.frames.frames, Cameras::Any)?;
    let plan = Plan::new(names, options.frames_per_part)?;
    let inputs = Inputs::Frames(arguments.page.unwrap_or_default());
    let SolvingOptions {
        catalog, output, ..
    } = &arguments.solving;
    catalog.with_deep(!output.quiet, |pool, indexed, deep| {
        let ProcessArgs {
            calibration, page, ..
        } = arguments;
        let hints = &arguments.solving.hints;
        let configuration = Configuration {
            page: page.and_then(text_of),
            ..calibration.configuration(indexed.catalog(), &solving.options, hints)?
        };
        let archive = Archive::claim(directory, plan, &configuration);
        let archive = archive.map_err(|error| CommandError::of_store(error, "--out-parquet"))?;
        report_mended(archive.mended());
        let mut context = solving.context(indexed);
        context.deep = deep;
        let worker = Worker(InputSolver {
            pool,
            inputs: &inputs,
            context,
            memory: solving.memory,
            sink: TableRowSink(indexed.catalog()),
        });
        let shard = options.shard.unwrap_or(Shard::ALL);
        let parts: Vec<Part> = archive.plan().shard(shard).collect();
        let counts = worker.run(&archive, &parts, output.quiet)?;
        let mut outcome = counts.outcome();
        if output.quiet {
            outcome.text.clear();
        }
        Ok(outcome)
    })
}

/// Makes rows of tables: that of the frame, and those of its stars.
struct TableRowSink<'a>(&'a Catalog);

impl Sink for TableRowSink<'_> {
    type Made = (FrameRow, Vec<StarRow>);

    fn make(&self, image: &ImageName, solved: &SolvedImage) -> Self::Made {
        let report = FrameReport::new(&image.to_string(), &solved.solution, self.0);
        let stars = StarRow::of_frame(&report).collect();
        (FrameRow::new(&report, &solved.solution), stars)
    }
}

/// Solves frames, and writes the rows.
struct Worker<'a>(InputSolver<'a, TableRowSink<'a>>);

/// Counts of a run.
#[derive(Default)]
struct Counts {
    parts: usize,
    skipped: usize,
    frames: OutcomeTally,
}

impl Worker<'_> {
    fn run(
        &self,
        archive: &Archive,
        parts: &[Part],
        is_quiet: bool,
    ) -> Result<Counts, CommandError> {
        let frames: usize = parts.iter().map(|part| part.names.len()).sum();
        let progress = match is_quiet {
            true => ProgressBar::hidden(),
            false => frames_bar(frames as u64),
        };
        let mut counts = Counts::default();
        for part in parts {
            match archive.state(part) {
                PartState::Missing => {}
                PartState::Damaged => {
                    let number = part.number;
                    let text = format!("part {number} is damaged and is processed again");
                    progress.suspend(|| report_warning(text));
                }
                PartState::Whole => {
                    counts.skipped += 1;
                    progress.inc(part.names.len() as u64);
                    progress.reset_eta();
                    continue;
                }
            }
            self.write_part(archive, part, &progress, &mut counts)?;
            counts.parts += 1;
        }
        progress.finish_and_clear();
        Ok(counts)
    }

    fn write_part(
        &self,
        archive: &Archive,
        part: &Part,
        progress: &ProgressBar,
        counts: &mut Counts,
    ) -> Result<(), StoreError> {
        let mut writer = archive.write(part)?;
        let mut added = Ok(());
        self.0.solve_all(part.names, |images| {
            progress.inc(1);
            added = images.into_iter().try_for_each(|(name, rows)| {
                let (frame, stars) = match rows {
                    Ok((frame, stars)) => {
                        counts.frames.count(frame.status == "identified");
                        (frame, stars)
                    }
                    Err(error) => {
                        counts.frames.failed += 1;
                        progress.suspend(|| report_error(error.as_ref()));
                        let unread = FrameRow::unread(&name, one_line(error.as_ref()));
                        (unread, Vec::new())
                    }
                };
                writer.add(frame, stars)
            });
            if added.is_ok() {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        });
        added?;
        writer.finish()
    }
}

impl Counts {
    fn outcome(self) -> CommandOutput {
        let OutcomeTally {
            identified,
            not_identified,
            failed,
        } = self.frames;
        let mut text = format!(
            "{}, {}: {identified} identified, {not_identified} not identified, {failed} unreadable",
            counted(self.parts, "part"),
            counted(identified + not_identified + failed, "frame"),
        );
        if self.skipped > 0 {
            text += &format!("; {} already done", counted(self.skipped, "part"));
        }
        CommandOutput {
            text: text + "\n",
            exit: self.frames.exit(),
        }
    }
}

/// The choice as it is given.
fn text_of(page: PageChoice) -> Option<String> {
    match page {
        PageChoice::Main => None,
        PageChoice::Number(number) => Some(number.to_string()),
        PageChoice::All => Some("all".to_owned()),
    }
}
