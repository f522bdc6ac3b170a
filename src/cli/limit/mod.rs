//! `limit`: the predicted limiting magnitude, sweeps over one parameter, and their figures.

mod args;
mod figures;
mod page;
mod rows;

pub(crate) use args::LimitArgs;

use super::exit::{CommandError, CommandOutput};
use super::options::format::OutputFormat;
use super::output::files::{write_each, write_into};
use super::output::overwrite::is_same_file;
use super::output::rows::{csv_table, json_lines};
use anyhow::Context;
use starpipe::predict::{PredictionRow, Scenario};
use std::path::{Path, PathBuf};

/// More sweeps than this are a mistake; a figure of them would be unreadable.
const MAX_SWEEPS: usize = 64;

/// `starpipe limit`
pub(crate) fn limit(arguments: &LimitArgs) -> Result<CommandOutput, CommandError> {
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
    let inputs: Vec<PathBuf> = arguments.scenario.files().cloned().collect();
    let page_path = arguments
        .html
        .checked_path(&inputs, || page_path(arguments))?;
    let rows = rows::predict(arguments, &scenario)?;
    let plot = arguments.plot.as_ref().map(|plot| {
        let sweeps = arguments.sweep.iter().map(|sweep| &sweep.0);
        let sheet = figures::of_sweeps(sweeps, &scenario)?;
        Ok::<_, CommandError>(plot.with(&sheet).context("drawing the figure"))
    });
    let plot = plot.transpose()?;
    let page = page_path.map(|path| {
        let page = page::build(&rows, arguments, &scenario)?;
        crate::cli::page::file(&path, &page)
    });
    let all_written = write_each(plot.into_iter().chain(page));
    let outcome = CommandOutput::success(match arguments.format {
        OutputFormat::Text => PredictionRow::to_text(&rows),
        OutputFormat::Json => json_lines(rows.iter())?,
        OutputFormat::Csv => csv_table(rows.iter().map(PredictionRow::table_row))?,
    });
    Ok(outcome.if_written(all_written))
}

/// Where the page is written if no file is named: beside the figure, if there is one.
fn page_path(arguments: &LimitArgs) -> PathBuf {
    let figure = arguments.plot.as_ref();
    figure.map_or("limit.html".into(), |plot| plot.path.with_extension("html"))
}

/// Refuses to overwrite an input with the figure.
fn check_plot(arguments: &LimitArgs) -> Result<(), CommandError> {
    let Some(plot) = &arguments.plot else {
        return Ok(());
    };
    let mut read = arguments.scenario.files();
    match read.find(|path| is_same_file(path, &plot.path)) {
        Some(path) => Err(CommandError::Usage(format!(
            "--plot would overwrite the input {}",
            path.display()
        ))),
        None => Ok(()),
    }
}

/// Writes the eleven figures of the paper and a sheet of all of them.
fn paper_figures(directory: &Path, scenario: &Scenario) -> Result<CommandOutput, CommandError> {
    let files = figures::of_paper(scenario)?;
    let lines = files
        .iter()
        .map(|(name, _)| format!("{}\n", directory.join(name).display()));
    let outcome = CommandOutput::success(lines.collect());
    let all_written = write_into(directory, files.into_iter().map(Ok));
    Ok(outcome.if_written(all_written))
}
