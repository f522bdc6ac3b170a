//! The file that a lens is written to.

use super::CalibrateArgs;
use crate::cli::exit::CommandError;
use anyhow::Context as _;
use starpipe::lens::LensCalibration;
use std::path::Path;

/// Start of the comment before the table.
const MEASURED_BY: &str = "# Measured by starpipe";

/// Refuses to overwrite a file without --force.
pub(super) fn check(arguments: &CalibrateArgs) -> Result<(), CommandError> {
    let out = arguments.out.as_ref().filter(|_| !arguments.force);
    // A link counts as existing even if its target does not exist.
    match out.filter(|out| out.symlink_metadata().is_ok()) {
        None => Ok(()),
        Some(out) => Err(CommandError::Usage(format!(
            "{} exists; --force overwrites it",
            out.display()
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
    let about = [
        format!(
            "{} {} in {} stars of {} frames; residuals {:.3} px on each axis,",
            MEASURED_BY.trim_start_matches("# "),
            env!("CARGO_PKG_VERSION"),
            measured.stars,
            measured.frames.len(),
            measured.rms_px
        ),
        format!(
            "{:.3} px of stars that were left out of the fit.",
            measured.held_out_rms_px
        ),
    ];
    Ok(text + &measured.lens.to_toml(&about))
}

/// A description up to its table of a lens.
fn without_lens(text: &str) -> String {
    let lines = text.lines();
    let before = lines.take_while(|line| line.trim() != "[lens]" && !line.starts_with(MEASURED_BY));
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
