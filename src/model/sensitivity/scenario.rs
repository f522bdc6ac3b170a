//! A camera and its observing conditions.

use super::conditions::{Conditions, SkyBrightness};
use crate::camera::data_sheet::{DataSheet, Preset};
use serde::Serialize;

/// Which equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Reading {
    /// The paper's, as its authors used them.
    Paper,
    /// With the physics put right.
    Physical,
}

/// A camera under conditions, and how to reckon.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// The camera.
    pub camera: DataSheet,
    /// The conditions.
    pub conditions: Conditions,
    /// Which equations.
    pub reading: Reading,
}

impl Scenario {
    /// A camera under the default conditions, in the physical reading.
    pub fn new(camera: DataSheet) -> Self {
        Self {
            camera,
            conditions: Conditions::default(),
            reading: Reading::Physical,
        }
    }

    /// The scenario of a preset: the paper's experiments as the paper has them, other cameras under the default conditions but
    /// for the exposure.
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
