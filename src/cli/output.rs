//! Results on standard output and in files.

use super::args::Format;
use super::settings::output_path;
use anyhow::Context;
use starpipe::report::{FrameReport, TextOptions, write_table_header};
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Where results go, and in which form.
pub(crate) struct OutputSettings {
    pub(crate) format: Format,
    pub(crate) text: TextOptions,
    pub(crate) directory: Option<PathBuf>,
}

/// Writes reports as they come.
pub(crate) struct Output {
    settings: OutputSettings,
    reports: usize,
}

impl Output {
    /// Makes the directory for results, if one is wanted.
    pub(crate) fn new(settings: OutputSettings) -> anyhow::Result<Self> {
        if let Some(directory) = &settings.directory {
            std::fs::create_dir_all(directory)
                .with_context(|| format!("making the directory {}", directory.display()))?;
        }
        Ok(Self {
            settings,
            reports: 0,
        })
    }

    /// Prints `report`. Ends it where nobody listens any longer.
    pub(crate) fn print(&mut self, report: &FrameReport) -> anyhow::Result<ControlFlow<()>> {
        let first = self.reports == 0;
        self.reports += 1;
        let text = self.rendered(report, first)?;
        print(&text)
    }

    /// Writes the files that belong to `report`, if any are wanted.
    pub(crate) fn save(&self, input: &Path, report: &FrameReport) -> anyhow::Result<()> {
        let Some(directory) = &self.settings.directory else {
            return Ok(());
        };
        let json = report.to_json_line()? + "\n";
        write_whole(&output_path(directory, input, "json"), json.as_bytes())?;
        let table = table(report, true)?;
        write_whole(&output_path(directory, input, "csv"), &table)
    }

    fn rendered(&self, report: &FrameReport, first: bool) -> anyhow::Result<String> {
        Ok(match self.settings.format {
            Format::Text if first => report.to_text(self.settings.text),
            Format::Text => format!("\n{}", report.to_text(self.settings.text)),
            Format::Json => report.to_json_line()? + "\n",
            Format::Csv => String::from_utf8(table(report, first)?)?,
        })
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

/// Writes a file whole or not at all: into a temporary file beside it, which then takes its name.
pub(crate) fn write_whole(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    let write = || -> io::Result<()> {
        let directory = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let mut file = new_file_in(directory)?;
        file.write_all(content)?;
        file.persist(path)?;
        Ok(())
    };
    write().with_context(|| format!("writing {}", path.display()))
}

/// A temporary file with the permissions of any other new file, and not those of a secret.
fn new_file_in(directory: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The process's umask takes away from this what the user wants taken away.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(directory)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_nothing_is_left_beside_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.json");
        write_whole(&path, b"one, and long").unwrap();
        write_whole(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_file_that_cannot_be_written_leaves_nothing_behind() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("taken");
        std::fs::create_dir(&path).unwrap();
        let error = write_whole(&path, b"one").unwrap_err();
        assert!(format!("{error:#}").contains("taken"), "{error:#}");
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
