//! Names of many frames: directories, patterns, lists.

use super::stdin::is_stdin;
use crate::cli::output::messages::report;
use anyhow::{Context, anyhow, bail};
use starpipe::base::files;
use starpipe::base::format::counted_as;
use starpipe::frame::{Cameras, Folder, OtherFile, PassedOver};
use starpipe::store::names_in;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

/// Largest size of a list: some ten million names.
const MAX_BYTES: u64 = 1 << 30;

/// Extensions of lists of names, one a line.
const LISTS: [&str; 2] = ["txt", "lst"];

/// The frames that `inputs` name: frames themselves, directories of them, patterns such as
/// `night/**/*.fits`, lists, and `-` for a list on standard input; and what is no frame of the sky in directories
/// and patterns, which is told.
pub(crate) fn frame_names(
    inputs: &[PathBuf],
    cameras: Cameras,
) -> anyhow::Result<(Vec<String>, Vec<PassedOver>)> {
    let mut names = Vec::new();
    let mut passed_over = Vec::new();
    let mut add = |folder: Folder, names: &mut Vec<String>| {
        passed_over.extend(folder.passed_over);
        for path in &folder.frames {
            names.push(name_of(path)?);
        }
        anyhow::Ok(())
    };
    for input in inputs {
        if is_stdin(input) {
            let bytes = files::read_stream(io::stdin().lock(), MAX_BYTES);
            let text = bytes.and_then(files::text_of);
            let text = text.context("reading a list of frames from standard input")?;
            add_lines(&text, &mut names);
        } else if input.is_dir() {
            add(Folder::read(input, cameras)?, &mut names)?;
        } else if is_pattern(input) {
            add(Folder::sorted(matching(input)?, cameras), &mut names)?;
        } else {
            add_file(input, &mut names)?;
        }
    }
    if let Some(name) = names.iter().find(|name| name.contains('\n')) {
        bail!("a line break in the name {name:?}: such a frame cannot be listed");
    }
    report_passed_over(&passed_over);
    Ok((names, passed_over))
}

/// The files that match a pattern.
fn matching(pattern: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let reading = || format!("reading the list of frames {}", pattern.display());
    let found = glob::glob(&name_of(pattern)?).with_context(reading)?;
    found
        .filter(|path| !path.as_ref().is_ok_and(|path| path.is_dir()))
        .map(|path| path.with_context(reading))
        .collect()
}

/// Tells how many files of each kind are no frames of the sky, and the first of each.
pub(crate) fn report_passed_over(files: &[PassedOver]) {
    let mut by_kind: BTreeMap<OtherFile, Vec<&Path>> = BTreeMap::new();
    for file in files {
        by_kind.entry(file.kind).or_default().push(&file.path);
    }
    for (kind, paths) in by_kind {
        let others = if paths.len() > 1 { " and others" } else { "" };
        let count = counted_as(paths.len(), kind.text());
        report(format_args!(
            "skipped {count}: {}{others}",
            paths[0].display()
        ));
    }
}

fn add_file(input: &Path, names: &mut Vec<String>) -> anyhow::Result<()> {
    let extension = input.extension().and_then(|extension| extension.to_str());
    let reading = || format!("reading the list of frames {}", input.display());
    match extension {
        Some("parquet") => names.extend(names_in(input)?),
        Some(extension) if LISTS.contains(&extension) => {
            add_lines(
                &files::read_text(input, MAX_BYTES).with_context(reading)?,
                names,
            );
        }
        _ => names.push(name_of(input)?),
    }
    Ok(())
}

fn is_pattern(input: &Path) -> bool {
    !input.exists() && input.to_string_lossy().contains(['*', '?', '['])
}

fn add_lines(text: &str, names: &mut Vec<String>) {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    names.extend(lines.map(unquoted).map(str::to_owned));
}

/// A name without the quotation marks that file managers copy with it, unless they belong to it.
fn unquoted(line: &str) -> &str {
    let inside = ['"', '\'']
        .into_iter()
        .find_map(|mark| line.strip_prefix(mark)?.strip_suffix(mark));
    match inside {
        Some(name) if !name.is_empty() && !Path::new(line).exists() => name,
        _ => line,
    }
}

fn name_of(path: &Path) -> anyhow::Result<String> {
    let name = path.to_str();
    let name = name.ok_or_else(|| anyhow!("the name of {} is not UTF-8", path.display()))?;
    Ok(name.to_owned())
}
