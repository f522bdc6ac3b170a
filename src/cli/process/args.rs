//! The arguments of `process`, and what they make of a [`Plan`].

use crate::cli::exit::CommandError;
use crate::cli::options::calibration::CalibrationOptions;
use crate::cli::options::frames::{FrameOptions, MemoryOption};
use crate::cli::options::stated::{ExposureOption, with_stated};
use crate::cli::solving::SolvingPlan;
use crate::cli::solving::options::SolvingOptions;
use clap::Args;
use serde::Serialize;
use starpipe::detect::CentroidMethod;
use starpipe::frame::PageChoice;
use starpipe::solve::SolveOptions;
use starpipe::store::{DEFAULT_FRAMES_PER_PART, Shard};
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe process night.tif\n  \
    starpipe process --fov 11.4 --near 83.8,-1.2 --radius 10 night.tif\n  \
    starpipe process --date 2019-07-29T22:47+02:00 --site 52.22,4.42 night.tif\n  \
    starpipe process --format json --out results night/ > night.jsonl\n  \
    starpipe process --page all mosaic.fits\n  \
    starpipe process --dark master-dark.fits --flat master-flat.fits --hot-pixels hot-pixels.csv night.fits\n  \
    ssh telescope cat night.fits.fz | starpipe process -\n  \
    starpipe process 'nights/*/*.fits' --out-parquet results --shard 3/100\n\n\
    The format of a file is recognized from its content. Files may be compressed with gzip or bzip2. Date,\n\
    exposure, pixel size and focal length are taken from FITS keywords or Exif unless an option gives them.\n\n\
    --out results writes results/night.json, night.csv, night.wcs and night.png for night.tif, and\n\
    overwrites only its own results. Result files in a directory of frames are not processed.")]
pub(crate) struct ProcessArgs {
    /// Whether the sky is measured: `starpipe sky`.
    #[arg(skip)]
    pub(crate) sky: bool,
    #[command(flatten)]
    pub(super) frames: FrameOptions,
    /// Number of the image in a file with several, from 1: a page of a TIFF, an image or plane of a FITS
    /// file; or all of them, as FRAME[1], FRAME[2] and so on [default: the largest]
    #[arg(long, value_name = "NUMBER|all")]
    pub(super) page: Option<PageChoice>,
    #[command(flatten)]
    pub(super) calibration: CalibrationOptions,
    #[command(flatten)]
    detection: DetectionOptions,
    #[command(flatten)]
    conditions: ConditionOptions,
    #[command(flatten)]
    pub(super) memory: MemoryOption,
    #[command(flatten)]
    pub(super) solving: SolvingOptions,
    #[command(flatten)]
    pub(super) parts: PartOptions,
}

#[derive(Debug, Args, Serialize)]
#[command(next_help_heading = "Detection")]
struct DetectionOptions {
    /// Detection threshold in standard deviations of the background, instead of --false-alarms
    #[arg(
        long,
        value_name = "NUMBER",
        allow_hyphen_values = true,
        conflicts_with = "false_alarms"
    )]
    sigma: Option<String>,
    /// Accepted rate of false detections per million pixels of noise [default: 0.1]
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    false_alarms: Option<String>,
    /// Measure only this many of the brightest stars; a star tracker needs about 20. The limiting
    /// magnitude is then not measured
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    max_stars: Option<String>,
    /// Also search for trails of satellites, aircraft and meteors
    #[arg(long)]
    trails: bool,
    /// How to measure the position of a star
    #[arg(long, value_name = "METHOD", value_enum)]
    centroid: Option<CentroidMethod>,
}

/// Hints that apply to frames, but not to lists of centroids.
#[derive(Debug, Args, Serialize)]
#[command(next_help_heading = "Hints")]
struct ConditionOptions {
    #[command(flatten)]
    #[serde(flatten)]
    exposure: ExposureOption,
    /// With --camera, zenith distance of the frames' centers in degrees [default: from --site and
    /// the date, else from the header, else 0]
    #[arg(
        long,
        value_name = "DEG",
        allow_hyphen_values = true,
        requires = "camera"
    )]
    zenith_distance: Option<String>,
    /// With --camera, extinction in magnitudes per airmass [default: 0.35 in V, with the wavelength
    /// dependence of Tong, Li & Wang 2014]
    #[arg(
        long,
        value_name = "MAG",
        allow_hyphen_values = true,
        requires = "camera"
    )]
    extinction: Option<String>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Archives")]
pub(super) struct PartOptions {
    /// Write Parquet tables of frames and stars into this directory, in parts, and print no reports.
    /// Existing parts are skipped. FRAME may then also be a pattern ('night/*.fits'), or a list
    /// of names: .txt (one per line), .parquet, or - for standard input
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "format", "all_stars"])]
    pub(super) out_parquet: Option<PathBuf>,
    /// Process only the parts of worker K of N: every Nth part, starting with the Kth
    #[arg(long, value_name = "K/N", requires = "out_parquet")]
    pub(super) shard: Option<Shard>,
    /// Frames in each part
    #[arg(long, value_name = "NUMBER", default_value_t = DEFAULT_FRAMES_PER_PART,
          requires = "out_parquet")]
    pub(super) frames_per_part: NonZeroUsize,
}

impl ProcessArgs {
    /// All that is stated for the frames.
    fn options(&self) -> Result<SolveOptions, CommandError> {
        let options = with_stated(self.solving.options()?, &self.detection)?;
        let mut options = with_stated(options, &self.conditions)?;
        options.sky = self.sky;
        options.trails |= self.sky;
        Ok(options)
    }

    pub(super) fn plan(&self) -> Result<SolvingPlan, CommandError> {
        let options = self.options()?;
        let camera = self.solving.hints.description()?;
        Ok(SolvingPlan {
            options,
            calibration: self.calibration.read(camera.as_ref())?,
            camera,
            memory: self.memory.limit(),
        })
    }
}
