//! `astap`: answers programs that call ASTAP. Its command line → a solution → its files, lines and exit status.
//!
//! What its callers pass and read is in `docs/doors/astap.md`.

mod args;
mod words;

pub(crate) use args::AstapArgs;
pub(crate) use words::translated;

use super::Question;
use crate::cli::exit::{CommandError, CommandOutput, Exit};
use crate::cli::input::frames::read_frame;
use crate::cli::output::files::write_whole;
use crate::cli::output::messages::{one_line, report_error};
use crate::cli::solving::{Inputs, SolvingPlan};
use anyhow::anyhow;
use starpipe::catalog::Catalog;
use starpipe::detect::{DetectConfig, detect};
use starpipe::doors::FitsFileHeader;
use starpipe::doors::astap::{Failure, Ini, Plate, StarList, row_order, solved_cards};
use starpipe::frame::{Frame, MemoryLimit, PageChoice, RowOrder};
use starpipe::report::FrameReport;
use starpipe::solve::{Outcome, Solution, Source, Workspace, solve_guarded, solve_read};
use std::fs::{self, File};
use std::io::Read;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::{env, mem};

/// Its name, as a command and as a program.
pub(crate) const NAME: &str = "astap";

/// `starpipe astap`
pub(crate) fn astap(mut arguments: AstapArgs) -> Result<CommandOutput, CommandError> {
    if let Some(job) = arguments.other_job.first() {
        return Err(anyhow!("-{job} is a job that only ASTAP itself does").into());
    }
    let Some(path) = arguments.file.take() else {
        return Err(anyhow!("no frame is given; give one with -f FILE").into());
    };
    arguments.take_databases();
    let mut workspace = Workspace::new();
    workspace.frames.set_memory(MemoryLimit::default());
    let frame = read_frame(&path, None, &mut workspace.frames);
    let run = Run {
        head: first_bytes(&path),
        base: arguments.output.take().unwrap_or_else(|| path.clone()),
        path,
        arguments,
    };
    match (frame, run.arguments.least_snr()) {
        (Err(error), _) => {
            report_error(&error);
            run.unsolved(Failure::UnreadableImage, None, "")
        }
        (Ok(frame), Some(least_snr)) => run.measured(&frame, least_snr),
        (Ok(frame), None) => run.solved(frame, workspace),
    }
}

/// What is stated.
struct Run {
    arguments: AstapArgs,
    /// The frame's file, and how it begins.
    path: PathBuf,
    head: Vec<u8>,
    /// The name of result files, with some extension.
    base: PathBuf,
}

impl Run {
    /// Measures the stars, in place of solving.
    fn measured(&self, frame: &Frame, least_snr: f64) -> Result<CommandOutput, CommandError> {
        let pool = self.arguments.catalog.threads.pool()?;
        let workspace = Workspace::new().detect;
        let mut workspace = match NonZeroUsize::new(pool.current_num_threads()) {
            Some(threads) => workspace.on_threads(threads),
            None => workspace,
        };
        let found = detect(frame, &DetectConfig::default(), &mut workspace)?;
        let sources: Vec<Source> = found.sources.iter().map(Source::from).collect();
        let stars = StarList::measure(frame, &sources, self.rows(frame), least_snr);
        if self.arguments.extract.is_some() {
            self.write_stars(&stars)?;
        }
        Ok(CommandOutput::success(stars.lines()))
    }

    fn solved(
        &self,
        frame: Frame<'static>,
        mut workspace: Workspace,
    ) -> Result<CommandOutput, CommandError> {
        let hints = self.arguments.hints();
        let size_px = [frame.width, frame.height];
        let question = Question {
            inputs: Inputs::Frames(PageChoice::default()),
            plan: SolvingPlan {
                options: hints.options(),
                ..SolvingPlan::default()
            },
            scale: hints.scale(frame.height),
        };
        self.arguments
            .catalog
            .with_deep(false, |pool, indexed, deep| {
                let context = question.context(indexed, deep);
                if let Some(threads) = NonZeroUsize::new(pool.current_num_threads()) {
                    workspace.detect = mem::take(&mut workspace.detect).on_threads(threads);
                }
                let solve = |workspace: &mut Workspace| {
                    solve_read(&self.path, |_| Ok(frame), &context, workspace)
                };
                match solve_guarded(&self.path, &mut workspace, solve) {
                    Ok((solution, frame)) => self.answer(&solution, &frame, indexed.catalog()),
                    Err(error) => {
                        report_error(&error);
                        self.unsolved(Failure::NoSolution, Some(size_px), &one_line(&error))
                    }
                }
            })
    }

