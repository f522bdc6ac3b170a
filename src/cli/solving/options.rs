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
    /// Minimum odds, NUMBER to 1, that a name is right; stars with lower odds get no name
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true,
          default_value_t = NAME_ODDS.to_string())]
    name_odds: String,
    /// Effort of the search if the brightest stars do not identify a frame
    #[arg(long, value_enum, default_value_t)]
    effort: Effort,
    /// Measure only the pointing: attitude and optics, from the brightest stars. This is several times
    /// faster, but gives no further names, no zero point and no limiting magnitude
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
    /// One JSON object per line
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
    /// With --format text, list every identified star, not only the brightest
    #[arg(short = 'v', long, visible_alias = "verbose")]
    pub(super) all_stars: bool,
    /// Print errors only: no progress, no warnings, and no reports unless --format is given
    #[arg(short, long)]
    pub(crate) quiet: bool,
    /// Directory for result files: FRAME.json, FRAME.csv (its stars), FRAME.wcs (a FITS header, if the
    /// frame is identified) and, for frames, FRAME.png (a picture with the stars marked and named)
    #[arg(short, long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// With --out, also write FRAME.html: a page for a browser with the result, the picture, figures and a
    /// table
    #[arg(long, requires = "out")]
    pub(super) html: bool,
    /// With --out, also write FRAME.solved.fits: a copy of an identified frame with its coordinates (WCS) in the
    /// header
    #[arg(long, requires = "out")]
    pub(super) write_fits: bool,
    /// With --out, also write FRAME.reg: the detections as regions for SAOImage DS9
    #[arg(long, requires = "out")]
    pub(super) regions: bool,
    /// With --out, also write the detections as tables of these kinds, separated by commas
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
    /// FRAME.stars.fits: a FITS binary table
    Fits,
    /// FRAME.stars.vot: a VOTable
    Votable,
    /// FRAME.stars.ecsv: Enhanced CSV, as astropy reads it
    Ecsv,
    /// FRAME.corr: pairs of detections and stars, in the format of astrometry.net
    Corr,
    /// FRAME.rdls: directions of the identified stars, in the format of astrometry.net
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
