//! Studies: a run for each value of a parameter, and a row for each run.

use super::frames::FailedFrames;
use super::shared::Shared;
use super::sweep::StudySweep;
use super::{figures, run};
use crate::cli::exit::CommandError;
use crate::cli::output::files::made;
use crate::cli::output::rows::{csv_table, json_indented};
use crate::cli::plot::figure_files;
use starpipe::model::sensitivity::Spacing;
use starpipe::study::validation::{Protocol, StudyParameter, StudyRow};
use std::path::Path;

/// One value of one parameter.
pub(super) struct StudyRun {
    parameter: StudyParameter,
    spacing: Spacing,
    value: f64,
    protocol: Protocol,
}

/// The runs that the sweeps ask for, all of them valid.
pub(super) fn runs(sweeps: &[StudySweep], base: &Protocol) -> Result<Vec<StudyRun>, CommandError> {
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

/// Does all runs, one after the other, and writes a table and figures of them.
pub(super) fn run(
    directory: &Path,
    runs: &[StudyRun],
    shared: &Shared,
) -> Result<(Vec<StudyRow>, FailedFrames), CommandError> {
    let (mut rows, mut failed) = (Vec::new(), FailedFrames::default());
    for run in runs {
        let name = format!("{}={}", run.parameter.name(), run.value);
        let case = directory.join(&name);
        let done = run::run(&case, &run.protocol, shared)?;
        rows.push(StudyRow::new(
            run.parameter,
            run.value,
            run.spacing,
            &done.summary,
        ));
        failed.add(&name, done.frames);
    }
    let tables = [
        ("study.json", json_indented(&rows)?),
        ("study.csv", csv_table(rows.iter())?),
    ];
    let tables = tables.map(|(name, text)| (name.to_owned(), text.into_bytes()));
    let figures = made(figure_files(figures::of_study(&rows), shared.figures));
    shared.write_into(directory, tables.into_iter().map(Ok).chain(figures));
    Ok((rows, failed))
}
