//! The arguments of `night`.

use super::files;
use crate::cli::exit::CommandError;
use crate::cli::options::calibration::CalibrationOptions;
use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::format::PageFormat;
use crate::cli::options::frames::MemoryOption;
use crate::cli::options::hints::HintOptions;
use crate::cli::options::stated::{ExposureOption, TimeLimitOption, with_stated};
use crate::cli::solving::SolvingPlan;
use clap::Args;
use starpipe::calibration::Calibration;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe night --site 52.22,4.42 --dark master-dark.fits --out 2026-01-15 night/\n  \
    starpipe night --site 47.1,8.3,900 --camera camera.toml --utc-offset 1 --out results 'night/image-*.tif'\n\n\
    Frames are processed in the order of their dates. The lens and the orientation of the camera are measured\n\
    in frames spread over the night, and then assumed to be constant. The directory --out gets a line for\n\
    each frame in night.jsonl, night.csv, night.parquet and night.dat (the zenith in the format of the\n\
    skyglow community), a summary in night.json, a figure in night.svg, and the hot pixels in\n\
    hot-pixels.csv.\n\
    The same command continues a run that was stopped.\n\n\
    Exit status: 0 all went well, 1 something could not be read or written, 2 the command line is wrong, 3 no\n\
    frame was identified.")]
pub(crate) struct NightArgs {
    /// Frames of a night; files, directories of frames, patterns ('night/*.fits'), or lists of names (.txt,
    /// .lst, .parquet, or - for standard input)
    #[arg(value_name = "FRAME", required = true)]
    pub(super) frames: Vec<PathBuf>,
    /// Directory for the results
    #[arg(short, long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Also write night.html, a page with the figure, the events and the table
    #[arg(long)]
    pub(super) html: bool,
    /// What to print when the night is done [default: text]
    #[arg(long, value_enum)]
    pub(super) format: Option<PageFormat>,
    /// Print errors only: no progress, no warnings, and no report unless --format is given
    #[arg(short, long)]
    pub(super) quiet: bool,
    /// Ignore the hot pixels found in the frames of the night (those listed in hot-pixels.csv)
    #[arg(long, conflicts_with = "hot_pixels")]
    pub(super) mask_hot_pixels: bool,
    #[command(flatten)]
    pub(super) calibration: CalibrationOptions,
    #[command(flatten)]
    exposure: ExposureOption,
    #[command(flatten)]
    pub(super) hints: HintOptions,
    #[command(flatten)]
    pub(super) station: StationOptions,
    #[command(flatten)]
    limit: TimeLimitOption,
    #[command(flatten)]
    memory: MemoryOption,
    #[command(flatten)]
    pub(super) catalog: CatalogOptions,
}

/// What night.dat says of the station.
#[derive(Debug, Args)]
#[command(next_help_heading = "Header of night.dat")]
pub(super) struct StationOptions {
    /// Name of the instrument
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub(super) instrument: String,
    /// Supplier of the data
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub(super) supplier: String,
    /// Name of the place
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub(super) location: String,
}

impl NightArgs {
    /// The calibration with the hot pixels that were learned.
    pub(super) fn masked_calibration(&self) -> anyhow::Result<Option<Calibration>> {
        let learned = CalibrationOptions {
            hot_pixels: Some(self.out.join(files::HOT_PIXELS)),
            ..self.calibration.clone()
        };
        learned.read(self.hints.description()?.as_ref())
    }

    /// What the frames are solved with.
    pub(super) fn plan(&self) -> Result<SolvingPlan, CommandError> {
        let options = with_stated(self.hints.options()?, &self.exposure)?;
        let mut options = with_stated(options, &self.limit)?;
        if options.date.is_some() {
            return Err(CommandError::usage(
                "--date sets one date for all frames, but each frame of a night needs its own: in its header, or in \
                 its name with --utc-offset",
            ));
        }
        let camera = self.hints.description()?;
        options.sky = true;
        options.trails = true;
        Ok(SolvingPlan {
            options,
            calibration: self.calibration.read(camera.as_ref())?,
            camera,
            memory: self.memory.limit(),
        })
    }
}
