//! `validate`: simulated frames through the pipeline, run by run; studies over a parameter; and the suites, each
//! with options of its own.

mod args;
mod clutter;
mod figures;
mod frames;
mod page;
mod parquet;
mod robustness;
mod run;
mod shared;
mod sky;
mod study;
mod suite;
mod sweep;

pub(crate) use args::{HardArgs, SkyArgs, ValidateArgs};
pub(crate) use clutter::{ClutterArgs, clutter};
pub(crate) use robustness::{RobustnessArgs, robustness};

use super::exit::{CommandError, CommandOutput};
use super::output::files::write_each;
use super::output::rows::{json_line, json_lines};
use super::progress::frames_bar_with_speed;
use args::RunOptions;
use shared::Shared;
use starpipe::lab::validation::HARD_SUITE;
use starpipe::report::page::{PageContent, Thumbnail};
use std::cell::Cell;

/// `starpipe validate` without a suite
pub(crate) fn validate(arguments: &ValidateArgs) -> Result<CommandOutput, CommandError> {
    let options = &arguments.run;
    let protocol = options.protocol(!arguments.scale_unknown)?;
    let runs = study::runs(&arguments.sweep, &protocol)?;
    if runs.is_empty() {
        return with_page(options, 1, |shared| {
            let done = run::run(&options.out, &protocol, shared)?;
            Ok((json_line(&done.summary)?, page::of_run(done)?))
        });
    }
    with_page(options, runs.len(), |shared| {
        let (rows, failed) = study::run(&options.out, &runs, shared)?;
        let page = page::of_study(&protocol.setup.scenario.camera.name, &rows, failed)?;
        Ok((json_lines(rows.iter())?, page))
    })
}

/// `starpipe validate --suite hard`
pub(crate) fn hard(arguments: &HardArgs) -> Result<CommandOutput, CommandError> {
    let options = &arguments.run;
    let protocol = options.protocol(!arguments.scale_unknown)?;
    with_page(options, HARD_SUITE.len(), |shared| {
        let (rows, failed) = suite::run(&options.out, &protocol, shared)?;
        let page = page::of_suite(&protocol.setup.scenario.camera.name, &rows, failed)?;
        Ok((json_lines(rows.iter())?, page))
    })
}

/// `starpipe validate --suite sky`
pub(crate) fn sky(arguments: &SkyArgs) -> Result<CommandOutput, CommandError> {
    let options = &arguments.run;
    let protocol = options.protocol(true)?;
    with_page(options, 1, |shared| {
        let (summary, trials) = sky::run(&options.out, &protocol, shared)?;
        let sheet = sky::sheet(&trials, &summary);
        let page = page::of_sky(&protocol.setup.scenario.camera.name, &summary, &sheet)?;
        Ok((json_line(&summary)?, page))
    })
}

/// Does `work`, so many runs, which returns its results as JSON and as a page. Writes the page if one is asked for.
fn with_page(
    options: &RunOptions,
    runs: usize,
    work: impl FnOnce(&Shared) -> Result<(String, PageContent), CommandError>,
) -> Result<CommandOutput, CommandError> {
    let default = || options.out.join("validate.html");
    let page_path = options.html.checked_path(&[], default)?;
    options.catalog.with_index(|pool, indexed| {
        let shared = Shared {
            indexed,
            pool,
            frames: options.count,
            figures: options.figures,
            pictures: page_path.as_ref().map(|_| Thumbnail::MAX.div_ceil(runs)),
            progress: frames_bar_with_speed(options.count * runs as u64),
            all_written: Cell::new(true),
        };
        let (json, page) = work(&shared)?;
        let text = options.format.of(|| page.text.clone(), || Ok(json))?;
        shared.progress.finish_and_clear();
        let page = page_path.as_ref().map(|path| {
            let page = page::with_provenance(page, options.seed, indexed.catalog());
            super::page::file(path, &page)
        });
        let all_written = write_each(page) && shared.all_written.get();
        Ok(CommandOutput::success(text).if_written(all_written))
    })
}
