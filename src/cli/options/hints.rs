//! Hints: what is known of the frames in advance.

use super::values;
use crate::cli::exit::CommandError;
use clap::Args;
use starpipe::base::coords::UnitVector;
use starpipe::base::epoch::ObservationDate;
use starpipe::base::units::{RAD_PER_ARCSEC, RAD_PER_DEG};
use starpipe::camera::data_sheet::DataSheet;
use starpipe::identify::{
    DateSource, FrameDate, Priors, Scale, ScalePrior, ScaleSource, SkyRegion,
};
use starpipe::sky::observer::Site;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(next_help_heading = "What is known of the frames")]
pub(crate) struct HintOptions {
    /// Horizontal field of view in degrees
    #[arg(long, value_name = "DEG", value_parser = values::field_of_view, allow_hyphen_values = true,
          conflicts_with = "pixel_scale")]
    pub(crate) fov: Option<f64>,
    /// Angle of a pixel in arcseconds
    #[arg(long, value_name = "ARCSEC", value_parser = values::pixel_scale, allow_hyphen_values = true)]
    pub(crate) pixel_scale: Option<f64>,
    /// How far --fov or --pixel-scale may be off, in percent [default: 10]
    #[arg(long, value_name = "PERCENT", value_parser = values::percent, allow_hyphen_values = true)]
    pub(crate) scale_error: Option<f64>,
    /// Approximate direction of the frame's centre, in degrees
    #[arg(long, value_name = "RA,DEC", value_parser = values::direction, allow_hyphen_values = true,
          requires = "radius")]
    pub(crate) near: Option<values::Direction>,
    /// How far from --near the frame's centre may lie, in degrees
    #[arg(long, value_name = "DEG", value_parser = values::radius, allow_hyphen_values = true,
          requires = "near")]
    pub(crate) radius: Option<f64>,
    /// When the frames were taken, as ISO 8601, in UTC unless it has an offset; used for proper
    /// motion [default: of frames, the date in the file's header, else in its name; else 2000]
    #[arg(long, value_name = "ISO8601", allow_hyphen_values = true)]
    pub(crate) date: Option<ObservationDate>,
    /// Where they were taken: latitude and longitude (north and east positive) in degrees, and
    /// height in metres; with the date, gives zenith distance and airmass
    #[arg(long, value_name = "LAT,LON[,HEIGHT_M]", allow_hyphen_values = true)]
    pub(crate) site: Option<Site>,
    /// Description of the camera, see `starpipe camera new`: gives the scale if no option does, and
    /// a predicted limiting magnitude for frames whose exposure is known
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) camera: Option<PathBuf>,
}

/// Default of --scale-error, in percent.
const DEFAULT_SCALE_ERROR_PERCENT: f64 = 10.0;

impl HintOptions {
    /// The hints, without the camera's.
    pub(crate) fn resolve(&self) -> Result<Priors, CommandError> {
        let fov = self.fov.map(|deg| Scale::FieldOfView(deg * RAD_PER_DEG));
        let pixel = self
            .pixel_scale
            .map(|arcsec| Scale::Pixel(arcsec * RAD_PER_ARCSEC));
        let scale = fov.or(pixel);
        if scale.is_none() && self.scale_error.is_some() {
            return Err(CommandError::usage(
                "--scale-error is the error of --fov or --pixel-scale; give one of these, too",
            ));
        }
        let tolerance = self.scale_error.unwrap_or(DEFAULT_SCALE_ERROR_PERCENT) / 100.0;
        let near = self.near.zip(self.radius).map(|(direction, radius_deg)| {
            let ra_rad = direction.ra_deg * RAD_PER_DEG;
            let dec_rad = direction.dec_deg * RAD_PER_DEG;
            SkyRegion {
                centre: UnitVector::from_ra_dec(ra_rad, dec_rad),
                radius_rad: radius_deg * RAD_PER_DEG,
            }
        });
        Ok(Priors {
            scale: scale.map(|scale| ScalePrior::by_user(scale, tolerance)),
            near,
            date: self.date.map(|date| FrameDate {
                date,
                source: DateSource::Option,
            }),
            site: self.site,
            exposure_s: None,
        })
    }

    /// The hints, with the camera's scale as a hard constraint if no other is given.
    pub(crate) fn resolve_with_camera(&self) -> Result<Priors, CommandError> {
        let sheet = self.data_sheet()?;
        let priors = self.resolve()?;
        let of_camera = sheet.as_ref().map(|sheet| ScalePrior {
            source: ScaleSource::User,
            ..ScalePrior::of_camera(sheet)
        });
        Ok(Priors {
            scale: priors.scale.or(of_camera),
            ..priors
        })
    }

    /// The camera, if one is given.
    pub(crate) fn data_sheet(&self) -> anyhow::Result<Option<DataSheet>> {
        let read = |path: &PathBuf| Ok(DataSheet::read(path)?);
        self.camera.as_ref().map(read).transpose()
    }
}
