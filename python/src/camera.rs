//! Cameras, conditions and scenes by name.

use crate::errors::exception;
use pyo3::prelude::*;
use starpipe::camera::data_sheet::{CameraDescription, DataSheet, Preset};
use starpipe::lab::simulate::{Scene, Setup, SetupParameter};
use starpipe::predict::{Parameter, Reading, Scenario};
use std::path::{Path, PathBuf};

/// A parameter's name and its value.
type Value = (String, f64);

fn preset(camera: &Path) -> Option<Preset> {
    camera.to_str().and_then(Preset::named)
}

/// The description of a preset, or that in a file.
pub fn description(camera: &Path) -> PyResult<CameraDescription> {
    match preset(camera) {
        Some(preset) => Ok(preset.data_sheet().into()),
        None => CameraDescription::read(camera).map_err(exception),
    }
}

/// What Python passes of a camera and of what it looks at.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Stated {
    camera: PathBuf,
    is_paper: Option<bool>,
    values: Vec<Value>,
}

impl Stated {
    /// The preset, where the camera is one.
    pub fn preset(&self) -> Option<Preset> {
        preset(&self.camera)
    }

    /// The camera under its conditions, checked.
    pub fn scenario(&self) -> PyResult<Scenario> {
        let named = |name: &str| Parameter::named(name).map(SetupParameter::Scenario);
        let setup = self.with_values(named)?;
        setup.scenario.check().map_err(exception)?;
        Ok(setup.scenario)
    }

    /// The camera, its conditions and the scene, checked.
    pub fn setup(&self) -> PyResult<Setup> {
        let setup = self.with_values(SetupParameter::named)?;
        setup.check().map_err(exception)?;
        Ok(setup)
    }

    fn with_values<E: std::error::Error + 'static>(
        &self,
        named: impl Fn(&str) -> Result<SetupParameter, E>,
    ) -> PyResult<Setup> {
        let mut scenario = match self.preset() {
            Some(preset) => Scenario::of(preset),
            None => Scenario::new(DataSheet::read(&self.camera).map_err(exception)?),
        };
        scenario.reading = match self.is_paper {
            None => scenario.reading,
            Some(true) => Reading::Paper,
            Some(false) => Reading::Physical,
        };
        let value = |(name, value): &Value| Ok((named(name)?, *value));
        let values: Result<Vec<_>, E> = self.values.iter().map(value).collect();
        let scene = Scene::default();
        let mut setup = Setup::new(scenario);
        setup.scene = scene;
        setup
            .set_all(&values.map_err(exception)?)
            .map_err(exception)?;
        Ok(setup)
    }
}
