//! What may be overwritten: results of an earlier run, and nothing else.

use super::paths::{output_path, result_stem};
use crate::cli::exit::CommandError;
use anyhow::bail;
use starpipe::base::files;
use starpipe::frame;
use starpipe::report::{figure, overlay, page, regions, tables, wcs};
use std::collections::{HashMap, HashSet};
use std::ffi::OsStr;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// This much of a file shows whether it is a result: the longest header has fewer bytes.
const HEAD_BYTES: u64 = 1 << 16;

const OTHER_DIRECTORY: &str = "choose another directory for --out";

/// Refuses inputs whose results would overwrite each other, an input, or a file that is not a
/// result.
pub(crate) fn check(
    inputs: &[PathBuf],
    directory: &Path,
    extensions: &[&str],
) -> Result<(), CommandError> {
    check_names_differ(inputs, directory)?;
    let inputs_found = found(inputs);
    for input in inputs {
        let results = format!("the results of {}", input.display());
        for extension in extensions {
            check_result(
                &output_path(directory, input, None, extension),
                &inputs_found,
                &results,
            )?;
        }
    }
    Ok(())
}

/// Refuses `results` that would overwrite an input, or a file that is not a result.
pub(crate) fn check_results(inputs: &[PathBuf], results: &[PathBuf]) -> Result<(), CommandError> {
    let inputs_found = found(inputs);
    results
        .iter()
        .try_for_each(|result| check_result(result, &inputs_found, "the results"))
}

/// Refuses to overwrite the file `output` with the results of `input`, unless it is such a result.
pub(crate) fn check_output(output: &Path, input: &Path) -> anyhow::Result<()> {
    let results = format!("the results of {}", input.display());
    match refusal(output, &HashSet::new(), &results, OTHER_DIRECTORY) {
        Some(refusal) => bail!(refusal),
        None => Ok(()),
    }
}

/// Refuses a `page` that would overwrite an input, or a file that is not such a page.
pub(crate) fn check_page(inputs: &[PathBuf], page: &Path) -> Result<(), CommandError> {
    let advice = "give the page another name with --html=FILE";
    let refusal = refusal(page, &found(inputs), "the page", advice);
    refusal.map_or(Ok(()), |refusal| Err(CommandError::Usage(refusal)))
}

/// The inputs that exist, with links resolved.
fn found(inputs: &[PathBuf]) -> HashSet<PathBuf> {
    inputs
        .iter()
        .filter_map(|input| input.canonicalize().ok())
        .collect()
}

fn check_result(
    output: &Path,
    inputs_found: &HashSet<PathBuf>,
    results: &str,
) -> Result<(), CommandError> {
    let refusal = refusal(output, inputs_found, results, OTHER_DIRECTORY);
    refusal.map_or(Ok(()), |refusal| Err(CommandError::Usage(refusal)))
}

/// Why `results` may not be written to `output`, and what to do.
fn refusal(
    output: &Path,
    inputs_found: &HashSet<PathBuf>,
    results: &str,
    advice: &str,
) -> Option<String> {
    let existing = output.canonicalize().ok()?;
    let extension = output.extension().and_then(OsStr::to_str);
    let what = if inputs_found.contains(&existing) {
        "the input"
    } else if is_result(&existing, extension.unwrap_or_default()) {
        return None;
    } else {
        "a file that starpipe did not write:"
    };
    Some(format!(
        "{results} would overwrite {what} {}; {advice}",
        output.display(),
    ))
}

fn check_names_differ(inputs: &[PathBuf], directory: &Path) -> Result<(), CommandError> {
    let mut taken: HashMap<&OsStr, &Path> = HashMap::new();
    for input in inputs {
        if let Some(other) = taken.insert(result_stem(input), input) {
            return Err(CommandError::Usage(format!(
                "the results of {} and {} would both be written to {}; process them into different directories",
                other.display(),
                input.display(),
                output_path(directory, input, None, "json").display(),
            )));
        }
    }
    Ok(())
}

/// Whether both paths lead to the same file, which exists.
pub(crate) fn is_same_file(a: &Path, b: &Path) -> bool {
    let found = a.canonicalize();
    found.is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}

/// Whether `path` is a regular file that is a result of this kind, or empty. Unreadable files are
/// not.
fn is_result(path: &Path, extension: &str) -> bool {
    let head = || -> io::Result<Vec<u8>> {
        let mut head = Vec::new();
        files::open(path)?.take(HEAD_BYTES).read_to_end(&mut head)?;
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
        "fits" => {
            frame::is_calibration_frame(head) || frame::is_copy(head) || frame::is_table(head)
        }
        "corr" | "rdls" => frame::is_table(head),
        "vot" | "ecsv" => tables::is_text_table(head),
        "png" | "jpg" => frame::is_overlay(head),
        "svg" => overlay::is_svg(head) || figure::is_figure(head),
        "html" | "htm" => page::is_page(head),
        "reg" => head.starts_with(regions::FIRST_LINE.as_bytes()),
        _ => wcs::is_header(head),
    }
}
