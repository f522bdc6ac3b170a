//! What the page states of a frame.

use crate::told;
use serde::Deserialize;
use starpipe::ephemeris::observer::Site;
use starpipe::identify::Effort;
use starpipe::{ObservationDate, SolveOptions};
use std::num::NonZeroUsize;
use wasm_bindgen::JsError;

/// The options, named as those of `starpipe process` with their units; what is absent has its default.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Stated {
    fov_deg: Option<f64>,
    pixel_scale_arcsec: Option<f64>,
    scale_error_percent: Option<f64>,
    near_deg: Option<[f64; 2]>,
    radius_deg: Option<f64>,
    date: Option<String>,
    site: Option<[f64; 2]>,
    sigma: Option<f64>,
    thorough: bool,
    sky: bool,
    time_limit_s: Option<f64>,
    /// Of a file with several.
    image: Option<NonZeroUsize>,
}

/// The options of the library, and the number of the image that is meant.
///
/// # Errors
/// JSON that is none, and values outside their limits.
pub(crate) fn resolve(text: &str) -> Result<(SolveOptions, Option<NonZeroUsize>), JsError> {
    let stated: Stated = serde_json::from_str(text).map_err(told)?;
    let mut options = SolveOptions::default();
    options.fov_deg = within("the field of view", stated.fov_deg, 0.0, 360.0)?;
    options.pixel_scale_arcsec = within("the pixel scale", stated.pixel_scale_arcsec, 0.0, 36e3)?;
    options.near_deg = stated.near_deg;
    let error = within("the scale's error", stated.scale_error_percent, 0.0, 100.0)?;
    options.scale_error_percent = error.unwrap_or(options.scale_error_percent);
    let radius = within("the radius", stated.radius_deg, 0.0, 180.0)?;
    options.radius_deg = radius.unwrap_or(options.radius_deg);
    let date = stated.date.map(|date| date.parse::<ObservationDate>());
    options.date = date.transpose().map_err(told)?;
    let site = stated
        .site
        .map(|[lat_deg, lon_deg]| Site::new(lat_deg, lon_deg, 0.0));
    options.site = site.transpose().map_err(told)?;
    options.sigma = within("sigma", stated.sigma, 0.0, 1e6)?;
    if stated.thorough {
        options.effort = Effort::Thorough;
    }
    options.sky = stated.sky;
    // Who waits may end it.
    options.time_limit_s = stated.time_limit_s;
    Ok((options, stated.image))
}

/// A value above `low` and up to `high`.
fn within(name: &str, value: Option<f64>, low: f64, high: f64) -> Result<Option<f64>, JsError> {
    match value {
        Some(value) if !(value > low && value <= high) => Err(JsError::new(&format!(
            "{name} is {value}, expected more than {low} and up to {high}"
        ))),
        value => Ok(value),
    }
}
