//! SKY2000's fixed-width records: their length, and the bytes of each column.

use super::columns::{FIXED_COLUMNS, StarColumn};
use super::record::Sky2000Record;
use crate::catalog::error::{RecordError, RecordLocation, quoted};
use crate::catalog::import::{NamedStar, Parsed, Rejection, Row, RowParser};
use std::borrow::Cow;

/// The length of a record without its line end, in bytes.
pub const RECORD_BYTES: usize = 520;

/// The first bytes of the file.
pub(super) const MARK: &[u8] = b"SKY2000 J";

/// SKY2000's fixed-width records.
pub(in crate::catalog) struct FixedWidth;

impl FixedWidth {
    /// Whether a file that begins with `head` has this format.
    pub(in crate::catalog) fn is_in(head: &[u8]) -> bool {
        head.starts_with(MARK)
    }
}

impl RowParser for FixedWidth {
    fn catalog(&self) -> Option<&'static str> {
        Some("SKY2000 Master Catalog")
    }

    fn kind(&self) -> String {
        "SKY2000 records".to_owned()
    }

    fn id_location(&self) -> (RecordLocation, String) {
        let id = StarColumn::Id;
        (location_of(id), id.label().to_owned())
    }

    fn parse(&self, row: Row) -> Parsed<NamedStar> {
        let record = whole_record(row.bytes).map_err(|(byte, found, expected)| {
            Rejection::Unreadable(RecordError {
                line: row.line,
                location: RecordLocation::Byte(byte),
                label: String::new(),
                found,
                expected,
            })
        })?;
        let record = Sky2000Record {
            line: row.line,
            cells: FIXED_COLUMNS.map(|column| column.cut(&record)),
            location_of: &location_of,
        };
        record.parse()
    }
}

fn location_of(column: StarColumn) -> RecordLocation {
    RecordLocation::Byte(column.fixed().first_byte)
}

/// The record of full length on a line; else the byte of the error, what was found, and what was
/// expected there.
pub(super) fn whole_record(line: &[u8]) -> Result<Cow<'_, [u8]>, (usize, String, &'static str)> {
    /// The number of bytes of [`MARK`] with which every record begins.
    const MARK_BYTES: usize = 7;
    /// The last column that is never blank ends here.
    const ESSENTIAL_BYTES: usize = 264;
    if line.len() > RECORD_BYTES {
        let found = quoted(&line[RECORD_BYTES..]);
        let expected = "the end of the line after 520 bytes";
        return Err((RECORD_BYTES + 1, found, expected));
    }
    if !line.starts_with(&MARK[..MARK_BYTES]) {
        let found = quoted(&line[..line.len().min(MARK_BYTES)]);
        return Err((1, found, "\"SKY2000\""));
    }
    if line.len() == RECORD_BYTES {
        return Ok(Cow::Borrowed(line));
    }
    // Tools that cut off blanks at the end of a line cut off all of them.
    if line.len() < ESSENTIAL_BYTES || line.ends_with(b" ") {
        let found = format!("the end of the line after {} bytes", line.len());
        return Err((line.len() + 1, found, "a record of 520 bytes"));
    }
    let mut record = line.to_vec();
    record.resize(RECORD_BYTES, b' ');
    Ok(Cow::Owned(record))
}
