//! What a command prints.

use crate::cli::output::rows::{csv_table, json_lines};
use clap::ValueEnum;
use serde::Serialize;

/// The forms of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum OutputFormat {
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

impl OutputFormat {
    /// A table in this form.
    pub(crate) fn of_rows<R: Serialize>(
        self,
        text: impl FnOnce() -> String,
        rows: impl Iterator<Item = R>,
    ) -> anyhow::Result<String> {
        match self {
            Self::Text => Ok(text()),
            Self::Json => json_lines(rows),
            Self::Csv => csv_table(rows),
        }
    }
}

impl PageFormat {
    /// The report in this form.
    pub(crate) fn of(
        self,
        text: impl FnOnce() -> String,
        json: impl FnOnce() -> anyhow::Result<String>,
    ) -> anyhow::Result<String> {
        match self {
            Self::Text => Ok(text()),
            Self::Json => json(),
        }
    }
}
