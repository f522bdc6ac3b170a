//! Solving many inputs at once.

use super::output::{OutputSettings, Printer, ResultFiles, Solved};
use crate::cli::batch;
use crate::cli::exit::{CommandError, Exit};
use crate::cli::options::catalog::{
    CatalogOptions, index_catalog, read_catalog, thread_pool, warn_of_cache,
};
use crate::cli::output::messages::{one_line, report_error};
use crate::cli::progress::bar;
use indicatif::ProgressBar;
use starpipe::calibration::Calibration;
use starpipe::detect::DetectConfig;
use starpipe::identify::{IndexedCatalog, Priors};
use starpipe::photometry::comparison::StatedCamera;
use starpipe::pipeline::{Context, Workspace};
use starpipe::report::FrameReport;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// What inputs are solved with, beside the catalogue.
#[derive(Default)]
pub(crate) struct Plan {
    pub(crate) detect: DetectConfig,
    pub(crate) priors: Priors,
    pub(crate) camera: Option<StatedCamera>,
    pub(crate) calibration: Option<Calibration>,
}

impl Plan {
    fn context<'a>(&'a self, indexed: &'a IndexedCatalog<'a>) -> Context<'a> {
        Context {
            detect: self.detect.clone(),
            priors: self.priors,
            camera: self.camera.clone(),
            calibration: self.calibration.as_ref(),
            ..Context::new(indexed)
        }
    }
}

/// Solves every input, prints its report, and writes its files; one that cannot be read does not disturb the others.
pub(crate) fn solve_all(
    inputs: &[PathBuf],
    settings: OutputSettings,
    resources: &CatalogOptions,
    plan: &Plan,
    solve: impl Fn(&Context, &Path, &mut Workspace) -> anyhow::Result<Solved> + Sync,
) -> Result<Exit, CommandError> {
    let mut run = Run::new(&settings, inputs);
    let files = ResultFiles::new(settings)?;
    if inputs.is_empty() {
        return Ok(run.exit());
    }
    let pool = thread_pool(resources.threads)?;
    let catalog = pool.install(|| read_catalog(resources.catalog.as_deref()))?;
    let indexed = pool.install(|| index_catalog(&catalog, resources));
    let context = plan.context(&indexed);
    // The threads that solve also draw and write: the one that prints waits for nothing else.
    let report = |input: &PathBuf, workspace: &mut Workspace| {
        let solved = solve(&context, input, workspace)?;
        let name = input.display().to_string();
        let report = FrameReport::new(&name, &solved.solution, indexed.catalog());
        let saved = files.save(input, &solved, &report, indexed.catalog());
        Ok(Answer { report, saved })
    };
    // An input that is alone has all threads for itself.
    let threads = match inputs.len() {
        1 => NonZeroUsize::new(pool.current_num_threads()),
        _ => None,
    };
    let workspace = || {
        let mut workspace = Workspace::new();
        if let Some(threads) = threads {
            workspace.detect = workspace.detect.on_threads(threads);
        }
        workspace
    };
    batch::for_each_ordered(&pool, inputs, workspace, report, |_, result| {
        run.take(result)
    });
    let exit = run.exit();
    warn_of_cache(&indexed);
    Ok(exit)
}

/// What is told of an input, and whether it is in its files as well.
struct Answer {
    report: FrameReport,
    saved: anyhow::Result<()>,
}

/// What has become of the inputs so far.
struct Run {
    printer: Printer,
    progress: ProgressBar,
    failed: bool,
    unidentified: bool,
}

impl Run {
    fn new(settings: &OutputSettings, inputs: &[PathBuf]) -> Self {
        let progress = if inputs.len() > 1 {
            bar(inputs.len() as u64, "frames {wide_bar} {pos}/{len} {eta}")
        } else {
            ProgressBar::hidden()
        };
        Self {
            printer: Printer::new(settings),
            progress,
            failed: false,
            unidentified: false,
        }
    }

    fn take(&mut self, result: anyhow::Result<Answer>) -> ControlFlow<()> {
        self.progress.inc(1);
        let answer = match result {
            Ok(answer) => answer,
            Err(error) => {
                self.report_error(&error);
                return ControlFlow::Continue(());
            }
        };
        self.unidentified |= !answer.report.is_identified();
        if let Err(error) = answer.saved {
            self.report_error(&error);
        }
        // The bar steps aside: results may go to the same terminal.
        let printed = self.progress.suspend(|| self.printer.print(&answer.report));
        printed.unwrap_or_else(|error| {
            self.report_error(&error);
            ControlFlow::Continue(())
        })
    }

    fn report_error(&mut self, error: &anyhow::Error) {
        self.failed = true;
        self.progress
            .suspend(|| report_error(one_line(error.as_ref())));
    }

    fn exit(self) -> Exit {
        self.progress.finish_and_clear();
        match (self.failed, self.unidentified) {
            (true, _) => Exit::Failure,
            (false, true) => Exit::NotIdentified,
            (false, false) => Exit::Success,
        }
    }
}
