//! Why an archive cannot be used.

use parquet::errors::ParquetError;
use std::io;
use std::path::{Path, PathBuf};

/// Why an archive cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ArchiveError {
    /// There are no frames.
    #[error("there are no frames")]
    NoFrames,
    /// The directory has results of other frames or another configuration.
    #[error("{} holds another run: {differences}", .directory.display())]
    OtherRun {
        /// The directory.
        directory: PathBuf,
        /// What differs.
        differences: String,
    },
    /// The directory has files that are not an archive's.
    #[error("{} has {name} and no archive.json: it is no archive", .directory.display())]
    Foreign {
        /// The directory.
        directory: PathBuf,
        /// Name of the file.
        name: &'static str,
    },
    /// There is no archive in the directory.
    #[error("{} has no archive.json: no archive has begun in it", .0.display())]
    NoArchive(PathBuf),
    /// A file that says whose the directory is was changed since it was written.
    #[error("{} is damaged; the command that wrote the directory writes it anew, if results show that they are its own", .0.display())]
    Damaged(PathBuf),
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
    #[error("{} has no column \"frame\", nor one column of text only", .0.display())]
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
    #[error("{action} {}", .path.display())]
    Table {
        /// What was done to it.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: ParquetError,
    },
    /// A file of the archive is not what was written.
    #[error("reading {}", .path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// The error of the parser.
        source: serde_json::Error,
    },
}

impl ArchiveError {
    pub(super) fn file<'p>(
        action: &'static str,
        path: &'p Path,
    ) -> impl FnOnce(io::Error) -> Self + use<'p> {
        move |source| Self::File {
            action,
            path: path.to_owned(),
            source,
        }
    }

    pub(super) fn table<'p>(
        action: &'static str,
        path: &'p Path,
    ) -> impl Fn(ParquetError) -> Self + use<'p> {
        move |source| Self::Table {
            action,
            path: path.to_owned(),
            source,
        }
    }

    pub(super) fn json<'p>(path: &'p Path) -> impl FnOnce(serde_json::Error) -> Self + use<'p> {
        move |source| Self::Json {
            path: path.to_owned(),
            source,
        }
    }
}
