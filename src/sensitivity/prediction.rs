//! What is told of a scenario: its limit, the parameters it follows from, and all that lies between.

use super::budget::Budget;
use super::conditions::{Reading, Scenario, ScenarioError};
use super::parameters::Parameter;
use serde::{Serialize, Serializer};

/// The limit of a scenario with everything it follows from. The first fields are those that other programs build on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Prediction {
    /// Johnson V of the faintest star with the wanted ratio of signal to noise in its brightest pixel.
    pub limit_vmag: f64,
    /// That star's electrons on its brightest pixel.
    pub star_e: f64,
    /// Electrons of the sky in a pixel.
    pub background_e: f64,
    /// All noise of the brightest pixel, in electrons.
    pub noise_e: f64,
    /// Signal over noise in the brightest pixel.
    pub snr: f64,
    /// Thickness of the air in units of that at the zenith.
    pub airmass: f64,
    /// Every parameter that has a value, by name.
    #[serde(serialize_with = "as_map")]
    pub parameters: Vec<(&'static str, f64)>,
    /// Which equations.
    pub reading: Reading,
    /// What the camera is called.
    pub camera: String,
    /// All that lies between.
    pub budget: Budget,
}

fn as_map<S: Serializer>(
    parameters: &[(&'static str, f64)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(parameters.iter().copied())
}

impl Prediction {
    /// The prediction for a scenario.
    ///
    /// # Errors
    /// [`ScenarioError`] where the scenario makes no sense or has no limit.
    pub fn new(scenario: &Scenario) -> Result<Self, ScenarioError> {
        let budget = Budget::checked(scenario)?;
        let parameters = Parameter::all()
            .filter_map(|parameter| Some((parameter.name(), parameter.get(scenario)?)))
            .collect();
        Ok(Self {
            limit_vmag: budget.limit_vmag,
            star_e: budget.star_e,
            background_e: budget.background_e,
            noise_e: budget.noise_e,
            snr: budget.snr,
            airmass: budget.airmass,
            parameters,
            reading: scenario.reading,
            camera: scenario.sensor.name.clone(),
            budget,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensitivity::SkyBrightness;
    use crate::sensor::Preset;

    #[test]
    fn parameters_are_an_object_in_the_order_of_their_table() {
        let prediction = Prediction::new(&Scenario::of(Preset::Experiment1)).unwrap();
        let json = serde_json::to_string(&prediction).unwrap();
        assert!(
            json.contains("\"parameters\":{\"width_px\":752.0,\"height_px\":582.0,"),
            "{json}"
        );
        assert!(json.contains("\"reading\":\"paper\""), "{json}");
        assert!(
            json.contains("\"zenith_transmission\"") && !json.contains("extinction_mag"),
            "{json}"
        );
    }

    #[test]
    fn where_no_light_arrives_there_is_no_limit() {
        let mut scenario = Scenario::of(Preset::Experiment1);
        scenario.conditions.zenith_distance_deg = 89.999_999;
        let error = Prediction::new(&scenario).unwrap_err().to_string();
        assert!(
            error.starts_with("there is no limiting magnitude"),
            "{error}"
        );
        let mut scenario = Scenario::of(Preset::Experiment1);
        scenario.conditions.sky = SkyBrightness::LuminanceCdM2(1e308);
        assert!(Prediction::new(&scenario).is_err());
    }
}
