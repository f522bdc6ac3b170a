//! What can go wrong with a catalogue file.

use super::StarId;
use std::fmt;
use std::io;
use std::path::PathBuf;

/// How many of the unreadable records an error message shows.
const FAULTS_SHOWN: usize = 5;

/// Why a catalogue could not be read, made or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CatalogError {
    /// The file could not be opened.
    #[error("opening the catalog {}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file could not be read to its end.
    #[error("reading the catalog {}, after line {lines_read}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The lines that were read before (0 in a binary file).
        lines_read: u64,
        /// What the system, or the decompression, says.
        source: io::Error,
    },
    /// The file could not be written.
    #[error("writing the catalog {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The content is of no kind that is read.
    #[error(
        "{}: not a catalog that can be read: it begins with {found}; expected {expected}",
        path.display()
    )]
    UnknownKind {
        /// The file.
        path: PathBuf,
        /// How the (decompressed) content begins.
        found: String,
        /// The kinds that are read.
        expected: &'static str,
    },
    /// A table lacks columns that a catalogue must have.
    #[error(
        "{}, line {line}: the table has no column {}; found {found}",
        path.display(),
        missing.join(", ")
    )]
    MissingColumns {
        /// The file.
        path: PathBuf,
        /// The line with the headings, from 1.
        line: u64,
        /// The labels of the missing columns.
        missing: Vec<&'static str>,
        /// The headings that are there.
        found: String,
    },
    /// So many records are unreadable that the file cannot be what it seems to be.
    #[error(
        "{}: {}{} of {records} records are unreadable, at most {limit_percent} % are tolerated; the first: {}",
        path.display(), reason.as_ref().map_or(String::new(), |reason| format!("{reason}; ")),
        faults.len(), first_of(faults)
    )]
    TooManyUnreadable {
        /// The file.
        path: PathBuf,
        /// Records read so far, unreadable ones included.
        records: u64,
        /// The share that would have been tolerated, in percent.
        limit_percent: u64,
        /// Every unreadable record so far.
        faults: Vec<RecordFault>,
        /// What is probably wrong, where that can be told.
        reason: Option<String>,
    },
    /// The records can be read one by one, but together they cannot be right.
    #[error("{}: {reason}", path.display())]
    Doubtful {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// A directory holds no catalogue, or more than one.
    #[error("{}: {found}; expected a directory with the files of Tycho-2 or one other catalog", path.display())]
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
    /// A compact catalogue is damaged, or of a version that is not read.
    #[error("the catalog {}: {fault}", path.display())]
    Compact {
        /// The file.
        path: PathBuf,
        /// The damage.
        fault: CompactFault,
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
        /// The values that can be held.
        expected: &'static str,
    },
    /// Two stars have the same number.
    #[error("star {id} occurs twice; expected every number once")]
    DuplicateStar {
        /// The number.
        id: StarId,
    },
    /// A name is given to no star, twice to one star, or is no short text.
    #[error("the name {name:?} of star {id}: expected {expected}")]
    BadName {
        /// The number of the star named.
        id: StarId,
        /// The name.
        name: String,
        /// What a name must be.
        expected: &'static str,
    },
}

fn first_of(faults: &[RecordFault]) -> String {
    let shown: Vec<String> = faults
        .iter()
        .take(FAULTS_SHOWN)
        .map(ToString::to_string)
        .collect();
    shown.join("; ")
}

/// Where in a line a record is at fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultPlace {
    /// A byte of a fixed-width record, from 1.
    Byte(usize),
    /// A cell of a table, from 1.
    Cell(usize),
}

impl fmt::Display for FaultPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Byte(number) => write!(f, "byte {number}"),
            Self::Cell(number) => write!(f, "column {number}"),
        }
    }
}

/// One record that cannot be read, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordFault {
    /// The line in the file, from 1.
    pub line: u64,
    /// Where in the line.
    pub place: FaultPlace,
    /// The label of the column at fault; empty if the line as a whole is.
    pub label: String,
    /// What stands there.
    pub found: String,
    /// What should stand there.
    pub expected: &'static str,
}

impl fmt::Display for RecordFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}, {}", self.line, self.place)?;
        if !self.label.is_empty() {
            write!(f, " ({})", self.label)?;
        }
        write!(f, ": found {}, expected {}", self.found, self.expected)
    }
}

/// Where and how a compact catalogue is damaged.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("byte {byte}: found {found}, expected {expected}")]
pub struct CompactFault {
    /// The offset in the file, from 0.
    pub byte: usize,
    /// What stands there.
    pub found: String,
    /// What should stand there.
    pub expected: String,
}

/// Raw bytes as they are shown in a message: quoted, escaped, cut after `SHOWN` bytes.
pub(super) fn quoted(bytes: &[u8]) -> String {
    const SHOWN: usize = 40;
    let more = if bytes.len() > SHOWN { "…" } else { "" };
    format!(
        "\"{}\"{more}",
        bytes[..bytes.len().min(SHOWN)].escape_ascii()
    )
}
