//! SKY2000 as its makers distribute it: one star a line, in fixed columns.
//!
//! A file of 520-byte records, version 4 or 5 (V/109 or V/145 at the CDS) → stars, and what became
//! of each record. A line ends with LF or CR LF; a last byte 0x1A (end of file, of old) is let pass.
//!
//! The reading is strict, because columns abut: a record of any other length, or one that does not
//! begin with `SKY2000`, is unreadable, and more than 1 % of those mean another format.
//! A record that is whole but has no V magnitude or no position is no star, and counted apart.

use super::error::{FaultPlace, RecordFault, quoted};
use super::import::Importer;
use super::record::{COLUMN_COUNT, COLUMNS, Cell, Cells, Column};
use super::source::{Lines, Source};
use super::{CatalogError, ImportSummary, Star, write_whole};
use std::io::{self, BufRead};
use std::path::Path;

/// The length of a record without its line end, in bytes.
pub const RECORD_BYTES: usize = 520;

/// What the file, and every record (as far as its seventh byte), begins with.
const MARK: &[u8] = b"SKY2000 J";
const MARK_BYTES: usize = 7;

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
            found: quoted(&opened.head),
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

    let mut importer = Importer::new(source);
    read_records(opened.reader, &mut importer, |star, record| {
        if !star.is_brighter_than(v_mag_limit) {
            return Ok(());
        }
        row_count += 1;
        let values = BRIGHT_COLUMNS.map(|column| unpadded(column.cut(record)));
        rows.write_record(&values).map_err(write_error)
    })?;
    let (_, summary) = importer.finish()?;
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

/// Gives every record to `importer`, and those that are stars to `also`, with the bytes they come from.
pub(super) fn read_records(
    reader: impl BufRead,
    importer: &mut Importer,
    mut also: impl FnMut(&Star, &[u8]) -> Result<(), CatalogError>,
) -> Result<(), CatalogError> {
    let mut lines = Lines::new(reader);
    let place_of = |cell: Cell| FaultPlace::Byte(COLUMNS[cell as usize].first_byte);
    loop {
        let lines_read = lines.read();
        let (line, record) = match lines.next() {
            Ok(Some(numbered)) => numbered,
            Ok(None) => return Ok(()),
            Err(source) => return Err(importer.read_error(lines_read, source)),
        };
        if let Err((place, found, expected)) = check_record(record) {
            importer.refuse(RecordFault {
                line,
                place: FaultPlace::Byte(place),
                label: "",
                found,
                expected,
            })?;
            continue;
        }
        if let Some(star) = importer.take(line, &cut(record), place_of)? {
            also(star, record)?;
        }
    }
}

/// The cells of a record of full length.
fn cut(record: &[u8]) -> Cells<'_> {
    let mut cells: Cells = [&[]; COLUMN_COUNT];
    for (cell, column) in cells.iter_mut().zip(&COLUMNS) {
        *cell = column.cut(record);
    }
    cells
}

/// Whether the line can be a record; else the byte at fault, what is found, and what is expected.
fn check_record(record: &[u8]) -> Result<(), (usize, String, &'static str)> {
    if record.len() < RECORD_BYTES {
        let found = format!("the end of the line after {} bytes", record.len());
        return Err((record.len() + 1, found, "a record of 520 bytes"));
    }
    if record.len() > RECORD_BYTES {
        let found = quoted(&record[RECORD_BYTES..]);
        return Err((
            RECORD_BYTES + 1,
            found,
            "the end of the line after 520 bytes",
        ));
    }
    if record[..MARK_BYTES] != MARK[..MARK_BYTES] {
        return Err((1, quoted(&record[..MARK_BYTES]), "\"SKY2000\""));
    }
    Ok(())
}

/// A value without the blanks around it, and without those between a sign and its digits.
fn unpadded(cell: &[u8]) -> Vec<u8> {
    let value = cell.trim_ascii();
    match value {
        [sign @ (b'+' | b'-'), rest @ ..] => [&[*sign], rest.trim_ascii_start()].concat(),
        _ => value.to_vec(),
    }
}
