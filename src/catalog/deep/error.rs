//! What is wrong with a file of a deep catalogue.

use std::io;

/// What is wrong with a file of a deep catalogue.
#[derive(Debug, thiserror::Error)]
pub enum Damage {
    /// The file could not be read.
    #[error("it cannot be read")]
    Unreadable(#[source] io::Error),
    /// The file ends before its content does.
    #[error("it is truncated")]
    Truncated,
    /// Its content contradicts its format.
    #[error("it is damaged: {0}")]
    Invalid(String),
    /// Reading was to end early.
    #[error("reading was interrupted")]
    Interrupted,
    /// It is a table, but not of stars, or lacks columns of them.
    #[error("it has no columns {0}")]
    NoColumns(String),
    /// The format has what is not read here.
    #[error("it has {0}, which is not supported")]
    Unsupported(String),
}

impl From<io::Error> for Damage {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Self::Truncated,
            io::ErrorKind::InvalidData => Self::Invalid(error.to_string()),
            _ => Self::Unreadable(error),
        }
    }
}
