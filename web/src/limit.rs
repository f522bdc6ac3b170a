//! The limiting magnitude of a camera.

use crate::stated::Stated;
use crate::{catalogs, json, told};
use serde::{Deserialize, Serialize};
use starpipe::camera::data_sheet::Preset;
use starpipe::predict::{Parameter, PredictionRow, Scenario, Spacing, Sweep};
use wasm_bindgen::prelude::*;

/// The prediction for a camera, as `starpipe limit --format json` prints it. Until the catalog was given,
/// the faintest star to be expected is `null`.
///
/// # Errors
/// A camera that is none, values outside their limits, and a scenario without a limit.
#[wasm_bindgen]
pub fn limit(stated: &str) -> Result<String, JsError> {
    let stated: Stated = serde_json::from_str(stated).map_err(told)?;
    let (scenario, preset) = (stated.scenario()?, stated.preset()?);
    let catalog = catalogs::whole();
    let stars = *catalog.as_ref().unwrap_or(&catalogs::bright());
    let mut row = PredictionRow::new(&scenario, Some(preset), stars).map_err(told)?;
    if catalog.is_err() {
        row.faintest = None;
    }
    json(&row)
}

/// A sweep over one parameter.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StatedSweep {
    parameter: String,
    from: f64,
    to: f64,
    count: usize,
    log: bool,
}

/// The same for each value of a parameter, as an array.
///
/// # Errors
/// As [`limit`], and for a sweep that is none.
#[wasm_bindgen]
pub fn limit_curve(stated: &str, sweep: &str) -> Result<String, JsError> {
    let stated: Stated = serde_json::from_str(stated).map_err(told)?;
    let given: StatedSweep = serde_json::from_str(sweep).map_err(told)?;
    let spacing = if given.log {
        Spacing::Log
    } else {
        Spacing::Linear
    };
    let ends = [given.from, given.to];
    let sweep = Sweep::new(&given.parameter, ends, given.count, spacing).map_err(told)?;
    let preset = Some(stated.preset()?);
    json(&PredictionRow::of_sweep(&stated.scenario()?, preset, &sweep).map_err(told)?)
}

/// A built-in camera and its parameters.
#[derive(Debug, Serialize)]
struct PresetRow {
    name: &'static str,
    about: &'static str,
    parameters: Vec<ParameterRow>,
}

#[derive(Debug, Serialize)]
struct ParameterRow {
    name: &'static str,
    title: String,
    about: &'static str,
    limits: String,
    value: Option<f64>,
}

/// The built-in cameras, and the value of each of their parameters that has one.
///
/// # Errors
/// None that occur.
#[wasm_bindgen]
pub fn parameters() -> Result<String, JsError> {
    let row = |scenario: &Scenario, parameter: Parameter| ParameterRow {
        name: parameter.name(),
        title: parameter.title(),
        about: parameter.about(),
        limits: parameter.limits().to_string(),
        value: parameter.get(scenario),
    };
    let of = |preset: Preset| {
        let scenario = Scenario::of(preset);
        PresetRow {
            name: preset.name(),
            about: preset.about(),
            parameters: Parameter::all().map(|it| row(&scenario, it)).collect(),
        }
    };
    json(&Preset::ALL.map(of))
}
