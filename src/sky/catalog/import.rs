//! Counts what becomes of each record of a source, and makes the catalogue of the stars among them.

use super::error::{FaultPlace, RecordFault};
use super::rows::{Row, Rows};
use super::{Catalog, CatalogError, Star, StarId};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::fmt;
use std::io::BufRead;
use std::path::{Path, PathBuf};

/// The share of unreadable records above which a file is refused, in percent.
///
/// SKY2000 and Tycho-2 have none. One in a hundred lets a few damaged lines pass, but not a shifted or foreign format.
const UNREADABLE_LIMIT_PERCENT: u64 = 1;
/// So many unreadable records end the reading at once, if they are more than that share.
const UNREADABLE_MAX: usize = 100_000;
/// So many rows are parsed in one go.
const ROWS_PER_TASK: usize = 1024;

/// How many line numbers the summary shows for each reason.
const LINES_SHOWN: usize = 5;

/// What became of the records of a source file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ImportSummary {
    /// Records in the file.
    pub records: u64,
    /// Records that became stars.
    pub stars: u64,
    /// Lines, from 1, of the records without a magnitude.
    pub without_magnitude: Vec<u64>,
    /// Lines, from 1, of the records without a position.
    pub without_position: Vec<u64>,
    /// The records that cannot be read: at most 1 % of all.
    pub unreadable: Vec<RecordFault>,
}

impl ImportSummary {
    /// What kept records from becoming stars, with the first lines; `None` if all did.
    pub fn left_out(&self) -> Option<String> {
        let unreadable: Vec<u64> = self.unreadable.iter().map(|fault| fault.line).collect();
        let reasons = [
            ("without a magnitude", &self.without_magnitude),
            ("without a position", &self.without_position),
            ("unreadable", &unreadable),
        ];
        let told: Vec<String> = reasons
            .into_iter()
            .filter(|(_, lines)| !lines.is_empty())
            .map(|(what, lines)| counted_lines(what, lines))
            .collect();
        (!told.is_empty()).then(|| told.join(", "))
    }
}

fn counted_lines(what: &str, lines: &[u64]) -> String {
    let shown: Vec<String> = lines.iter().take(LINES_SHOWN).map(u64::to_string).collect();
    let more = if lines.len() > LINES_SHOWN {
        ", …"
    } else {
        ""
    };
    let count = lines.len();
    let noun = if count == 1 { "line" } else { "lines" };
    format!("{count} {what} ({noun} {}{more})", shown.join(", "))
}

impl fmt::Display for ImportSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} records, {} stars", self.records, self.stars)?;
        match self.left_out() {
            Some(reasons) => write!(f, ", {reasons}"),
            None => Ok(()),
        }
    }
}

/// A file that a catalogue was made from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceFile {
    /// The file.
    pub path: PathBuf,
    /// What it is and, of a table, which columns were taken for what.
    pub kind: String,
    /// What became of its records.
    pub summary: ImportSummary,
}

/// A catalogue as it was read, and from what.
#[derive(Debug, Clone)]
pub struct Reading {
    /// The catalogue.
    pub catalog: Catalog,
    /// The source files, in the order of their names; none if the catalogue was in the compact form.
    pub files: Vec<SourceFile>,
}

/// What one row of a source is.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Record {
    /// A star, and its name if it has one.
    Star(Star, Option<String>),
    /// Readable, but without right ascension and declination.
    NoPosition,
    /// Readable, but without a magnitude.
    NoMagnitude,
    /// Not readable.
    Unreadable(RecordFault),
    /// No record at all: a comment, an empty line, a heading once more.
    Void,
}

/// How the rows of one kind of source are read.
pub(super) trait Format: Sync {
    /// The catalogue that the file is of, if it is one of those known.
    fn catalog(&self) -> Option<&'static str> {
        None
    }
    /// What the file is, for people.
    fn kind(&self) -> String;
    /// What the row is.
    fn parse(&self, row: Row) -> Record;
    /// Where in a row the identifier stands, and its label.
    fn id_place(&self) -> (FaultPlace, String);
    /// Why so many records are unreadable, or all stars are to be refused, if that can be told from the whole.
    fn judge(&self, tally: &Tally) -> Option<String> {
        let _ = tally;
        None
    }
}

/// What became of the rows of a file.
#[derive(Default)]
pub(super) struct Tally {
    pub(super) summary: ImportSummary,
    pub(super) stars: Vec<Star>,
    /// The line of each star.
    lines: Vec<u64>,
    names: Vec<(StarId, String)>,
}

impl Tally {
    /// Reads all rows, on all threads.
    pub(super) fn of<R: BufRead>(
        rows: &mut Rows<R>,
        format: &dyn Format,
        path: &Path,
    ) -> Result<Self, CatalogError> {
        let mut tally = Self::default();
        loop {
            let lines_read = rows.lines_read();
            let batch = rows.batch().map_err(|source| CatalogError::Read {
                path: path.to_owned(),
                lines_read,
                source,
            })?;
            if batch.is_empty() {
                break;
            }
            let parts: Vec<Self> = batch
                .par_chunks(ROWS_PER_TASK)
                .map(|rows| Self::of_some(rows, format))
                .collect();
            parts.into_iter().for_each(|part| tally.append(part));
            if tally.summary.unreadable.len() > UNREADABLE_MAX && tally.is_unfit() {
                break;
            }
        }
        tally.check(format, path)?;
        Ok(tally)
    }

    fn of_some(rows: &[Row], format: &dyn Format) -> Self {
        let mut tally = Self::default();
        for &row in rows {
            tally.take(row.line, format.parse(row));
        }
        tally
    }

