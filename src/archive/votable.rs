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

/// Comes before the size of a text.
const SIZE: &str = "arraysize=\"";

/// The VOTable of `columns`; `widths` are the characters of the longest text in each. The size is
/// fixed, since astropy cannot stack columns of texts of any size.
pub fn votable<R>(table: &str, columns: &[Column<R>], widths: &[usize]) -> String {
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <VOTABLE version=\"1.4\" xmlns=\"http://www.ivoa.net/xml/VOTable/v1.3\">\n\
         <RESOURCE type=\"results\">\n<TABLE name=\"{table}\">\n"
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
    text + "<PARQUET type=\"Parquet-local-XML\"/>\n</TABLE>\n</RESOURCE>\n</VOTABLE>\n"
}

/// The VOTable of two tables with the same columns in one: texts have the larger size.
pub fn widened(one: &str, other: &str) -> String {
    let mut others = other.split(SIZE).skip(1).map(size);
    let mut pieces = one.split(SIZE);
    let mut text = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let (own, other) = (size(piece), others.next().unwrap_or(0));
        let rest = piece.trim_start_matches(|digit: char| digit.is_ascii_digit());
        text += &format!("{SIZE}{}{rest}", own.max(other));
    }
    text
}

/// The number at the beginning of a text.
fn size(text: &str) -> usize {
    let end = text.find('"').unwrap_or(0);
    text[..end].parse().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::StarRow;

    #[test]
    fn two_tables_in_one_have_the_longer_texts() {
        let columns = StarRow::columns();
        let of = |width| votable("stars", &columns, &vec![width; columns.len()]);
        assert_eq!(widened(&of(3), &of(12)), of(12));
        assert_eq!(widened(&of(12), &of(3)), of(12));
        assert!(of(3).contains(
            "<FIELD ID=\"frame\" name=\"frame\" datatype=\"unicodeChar\" arraysize=\"3\""
        ));
    }
}
