//! Results on standard output and in files.

use crate::cli::options::format::Format;
use crate::cli::output::files::write_whole;
use crate::cli::output::paths::output_path;
use crate::cli::output::stdout::print;
use anyhow::Context;
use starpipe::frame::Frame;
use starpipe::pipeline::Solution;
use starpipe::report::{FrameReport, TextOptions, write_table_header};
use starpipe::report::{overlay, wcs};
use starpipe::sky::catalog::Catalog;
use std::io;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Where results go, and in which form.
pub(crate) struct OutputSettings {
    pub(crate) format: Format,
    pub(crate) text: TextOptions,
    pub(crate) directory: Option<PathBuf>,
}

/// Prints reports as they come.
pub(crate) struct Printer {
    format: Format,
    text: TextOptions,
    reports: usize,
}

impl Printer {
    pub(crate) fn new(settings: &OutputSettings) -> Self {
        Self {
            format: settings.format,
            text: settings.text,
            reports: 0,
        }
    }

    /// Prints `report`. Ends it where nobody listens any longer.
    pub(crate) fn print(&mut self, report: &FrameReport) -> anyhow::Result<ControlFlow<()>> {
        let first = self.reports == 0;
        self.reports += 1;
        let text = self.rendered(report, first)?;
        print(&text)
    }

    fn rendered(&self, report: &FrameReport, first: bool) -> anyhow::Result<String> {
        Ok(match self.format {
            Format::Text if first => report.to_text(self.text),
            Format::Text => format!("\n{}", report.to_text(self.text)),
            Format::Json => report.to_json_line()? + "\n",
            Format::Csv => String::from_utf8(table(report, first)?)?,
        })
    }
}

/// One input, worked on: what the files of results are made from.
pub(crate) struct Solved {
    pub(crate) solution: Solution,
    /// The frame itself, where there is one to draw on.
    pub(crate) frame: Option<Frame>,
}

/// The directory for files of results, where one is wanted.
pub(crate) struct ResultFiles {
    directory: Option<PathBuf>,
}

impl ResultFiles {
    /// Makes the directory, if one is wanted.
    pub(crate) fn new(settings: OutputSettings) -> anyhow::Result<Self> {
        if let Some(directory) = &settings.directory {
            std::fs::create_dir_all(directory)
                .with_context(|| format!("making the directory {}", directory.display()))?;
        }
        Ok(Self {
            directory: settings.directory,
        })
    }

    /// Writes the files that belong to `input`: all of them, or none where there is no room for one.
    ///
    /// A header of world coordinates that an earlier run left is taken away where this one has none to give.
    pub(crate) fn save(
        &self,
        input: &Path,
        solved: &Solved,
        report: &FrameReport,
        catalog: &Catalog,
    ) -> anyhow::Result<()> {
        let Some(directory) = &self.directory else {
            return Ok(());
        };
        let path = |extension: &str| output_path(directory, input, extension);
        let json = report.to_json_line()? + "\n";
        let mut files = vec![
            (path("json"), json.into_bytes()),
            (path("csv"), table(report, true)?),
        ];
        if let Some(frame) = &solved.frame {
            let title = input.file_name().unwrap_or(input.as_os_str());
            let title = title.to_string_lossy();
            let picture = overlay::draw(&title, frame, &solved.solution, catalog);
            files.push((path("png"), overlay::to_png(&picture)?));
        }
        let header = wcs::header(&report.frame, &solved.solution);
        let has_header = header.is_some();
        files.extend(header.map(|header| (path("wcs"), header)));
        write_whole(&files)?;
        if has_header {
            Ok(())
        } else {
            remove_stale(&path("wcs"))
        }
    }
}

fn remove_stale(path: &Path) -> anyhow::Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("removing {}, which is out of date", path.display()))
        }
        _ => Ok(()),
    }
}

fn table(report: &FrameReport, with_header: bool) -> anyhow::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    if with_header {
        write_table_header(&mut writer)?;
    }
    report.write_table_rows(&mut writer)?;
    writer
        .into_inner()
        .map_err(|error| error.into_error().into())
}
