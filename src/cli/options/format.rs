//! What a command prints.

use clap::ValueEnum;

/// The forms of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// A report for people
    Text,
    /// One JSON object a line
    Json,
    /// A table
    Csv,
}

/// The forms of a report that is not a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PageFormat {
    /// A report for people
    Text,
    /// One JSON object
    Json,
}
