//! `process`: finds and identifies the stars in frames.

mod configuration;
mod parts;

use super::exit::{CommandError, Exit, Outcome};
use super::input::frames::{FrameList, read_frame, read_master};
use super::options::frames::FrameOptions;
use super::options::values;
use super::solving::options::{FRAME_RESULTS, SolvingOptions};
use super::solving::result_files::Solved;
use super::solving::{Plan, solve_all};
use anyhow::Context as _;
use clap::{Args, ValueEnum, value_parser};
use parts::{PartOptions, process_parts};
use starpipe::calibration::{Calibration, read_hot_pixels};
use starpipe::camera::data_sheet::DataSheet;
use starpipe::detect::{CentroidMethod, DetectConfig};
use starpipe::frame::Buffers;
use starpipe::identify::Priors;
use starpipe::model::sensitivity::Extinction;
use starpipe::photometry::comparison::StatedCamera;
use starpipe::pipeline::{Context, Workspace, solve_read};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe process night.tif\n  \
    starpipe process --fov 11.4 --near 83.8,-1.2 --radius 10 night.tif\n  \
    starpipe process --date 2019-07-29T22:47+02:00 --site 52.22,4.42 night.tif\n  \
    starpipe process --format json --out results night/ > night.jsonl\n  \
    starpipe process --page 2 night.fits\n  \
    starpipe process --dark master-dark.fits --flat master-flat.fits --hot-pixels hot-pixels.csv night.fits\n  \
    ssh telescope cat night.fits.fz | starpipe process -\n  \
    starpipe process 'nights/*/*.fits' --out-parquet results --shard 3/100\n\n\
    The format of a file is recognized from its content; any may be compressed with gzip or bzip2. Date,\n\
    exposure, pixel size and focal length are taken from FITS keywords or Exif unless an option gives them.\n\n\
    --out results writes results/night.json, night.csv, night.wcs and night.png for night.tif, and\n\
    overwrites only such results. In directories of frames such results are skipped.")]
pub(crate) struct ProcessArgs {
    #[command(flatten)]
    frames: FrameOptions,
    #[command(flatten)]
    calibration: CalibrationOptions,
    #[command(flatten)]
    detection: DetectionOptions,
    #[command(flatten)]
    exposure: ExposureOptions,
    #[command(flatten)]
    solving: SolvingOptions,
    #[command(flatten)]
    parts: PartOptions,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Calibration")]
pub(crate) struct CalibrationOptions {
    /// Frame taken without light, or the mean of many, which is subtracted; see `starpipe darks`
    #[arg(long, value_name = "FILE")]
    dark: Option<PathBuf>,
    /// Mean of evenly lit frames: the signal above the dark level is divided by it; see `starpipe
    /// flats`
    #[arg(long, value_name = "FILE")]
    flat: Option<PathBuf>,
    /// Pixels to ignore: a table with the columns x,y; see `starpipe darks`
    #[arg(long, value_name = "FILE.csv")]
    hot_pixels: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Detection")]
struct DetectionOptions {
    /// Detection threshold in standard deviations of the background, in place of --false-alarms
    #[arg(long, value_name = "NUMBER", value_parser = values::positive, allow_hyphen_values = true,
          conflicts_with = "false_alarms")]
    sigma: Option<f64>,
    /// Accepted false detections in a million pixels of noise [default: 0.1]
    #[arg(long, value_name = "NUMBER", value_parser = values::positive, allow_hyphen_values = true)]
    false_alarms: Option<f64>,
    /// Most stars that are measured, the brightest: a star tracker needs some twenty. The frame's
    /// limiting magnitude is then not measured
    #[arg(long, value_name = "NUMBER", value_parser = value_parser!(u64).range(4..),
          allow_hyphen_values = true)]
    max_stars: Option<u64>,
    /// How to measure the position of a star
    #[arg(long, value_name = "METHOD", value_enum)]
    centroid: Option<Centroid>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Centroid {
    /// Fit of a Gaussian spot: the most accurate
    GaussianFit,
    /// Centre of the light above a threshold: the fastest
    GreyWeighted,
}

