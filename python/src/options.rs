//! What is stated for frames.

use crate::errors::exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use starpipe::detect::CentroidMethod;
use starpipe::ephemeris::observer::Air;
use starpipe::ephemeris::places::AttitudeFrame;
use starpipe::identify::Effort;
use starpipe::solve::SolveOptions;
use starpipe::{ObservationDate, Site, UtcOffset};

/// The options as Python has checked them; `None` stands for the default.
#[derive(Debug, FromPyObject)]
#[pyo3(from_item_all)]
pub struct Options {
    fov_deg: Option<f64>,
    pixel_scale_arcsec: Option<f64>,
    scale_error_percent: f64,
    near_deg: Option<[f64; 2]>,
    radius_deg: f64,
    date: Option<String>,
    utc_offset: Option<String>,
    site: Option<[f64; 3]>,
    air: Option<[f64; 2]>,
    velocity_km_s: Option<[f64; 3]>,
    frame_of: String,
    exposure_s: Option<f64>,
    zenith_distance_deg: Option<f64>,
    extinction_mag_per_airmass: Option<f64>,
    sigma: Option<f64>,
    false_alarms_per_mpx: Option<f64>,
    max_stars: Option<usize>,
    centroid: Option<String>,
    name_odds: f64,
    effort: String,
    refine_lens: bool,
    attitude_only: bool,
    sky: bool,
    trails: bool,
    time_limit_s: Option<f64>,
}

impl Options {
    /// The options of the library.
    pub fn resolve(&self) -> PyResult<SolveOptions> {
        let mut options = SolveOptions::default();
        let date = self.date.as_deref().map(str::parse::<ObservationDate>);
        let site = self
            .site
            .map(|[lat_deg, lon_deg, height_m]| Site::new(lat_deg, lon_deg, height_m));
        options.fov_deg = self.fov_deg;
        options.pixel_scale_arcsec = self.pixel_scale_arcsec;
        options.scale_error_percent = self.scale_error_percent;
        options.near_deg = self.near_deg;
        options.radius_deg = self.radius_deg;
        options.date = date.transpose().map_err(exception)?;
        let offset = self.utc_offset.as_deref().map(str::parse::<UtcOffset>);
        options.utc_offset = offset.transpose().map_err(exception)?;
        let site = site.transpose().map_err(exception)?;
        let air = self.air.map(|[hpa, celsius]| Air::new(hpa, celsius));
        options.site = site.map(|site| air.map_or(site, |air| site.with_air(air)));
        options.velocity_km_s = self.velocity_km_s;
        options.attitude_frame = attitude_frame(&self.frame_of)?;
        options.exposure_s = self.exposure_s;
        options.zenith_distance_deg = self.zenith_distance_deg;
        options.extinction_mag_per_airmass = self.extinction_mag_per_airmass;
        options.sigma = self.sigma;
        options.name_odds = self.name_odds;
        options.effort = effort(&self.effort)?;
        options.refine_lens = self.refine_lens;
        options.attitude_only = self.attitude_only;
        options.sky = self.sky;
        options.trails = self.trails;
        options.time_limit_s = self.time_limit_s;
        if let Some(false_alarms) = self.false_alarms_per_mpx {
            options.false_alarms_per_mpx = false_alarms;
        }
        if let Some(max_stars) = self.max_stars {
            options.max_stars = max_stars;
        }
        if let Some(centroid) = &self.centroid {
            options.centroid = centroid_method(centroid)?;
        }
        Ok(options)
    }
}

fn attitude_frame(name: &str) -> PyResult<AttitudeFrame> {
    match name {
        "icrs" => Ok(AttitudeFrame::Icrs),
        "apparent" => Ok(AttitudeFrame::Apparent),
        other => Err(PyValueError::new_err(format!(
            "frame_of must be 'icrs' or 'apparent', not '{other}'"
        ))),
    }
}

fn effort(name: &str) -> PyResult<Effort> {
    match name {
        "fast" => Ok(Effort::Fast),
        "normal" => Ok(Effort::Normal),
        "thorough" => Ok(Effort::Thorough),
        other => Err(PyValueError::new_err(format!(
            "effort must be 'fast', 'normal' or 'thorough', not '{other}'"
        ))),
    }
}

fn centroid_method(name: &str) -> PyResult<CentroidMethod> {
    match name {
        "gaussian-fit" => Ok(CentroidMethod::GaussianFit),
        "grey-weighted" => Ok(CentroidMethod::GreyWeighted),
        other => Err(PyValueError::new_err(format!(
            "centroid must be 'gaussian-fit' or 'grey-weighted', not '{other}'"
        ))),
    }
}
