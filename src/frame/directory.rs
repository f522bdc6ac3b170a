//! The frames in a directory.

use super::compressed::format_inside;
use super::error::FrameError;
use super::format::FrameFormat;
use super::limits::HEAD_BYTES;
use super::other_file::OtherFile;
use super::unsupported_formats;
use crate::base::files;
use memchr::memmem;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Keyword and value of the PNG text that marks an overlay; the value is the comment of a JPEG.
pub(crate) const OVERLAY_TEXT: (&str, &str) = ("Software", "starpipe overlay");

/// The files in `directory` that begin like an image or are named as one, sorted by name.
///
/// Left out are subdirectories, hidden files, and products of starpipe: overlays ([`is_overlay`]), calibration
/// frames ([`is_calibration_frame`]), copies of frames ([`is_copy`]), tables ([`is_table`]) and headers without an image (`.wcs`). A file that cannot be
/// opened or is empty or damaged is listed, so that reading it reports the error.
/// # Errors
/// [`FrameError::File`] with the directory and [`FrameError::Io`] or [`FrameError::NoFrames`]; without
/// frames, with the first file in a format that is not read and [`FrameError::ForeignFormat`].
pub fn files_in(directory: &Path) -> Result<Vec<PathBuf>, FrameError> {
    let files = all_files_in(directory).map_err(|e| FrameError::from(e).in_file(directory))?;
    let is_frame = |path: &&PathBuf| other_kind(path).is_none();
    let frames: Vec<PathBuf> = files.iter().filter(is_frame).cloned().collect();
    if !frames.is_empty() {
        return Ok(frames);
    }
    Err(unsupported_file(&files).unwrap_or_else(|| {
        let nothing = FrameError::NoFrames { files: files.len() };
        nothing.in_file(directory)
    }))
}

/// The error of the first file in a format that is known but not read.
pub(super) fn unsupported_file(files: &[PathBuf]) -> Option<FrameError> {
    files.iter().find_map(|path| {
        let known = unsupported_formats::detect(&head_of(path).ok()?)?;
        Some(FrameError::from(known).in_file(path))
    })
}

pub(super) fn head_of(path: &Path) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    files::open(path)?.take(HEAD_BYTES).read_to_end(&mut head)?;
    Ok(head)
}

pub(super) fn all_files_in(directory: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory)? {
        let path = entry?.path();
        // Opening anything else, such as a pipe, may block.
        if path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// Whether the file that begins with `head` is an overlay: a frame with its stars marked, drawn by
/// starpipe.
pub fn is_overlay(head: &[u8]) -> bool {
    let (keyword, text) = OVERLAY_TEXT;
    let mark = match FrameFormat::detect(head) {
        Some(FrameFormat::Png) => [b"tEXt", keyword.as_bytes(), b"\0", text.as_bytes()].concat(),
        // A comment.
        Some(FrameFormat::Jpeg) => {
            [&[0xff, 0xfe, 0, text.len() as u8 + 2], text.as_bytes()].concat()
        }
        _ => return false,
    };
    memmem::find(head, &mark).is_some()
}

/// Beginning of the CREATOR keyword that marks a calibration frame.
pub const CALIBRATION_CREATOR: &str = "starpipe calibration";

/// Whether the file that begins with `head` is a master dark, a master flat or a noise map written
/// by starpipe.
pub fn is_calibration_frame(head: &[u8]) -> bool {
    is_created_by(head, CALIBRATION_CREATOR)
}

/// Beginning of the CREATOR keyword that marks the copy of a frame.
pub const COPY_CREATOR: &str = "starpipe copy";

/// Whether the file that begins with `head` is a copy of a frame, written by starpipe.
pub fn is_copy(head: &[u8]) -> bool {
    is_created_by(head, COPY_CREATOR)
}

/// Beginning of the CREATOR keyword that marks a table.
pub const TABLE_CREATOR: &str = "starpipe table";

/// Whether the file that begins with `head` is a table in FITS, written by starpipe.
pub fn is_table(head: &[u8]) -> bool {
    is_created_by(head, TABLE_CREATOR)
}

fn is_created_by(head: &[u8], creator: &str) -> bool {
    let card = format!("CREATOR = '{creator}");
    FrameFormat::detect(head) == Some(FrameFormat::Fits)
        && memmem::find(head, card.as_bytes()).is_some()
}

/// Whether a file is named as an image of a format that is read.
fn is_named_as_an_image(path: &Path) -> bool {
    has_extension(
        path,
        &[
            "fits", "fit", "fts", "fz", "tif", "tiff", "png", "jpg", "jpeg", "bmp", "pgm",
        ],
    )
}

/// Whether a file is named as a video: one that is not finished may have no signature.
fn is_named_as_a_video(path: &Path) -> bool {
    has_extension(
        path,
        &[
            "mp4", "mov", "m4v", "avi", "mkv", "webm", "mpg", "mpeg", "ser", "vid",
        ],
    )
}

fn has_extension(path: &Path, known: &[&str]) -> bool {
    let extension = path.extension().unwrap_or_default();
    known
        .iter()
        .any(|known| extension.eq_ignore_ascii_case(known))
}

/// What a file is by its name and first bytes, if it is no image that is read; `None` for one that cannot be
/// opened, so that reading it reports why.
pub(super) fn other_kind(path: &Path) -> Option<OtherFile> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if name.starts_with('.') {
        return Some(OtherFile::Hidden);
    }
    if path.extension().is_some_and(|extension| extension == "wcs") {
        return Some(OtherFile::Product);
    }
    let head = head_of(path).ok()?;
    let (is_image, is_product) = match FrameFormat::detect(&head) {
        Some(FrameFormat::Png | FrameFormat::Jpeg) => (true, is_overlay(&head)),
        Some(FrameFormat::Fits) => {
            let is_product = is_calibration_frame(&head) || is_copy(&head) || is_table(&head);
            (true, is_product)
        }
        Some(format) if format.is_compressed() => {
            let (known, inside) = format_inside(&head, format);
            // As in `night.fits.bz2`.
            let inner = path.file_stem().map(Path::new);
            let is_named = inside.is_empty() && inner.is_some_and(is_named_as_an_image);
            (known.is_some() || is_named, false)
        }
        format => (format.is_some() || is_named_as_an_image(path), false),
    };
    match (is_image, is_product) {
        (_, true) => Some(OtherFile::Product),
        (true, false) => None,
        (false, false) => Some(match unsupported_formats::detect(&head) {
            Some(known) if known.is_video() => OtherFile::Video,
            Some(_) => OtherFile::OtherFormat,
            None if is_named_as_a_video(path) => OtherFile::Video,
            None => OtherFile::NoImage,
        }),
    }
}
