//! SKY2000 as its makers distribute it: one star a line, in fixed columns.
//!
//! A file of 520-byte records, version 4 or 5 (V/109 or V/145 at the CDS) → stars, and what became
//! of each record. A line ends with LF or CR LF; a last byte 0x1A (end of file, of old) is let pass.
//!
//! The reading is strict, because columns abut: a record of any other length, or one that does not
//! begin with `SKY2000`, is unreadable, and more than 1 % of those mean another format. Only blanks
//! at a line's end may be cut off, as some tools do.
//! A record that is whole but has no V magnitude or no position is no star, and counted apart.

use super::error::{FaultPlace, RecordFault, quoted};
use super::import::{Format, Record, Tally};
use super::record::{self, COLUMN_COUNT, COLUMNS, Cell, Cells, Column};
use super::rows::{Row, Rows};
use super::source::Source;
use super::{CatalogError, ImportSummary, write_whole};
use std::borrow::Cow;
use std::io::{self, Read};
use std::path::Path;

/// The length of a record without its line end, in bytes.
pub const RECORD_BYTES: usize = 520;

/// What the file, and every record (as far as its seventh byte), begins with.
const MARK: &[u8] = b"SKY2000 J";
const MARK_BYTES: usize = 7;
/// A record without its blanks at the end goes at least as far: to the end of B−V.
const ESSENTIAL_BYTES: usize = 264;

/// The columns of the bright CSV, in the order of the source.
const BRIGHT_COLUMNS: [Column; 26] = [
    Cell::Id.column(),
    Column::new("HD", 36, 41),
    Column::new("SAO", 44, 49),
    Column::new("HR", 64, 67),
    Cell::Name.column(),
    Cell::VariableName.column(),
    Cell::RaH.column(),
    Cell::RaM.column(),
    Cell::RaS.column(),
    Cell::DecSign.column(),
    Cell::DecD.column(),
    Cell::DecM.column(),
    Cell::DecS.column(),
    Cell::BlendedPosition.column(),
    Cell::PmRa.column(),
    Cell::PmDec.column(),
    Column::new("Plx", 176, 183),
    Cell::VObserved.column(),
    Cell::VDerived.column(),
    Column::new("e_Vmag", 244, 248),
    Cell::BlendedV.column(),
    Cell::BMinusV.column(),
    Column::new("SpMK", 305, 334),
    Cell::Separation.column(),
    Column::new("Dmag", 349, 353),
    Cell::VariableType.column(),
];

/// Writes the stars of the SKY2000 file `source` that are brighter than `v_mag_limit` (Johnson V) to
/// `out`, as CSV: a heading of SKY2000's labels, then one row a star in the order of the source.
///
/// Values are as in the source, without the blanks that pad them to their columns (also between a
/// sign and its digits, so that every number is one to other programs); a value that is missing is
/// an empty cell. Proper motions keep the source's units: `pmRA` in seconds of time a year, `pmDE`
/// in arcseconds a year. [`Catalog::read`](super::Catalog::read) reads the file.
///
/// Returns what became of the records, and the number of rows.
///
/// # Errors
/// [`CatalogError`] if `source` is no file of SKY2000 records, or more than 1 % of them are
/// unreadable, or `out` cannot be written. `out` is written as a whole or not at all.
pub fn write_bright_csv(
    source: &Path,
    v_mag_limit: f64,
    out: &Path,
) -> Result<(ImportSummary, usize), CatalogError> {
    let opened = Source::open(source)?;
    if !is_fixed_width(&opened.head) {
        return Err(CatalogError::UnknownKind {
            path: source.to_owned(),
            found: quoted(&opened.head[..opened.head.len().min(MARK.len())]),
            expected: "SKY2000 records of 520 bytes, plain or gzip",
        });
    }
    let mut rows = csv::Writer::from_writer(Vec::new());
    let mut row_count = 0;
    let write_error = |error: csv::Error| CatalogError::Write {
        path: out.to_owned(),
        source: error.into(),
    };
    let labels = BRIGHT_COLUMNS.map(|column| column.label);
    rows.write_record(labels).map_err(write_error)?;

    let mut content = Vec::new();
    let mut reader = opened.reader;
    let read = reader.read_to_end(&mut content);
    read.map_err(|error| CatalogError::Read {
        path: source.to_owned(),
        lines_read: 0,
        source: error,
    })?;
    let tally = Tally::of(&mut Rows::new(&content[..]), &FixedWidth, source)?;
    let mut lines = Rows::new(&content[..]);
    while let Ok(Some(row)) = lines.next() {
        if let Record::Star(star, _) = FixedWidth.parse(row)
            && star.is_brighter_than(v_mag_limit)
            && let Ok(record) = whole_record(row.bytes)
        {
            row_count += 1;
            let values = BRIGHT_COLUMNS.map(|column| unpadded(column.cut(&record)));
            rows.write_record(&values).map_err(write_error)?;
        }
    }
    let mut summary = tally.summary;
    summary.stars = tally.stars.len() as u64;
    let bytes = rows.into_inner().map_err(|error| CatalogError::Write {
        path: out.to_owned(),
        source: io::Error::other(error.to_string()),
    })?;
    write_whole(out, &bytes)?;
    Ok((summary, row_count))
}

