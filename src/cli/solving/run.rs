//! Solves many inputs on all threads.

use super::options::{OutputOptions, SolvingOptions};
use super::printer::Printer;
use super::result_files::{Image, ResultFiles, Solved};
use crate::cli::batch;
use crate::cli::exit::{CommandError, Exit};
use crate::cli::output::messages::report_error;
use crate::cli::output::overwrite;
use crate::cli::progress::frames_bar;
use indicatif::ProgressBar;
use starpipe::calibration::Calibration;
use starpipe::camera::data_sheet::DataSheet;
use starpipe::frame::MemoryLimit;
use starpipe::identify::IndexedCatalog;
use starpipe::pipeline::{Context, SolveOptions, Workspace};
use starpipe::report::FrameReport;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// What the inputs are solved with, beside the catalogue.
#[derive(Default)]
pub(crate) struct Plan {
    pub(crate) options: SolveOptions,
    pub(crate) camera: Option<DataSheet>,
    pub(crate) calibration: Option<Calibration>,
    pub(crate) memory: MemoryLimit,
}

impl Plan {
    pub(crate) fn context<'a>(&'a self, indexed: &'a IndexedCatalog<'a>) -> Context<'a> {
        let mut context = Context::new(indexed).with_options(&self.options, self.camera.clone());
        context.calibration = self.calibration.as_ref();
        context
    }
}

/// Makes the report and the result files of a solved image.
pub(crate) type Finish<'a> = &'a dyn Fn(Image, Solved) -> Answer;

/// Solves every input, prints its report and writes its result files, which have these
/// `extensions`. `solve` solves the images of an input, and finishes each. Inputs that cannot be read are
/// reported, and the others solved.
pub(crate) fn solve_all(
    inputs: &[PathBuf],
    options: SolvingOptions,
    extensions: &[&str],
    plan: &Plan,
    solve: impl Fn(&Context, &Path, &mut Workspace, Finish) -> Vec<anyhow::Result<Answer>> + Sync,
) -> Result<Exit, CommandError> {
    let SolvingOptions {
        output, catalog, ..
    } = options;
    if let Some(directory) = &output.out {
        overwrite::check(inputs, directory, extensions)?;
    }
    let mut run = Run::new(&output, inputs.len());
    let files = ResultFiles::new(output.out)?;
    if inputs.is_empty() {
        return Ok(run.exit());
    }
    catalog.with_index(|pool, indexed| {
        let context = plan.context(indexed);
        // The threads that solve also draw and write files; this one only prints.
        let finish = |image: Image, solved: Solved| {
            let name = image.name().display().to_string();
            let report = FrameReport::new(&name, &solved.solution, indexed.catalog());
            let saved = files.save(image, &solved, &report, indexed.catalog());
            Answer { report, saved }
        };
        let work =
            |input: &PathBuf, workspace: &mut Workspace| solve(&context, input, workspace, &finish);
        let workspace = || workspace(pool, inputs.len(), plan.memory);
        batch::for_each_ordered(pool, inputs, workspace, work, |_, answers| {
            run.progress.inc(1);
            answers.into_iter().try_for_each(|answer| run.take(answer))
        });
        Ok(run.exit())
    })
}

/// A workspace of one thread. A single input is solved on all threads.
pub(crate) fn workspace(pool: &rayon::ThreadPool, inputs: usize, memory: MemoryLimit) -> Workspace {
    let mut workspace = Workspace::new();
    workspace.frames.set_memory(memory);
    if let (1, Some(threads)) = (inputs, NonZeroUsize::new(pool.current_num_threads())) {
        workspace.detect = workspace.detect.on_threads(threads);
    }
    workspace
}

/// The report of an input, and whether its files could be written.
pub(crate) struct Answer {
    report: FrameReport,
    saved: anyhow::Result<()>,
}

/// State of the inputs so far.
struct Run {
    printer: Printer,
    progress: ProgressBar,
    has_failed: bool,
    has_unidentified: bool,
}

impl Run {
    fn new(options: &OutputOptions, inputs: usize) -> Self {
        Self {
            printer: Printer::new(options),
            progress: match inputs {
                0 | 1 => ProgressBar::hidden(),
                _ => frames_bar(inputs as u64),
            },
            has_failed: false,
            has_unidentified: false,
        }
    }

    /// Prints a report or an error. Breaks if nobody reads the reports any longer.
    fn take(&mut self, result: anyhow::Result<Answer>) -> ControlFlow<()> {
        let answer = match result {
            Ok(answer) => answer,
            Err(error) => {
                self.fail(&error);
                return ControlFlow::Continue(());
            }
        };
        self.has_unidentified |= !answer.report.is_identified();
        if let Err(error) = answer.saved {
            self.fail(&error);
        }
        // The bar is hidden meanwhile: results may go to the same terminal.
        let printed = self.progress.suspend(|| self.printer.print(&answer.report));
        printed.unwrap_or_else(|error| {
            self.fail(&error);
            ControlFlow::Continue(())
        })
    }

    fn fail(&mut self, error: &anyhow::Error) {
        self.has_failed = true;
        self.progress.suspend(|| report_error(error.as_ref()));
    }

    fn exit(self) -> Exit {
        self.progress.finish_and_clear();
        match (self.has_failed, self.has_unidentified) {
            (true, _) => Exit::Failure,
            (false, true) => Exit::NotIdentified,
            (false, false) => Exit::Success,
        }
    }
}
