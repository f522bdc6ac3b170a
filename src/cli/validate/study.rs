//! Studies: a run for each value of a parameter, and a row for each run.

use super::frames::FailedFrames;
use super::shared::Shared;
use super::sweep::StudySweep;
use super::{figures, run};
use crate::cli::exit::CommandError;
use crate::cli::output::rows::{csv_table, json_indented};
use starpipe::lab::validation::{StudyParameter, StudyRow, ValidationProtocol, ValidationSummary};
use starpipe::predict::Spacing;
use std::path::Path;

/// One value of one parameter.
pub(super) struct StudyRun {
    parameter: StudyParameter,
    spacing: Spacing,
    value: f64,
    protocol: ValidationProtocol,
}

/// The runs that the sweeps ask for, all of them valid.
pub(super) fn runs(
    sweeps: &[StudySweep],
    base: &ValidationProtocol,
) -> Result<Vec<StudyRun>, CommandError> {
    let mut runs: Vec<StudyRun> = Vec::new();
    for sweep in sweeps {
        let name = sweep.parameter.name();
        if runs.iter().any(|run| run.parameter.name() == name) {
            return Err(CommandError::Usage(format!(
                "--sweep is given twice for {name}"
            )));
        }
        for &value in &sweep.values {
            let mut protocol = base.clone();
            sweep.parameter.set(&mut protocol.setup, value);
            let check = protocol.setup.scenario.check();
            check.map_err(|error| CommandError::Usage(format!("{name} of {value}: {error}")))?;
            runs.push(StudyRun {
                parameter: sweep.parameter,
                spacing: sweep.spacing,
                value,
                protocol,
            });
        }
    }
    Ok(runs)
}

/// Does all runs, and writes a table and figures of them.
pub(super) fn run(
    directory: &Path,
    runs: &[StudyRun],
    shared: &Shared,
) -> Result<(Vec<StudyRow>, FailedFrames), CommandError> {
    let cases = runs.iter().map(|run| {
        let name = format!("{}={}", run.parameter.name(), run.value);
        let row = |summary: &_| StudyRow::new(run.parameter, run.value, run.spacing, summary);
        Ok((name, run.protocol.clone(), row))
    });
    let (rows, failed) = run_each(directory, cases, shared)?;
    let tables = [
        ("study.json", json_indented(&rows)?),
        ("study.csv", csv_table(rows.iter())?),
    ];
    shared.write(directory, tables, figures::of_study(&rows));
    Ok((rows, failed))
}

/// Does runs one after the other, each in the directory of its name. Returns a row for each, and the frames that
/// failed.
pub(super) fn run_each<R, F: FnOnce(&ValidationSummary) -> R>(
    directory: &Path,
    cases: impl Iterator<Item = Result<(String, ValidationProtocol, F), CommandError>>,
    shared: &Shared,
) -> Result<(Vec<R>, FailedFrames), CommandError> {
    let (mut rows, mut failed) = (Vec::new(), FailedFrames::default());
    for case in cases {
        let (name, protocol, row) = case?;
        let done = run::run(&directory.join(&name), &protocol, shared)?;
        rows.push(row(&done.summary));
        failed.add(&name, done.frames);
    }
    Ok((rows, failed))
}
