//! The table of a compressed image: a row for each tile, and the heap with their data.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sect. 7.3.

use super::error::TileError;
use crate::base::fits_types::element_bytes;
use crate::frame::FrameError;
use crate::frame::fits::error::{malformed, truncated};
use crate::frame::fits::header::UnitHeader;
use crate::frame::fits::unit::FitsUnit;

/// Largest number of columns (TFIELDS).
const MAX_COLUMNS: i64 = 999;

/// One column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TileColumn {
    /// Its place in a row, in bytes.
    offset: usize,
    /// The letter of its type.
    kind: u8,
    /// In columns of descriptors the type of the data in the heap.
    element: Option<u8>,
}

/// The rows and the heap.
pub(super) struct TileTable<'a> {
    names: Vec<(String, TileColumn)>,
    rows: &'a [u8],
    row_bytes: usize,
    heap: &'a [u8],
}

impl<'a> TileTable<'a> {
    /// The table of `unit` in `bytes`, the content of a file, with at least `tiles` rows.
    pub fn new(unit: &FitsUnit, bytes: &'a [u8], tiles: usize) -> Result<Self, FrameError> {
        let header = &unit.header;
        let [row_bytes, rows] = unit.table[..] else {
            return Err(header.invalid("NAXIS", "2, the axes of a table"));
        };
        if rows < tiles {
            let expected = format!("{tiles} rows in the table, one for each tile");
            return Err(header.invalid("NAXIS2", &expected));
        }
        let names = columns(header, row_bytes)?;
        let length = row_bytes.saturating_mul(rows);
        let end = unit.data.saturating_add(length);
        let rows = bytes.get(unit.data..end).ok_or_else(|| {
            let detail = format!("the table of the tiles ends at byte {end}");
            truncated(bytes.len(), detail)
        })?;
        let expected = "the place of the heap behind the table";
        let heap = match header.optional("THEAP", expected)? {
            None => length,
            Some(place) => usize::try_from(place)
                .ok()
                .filter(|place| *place >= length)
                .ok_or_else(|| header.invalid("THEAP", expected))?,
        };
        let start = unit.data.saturating_add(heap).min(bytes.len());
        let end = unit.end().min(bytes.len()).max(start);
        Ok(Self {
            names,
            rows,
            row_bytes,
            heap: &bytes[start..end],
        })
    }

    /// The column of this name, in any case.
    pub fn column(&self, name: &str) -> Option<TileColumn> {
        let found = self
            .names
            .iter()
            .find(|(found, _)| found.eq_ignore_ascii_case(name));
        found.map(|(_, column)| *column)
    }

    /// The data in the heap of `row`, from 0; nothing if there are none.
    pub fn data(&self, column: TileColumn, row: usize) -> Result<&'a [u8], TileError> {
        let (count, offset) = if column.kind == b'Q' {
            (
                self.integer(column, b'K', row, 0),
                self.integer(column, b'K', row, 8),
            )
        } else {
            (
                self.integer(column, b'J', row, 0),
                self.integer(column, b'J', row, 4),
            )
        };
        let negative = TileError::Negative { count, offset };
        let (Ok(count), Ok(offset)) = (u64::try_from(count), u64::try_from(offset)) else {
            return Err(negative);
        };
        if count == 0 {
            return Ok(&[]);
        }
        let width = column.element.and_then(element_bytes).unwrap_or(1);
        let start = u128::from(offset);
        let end = start + u128::from(count) * width as u128;
        let heap = self.heap.len();
        if end > heap as u128 {
            return Err(TileError::OutsideHeap { start, end, heap });
        }
        Ok(&self.heap[start as usize..end as usize])
    }

    /// Size of the heap, in bytes.
    pub fn heap_bytes(&self) -> usize {
        self.heap.len()
    }

    /// The number of `row`, from 0.
    pub fn number(&self, column: TileColumn, row: usize) -> Option<f64> {
        match column.kind {
            b'E' => Some(f32::from_be_bytes(self.cell(column, row, 0)).into()),
            b'D' => Some(f64::from_be_bytes(self.cell(column, row, 0))),
            _ => self.whole_number(column, row).map(|number| number as f64),
        }
    }

    /// The whole number of `row`, from 0; `None` if the column has none.
    pub fn whole_number(&self, column: TileColumn, row: usize) -> Option<i64> {
        let is_whole = matches!(column.kind, b'B' | b'I' | b'J' | b'K');
        is_whole.then(|| self.integer(column, column.kind, row, 0))
    }

    /// The integer of type `kind` at `place` in the column.
    fn integer(&self, column: TileColumn, kind: u8, row: usize, place: usize) -> i64 {
        match kind {
            b'B' => u8::from_be_bytes(self.cell(column, row, place)).into(),
            b'I' => i16::from_be_bytes(self.cell(column, row, place)).into(),
            b'J' => i32::from_be_bytes(self.cell(column, row, place)).into(),
            _ => i64::from_be_bytes(self.cell(column, row, place)),
        }
    }

    /// Bytes at `place` in the column, whose width is known to hold them; zeros after the table.
    fn cell<const N: usize>(&self, column: TileColumn, row: usize, place: usize) -> [u8; N] {
        let start = row * self.row_bytes + column.offset + place;
        let cell = self.rows.get(start..).and_then(|rest| rest.first_chunk());
        cell.copied().unwrap_or([0; N])
    }
}

