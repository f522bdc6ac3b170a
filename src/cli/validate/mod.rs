//! `validate`: simulated frames through the pipeline, run by run; studies over a parameter.

mod args;
mod figures;
mod parquet;
mod run;
mod shared;
mod study;
mod suite;
mod sweep;

use args::Suite;
pub(crate) use args::ValidateArgs;

use super::exit::{CommandError, Outcome};
use super::options::format::PageFormat;
use super::output::rows::{json_line, json_lines};
use super::progress::frames_bar_with_speed;
use shared::Shared;
use starpipe::study::validation::{HARD_SUITE, HardRow, Protocol, StudyRow};

/// `starpipe validate`
pub(crate) fn validate(arguments: &ValidateArgs) -> Result<Outcome, CommandError> {
    let protocol = Protocol {
        setup: arguments.setup.setup()?,
        scale_known: !arguments.scale_unknown,
        site: None,
        seed: arguments.seed,
    };
    let study_runs = study::runs(&arguments.sweep, &protocol)?;
    let runs = match arguments.suite {
        Some(Suite::Hard) => HARD_SUITE.len(),
        None => study_runs.len().max(1),
    } as u64;
    let text = arguments.catalog.with_index(|pool, indexed| {
        let shared = Shared {
            indexed,
            pool,
            frames: arguments.count,
            figures: arguments.figures,
            progress: frames_bar_with_speed(arguments.count * runs),
        };
        let text = if arguments.suite.is_some() {
            let rows = suite::run(&arguments.out, &protocol, &shared)?;
            match arguments.format {
                PageFormat::Text => HardRow::to_text(&rows),
                PageFormat::Json => json_lines(rows.iter())?,
            }
        } else if study_runs.is_empty() {
            let summary = run::run(&arguments.out, &protocol, &shared)?;
            match arguments.format {
                PageFormat::Text => summary.to_text(),
                PageFormat::Json => json_line(&summary)?,
            }
        } else {
            let rows = study::run(&arguments.out, &study_runs, &shared)?;
            match arguments.format {
                PageFormat::Text => StudyRow::to_text(&rows),
                PageFormat::Json => json_lines(rows.iter())?,
            }
        };
        shared.progress.finish_and_clear();
        Ok(text)
    })?;
    Ok(Outcome::success(text))
}
