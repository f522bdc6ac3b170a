//! `validate`: frames simulated and processed, run by run; studies over a parameter.

mod args;
mod columns;
mod figures;
mod identity;
mod parquet;
mod run;
mod study;
mod sweep;
mod tables;

pub(crate) use args::ValidateArgs;

use super::exit::{CommandError, Exit};
use super::options::catalog::{index_catalog, read_catalog, thread_pool, warn_of_cache};
use super::options::format::PageFormat;
use super::output::messages::report_error;
use super::output::rows::json_lines;
use super::output::stdout::print;
use super::plot::FigureForm;
use super::progress::bar;
use indicatif::ProgressBar;
use starpipe::identify::IndexedCatalog;
use starpipe::study::validation::Protocol;
use std::fmt::Display;

/// What the runs of one command have in common.
struct Shared<'a> {
    indexed: &'a IndexedCatalog<'a>,
    pool: &'a rayon::ThreadPool,
    /// Frames of each run.
    frames: u64,
    figures: FigureForm,
    /// Of the frames of all runs.
    progress: ProgressBar,
}

impl Shared<'_> {
    /// Says something on standard error, above the bar where there is one.
    fn tell(&self, message: impl Display) {
        self.progress.suspend(|| report_error(message));
    }
}

/// `starpipe validate`
pub(crate) fn validate(arguments: &ValidateArgs) -> Result<Exit, CommandError> {
    let protocol = Protocol {
        setup: arguments.setup.setup()?,
        scale_known: !arguments.scale_unknown,
        seed: arguments.seed,
    };
    let studies = study::protocols(&arguments.sweep, &protocol)?;
    let pool = thread_pool(arguments.resources.threads)?;
    let catalog = pool.install(|| read_catalog(arguments.resources.catalog.as_deref()))?;
    let indexed = pool.install(|| index_catalog(&catalog, &arguments.resources));
    let runs = studies.len().max(1) as u64;
    let shared = Shared {
        indexed: &indexed,
        pool: &pool,
        frames: arguments.frames,
        figures: arguments.figures,
        progress: bar(
            arguments.frames * runs,
            "frames {wide_bar} {pos}/{len} {per_sec} {eta}",
        ),
    };
    let text = if studies.is_empty() {
        let summary = run::run(&arguments.out, &protocol, &shared)?;
        match arguments.format {
            PageFormat::Text => summary.to_text(),
            PageFormat::Json => json_lines(std::iter::once(&summary))?,
        }
    } else {
        let rows = study::run(&arguments.out, &studies, &shared)?;
        match arguments.format {
            PageFormat::Text => study::text(&rows),
            PageFormat::Json => json_lines(rows.iter())?,
        }
    };
    shared.progress.finish_and_clear();
    warn_of_cache(&indexed);
    // Nobody left to read it: nothing is lost.
    let _ = print(&text)?;
    Ok(Exit::Success)
}
