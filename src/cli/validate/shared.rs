//! What the runs of one command have in common.

use crate::cli::output::messages::report_error;
use crate::cli::plot::FigureForm;
use anyhow::Context;
use indicatif::ProgressBar;
use starpipe::identify::IndexedCatalog;
use std::fmt::Display;
use std::io::ErrorKind;
use std::path::Path;

/// What the runs of one command have in common.
pub(super) struct Shared<'a> {
    pub(super) indexed: &'a IndexedCatalog<'a>,
    pub(super) pool: &'a rayon::ThreadPool,
    /// Frames of each run.
    pub(super) frames: u64,
    pub(super) figures: FigureForm,
    /// Progress over the frames of all runs.
    pub(super) progress: ProgressBar,
}

impl Shared<'_> {
    /// Reports something on standard error, above the progress bar if there is one.
    pub(super) fn report(&self, message: impl Display) {
        self.progress.suspend(|| report_error(message));
    }
}

/// Removes a file that is out of date; whether it was there.
pub(super) fn remove_outdated(path: &Path) -> anyhow::Result<bool> {
    match std::fs::remove_file(path) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => {
            Err(error).with_context(|| format!("removing {}, which is out of date", path.display()))
        }
    }
}
