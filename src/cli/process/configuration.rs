//! All that the results depend on, so that results of different options are never mixed.

use super::args::{CalibrationOptions, ProcessArgs};
use anyhow::Context;
use starpipe::archive::{Configuration, FileHash};
use starpipe::frame::PageChoice;
use starpipe::pipeline::SolveOptions;
use starpipe::sky::catalog::Catalog;
use std::path::PathBuf;

/// The options as they are given; of files the hash of what is in them.
pub(super) fn configuration(
    arguments: &ProcessArgs,
    options: &SolveOptions,
    catalog: &Catalog,
) -> anyhow::Result<Configuration> {
    let CalibrationOptions {
        dark,
        flat,
        hot_pixels,
        mask,
    } = &arguments.calibration;
    Ok(Configuration {
        catalog: catalog.into(),
        options: options.clone(),
        camera: hash_of(&arguments.solving.hints.camera)?,
        dark: hash_of(dark)?,
        flat: hash_of(flat)?,
        hot_pixels: hash_of(hot_pixels)?,
        mask: hash_of(mask)?,
        page: arguments.page.and_then(text_of),
        night: None,
    })
}

/// The choice as it is given.
fn text_of(page: PageChoice) -> Option<String> {
    match page {
        PageChoice::Main => None,
        PageChoice::Number(number) => Some(number.to_string()),
        PageChoice::All => Some("all".to_owned()),
    }
}

/// The hash of a file's content.
pub(crate) fn hash_of(path: &Option<PathBuf>) -> anyhow::Result<Option<FileHash>> {
    let Some(path) = path else { return Ok(None) };
    let hash = FileHash::of_file(path).with_context(|| format!("reading {}", path.display()))?;
    Ok(Some(hash))
}
