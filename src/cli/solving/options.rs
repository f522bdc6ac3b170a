//! Options of `process` and `identify`.

use super::overlay_args::OverlayArgs;
use crate::cli::exit::CommandError;
use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::hints::HintOptions;
use crate::cli::options::stated::{TimeLimitOption, with_stated};
use clap::{Args, ValueEnum};
use serde::Serialize;
use starpipe::identify::{Effort, NAME_ODDS};
use starpipe::report::tables::TableFormat;
use starpipe::solve::SolveOptions;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct SolvingOptions {
    #[command(flatten)]
    pub(crate) hints: HintOptions,
    #[command(flatten)]
    identification: IdentificationOptions,
    #[command(flatten)]
    limit: TimeLimitOption,
    #[command(flatten)]
    pub(crate) output: OutputOptions,
    #[command(flatten)]
    pub(crate) catalog: CatalogOptions,
}

#[derive(Debug, Args, Serialize)]
#[command(next_help_heading = "Identification")]
struct IdentificationOptions {
    /// Give a star a name only where the odds are at least this many to 1 that it is right
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true,
          default_value_t = NAME_ODDS.to_string())]
    name_odds: String,
    /// How much is tried where the brightest stars do not identify a frame at once
    #[arg(long, value_enum, default_value_t)]
    effort: Effort,
    /// Determine only this. pointing: attitude and optics, from the brightest stars, several times faster; no
    /// further names, no zero point and no limiting magnitude
    #[arg(long, value_enum, value_name = "WHAT")]
    only: Option<Only>,
    /// The same as --only pointing.
    #[arg(long, hide = true, conflicts_with = "only")]
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    attitude_only: bool,
}

/// What alone is wanted.
#[derive(Debug, Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Only {
    /// Attitude and optics, from the brightest stars
    Pointing,
}

/// The forms of reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum ReportFormat {
    /// A report for people
    Text,
    /// A line for each frame, and a summary
    Table,
    /// One JSON object a line
    Json,
    /// A table of the stars
    Csv,
    /// A table of the frames
    FramesCsv,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub(crate) struct OutputOptions {
    /// What to print [default: text; table for several inputs on a terminal]
    #[arg(long, value_enum)]
    pub(super) format: Option<ReportFormat>,
    /// With --format text, list every identified star and not just the brightest
    #[arg(short = 'v', long, visible_alias = "verbose")]
    pub(super) all_stars: bool,
    /// Print errors only: no progress, no warnings, and no reports but those that --format asks for
    #[arg(short, long)]
    pub(crate) quiet: bool,
    /// Also write into this directory FRAME.json, FRAME.csv (its stars), FRAME.wcs (a FITS header,
    /// if the frame is identified) and, for frames, FRAME.png (a picture with the stars marked and named)
    #[arg(short, long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// With --out, also write FRAME.html: a page with the answer, the picture, figures and a table, to look at
    /// in a browser
    #[arg(long, requires = "out")]
    pub(super) html: bool,
    /// With --out, also write FRAME.solved.fits: a copy of an identified frame with its coordinates (WCS) in the
    /// header
    #[arg(long, requires = "out")]
    pub(super) write_fits: bool,
    /// With --out, also write FRAME.reg: the detections as regions for SAOImage DS9
    #[arg(long, requires = "out")]
    pub(super) regions: bool,
    /// With --out, also write the detections as these tables, separated by commas
    #[arg(
        long,
        value_enum,
        value_name = "KIND",
        value_delimiter = ',',
        requires = "out"
    )]
    stars: Vec<TableOption>,
    #[command(flatten)]
    pub(super) overlay: OverlayArgs,
}

/// Kinds of tables.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum TableOption {
    /// FRAME.stars.fits: a binary table of FITS
    Fits,
    /// FRAME.stars.vot: a VOTable
    Votable,
    /// FRAME.stars.ecsv: Enhanced CSV, as astropy reads it
    Ecsv,
    /// FRAME.corr: pairs of detections and stars, as astrometry.net writes them
    Corr,
    /// FRAME.rdls: directions of the identified stars, as astrometry.net writes them
    Rdls,
}

impl OutputOptions {
    /// The tables that are wanted.
    pub(super) fn tables(&self) -> Vec<TableFormat> {
        let format = |option: &TableOption| match option {
            TableOption::Fits => TableFormat::Fits,
            TableOption::Votable => TableFormat::VoTable,
            TableOption::Ecsv => TableFormat::Ecsv,
            TableOption::Corr => TableFormat::Corr,
            TableOption::Rdls => TableFormat::Rdls,
        };
        self.stars.iter().map(format).collect()
    }

    /// Extensions of the result files of an image.
    pub(super) fn result_extensions(&self, has_picture: bool) -> Vec<&'static str> {
        let all = [
            (true, "json"),
            (true, "csv"),
            (true, "wcs"),
            (true, "sky.svg"),
            (has_picture, self.overlay.options().format.extension()),
            (self.html, "html"),
            (self.write_fits, "solved.fits"),
            (self.regions, "reg"),
        ];
        let wanted = all.into_iter().filter(|(is_wanted, _)| *is_wanted);
        let tables = self.tables().into_iter().map(TableFormat::extension);
        wanted
            .map(|(_, extension)| extension)
            .chain(tables)
            .collect()
    }
}

impl SolvingOptions {
    /// The defaults with what is given.
    pub(crate) fn options(&self) -> Result<SolveOptions, CommandError> {
        let options = with_stated(self.hints.options()?, &self.identification)?;
        with_stated(options, &self.limit)
    }
}
