//! The kinds of file that can be read, and why one could not be.

use super::{MAX_PIXELS, MIN_SIDE_PX};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// What a file may be.
const FORMATS: &str = "FITS, TIFF, PNG, JPEG, BMP or PGM";

/// The kinds of file that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameFormat {
    /// Flexible Image Transport System.
    Fits,
    /// Tagged Image File Format, also BigTIFF.
    Tiff,
    /// Portable Network Graphics.
    Png,
    /// JPEG (JFIF or Exif).
    Jpeg,
    /// Windows bitmap.
    Bmp,
    /// Portable anymap: PBM, PGM, PPM or PAM.
    Pnm,
    /// Any of the others, compressed with gzip.
    Gzip,
}

impl std::fmt::Display for FrameFormat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Fits => "FITS",
            Self::Tiff => "TIFF",
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Bmp => "BMP",
            Self::Pnm => "PNM",
            Self::Gzip => "gzip",
        })
    }
}

/// Why a frame could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// Something is wrong with a file.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: Box<FrameError>,
    },
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    /// There are no bytes.
    #[error("empty: found 0 bytes, expected an image ({FORMATS})")]
    Empty,
    /// The first bytes are of no known image format.
    #[error("not an image: found {found} at byte 0, expected {FORMATS}")]
    UnknownFormat {
        /// The first bytes, as text where they are text.
        found: String,
    },
    /// The data end before the image does.
    #[error("truncated {format}: found {found_bytes} bytes, expected more ({detail})")]
    Truncated {
        /// The kind of file.
        format: FrameFormat,
        /// The bytes there are.
        found_bytes: usize,
        /// What was being read.
        detail: String,
    },
    /// The data break the format's rules.
    #[error("damaged {format}: {detail}")]
    Malformed {
        /// The kind of file.
        format: FrameFormat,
        /// What was found, and where.
        detail: String,
    },
    /// A valid file of a kind that is not supported.
    #[error("unsupported {format}: found {found}, expected {expected}")]
    Unsupported {
        /// The kind of file.
        format: FrameFormat,
        /// What the file holds.
        found: String,
        /// What is supported.
        expected: &'static str,
    },
    /// More pixels than [`MAX_PIXELS`].
    #[error("too large: found {width} x {height} pixels, expected at most {MAX_PIXELS} in all")]
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// More bytes than the largest frame has.
    #[error("too large: found more than {limit} bytes, expected at most so many")]
    TooManyBytes {
        /// The most bytes of a file.
        limit: u64,
    },
    /// A side shorter than [`MIN_SIDE_PX`].
    #[error(
        "too small: found {width} x {height} pixels, expected at least {MIN_SIDE_PX} on each side"
    )]
    TooSmall {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The number of pixels is not width times height.
    #[error("found {found} pixels, expected {expected} (width times height)")]
    WrongLength {
        /// Width times height.
        expected: usize,
        /// The pixels there are.
        found: usize,
    },
    /// No pixel has a value.
    #[error("no pixel has a value: found only NaN or infinity, expected numbers")]
    NoValues,
    /// The file has fewer images than the page asked for.
    #[error("no page {page}: found {}, expected at least {page}", pages_found(*pages))]
    NoSuchPage {
        /// The page asked for, counted from 1.
        page: NonZeroUsize,
        /// The pages there are.
        pages: usize,
    },
    /// No file in a directory begins like an image.
    #[error("a directory without frames: found {} in it, expected {FORMATS}", files_found(*files))]
    NoFrames {
        /// The files there are.
        files: usize,
    },
}

impl FrameError {
    /// The same, with the file in which it is.
    pub fn in_file(self, path: &Path) -> Self {
        Self::File {
            path: path.to_path_buf(),
            source: Box::new(self),
        }
    }
}

fn pages_found(pages: usize) -> String {
    format!("{pages} page{}", if pages == 1 { "" } else { "s" })
}

fn files_found(files: usize) -> String {
    match files {
        0 => "no file".to_owned(),
        1 => "1 file that is no image".to_owned(),
        _ => format!("{files} files that are no images"),
    }
}
