//! Errors of catalogue files.

use super::StarId;
use super::deep::Damage;
use crate::base::format::excerpt;
use std::path::{Path, PathBuf};
use std::{fmt, io};

/// The readable kinds of files, for messages.
const KINDS_READ: &str = "a compact starpipe catalog, SKY2000 records of 520 bytes, the files of \
     Tycho-2, or a table (text or VOTable) with headings for identifiers, right ascension, declination \
     and magnitude, plain or gzip";
/// The kinds of files that can be imported, for messages.
const KINDS_IMPORTED: &str = "SKY2000 records of 520 bytes, the files of Tycho-2, or a table (text \
     or VOTable) with headings for identifiers, right ascension, declination and magnitude, plain or \
     gzip";

/// Why a catalogue could not be read, made or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CatalogError {
    /// The file could not be opened.
    #[error("opening the catalog {}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// The file could not be read to its end.
    #[error("reading the catalog {}, after line {lines_read}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The number of lines read before (0 in a binary file).
        lines_read: u64,
        /// The cause, from the system or the decompression.
        source: io::Error,
    },
    /// The file could not be written.
    #[error("writing the catalog {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// The content is of no readable kind.
    #[error(
        "{}: unknown catalog format: it begins with {found}; expected {expected}",
        path.display()
    )]
    UnknownKind {
        /// The file.
        path: PathBuf,
        /// The beginning of the (decompressed) content.
        found: String,
        /// The readable kinds.
        expected: &'static str,
    },
    /// A table lacks required columns.
    #[error(
        "{}, line {line}: the table has no column {}; found {}",
        path.display(),
        missing.join(", "),
        excerpt(.found)
    )]
    MissingColumns {
        /// The file.
        path: PathBuf,
        /// The line with the headings, from 1.
        line: u64,
        /// The labels of the missing columns.
        missing: Vec<&'static str>,
        /// The headings found.
        found: String,
    },
    /// More records than any catalogue for this purpose has.
    #[error("{}: too large: more than {limit} records; keep the brighter stars", .path.display())]
    TooManyRecords {
        /// The file.
        path: PathBuf,
        /// The most that are read.
        limit: u64,
    },
    /// Too many records are unreadable.
    #[error(
        "{}: {}{} of {records} records are unreadable, at most {limit_percent} % are tolerated; the first \
         ones: {}",
        path.display(), reason.as_ref().map_or(String::new(), |reason| format!("{reason}; ")),
        errors.len(), first_of(errors)
    )]
    TooManyUnreadable {
        /// The file.
        path: PathBuf,
        /// Records read so far, unreadable ones included.
        records: u64,
        /// The largest share tolerated, in percent.
        limit_percent: u64,
        /// Every unreadable record so far.
        errors: Vec<RecordError>,
        /// The probable cause, where known.
        reason: Option<String>,
    },
    /// Every record is valid, but together they cannot be right.
    #[error("{}: {reason}", path.display())]
    Doubtful {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// A directory holds no catalogue, or more than one.
    #[error(
        "{}: {found}; expected a directory with the files of Tycho-2 or one other catalog",
        path.display()
    )]
    Directory {
        /// The directory.
        path: PathBuf,
        /// What is in it.
        found: String,
    },
    /// No record has both a position and a magnitude.
    #[error("{}: no star with a position and a magnitude among {records} records", path.display())]
    NoStars {
        /// The file.
        path: PathBuf,
        /// Records read.
        records: u64,
    },
    /// A compact catalogue is damaged, or of an unknown version.
    #[error("the catalog {}: {error}", path.display())]
    Compact {
        /// The file.
        path: PathBuf,
        /// The damage.
        error: CompactError,
    },
    /// A file of another program's catalogue is damaged, or could not be read.
    #[error("the catalog {}: {error}", path.display())]
    Deep {
        /// The file.
        path: PathBuf,
        /// The damage.
        #[source]
        error: Damage,
    },
    /// A star has a value that the compact form cannot hold.
    #[error("star {id}: {quantity} is {value}, expected {expected}")]
    OutOfRange {
        /// The star.
        id: StarId,
        /// What is out of range.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// The range of values that can be held.
        expected: &'static str,
    },
    /// Two stars have the same identifier.
    #[error("star {id} occurs twice; identifiers must be unique")]
    DuplicateStar {
        /// The identifier.
        id: StarId,
    },
    /// A name has no star, is the second one of a star, or is empty or too long.
    #[error("the name {name:?} of star {id}: expected {expected}")]
    BadName {
        /// The star.
        id: StarId,
        /// The name.
        name: String,
        /// What a name must be.
        expected: &'static str,
    },
}

