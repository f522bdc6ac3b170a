//! Reports on standard output, one after the other.

use super::frame_table::{FrameTable, RunSummary};
use super::options::{OutputOptions, ReportFormat};
use crate::cli::exit::OutcomeTally;
use crate::cli::output::stdout::print;
use starpipe::base::remedy::OptionNames;
use starpipe::base::table::csv_of;
use starpipe::report::{FrameReport, TextOptions};
use starpipe::store::FrameRow;
use std::io::{self, IsTerminal};
use std::ops::ControlFlow;

/// Prints reports as they come.
pub(super) struct Printer {
    /// Nothing is printed.
    is_silent: bool,
    format: ReportFormat,
    text: TextOptions,
    table: FrameTable,
    reports: usize,
    summary: RunSummary,
}

impl Printer {
    /// For so many inputs.
    pub(super) fn new(options: &OutputOptions, inputs: usize) -> Self {
        let mut text = TextOptions::default();
        text.all_stars = options.all_stars;
        text.option_names = OptionNames::Flags;
        let is_table = inputs > 1 && !options.all_stars && io::stdout().is_terminal();
        let usual = if is_table {
            ReportFormat::Table
        } else {
            ReportFormat::Text
        };
        Self {
            is_silent: options.quiet && options.format.is_none(),
            format: options.format.unwrap_or(usual),
            text,
            table: FrameTable::for_stdout(),
            reports: 0,
            summary: RunSummary::new(),
        }
    }

    /// Whether rows of frames are printed.
    pub(super) fn needs_rows(&self) -> bool {
        self.format == ReportFormat::FramesCsv
    }

    /// Prints a report and its row. Breaks if the reader has closed the pipe.
    pub(super) fn print(
        &mut self,
        report: &FrameReport,
        row: Option<&FrameRow>,
    ) -> anyhow::Result<ControlFlow<()>> {
        if self.is_silent {
            return Ok(ControlFlow::Continue(()));
        }
        let is_first = self.reports == 0;
        self.reports += 1;
        self.summary.add(report);
        print(&self.format(report, row, is_first)?)
    }

    /// Prints what follows the last report.
    pub(super) fn finish(&mut self, tally: &OutcomeTally) -> anyhow::Result<ControlFlow<()>> {
        if self.is_silent || self.format != ReportFormat::Table {
            return Ok(ControlFlow::Continue(()));
        }
        print(&self.summary.text(tally))
    }

    fn format(
        &self,
        report: &FrameReport,
        row: Option<&FrameRow>,
        is_first: bool,
    ) -> anyhow::Result<String> {
        Ok(match self.format {
            ReportFormat::Text if is_first => report.to_text(self.text),
            ReportFormat::Text => format!("\n{}", report.to_text(self.text)),
            ReportFormat::Table if is_first => self.table.header() + &self.table.row(report),
            ReportFormat::Table => self.table.row(report),
            ReportFormat::Json => report.to_json_line()? + "\n",
            ReportFormat::Csv => report.to_csv(is_first)?,
            ReportFormat::FramesCsv => csv_of(row, is_first)?,
        })
    }
}
