//! The predictions that are asked for.

use super::args::LimitArgs;
use crate::cli::exit::CommandError;
use crate::cli::output::messages::report_warning;
use starpipe::catalog::Catalog;
use starpipe::predict::{PredictionRow, Scenario};

/// The prediction for the scenario, or for each value of the sweeps.
pub(super) fn predict(
    arguments: &LimitArgs,
    scenario: &Scenario,
) -> Result<Vec<PredictionRow>, CommandError> {
    let preset = arguments.scenario.preset;
    if arguments.sweep.is_empty() {
        let row = PredictionRow::new(scenario, preset, Catalog::built_in())
            .map_err(CommandError::usage)?;
        return Ok(vec![row]);
    }
    let mut all = Vec::new();
    for sweep in arguments.sweep.iter().map(|sweep| &sweep.0) {
        let rows = PredictionRow::of_sweep(scenario, preset, sweep).map_err(CommandError::usage)?;
        // Some parameters matter in one reading only, or for one detector only.
        if PredictionRow::have_same_limits(&rows) {
            report_warning(changes_nothing(sweep.parameter.name()));
        }
        all.extend(rows);
    }
    Ok(all)
}

/// What is said of a parameter that changes nothing.
pub(super) fn changes_nothing(parameter: &str) -> String {
    format!("{parameter} changes nothing: the limits are the same at each of its values")
}
