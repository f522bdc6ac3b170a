//! Runs the trials of each row of the table.

use super::args::RobustnessArgs;
use crate::cli::exit::CommandError;
use crate::cli::progress::bar;
use starpipe::lab::robustness::{CaseResult, ProtocolCase, VariedParameter, run, standard_cases};

/// A row of the table.
pub(super) struct SweptRow {
    pub(super) row: CaseResult,
    /// The parameter that is swept, and its value in this row.
    pub(super) swept: Option<(VariedParameter, f64)>,
}

/// Runs all trials.
pub(super) fn run_all(arguments: &RobustnessArgs) -> Result<Vec<SweptRow>, CommandError> {
    let cases = cases(arguments);
    let (trials, seed) = (arguments.count, arguments.seed);
    arguments.catalog.with_index(|pool, indexed| {
        let progress = bar(
            trials * cases.len() as u64,
            "trials {wide_bar} {pos}/{len} {eta}",
        );
        let row = |(case, swept): (ProtocolCase, Option<(VariedParameter, f64)>)| {
            let done = || progress.inc(1);
            let tally = pool.install(|| run(indexed, &case.protocol, trials, seed, &done));
            let row = CaseResult::new(&case, &tally, arguments.least_true_stars);
            SweptRow { row, swept }
        };
        let rows = cases.into_iter().map(row).collect();
        progress.finish_and_clear();
        Ok(rows)
    })
}

/// The case of each row: those of the sweeps, else the standard ones.
fn cases(arguments: &RobustnessArgs) -> Vec<(ProtocolCase, Option<(VariedParameter, f64)>)> {
    let base = arguments.protocol.protocol();
    if arguments.sweep.is_empty() {
        let standard = standard_cases(&base).into_iter();
        return standard.map(|case| (case, None)).collect();
    }
    let mut cases = Vec::new();
    for sweep in &arguments.sweep {
        for &value in &sweep.values {
            let case = ProtocolCase {
                label: format!("{} {value}", sweep.parameter.name()),
                protocol: sweep.parameter.set(&base, value),
            };
            cases.push((case, Some((sweep.parameter, value))));
        }
    }
    cases
}
