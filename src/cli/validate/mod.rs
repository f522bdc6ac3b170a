//! `validate`: simulated frames through the pipeline, run by run; studies over a parameter.

mod args;
mod figures;
mod frames;
mod page;
mod parquet;
mod run;
mod shared;
mod sky;
mod study;
mod suite;
mod sweep;

use args::Suite;
pub(crate) use args::ValidateArgs;

use super::exit::{CommandError, Outcome};
use super::options::format::PageFormat;
use super::output::files::write_each;
use super::output::rows::{json_line, json_lines};
use super::progress::frames_bar_with_speed;
use shared::Shared;
use starpipe::report::page::{Page, Thumbnail};
use starpipe::study::validation::{HARD_SUITE, HardRow, Protocol, StudyRow};
use std::cell::Cell;

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
        Some(Suite::Sky) => 1,
        None => study_runs.len().max(1),
    } as u64;
    let default = || arguments.out.join("validate.html");
    let page_path = arguments.html.checked_path(&[], default)?;
    arguments.catalog.with_index(|pool, indexed| {
        let shared = Shared {
            indexed,
            pool,
            frames: arguments.count,
            figures: arguments.figures,
            pictures: page_path
                .as_ref()
                .map(|_| Thumbnail::MOST.div_ceil(runs as usize)),
            progress: frames_bar_with_speed(arguments.count * runs),
            all_written: Cell::new(true),
        };
        let camera = &protocol.setup.scenario.camera.name;
        let (text, page): (String, Page) = if arguments.suite == Some(Suite::Sky) {
            let (summary, trials) = sky::run(&arguments.out, &protocol, &shared)?;
            let text = match arguments.format {
                PageFormat::Text => summary.to_text(),
                PageFormat::Json => json_line(&summary)?,
            };
            (
                text,
                page::of_sky(camera, &summary, &sky::sheet(&trials, &summary))?,
            )
        } else if arguments.suite.is_some() {
            let (rows, failed) = suite::run(&arguments.out, &protocol, &shared)?;
            let text = match arguments.format {
                PageFormat::Text => HardRow::to_text(&rows),
                PageFormat::Json => json_lines(rows.iter())?,
            };
            (text, page::of_suite(camera, &rows, failed)?)
        } else if study_runs.is_empty() {
            let done = run::run(&arguments.out, &protocol, &shared)?;
            let text = match arguments.format {
                PageFormat::Text => done.summary.to_text(),
                PageFormat::Json => json_line(&done.summary)?,
            };
            (text, page::of_run(done)?)
        } else {
            let (rows, failed) = study::run(&arguments.out, &study_runs, &shared)?;
            let text = match arguments.format {
                PageFormat::Text => StudyRow::to_text(&rows),
                PageFormat::Json => json_lines(rows.iter())?,
            };
            (text, page::of_study(camera, &rows, failed)?)
        };
        shared.progress.finish_and_clear();
        let page = page_path.as_ref().map(|path| {
            let page = page::with_provenance(page, arguments.seed, indexed.catalog());
            super::page::file(path, &page)
        });
        let all_written = write_each(page) && shared.all_written.get();
        Ok(Outcome::success(text).if_written(all_written))
    })
}
