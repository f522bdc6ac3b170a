//! What the runs of one command have in common.

use crate::cli::output::files::{generated, write_into};
use crate::cli::output::messages::report;
use crate::cli::plot::{FigureForm, figure_files};
use indicatif::ProgressBar;
use starpipe::identify::IndexedCatalog;
use starpipe::report::figure::Sheet;
use std::cell::Cell;
use std::fmt::Display;
use std::path::Path;

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
    /// Whether everything could be written so far.
    pub(super) all_written: Cell<bool>,
}

impl Shared<'_> {
    /// Writes texts and figures into a directory; what fails is told.
    pub(super) fn write<'t>(
        &self,
        directory: &Path,
        texts: impl IntoIterator<Item = (&'t str, String)>,
        sheets: Vec<(&str, Sheet)>,
    ) {
        let file = |(name, text): (&str, String)| Ok((name.to_owned(), text.into_bytes()));
        let figures = generated(figure_files(sheets, self.figures));
        let files = texts.into_iter().map(file).chain(figures);
        let written = self.progress.suspend(|| write_into(directory, files));
        self.all_written.set(self.all_written.get() && written);
    }

    /// Reports something on standard error, above the progress bar if there is one.
    pub(super) fn report(&self, message: impl Display) {
        self.progress.suspend(|| report(message));
    }
}
