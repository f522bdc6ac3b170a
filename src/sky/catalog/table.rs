//! Tables of stars: comma- or tab-separated files from anywhere, and VizieR's exports.
//!
//! The first line that is neither empty nor a comment (`#`) holds the headings; the separator (tab, semicolon,
//! bar or comma) is the one that occurs there. A line of units and one of dashes under the headings are heeded and
//! skipped, as are headings that come once more. With SKY2000's labels the columns are SKY2000's, else
//! [`Columns`] finds out what they are.

use super::CatalogError;
use super::columns::{Columns, EXPECTED_DEC, Heading, unquoted};
use super::error::{FaultPlace, RecordFault, quoted};
use super::import::{Format, Record, Tally};
use super::record::{self, COLUMN_COUNT, COLUMNS, Cell, Cells, REQUIRED};
use super::rows::{Row, Rows};
use super::source::unknown_kind;
use super::{Star, StarId};
use crate::base::units::RAD_PER_DEG;
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::BufRead;
use std::path::Path;

const SEPARATORS: [u8; 4] = *b"\t;|,";
/// Where a cell that begins with a quote goes on to the next one. In the others a quote is an inch sign.
const QUOTING: [u8; 2] = *b",;";
/// What a line of units holds.
const UNITS: [&str; 19] = [
    "deg",
    "degrees",
    "h",
    "hours",
    "rad",
    "min",
    "s",
    "arcmin",
    "arcsec",
    "h:m:s",
    "d:m:s",
    "mag",
    "mas/yr",
    "mas/a",
    "s/a",
    "s/yr",
    "arcsec/a",
    "arcsec/yr",
    "yr",
];
/// The columns that give SKY2000's positions.
const SKY2000_POSITION: [Cell; 7] = [
    Cell::RaH,
    Cell::RaM,
    Cell::RaS,
    Cell::DecSign,
    Cell::DecD,
    Cell::DecM,
    Cell::DecS,
];
/// So many stars, over such a range of declinations, cannot all have a right ascension below 24 degrees by chance.
const HOURS_STARS: usize = 50;
const HOURS_DEC_RANGE_DEG: f64 = 60.0;

/// A table of which the headings are read.
pub(super) struct Table {
    separator: u8,
    /// How many cells a row has.
    width: usize,
    /// The lines of headings and of units, which may come again where tables were joined.
    headings: Vec<Vec<u8>>,
    roles: Roles,
}

/// What the columns are.
enum Roles {
    Sky2000(Box<Sky2000Columns>),
    Any(Box<Columns>),
}

/// SKY2000's columns in a table.
struct Sky2000Columns {
    /// Where each of [`COLUMNS`] stands.
    cell_of: [Option<usize>; COLUMN_COUNT],
    /// The identifier is a mere record number.
    recno: bool,
}

impl Table {
    /// Reads the headings.
    pub(super) fn open<R: BufRead>(rows: &mut Rows<R>, path: &Path) -> Result<Self, CatalogError> {
        let read_error = |lines_read, source| CatalogError::Read {
            path: path.to_owned(),
            lines_read,
            source,
        };
        let mut notes = HashMap::new();
        let (line, heading) = loop {
            let lines_read = rows.lines_read();
            match rows.next().map_err(|error| read_error(lines_read, error))? {
                None => return Err(unknown_kind(path, b"")),
                Some(row) if row.is_void() => notes.extend(column_note(row.bytes)),
                Some(row) => break (row.line, row.bytes.to_owned()),
            }
        };
        let text = heading.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&heading);
        let separator = SEPARATORS
            .into_iter()
            .find(|separator| text.contains(separator));
        let separator = separator.ok_or_else(|| unknown_kind(path, text))?;
        if QUOTING.contains(&separator) {
            rows.quote_between(separator);
        }
        let labels = split(text, separator);
        let lines_read = rows.lines_read();
        let below = rows.peek().map_err(|error| read_error(lines_read, error))?;
        let units = below.and_then(|row| units_in(row.bytes, separator, labels.len()));
        let mut headings = vec![text.to_owned()];
        headings.extend(
            below
                .filter(|_| units.is_some())
                .map(|row| row.bytes.to_owned()),
        );

