//! Binary tables of FITS.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sect. 7.3.

use crate::base::table::{Column, FieldValue, widths};
use crate::frame::{BLOCK_BYTES, FitsHeader, TABLE_CREATOR};

/// Stands for a missing whole number.
const NO_INTEGER: i64 = i64::MIN;

/// A file with one table. Texts are ASCII: other characters become question marks.
pub(super) fn file<R>(name: &str, columns: &[Column<R>], rows: &[R]) -> Vec<u8> {
    file_with(&FitsHeader::default(), name, columns, rows)
}

/// The same with more cards in the primary header.
pub(super) fn file_with<R>(
    cards: &FitsHeader,
    name: &str,
    columns: &[Column<R>],
    rows: &[R],
) -> Vec<u8> {
    let formats: Vec<ColumnFormat> = columns
        .iter()
        .zip(widths(columns, rows))
        .map(|(column, width)| ColumnFormat::of(&column.empty, width))
        .collect();
    let row_bytes: usize = formats.iter().map(|format| format.bytes()).sum();
    let mut bytes = primary_header(cards);
    bytes.extend(table_header(
        name,
        columns,
        &formats,
        [row_bytes, rows.len()],
    ));
    let start = bytes.len();
    for row in rows {
        for (column, format) in columns.iter().zip(&formats) {
            format.write((column.value)(row), &mut bytes);
        }
    }
    let data = (bytes.len() - start).next_multiple_of(BLOCK_BYTES);
    bytes.resize(start + data, 0);
    bytes
}

fn primary_header(cards: &FitsHeader) -> Vec<u8> {
    let mut header = FitsHeader::default();
    header.logical("SIMPLE", true, "");
    header.integer("BITPIX", 8, "");
    header.integer("NAXIS", 0, "no image");
    header.logical("EXTEND", true, "");
    header.text("CREATOR", TABLE_CREATOR, "");
    header.extend(cards);
    header.to_bytes()
}

fn table_header<R>(
    name: &str,
    columns: &[Column<R>],
    formats: &[ColumnFormat],
    [row_bytes, rows]: [usize; 2],
) -> Vec<u8> {
    let mut header = FitsHeader::default();
    header.text("XTENSION", "BINTABLE", "");
    for (keyword, value) in [
        ("BITPIX", 8),
        ("NAXIS", 2),
        ("NAXIS1", row_bytes),
        ("NAXIS2", rows),
        ("PCOUNT", 0),
        ("GCOUNT", 1),
        ("TFIELDS", columns.len()),
    ] {
        header.integer(keyword, value as i64, "");
    }
    header.text("EXTNAME", name, "");
    for (number, (column, format)) in columns.iter().zip(formats).enumerate() {
        let number = number + 1;
        let meaning = column.meaning;
        header.text(&format!("TTYPE{number}"), column.name, meaning.description);
        header.text(&format!("TFORM{number}"), &format.code(), "");
        if !meaning.unit.is_empty() {
            header.text(&format!("TUNIT{number}"), meaning.unit, "");
        }
        if matches!(format, ColumnFormat::Integer) {
            header.integer(&format!("TNULL{number}"), NO_INTEGER, "");
        }
        if !meaning.ucd.is_empty() {
            header.text(&format!("TUCD{number}"), meaning.ucd, "");
        }
    }
    header.to_bytes()
}

/// How the values of a column are stored.
enum ColumnFormat {
    Integer,
    Number,
    Bool,
    /// Of so many characters.
    Text(usize),
}

impl ColumnFormat {
    fn of(empty: &FieldValue, width: usize) -> Self {
        match empty {
            FieldValue::Integer(_) => Self::Integer,
            FieldValue::Number(_) => Self::Number,
            FieldValue::Bool(_) => Self::Bool,
            FieldValue::Text(_) => Self::Text(width.max(1)),
        }
    }

    fn code(&self) -> String {
        match self {
            Self::Integer => "K".to_owned(),
            Self::Number => "D".to_owned(),
            Self::Bool => "L".to_owned(),
            Self::Text(width) => format!("{width}A"),
        }
    }

    const fn bytes(&self) -> usize {
        match self {
            Self::Integer | Self::Number => 8,
            Self::Bool => 1,
            Self::Text(width) => *width,
        }
    }

    fn write(&self, value: FieldValue, bytes: &mut Vec<u8>) {
        match value {
            FieldValue::Integer(value) => bytes.extend(value.unwrap_or(NO_INTEGER).to_be_bytes()),
            FieldValue::Number(value) => bytes.extend(value.unwrap_or(f64::NAN).to_be_bytes()),
            FieldValue::Bool(value) => bytes.push(match value {
                Some(true) => b'T',
                Some(false) => b'F',
                None => 0,
            }),
            FieldValue::Text(value) => {
                let end = bytes.len() + self.bytes();
                let text = value.unwrap_or_default();
                let ascii = text.chars().map(|c| {
                    if matches!(c, ' '..='~') {
                        c as u8
                    } else {
                        b'?'
                    }
                });
                bytes.extend(ascii);
                bytes.resize(end, b' ');
            }
        }
    }
}
