//! Opens a table, and parses its rows.

use super::cells::{SEPARATORS, may_quote, split, units_in};
use super::columns::GeneralColumns;
use super::headings::Heading;
use super::plausibility::{look_like_hours, look_swapped};
use super::row::GeneralRow;
use super::sky2000::Sky2000Columns;
use crate::catalog::error::{RecordError, RecordLocation, quoted};
use crate::catalog::import::{
    ImportRows, ImportTally, NamedStar, Parsed, Rejection, Row, RowParser,
};
use crate::catalog::sky2000::StarColumn;
use crate::catalog::{Band, CatalogError};
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::BufRead;
use std::path::Path;

/// A table whose headings have been read.
pub(in crate::catalog) struct CatalogTable {
    separator: u8,
    /// The number of cells of a row.
    width: usize,
    /// The lines of headings and units, which are repeated where tables were joined.
    headings: Vec<Vec<u8>>,
    columns: CatalogColumns,
    /// What the file is called, for people.
    form: &'static str,
}

/// The columns of a table.
enum CatalogColumns {
    Sky2000(Box<Sky2000Columns>),
    General(Box<GeneralColumns>),
}

impl CatalogTable {
    /// Reads the headings.
    pub(in crate::catalog) fn open<R: BufRead>(
        rows: &mut ImportRows<R>,
        path: &Path,
    ) -> Result<Self, CatalogError> {
        let mut notes = HashMap::new();
        let mut is_ecsv = false;
        let (line, heading) = loop {
            let lines_read = rows.lines_read();
            match rows.next().map_err(CatalogError::read(path, lines_read))? {
                None => return Err(CatalogError::unknown_kind(path, b"")),
                Some(row) if row.is_blank_or_comment() => {
                    is_ecsv |= row.bytes.starts_with(b"# %ECSV");
                    notes.extend(column_note(row.bytes));
                }
                Some(row) => break (row.line, row.bytes.to_owned()),
            }
        };
        let text = heading.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&heading);
        let separators = SEPARATORS.into_iter();
        let separator = { separators }.find(|separator| text.contains(separator));
        // Blanks are what ECSV has between columns unless it says otherwise.
        let blank = || Some(b' ').filter(|blank| is_ecsv && text.contains(blank));
        let separator = separator.or_else(blank);
        let separator = separator.ok_or_else(|| CatalogError::unknown_kind(path, text))?;
        if may_quote(separator) {
            rows.quote_between(separator);
        }
        let labels = split(text, separator);
        let lines_read = rows.lines_read();
        let below = rows.peek().map_err(CatalogError::read(path, lines_read))?;
        let units = below.and_then(|row| units_in(row.bytes, separator, labels.len()));
        let mut headings = vec![text.to_owned()];
        if let (Some(row), Some(_)) = (below, &units) {
            headings.push(row.bytes.to_owned());
        }
        let columns = CatalogColumns::find(&labels, units, &notes).map_err(|missing| {
            if missing.is_empty() {
                return CatalogError::unknown_kind(path, text);
            }
            CatalogError::MissingColumns {
                path: path.to_owned(),
                line,
                missing,
                found: String::from_utf8_lossy(text).into_owned(),
            }
        })?;
        Ok(Self {
            separator,
            width: labels.len(),
            headings,
            columns,
            form: "table",
        })
    }

    /// The bands of its magnitudes, if these are Gaia's.
    pub(in crate::catalog) fn gaia_band(&self) -> Option<Band> {
        match &self.columns {
            CatalogColumns::General(columns) if columns.magnitude.are_of_gaia() => {
                Some(columns.magnitude.band())
            }
            CatalogColumns::General(..) | CatalogColumns::Sky2000(..) => None,
        }
    }

    /// This table, of which the text was made from a VOTable.
    pub(in crate::catalog) fn of_votable(self) -> Self {
        Self {
            form: "VOTable",
            ..self
        }
    }

    /// Whether a line holds no data: dashes, empty cells, repeated headings or units.
    fn is_decoration(&self, text: &[u8]) -> bool {
        let is_blank = |byte: &u8| *byte == self.separator || b"- ".contains(byte);
        text.iter().all(is_blank) || self.headings.iter().any(|heading| heading == text)
    }

    fn parse_record(&self, row: Row) -> Parsed<NamedStar> {
        let cells = split(row.bytes, self.separator);
        if cells.len() != self.width {
            return Err(Box::new(Rejection::Unreadable(RecordError {
                line: row.line,
                location: RecordLocation::Column(cells.len().min(self.width) + 1),
                label: String::new(),
                found: format!("{} columns, {}", cells.len(), quoted(row.bytes)),
                expected: "as many columns as headings",
            })));
        }
        let (line, cells) = (row.line, &cells[..]);
        match &self.columns {
            CatalogColumns::Sky2000(columns) => columns.parse(line, cells),
            CatalogColumns::General(columns) => {
                let row = GeneralRow {
                    columns,
                    line,
                    cells,
                };
                row.star()
            }
        }
    }
}

