//! The figures of a run and of a study.

use super::study::StudyRow;
use clap::ValueEnum;
use starpipe::validation::Summary;

/// What figures are drawn as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum FigureForm {
    /// Lines and letters
    Svg,
    /// Pixels
    Png,
    /// Not at all
    None,
}

/// Names and contents of files.
type Files = Vec<(String, Vec<u8>)>;

/// The figures of a run.
pub(super) fn of_run(_: &Summary, _: FigureForm) -> anyhow::Result<Files> {
    Ok(Files::new())
}

/// The figures of a study.
pub(super) fn of_study(_: &[StudyRow], _: FigureForm) -> anyhow::Result<Files> {
    Ok(Files::new())
}
