//! VOTables.
//!
//! # Reference
//! VOTable Format Definition 1.4, IVOA recommendation 2019.

use crate::base::format::xml_escaped;
use crate::base::table::{Column, FieldValue, widths};
use std::fmt::Write as _;

/// The mark of tables written by starpipe.
pub(super) const MARK: &str = "<INFO name=\"creator\" value=\"starpipe\"/>";

/// Comes before the size of a text.
pub const SIZE: &str = "arraysize=\"";

/// A table with its rows.
pub(super) fn document<R>(table: &str, columns: &[Column<R>], rows: &[R]) -> String {
    let mut data = String::from("<DATA>\n<TABLEDATA>\n");
    for row in rows {
        data.push_str("<TR>");
        for column in columns {
            let text = xml_escaped(&(column.value)(row).to_csv());
            let _ = write!(data, "<TD>{text}</TD>");
        }
        data.push_str("</TR>\n");
    }
    data.push_str("</TABLEDATA>\n</DATA>\n");
    with_data(table, columns, &widths(columns, rows), &data)
}

/// The table with its columns, and `data` after them; `widths` are the characters of the longest text in each
/// column. The size is fixed, since astropy cannot stack columns of texts of any size.
pub fn with_data<R>(table: &str, columns: &[Column<R>], widths: &[usize], data: &str) -> String {
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <VOTABLE version=\"1.4\" xmlns=\"http://www.ivoa.net/xml/VOTable/v1.3\">\n\
         <RESOURCE type=\"results\">\n{MARK}\n<TABLE name=\"{table}\">\n"
    );
    for (column, width) in columns.iter().zip(widths) {
        let name = column.name;
        let kind = match column.empty {
            FieldValue::Integer(_) => "datatype=\"long\"".to_owned(),
            FieldValue::Number(_) => "datatype=\"double\"".to_owned(),
            FieldValue::Bool(_) => "datatype=\"boolean\"".to_owned(),
            FieldValue::Text(_) => {
                format!("datatype=\"unicodeChar\" {SIZE}{}\"", width.max(&1))
            }
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
    text + data + "</TABLE>\n</RESOURCE>\n</VOTABLE>\n"
}
