//! A camera under its conditions, as the page states it.

use crate::told;
use serde::Deserialize;
use starpipe::camera::data_sheet::Preset;
use starpipe::lab::simulate::{Setup, SetupParameter};
use starpipe::predict::{Parameter, Reading, Scenario};
use std::collections::BTreeMap;
use wasm_bindgen::JsError;

/// A built-in camera, and the parameters that differ from it, by name.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Stated {
    preset: String,
    #[serde(default)]
    reading: Option<StatedReading>,
    #[serde(default)]
    values: BTreeMap<String, f64>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum StatedReading {
    Paper,
    Physical,
}

impl Stated {
    pub(crate) fn preset(&self) -> Result<Preset, JsError> {
        let unknown = || JsError::new(&format!("'{}' is no built-in camera", self.preset));
        Preset::named(&self.preset).ok_or_else(unknown)
    }

    /// The camera under its conditions, checked.
    pub(crate) fn scenario(&self) -> Result<Scenario, JsError> {
        let mut scenario = Scenario::of(self.preset()?);
        match self.reading {
            None => (),
            Some(StatedReading::Paper) => scenario.reading = Reading::Paper,
            Some(StatedReading::Physical) => scenario.reading = Reading::Physical,
        }
        let mut setup = Setup::new(scenario);
        let value = |(name, value): (&String, &f64)| {
            let parameter = Parameter::named(name).map_err(told)?;
            Ok((SetupParameter::Scenario(parameter), *value))
        };
        let values: Result<Vec<_>, JsError> = self.values.iter().map(value).collect();
        setup.set_all(&values?).map_err(told)?;
        setup.scenario.check().map_err(told)?;
        Ok(setup.scenario)
    }
}
