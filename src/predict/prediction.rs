//! The prediction for a scenario: its limit, the parameters, and all intermediate quantities.

use super::budget::Budget;
use super::check::ScenarioError;
use super::completeness::{Detector, Rule};
use super::parameters::Parameter;
use super::scenario::{Reading, Scenario};
use serde::{Serialize, Serializer};

/// Limiting magnitude of a scenario and everything that it follows from. Other programs read the
/// first fields.
///
/// # Example
/// ```
/// use starpipe::camera::data_sheet::Preset;
/// use starpipe::predict::{Prediction, Scenario};
///
/// let mut scenario = Scenario::of(Preset::NanosatTracker);
/// let faint = Prediction::new(&scenario)?.detector.limit50_vmag.expect("there is a limit");
/// scenario.conditions.exposure_s *= 4.0;
/// let fainter = Prediction::new(&scenario)?.detector.limit50_vmag.expect("there is a limit");
/// assert!(fainter > faint + 0.75);
/// # Ok::<(), starpipe::predict::ScenarioError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Prediction {
    /// V magnitude of the faintest star with the required SNR in its brightest pixel.
    pub limit_vmag: f64,
    /// Electrons of that star on its brightest pixel.
    pub star_e: f64,
    /// Sky electrons per pixel.
    pub background_e: f64,
    /// Total noise of the brightest pixel, in electrons.
    pub noise_e: f64,
    /// Signal-to-noise ratio of the brightest pixel.
    pub snr: f64,
    /// Airmass.
    pub airmass: f64,
    /// Name and value of every parameter that has a value.
    #[serde(serialize_with = "as_map")]
    pub parameters: Vec<(&'static str, f64)>,
    /// Set of equations.
    pub reading: Reading,
    /// Name of the camera.
    pub camera: String,
    /// Performance of the matched filter of [`detect`](crate::detect::detect).
    pub detector: DetectorReport,
    /// Performance of the peak-pixel rule.
    pub peak_pixel: DetectorReport,
    /// All intermediate quantities.
    pub budget: Budget,
}

/// Performance of a detector: limits, threshold, false alarms and completeness.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct DetectorReport {
    /// Detection rule.
    pub rule: Rule,
    /// V magnitude of 50 % completeness; none where noise alone is detected more often.
    pub limit50_vmag: Option<f64>,
    /// V magnitude of 90 % completeness; none likewise.
    pub limit90_vmag: Option<f64>,
    /// Threshold in standard deviations of the (filtered) background noise.
    pub threshold_sigma: f64,
    /// False detections per million pixels.
    pub false_alarms_per_mpx: f64,
    /// Completeness by V magnitude, around the first of these limits that exists.
    pub completeness: Vec<CompletenessPoint>,
}

/// A point of the completeness curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CompletenessPoint {
    /// V magnitude.
    pub vmag: f64,
    /// Fraction of the stars that is detected.
    pub part: f64,
}

impl DetectorReport {
    fn new(detector: &Detector) -> Self {
        /// Half width of the completeness curve, in magnitudes.
        const CURVE_REACH_MAG: f64 = 1.2;
        /// Step of the completeness curve, in magnitudes.
        const CURVE_STEP_MAG: f64 = 0.1;
        let vmag_at = |part| Some(detector.vmag_at(part)).filter(|vmag| vmag.is_finite());
        let (limit50_vmag, limit90_vmag) = (vmag_at(0.5), vmag_at(0.9));
        let steps = (CURVE_REACH_MAG / CURVE_STEP_MAG).round() as i32;
        let point = |around: f64, step: i32| {
            let middle = (around / CURVE_STEP_MAG).round();
            // A division, so that 8.3 is exactly 8.3.
            let vmag = (middle + f64::from(step)) / (1.0 / CURVE_STEP_MAG).round();
            CompletenessPoint {
                vmag,
                part: detector.probability(vmag),
            }
        };
        let curve = |around| (-steps..=steps).map(move |step| point(around, step));
        Self {
            rule: detector.rule,
            limit50_vmag,
            limit90_vmag,
            threshold_sigma: detector.threshold_sigma,
            false_alarms_per_mpx: detector.false_alarms_per_mpx,
            completeness: limit50_vmag
                .or(limit90_vmag)
                .into_iter()
                .flat_map(curve)
                .collect(),
        }
    }
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
    /// [`ScenarioError`] if the scenario is invalid or has no limit.
    pub fn new(scenario: &Scenario) -> Result<Self, ScenarioError> {
        Self::with_detector(scenario).map(|(prediction, _)| prediction)
    }

    /// The prediction, and the matched filter it describes.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn with_detector(scenario: &Scenario) -> Result<(Self, Detector), ScenarioError> {
        let budget = Budget::checked(scenario)?;
        let detector = Detector::new(Rule::MatchedFilter, scenario, &budget);
        let peak_pixel = Detector::new(Rule::PeakPixel, scenario, &budget);
        let parameters = Parameter::all()
            .filter_map(|parameter| Some((parameter.name(), parameter.get(scenario)?)))
            .collect();
        let prediction = Self {
            limit_vmag: budget.limit_vmag,
            star_e: budget.star_e,
            background_e: budget.background_e,
            noise_e: budget.noise_e,
            snr: budget.snr,
            airmass: budget.airmass,
            parameters,
            reading: scenario.reading,
            camera: scenario.camera.name.clone(),
            detector: DetectorReport::new(&detector),
            peak_pixel: DetectorReport::new(&peak_pixel),
            budget,
        };
        Ok((prediction, detector))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use crate::predict::SkyBrightness;

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
