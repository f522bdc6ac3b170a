//! `validate`: simulated frames through the pipeline, run by run; studies over a parameter.

mod args;
mod figures;
mod parquet;
mod run;
mod shared;
mod study;
mod sweep;

pub(crate) use args::ValidateArgs;

use super::exit::{CommandError, Exit};
use super::options::catalog::{index_catalog, read_catalog, thread_pool, warn_of_cache};
use super::options::format::PageFormat;
use super::output::rows::json_lines;
use super::output::stdout::print;
use super::progress::bar;
use shared::Shared;
use starpipe::study::validation::{Protocol, StudyRow};

/// `starpipe validate`
pub(crate) fn validate(arguments: &ValidateArgs) -> Result<Exit, CommandError> {
    let protocol = Protocol {
        setup: arguments.setup.setup()?,
        scale_known: !arguments.scale_unknown,
        seed: arguments.seed,
    };
    let study_runs = study::runs(&arguments.sweep, &protocol)?;
    let pool = thread_pool(arguments.resources.threads)?;
    let catalog = pool.install(|| read_catalog(arguments.resources.catalog.as_deref()))?;
    let indexed = pool.install(|| index_catalog(&catalog, &arguments.resources));
    let runs = study_runs.len().max(1) as u64;
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
    let text = if study_runs.is_empty() {
        let summary = run::run(&arguments.out, &protocol, &shared)?;
        match arguments.format {
            PageFormat::Text => summary.to_text(),
            PageFormat::Json => json_lines(std::iter::once(&summary))?,
        }
    } else {
        let rows = study::run(&arguments.out, &study_runs, &shared)?;
        match arguments.format {
            PageFormat::Text => StudyRow::to_text(&rows),
            PageFormat::Json => json_lines(rows.iter())?,
        }
    };
    shared.progress.finish_and_clear();
    warn_of_cache(&indexed);
    // Nobody left to read it: nothing is lost.
    let _ = print(&text)?;
    Ok(Exit::Success)
}
