//! Why results of a run cannot be used.

use std::io;
use std::path::{Path, PathBuf};

/// Why results of a run cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// There are no frames.
    #[error("there are no frames")]
    NoFrames,
    /// The directory belongs to another run.
    #[error("{} has the results of a run with other settings: {differences}", .directory.display())]
    OtherRun {
        /// The directory.
        directory: PathBuf,
        /// What differs.
        differences: String,
    },
    /// The directory has results of an unknown run.
    #[error("{} has {name} but no {file}: it is unknown which run {name} belongs to", .directory.display())]
    UnknownRun {
        /// The directory.
        directory: PathBuf,
        /// Name of the result.
        name: &'static str,
        /// Name of the file that is missing.
        file: &'static str,
    },
    /// A file that says whose the directory is was changed since it was written.
    #[error("{} is damaged; repeat the command that wrote the directory: it restores the file if the results match", .0.display())]
    Damaged(PathBuf),
    /// Another process writes the results.
    #[error("another run is writing {}", .0.display())]
    Locked(PathBuf),
    /// A table has other content than this run would write.
    #[error("{}, line {line}: {problem}; the table was modified: remove the directory to start again", .path.display())]
    Changed {
        /// The table.
        path: PathBuf,
        /// Number of the line, from 1.
        line: u64,
        /// What was found and what was expected.
        problem: String,
    },
    /// There is no archive in the directory.
    #[error("{} has no archive.json: it is not an archive", .0.display())]
    NoArchive(PathBuf),
    /// Parts are missing or damaged.
    #[error("{missing} of {parts} parts are missing or damaged in {}: see `starpipe archive status`", .directory.display())]
    Unfinished {
        /// The directory.
        directory: PathBuf,
        /// Missing and damaged parts.
        missing: usize,
        /// All parts.
        parts: usize,
    },
    /// A list of frames has no column of names.
    #[error("{} has neither a column \"frame\" nor a single text column", .0.display())]
    NoNames(PathBuf),
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
    /// A table could not be read or written.
    #[cfg(feature = "archive")]
    #[error("{action} {}", .path.display())]
    Table {
        /// What was done to it.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: parquet::errors::ParquetError,
    },
    /// A value could not be written as JSON.
    #[error("writing JSON")]
    Json(#[from] serde_json::Error),
    /// A row could not be written as CSV.
    #[error("writing a row of a table")]
    Row(#[from] csv::Error),
}

impl StoreError {
    /// Whether the directory holds something else than this run: another one would do.
    pub fn is_of_directory(&self) -> bool {
        matches!(
            self,
            Self::OtherRun { .. } | Self::UnknownRun { .. } | Self::Damaged(_)
        )
    }

    /// A function that adds what was done to which file to an error of the system.
    pub(crate) fn file(action: &'static str, path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| Self::File {
            action,
            path: path.to_owned(),
            source,
        }
    }

    /// The same for an error of Parquet.
    #[cfg(feature = "archive")]
    pub(super) fn table(
        action: &'static str,
        path: &Path,
    ) -> impl Fn(parquet::errors::ParquetError) -> Self {
        move |source| Self::Table {
            action,
            path: path.to_owned(),
            source,
        }
    }
}
