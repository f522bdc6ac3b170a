//! What inputs may be named: files, directories of frames, and `-` for standard input.

use super::Fault;
use anyhow::Context;
use starpipe::frame;
use starpipe::pipeline::Error;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Whether `input` stands for standard input.
pub(crate) fn is_stdin(input: &Path) -> bool {
    input.as_os_str() == "-"
}

/// All of standard input.
pub(crate) fn read_stdin() -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    io::stdin()
        .lock()
        .read_to_end(&mut bytes)
        .context("reading -")?;
    Ok(bytes)
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
