//! Sweeps over a parameter of the simulated frames.

use crate::cli::options::steps::named_steps;
use crate::cli::options::values::field_of_view;
use starpipe::lab::validation::StudyParameter;
use starpipe::predict::Spacing;
use std::str::FromStr;

/// Values of one parameter.
#[derive(Debug, Clone)]
pub(crate) struct StudySweep {
    pub(crate) parameter: StudyParameter,
    pub(crate) values: Vec<f64>,
    pub(crate) spacing: Spacing,
}

impl FromStr for StudySweep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, steps) = named_steps(text)?;
        let values = steps.values()?;
        let parameter = StudyParameter::named(&name).map_err(|error| error.to_string())?;
        values
            .iter()
            .try_for_each(|&value| check(parameter, value))?;
        Ok(Self {
            parameter,
            values,
            spacing: steps.spacing,
        })
    }
}

fn check(parameter: StudyParameter, value: f64) -> Result<(), String> {
    match parameter {
        StudyParameter::FieldOfView => field_of_view(&value.to_string()).map(drop),
        StudyParameter::Setup(parameter) if parameter.limits().accept(value) => Ok(()),
        StudyParameter::Setup(parameter) => Err(format!(
            "{} would be {value}, expected {}",
            parameter.name(),
            parameter.limits()
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_study_may_be_over_the_field_of_view() {
        let sweep: StudySweep = "fov-deg=5:20:4".parse().unwrap();
        assert_eq!(sweep.values, [5.0, 10.0, 15.0, 20.0]);
        assert!(matches!(sweep.parameter, StudyParameter::FieldOfView));
        for (text, expected) in [
            ("fov_deg=20:5:4", "expected increasing values"),
            ("fov_deg=5:180:4", "below 180 degrees"),
            ("fov_deg=0:20:4", "above 0"),
            ("apertur=5:20:4", "did you mean 'aperture_mm'?"),
            ("aperture_mm=5:20", "is not of the form NAME=FROM:TO:COUNT"),
        ] {
            let error = text.parse::<StudySweep>().unwrap_err();
            assert!(error.contains(expected), "{error}");
        }
    }
}
