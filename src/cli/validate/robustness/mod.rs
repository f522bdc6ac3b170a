//! The suite of robustness: how often identification is right, wrong or fails, on simulated lists of centroids.

mod args;
mod figure;
mod rows;
mod sweep;
mod table;

pub(crate) use args::RobustnessArgs;

use crate::cli::exit::{CommandError, CommandOutput};
use crate::cli::output::files::write_each;
use anyhow::Context;

/// `starpipe validate --suite robustness`
pub(crate) fn robustness(arguments: &RobustnessArgs) -> Result<CommandOutput, CommandError> {
    let rows = rows::run_all(arguments)?;
    let plot = arguments.plot.as_ref().map(|plot| {
        let sheet = figure::sweeps(&rows).unwrap_or_else(|| figure::rate_table(&rows));
        plot.with(&sheet).context("drawing the figure")
    });
    let all_written = write_each(plot);
    let table = rows.iter().map(|swept| &swept.row);
    let text = arguments
        .format
        .of_rows(|| table::text(arguments, &rows), table)?;
    Ok(CommandOutput::success(text).if_written(all_written))
}
