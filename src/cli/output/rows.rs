//! Serializable values as JSON and CSV.

use anyhow::Context;
use serde::Serialize;
use starpipe::base::format::json_escaped;
use starpipe::base::table::finished;

/// One JSON object on one line.
pub(crate) fn json_line(value: &impl Serialize) -> anyhow::Result<String> {
    let text = serde_json::to_string(value).context("writing JSON")?;
    Ok(json_escaped(text) + "\n")
}

/// JSON Lines: one object for each row.
pub(crate) fn json_lines<R: Serialize>(rows: impl Iterator<Item = R>) -> anyhow::Result<String> {
    rows.map(|row| json_line(&row)).collect()
}

/// Indented JSON, for files that people read as well.
pub(crate) fn json_indented(value: &impl Serialize) -> anyhow::Result<String> {
    let text = serde_json::to_string_pretty(value).context("writing JSON")?;
    Ok(json_escaped(text) + "\n")
}

/// A CSV table with a heading, which is missing if there is no row.
pub(crate) fn csv_table<R: Serialize>(rows: impl Iterator<Item = R>) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    Ok(finished(writer)?)
}
