//! What inputs may be named: files, directories of frames, and `-` for standard input.

use super::Fault;
use starpipe::frame::{self, Buffers, Frame, FrameError};
use starpipe::pipeline::Error;
use std::io;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Whether `input` stands for standard input.
pub(crate) fn is_stdin(input: &Path) -> bool {
    input.as_os_str() == "-"
}

/// The frame in the file `input`, or in standard input.
pub(crate) fn read_frame(
    input: &Path,
    page: Option<NonZeroUsize>,
    buffers: &mut Buffers,
) -> Result<Frame, FrameError> {
    if !is_stdin(input) {
        return frame::read_page_with(input, page, buffers);
    }
    frame::read_stream(io::stdin().lock(), page).map_err(|error| error.in_file(input))
}

/// Refuses to read standard input twice.
pub(crate) fn check(inputs: &[PathBuf]) -> Result<(), Fault> {
    if inputs.iter().filter(|input| is_stdin(input)).count() > 1 {
        return Err(Fault::Usage(
            "- stands for standard input, which can be read only once; it is given twice".into(),
        ));
    }
    Ok(())
}

/// The frames that `inputs` stand for, a directory for those in it; and which directories have none.
pub(crate) fn frames(inputs: Vec<PathBuf>) -> (Vec<PathBuf>, Vec<Error>) {
    let mut frames = Vec::new();
    let mut troubles = Vec::new();
    for input in inputs {
        if input.is_dir() {
            match frame::files_in(&input) {
                Ok(found) => frames.extend(found),
                Err(error) => troubles.push(error.into()),
            }
        } else {
            frames.push(input);
        }
    }
    (frames, troubles)
}
