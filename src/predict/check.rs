//! Checks a scenario.

use super::light;
use super::parameters::Parameter;
use super::scenario::{Reading, Scenario};

/// Why a scenario is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScenarioError {
    /// A value outside its limits.
    #[error("{name} is {found}, expected {expected}")]
    Value {
        /// Name of the parameter.
        name: &'static str,
        /// Its value.
        found: f64,
        /// Valid values.
        expected: String,
    },
    /// Values that contradict each other.
    #[error("{0}")]
    Contradiction(String),
    /// The limiting magnitude is not finite.
    #[error(
        "there is no limiting magnitude: with {star_photons_s_m2:e} photons per second and m² from a star of V = 0 below the atmosphere, {background_e:e} electrons of sky background and a noise of {noise_e:e} electrons it would be {limit_vmag}"
    )]
    NoLimit {
        /// Its value.
        limit_vmag: f64,
        /// Photons of a star of V = 0 below the atmosphere, per second and m².
        star_photons_s_m2: f64,
        /// Sky electrons per pixel.
        background_e: f64,
        /// Noise of the brightest pixel, in electrons.
        noise_e: f64,
    },
}

impl Scenario {
    /// Checks every parameter against its limits, and the camera data for contradictions.
    ///
    /// # Errors
    /// [`ScenarioError`] for the first violation.
    pub fn check(&self) -> Result<(), ScenarioError> {
        for parameter in Parameter::all() {
            let Some(found) = parameter.get(self) else {
                continue;
            };
            if !parameter.limits().accept(found) {
                return Err(ScenarioError::Value {
                    name: parameter.name(),
                    found,
                    expected: parameter.limits().to_string(),
                });
            }
        }
        match self
            .camera
            .contradiction()
            .or_else(|| self.beyond_the_papers_table())
        {
            Some(what) => Err(ScenarioError::Contradiction(what)),
            None => Ok(()),
        }
    }

    /// [`Reading::Paper`] uses the wavelengths of the paper's table 1, whatever the camera's band.
    fn beyond_the_papers_table(&self) -> Option<String> {
        let uncovered = match self.reading {
            Reading::Paper => self
                .camera
                .uncovered(light::PAPER_BAND_NM.0, light::PAPER_BAND_NM.1),
            Reading::Physical => None,
        };
        uncovered.map(|uncovered| format!("{uncovered} of the paper's equations (reading paper)"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::{Preset, Response};

    #[test]
    fn the_papers_reading_wants_curves_over_its_own_band() {
        let mut scenario = Scenario::of(Preset::Experiment1);
        scenario.camera.quantum_efficiency = Response::Table(vec![(400.0, 0.5), (800.0, 0.5)]);
        scenario.camera.band_from_nm = 450.0;
        let error = scenario.check().unwrap_err().to_string();
        assert_eq!(
            error,
            "quantum_efficiency is known from 400 to 800 nm, which does not cover the band from 360 to 780 nm of the \
             paper's equations (reading paper)"
        );
        scenario.reading = Reading::Physical;
        assert_eq!(scenario.check(), Ok(()));
    }
}
