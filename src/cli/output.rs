//! Results on standard output and in files.

use super::args::Format;
use super::settings::output_path;
use anyhow::Context;
use serde::Serialize;
use starpipe::frame::Frame;
use starpipe::pipeline::Solution;
use starpipe::report::{FrameReport, TextOptions, write_table_header};
use starpipe::sky::catalog::Catalog;
use starpipe::{base::files, report::overlay, report::wcs};
use std::io::{self, Write};
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

/// Writes `text` to standard output, whole and at once. Breaks off where nobody reads it any longer.
pub(crate) fn print(text: &str) -> anyhow::Result<ControlFlow<()>> {
    let mut stdout = io::stdout().lock();
    let written = stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush());
    match written {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(ControlFlow::Break(())),
        Err(error) => Err(error).context("writing to standard output"),
        Ok(()) => Ok(ControlFlow::Continue(())),
    }
}

/// Rows as JSON Lines.
pub(crate) fn json_lines<R: Serialize>(rows: impl Iterator<Item = R>) -> anyhow::Result<String> {
    let mut lines = String::new();
    for row in rows {
        lines += &serde_json::to_string(&row)?;
        lines.push('\n');
    }
    Ok(lines)
}

/// Rows as a CSV table with a heading.
pub(crate) fn csv_table<R: Serialize>(rows: impl Iterator<Item = R>) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    let bytes = writer
        .into_inner()
        .map_err(csv::IntoInnerError::into_error)?;
    Ok(String::from_utf8(bytes)?)
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

/// Writes files whole or not at all: into temporary files beside them, which take their names once all are written.
pub(crate) fn write_whole(files: &[(PathBuf, Vec<u8>)]) -> anyhow::Result<()> {
    let writing = |path: &Path| format!("writing {}", path.display());
    let write = |path: &Path, content: &[u8]| {
        let mut file = files::beside(path)?;
        file.write_all(content)?;
        io::Result::Ok(file)
    };
    let mut written = Vec::new();
    for (path, content) in files {
        let file = write(path, content).with_context(|| writing(path))?;
        written.push((path, file));
    }
    for (path, file) in written {
        // The error would keep the temporary file as long as it lives.
        let persisted = file.persist(path).map_err(|refused| refused.error);
        persisted.with_context(|| writing(path))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_nothing_is_left_beside_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.json");
        for content in [&b"one, and long"[..], b"two"] {
            write_whole(&[(path.clone(), content.to_vec())]).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), content);
        }
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_file_that_cannot_be_written_leaves_nothing_behind_nor_those_before_it() {
        let directory = tempfile::tempdir().unwrap();
        let there = directory.path().join("a.json");
        let elsewhere = directory.path().join("not/there/a.csv");
        let files = [(there, b"one".to_vec()), (elsewhere, b"two".to_vec())];
        let error = write_whole(&files).unwrap_err();
        assert!(
            format!("{error:#}").contains("not/there/a.csv"),
            "{error:#}"
        );
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_name_that_is_taken_by_a_directory_is_no_file_to_write() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("taken");
        std::fs::create_dir(&path).unwrap();
        let error = write_whole(&[(path, b"one".to_vec())]).unwrap_err();
        assert!(format!("{error:#}").contains("taken"), "{error:#}");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
