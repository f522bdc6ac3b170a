//! The arguments of `process`, and what they make of a [`Plan`].

use crate::cli::exit::CommandError;
use crate::cli::options::calibration::CalibrationOptions;
use crate::cli::options::frames::{FrameOptions, MemoryOption};
use crate::cli::options::hints::set;
use crate::cli::options::values;
use crate::cli::solving::SolvingPlan;
use crate::cli::solving::options::SolvingOptions;
use clap::{Args, ValueEnum, value_parser};
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
    The format of a file is recognized from its content; any may be compressed with gzip or bzip2. Date,\n\
    exposure, pixel size and focal length are taken from FITS keywords or Exif unless an option gives them.\n\n\
    --out results writes results/night.json, night.csv, night.wcs and night.png for night.tif, and\n\
    overwrites only such results. In directories of frames such results are skipped.")]
pub(crate) struct ProcessArgs {
    /// Whether the sky is measured: `starpipe sky`.
    #[arg(skip)]
    pub(crate) sky: bool,
    #[command(flatten)]
    pub(super) frames: FrameOptions,
    /// Which image of a file with several, from 1: a page of a TIFF, an image or plane of a FITS
    /// file; or all of them, as FRAME[1], FRAME[2] and so on [default: the largest]
    #[arg(long, value_name = "NUMBER|all")]
    pub(super) page: Option<PageChoice>,
    #[command(flatten)]
    pub(super) calibration: CalibrationOptions,
    #[command(flatten)]
    pub(super) detection: DetectionOptions,
    #[command(flatten)]
    pub(super) exposure: ExposureOptions,
    #[command(flatten)]
    pub(super) memory: MemoryOption,
    #[command(flatten)]
    pub(super) solving: SolvingOptions,
    #[command(flatten)]
    pub(super) parts: PartOptions,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Detection")]
pub(super) struct DetectionOptions {
    /// Detection threshold in standard deviations of the background, in place of --false-alarms
    #[arg(long, value_name = "NUMBER", value_parser = values::positive, allow_hyphen_values = true,
          conflicts_with = "false_alarms")]
    pub(super) sigma: Option<f64>,
    /// Accepted false detections in a million pixels of noise [default: 0.1]
    #[arg(long, value_name = "NUMBER", value_parser = values::positive, allow_hyphen_values = true)]
    pub(super) false_alarms: Option<f64>,
    /// Maximum number of stars to measure, the brightest; a star tracker needs about 20. The
    /// limiting magnitude is then not measured
    #[arg(long, value_name = "NUMBER", value_parser = value_parser!(u64).range(4..),
          allow_hyphen_values = true)]
    pub(super) max_stars: Option<u64>,
    /// Search satellites, aeroplanes and meteors, too: straight lines of light
    #[arg(long)]
    pub(super) trails: bool,
    /// How to measure the position of a star
    #[arg(long, value_name = "METHOD", value_enum)]
    pub(super) centroid: Option<CentroidMethodOption>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum CentroidMethodOption {
    /// Fit of a Gaussian spot: the most accurate
    GaussianFit,
    /// Centre of the light above a threshold: the fastest
    GreyWeighted,
}

/// Hints that apply to frames, but not to lists of centroids.
#[derive(Debug, Args)]
#[command(next_help_heading = "What is known of the frames")]
pub(super) struct ExposureOptions {
    /// Exposure of the frames, in seconds [default: the exposure in the file's header]
    #[arg(long, value_name = "SECONDS", value_parser = values::exposure, allow_hyphen_values = true)]
    pub(super) exposure: Option<f64>,
    /// With --camera, zenith distance of the frames' centres in degrees [default: from --site and
    /// the date, else from the header, else 0]
    #[arg(long, value_name = "DEG", value_parser = values::zenith_distance, allow_hyphen_values = true,
          requires = "camera")]
    pub(super) zenith_distance: Option<f64>,
    /// With --camera, extinction in magnitudes per airmass [default: the law of the sensitivity
    /// paper, 0.35 in V]
    #[arg(long, value_name = "MAG", value_parser = values::extinction, allow_hyphen_values = true,
          requires = "camera")]
    pub(super) extinction: Option<f64>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Archives")]
pub(super) struct PartOptions {
    /// Write tables of frames and stars into this directory, part by part, and print no reports.
    /// Parts that are there are skipped. FRAME may then also be a pattern ('night/*.fits'), or a list
    /// of names: .txt (one a line), .parquet, or - for standard input
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "format", "all_stars"])]
    pub(super) out_parquet: Option<PathBuf>,
    /// Process only the parts of worker K of N: every Nth
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
        let mut options = self.solving.options()?;
        options.sky = self.sky;
        options.trails = self.detection.trails || self.sky;
        options.exposure_s = self.exposure.exposure;
        options.zenith_distance_deg = self.exposure.zenith_distance;
        options.extinction_mag_per_airmass = self.exposure.extinction;
        let detection = &self.detection;
        options.sigma = detection.sigma;
        set(&mut options.false_alarms_per_mpx, detection.false_alarms);
        set(
            &mut options.max_stars,
            detection.max_stars.map(|stars| stars as usize),
        );
        set(
            &mut options.centroid,
            detection.centroid.map(CentroidMethod::from),
        );
        Ok(options)
    }

    pub(super) fn plan(&self) -> Result<SolvingPlan, CommandError> {
        let camera = self.solving.hints.description()?;
        Ok(SolvingPlan {
            options: self.options()?,
            calibration: self.calibration.read(camera.as_ref())?,
            camera,
            memory: self.memory.limit(),
        })
    }
}

impl From<CentroidMethodOption> for CentroidMethod {
    fn from(centroid: CentroidMethodOption) -> Self {
        match centroid {
            CentroidMethodOption::GaussianFit => Self::GaussianFit,
            CentroidMethodOption::GreyWeighted => Self::GreyWeighted,
        }
    }
}
