//! What the user knows of a frame.

use crate::errors::exception;
use pyo3::prelude::*;
use starpipe::archive::Configuration;
use starpipe::base::units::{RAD_PER_ARCSEC, RAD_PER_DEG};
use starpipe::identify::{DateSource, FrameDate, Scale};
use starpipe::{ObservationDate, Priors, ScalePrior, Site, SkyRegion, UnitVector};

/// What the user knows of a frame, in degrees, arcseconds, seconds and metres.
#[derive(Debug, FromPyObject)]
#[pyo3(from_item_all)]
pub struct Hints {
    fov_deg: Option<f64>,
    pixel_scale_arcsec: Option<f64>,
    near_deg: Option<[f64; 3]>,
    date: Option<String>,
    site: Option<[f64; 3]>,
    exposure_s: Option<f64>,
    scale_error: f64,
    pub zenith_distance_deg: Option<f64>,
    pub extinction: Option<f64>,
    pub name_odds: f64,
    pub time_limit_s: Option<f64>,
}

/// Default of `scale_error`, in percent.
const DEFAULT_SCALE_ERROR_PERCENT: f64 = 10.0;

impl Hints {
    /// The same for the identity of an archive, as the program states it.
    pub fn configuration(&self) -> PyResult<Configuration> {
        let date = self.date.as_deref().map(str::parse::<ObservationDate>);
        let date = date.transpose().map_err(exception)?;
        let scale_error_percent = 100.0 * self.scale_error;
        Ok(Configuration {
            fov_deg: self.fov_deg,
            pixel_scale_arcsec: self.pixel_scale_arcsec,
            scale_error_percent: Some(scale_error_percent)
                .filter(|percent| *percent != DEFAULT_SCALE_ERROR_PERCENT),
            near_deg: self.near_deg.map(|[ra, dec, _]| [ra, dec]),
            radius_deg: self.near_deg.map(|[_, _, radius]| radius),
            date: date.map(|date| date.to_iso()),
            site: self.site,
            exposure_s: self.exposure_s,
            zenith_distance_deg: self.zenith_distance_deg,
            extinction_mag: self.extinction,
            name_odds: self.name_odds,
            time_limit_s: self.time_limit_s,
            ..Configuration::default()
        })
    }

    pub fn priors(&self) -> PyResult<Priors> {
        let fov = self
            .fov_deg
            .map(|deg| Scale::FieldOfView(deg * RAD_PER_DEG));
        let pixel = self.pixel_scale_arcsec;
        let scale = fov.or(pixel.map(|arcsec| Scale::Pixel(arcsec * RAD_PER_ARCSEC)));
        let date = self.date.as_deref().map(str::parse).transpose();
        let site = self
            .site
            .map(|[lat_deg, lon_deg, height_m]| Site::new(lat_deg, lon_deg, height_m));
        Ok(Priors {
            scale: scale.map(|scale| ScalePrior::by_user(scale, self.scale_error)),
            near: self.near_deg.map(|[ra, dec, radius]| SkyRegion {
                centre: UnitVector::from_ra_dec(ra * RAD_PER_DEG, dec * RAD_PER_DEG),
                radius_rad: radius * RAD_PER_DEG,
            }),
            date: date.map_err(exception)?.map(|date| FrameDate {
                date,
                source: DateSource::Option,
            }),
            site: site.transpose().map_err(exception)?,
            exposure_s: self.exposure_s,
        })
    }
}