        let missing = |missing: Vec<&'static str>| CatalogError::MissingColumns {
            path: path.to_owned(),
            line,
            missing,
            found: String::from_utf8_lossy(text).into_owned(),
        };
        let roles = match sky2000_roles(&labels) {
            Some(roles) => roles.map_err(missing)?,
            None => {
                let units = units.unwrap_or_else(|| vec![String::new(); labels.len()]);
                let headings: Vec<Heading> = labels
                    .iter()
                    .zip(&units)
                    .map(|(label, unit)| Heading::new(label, unit))
                    .collect();
                let note_of = |label: &str| notes.get(label).cloned();
                let columns = Columns::find(&headings, note_of);
                Roles::Any(Box::new(columns.map_err(|lacking| {
                    if lacking.is_empty() {
                        unknown_kind(path, text)
                    } else {
                        missing(lacking)
                    }
                })?))
            }
        };
        Ok(Self {
            separator,
            width: labels.len(),
            headings,
            roles,
        })
    }

    /// Whether the line is none of data: dashes, headings or units once more, or empty cells.
    fn is_decoration(&self, text: &[u8]) -> bool {
        let only = |allowed: &[u8]| {
            text.iter()
                .all(|byte| *byte == self.separator || allowed.contains(byte))
        };
        only(b"- ") || self.headings.iter().any(|heading| heading == text)
    }
}

impl Sky2000Columns {
    fn parse(&self, line: u64, cells: &[Cow<str>]) -> Record {
        let mut known: Cells = [&[]; COLUMN_COUNT];
        for (cell, place) in known.iter_mut().zip(self.cell_of) {
            *cell = place.map_or(&[][..], |place| cells[place].as_bytes());
        }
        let place_of =
            |cell: Cell| FaultPlace::Cell(self.cell_of[cell as usize].map_or(0, |place| place + 1));
        let mut record = record::parse_record(line, &known, place_of);
        if let Record::Star(star, _) = &mut record
            && self.recno
            && let StarId::Skymap(number) = star.id
        {
            star.id = StarId::Number(u64::from(number));
        }
        record
    }
}

impl Format for Table {
    fn catalog(&self) -> Option<&'static str> {
        matches!(self.roles, Roles::Sky2000(..)).then_some("SKY2000 Master Catalog")
    }

    fn kind(&self) -> String {
        match &self.roles {
            Roles::Sky2000(..) => "table with SKY2000's columns".to_owned(),
            Roles::Any(columns) => format!("table: {}", columns.told()),
        }
    }

    fn id_place(&self) -> (FaultPlace, String) {
        match &self.roles {
            Roles::Sky2000(columns) => {
                let place = columns.cell_of[Cell::Id as usize].map_or(0, |place| place + 1);
                (
                    FaultPlace::Cell(place),
                    COLUMNS[Cell::Id as usize].label.to_owned(),
                )
            }
            Roles::Any(columns) => columns.id_place(),
        }
    }

    fn parse(&self, row: Row) -> Record {
        if row.is_void() {
            return Record::Void;
        }
        let cells = split(row.bytes, self.separator);
        let record = if cells.len() != self.width {
            Record::Unreadable(RecordFault {
                line: row.line,
                place: FaultPlace::Cell(cells.len().min(self.width) + 1),
                label: String::new(),
                found: format!("{} columns, {}", cells.len(), quoted(row.bytes)),
                expected: "as many columns as headings",
            })
        } else {
            match &self.roles {
                Roles::Sky2000(columns) => columns.parse(row.line, &cells),
                Roles::Any(columns) => {
                    let cells: Vec<&str> = cells.iter().map(|cell| &**cell).collect();
                    columns.parse(row.line, &cells)
                }
            }
        };
        match record {
            Record::Star(..) => record,
            _ if self.is_decoration(row.bytes) => Record::Void,
            _ => record,
        }
    }

    fn judge(&self, tally: &Tally) -> Option<String> {
        let Roles::Any(columns) = &self.roles else {
            return None;
        };
        if tally.is_unfit() && look_swapped(tally) {
            return Some(
                "declinations beyond the poles, and no right ascension beyond them: the columns of right \
                 ascension and declination seem to be swapped, or their headings are"
                    .to_owned(),
            );
        }
        let in_hours = columns.has_bare_numbers() && look_like_hours(&tally.stars);
        in_hours.then(|| {
            "all right ascensions lie between 0 and 24, while the declinations cover the sky: they are \
             hours and not degrees; name the column ra_hours (if they are degrees after all, write them \
             in radians, as ra_rad, or as hh:mm:ss)"
                .to_owned()
        })
    }
}

