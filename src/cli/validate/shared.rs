//! What the runs of one command have in common.

use crate::cli::output::messages::report;
use crate::cli::plot::FigureForm;
use indicatif::ProgressBar;
use starpipe::identify::IndexedCatalog;
use std::fmt::Display;

/// What the runs of one command have in common.
pub(super) struct Shared<'a> {
    pub(super) indexed: &'a IndexedCatalog<'a>,
    pub(super) pool: &'a rayon::ThreadPool,
    /// Frames of each run.
    pub(super) frames: u64,
    pub(super) figures: FigureForm,
    /// Small pictures of each run on the page, if there is to be one.
    pub(super) pictures: Option<usize>,
    /// Progress over the frames of all runs.
    pub(super) progress: ProgressBar,
}

impl Shared<'_> {
    /// Reports something on standard error, above the progress bar if there is one.
    pub(super) fn report(&self, message: impl Display) {
        self.progress.suspend(|| report(message));
    }
}
