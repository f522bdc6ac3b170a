//! Hints: what is known of the frames in advance.

use super::observer::ObserverOptions;
use super::values;
use crate::cli::exit::CommandError;
use anyhow::Context as _;
use clap::{Args, ValueEnum};
use starpipe::UtcOffset;
use starpipe::base::epoch::ObservationDate;
use starpipe::camera::data_sheet::CameraDescription;
use starpipe::camera::formats::{from_opencv_yaml_within, from_platepar_within};
use starpipe::camera::{CameraModel, KnownLens};
use starpipe::ephemeris::places::AttitudeFrame;
use starpipe::solve::SolveOptions;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[derive(Debug, Args)]
#[command(next_help_heading = "What is known of the frames")]
pub(crate) struct HintOptions {
    /// Horizontal field of view in degrees
    #[arg(long, value_name = "DEG", value_parser = values::field_of_any_lens, allow_hyphen_values = true,
          conflicts_with = "pixel_scale")]
    pub(crate) fov: Option<f64>,
    /// Angle of a pixel in arcseconds
    #[arg(long, value_name = "ARCSEC", value_parser = values::pixel_scale, allow_hyphen_values = true)]
    pub(crate) pixel_scale: Option<f64>,
    /// Tolerance of --fov or --pixel-scale, in percent [default: 10]
    #[arg(long, value_name = "PERCENT", value_parser = values::percent, allow_hyphen_values = true)]
    pub(crate) scale_error: Option<f64>,
    /// Approximate direction of the frame's centre, in degrees or as 05h35m17s,-05d23m28s
    #[arg(long, value_name = "RA,DEC", value_parser = values::direction, allow_hyphen_values = true)]
    pub(crate) near: Option<values::Direction>,
    /// Maximum distance of the frame's center from --near, in degrees [default: 10]
    #[arg(long, value_name = "DEG", value_parser = values::radius, allow_hyphen_values = true,
          requires = "near")]
    pub(crate) radius: Option<f64>,
    /// When the frames were taken, as ISO 8601, in UTC unless it has an offset; used for proper motion
    /// and aberration [default: of frames, the date in the file's header, else in its name; else 2000]
    #[arg(long, value_name = "ISO8601", allow_hyphen_values = true)]
    pub(crate) date: Option<ObservationDate>,
    /// How many hours local times are ahead of UTC: those in names of files and in Exif, unless they say;
    /// auto finds it by the stars over --site. Dates in FITS headers are UTC [default: not known, and such
    /// a time tells no refraction]
    #[arg(long, value_name = "HOURS|auto", allow_hyphen_values = true)]
    pub(crate) utc_offset: Option<UtcOffset>,
    #[command(flatten)]
    observer: ObserverOptions,
    /// Which directions the attitude refers to
    #[arg(long, value_name = "DIRECTIONS", value_enum, default_value_t = FrameOf::Icrs)]
    frame_of: FrameOf,
    /// Description of the camera, see `starpipe camera new`: gives the scale if no option does, and
    /// a predicted limiting magnitude for frames whose exposure is known. Its lens, where
    /// `starpipe calibrate` has measured one, is held. Also a lens of OpenCV or ROS (.yaml), or a platepar
    /// of RMS (.cal)
    #[arg(long, value_name = "FILE")]
    pub(crate) camera: Option<PathBuf>,
    /// Fit the lens to each frame, although --camera has one that `starpipe calibrate` measured
    #[arg(long, requires = "camera")]
    refine_lens: bool,
}

/// Which directions an attitude refers to.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum FrameOf {
    /// Those of the catalogue at the date: coordinates of what is in the centre
    Icrs,
    /// Those from which light reaches the camera: how the camera itself is turned
    Apparent,
}

impl From<FrameOf> for AttitudeFrame {
    fn from(frame: FrameOf) -> Self {
        match frame {
            FrameOf::Icrs => Self::Icrs,
            FrameOf::Apparent => Self::Apparent,
        }
    }
}

/// Largest error of a lens that is read from a file of another program: well below those that it is
/// taken to have.
const READ_WITHIN_PX: f64 = 0.1;

impl HintOptions {
    /// The defaults with the hints that are given.
    pub(crate) fn options(&self) -> Result<SolveOptions, CommandError> {
        if self.scale_error.is_some() && self.fov.or(self.pixel_scale).is_none() {
            return Err(CommandError::usage(
                "--scale-error is the error of --fov or --pixel-scale; give one of these, too",
            ));
        }
        let mut options = SolveOptions::default();
        options.fov_deg = self.fov;
        options.pixel_scale_arcsec = self.pixel_scale;
        options.near_deg = self.near.map(|near| [near.ra_deg, near.dec_deg]);
        options.date = self.date;
        options.utc_offset = self.utc_offset;
        options.refine_lens = self.refine_lens;
        options.attitude_frame = self.frame_of.into();
        options.site = self.observer.site();
        options.velocity_km_s = self.observer.velocity_km_s();
        set(&mut options.scale_error_percent, self.scale_error);
        set(&mut options.radius_deg, self.radius);
        Ok(options)
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

/// Replaces a default by what is given.
pub(crate) fn set<T>(default: &mut T, given: Option<T>) {
    if let Some(given) = given {
        *default = given;
    }
}
