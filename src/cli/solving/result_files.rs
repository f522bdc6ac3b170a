//! Result files of an input, which `--out` asks for.

use super::images::Solved;
use super::options::OutputOptions;
use crate::cli::input::stdin::is_stdin;
use crate::cli::output::files::{make_directory, remove_outdated, write_whole};
use crate::cli::output::overwrite;
use crate::cli::output::paths::output_path;
use starpipe::frame::{Buffers, Colors, Frame, ImageName, MemoryLimit, RowOrder};
use starpipe::report::overlay::{self, Shown};
use starpipe::report::{FrameReport, page, regions, sky_figure, tables, wcs};
use starpipe::sky::catalog::Catalog;

/// Writes result files into a directory, if one is given.
pub(super) struct ResultFiles<'a> {
    options: &'a OutputOptions,
    /// For the colors of a frame.
    memory: MemoryLimit,
}

impl<'a> ResultFiles<'a> {
    /// Makes the directory, if one is given.
    pub(super) fn new(options: &'a OutputOptions, memory: MemoryLimit) -> anyhow::Result<Self> {
        options.out.as_deref().map(make_directory).transpose()?;
        Ok(Self { options, memory })
    }

    /// Writes the files of `image`, all or none, and removes the FITS header of an earlier run if
    /// there is none now.
    pub(super) fn save(
        &self,
        image: &ImageName,
        solved: &Solved,
        report: &FrameReport,
        catalog: &Catalog,
    ) -> anyhow::Result<()> {
        let OutputOptions {
            out: Some(directory),
            ..
        } = self.options
        else {
            return Ok(());
        };
        let path = |extension: &str| output_path(directory, image.path, image.page, extension);
        let json = report.to_json_line()? + "\n";
        let mut files = vec![
            (path("json"), json.into_bytes()),
            (path("csv"), report.to_csv(true)?.into_bytes()),
        ];
        let name = image.to_path();
        let title = name.file_name().unwrap_or(name.as_os_str());
        let title = title.to_string_lossy();
        let frame = solved.frame.as_ref();
        let overlay = self.options.overlay.options();
        let colors = frame
            .filter(|_| overlay.has_colors())
            .and_then(|frame| self.colors(image, frame));
        let shown = frame.map(|frame| {
            let mut shown = Shown::new(&title, frame);
            shown.colors = colors.as_ref();
            shown
        });
        if let Some(shown) = &shown {
            let picture = overlay::encoded(shown, &solved.solution, catalog, &overlay)?;
            files.push((path(overlay.format.extension()), picture));
        }
        if self.options.html {
            let page = page::html(report, &solved.solution, shown.as_ref(), &overlay)?;
            files.push((path("html"), page.into_bytes()));
        }
        for format in self.options.tables() {
            let table = tables::stars(report, &solved.solution, format);
            files.push((path(format.extension()), table));
        }
        let sky = sky_figure::svg(report);
        files.extend(sky.map(|figure| (path("sky.svg"), figure.into_bytes())));
        if self.options.regions {
            files.push((path("reg"), regions::ds9(report).into_bytes()));
        }
        if let Some(frame) = frame.filter(|_| self.options.write_fits) {
            let copy = wcs::solved_copy(&report.frame, frame, &solved.solution, RowOrder::TopDown)?;
            files.extend(copy.map(|copy| (path("solved.fits"), copy)));
        }
        let header = wcs::header(&report.frame, &solved.solution);
        let has_header = header.is_some();
        files.extend(header.map(|header| (path("wcs"), header)));
        if image.page.is_some() {
            // How many images an input has was not known when the others were checked.
            for (path, _) in &files {
                overwrite::check_output(path, &image.to_path())?;
            }
        }
        write_whole(&files)?;
        if !has_header {
            remove_outdated(&path("wcs"))?;
        }
        Ok(())
    }

    /// The colors of an image, if it is the only one of a file.
    fn colors(&self, image: &ImageName, frame: &Frame) -> Option<Colors> {
        if image.page.is_some() || is_stdin(image.path) {
            return None;
        }
        let mut buffers = Buffers::new();
        buffers.set_memory(self.memory);
        Colors::read(image.path, frame, &mut buffers)
    }
}
