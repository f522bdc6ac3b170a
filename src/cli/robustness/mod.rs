//! `robustness`: measures how often identification is right, wrong or fails, on simulated lists of
//! centroids.

mod args;
mod figure;
mod rows;
mod sweep;
mod table;

pub(crate) use args::RobustnessArgs;

use super::exit::{CommandError, Outcome};
use super::options::format::Format;
use super::output::files::write_each;
use super::output::rows::{csv_table, json_lines};
use anyhow::Context;
use figure::RateTable;

/// `starpipe robustness`
pub(crate) fn robustness(arguments: &RobustnessArgs) -> Result<Outcome, CommandError> {
    let rows = rows::run_all(arguments)?;
    let plot = arguments.plot.as_ref().map(|plot| {
        let file = match figure::sweeps(&rows) {
            Some(sheet) => plot.with(&sheet),
            None => plot.with(&RateTable(&rows)),
        };
        file.context("drawing the figure")
    });
    let all_written = write_each(plot);
    let table = rows.iter().map(|swept| &swept.row);
    let outcome = Outcome::success(match arguments.format {
        Format::Text => table::text(arguments, &rows),
        Format::Json => json_lines(table)?,
        Format::Csv => csv_table(table)?,
    });
    Ok(outcome.if_written(all_written))
}
