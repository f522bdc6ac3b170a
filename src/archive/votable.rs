//! The columns of a table as a VOTable without data: the metadata of `parquet.votable`.
//!
//! # Reference
//! "Parquet in the VO", IVOA note 2025; VOTable 1.4.

use crate::base::table::{Column, FieldValue};
use std::fmt::Write as _;

/// Keys of the metadata of a Parquet file.
pub const VERSION_KEY: &str = "IVOA.VOTable-Parquet.version";
pub const CONTENT_KEY: &str = "IVOA.VOTable-Parquet.content";
pub const VERSION: &str = "1.0";

/// The VOTable of `columns`.
pub fn votable<R>(table: &str, columns: &[Column<R>]) -> String {
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <VOTABLE version=\"1.4\" xmlns=\"http://www.ivoa.net/xml/VOTable/v1.3\">\n\
         <RESOURCE type=\"results\">\n<TABLE name=\"{table}\">\n"
    );
    for column in columns {
        let name = column.name;
        let kind = match column.empty {
            FieldValue::Integer(_) => "datatype=\"long\"",
            FieldValue::Number(_) => "datatype=\"double\"",
            FieldValue::Bool(_) => "datatype=\"boolean\"",
            FieldValue::Text(_) => "datatype=\"char\" arraysize=\"*\"",
        };
        let _ = write!(text, "<FIELD ID=\"{name}\" name=\"{name}\" {kind}");
        for (key, value) in [("unit", column.meaning.unit), ("ucd", column.meaning.ucd)] {
            if !value.is_empty() {
                let _ = write!(text, " {key}=\"{value}\"");
            }
        }
        let description = column.meaning.description;
        let _ = writeln!(text, "><DESCRIPTION>{description}</DESCRIPTION></FIELD>");
    }
    text + "<PARQUET type=\"Parquet-local-XML\"/>\n</TABLE>\n</RESOURCE>\n</VOTABLE>\n"
}
