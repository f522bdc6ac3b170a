//! Reports on standard output, one after the other.

use super::options::OutputOptions;
use super::result_files::table;
use crate::cli::options::format::Format;
use crate::cli::output::stdout::print;
use starpipe::base::remedy::OptionNames;
use starpipe::report::{FrameReport, TextOptions};
use std::ops::ControlFlow;

/// Prints reports as they come.
pub(super) struct Printer {
    format: Format,
    text: TextOptions,
    reports: usize,
}

impl Printer {
    pub(super) fn new(options: &OutputOptions) -> Self {
        let mut text = TextOptions::default();
        text.all_stars = options.all_stars;
        text.option_names = OptionNames::Flags;
        Self {
            format: options.format,
            text,
            reports: 0,
        }
    }

    /// Prints `report`. Breaks if the reader has closed the pipe.
    pub(super) fn print(&mut self, report: &FrameReport) -> anyhow::Result<ControlFlow<()>> {
        let is_first = self.reports == 0;
        self.reports += 1;
        print(&self.format(report, is_first)?)
    }

    fn format(&self, report: &FrameReport, is_first: bool) -> anyhow::Result<String> {
        Ok(match self.format {
            Format::Text if is_first => report.to_text(self.text),
            Format::Text => format!("\n{}", report.to_text(self.text)),
            Format::Json => report.to_json_line()? + "\n",
            Format::Csv => table(report, is_first)?,
        })
    }
}
