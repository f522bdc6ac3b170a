//! The hard suite: a run for each case, and a row for each run.

use super::frames::FailedFrames;
use super::run;
use super::shared::Shared;
use crate::cli::exit::CommandError;
use crate::cli::output::rows::{csv_table, json_indented};
use starpipe::study::validation::{HARD_SUITE, HardRow, Protocol};
use std::path::Path;

/// Does the runs of all cases, one after the other, and writes a table of them.
pub(super) fn run(
    directory: &Path,
    base: &Protocol,
    shared: &Shared,
) -> Result<(Vec<HardRow>, FailedFrames), CommandError> {
    let (mut rows, mut failed) = (Vec::new(), FailedFrames::default());
    for case in &HARD_SUITE {
        let protocol = case.protocol(base);
        let check = protocol.setup.check();
        check.map_err(|error| CommandError::Usage(format!("{}: {error}", case.name)))?;
        let done = run::run(&directory.join(case.name), &protocol, shared)?;
        rows.push(HardRow::new(case, &done.summary));
        failed.add(case.name, done.frames);
    }
    let tables = [
        ("suite.json", json_indented(&rows)?),
        ("suite.csv", csv_table(rows.iter())?),
        ("suite.txt", HardRow::to_text(&rows)),
    ];
    let tables = tables.map(|(name, text)| (name.to_owned(), text.into_bytes()));
    shared.write_into(directory, tables.map(Ok));
    Ok((rows, failed))
}