/// Hints that apply to frames, but not to lists of centroids.
#[derive(Debug, Args)]
#[command(next_help_heading = "What is known of the frames")]
struct ExposureOptions {
    /// Exposure of the frames, in seconds [default: the exposure in the file's header]
    #[arg(long, value_name = "SECONDS", value_parser = values::exposure, allow_hyphen_values = true)]
    exposure: Option<f64>,
    /// With --camera, zenith distance of the frames' centres in degrees [default: from --site and
    /// the date, else from the header, else 0]
    #[arg(long, value_name = "DEG", value_parser = values::zenith_distance, allow_hyphen_values = true,
          requires = "camera")]
    zenith_distance: Option<f64>,
    /// With --camera, extinction in magnitudes per airmass [default: the law of the sensitivity
    /// paper, 0.35 in V]
    #[arg(long, value_name = "MAG", value_parser = values::extinction, allow_hyphen_values = true,
          requires = "camera")]
    extinction: Option<f64>,
}

/// `starpipe process`
pub(crate) fn process(arguments: ProcessArgs) -> Result<Outcome, CommandError> {
    if let Some(directory) = &arguments.parts.out_parquet {
        return process_parts(&arguments, directory);
    }
    let plan = arguments.plan()?;
    let page = arguments.frames.page;
    let (frames, failed) = FrameList::of(arguments.frames.frames)?.reported();
    // Frames are large: one is kept only to be drawn.
    let keep = arguments.solving.writes_files();
    let solve = |context: &Context, path: &Path, workspace: &mut Workspace| {
        let read = |buffers: &mut Buffers| read_frame(path, page, buffers);
        let (solution, frame) = solve_read(path, read, context, workspace)?;
        let frame = if keep {
            Some(frame)
        } else {
            workspace.frames.recycle(frame);
            None
        };
        Ok(Solved { solution, frame })
    };
    let exit = solve_all(&frames, arguments.solving, FRAME_RESULTS, &plan, solve)?;
    Ok(if failed { Exit::Failure } else { exit }.into())
}

impl ProcessArgs {
    fn plan(&self) -> Result<Plan, CommandError> {
        let hints = &self.solving.hints;
        let sheet = hints.data_sheet()?;
        Ok(Plan {
            detect: self.detection.config(),
            priors: Priors {
                exposure_s: self.exposure.exposure,
                ..hints.resolve()?
            },
            calibration: self.calibration.read(sheet.as_ref())?,
            camera: sheet.map(|sheet| self.exposure.stated_camera(sheet)),
        })
    }
}

impl CalibrationOptions {
    /// Reads the calibration, if any is given. Without a dark, the bias is that of `sheet`.
    pub(crate) fn read(&self, sheet: Option<&DataSheet>) -> anyhow::Result<Option<Calibration>> {
        if self.dark.is_none() && self.flat.is_none() && self.hot_pixels.is_none() {
            return Ok(None);
        }
        let master = |path: &Option<PathBuf>| path.as_deref().map(read_master).transpose();
        let list = self.hot_pixels.as_deref().map(read_hot_pixels).transpose();
        let bias_adu = sheet.map_or(0.0, |sheet| sheet.bias_adu);
        let calibration = Calibration::new(
            master(&self.dark)?,
            master(&self.flat)?,
            list.context("reading the hot pixels")?,
            bias_adu,
        );
        Ok(Some(calibration?))
    }
}

impl DetectionOptions {
    /// The library's defaults, with the options given.
    fn config(&self) -> DetectConfig {
        let default = DetectConfig::default();
        DetectConfig {
            threshold_sigma: self.sigma,
            false_alarms_per_mpx: self.false_alarms.unwrap_or(default.false_alarms_per_mpx),
            max_detections: self
                .max_stars
                .map_or(default.max_detections, |stars| stars as usize),
            centroid: self.centroid.map_or(default.centroid, CentroidMethod::from),
            ..default
        }
    }
}

impl From<Centroid> for CentroidMethod {
    fn from(centroid: Centroid) -> Self {
        match centroid {
            Centroid::GaussianFit => Self::GaussianFit,
            Centroid::GreyWeighted => Self::GreyWeighted,
        }
    }
}

impl ExposureOptions {
    /// The camera with its zenith distance and extinction as the user states them.
    fn stated_camera(&self, sheet: DataSheet) -> StatedCamera {
        StatedCamera {
            sheet,
            zenith_distance_deg: self.zenith_distance,
            extinction: self.extinction.map(Extinction::MagPerAirmass),
        }
    }
}
