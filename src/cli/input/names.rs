//! Names of many frames: directories, patterns, lists.

use super::stdin::is_stdin;
use anyhow::{Context, anyhow, bail};
use starpipe::archive::names_in;
use starpipe::base::files;
use starpipe::frame;
use std::io;
use std::path::{Path, PathBuf};

/// Largest size of a list: some ten million names.
const MAX_BYTES: u64 = 1 << 30;

/// Extensions of lists of names, one a line.
const LISTS: [&str; 2] = ["txt", "lst"];

/// The frames that `inputs` name: frames themselves, directories of them, patterns such as
/// `night/**/*.fits`, lists, and `-` for a list on standard input.
pub(crate) fn frame_names(inputs: &[PathBuf]) -> anyhow::Result<Vec<String>> {
    let mut names = Vec::new();
    for input in inputs {
        if is_stdin(input) {
            let bytes = files::read_stream(io::stdin().lock(), MAX_BYTES);
            let text = bytes.and_then(files::text_of);
            let text = text.context("reading a list of frames from standard input")?;
            add_lines(&text, &mut names);
        } else if input.is_dir() {
            for path in frame::files_in(input)? {
                names.push(name_of(&path)?);
            }
        } else {
            add_file(input, &mut names)?;
        }
    }
    if let Some(name) = names.iter().find(|name| name.contains('\n')) {
        bail!("a line break in the name {name:?}: such a frame cannot be listed");
    }
    Ok(names)
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
        _ if is_pattern(input) => {
            for path in glob::glob(&name_of(input)?).with_context(reading)? {
                names.push(name_of(&path.with_context(reading)?)?);
            }
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
