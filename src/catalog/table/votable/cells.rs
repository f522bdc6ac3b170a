//! Rows of cells as lines of text.

use super::fields::{Count, Datatype, Field};
use super::xml::invalid;
use std::io;

/// The longest row.
pub(super) const MAX_ROW_BYTES: usize = 1 << 16;

/// A line of cells between tabs, as it grows.
#[derive(Default)]
pub(super) struct Line {
    bytes: Vec<u8>,
    cells: usize,
}

impl Line {
    /// Adds a cell of the next column, of `fields`.
    pub(super) fn push_value(&mut self, fields: &[Field], text: &str) -> io::Result<()> {
        let text = text.trim();
        let field = fields.get(self.cells);
        self.push(field.map_or(text, |field| value(field, text)))
    }

    /// Adds a cell.
    pub(super) fn push(&mut self, text: &str) -> io::Result<()> {
        if self.bytes.len() + text.len() + 2 >= MAX_ROW_BYTES {
            return Err(too_large());
        }
        if self.cells > 0 {
            self.bytes.push(b'\t');
        } else if text.starts_with('#') {
            // It would be a comment.
            self.bytes.push(b' ');
        }
        self.cells += 1;
        let bytes = text.bytes();
        self.bytes.extend(bytes.map(|byte| match byte {
            b'\t' | b'\n' | b'\r' => b' ',
            byte => byte,
        }));
        Ok(())
    }

    /// Moves the line to the end of `text`.
    pub(super) fn end(&mut self, text: &mut Vec<u8>) {
        text.append(&mut self.bytes);
        text.push(b'\n');
        self.cells = 0;
    }
}

/// The error of a row or cell that is longer than any of a catalogue.
pub(super) fn too_large() -> io::Error {
    invalid(format!(
        "found a row of more than {MAX_ROW_BYTES} bytes, more than any catalog has"
    ))
}

/// The text of a cell; empty if it has no value.
fn value<'t>(field: &Field, text: &'t str) -> &'t str {
    let is_null = match field.datatype {
        Some(datatype) if datatype.is_floating() => {
            text.eq_ignore_ascii_case("nan") || is_number(text, &field.null)
        }
        _ => is_number(text, &field.null),
    };
    match field.datatype {
        _ if is_null => "",
        Some(Datatype::Boolean) if field.count == Count::Fixed(1) => boolean(text),
        _ => text,
    }
}

/// Whether `text` is `other`, as a text or as a number.
fn is_number(text: &str, other: &str) -> bool {
    if other.is_empty() || text == other {
        return text == other;
    }
    match (text.parse::<i64>(), other.parse::<i64>()) {
        (Ok(number), Ok(other)) => number == other,
        // Of long numbers, these would be the same although they differ.
        (Ok(_), _) | (_, Ok(_)) if !text.contains('.') && !other.contains('.') => false,
        _ => {
            let numbers = (text.parse::<f64>(), other.parse::<f64>());
            matches!(numbers, (Ok(number), Ok(other)) if number == other)
        }
    }
}

/// `T`, `F`, or empty.
pub(super) fn boolean(text: &str) -> &'static str {
    match text.to_ascii_lowercase().as_str() {
        "t" | "1" | "true" => "T",
        "f" | "0" | "false" => "F",
        _ => "",
    }
}
