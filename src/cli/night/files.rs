//! The files of a night.

use crate::cli::output::files::NewFile;
use crate::cli::output::rows::json_indented;
use starpipe::base::table::{finished, write_row};
use starpipe::night::{self, NightRow, NightSummary, SkyglowStation, skyglow};
use starpipe::store::TableWriter;
use std::path::Path;

/// Names of the files, beside that of the run.
pub(super) const NAMES: [&str; 9] = [
    ROWS,
    "night.csv",
    "night.parquet",
    "night.dat",
    "night.json",
    "night.svg",
    LENS,
    PAGE,
    HOT_PIXELS,
];
/// The rows.
pub(super) const ROWS: &str = "night.jsonl";
/// The lens that was held.
pub(super) const LENS: &str = "lens.toml";
/// The page.
pub(super) const PAGE: &str = "night.html";
/// The hot pixels.
pub(super) const HOT_PIXELS: &str = "hot-pixels.csv";
/// Says whose the directory is.
pub(super) const RUN: &str = "night-run.json";

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
    let columns = NightRow::columns();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(columns.iter().map(|column| column.name))?;
    for row in rows {
        write_row(&mut writer, &columns, row)?;
    }
    Ok(finished(writer)?)
}

fn parquet(rows: &[NightRow]) -> anyhow::Result<Vec<u8>> {
    let mut writer = TableWriter::new(Vec::new(), "night", NightRow::columns())?;
    for row in rows {
        writer.add(row.without_cells())?;
    }
    Ok(writer.finish()?)
}
