//! Options of `process` and `identify`.

use super::output::OutputSettings;
use crate::cli::exit::CommandError;
use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::format::Format;
use crate::cli::options::hints::HintOptions;
use crate::cli::output::overwrite;
use clap::Args;
use starpipe::report::TextOptions;
use std::path::PathBuf;

/// What `process` and `identify` share.
#[derive(Debug, Args)]
pub(crate) struct SolvingOptions {
    #[command(flatten)]
    pub(crate) hints: HintOptions,
    #[command(flatten)]
    pub(crate) output: OutputOptions,
    #[command(flatten)]
    pub(crate) resources: CatalogOptions,
}

impl SolvingOptions {
    pub(crate) fn resolve(
        self,
        inputs: &[PathBuf],
        extensions: &[&str],
    ) -> Result<(OutputSettings, CatalogOptions), CommandError> {
        Ok((self.output.resolve(inputs, extensions)?, self.resources))
    }
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub(crate) struct OutputOptions {
    /// What to print
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(crate) format: Format,
    /// With --format text, list every identified star and not just the brightest
    #[arg(long)]
    pub(crate) all_stars: bool,
    /// Also write, into this directory, FRAME.json, FRAME.csv (its stars), FRAME.wcs (a FITS header, where
    /// it is identified) and, of frames, FRAME.png (the stars ringed and named)
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

/// Extensions of the files that `--out` makes of a frame, and of a list of centroids.
pub(crate) const FRAME_RESULTS: &[&str] = &["json", "csv", "png", "wcs"];
pub(crate) const LIST_RESULTS: &[&str] = &["json", "csv", "wcs"];

impl OutputOptions {
    /// Where the results of `inputs` go; `extensions` are those of the files made of each.
    pub(crate) fn resolve(
        self,
        inputs: &[PathBuf],
        extensions: &[&str],
    ) -> Result<OutputSettings, CommandError> {
        if let Some(directory) = &self.out {
            overwrite::check(inputs, directory, extensions)?;
        }
        Ok(OutputSettings {
            format: self.format,
            text: TextOptions {
                all_stars: self.all_stars,
            },
            directory: self.out,
        })
    }
}
