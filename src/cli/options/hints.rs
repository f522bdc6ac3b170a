//! Hints: what is known of the frames in advance.

use super::observer::ObserverOptions;
use super::stated::with_stated;
use crate::cli::exit::CommandError;
use anyhow::Context as _;
use clap::Args;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use starpipe::camera::data_sheet::CameraDescription;
use starpipe::camera::formats::{from_opencv_yaml_within, from_platepar_within};
use starpipe::camera::{CameraModel, KnownLens};
use starpipe::ephemeris::places::AttitudeFrame;
use starpipe::solve::SolveOptions;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[derive(Debug, Args, Serialize)]
#[command(next_help_heading = "Hints")]
pub(crate) struct HintOptions {
    /// Horizontal field of view in degrees
    #[arg(
        long,
        value_name = "DEG",
        allow_hyphen_values = true,
        conflicts_with = "pixel_scale"
    )]
    fov: Option<String>,
    /// Pixel scale in arcseconds per pixel
    #[arg(long, value_name = "ARCSEC", allow_hyphen_values = true)]
    pixel_scale: Option<String>,
    /// Tolerance of --fov or --pixel-scale, in percent [default: 10]
    #[arg(long, value_name = "PERCENT", allow_hyphen_values = true)]
    scale_error: Option<String>,
    #[command(flatten)]
    #[serde(flatten)]
    direction: DirectionOptions,
    /// Maximum distance of the frame's center from --near, in degrees [default: 10]
    #[arg(
        long,
        value_name = "DEG",
        allow_hyphen_values = true,
        requires = "direction"
    )]
    radius: Option<String>,
    /// Date and time of the frames, as ISO 8601, in UTC unless it has an offset; used for proper motion
    /// and aberration [default: the date in the file's header, else in its name, else 2000]
    #[arg(long, value_name = "ISO8601", allow_hyphen_values = true)]
    date: Option<String>,
    /// Offset of local time from UTC in hours, positive if ahead; applies to times in file names and in
    /// Exif that state no offset. auto determines it from the stars and --site. Dates in FITS headers
    /// are UTC [default: unknown; UTC is assumed, and refraction is not corrected]
    #[arg(long, value_name = "HOURS|auto", allow_hyphen_values = true)]
    utc_offset: Option<String>,
    #[command(flatten)]
    #[serde(flatten)]
    observer: ObserverOptions,
    /// Star directions that the attitude refers to
    #[arg(long, value_name = "DIRECTIONS", value_enum, default_value_t)]
    frame_of: AttitudeFrame,
    /// Description of the camera, see `starpipe camera new`. It gives the scale if no option does, and
    /// a predicted limiting magnitude if the exposure is known. If it has a lens measured by
    /// `starpipe calibrate`, that lens is used. A lens of OpenCV or ROS (.yaml) and an RMS platepar
    /// (.cal) are also accepted
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    pub(crate) camera: Option<PathBuf>,
    /// Fit the lens to each frame, even if --camera has a measured one
    #[arg(long, requires = "camera")]
    refine_lens: bool,
}

#[derive(Debug, Args)]
#[group(id = "direction")]
struct DirectionOptions {
    /// Approximate direction of the frame's center, in degrees or as 05h35m17s,-05d23m28s; tried first
    #[arg(long, value_name = "RA,DEC", allow_hyphen_values = true)]
    near: Option<String>,
    /// Right ascension of the same, in degrees or as 05h35m17s
    #[arg(
        long,
        value_name = "RA",
        allow_hyphen_values = true,
        requires = "dec",
        conflicts_with = "near"
    )]
    ra: Option<String>,
    /// Declination of the same, in degrees or as -05d23m28s
    #[arg(
        long,
        value_name = "DEC",
        allow_hyphen_values = true,
        requires = "ra",
        conflicts_with = "near"
    )]
    dec: Option<String>,
}

/// As the library names it, however it is stated.
impl Serialize for DirectionOptions {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let parts = self.ra.as_ref().zip(self.dec.as_ref());
        let joined = parts.map(|(ra, dec)| format!("{ra},{dec}"));
        let mut map = serializer.serialize_map(Some(1))?;
        map.serialize_entry("near", &joined.as_ref().or(self.near.as_ref()))?;
        map.end()
    }
}

/// Largest error of a lens that is read from a file of another program: well below those that it is
/// taken to have.
const READ_WITHIN_PX: f64 = 0.1;

impl HintOptions {
    /// The defaults with the hints that are given.
    pub(crate) fn options(&self) -> Result<SolveOptions, CommandError> {
        if self.scale_error.is_some() && self.fov.is_none() && self.pixel_scale.is_none() {
            return Err(CommandError::usage(
                "--scale-error needs --fov or --pixel-scale",
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
