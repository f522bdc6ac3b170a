//! Writes the bright stars of SKY2000 as CSV.

use super::columns::{FixedColumn, StarColumn};
use super::fixed_width::{FixedWidth, MARK, whole_record};
use crate::base::files;
use crate::base::interrupt::Interrupt;
use crate::catalog::CatalogError;
use crate::catalog::error::quoted;
use crate::catalog::import::{ImportRows, ImportSummary, ImportTally, OpenedFile, RowParser};
use std::io;
use std::path::Path;

/// The columns of the bright CSV, in the order of the source.
const BRIGHT_COLUMNS: [FixedColumn; 29] = [
    StarColumn::Id.fixed(),
    FixedColumn::new("HD", 36, 41),
    FixedColumn::new("SAO", 44, 49),
    FixedColumn::new("HR", 64, 67),
    StarColumn::Name.fixed(),
    StarColumn::VariableName.fixed(),
    StarColumn::RaH.fixed(),
    StarColumn::RaM.fixed(),
    StarColumn::RaS.fixed(),
    StarColumn::DecSign.fixed(),
    StarColumn::DecD.fixed(),
    StarColumn::DecM.fixed(),
    StarColumn::DecS.fixed(),
    StarColumn::BlendedPosition.fixed(),
    StarColumn::PmRa.fixed(),
    StarColumn::PmDec.fixed(),
    FixedColumn::new("Plx", 176, 183),
    StarColumn::VObserved.fixed(),
    StarColumn::VDerived.fixed(),
    FixedColumn::new("e_Vmag", 244, 248),
    StarColumn::BlendedV.fixed(),
    StarColumn::BMinusV.fixed(),
    FixedColumn::new("SpMK", 305, 334),
    StarColumn::Separation.fixed(),
    StarColumn::MagDifference.fixed(),
    StarColumn::MaximumMag.fixed(),
    StarColumn::MinimumMag.fixed(),
    StarColumn::Amplitude.fixed(),
    StarColumn::VariableType.fixed(),
];

/// Writes the stars of the SKY2000 file `source` brighter than `v_mag_limit` (Johnson V) to `out`,
/// as CSV: a heading of SKY2000's labels, then one row a star in the order of the source.
///
/// Values are those of the source without padding (also between a sign and its digits); a missing
/// value is an empty cell. Proper motions keep the source's units: `pmRA` in seconds of time a
/// year, `pmDE` in arcseconds a year. [`Catalog::read`](crate::Catalog::read) reads the file.
///
/// Returns the summary of the records, and the number of rows written.
///
/// # Errors
/// [`CatalogError`] if `source` is not a file of SKY2000 records, or more than 1 % of them are
/// unreadable, or `out` cannot be written. `out` is written atomically.
pub fn write_bright_csv(
    source: &Path,
    v_mag_limit: f64,
    out: &Path,
) -> Result<(ImportSummary, usize), CatalogError> {
    let file = OpenedFile::open(source, &Interrupt::default())?;
    if !FixedWidth::is_in(&file.head) {
        return Err(CatalogError::UnknownKind {
            path: source.to_owned(),
            found: quoted(&file.head[..file.head.len().min(MARK.len())]),
            expected: "SKY2000 records of 520 bytes, plain or gzip",
        });
    }
    let content = file.read_to_end(source)?;
    let mut tally = ImportTally::read(&mut ImportRows::new(&content[..]), &FixedWidth, source)?;
    tally.summary.stars = tally.stars.len() as u64;
    let written = bright_rows(&content, v_mag_limit)
        .and_then(|(rows, count)| files::write(out, &rows).map(|()| count));
    Ok((tally.summary, written.map_err(CatalogError::write(out))?))
}

/// The CSV, and its number of rows.
fn bright_rows(content: &[u8], v_mag_limit: f64) -> io::Result<(Vec<u8>, usize)> {
    let mut rows = csv::Writer::from_writer(Vec::new());
    let mut count = 0;
    rows.write_record(BRIGHT_COLUMNS.map(|column| column.label))?;
    let mut lines = ImportRows::new(content);
    while let Ok(Some(row)) = lines.next() {
        if let Ok((star, _)) = FixedWidth.parse(row)
            && star.is_brighter_than(v_mag_limit)
            && let Ok(record) = whole_record(row.bytes)
        {
            count += 1;
            rows.write_record(BRIGHT_COLUMNS.map(|column| unpadded(column.cut(&record))))?;
        }
    }
    let bytes = rows.into_inner();
    let bytes = bytes.map_err(|error| io::Error::other(error.to_string()))?;
    Ok((bytes, count))
}

/// A value without the blanks around it, and without those between a sign and its digits.
fn unpadded(cell: &[u8]) -> Vec<u8> {
    let value = cell.trim_ascii();
    match value {
        [sign @ (b'+' | b'-'), rest @ ..] => [&[*sign], rest.trim_ascii_start()].concat(),
        _ => value.to_vec(),
    }
}
