//! The frames in a directory.

use super::{FrameError, FrameFormat, format_inside, format_of};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// What has to be read of a file to tell whether it is a frame; a gzip file can hold a long name before its data.
const HEAD_BYTES: u64 = 4096;

/// The files in `directory` that begin like an image, in the order of their names; directories in it are left out.
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

fn begins_like_a_frame(path: &Path) -> io::Result<bool> {
    let mut head = Vec::new();
    File::open(path)?.take(HEAD_BYTES).read_to_end(&mut head)?;
    Ok(match format_of(&head) {
        Some(FrameFormat::Gzip) => format_inside(&head).0.is_some(),
        format => format.is_some(),
    })
}