impl CatalogError {
    /// Whether the file could not be read, whatever is in it.
    pub(super) fn is_of_system(&self) -> bool {
        match self {
            Self::Read { source, .. } => source.kind() != io::ErrorKind::InvalidData,
            _ => false,
        }
    }

    /// Converts an I/O error on opening `path`.
    pub(super) fn open(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Open { path, source }
    }

    /// Converts an I/O error on reading `path` after `lines_read` lines.
    pub(super) fn read(path: &Path, lines_read: u64) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Read {
            path,
            lines_read,
            source,
        }
    }

    /// Converts an I/O error on writing `path`.
    pub(super) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Write { path, source }
    }

    /// The error for a file that begins with `head`, of no readable kind.
    pub(super) fn unknown_kind(path: &Path, head: &[u8]) -> Self {
        const SHOWN_BYTES: usize = 16;
        Self::UnknownKind {
            path: path.to_owned(),
            found: if head.is_empty() {
                "nothing: the file is empty".to_owned()
            } else {
                quoted(&head[..head.len().min(SHOWN_BYTES)])
            },
            expected: KINDS_READ,
        }
    }

    /// The error for importing a catalogue that is compact already.
    pub(super) fn already_compact(path: &Path) -> Self {
        Self::UnknownKind {
            path: path.to_owned(),
            found: "the signature of a compact catalog, which is already imported".to_owned(),
            expected: KINDS_IMPORTED,
        }
    }
}

/// The first few errors, for messages.
fn first_of(errors: &[RecordError]) -> String {
    const SHOWN: usize = 5;
    let shown: Vec<String> = errors.iter().take(SHOWN).map(ToString::to_string).collect();
    shown.join("; ")
}

/// Where in a row an error is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum RecordLocation {
    /// A byte of a fixed-width record, from 1.
    Byte(usize),
    /// A column of a table, from 1.
    Column(usize),
}

impl fmt::Display for RecordLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Byte(number) => write!(f, "byte {number}"),
            Self::Column(number) => write!(f, "column {number}"),
        }
    }
}

/// An unreadable record, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordError {
    /// The line in the file, from 1.
    pub line: u64,
    /// Where in the line.
    pub location: RecordLocation,
    /// The label of the column; empty for the line as a whole.
    pub label: String,
    /// What was found.
    pub found: String,
    /// What was expected.
    pub expected: &'static str,
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}, {}", self.line, self.location)?;
        if !self.label.is_empty() {
            write!(f, " ({})", self.label)?;
        }
        write!(f, ": found {}, expected {}", self.found, self.expected)
    }
}

/// Damage of a compact catalogue.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("byte {byte}: found {found}, expected {expected}")]
pub struct CompactError {
    /// The offset in the file, from 0.
    pub byte: usize,
    /// What was found.
    pub found: String,
    /// What was expected.
    pub expected: String,
}

/// Raw bytes for messages: quoted, escaped, cut after `SHOWN` bytes.
pub(super) fn quoted(bytes: &[u8]) -> String {
    const SHOWN: usize = 40;
    let more = if bytes.len() > SHOWN { "…" } else { "" };
    format!(
        "\"{}\"{more}",
        bytes[..bytes.len().min(SHOWN)].escape_ascii()
    )
}
