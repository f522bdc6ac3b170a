//! The binary tables of a FITS file: where they are, and their columns.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sect. 4 and 7.3.

use super::file_ranges::FileRanges;
use super::fits_types::element_bytes;
use std::collections::HashMap;
use std::io::{self, ErrorKind};
use std::ops::Range;

/// Headers and data fill blocks of this many bytes.
const BLOCK: u64 = 2880;
const CARD: usize = 80;
/// More blocks of a header, or more tables, are damage.
const MAX_HEADER_BLOCKS: usize = 1000;
const MAX_TABLES: usize = 1000;

/// The cards of a header that have a value, by keyword. Of texts the quotation marks and the blanks at
/// the end are removed.
#[derive(Debug, Default)]
pub struct Cards(HashMap<String, String>);

impl Cards {
    /// The value of a keyword as text.
    pub fn text(&self, keyword: &str) -> Option<&str> {
        self.0.get(keyword).map(String::as_str)
    }

    /// The value of a keyword as a number.
    pub fn number<T: std::str::FromStr>(&self, keyword: &str) -> Option<T> {
        self.text(keyword)?.parse().ok()
    }

    /// Adds the card in 80 bytes; whether it is not the last.
    fn add(&mut self, card: &[u8]) -> bool {
        let card = String::from_utf8_lossy(card);
        let keyword = card.get(..8).unwrap_or_default().trim_end();
        if keyword == "END" {
            return false;
        }
        if let Some(value) = card.get(8..).and_then(|rest| rest.strip_prefix("= ")) {
            self.0.insert(keyword.to_owned(), value_of(value));
        }
        true
    }
}

/// The value in the rest of a card, without its comment.
fn value_of(text: &str) -> String {
    let text = text.trim_start();
    match text.strip_prefix('\'') {
        // A doubled quotation mark stands for one.
        Some(quoted) => {
            let marked = quoted.replace("''", "\u{0}");
            let value = marked.split('\'').next().unwrap_or_default();
            value.replace('\u{0}', "'").trim_end().to_owned()
        }
        None => text.split('/').next().unwrap_or_default().trim().to_owned(),
    }
}

fn invalid(what: impl Into<String>) -> io::Error {
    io::Error::new(ErrorKind::InvalidData, what.into())
}

/// A column of a table.
#[derive(Debug)]
pub struct Column {
    /// Its name, `TTYPE`.
    pub name: String,
    /// The code of its type, the letter of `TFORM`.
    pub code: u8,
    /// Where its cell is in a row, in bytes.
    pub bytes: Range<usize>,
}

/// A binary table.
#[derive(Debug)]
pub struct FitsTable {
    /// Its header.
    pub cards: Cards,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Its rows.
    pub rows: Rows,
}

/// The rows of a table: where they are in the file.
#[derive(Debug, Clone, Copy)]
pub struct Rows {
    /// Number of rows.
    pub count: u64,
    /// Bytes of a row.
    pub bytes: usize,
    /// The first byte in the file.
    start: u64,
}

impl Rows {
    /// The rows of a range, one after the other.
    pub fn read(&self, file: &FileRanges, rows: Range<u64>) -> io::Result<Vec<u8>> {
        if rows.end > self.count {
            let message = format!("row {} of a table of {} rows", rows.end, self.count);
            return Err(invalid(message));
        }
        let at = |row: u64| self.start + row * self.bytes as u64;
        file.read(at(rows.start)..at(rows.end))
    }

    /// All rows, one after the other, of a table that has few.
    pub fn read_all(&self, file: &FileRanges) -> io::Result<Vec<u8>> {
        /// A hundred times those of the largest tree of stars.
        const MOST_BYTES: u64 = 1 << 28;
        let bytes = self.count.saturating_mul(self.bytes as u64);
        if bytes > MOST_BYTES {
            let message = format!("a table of {bytes} bytes where {MOST_BYTES} are the most");
            return Err(invalid(message));
        }
        self.read(file, 0..self.count)
    }
}

impl FitsTable {
    /// Whether this is the name of its first column, by which programs call a table.
    pub fn is_called(&self, name: &str) -> bool {
        self.columns
            .first()
            .is_some_and(|column| column.name == name)
    }

    /// The column with this name; capital and small letters are the same.
    pub fn column(&self, name: &str) -> Option<&Column> {
        let mut columns = self.columns.iter();
        columns.find(|column| column.name.eq_ignore_ascii_case(name))
    }
}

/// The header of a FITS file, and its binary tables.
///
/// # Errors
/// The file cannot be read, or is no FITS file (of the kind [`ErrorKind::InvalidData`]), or ends before a table
/// does ([`ErrorKind::UnexpectedEof`]).
pub fn read_tables(file: &FileRanges) -> io::Result<(Cards, Vec<FitsTable>)> {
    let (primary, mut at) = read_header(file, 0)?;
    if primary.text("SIMPLE") != Some("T") {
        return Err(invalid("a FITS file without SIMPLE = T".to_owned()));
    }
    at = end_of_data(&primary, at)?;
    let mut tables = Vec::new();
    while at + BLOCK <= file.length() && tables.len() < MAX_TABLES {
        let (cards, start) = read_header(file, at)?;
        at = end_of_data(&cards, start)?;
        if cards.text("XTENSION") == Some("BINTABLE") {
            tables.push(table(cards, start, file.length())?);
        }
    }
    Ok((primary, tables))
}

