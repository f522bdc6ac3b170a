//! Reports of many inputs: printed in their order, with result files where these are wanted.

use super::images::{Inputs, SolvedImage};
use super::options::SolvingOptions;
use super::printer::Printer;
use super::result_files::ResultFiles;
use super::solver::{InputSolver, Sink};
use crate::cli::exit::{CommandError, Exit, OutcomeTally};
use crate::cli::output::messages::report_error;
use crate::cli::output::overwrite;
use crate::cli::progress::frames_bar;
use indicatif::ProgressBar;
use starpipe::calibration::Calibration;
use starpipe::camera::data_sheet::CameraDescription;
use starpipe::catalog::Catalog;
use starpipe::frame::{ImageName, MemoryLimit};
use starpipe::identify::IndexedCatalog;
use starpipe::report::FrameReport;
use starpipe::solve::{Context, SolveOptions};
use starpipe::store::FrameRow;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// What the inputs are solved with, besides the catalog.
#[derive(Default)]
pub(crate) struct SolvingPlan {
    pub(crate) options: SolveOptions,
    pub(crate) camera: Option<CameraDescription>,
    pub(crate) calibration: Option<Calibration>,
    pub(crate) memory: MemoryLimit,
}

impl SolvingPlan {
    pub(crate) fn context<'a>(&'a self, indexed: &'a IndexedCatalog<'a>) -> Context<'a> {
        let mut context = Context::new(indexed).with_options(&self.options, self.camera.clone());
        context.calibration = self.calibration.as_ref();
        context
    }
}

/// Solves the inputs `paths`, prints their reports and writes their result files. Inputs that cannot
/// be read are reported, and the others solved.
pub(crate) fn report_all(
    inputs: &Inputs,
    paths: &[PathBuf],
    options: SolvingOptions,
    plan: &SolvingPlan,
) -> Result<Exit, CommandError> {
    let SolvingOptions {
        output, catalog, ..
    } = options;
    if let Some(directory) = &output.out {
        let extensions = output.result_extensions(inputs.have_pictures());
        overwrite::check(paths, directory, &extensions)?;
    }
    let mut run = ReportRun {
        printer: Printer::new(&output, paths.len()),
        progress: match paths.len() {
            count if count > 1 && !output.quiet => frames_bar(count as u64),
            _ => ProgressBar::hidden(),
        },
        tally: OutcomeTally::default(),
    };
    let files = ResultFiles::new(&output, plan.memory)?;
    let needs_rows = run.printer.needs_rows();
    if !paths.is_empty() {
        catalog.with_deep(!output.quiet, |pool, indexed, deep| {
            let mut context = plan.context(indexed);
            context.deep = deep;
            context.measure_known_sky = true;
            let solver = InputSolver {
                pool,
                inputs,
                context,
                memory: plan.memory,
                sink: Reports {
                    files,
                    needs_rows,
                    catalog: indexed.catalog(),
                },
            };
            solver.solve_all(paths, |images| run.take_all(images));
            Ok(())
        })?;
    }
    run.progress.finish_and_clear();
    let _ = run.printer.finish(&run.tally)?;
    Ok(run.tally.exit())
}

/// Makes reports and result files. The threads that solve also draw and write; one only prints.
struct Reports<'a> {
    files: ResultFiles<'a>,
    /// Whether rows of the table of frames are wanted.
    needs_rows: bool,
    catalog: &'a Catalog,
}

/// The report of an image, and why files of it could not be written.
struct Report {
    report: FrameReport,
    row: Option<FrameRow>,
    failures: Vec<anyhow::Error>,
}

impl Sink for Reports<'_> {
    type Made = Report;

    fn make(&self, image: &ImageName, solved: &SolvedImage) -> Report {
        let report = FrameReport::new(&image.to_string(), &solved.solution, self.catalog);
        let failures = self.files.save(image, solved, &report, self.catalog);
        let row = self
            .needs_rows
            .then(|| FrameRow::new(&report, &solved.solution));
        Report {
            report,
            row,
            failures,
        }
    }
}

/// State of the inputs so far.
struct ReportRun {
    printer: Printer,
    progress: ProgressBar,
    tally: OutcomeTally,
}

impl ReportRun {
    /// Prints the reports of an input. Breaks if nobody reads them any longer.
    fn take_all(&mut self, images: Vec<(String, anyhow::Result<Report>)>) -> ControlFlow<()> {
        self.progress.inc(1);
        images.into_iter().try_for_each(|(_, report)| match report {
            Ok(report) => self.take(report),
            Err(error) => {
                self.fail(&error);
                ControlFlow::Continue(())
            }
        })
    }

    fn take(&mut self, report: Report) -> ControlFlow<()> {
        let Report {
            report,
            row,
            failures,
        } = report;
        self.tally.count(report.is_identified());
        for error in &failures {
            self.fail(error);
        }
        // The bar is hidden meanwhile: results may go to the same terminal.
        let printed = self
            .progress
            .suspend(|| self.printer.print(&report, row.as_ref()));
        printed.unwrap_or_else(|error| {
            self.fail(&error);
            ControlFlow::Continue(())
        })
    }

    fn fail(&mut self, error: &anyhow::Error) {
        self.tally.failed += 1;
        self.progress.suspend(|| report_error(error.as_ref()));
    }
}
