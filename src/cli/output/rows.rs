//! Tables of serializable rows.

use serde::Serialize;

/// Rows as JSON Lines.
pub(crate) fn json_lines<R: Serialize>(rows: impl Iterator<Item = R>) -> anyhow::Result<String> {
    let mut lines = String::new();
    for row in rows {
        lines += &serde_json::to_string(&row)?;
        lines.push('\n');
    }
    Ok(lines)
}

/// Rows as a CSV table with a heading.
pub(crate) fn csv_table<R: Serialize>(rows: impl Iterator<Item = R>) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    let bytes = writer
        .into_inner()
        .map_err(csv::IntoInnerError::into_error)?;
    Ok(String::from_utf8(bytes)?)
}