/// The header at a byte of the file, and the byte after it.
fn read_header(file: &FileRanges, mut at: u64) -> io::Result<(Cards, u64)> {
    let mut cards = Cards::default();
    for _ in 0..MAX_HEADER_BLOCKS {
        let block = file.read(at..at + BLOCK)?;
        at += BLOCK;
        if !block.chunks_exact(CARD).all(|card| cards.add(card)) {
            return Ok((cards, at));
        }
    }
    Err(invalid("a header without END".to_owned()))
}

/// The first byte after the data that begin at `start`.
fn end_of_data(cards: &Cards, start: u64) -> io::Result<u64> {
    let number = |keyword: &str, default: u64| match cards.text(keyword) {
        Some(text) => text
            .parse::<u64>()
            .map_err(|_| invalid(format!("{keyword} = {text}"))),
        None => Ok(default),
    };
    let axes = number("NAXIS", 0)?;
    let overflow = || invalid("more data than any file holds".to_owned());
    if axes == 0 {
        return Ok(start);
    }
    let mut values = 1u64;
    for axis in 1..=axes.min(999) {
        let length = number(&format!("NAXIS{axis}"), 0)?;
        values = values.checked_mul(length).ok_or_else(overflow)?;
    }
    let bits: i64 = cards.number("BITPIX").unwrap_or(8);
    let extra = number("PCOUNT", 0)?;
    let bytes = values.checked_add(extra);
    let bytes = bytes.and_then(|values| values.checked_mul(bits.unsigned_abs() / 8));
    let end = bytes.and_then(|bytes| bytes.checked_next_multiple_of(BLOCK));
    end.and_then(|bytes| start.checked_add(bytes))
        .ok_or_else(overflow)
}

fn table(cards: Cards, start: u64, length: u64) -> io::Result<FitsTable> {
    let row_bytes: usize = cards
        .number("NAXIS1")
        .ok_or_else(|| invalid("a table without NAXIS1"))?;
    let rows: u64 = cards
        .number("NAXIS2")
        .ok_or_else(|| invalid("a table without NAXIS2"))?;
    let bytes = rows.checked_mul(row_bytes as u64);
    let end = bytes.and_then(|bytes| start.checked_add(bytes));
    if end.is_none_or(|end| end > length) {
        return Err(ErrorKind::UnexpectedEof.into());
    }
    let fields: usize = cards.number("TFIELDS").unwrap_or(0);
    let mut columns = Vec::new();
    let mut from = 0usize;
    for field in 1..=fields.min(999) {
        let form = cards.text(&format!("TFORM{field}")).unwrap_or_default();
        let (code, bytes) = cell_of(form).ok_or_else(|| invalid("a column without TFORM"))?;
        let name = cards.text(&format!("TTYPE{field}")).unwrap_or_default();
        let to = from.checked_add(bytes).filter(|to| *to <= row_bytes);
        let to = to.ok_or_else(|| invalid("columns wider than the rows"))?;
        columns.push(Column {
            name: name.to_owned(),
            code,
            bytes: from..to,
        });
        from = to;
    }
    Ok(FitsTable {
        cards,
        columns,
        rows: Rows {
            count: rows,
            bytes: row_bytes,
            start,
        },
    })
}

/// The code and the bytes of a cell with this `TFORM`, as in `1E` and `12A`.
fn cell_of(form: &str) -> Option<(u8, usize)> {
    let digits = form.bytes().take_while(u8::is_ascii_digit).count();
    let repeat: usize = match digits {
        0 => 1,
        _ => form[..digits].parse().ok()?,
    };
    let code = *form.as_bytes().get(digits)?;
    let bytes = match code {
        b'X' => repeat.div_ceil(8),
        _ => repeat.checked_mul(element_bytes(code)?)?,
    };
    Some((code, bytes))
}

impl Column {
    /// The number in the cell of a row; `None` where it is not finite, or the column has none.
    pub fn number(&self, row: &[u8]) -> Option<f64> {
        let cell = row.get(self.bytes.clone())?;
        let value = match self.code {
            b'D' => f64::from_be_bytes(cell.try_into().ok()?),
            b'E' => f64::from(f32::from_be_bytes(cell.try_into().ok()?)),
            _ => self.integer(row)? as f64,
        };
        value.is_finite().then_some(value)
    }

    /// The whole number in the cell of a row; `None` where the column has none.
    pub fn integer(&self, row: &[u8]) -> Option<i64> {
        let cell = row.get(self.bytes.clone())?;
        Some(match self.code {
            b'B' => i64::from(*cell.first()?),
            b'I' => i64::from(i16::from_be_bytes(cell.try_into().ok()?)),
            b'J' => i64::from(i32::from_be_bytes(cell.try_into().ok()?)),
            b'K' => i64::from_be_bytes(cell.try_into().ok()?),
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_without_quotation_marks_and_comments() {
        for (text, value) in [
            ("'stars   ' / kdtree: name", "stars"),
            ("                 1871011 / Number of stars.", "1871011"),
            ("'O''Brien / x'", "O'Brien / x"),
            ("T", "T"),
            ("'no end", "no end"),
        ] {
            assert_eq!(value_of(text), value);
        }
    }

    #[test]
    fn forms_give_the_width_of_a_cell() {
        assert_eq!(cell_of("12A"), Some((b'A', 12)));
        assert_eq!(cell_of("E"), Some((b'E', 4)));
        assert_eq!(cell_of("2D"), Some((b'D', 16)));
        assert_eq!(cell_of("11X"), Some((b'X', 2)));
        assert_eq!(cell_of("0A"), Some((b'A', 0)));
        for wrong in ["", "3", "7Z", "99999999999999999999E"] {
            assert_eq!(cell_of(wrong), None);
        }
    }
}
