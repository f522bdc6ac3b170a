//! Result files of an input, which `--out` asks for.

use super::images::SolvedImage;
use super::options::OutputOptions;
use crate::cli::input::stdin::is_stdin;
use crate::cli::output::files::{NewFile, failures, make_directory, remove_outdated};
use crate::cli::output::overwrite;
use crate::cli::output::paths::output_path;
use starpipe::catalog::Catalog;
use starpipe::frame::{Buffers, Colors, Frame, ImageName, MemoryLimit, RowOrder};
use starpipe::report::overlay::{self, Shown};
use starpipe::report::{FrameReport, page, regions, sky_figure, tables, wcs};
use std::path::{Path, PathBuf};

/// Writes result files into a directory, if one is given.
pub(super) struct ResultFiles<'a> {
    options: &'a OutputOptions,
    /// For the colors of a frame.
    memory: MemoryLimit,
}

/// An image, and what its result files are made of.
struct Results<'a> {
    directory: &'a Path,
    image: &'a ImageName<'a>,
    solved: &'a SolvedImage,
    report: &'a FrameReport,
}

impl Results<'_> {
    /// The result file with this extension.
    fn path(&self, extension: &str) -> PathBuf {
        output_path(self.directory, self.image.path, self.image.page, extension)
    }
}

impl<'a> ResultFiles<'a> {
    /// Makes the directory, if one is given.
    pub(super) fn new(options: &'a OutputOptions, memory: MemoryLimit) -> anyhow::Result<Self> {
        options.out.as_deref().map(make_directory).transpose()?;
        Ok(Self { options, memory })
    }

    /// Writes the files of `image`, and removes the FITS header of an earlier run if there is none now. Returns
    /// why some could not be made or written.
    pub(super) fn save(
        &self,
        image: &ImageName,
        solved: &SolvedImage,
        report: &FrameReport,
        catalog: &Catalog,
    ) -> Vec<anyhow::Error> {
        let OutputOptions {
            out: Some(directory),
            ..
        } = self.options
        else {
            return Vec::new();
        };
        let of = Results {
            directory,
            image,
            solved,
            report,
        };
        let header = wcs::header(&report.frame, &solved.solution);
        let outdated = header.is_none().then(|| remove_outdated(&of.path("wcs")));
        let header = header.map(|header| Ok((of.path("wcs"), header)));
        let files = self.data(&of).into_iter().chain(header);
        let files = files.chain(self.pictures(&of, catalog));
        let checked = files.map(|file| {
            let (path, content) = file?;
            if image.page.is_some() {
                // How many images an input has was not known when the others were checked.
                overwrite::check_output(&path, &image.to_path())?;
            }
            Ok((path, content))
        });
        let mut failures = failures(checked);
        failures.extend(outdated.and_then(Result::err));
        failures
    }

    /// The files with numbers.
    fn data(&self, of: &Results) -> Vec<anyhow::Result<NewFile>> {
        let Results { solved, report, .. } = of;
        let file = |extension: &str, text: anyhow::Result<String>| {
            Ok((of.path(extension), text?.into_bytes()))
        };
        let json = report.to_json_line().map(|line| line + "\n");
        let mut files = vec![
            file("json", json.map_err(Into::into)),
            file("csv", report.to_csv(true).map_err(Into::into)),
        ];
        for format in self.options.tables() {
            let table = tables::stars(report, &solved.solution, format);
            files.push(Ok((of.path(format.extension()), table)));
        }
        if self.options.regions {
            files.push(file("reg", Ok(regions::ds9(report))));
        }
        let frame = solved.frame.as_ref();
        if let Some(frame) = frame.filter(|_| self.options.write_fits) {
            let copy = wcs::solved_copy(&report.frame, frame, &solved.solution, RowOrder::TopDown);
            let copy = copy.transpose();
            files.extend(copy.map(|copy| Ok((of.path("solved.fits"), copy?))));
        }
        files
    }

    /// The files to look at.
    fn pictures(&self, of: &Results, catalog: &Catalog) -> Vec<anyhow::Result<NewFile>> {
        let Results {
            image,
            solved,
            report,
            ..
        } = of;
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
        let drawn = shown.as_ref().map(|shown| {
            let picture = overlay::encoded(shown, &solved.solution, catalog, &overlay)?;
            Ok((of.path(overlay.format.extension()), picture))
        });
        let page = self.options.html.then(|| {
            let page = page::html(report, &solved.solution, catalog, shown.as_ref(), &overlay)?;
            Ok((of.path("html"), page.into_bytes()))
        });
        let sky = sky_figure::svg(report);
        let sky = sky.map(|figure| Ok((of.path("sky.svg"), figure.into_bytes())));
        drawn.into_iter().chain(page).chain(sky).collect()
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
