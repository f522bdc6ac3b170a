//! Sweeps over a parameter of the simulated frames.

use crate::cli::options::steps::{Steps, named_steps};
use crate::cli::options::values::field_of_view;
use starpipe::base::units::RAD_PER_DEG;
use starpipe::camera::focal_length_px;
use starpipe::model::sensitivity::Spacing;
use starpipe::model::simulate;
use std::str::FromStr;

/// What a study is over.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Studied {
    /// A parameter of the camera, of the conditions, or of the scene.
    Parameter(simulate::Parameter),
    /// The horizontal field of view, in degrees: the focal length follows it, pixels and spot stay as they are.
    FieldOfView,
}

impl Studied {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.name(),
            Self::FieldOfView => FIELD_OF_VIEW,
        }
    }

    /// What an axis of it is called.
    pub(crate) fn title(self) -> String {
        match self {
            Self::Parameter(parameter) => parameter.title(),
            Self::FieldOfView => "horizontal field of view (°)".to_owned(),
        }
    }

    pub(crate) fn set(self, setup: &mut simulate::Setup, value: f64) {
        match self {
            Self::Parameter(parameter) => parameter.set(setup, value),
            Self::FieldOfView => {
                let sheet = &mut setup.scenario.camera;
                let pitch_um = (sheet.pitch_x_um * sheet.pitch_y_um).sqrt();
                let focal_px = focal_length_px(sheet.width_px as f64, value * RAD_PER_DEG);
                sheet.focal_length_mm = focal_px * pitch_um * 1e-3;
            }
        }
    }
}

const FIELD_OF_VIEW: &str = "fov_deg";

/// A sweep of a study.
#[derive(Debug, Clone)]
pub(crate) struct StudySweep {
    pub(crate) studied: Studied,
    pub(crate) values: Vec<f64>,
    pub(crate) spacing: Spacing,
}

impl FromStr for StudySweep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, steps) = named_steps(text)?;
        let Steps {
            ends,
            count,
            spacing,
        } = steps;
        let values = spacing
            .checked_values(ends, count)
            .map_err(|error| error.to_string())?;
        let studied = if name == FIELD_OF_VIEW {
            Studied::FieldOfView
        } else {
            let found = simulate::Parameter::named(&name);
            Studied::Parameter(found.map_err(|error| error.to_string())?)
        };
        for &value in &values {
            match studied {
                Studied::FieldOfView => drop(field_of_view(&value.to_string())?),
                Studied::Parameter(parameter) if !parameter.limits().accept(value) => {
                    let expected = parameter.limits();
                    return Err(format!("{name} would be {value}, expected {expected}"));
                }
                Studied::Parameter(_) => (),
            }
        }
        Ok(Self {
            studied,
            values,
            spacing,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use starpipe::model::sensitivity;

    #[test]
    fn a_study_may_be_over_the_field_of_view() {
        let sweep: StudySweep = "fov-deg=5:20:4".parse().unwrap();
        assert_eq!(sweep.values, [5.0, 10.0, 15.0, 20.0]);
        let mut setup = simulate::Setup {
            scenario: sensitivity::Scenario::of(
                starpipe::camera::data_sheet::Preset::NanosatTracker,
            ),
            scene: simulate::Scene::default(),
        };
        sweep.studied.set(&mut setup, 10.0);
        let scenario = setup.scenario;
        let half_width_um = 0.5 * scenario.camera.width_px as f64 * scenario.camera.pitch_x_um;
        let half_rad = (half_width_um * 1e-3 / scenario.camera.focal_length_mm).atan();
        assert!((2.0 * half_rad.to_degrees() - 10.0).abs() < 1e-9);
        for (text, expected) in [
            ("fov_deg=20:5:4", "expected a rising one"),
            ("fov_deg=5:180:4", "below 180 degrees"),
            ("fov_deg=0:20:4", "above 0, ..."),
            ("apertur=5:20:4", "did you mean 'aperture_mm'?"),
            ("aperture_mm=5:20", "is not of the form NAME=FROM:TO:COUNT"),
        ] {
            let error = text.parse::<StudySweep>().unwrap_err();
            let expected = expected.trim_end_matches(", ...");
            assert!(error.contains(expected), "{error}");
        }
    }
}
