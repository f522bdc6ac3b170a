//! The files of a night.

use crate::cli::output::files::NewFile;
use crate::cli::output::rows::json_indented;
use starpipe::base::table::csv_of;
use starpipe::night::{self, NightRow, NightSummary, SkyglowStation, skyglow};
use starpipe::store::{RunFiles, TableWriter};
use std::path::Path;

/// The names of all files.
pub(super) const FILES: RunFiles = RunFiles {
    identity: "night-run.json",
    results: &[
        ROWS,
        "night.csv",
        "night.parquet",
        "night.dat",
        "night.json",
        "night.svg",
        LENS,
        PAGE,
        HOT_PIXELS,
    ],
};
/// The rows.
pub(super) const ROWS: &str = "night.jsonl";
/// The lens that was held.
pub(super) const LENS: &str = "lens.toml";
/// The page.
pub(super) const PAGE: &str = "night.html";
/// The hot pixels.
pub(super) const HOT_PIXELS: &str = "hot-pixels.csv";

/// The files that are made of all rows.
pub(super) fn of_rows(
    directory: &Path,
    rows: &[NightRow],
    summary: &NightSummary,
    station: &SkyglowStation,
) -> Vec<anyhow::Result<NewFile>> {
    let file = |name: &str, content: anyhow::Result<Vec<u8>>| Ok((directory.join(name), content?));
    let mut files = vec![
        file("night.csv", csv(rows).map(String::into_bytes)),
        file("night.parquet", parquet(rows)),
        file("night.dat", Ok(skyglow(rows, station).into_bytes())),
        file("night.json", json_indented(summary).map(String::into_bytes)),
    ];
    let figure = night::svg(rows, summary);
    files.extend(figure.map(|figure| file("night.svg", Ok(figure.into_bytes()))));
    files
}

/// The rows as CSV.
pub(super) fn csv(rows: &[NightRow]) -> anyhow::Result<String> {
    Ok(csv_of(rows, true)?)
}

fn parquet(rows: &[NightRow]) -> anyhow::Result<Vec<u8>> {
    let mut writer = TableWriter::new(Vec::new())?;
    for row in rows {
        writer.add(row.without_cells())?;
    }
    Ok(writer.finish()?)
}
