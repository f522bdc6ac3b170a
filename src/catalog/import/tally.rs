//! Parses the rows of one file, and collects stars and rejected records.

use super::rows::{ImportRows, MAX_RECORDS, Row};
use super::summary::ImportSummary;
use crate::catalog::error::{CatalogError, RecordError, RecordLocation};
use crate::catalog::{Star, StarId};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::io::BufRead;
use std::path::Path;

/// A file is rejected if more than this share of its records is unreadable, in percent.
///
/// SKY2000 and Tycho-2 have none. A share of 1 % allows for a few damaged lines, but not for a
/// shifted or foreign format.
const UNREADABLE_LIMIT_PERCENT: u64 = 1;

/// A star, and its name if it has one.
pub(in crate::catalog) type NamedStar = (Star, Option<String>);

/// A parsed value; rejections are boxed because they are rare.
pub(in crate::catalog) type Parsed<T> = Result<T, Box<Rejection>>;

/// Why a row gives no star.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::catalog) enum Rejection {
    /// Valid, but without right ascension and declination.
    NoPosition,
    /// Valid, but without a magnitude.
    NoMagnitude,
    /// Not valid.
    Unreadable(RecordError),
    /// Not a record: a comment, an empty line, a repeated heading.
    NotARecord,
}

/// Both values, or `None` without either; an error where only one is missing.
pub(in crate::catalog) fn both_or_neither<T>(
    first: Option<T>,
    second: Option<T>,
    without_first: impl FnOnce() -> Box<Rejection>,
    without_second: impl FnOnce() -> Box<Rejection>,
) -> Parsed<Option<(T, T)>> {
    match (first, second) {
        (Some(first), Some(second)) => Ok(Some((first, second))),
        (None, None) => Ok(None),
        (None, Some(_)) => Err(without_first()),
        (Some(_), None) => Err(without_second()),
    }
}

/// A parser for the rows of one kind of file.
pub(in crate::catalog) trait RowParser: Sync {
    /// The catalogue that the file is part of, if it is a known one.
    fn catalog(&self) -> Option<&'static str> {
        None
    }
    /// The kind of file, for people.
    fn kind(&self) -> String;
    /// Parses a row.
    fn parse(&self, row: Row) -> Parsed<NamedStar>;
    /// Where in a row the identifier is, and the label of its column.
    fn id_location(&self) -> (RecordLocation, String);
    /// A defect of the file that shows only in all of its records.
    fn diagnose(&self, tally: &ImportTally) -> Option<String> {
        let _ = tally;
        None
    }
}

/// The stars of a file, and a summary of its records.
#[derive(Default)]
pub(in crate::catalog) struct ImportTally {
    pub(in crate::catalog) summary: ImportSummary,
    pub(in crate::catalog) stars: Vec<Star>,
    /// The line of each star.
    lines: Vec<u64>,
    pub(super) names: Vec<(StarId, String)>,
}

impl ImportTally {
    /// Parses all rows, on all threads.
    pub(in crate::catalog) fn read<R: BufRead>(
        rows: &mut ImportRows<R>,
        format: &dyn RowParser,
        path: &Path,
    ) -> Result<Self, CatalogError> {
        /// With more unreadable records than this, and a share above the limit, reading stops.
        const UNREADABLE_MAX: usize = 100_000;
        const ROWS_PER_TASK: usize = 1024;
        let mut tally = Self::default();
        loop {
            let lines_read = rows.lines_read();
            let batch = rows.batch().map_err(CatalogError::read(path, lines_read))?;
            if batch.is_empty() {
                break;
            }
            let tasks = batch.par_chunks(ROWS_PER_TASK);
            let tallies: Vec<Self> = tasks.map(|rows| Self::parse(rows, format)).collect();
            tallies.into_iter().for_each(|part| tally.append(part));
            if tally.summary.records > MAX_RECORDS {
                return Err(CatalogError::TooManyRecords {
                    path: path.to_owned(),
                    limit: MAX_RECORDS,
                });
            }
            if tally.summary.unreadable.len() > UNREADABLE_MAX && tally.exceeds_limit() {
                break;
            }
        }
        tally.check(format, path)?;
        Ok(tally)
    }

    fn parse(rows: &[Row], format: &dyn RowParser) -> Self {
        let mut tally = Self::default();
        for &row in rows {
            tally.add(row.line, format.parse(row));
        }
        tally
    }

    fn add(&mut self, line: u64, parsed: Parsed<NamedStar>) {
        match parsed.map_err(|rejection| *rejection) {
            Ok((star, name)) => {
                self.names.extend(name.map(|name| (star.id, name)));
                self.stars.push(star);
                self.lines.push(line);
            }
            Err(Rejection::NoPosition) => self.summary.without_position.push(line),
            Err(Rejection::NoMagnitude) => self.summary.without_magnitude.push(line),
            Err(Rejection::Unreadable(error)) => self.summary.unreadable.push(error),
            Err(Rejection::NotARecord) => return,
        }
        self.summary.records += 1;
    }

    fn append(&mut self, mut other: Self) {
        let (ours, theirs) = (&mut self.summary, &mut other.summary);
        ours.records += theirs.records;
        ours.without_magnitude.append(&mut theirs.without_magnitude);
        ours.without_position.append(&mut theirs.without_position);
        ours.unreadable.append(&mut theirs.unreadable);
        self.stars.append(&mut other.stars);
        self.lines.append(&mut other.lines);
        self.names.append(&mut other.names);
    }

    /// Whether more records are unreadable than tolerated.
    pub(in crate::catalog) fn exceeds_limit(&self) -> bool {
        let unreadable = self.summary.unreadable.len() as u64;
        unreadable * 100 > self.summary.records * UNREADABLE_LIMIT_PERCENT
    }

    /// Rejects a file with too many unreadable records, or with a defect that its format detects.
    pub(super) fn check(
        &mut self,
        format: &dyn RowParser,
        path: &Path,
    ) -> Result<(), CatalogError> {
        let reason = format.diagnose(self);
        if self.exceeds_limit() {
            return Err(CatalogError::TooManyUnreadable {
                path: path.to_owned(),
                records: self.summary.records,
                limit_percent: UNREADABLE_LIMIT_PERCENT,
                errors: std::mem::take(&mut self.summary.unreadable),
                reason,
            });
        }
        match reason {
            Some(reason) => Err(CatalogError::Doubtful {
                path: path.to_owned(),
                reason,
            }),
            None => Ok(()),
        }
    }

    /// Removes the stars for which `keep` is false, as repetitions.
    pub(super) fn remove_repeated(&mut self, format: &dyn RowParser, keep: &[bool]) {
        let (location, label) = format.id_location();
        let names: HashMap<StarId, &str> = self.names.iter().map(|(id, n)| (*id, &**n)).collect();
        let mut removed = HashSet::new();
        for (index, star) in self.stars.iter().enumerate().filter(|&(i, _)| !keep[i]) {
            let found = match (star.id, names.get(&star.id)) {
                (StarId::Named(_), Some(name)) => format!("{name:?}"),
                (id, _) => id.to_string(),
            };
            removed.insert(star.id);
            self.summary.unreadable.push(RecordError {
                line: self.lines[index],
                location,
                label: label.clone(),
                found,
                expected: "an identifier that no record before has",
            });
        }
        self.summary.unreadable.sort_by_key(|error| error.line);
        let is_removed = |id: &StarId| matches!(id, StarId::Named(_)) && removed.contains(id);
        self.names.retain(|(id, _)| !is_removed(id));
        let mut kept = keep.iter();
        self.stars.retain(|_| kept.next() == Some(&true));
    }
}