impl TileColumn {
    /// Whether its cells point to data in the heap.
    pub fn is_descriptor(self) -> bool {
        self.element.is_some()
    }

    /// Size of the elements in the heap, in bytes.
    pub fn element_bytes(self) -> Option<usize> {
        self.element.and_then(element_bytes)
    }
}

/// The columns that hold something, with their names.
fn columns(header: &UnitHeader, row_bytes: usize) -> Result<Vec<(String, TileColumn)>, FrameError> {
    let expected = "a number of columns from 0 to 999";
    let count = header.required("TFIELDS", expected)?;
    if !(0..=MAX_COLUMNS).contains(&count) {
        return Err(header.invalid("TFIELDS", expected));
    }
    let mut columns = Vec::new();
    let mut offset = 0_usize;
    for number in 1..=count {
        let keyword = format!("TFORM{number}");
        let form = header.text(&keyword).unwrap_or_default();
        let (column, bytes) = column(&form, offset)
            .ok_or_else(|| header.invalid(&keyword, "the type of a column, such as 1PB(100)"))?;
        offset = offset.saturating_add(bytes);
        let name = header.text(&format!("TTYPE{number}"));
        if let Some(name) = name.filter(|_| bytes > 0) {
            columns.push((name.into_owned(), column));
        }
    }
    if offset > row_bytes {
        let detail =
            format!("rows of {row_bytes} bytes (NAXIS1), expected {offset} for the columns");
        return Err(malformed(detail));
    }
    Ok(columns)
}

/// The column at `offset` with this TFORM, and its width in bytes.
fn column(form: &str, offset: usize) -> Option<(TileColumn, usize)> {
    let digits = form.bytes().take_while(u8::is_ascii_digit).count();
    let (repeat, kind) = form.split_at(digits);
    let repeat: usize = if digits == 0 { 1 } else { repeat.parse().ok()? };
    let mut letters = kind.bytes();
    let kind = letters.next()?;
    let bytes = match kind {
        b'X' => repeat.div_ceil(8),
        _ => repeat.checked_mul(element_bytes(kind)?)?,
    };
    let is_descriptor = matches!(kind, b'P' | b'Q');
    let element = if is_descriptor { letters.next() } else { None };
    if is_descriptor && element.and_then(element_bytes).is_none() {
        return None;
    }
    let column = TileColumn {
        offset,
        kind,
        element,
    };
    Some((column, bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_width_of_a_column_follows_from_its_type() {
        for (form, bytes) in [
            ("1PB(1234)", 8),
            ("QI", 16),
            ("D", 8),
            ("3E", 12),
            ("9X", 2),
            ("0J", 0),
            ("20A", 20),
        ] {
            assert_eq!(column(form, 0).unwrap().1, bytes, "{form}");
        }
        for form in ["", "7", "1Z", "1P", "1PX", "99999999999999999999B"] {
            assert_eq!(column(form, 0), None, "{form}");
        }
    }
}