/// Whether content that begins with `head` is of SKY2000 records.
pub(super) fn is_fixed_width(head: &[u8]) -> bool {
    head.starts_with(MARK)
}

/// SKY2000's fixed-width records.
pub(super) struct FixedWidth;

impl Format for FixedWidth {
    fn catalog(&self) -> Option<&'static str> {
        Some("SKY2000 Master Catalog")
    }

    fn kind(&self) -> String {
        "SKY2000 records".to_owned()
    }

    fn id_place(&self) -> (FaultPlace, String) {
        (byte_of(Cell::Id), Cell::Id.column().label.to_owned())
    }

    fn parse(&self, row: Row) -> Record {
        match whole_record(row.bytes) {
            Ok(record) => record::parse_record(row.line, &cut(&record), byte_of),
            Err((byte, found, expected)) => Record::Unreadable(RecordFault {
                line: row.line,
                place: FaultPlace::Byte(byte),
                label: String::new(),
                found,
                expected,
            }),
        }
    }
}

fn byte_of(cell: Cell) -> FaultPlace {
    FaultPlace::Byte(cell.column().first_byte)
}

/// The cells of a record of full length.
fn cut(record: &[u8]) -> Cells<'_> {
    let mut cells: Cells = [&[]; COLUMN_COUNT];
    for (cell, column) in cells.iter_mut().zip(&COLUMNS) {
        *cell = column.cut(record);
    }
    cells
}

/// The record of full length on a line; else the byte at fault, what is found, and what is expected.
fn whole_record(line: &[u8]) -> Result<Cow<'_, [u8]>, (usize, String, &'static str)> {
    if line.len() > RECORD_BYTES {
        let found = quoted(&line[RECORD_BYTES..]);
        return Err((
            RECORD_BYTES + 1,
            found,
            "the end of the line after 520 bytes",
        ));
    }
    if !line.starts_with(&MARK[..MARK_BYTES]) {
        return Err((
            1,
            quoted(&line[..line.len().min(MARK_BYTES)]),
            "\"SKY2000\"",
        ));
    }
    if line.len() == RECORD_BYTES {
        return Ok(Cow::Borrowed(line));
    }
    // Some tools cut off the blanks at a line's end, and then all of them.
    if line.len() < ESSENTIAL_BYTES || line.ends_with(b" ") {
        let found = format!("the end of the line after {} bytes", line.len());
        return Err((line.len() + 1, found, "a record of 520 bytes"));
    }
    let mut record = line.to_vec();
    record.resize(RECORD_BYTES, b' ');
    Ok(Cow::Owned(record))
}

/// A value without the blanks around it, and without those between a sign and its digits.
fn unpadded(cell: &[u8]) -> Vec<u8> {
    let value = cell.trim_ascii();
    match value {
        [sign @ (b'+' | b'-'), rest @ ..] => [&[*sign], rest.trim_ascii_start()].concat(),
        _ => value.to_vec(),
    }
}
