//! The columns of a table as a VOTable without data: the metadata of `parquet.votable`.
//!
//! # Reference
//! "Parquet in the VO", IVOA note 2025; VOTable 1.4.

use crate::base::table::Column;
use crate::report::tables::votable::{SIZE, with_data};

/// Keys of the metadata of a Parquet file.
pub const VERSION_KEY: &str = "IVOA.VOTable-Parquet.version";
pub const CONTENT_KEY: &str = "IVOA.VOTable-Parquet.content";
pub const VERSION: &str = "1.0";

/// The VOTable of `columns`; `widths` are the characters of the longest text in each.
pub fn votable<R>(table: &str, columns: &[Column<R>], widths: &[usize]) -> String {
    with_data(
        table,
        columns,
        widths,
        "<PARQUET type=\"Parquet-local-XML\"/>\n",
    )
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
    use crate::base::table::TableRow;
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
