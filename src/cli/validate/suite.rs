//! The hard suite: a run for each case, and a row for each run.

use super::frames::FailedFrames;
use super::shared::Shared;
use super::study::run_each;
use crate::cli::exit::CommandError;
use crate::cli::output::rows::{csv_table, json_indented};
use starpipe::lab::validation::{HARD_SUITE, HardRow, ValidationProtocol};
use std::path::Path;

/// Does the runs of all cases, one after the other, and writes a table of them.
pub(super) fn run(
    directory: &Path,
    base: &ValidationProtocol,
    shared: &Shared,
) -> Result<(Vec<HardRow>, FailedFrames), CommandError> {
    let cases = HARD_SUITE.iter().map(|case| {
        let protocol = case.protocol(base);
        let check = protocol.setup.check();
        check.map_err(|error| CommandError::Usage(format!("{}: {error}", case.name)))?;
        let row = |summary: &_| HardRow::new(case, summary);
        Ok((case.name.to_owned(), protocol, row))
    });
    let (rows, failed) = run_each(directory, cases, shared)?;
    let tables = [
        ("suite.json", json_indented(&rows)?),
        ("suite.csv", csv_table(rows.iter())?),
        ("suite.txt", HardRow::to_text(&rows)),
    ];
    shared.write(directory, tables, Vec::new());
    Ok((rows, failed))
}
