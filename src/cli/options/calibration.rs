//! The files that frames are calibrated with.

use super::hints::HintOptions;
use crate::cli::input::frames::read_master;
use anyhow::Context as _;
use clap::Args;
use starpipe::calibration::{Calibration, read_hot_pixels};
use starpipe::camera::data_sheet::CameraDescription;
use starpipe::catalog::Catalog;
use starpipe::solve::SolveOptions;
use starpipe::store::{Configuration, FileHash};
use std::path::{Path, PathBuf};

#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Calibration")]
pub(crate) struct CalibrationOptions {
    /// Dark frame or master dark to subtract; see `starpipe darks`
    #[arg(long, value_name = "FILE")]
    pub(crate) dark: Option<PathBuf>,
    /// Master flat by which the signal above the dark level is divided; see `starpipe flats`
    #[arg(long, value_name = "FILE")]
    pub(crate) flat: Option<PathBuf>,
    /// Pixels to ignore: a table with the columns x,y; see `starpipe darks`
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) hot_pixels: Option<PathBuf>,
    /// Mask, an image of the frame's size that is black where something hides the sky: trees, houses,
    /// lamps
    #[arg(long, value_name = "FILE")]
    pub(crate) mask: Option<PathBuf>,
}

impl CalibrationOptions {
    /// Reads the calibration, if any is given. Without a dark, the bias is that of the camera.
    pub(crate) fn read(
        &self,
        camera: Option<&CameraDescription>,
    ) -> anyhow::Result<Option<Calibration>> {
        let files = [&self.dark, &self.flat, &self.hot_pixels, &self.mask];
        if files.into_iter().all(Option::is_none) {
            return Ok(None);
        }
        let master = |path: &Option<PathBuf>| path.as_deref().map(read_master).transpose();
        let list = self.hot_pixels.as_deref().map(read_hot_pixels).transpose();
        let sheet = camera.and_then(|camera| camera.sheet.as_ref());
        let bias_adu = sheet.map_or(0.0, |sheet| sheet.bias_adu);
        let calibration = Calibration::new(
            master(&self.dark)?,
            master(&self.flat)?,
            list.context("reading the hot pixels")?,
            bias_adu,
        );
        Ok(Some(calibration?.with_mask(master(&self.mask)?)))
    }

    /// All that the results of frames depend on: these options, the others as they are given; of files the
    /// hash of what is in them.
    pub(crate) fn configuration(
        &self,
        catalog: &Catalog,
        options: &SolveOptions,
        hints: &HintOptions,
    ) -> anyhow::Result<Configuration> {
        Ok(Configuration {
            catalog: catalog.into(),
            options: options.clone(),
            camera: hash_of(hints.camera.as_deref())?,
            dark: hash_of(self.dark.as_deref())?,
            flat: hash_of(self.flat.as_deref())?,
            hot_pixels: hash_of(self.hot_pixels.as_deref())?,
            mask: hash_of(self.mask.as_deref())?,
            ..Configuration::default()
        })
    }
}

/// The hash of a file's content.
fn hash_of(path: Option<&Path>) -> anyhow::Result<Option<FileHash>> {
    let Some(path) = path else { return Ok(None) };
    let hash = FileHash::of_file(path).with_context(|| format!("reading {}", path.display()))?;
    Ok(Some(hash))
}
