//! Hints: what is known of the frames in advance.

use super::observer::ObserverOptions;
use super::stated::with_stated;
use crate::cli::exit::CommandError;
use anyhow::Context as _;
use clap::Args;
use serde::Serialize;
use starpipe::camera::data_sheet::CameraDescription;
use starpipe::camera::formats::{from_opencv_yaml_within, from_platepar_within};
use starpipe::camera::{CameraModel, KnownLens};
use starpipe::ephemeris::places::AttitudeFrame;
use starpipe::solve::SolveOptions;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[derive(Debug, Args, Serialize)]
#[command(next_help_heading = "What is known of the frames")]
pub(crate) struct HintOptions {
    /// Horizontal field of view in degrees
    #[arg(
        long,
        value_name = "DEG",
        allow_hyphen_values = true,
        conflicts_with = "pixel_scale"
    )]
    fov: Option<String>,
    /// Angle of a pixel in arcseconds
    #[arg(long, value_name = "ARCSEC", allow_hyphen_values = true)]
    pixel_scale: Option<String>,
    /// Tolerance of --fov or --pixel-scale, in percent [default: 10]
    #[arg(long, value_name = "PERCENT", allow_hyphen_values = true)]
    scale_error: Option<String>,
    /// Approximate direction of the frame's centre, in degrees or as 05h35m17s,-05d23m28s
    #[arg(long, value_name = "RA,DEC", allow_hyphen_values = true)]
    near: Option<String>,
    /// Maximum distance of the frame's center from --near, in degrees [default: 10]
    #[arg(
        long,
        value_name = "DEG",
        allow_hyphen_values = true,
        requires = "near"
    )]
    radius: Option<String>,
    /// When the frames were taken, as ISO 8601, in UTC unless it has an offset; used for proper motion
    /// and aberration [default: of frames, the date in the file's header, else in its name; else 2000]
    #[arg(long, value_name = "ISO8601", allow_hyphen_values = true)]
    date: Option<String>,
    /// How many hours local times are ahead of UTC: those in names of files and in Exif, unless they say;
    /// auto finds it by the stars over --site. Dates in FITS headers are UTC [default: not known, and such
    /// a time tells no refraction]
    #[arg(long, value_name = "HOURS|auto", allow_hyphen_values = true)]
    utc_offset: Option<String>,
    #[command(flatten)]
    #[serde(flatten)]
    observer: ObserverOptions,
    /// Which directions the attitude refers to
    #[arg(long, value_name = "DIRECTIONS", value_enum, default_value_t)]
    frame_of: AttitudeFrame,
    /// Description of the camera, see `starpipe camera new`: gives the scale if no option does, and
    /// a predicted limiting magnitude for frames whose exposure is known. Its lens, where
    /// `starpipe calibrate` has measured one, is held. Also a lens of OpenCV or ROS (.yaml), or a platepar
    /// of RMS (.cal)
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    pub(crate) camera: Option<PathBuf>,
    /// Fit the lens to each frame, although --camera has one that `starpipe calibrate` measured
    #[arg(long, requires = "camera")]
    refine_lens: bool,
}

/// Largest error of a lens that is read from a file of another program: well below those that it is
/// taken to have.
const READ_WITHIN_PX: f64 = 0.1;

impl HintOptions {
    /// The defaults with the hints that are given.
    pub(crate) fn options(&self) -> Result<SolveOptions, CommandError> {
        if self.scale_error.is_some() && self.fov.is_none() && self.pixel_scale.is_none() {
            return Err(CommandError::usage(
                "--scale-error is the error of --fov or --pixel-scale; give one of these, too",
            ));
        }
        with_stated(SolveOptions::default(), self)
    }

    /// The camera, if one is given.
    pub(crate) fn description(&self) -> anyhow::Result<Option<CameraDescription>> {
        let read = |path: &PathBuf| match path.extension().and_then(OsStr::to_str) {
            Some("yaml" | "yml") => lens_of(path, |text| {
                Ok(from_opencv_yaml_within(text, READ_WITHIN_PX)?)
            }),
            Some("cal" | "json") => lens_of(path, |text| {
                Ok(from_platepar_within(text, READ_WITHIN_PX)?.0)
            }),
            _ => Ok(CameraDescription::read(path)?),
        };
        self.camera.as_ref().map(read).transpose()
    }
}

/// The lens in a file of another program.
fn lens_of(
    path: &Path,
    read: impl FnOnce(&str) -> anyhow::Result<CameraModel>,
) -> anyhow::Result<CameraDescription> {
    let in_file = || format!("reading {}", path.display());
    let text = std::fs::read_to_string(path).with_context(in_file)?;
    let camera = read(&text).with_context(in_file)?;
    Ok(CameraDescription {
        sheet: None,
        lens: KnownLens::with_assumed_errors(camera).map(Arc::new),
    })
}
