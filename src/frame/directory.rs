//! The frames in a directory.

use super::{FrameError, FrameFormat, HEAD_BYTES, format_inside, format_of};
use memchr::memmem;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// The text in a PNG file, keyword and value, by which an overlay is known.
pub(crate) const OVERLAY_TEXT: (&str, &str) = ("Software", "starpipe overlay");

/// The files in `directory` that begin like an image, in the order of their names; directories in it are left out,
/// and so is what was made of frames: overlays ([`is_overlay`]), masters ([`is_calibration_frame`]), and headers without an
/// image (`.wcs`).
///
/// A file of which not even the beginning can be read counts as a frame, so that this is told when it is read.
/// # Errors
/// [`FrameError::File`] with the directory, around [`FrameError::Io`] or [`FrameError::NoFrames`].
pub fn files_in(directory: &Path) -> Result<Vec<PathBuf>, FrameError> {
    let files = all_files_in(directory).map_err(|e| FrameError::from(e).in_file(directory))?;
    let found = files.len();
    let frames: Vec<PathBuf> = files
        .into_iter()
        .filter(|path| begins_like_a_frame(path).unwrap_or(true))
        .collect();
    if frames.is_empty() {
        return Err(FrameError::NoFrames { files: found }.in_file(directory));
    }
    Ok(frames)
}

fn all_files_in(directory: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory)? {
        let path = entry?.path();
        // Opening anything but a file, a pipe for one, might wait for ever.
        if path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// Whether the file that begins with `head` is a picture of a frame with its stars marked, as starpipe draws them.
pub fn is_overlay(head: &[u8]) -> bool {
    let (keyword, text) = OVERLAY_TEXT;
    let chunk = [b"tEXt", keyword.as_bytes(), b"\0", text.as_bytes()].concat();
    format_of(head) == Some(FrameFormat::Png) && memmem::find(head, &chunk).is_some()
}

/// What the keyword CREATOR of a master frame begins with, by which it is known.
pub const CALIBRATION_CREATOR: &str = "starpipe calibration";

/// Whether the file that begins with `head` is a master dark, a master flat or a map of noise, as starpipe writes them.
pub fn is_calibration_frame(head: &[u8]) -> bool {
    let card = format!("CREATOR = '{CALIBRATION_CREATOR}");
    format_of(head) == Some(FrameFormat::Fits) && memmem::find(head, card.as_bytes()).is_some()
}

fn begins_like_a_frame(path: &Path) -> io::Result<bool> {
    if path.extension().is_some_and(|extension| extension == "wcs") {
        return Ok(false);
    }
    let mut head = Vec::new();
    File::open(path)?.take(HEAD_BYTES).read_to_end(&mut head)?;
    Ok(match format_of(&head) {
        Some(FrameFormat::Png) => !is_overlay(&head),
        Some(FrameFormat::Fits) => !is_calibration_frame(&head),
        Some(FrameFormat::Gzip) => format_inside(&head).0.is_some(),
        format => format.is_some(),
    })
}