/// Whether what is read as right ascension is declination, and the other way round.
fn look_swapped(tally: &Tally) -> bool {
    let faults = &tally.summary.unreadable;
    let beyond_pole = faults.iter().filter(|fault| fault.expected == EXPECTED_DEC);
    let most = beyond_pole.count() * 2 > faults.len();
    // A quarter of a turn east or west of the equinox: as declinations are.
    most && tally
        .stars
        .iter()
        .all(|star| star.direction.as_vector().x > -1e-9)
}

/// Whether the right ascensions, read as degrees, are hours.
fn look_like_hours(stars: &[Star]) -> bool {
    if stars.len() <= HOURS_STARS {
        return false;
    }
    let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
    for star in stars {
        let (ra_rad, dec_rad) = star.direction.to_ra_dec();
        if ra_rad > 24.0 * RAD_PER_DEG {
            return false;
        }
        (lowest, highest) = (lowest.min(dec_rad), highest.max(dec_rad));
    }
    highest - lowest > HOURS_DEC_RANGE_DEG * RAD_PER_DEG
}

/// SKY2000's columns, where `labels` are its own; `None` if they are not. Fails with the labels that are missing.
fn sky2000_roles(labels: &[Cow<str>]) -> Option<Result<Roles, Vec<&'static str>>> {
    let place = |wanted: &str| labels.iter().position(|label| unquoted(label) == wanted);
    let mut cell_of = COLUMNS.map(|column| place(column.label));
    let parts = SKY2000_POSITION.iter();
    let parts = parts
        .filter(|&&cell| cell_of[cell as usize].is_some())
        .count();
    // One or two of them may be another catalogue's; with another position beside them they do not matter.
    if parts < 3 || (parts < SKY2000_POSITION.len() && has_other_position(labels)) {
        return None;
    }
    let id = &mut cell_of[Cell::Id as usize];
    *id = id.or_else(|| place("Skymap"));
    let recno = place("recno").filter(|_| id.is_none());
    *id = id.or(recno);
    let missing: Vec<&str> = REQUIRED
        .into_iter()
        .filter(|&cell| cell_of[cell as usize].is_none())
        .map(|cell| COLUMNS[cell as usize].label)
        .collect();
    Some(if missing.is_empty() {
        let recno = recno.is_some();
        Ok(Roles::Sky2000(Box::new(Sky2000Columns { cell_of, recno })))
    } else {
        Err(missing)
    })
}

fn has_other_position(labels: &[Cow<str>]) -> bool {
    let headings: Vec<Heading> = labels.iter().map(|label| Heading::new(label, "")).collect();
    Columns::find(&headings, |_| None).is_ok()
}

/// What a comment of VizieR's says of a column: its label, and all the rest.
fn column_note(comment: &[u8]) -> Option<(String, String)> {
    let text = String::from_utf8_lossy(comment.strip_prefix(b"#Column\t")?);
    let (label, note) = text.split_once('\t')?;
    Some((label.trim().to_owned(), note.to_owned()))
}

/// The units in a line under the headings, if it is one of units.
fn units_in(text: &[u8], separator: u8, width: usize) -> Option<Vec<String>> {
    let cells: Vec<String> = split(text, separator)
        .iter()
        .map(|cell| unquoted(cell).to_lowercase())
        .collect();
    let is_unit = |cell: &String| UNITS.contains(&cell.as_str());
    let is_number =
        |cell: &String| cell.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    let units = cells.len() == width && cells.iter().any(is_unit) && !cells.iter().any(is_number);
    units.then_some(cells)
}

/// The cells of a row, quotes around them taken away where the table quotes.
fn split(text: &[u8], separator: u8) -> Vec<Cow<'_, str>> {
    if QUOTING.contains(&separator) && text.contains(&b'"') {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .delimiter(separator)
            .from_reader(text);
        let row = reader.byte_records().next().and_then(Result::ok);
        let cells = row.iter().flatten();
        return cells
            .map(|cell| Cow::Owned(String::from_utf8_lossy(cell).into_owned()))
            .collect();
    }
    text.split(|&byte| byte == separator)
        .map(String::from_utf8_lossy)
        .collect()
}