impl CatalogColumns {
    /// # Errors
    /// The missing columns; none if the table does not seem to be one of stars.
    fn find(
        labels: &[Cow<str>],
        units: Option<Vec<String>>,
        notes: &HashMap<String, String>,
    ) -> Result<Self, Vec<&'static str>> {
        if let Some(columns) = Sky2000Columns::find(labels) {
            return columns.map(|columns| Self::Sky2000(Box::new(columns)));
        }
        let units = units.unwrap_or_else(|| vec![String::new(); labels.len()]);
        let headings = labels.iter().zip(&units);
        let headings: Vec<Heading> = headings
            .map(|(label, unit)| Heading::new(label, unit))
            .collect();
        let columns = GeneralColumns::find(&headings, |label| notes.get(label).cloned(), false)?;
        Ok(Self::General(Box::new(columns)))
    }
}

impl RowParser for CatalogTable {
    fn catalog(&self) -> Option<&'static str> {
        matches!(self.columns, CatalogColumns::Sky2000(..)).then_some("SKY2000 Master Catalog")
    }

    fn kind(&self) -> String {
        match &self.columns {
            CatalogColumns::Sky2000(..) => format!("{} with SKY2000's columns", self.form),
            CatalogColumns::General(columns) => format!("{}: {}", self.form, columns.description()),
        }
    }

    fn id_location(&self) -> (RecordLocation, String) {
        match &self.columns {
            CatalogColumns::Sky2000(columns) => {
                let id = StarColumn::Id;
                (columns.location_of(id), id.label().to_owned())
            }
            CatalogColumns::General(columns) => columns.id_location(),
        }
    }

    fn parse(&self, row: Row) -> Parsed<NamedStar> {
        if row.is_blank_or_comment() {
            return Err(Box::new(Rejection::NotARecord));
        }
        self.parse_record(row).map_err(|rejection| {
            if self.is_decoration(row.bytes) {
                Box::new(Rejection::NotARecord)
            } else {
                rejection
            }
        })
    }

    fn diagnose(&self, tally: &ImportTally) -> Option<String> {
        let CatalogColumns::General(columns) = &self.columns else {
            return None;
        };
        if tally.exceeds_limit() && look_swapped(tally) {
            return Some(
                "some declinations are beyond ±90°, but no right ascensions are: the columns of right \
                 ascension and declination, or their headings, seem to be swapped"
                    .to_owned(),
            );
        }
        let in_hours = columns.has_decimal_degrees() && look_like_hours(&tally.stars);
        in_hours.then(|| {
            "all right ascensions are between 0 and 24, but the declinations cover the sky: the right \
             ascensions seem to be in hours, not degrees; rename the column to ra_hours (if they really are \
             in degrees, convert them to radians, in a column ra_rad, or to hh:mm:ss)"
                .to_owned()
        })
    }
}

/// The label of a column and the note on it, in a comment of VizieR's.
fn column_note(comment: &[u8]) -> Option<(String, String)> {
    let text = String::from_utf8_lossy(comment.strip_prefix(b"#Column\t")?);
    let (label, note) = text.split_once('\t')?;
    Some((label.trim().to_owned(), note.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ecsv_may_have_blanks_between_columns() {
        let ecsv = "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: ra, unit: deg, datatype: float64}\n\
            source_id ra dec phot_g_mean_mag designation\n1 2.5 -3.5 4.5 \"Gaia DR3 1\"\n";
        let mut rows = ImportRows::new(ecsv.as_bytes());
        let table = CatalogTable::open(&mut rows, Path::new("x")).unwrap();
        let row = rows.next().unwrap().unwrap();
        assert_eq!(split(row.bytes, table.separator).len(), table.width);
        assert!(table.parse(row).is_ok());
        let other = ecsv.replace("%ECSV", "");
        let mut rows = ImportRows::new(other.as_bytes());
        assert!(CatalogTable::open(&mut rows, Path::new("x")).is_err());
    }
}
