//! Enhanced CSV.
//!
//! # Reference
//! Astropy Proposal for Enhancement 6 (version 1.0).

use crate::base::table::{Column, FieldValue, write_row};
use std::fmt::Write as _;

/// The mark of tables written by starpipe.
pub(super) const MARK: &str = "# meta: {creator: starpipe}";

/// A table with its rows.
pub(super) fn document<R>(columns: &[Column<R>], rows: &[R]) -> String {
    let mut text = String::from("# %ECSV 1.0\n# ---\n# delimiter: ','\n# datatype:\n");
    for column in columns {
        let kind = match column.empty {
            FieldValue::Integer(_) => "int64",
            FieldValue::Number(_) => "float64",
            FieldValue::Bool(_) => "bool",
            FieldValue::Text(_) => "string",
        };
        let meaning = column.meaning;
        let unit = match meaning.unit {
            "" => String::new(),
            unit => format!("unit: {unit}, "),
        };
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "# - {{name: {}, {unit}datatype: {kind}, description: '{}'}}",
            column.name,
            meaning.description.replace('\'', "''"),
        );
    }
    let _ = writeln!(text, "{MARK}");
    let mut table = csv::Writer::from_writer(Vec::new());
    let names = columns.iter().map(|column| column.name);
    let written = table.write_record(names).and_then(|()| {
        rows.iter()
            .try_for_each(|row| write_row(&mut table, columns, row))
    });
    written.expect("a table in memory can be written");
    let bytes = table
        .into_inner()
        .expect("a table in memory can be written");
    text + &String::from_utf8(bytes).expect("cells are UTF-8")
}
