//! Names of files of results.

use crate::cli::input::frames::is_stdin;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// The name under which the results of `input` are written, without its extension.
pub(crate) fn result_stem(input: &Path) -> &OsStr {
    if is_stdin(input) {
        return OsStr::new("stdin");
    }
    input.file_stem().unwrap_or(OsStr::new("frame"))
}

/// The file that holds the results of `input` in one form.
pub(crate) fn output_path(directory: &Path, input: &Path, extension: &str) -> PathBuf {
    let mut name = result_stem(input).to_owned();
    name.push(".");
    name.push(extension);
    directory.join(name)
}
