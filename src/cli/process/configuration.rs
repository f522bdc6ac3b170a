//! All that the results depend on, so that results of different options are never mixed.

use super::args::{CalibrationOptions, DetectionOptions, ExposureOptions, ProcessArgs};
use crate::cli::options::hints::HintOptions;
use anyhow::Context;
use clap::ValueEnum;
use starpipe::archive::{Configuration, FileHash};
use starpipe::sky::catalog::Catalog;
use std::path::PathBuf;

/// The options as they are given; of files the hash of what is in them.
pub(super) fn configuration(
    arguments: &ProcessArgs,
    catalog: &Catalog,
) -> anyhow::Result<Configuration> {
    // Named one by one: the compiler then asks for new ones.
    let HintOptions {
        fov,
        pixel_scale,
        scale_error,
        near,
        radius,
        date,
        site,
        camera,
    } = &arguments.solving.hints;
    let CalibrationOptions {
        dark,
        flat,
        hot_pixels,
    } = &arguments.calibration;
    let DetectionOptions {
        sigma,
        false_alarms,
        max_stars,
        centroid,
    } = &arguments.detection;
    let ExposureOptions {
        exposure,
        zenith_distance,
        extinction,
    } = &arguments.exposure;
    let centroid = centroid.and_then(|method| method.to_possible_value());
    Ok(Configuration {
        catalog: catalog.into(),
        fov_deg: *fov,
        pixel_scale_arcsec: *pixel_scale,
        scale_error_percent: *scale_error,
        near_deg: near.map(|near| [near.ra_deg, near.dec_deg]),
        radius_deg: *radius,
        date: date.map(|date| date.to_iso()),
        site: site.map(|site| [site.lat_deg(), site.lon_deg(), site.height_m()]),
        camera: hash_of(camera)?,
        dark: hash_of(dark)?,
        flat: hash_of(flat)?,
        hot_pixels: hash_of(hot_pixels)?,
        sigma: *sigma,
        false_alarms: *false_alarms,
        max_stars: *max_stars,
        centroid: centroid.map(|method| method.get_name().to_owned()),
        exposure_s: *exposure,
        zenith_distance_deg: *zenith_distance,
        extinction_mag: *extinction,
        name_odds: arguments.solving.name_odds,
        attitude_only: arguments.solving.attitude_only,
        time_limit_s: Some(arguments.solving.time_limit_s),
        page: arguments.page.map(String::from),
    })
}

/// The hash of a file's content.
fn hash_of(path: &Option<PathBuf>) -> anyhow::Result<Option<FileHash>> {
    let Some(path) = path else { return Ok(None) };
    let hash = FileHash::of_file(path).with_context(|| format!("reading {}", path.display()))?;
    Ok(Some(hash))
}
