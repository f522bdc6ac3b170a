//! What `--out` may write over: results of an earlier run, and nothing else.

use super::paths::{output_path, result_stem};
use crate::cli::exit::CommandError;
use starpipe::frame;
use std::collections::{HashMap, HashSet};
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// As much of a file tells whether it is a result: the longest header has fewer bytes.
const HEAD_BYTES: u64 = 1 << 16;

/// Refuses inputs whose results would overwrite each other, one of the inputs, or a file that is no result.
pub(crate) fn check(
    inputs: &[PathBuf],
    directory: &Path,
    extensions: &[&str],
) -> Result<(), CommandError> {
    check_each_other(inputs, directory)?;
    let inputs_found: HashSet<PathBuf> = inputs
        .iter()
        .filter_map(|i| i.canonicalize().ok())
        .collect();
    for input in inputs {
        for extension in extensions {
            let output = output_path(directory, input, extension);
            let Ok(there) = output.canonicalize() else {
                continue;
            };
            let what = if inputs_found.contains(&there) {
                "the input"
            } else if is_result(&there, extension) {
                continue;
            } else {
                "a file that starpipe did not write:"
            };
            return Err(CommandError::Usage(format!(
                "the results of {} would overwrite {what} {}; choose another directory for --out",
                input.display(),
                output.display(),
            )));
        }
    }
    Ok(())
}

/// Refuses to write `results` over one of the inputs, or over a file that is no result.
pub(crate) fn check_results(inputs: &[PathBuf], results: &[PathBuf]) -> Result<(), CommandError> {
    let inputs_found: HashSet<PathBuf> = inputs
        .iter()
        .filter_map(|i| i.canonicalize().ok())
        .collect();
    for output in results {
        let Ok(there) = output.canonicalize() else {
            continue;
        };
        let extension = output.extension().and_then(OsStr::to_str);
        let what = if inputs_found.contains(&there) {
            "the input"
        } else if is_result(&there, extension.unwrap_or_default()) {
            continue;
        } else {
            "a file that starpipe did not write:"
        };
        return Err(CommandError::Usage(format!(
            "the results would overwrite {what} {}; choose another directory for --out",
            output.display(),
        )));
    }
    Ok(())
}

fn check_each_other(inputs: &[PathBuf], directory: &Path) -> Result<(), CommandError> {
    let mut taken: HashMap<&OsStr, &Path> = HashMap::new();
    for input in inputs {
        if let Some(other) = taken.insert(result_stem(input), input) {
            return Err(CommandError::Usage(format!(
                "the results of {} and {} would both be written to {}; process them into different directories",
                other.display(),
                input.display(),
                output_path(directory, input, "json").display(),
            )));
        }
    }
    Ok(())
}

/// Whether `path` is a result of this form, or empty. Anything but a regular file is not, and one that cannot be read.
fn is_result(path: &Path, extension: &str) -> bool {
    let head = || -> io::Result<Vec<u8>> {
        let mut head = Vec::new();
        File::open(path)?.take(HEAD_BYTES).read_to_end(&mut head)?;
        Ok(head)
    };
    if !fs::metadata(path).is_ok_and(|found| found.is_file()) {
        return false;
    }
    head().is_ok_and(|head| head.is_empty() || begins_like_a_result(&head, extension))
}

fn begins_like_a_result(head: &[u8], extension: &str) -> bool {
    match extension {
        "json" => head.starts_with(b"{\"schema\":"),
        "csv" => head.starts_with(b"frame,x,y,") || head.starts_with(b"x,y,level_adu,"),
        "fits" => frame::is_calibration_frame(head),
        "png" => frame::is_overlay(head),
        _ => starpipe::report::wcs::is_header(head),
    }
}
