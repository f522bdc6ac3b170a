//! Files of simulated frames.

use super::args::{ImageFormat, SimulateArgs};
use super::header::Description;
use super::subject::FrameSubject;
use crate::cli::exit::CommandError;
use crate::cli::output::files::make_directory;
use starpipe::camera::data_sheet::DataSheet;
use starpipe::frame::{FitsSamples, Frame, TiffOptions, TiffSamples, write_fits, write_tiff};
use std::ffi::OsStr;
use std::io::Cursor;
use std::ops::Range;
use std::path::{Path, PathBuf};

impl ImageFormat {
    const fn extension(self) -> &'static str {
        match self {
            Self::Tiff => "tif",
            Self::Fits => "fits",
        }
    }

    fn of_name(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_lowercase().as_str() {
            "tif" | "tiff" => Some(Self::Tiff),
            "fits" | "fit" | "fts" => Some(Self::Fits),
            _ => None,
        }
    }
}

/// Endings of files of images that are not written: no name of a directory.
const OTHER_IMAGES: [&str; 9] = ["bmp", "fz", "gz", "jpeg", "jpg", "pgm", "png", "pnm", "ppm"];

/// Refuses the name of a file in a format that is not written.
fn check_out(out: &Path) -> Result<(), CommandError> {
    let ending = out.extension().and_then(OsStr::to_str);
    let is_other = |ending: &str| OTHER_IMAGES.contains(&ending.to_lowercase().as_str());
    if out.is_dir() || !ending.is_some_and(is_other) {
        return Ok(());
    }
    Err(CommandError::Usage(format!(
        "--out {}: found a file name with an unsupported format, expected a TIFF (.tif) or \
         FITS (.fits) file, or a directory",
        out.display()
    )))
}

/// Names and format of the files.
pub(super) struct FrameFiles {
    /// The file of a single frame, or the directory of all.
    out: PathBuf,
    is_file: bool,
    stem: &'static str,
    has_truth: bool,
    format: ImageFormat,
    compressed: bool,
    bits: u32,
    numbers: Range<u64>,
    may_overwrite: bool,
}

impl FrameFiles {
    /// The files that the options name.
    pub(super) fn from_arguments(
        arguments: &SimulateArgs,
        subject: &FrameSubject,
        sheet: &DataSheet,
    ) -> Result<Self, CommandError> {
        check_out(&arguments.out)?;
        let named_format = ImageFormat::of_name(&arguments.out).filter(|_| !arguments.out.is_dir());
        if named_format.is_some() && arguments.count > 1 {
            return Err(CommandError::Usage(format!(
                "--out {} is a single file, expected a directory for {} frames",
                arguments.out.display(),
                arguments.count
            )));
        }
        if let (Some(named), Some(wanted)) = (named_format, arguments.image)
            && named != wanted
        {
            return Err(CommandError::Usage(format!(
                "--out {} and --image contradict each other",
                arguments.out.display()
            )));
        }
        let format = named_format
            .or(arguments.image)
            .unwrap_or(ImageFormat::Tiff);
        if arguments.compress && format == ImageFormat::Fits {
            return Err(CommandError::usage(
                "--compress is for TIFF files, but the frames are written as FITS",
            ));
        }
        Ok(Self {
            out: arguments.out.clone(),
            is_file: named_format.is_some(),
            stem: subject.stem(),
            has_truth: subject.has_truth(),
            format,
            compressed: arguments.compress,
            bits: sheet.bits,
            numbers: arguments.first..arguments.first + arguments.count,
            may_overwrite: arguments.force,
        })
    }

    /// Makes the directory. Refuses to overwrite files without `--force`.
    pub(super) fn prepare(&self) -> Result<(), CommandError> {
        if !self.is_file {
            make_directory(&self.out)?;
        }
        let both = |image: PathBuf| {
            let table = self.has_truth.then(|| image.with_extension("csv"));
            table.into_iter().chain([image])
        };
        let mut files = self.numbers().map(|i| self.image(i)).flat_map(both);
        match files.find(|path| !self.may_overwrite && path.exists()) {
            Some(path) => Err(CommandError::Usage(format!(
                "{} exists; --force overwrites it",
                path.display()
            ))),
            None => Ok(()),
        }
    }

    /// Numbers of the frames.
    pub(super) fn numbers(&self) -> Range<u64> {
        self.numbers.clone()
    }

    /// The file of the frame with this number.
    pub(super) fn image(&self, number: u64) -> PathBuf {
        if self.is_file {
            return self.out.clone();
        }
        let extension = self.format.extension();
        self.out
            .join(format!("{}-{number:05}.{extension}", self.stem))
    }

    /// Content of the file of `frame`.
    pub(super) fn encoded(
        &self,
        frame: &Frame,
        description: &Description,
    ) -> anyhow::Result<Vec<u8>> {
        match self.format {
            ImageFormat::Fits => {
                let samples = if self.bits <= 16 {
                    FitsSamples::Unsigned16
                } else {
                    FitsSamples::Float32
                };
                let mut content = Vec::new();
                write_fits(&mut content, frame, samples, &description.fits_header())?;
                Ok(content)
            }
            ImageFormat::Tiff => {
                let samples = match self.bits {
                    ..=8 => TiffSamples::Unsigned8,
                    9..=16 => TiffSamples::Unsigned16,
                    _ => TiffSamples::Float32,
                };
                let mut content = Cursor::new(Vec::new());
                let description = description.text();
                let mut options = TiffOptions::new(samples);
                options.compressed = self.compressed;
                options.description = &description;
                write_tiff(&mut content, frame, &options)?;
                Ok(content.into_inner())
            }
        }
    }
}