    fn answer(
        &self,
        solution: &Solution,
        frame: &Frame,
        catalog: &Catalog,
    ) -> Result<CommandOutput, CommandError> {
        let rows = self.rows(frame);
        if let Some(least_snr) = self.arguments.least_snr_beside() {
            let stars = StarList::measure(frame, &solution.sources, rows, least_snr);
            let found = solution.outcome.identification();
            self.write_stars(&match found {
                Some(found) => stars.with_directions(found, rows),
                None => stars,
            })?;
        }
        match (Plate::new(solution, rows), &solution.outcome) {
            (Some(plate), _) => self.write(&plate, solution, rows),
            (None, outcome) => {
                let failure = match outcome {
                    Outcome::NotIdentified(reason) => Failure::of(reason),
                    Outcome::Identified(_) => Failure::NoSolution,
                };
                let name = self.path.display().to_string();
                let why = FrameReport::new(&name, solution, catalog).reason;
                let size_px = [solution.width, solution.height];
                self.unsolved(failure, Some(size_px), &why.unwrap_or_default())
            }
        }
    }

    /// Writes the files of a solution, and updates the header of the frame if that is wanted.
    fn write(
        &self,
        plate: &Plate,
        solution: &Solution,
        rows: RowOrder,
    ) -> Result<CommandOutput, CommandError> {
        let warning = self.arguments.hints().warning(plate);
        let mut text = plate.line() + "\n";
        text.extend(warning.iter().flat_map(|warning| [warning, "\n"]));
        self.write_ini(&Ini {
            plate: Ok(plate),
            command_line: &command_line(),
            size_px: Some(plate.size_px),
            warning: warning.as_deref(),
        })?;
        let cards = solved_cards(
            plate,
            solution,
            rows,
            self.arguments.sip,
            warning.as_deref(),
        );
        let file = match self.head.starts_with(b"SIMPLE") {
            true => fs::read(&self.path)?,
            false => Vec::new(),
        };
        let header =
            FitsFileHeader::of_file(&file).filter(|header| header.is_of_image(plate.size_px));
        let minimal = FitsFileHeader::default();
        let whole = header.as_ref().unwrap_or(&minimal);
        let wcs = match self.arguments.wcs {
            true => whole.wcs_blocks(&cards),
            false => whole.wcs_lines(&cards),
        };
        write_whole(&self.base.with_extension("wcs"), &wcs)?;
        let mut exit = Exit::Success;
        if self.arguments.update {
            let updated =
                header.ok_or_else(|| anyhow!("only an image in the first part of a FITS file"));
            let updated = updated.map(|header| header.updated(&file, &cards));
            if let Err(error) = updated.and_then(|updated| write_whole(&self.path, &updated)) {
                let error = error.context(format!("updating {}", self.path.display()));
                report_error(error.as_ref());
                exit = Exit::Other(Failure::NotUpdated.status());
            }
        }
        self.finished(text, exit)
    }

    /// Tells that there is no solution, and why.
    fn unsolved(
        &self,
        failure: Failure,
        size_px: Option<[usize; 2]>,
        why: &str,
    ) -> Result<CommandOutput, CommandError> {
        self.write_ini(&Ini {
            plate: Err(failure),
            command_line: &command_line(),
            size_px,
            warning: Some(why).filter(|why| !why.is_empty()),
        })?;
        let mut text = "No solution found!  :(\n".to_owned();
        text.extend([why, if why.is_empty() { "" } else { "\n" }]);
        self.finished(text, Exit::Other(failure.status()))
    }

    fn finished(&self, text: String, exit: Exit) -> Result<CommandOutput, CommandError> {
        if self.arguments.log {
            write_whole(&self.base.with_extension("log"), text.as_bytes())?;
        }
        Ok(CommandOutput { text, exit })
    }

    fn write_ini(&self, ini: &Ini) -> anyhow::Result<()> {
        write_whole(&self.base.with_extension("ini"), ini.text().as_bytes())
    }

    /// Beside the frame, as ASTAP does.
    fn write_stars(&self, stars: &StarList) -> anyhow::Result<()> {
        write_whole(&self.path.with_extension("csv"), stars.csv().as_bytes())
    }

    fn rows(&self, frame: &Frame) -> RowOrder {
        row_order(&self.head, frame.metadata.row_order)
    }
}

/// How a file begins; nothing of one that cannot be read.
fn first_bytes(path: &Path) -> Vec<u8> {
    let mut head = Vec::new();
    if let Ok(file) = File::open(path) {
        // What is missing is no beginning of any format.
        let _ = file.take(16).read_to_end(&mut head);
    }
    head
}

/// The words with which the program was called.
fn command_line() -> String {
    let words = env::args_os().map(|word| word.to_string_lossy().into_owned());
    words.collect::<Vec<_>>().join(" ")
}
