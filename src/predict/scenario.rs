//! A camera and its observing conditions.

use super::conditions::{Conditions, SkyBrightness};
use crate::camera::data_sheet::{DataSheet, Preset};
use serde::Serialize;

/// Set of equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Reading {
    /// Those of the paper, as its authors used them.
    Paper,
    /// Those of the paper with corrected physics.
    Physical,
}

/// A camera, its observing conditions, and the equations to use.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Scenario {
    /// The camera.
    pub camera: DataSheet,
    /// The conditions.
    pub conditions: Conditions,
    /// Set of equations.
    pub reading: Reading,
}

impl Scenario {
    /// A camera under default conditions, with [`Reading::Physical`].
    pub fn new(camera: DataSheet) -> Self {
        Self {
            camera,
            conditions: Conditions::default(),
            reading: Reading::Physical,
        }
    }

    /// The scenario of a preset: the experiments of the paper with their own conditions and
    /// [`Reading::Paper`], other cameras under default conditions except for the exposure.
    pub fn of(preset: Preset) -> Self {
        let paper = |exposure_s, zenith_distance_deg| Self {
            camera: preset.data_sheet(),
            conditions: Conditions {
                exposure_s,
                zenith_distance_deg,
                sky: SkyBrightness::IlluminanceLx(0.01),
                ..Conditions::default()
            },
            reading: Reading::Paper,
        };
        let other = |exposure_s| {
            let mut scenario = Self::new(preset.data_sheet());
            scenario.conditions.exposure_s = exposure_s;
            scenario
        };
        match preset {
            Preset::Experiment1 => paper(0.04, 0.0),
            Preset::Experiment2 => paper(0.1, 45.0),
            Preset::NanosatTracker => other(0.1),
            Preset::Imx174 => other(0.2),
            Preset::Asi183 => other(0.5),
        }
    }
}
