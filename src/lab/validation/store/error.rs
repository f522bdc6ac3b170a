//! Why a run's directory cannot be used.

use std::io;
use std::path::{Path, PathBuf};

/// Why a run's directory cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The directory belongs to another run.
    #[error("{} holds another run: {differences}", .directory.display())]
    OtherRun {
        /// The directory.
        directory: PathBuf,
        /// What differs.
        differences: String,
    },
    /// The directory has tables of an unknown run.
    #[error(
        "{} has {name} and no run.json, which would tell what run it is of",
        .directory.display()
    )]
    UnknownRun {
        /// The directory.
        directory: PathBuf,
        /// Name of the table.
        name: &'static str,
    },
    /// Another process writes the tables.
    #[error("another run is at work in {}", .0.display())]
    Locked(PathBuf),
    /// A table has other content than this run would write.
    #[error(
        "{}, line {line}: {problem}; the table was changed: remove the directory to begin anew",
        .path.display()
    )]
    Changed {
        /// The table.
        path: PathBuf,
        /// Number of the line, from 1.
        line: u64,
        /// What was found and what was expected.
        problem: String,
    },
    /// A file could not be read or written.
    #[error("{action} {}", .path.display())]
    File {
        /// What was done to it.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// `run.json` is not JSON.
    #[error("reading {}", .path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// The error of the parser.
        source: serde_json::Error,
    },
    /// A row could not be written as CSV.
    #[error("writing a row of a table")]
    Row(#[from] csv::Error),
}

impl StoreError {
    /// A function that adds what was done to which file to an error of the system.
    pub(super) fn file(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::File {
            action,
            path: path.to_owned(),
            source,
        }
    }
}
