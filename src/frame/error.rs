//! Errors of reading frames.

use super::format::FrameFormat;
use super::limits::{MAX_PIXELS, MIN_SIDE_PX};
use crate::base::interrupt::Interrupted;
use crate::base::panics::Panicked;
use crate::base::remedy::Remedy;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// The formats, as error messages list them.
const FORMATS: &str = "FITS, TIFF, PNG, JPEG, BMP or PGM";

/// Error of reading a frame.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// An error in a file.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The error.
        source: Box<FrameError>,
    },
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    /// The file is empty.
    #[error("empty: found 0 bytes, expected an image ({FORMATS})")]
    Empty,
    /// The first bytes match no known image format.
    #[error("not an image: found {found} at byte 0, expected {FORMATS}")]
    UnknownFormat {
        /// The first bytes, as text if they are text.
        found: String,
    },
    /// An image in a format that is not read.
    #[error("found {found}, expected {FORMATS}: {advice}")]
    ForeignFormat {
        /// The format, with an article.
        found: &'static str,
        /// What to convert it to, and how.
        advice: &'static str,
    },
    /// The data end before the image is complete.
    #[error("truncated {format}: found {found_bytes} bytes, expected more ({detail})")]
    Truncated {
        /// The format.
        format: FrameFormat,
        /// Size of the data, in bytes.
        found_bytes: usize,
        /// What was being read.
        detail: String,
    },
    /// The data violate the format.
    #[error("damaged {format}: {detail}")]
    Malformed {
        /// The format.
        format: FrameFormat,
        /// What is wrong, and where.
        detail: String,
    },
    /// A valid file with a feature that is not supported.
    #[error("unsupported {format}: found {found}, expected {expected}")]
    Unsupported {
        /// The format.
        format: FrameFormat,
        /// The feature.
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
    /// An image that needs more memory than a frame may take.
    #[error(
        "too large: {width} x {height} pixels of this kind need {} MB of memory, expected at most {} MB",
        .needed_bytes.div_ceil(1_000_000), .limit_bytes / 1_000_000
    )]
    TooMuchMemory {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// What it needs.
        needed_bytes: u64,
        /// What it may take.
        limit_bytes: u64,
    },
    /// A content that needs more memory than a frame may take.
    #[error(
        "too large: its content needs {} MB of memory or more, expected at most {} MB",
        .needed_bytes.div_ceil(1_000_000), .limit_bytes / 1_000_000
    )]
    OutOfMemory {
        /// What it needs so far.
        needed_bytes: u64,
        /// What it may take.
        limit_bytes: u64,
    },
    /// The work was ended early.
    #[error("not finished within the time limit per frame")]
    Interrupted(#[from] Interrupted),
    /// More bytes than the largest frame needs.
    #[error("too large: found more than {limit} bytes, expected at most {limit}")]
    TooManyBytes {
        /// Maximum size, in bytes.
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
        /// Number of pixels.
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
        /// Number of pages in the file.
        pages: usize,
    },
    /// A decoder has a bug.
    #[error("{0}")]
    Panicked(#[from] Panicked),
    /// A directory without frames.
    #[error("a directory without frames: found {} in it, expected {FORMATS}", files_found(*files))]
    NoFrames {
        /// Number of files in it.
        files: usize,
    },
}

impl FrameError {
    /// The options that may help.
    pub fn remedies(&self) -> &'static [Remedy] {
        match self {
            Self::File { source, .. } => source.remedies(),
            Self::TooMuchMemory { .. } | Self::OutOfMemory { .. } => &[Remedy::MaxMemory],
            Self::Interrupted(_) => &[Remedy::TimeLimit],
            _ => &[],
        }
    }

    /// Wraps the error in [`FrameError::File`] with the path of its file.
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
        1 => "1 file that is not an image".to_owned(),
        _ => format!("{files} files that are not images"),
    }
}
