//! `--out-parquet`: the frames of one worker, part by part, as rows of tables.

use super::args::ProcessArgs;
use super::configuration::configuration;
use super::images::solve_images;
use crate::cli::batch::for_each_ordered;
use crate::cli::exit::{CommandError, Exit, Outcome};
use crate::cli::input::names::frame_names;
use crate::cli::options::frames::PageChoice;
use crate::cli::output::messages::{one_line, report_error};
use crate::cli::progress::frames_bar;
use crate::cli::solving::result_files::{Image, Solved};
use crate::cli::solving::workspace;
use indicatif::ProgressBar;
use starpipe::archive::{Archive, ArchiveError, FrameRow, Part, Plan, Shard};
use starpipe::base::format::counted;
use starpipe::frame::MemoryLimit;
use starpipe::identify::IndexedCatalog;
use starpipe::pipeline::{Context, Error, Workspace};
use starpipe::report::{FrameReport, StarRow};
use std::ops::ControlFlow;
use std::path::Path;

/// Processes the frames of one worker.
pub(super) fn process_parts(
    arguments: &ProcessArgs,
    directory: &Path,
) -> Result<Outcome, CommandError> {
    let options = &arguments.parts;
    let solving = arguments.plan()?;
    let names = frame_names(&arguments.frames.frames)?;
    let plan = Plan::new(names, options.frames_per_part)?;
    arguments.solving.catalog.with_index(|pool, indexed| {
        let configuration = configuration(arguments, &solving.options, indexed.catalog())?;
        let archive = Archive::claim(directory, plan, &configuration).map_err(claim_error)?;
        let worker = Worker {
            pool,
            context: solving.context(indexed),
            indexed,
            memory: solving.memory,
            page: arguments.page,
        };
        let shard = options.shard.unwrap_or(Shard::ALL);
        let parts: Vec<Part> = archive.plan().shard(shard).collect();
        let tally = worker.run(&archive, &parts)?;
        Ok(tally.outcome())
    })
}

/// A directory that holds something else is an error of the command line.
fn claim_error(error: ArchiveError) -> CommandError {
    match error {
        ArchiveError::OtherRun { .. } | ArchiveError::Foreign { .. } => CommandError::Usage(
            format!("{error}; choose another directory for --out-parquet"),
        ),
        other => CommandError::Failed(other.into()),
    }
}

/// The rows of a frame and its stars, or why there are none.
type Rows = Result<(FrameRow, Vec<StarRow>), Error>;

/// Solves frames, and makes rows of them.
struct Worker<'a> {
    pool: &'a rayon::ThreadPool,
    context: Context<'a>,
    indexed: &'a IndexedCatalog<'a>,
    memory: MemoryLimit,
    page: Option<PageChoice>,
}

/// Counts of a run.
#[derive(Default)]
struct Tally {
    parts: usize,
    skipped: usize,
    frames: usize,
    not_identified: usize,
    unread: usize,
}

impl Worker<'_> {
    fn run(&self, archive: &Archive, parts: &[Part]) -> Result<Tally, CommandError> {
        let frames: usize = parts.iter().map(|part| part.names.len()).sum();
        let progress = frames_bar(frames as u64);
        let mut tally = Tally::default();
        for part in parts {
            if archive.has(part) {
                tally.skipped += 1;
                progress.inc(part.names.len() as u64);
                progress.reset_eta();
                continue;
            }
            self.write_part(archive, part, &progress, &mut tally)?;
            tally.parts += 1;
        }
        progress.finish_and_clear();
        Ok(tally)
    }

    fn write_part(
        &self,
        archive: &Archive,
        part: &Part,
        progress: &ProgressBar,
        tally: &mut Tally,
    ) -> Result<(), ArchiveError> {
        let mut writer = archive.write(part)?;
        let mut added = Ok(());
        let work = |name: &String, workspace: &mut Workspace| self.solve(name, workspace);
        let buffers = || workspace(self.pool, part.names.len(), self.memory);
        for_each_ordered(self.pool, part.names, buffers, work, |_, images| {
            progress.inc(1);
            added = images.into_iter().try_for_each(|(name, solved)| {
                tally.frames += 1;
                let (frame, stars) = solved.unwrap_or_else(|error| {
                    tally.unread += 1;
                    progress.suspend(|| report_error(&error));
                    (FrameRow::unread(&name, one_line(&error)), Vec::new())
                });
                tally.not_identified += usize::from(frame.status == "not_identified");
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

    /// The rows of each image of a file.
    fn solve(&self, name: &str, workspace: &mut Workspace) -> Vec<(String, Rows)> {
        let finish = |image: Image, mut solved: Solved, workspace: &mut Workspace| {
            solved.recycle_frame(workspace);
            let name = image.name().display().to_string();
            let report = FrameReport::new(&name, &solved.solution, self.indexed.catalog());
            let stars = StarRow::of_frame(&report).collect();
            (FrameRow::new(&report, &solved.solution), stars)
        };
        let path = Path::new(name);
        let images = solve_images(path, self.page, &self.context, workspace, finish).into_iter();
        let named = images.map(|(image, rows)| (image.name().display().to_string(), rows));
        named.collect()
    }
}

impl Tally {
    fn outcome(self) -> Outcome {
        let identified = self.frames - self.not_identified - self.unread;
        let mut text = format!(
            "{}, {}: {identified} identified, {} not identified, {} unread",
            counted(self.parts, "part"),
            counted(self.frames, "frame"),
            self.not_identified,
            self.unread
        );
        if self.skipped > 0 {
            text += &format!("; {} there already", counted(self.skipped, "part"));
        }
        let exit = match (self.unread, self.not_identified) {
            (0, 0) => Exit::Success,
            (0, _) => Exit::NotIdentified,
            _ => Exit::Failure,
        };
        Outcome {
            text: text + "\n",
            exit,
        }
    }
}
