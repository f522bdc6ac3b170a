//! The file that a lens is written to.

use crate::cli::exit::CommandError;
use anyhow::Context as _;
use starpipe::identify::lens::{LensCalibration, MEASURED_BY};
use std::path::Path;

/// Refuses to overwrite one of these files.
pub(super) fn check<'a>(files: impl IntoIterator<Item = &'a Path>) -> Result<(), CommandError> {
    // A link counts as existing even if its target does not exist.
    let exists = |path: &&Path| path.symlink_metadata().is_ok();
    match files.into_iter().find(exists) {
        None => Ok(()),
        Some(path) => Err(CommandError::Usage(format!(
            "{} exists; --force overwrites it",
            path.display()
        ))),
    }
}

/// The description of the camera, without the lens that it has, and with the one that was measured.
pub(super) fn text(camera: Option<&Path>, measured: &LensCalibration) -> anyhow::Result<String> {
    let described = camera.map(std::fs::read_to_string).transpose();
    let described = described.context("reading the description of the camera")?;
    let mut text = described.map_or_else(String::new, |text| without_lens(&text));
    if !text.is_empty() {
        text += "\n";
    }
    Ok(text + &measured.to_toml())
}

/// A description up to its table of a lens.
fn without_lens(text: &str) -> String {
    let lines = text.lines();
    let is_comment = |line: &str| line.trim_start_matches("# ").starts_with(MEASURED_BY);
    let before = lines.take_while(|line| line.trim() != "[lens]" && !is_comment(line));
    let before: Vec<&str> = before.collect();
    let text = before.join("\n");
    match text.trim_end() {
        "" => String::new(),
        text => format!("{text}\n"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lens_is_replaced_and_the_rest_is_kept() {
        let text = "width_px = 3\n# kept\n\n# Measured by starpipe 0.1\n# in a year\n[lens]\nwidth_px = 3\n";
        assert_eq!(without_lens(text), "width_px = 3\n# kept\n");
        assert_eq!(without_lens("[lens]\nwidth_px = 3\n"), "");
    }
}
