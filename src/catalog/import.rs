//! Counts what becomes of each record of a source file, and makes the catalogue of the stars among them.

use super::error::{FaultPlace, RecordFault};
use super::record::{self, COLUMNS, Cell, Cells, Rejection};
use super::{Catalog, CatalogError, Star, StarId};
use std::collections::HashSet;
use std::fmt;
use std::path::Path;

/// The share of unreadable records above which a file is refused, in percent.
///
/// SKY2000 has none. One in a hundred lets a few damaged lines pass, but not a shifted or foreign format.
const UNREADABLE_LIMIT_PERCENT: u64 = 1;
/// So many unreadable records end the reading at once: 1 % of a catalogue three times as large as SKY2000.
const UNREADABLE_MAX: usize = 10_000;

/// How many line numbers the summary shows for each reason.
const LINES_SHOWN: usize = 5;

/// What became of the records of a source file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ImportSummary {
    /// Records in the file.
    pub records: u64,
    /// Records that became stars.
    pub stars: u64,
    /// Lines, from 1, of the records without a V magnitude, observed or derived.
    pub without_magnitude: Vec<u64>,
    /// Lines, from 1, of the records without a position.
    pub without_position: Vec<u64>,
    /// The records that cannot be read: at most 1 % of all.
    pub unreadable: Vec<RecordFault>,
}

impl fmt::Display for ImportSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} records, {} stars", self.records, self.stars)?;
        let mut lines = |what: &str, lines: &[u64]| {
            if lines.is_empty() {
                return Ok(());
            }
            let shown: Vec<String> = lines.iter().take(LINES_SHOWN).map(u64::to_string).collect();
            let more = if lines.len() > LINES_SHOWN {
                ", …"
            } else {
                ""
            };
            let count = lines.len();
            let noun = if count == 1 { "line" } else { "lines" };
            write!(f, ", {count} {what} ({noun} {}{more})", shown.join(", "))
        };
        lines("without a magnitude", &self.without_magnitude)?;
        lines("without a position", &self.without_position)?;
        let unreadable: Vec<u64> = self.unreadable.iter().map(|fault| fault.line).collect();
        lines("unreadable", &unreadable)
    }
}

/// Takes the records of one file, one by one.
pub(super) struct Importer<'a> {
    path: &'a Path,
    summary: ImportSummary,
    stars: Vec<Star>,
    names: Vec<(StarId, String)>,
    numbers: HashSet<StarId>,
}

impl<'a> Importer<'a> {
    pub(super) fn new(path: &'a Path) -> Self {
        Self {
            path,
            summary: ImportSummary::default(),
            stars: Vec::new(),
            names: Vec::new(),
            numbers: HashSet::new(),
        }
    }

    /// Takes the record on `line`; `place_of` tells where in the line a column stands. Returns its star, if it is one.
    pub(super) fn take(
        &mut self,
        line: u64,
        cells: &Cells,
        place_of: impl Fn(Cell) -> FaultPlace,
    ) -> Result<Option<&Star>, CatalogError> {
        let fault = |cell: Cell, expected| RecordFault {
            line,
            place: place_of(cell),
            label: COLUMNS[cell as usize].label,
            found: super::error::quoted(cells[cell as usize]),
            expected,
        };
        let star = match record::parse_star(cells) {
            Ok(star) if !self.numbers.insert(star.id) => {
                let expected = "a number that no record before has";
                self.refuse(fault(Cell::Id, expected))?;
                return Ok(None);
            }
            Ok(star) => star,
            Err(Rejection::Unreadable { cell, expected }) => {
                self.refuse(fault(cell, expected))?;
                return Ok(None);
            }
            Err(Rejection::NoPosition) => {
                self.summary.records += 1;
                self.summary.without_position.push(line);
                return Ok(None);
            }
            Err(Rejection::NoMagnitude) => {
                self.summary.records += 1;
                self.summary.without_magnitude.push(line);
                return Ok(None);
            }
        };
        if let Some(name) = record::parse_name(cells[Cell::Name as usize]) {
            self.names.push((star.id, name));
        }
        self.summary.records += 1;
        self.stars.push(star);
        Ok(self.stars.last())
    }

    /// Counts a record that cannot be read.
    pub(super) fn refuse(&mut self, fault: RecordFault) -> Result<(), CatalogError> {
        self.summary.records += 1;
        self.summary.unreadable.push(fault);
        if self.summary.unreadable.len() > UNREADABLE_MAX {
            return Err(self.too_many_unreadable());
        }
        Ok(())
    }

    /// The error for a failure to read on.
    pub(super) fn read_error(&self, lines_read: u64, source: std::io::Error) -> CatalogError {
        CatalogError::Read {
            path: self.path.to_owned(),
            lines_read,
            source,
        }
    }

    /// The file that is being read.
    pub(super) fn path(&self) -> &Path {
        self.path
    }

    /// The catalogue, if the file is fit to be one.
    pub(super) fn finish(mut self) -> Result<(Catalog, ImportSummary), CatalogError> {
        let unreadable = self.summary.unreadable.len() as u64;
        if unreadable * 100 > self.summary.records * UNREADABLE_LIMIT_PERCENT {
            return Err(self.too_many_unreadable());
        }
        if self.stars.is_empty() {
            return Err(CatalogError::NoStars {
                path: self.path.to_owned(),
                records: self.summary.records,
            });
        }
        self.summary.stars = self.stars.len() as u64;
        let catalog = Catalog::new(title(self.path), self.stars, self.names)?;
        Ok((catalog, self.summary))
    }

    fn too_many_unreadable(&mut self) -> CatalogError {
        CatalogError::TooManyUnreadable {
            path: self.path.to_owned(),
            records: self.summary.records,
            limit_percent: UNREADABLE_LIMIT_PERCENT,
            faults: std::mem::take(&mut self.summary.unreadable),
        }
    }
}

/// The file's name tells which version of the catalogue it is; nothing inside it does.
fn title(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    format!("SKY2000 Master Catalog ({name})")
}