    fn take(&mut self, line: u64, record: Record) {
        match record {
            Record::Void => return,
            Record::Star(star, name) => {
                self.names.extend(name.map(|name| (star.id, name)));
                self.stars.push(star);
                self.lines.push(line);
            }
            Record::NoPosition => self.summary.without_position.push(line),
            Record::NoMagnitude => self.summary.without_magnitude.push(line),
            Record::Unreadable(fault) => self.summary.unreadable.push(fault),
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

    /// Whether more records are unreadable than a file may have.
    pub(super) fn is_unfit(&self) -> bool {
        let unreadable = self.summary.unreadable.len() as u64;
        unreadable * 100 > self.summary.records * UNREADABLE_LIMIT_PERCENT
    }

    /// Whether the file can be what it seems to be.
    fn check(&mut self, format: &dyn Format, path: &Path) -> Result<(), CatalogError> {
        let reason = format.judge(self);
        if self.is_unfit() {
            return Err(CatalogError::TooManyUnreadable {
                path: path.to_owned(),
                records: self.summary.records,
                limit_percent: UNREADABLE_LIMIT_PERCENT,
                faults: std::mem::take(&mut self.summary.unreadable),
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

    /// Takes out the stars for which `keep` is false.
    fn refuse(&mut self, format: &dyn Format, keep: &[bool]) {
        let (place, label) = format.id_place();
        let names: HashMap<StarId, &str> = self.names.iter().map(|(id, n)| (*id, &**n)).collect();
        let mut refused = HashSet::new();
        for (index, star) in self.stars.iter().enumerate().filter(|&(i, _)| !keep[i]) {
            let found = match (star.id, names.get(&star.id)) {
                (StarId::Named(_), Some(name)) => format!("{name:?}"),
                (id, _) => id.to_string(),
            };
            refused.insert(star.id);
            self.summary.unreadable.push(RecordFault {
                line: self.lines[index],
                place,
                label: label.clone(),
                found,
                expected: "an identifier that no record before has",
            });
        }
        self.summary.unreadable.sort_by_key(|fault| fault.line);
        let gone = |id: &StarId| matches!(id, StarId::Named(_)) && refused.contains(id);
        self.names.retain(|(id, _)| !gone(id));
        let mut kept = keep.iter();
        self.stars.retain(|_| kept.next() == Some(&true));
    }
}

/// A file of a catalogue, read.
pub(super) struct Part {
    pub(super) path: PathBuf,
    pub(super) format: Box<dyn Format + Send>,
    pub(super) tally: Tally,
}

/// The catalogue of all the stars in `parts`, which were found at `path`.
///
/// Of two records with one identifier the first counts, in the order of the parts; the other is unreadable.
pub(super) fn combine(
    path: &Path,
    title: String,
    mut parts: Vec<Part>,
) -> Result<Reading, CatalogError> {
    refuse_repeated(&mut parts)?;
    let (mut stars, mut names, mut files) = (Vec::new(), Vec::new(), Vec::new());
    for mut part in parts {
        part.tally.summary.stars = part.tally.stars.len() as u64;
        if stars.is_empty() {
            stars = part.tally.stars;
        } else {
            stars.append(&mut part.tally.stars);
        }
        names.append(&mut part.tally.names);
        files.push(SourceFile {
            path: part.path,
            kind: part.format.kind(),
            summary: part.tally.summary,
        });
    }
    if stars.is_empty() {
        return Err(CatalogError::NoStars {
            path: path.to_owned(),
            records: files.iter().map(|file| file.summary.records).sum(),
        });
    }
    // A record that was refused as a repetition may have brought a name, too: that of the first stays.
    let mut named = HashSet::new();
    names.retain(|(id, _)| named.insert(*id));
    let catalog = Catalog::new(title, stars, names)?;
    Ok(Reading { catalog, files })
}

fn refuse_repeated(parts: &mut [Part]) -> Result<(), CatalogError> {
    let stars = parts.iter().map(|part| part.tally.stars.as_slice());
    let mut ids: Vec<(StarId, usize)> = stars.flatten().map(|star| star.id).zip(0..).collect();
    ids.par_sort_unstable();
    let repeated = |pair: &&[(StarId, usize)]| pair[0].0 == pair[1].0;
    let mut refused: Vec<usize> = ids.windows(2).filter(repeated).map(|p| p[1].1).collect();
    refused.extend(repeated_names(parts));
    if refused.is_empty() {
        return Ok(());
    }
    let mut keep = vec![true; ids.len()];
    refused.into_iter().for_each(|index| keep[index] = false);
    let mut keep = keep.as_slice();
    for part in parts {
        let (ours, others) = keep.split_at(part.tally.stars.len());
        keep = others;
        part.tally.refuse(&*part.format, ours);
        part.tally.check(&*part.format, &part.path)?;
    }
    Ok(())
}

/// The stars, counted through all parts, that have no more than a name, and one that another had before.
fn repeated_names(parts: &[Part]) -> Vec<usize> {
    let mut refused = Vec::new();
    let mut first = 0;
    let mut seen = HashSet::new();
    for part in parts {
        let is_named = |star: &Star| matches!(star.id, StarId::Named(_));
        let named = part.tally.stars.iter().enumerate();
        // Every star without another identifier brought its name with it, in the same order.
        let named = named.filter(|(_, star)| is_named(star));
        let names = part.tally.names.iter();
        let names = names.filter(|(id, _)| matches!(id, StarId::Named(_)));
        for ((index, _), (_, name)) in named.zip(names) {
            if !seen.insert(name.as_str()) {
                refused.push(first + index);
            }
        }
        first += part.tally.stars.len();
    }
    refused
}
