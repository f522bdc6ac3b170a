//! Serializable values as JSON and CSV.

use anyhow::Context;
use serde::Serialize;
use starpipe::base::format::{is_deceptive, json_escaped, printable};

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
    finished(writer)
}

/// The text that `writer` has written, which a terminal shows as it is: control characters in names are
/// escaped but for line breaks, which are quoted.
pub(crate) fn finished(writer: csv::Writer<Vec<u8>>) -> anyhow::Result<String> {
    let bytes = writer
        .into_inner()
        .map_err(csv::IntoInnerError::into_error)?;
    let text = String::from_utf8(bytes)?;
    if !text.contains(|c: char| (c.is_control() && c != '\n') || is_deceptive(c)) {
        return Ok(text);
    }
    let lines: Vec<String> = text.split('\n').map(printable).collect();
    Ok(lines.join("\n"))
}
