//! Errors of reading a description of a camera.

use super::response::ResponseError;
use super::spot_image::SpotImageError;
use crate::base::format::excerpt;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Error of reading a data sheet.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DataSheetError {
    /// The file cannot be read.
    #[error("{}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is larger than any data sheet.
    #[error("{}: larger than {limit} bytes: too large for a camera description", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Maximum size, in bytes.
        limit: u64,
    },
    /// The file is not valid TOML.
    #[error("{}, line {line}: {}", path.display(), excerpt(.message))]
    Syntax {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// Error of the parser.
        message: String,
    },
    /// An unknown key.
    #[error("{}, line {line}: unknown key '{}'{}", path.display(), excerpt(.key), suggestion(.nearest.as_deref()))]
    UnknownKey {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The key.
        key: String,
        /// The most similar key.
        nearest: Option<String>,
    },
    /// An invalid value.
    #[error("{}, line {line}: {key} is {found}, expected {expected}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The key.
        key: String,
        /// The value.
        found: String,
        /// What is valid.
        expected: String,
    },
    /// A required key is missing.
    #[error("{}: {key} is missing: {about}", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
        /// The key.
        key: &'static str,
        /// Description of the key.
        about: &'static str,
    },
    /// An invalid curve of a transmission or an efficiency.
    #[error("{}, line {line}: {key}", path.display())]
    Response {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The key.
        key: String,
        /// The error in the curve.
        source: Box<ResponseError>,
    },
    /// An invalid picture of a spot.
    #[error("{}, line {line}: spot_file", path.display())]
    Spot {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The error in the picture.
        source: Box<SpotImageError>,
    },
    /// Values that contradict each other.
    #[error("{}: {what}", path.display())]
    Contradiction {
        /// The file.
        path: PathBuf,
        /// Description of the contradiction.
        what: String,
    },
}

fn suggestion(nearest: Option<&str>) -> String {
    nearest.map_or_else(String::new, |name| format!("; did you mean '{name}'?"))
}

impl DataSheetError {
    pub(super) fn syntax(path: &Path, text: &str, error: &toml::de::Error) -> Self {
        Self::Syntax {
            path: path.to_owned(),
            line: line_of(text, error.span()),
            message: error.message().trim().to_owned(),
        }
    }
}

/// The line, counted from 1, in which `span` begins.
pub(super) fn line_of(text: &str, span: Option<Range<usize>>) -> usize {
    let end = span.map_or(0, |span| span.start).min(text.len());
    text.as_bytes()[..end]
        .iter()
        .filter(|b| **b == b'\n')
        .count()
        + 1
}
