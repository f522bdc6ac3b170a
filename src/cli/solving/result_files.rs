//! Result files of an input, which `--out` asks for.

use crate::cli::output::files::{make_directory, remove_outdated, write_whole};
use crate::cli::output::overwrite;
use crate::cli::output::paths::output_path;
use crate::cli::output::rows::finished;
use starpipe::frame::Frame;
use starpipe::pipeline::{Solution, Workspace};
use starpipe::report::{FrameReport, overlay, wcs, write_table_header};
use starpipe::sky::catalog::Catalog;
use std::borrow::Cow;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// An image of an input.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Image<'a> {
    pub(crate) path: &'a Path,
    /// Its number from 1, where all images of the input are solved.
    pub(crate) page: Option<NonZeroUsize>,
}

impl<'a> Image<'a> {
    /// The only image of an input that is solved.
    pub(crate) fn of(path: &'a Path) -> Self {
        Self { path, page: None }
    }

    /// `night.fits`, or `night.fits[2]`.
    pub(crate) fn name(&self) -> Cow<'a, Path> {
        let Some(page) = self.page else {
            return Cow::Borrowed(self.path);
        };
        let mut name = self.path.as_os_str().to_owned();
        name.push(format!("[{page}]"));
        Cow::Owned(name.into())
    }
}

/// A solved input.
pub(crate) struct Solved {
    pub(crate) solution: Solution,
    /// The frame to draw on, if there is one.
    pub(crate) frame: Option<Frame<'static>>,
}

impl Solved {
    /// Reuses the frame's buffers: frames are large.
    pub(crate) fn recycle_frame(&mut self, workspace: &mut Workspace) {
        if let Some(frame) = self.frame.take() {
            workspace.frames.recycle(frame);
        }
    }
}

/// Writes result files into a directory, if one is given.
pub(super) struct ResultFiles {
    directory: Option<PathBuf>,
}

impl ResultFiles {
    /// Makes the directory, if one is given.
    pub(super) fn new(directory: Option<PathBuf>) -> anyhow::Result<Self> {
        directory.as_deref().map(make_directory).transpose()?;
        Ok(Self { directory })
    }

    /// Writes the files of `image`, all or none, and removes the FITS header of an earlier run if
    /// there is none now.
    pub(super) fn save(
        &self,
        image: Image,
        solved: &Solved,
        report: &FrameReport,
        catalog: &Catalog,
    ) -> anyhow::Result<()> {
        let Some(directory) = &self.directory else {
            return Ok(());
        };
        let path = |extension: &str| output_path(directory, image.path, image.page, extension);
        let json = report.to_json_line()? + "\n";
        let mut files = vec![
            (path("json"), json.into_bytes()),
            (path("csv"), table(report, true)?.into_bytes()),
        ];
        if let Some(frame) = &solved.frame {
            let name = image.name();
            let title = name.file_name().unwrap_or(name.as_os_str());
            let title = title.to_string_lossy();
            let picture = overlay::draw(&title, frame, &solved.solution, catalog);
            files.push((path("png"), overlay::to_png(&picture)?));
        }
        let header = wcs::header(&report.frame, &solved.solution);
        let has_header = header.is_some();
        files.extend(header.map(|header| (path("wcs"), header)));
        if image.page.is_some() {
            // How many images an input has was not known when the others were checked.
            for (path, _) in &files {
                overwrite::check_output(path, &image.name())?;
            }
        }
        write_whole(&files)?;
        if !has_header {
            remove_outdated(&path("wcs"))?;
        }
        Ok(())
    }
}

/// The stars of `report` as CSV.
pub(super) fn table(report: &FrameReport, with_header: bool) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    if with_header {
        write_table_header(&mut writer)?;
    }
    report.write_table_rows(&mut writer)?;
    finished(writer)
}
