//! Names of result files.

use crate::cli::input::stdin::is_stdin;
use std::ffi::OsStr;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// The name of the result files of `input`, without extension.
pub(crate) fn result_stem(input: &Path) -> &OsStr {
    if is_stdin(input) {
        return OsStr::new("stdin");
    }
    input.file_stem().unwrap_or(OsStr::new("frame"))
}

/// The path of the result file of `input` with this extension: of its image `page`, where all of its
/// images are solved.
pub(crate) fn output_path(
    directory: &Path,
    input: &Path,
    page: Option<NonZeroUsize>,
    extension: &str,
) -> PathBuf {
    let mut name = result_stem(input).to_owned();
    if let Some(page) = page {
        name.push(format!("-{page}"));
    }
    name.push(".");
    name.push(extension);
    directory.join(name)
}
