//! `limit`: the predicted limiting magnitude, sweeps over one parameter, and their figures.

mod args;
mod figures;

pub(crate) use args::LimitArgs;

use super::exit::{CommandError, Exit};
use super::options::format::Format;
use super::output::files::{save, write_whole};
use super::output::messages::report_warning;
use super::output::rows::{csv_table, json_lines};
use super::output::stdout::print;
use anyhow::Context;
use starpipe::model::sensitivity::{PredictionError, PredictionRow, Scenario};
use starpipe::sky::catalog::Catalog;
use std::path::Path;

/// More sweeps than this are a mistake; a figure of them would be unreadable.
const MAX_SWEEPS: usize = 64;

/// `starpipe limit`
pub(crate) fn limit(arguments: &LimitArgs) -> Result<Exit, CommandError> {
    let sweeps = arguments.sweep.len();
    if sweeps > MAX_SWEEPS {
        return Err(CommandError::Usage(format!(
            "--sweep is given {sweeps} times, expected at most {MAX_SWEEPS}"
        )));
    }
    check_plot(arguments)?;
    let scenario = arguments.scenario.scenario()?;
    if let Some(directory) = &arguments.figures {
        return paper_figures(directory, &scenario);
    }
    let rows = rows(arguments, &scenario)?;
    if let Some(plot) = &arguments.plot {
        let sweeps = arguments.sweep.iter().map(|sweep| &sweep.0);
        let sheet = figures::of_sweeps(sweeps, &scenario)?;
        let file = plot.with(&sheet).context("drawing the figure")?;
        write_whole(&[file])?;
    }
    let text = match arguments.format {
        Format::Text => PredictionRow::to_text(&rows),
        Format::Json => json_lines(rows.iter())?,
        Format::Csv => csv_table(rows.iter().map(PredictionRow::table_row))?,
    };
    // Nobody left to read it: nothing is lost.
    let _ = print(&text)?;
    Ok(Exit::Success)
}

/// Refuses to overwrite an input with the figure.
fn check_plot(arguments: &LimitArgs) -> Result<(), CommandError> {
    let Some(Ok(plot)) = arguments.plot.as_ref().map(|p| p.path.canonicalize()) else {
        return Ok(());
    };
    let mut read = arguments.scenario.files();
    match read.find(|path| path.canonicalize().is_ok_and(|path| path == plot)) {
        Some(path) => Err(CommandError::Usage(format!(
            "--plot would overwrite the input {}",
            path.display()
        ))),
        None => Ok(()),
    }
}

/// The prediction for the scenario, or for each value of the sweeps.
fn rows(arguments: &LimitArgs, scenario: &Scenario) -> Result<Vec<PredictionRow>, CommandError> {
    let preset = arguments.scenario.preset;
    let usage = |error: PredictionError| CommandError::Usage(error.to_string());
    if arguments.sweep.is_empty() {
        let row = PredictionRow::new(scenario, preset, Catalog::built_in()).map_err(usage)?;
        return Ok(vec![row]);
    }
    let mut all = Vec::new();
    for sweep in arguments.sweep.iter().map(|sweep| &sweep.0) {
        let rows = PredictionRow::of_sweep(scenario, preset, sweep).map_err(usage)?;
        // Some parameters matter in one reading only, or for one detector only.
        if PredictionRow::have_same_limits(&rows) {
            report_warning(format_args!(
                "{} changes nothing: the limits are the same at each of its values",
                sweep.parameter.name()
            ));
        }
        all.extend(rows);
    }
    Ok(all)
}

/// Writes the eleven figures of the paper and a sheet of all of them.
fn paper_figures(directory: &Path, scenario: &Scenario) -> Result<Exit, CommandError> {
    let files: Vec<_> = figures::of_paper(scenario)?
        .into_iter()
        .map(|(name, drawing)| (directory.join(name), drawing))
        .collect();
    save(directory, &files)?;
    let paths = files
        .iter()
        .map(|(path, _)| format!("{}\n", path.display()));
    let _ = print(&paths.collect::<String>())?;
    Ok(Exit::Success)
}
