//! `process`: frames.

use super::exit::{CommandError, Exit};
use super::input::frames as input;
use super::input::frames::read_master;
use super::options::values;
use super::output::messages::{one_line, report_error};
use super::solving::options::{FRAME_RESULTS, SolvingOptions};
use super::solving::output::Solved;
use super::solving::{Plan, solve_all};
use anyhow::Context;
use clap::{Args, ValueEnum};
use starpipe::calibration::{Calibration, read_hot_pixels};
use starpipe::camera::data_sheet::DataSheet;
use starpipe::detect::{CentroidMethod, DetectConfig};
use starpipe::frame::Buffers;
use starpipe::identify::Priors;
use starpipe::model::sensitivity::Extinction;
use starpipe::photometry::comparison::StatedCamera;
use starpipe::pipeline::solve_read;
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe process night.tif\n  \
    starpipe process --fov 11.4 --near 83.8,-1.2 --radius 10 night.tif\n  \
    starpipe process --date 2019-07-29T22:47+02:00 --site 52.22,4.42 night.tif\n  \
    starpipe process --format json --out results night/ > night.jsonl\n  \
    starpipe process --page 2 night.fits\n  \
    starpipe process --dark master-dark.fits --flat master-flat.fits --hot-pixels hot-pixels.csv night.fits\n  \
    funpack -S night.fits.fz | starpipe process -\n\n\
    The kind of a file is told from its content; any may be compressed with gzip. A date, an exposure,\n\
    a pixel size and a focal length in FITS keywords or Exif are used where no option says otherwise.\n\n\
    --out results makes results/night.json, night.csv, night.wcs and night.png of night.tif, and\n\
    overwrites nothing but such results. Those among the frames of a directory are left out.")]
pub(crate) struct ProcessArgs {
    /// Frames to process; a directory stands for the frames in it, - for standard input
    #[arg(value_name = "FRAME", required = true)]
    pub(crate) frames: Vec<PathBuf>,
    /// Which image of a file with several, from 1: a TIFF's page, a FITS image or plane [default: the first]
    #[arg(long, value_name = "NUMBER", help_heading = "Frame")]
    pub(crate) page: Option<NonZeroUsize>,
    #[command(flatten)]
    pub(crate) calibration: CalibrationOptions,
    #[command(flatten)]
    pub(crate) detection: DetectionOptions,
    #[command(flatten)]
    pub(crate) light: LightOptions,
    #[command(flatten)]
    pub(crate) solving: SolvingOptions,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Calibration")]
pub(crate) struct CalibrationOptions {
    /// Frame taken without light, or the mean of many: its pattern is subtracted, see `starpipe darks`
    #[arg(long, value_name = "FILE")]
    pub(crate) dark: Option<PathBuf>,
    /// Mean of evenly lit frames: what is above the dark level is divided by it, see `starpipe flats`
    #[arg(long, value_name = "FILE")]
    pub(crate) flat: Option<PathBuf>,
    /// Pixels not to be believed: a table with the columns x,y, see `starpipe darks`
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) hot_pixels: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Detection")]
pub(crate) struct DetectionOptions {
    /// Detection threshold in standard deviations of the background, in place of --false-alarms
    #[arg(long, value_name = "NUMBER", value_parser = values::positive, allow_hyphen_values = true,
          conflicts_with = "false_alarms")]
    pub(crate) sigma: Option<f64>,
    /// False detections to accept in a million pixels of noise [default: 0.1]
    #[arg(long, value_name = "NUMBER", value_parser = values::positive, allow_hyphen_values = true)]
    pub(crate) false_alarms: Option<f64>,
    /// How to measure a star's position
    #[arg(long, value_name = "METHOD", value_enum)]
    pub(crate) centroid: Option<Centroid>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Centroid {
    /// Fit of a Gaussian spot: the most accurate
    GaussianFit,
    /// Centre of the light above a threshold: the fastest
    GreyWeighted,
}

/// What is known of the light in a frame; lists of centroids have none.
#[derive(Debug, Args)]
#[command(next_help_heading = "What is known of the frames")]
pub(crate) struct LightOptions {
    /// How long the frames were exposed, in seconds [default: the exposure in the file's header]
    #[arg(long, value_name = "SECONDS", value_parser = values::exposure, allow_hyphen_values = true)]
    pub(crate) exposure: Option<f64>,
    /// With --camera, zenith distance of the frames' centres in degrees [default: by --site and the date, else by
    /// the header, else 0]
    #[arg(long, value_name = "DEG", value_parser = values::zenith_distance, allow_hyphen_values = true,
          requires = "camera")]
    pub(crate) zenith_distance: Option<f64>,
    /// With --camera, extinction in magnitudes for each airmass [default: the law of the sensitivity paper, 0.35
    /// in V]
    #[arg(long, value_name = "MAG", value_parser = values::extinction, allow_hyphen_values = true,
          requires = "camera")]
    pub(crate) extinction: Option<f64>,
}

/// `starpipe process`
pub(crate) fn process(arguments: ProcessArgs) -> Result<Exit, CommandError> {
    let ProcessArgs {
        frames,
        page,
        calibration,
        detection,
        light,
        solving,
    } = arguments;
    let sheet = solving.hints.data_sheet()?;
    let plan = Plan {
        detect: detection.resolve(),
        priors: Priors {
            exposure_s: light.exposure,
            ..solving.hints.resolve()?
        },
        calibration: calibration.resolve(sheet.as_ref())?,
        camera: sheet.map(|sheet| light.stated_camera(sheet)),
    };
    input::check(&frames)?;
    let (frames, troubles) = input::frames(frames);
    for trouble in &troubles {
        report_error(one_line(trouble));
    }
    let (settings, resources) = solving.resolve(&frames, FRAME_RESULTS)?;
    // Frames are large: one is kept only where it is drawn.
    let keep = settings.directory.is_some();
    let exit = solve_all(
        &frames,
        settings,
        &resources,
        &plan,
        |context, path, workspace| {
            let read = |buffers: &mut Buffers| input::read_frame(path, page, buffers);
            let (solution, frame) = solve_read(path, read, context, workspace)?;
            let frame = if keep {
                Some(frame)
            } else {
                workspace.frames.recycle(frame);
                None
            };
            Ok(Solved { solution, frame })
        },
    )?;
    Ok(if troubles.is_empty() {
        exit
    } else {
        Exit::Failure
    })
}

impl CalibrationOptions {
    /// What is to be taken out of frames, where anything is.
    pub(crate) fn resolve(&self, sheet: Option<&DataSheet>) -> anyhow::Result<Option<Calibration>> {
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
    /// How to detect stars; what is not given stays as the library has it.
    pub(crate) fn resolve(&self) -> DetectConfig {
        let mut config = DetectConfig {
            threshold_sigma: self.sigma,
            ..DetectConfig::default()
        };
        if let Some(number) = self.false_alarms {
            config.false_alarms_per_mpx = number;
        }
        if let Some(centroid) = self.centroid {
            config.centroid = match centroid {
                Centroid::GaussianFit => CentroidMethod::GaussianFit,
                Centroid::GreyWeighted => CentroidMethod::GreyWeighted,
            };
        }
        config
    }
}

impl LightOptions {
    /// The camera, the zenith distance and the extinction as the user states them.
    pub(crate) fn stated_camera(&self, sheet: DataSheet) -> StatedCamera {
        StatedCamera {
            sheet,
            zenith_distance_deg: self.zenith_distance,
            extinction: self.extinction.map(Extinction::MagPerAirmass),
        }
    }
}
