//! The prediction for the stated camera, and the comparison with it.

use super::digits::{AIRMASS_DECIMALS, HORIZON_DECIMALS};
use super::frame_report::{FrameReport, MagnitudeReport, PredictionReport, StarReport};
use super::text::labelled;
use crate::base::format::{finite, significant, to_decimals};
use crate::base::statistics::Estimate;
use crate::photometry::comparison::Comparison;

/// Decimals of a magnitude.
const MAG_DECIMALS: i32 = 3;
/// Significant digits of a charge.
const CHARGE_DIGITS: i32 = 5;

fn value(estimate: Option<Estimate>) -> Option<f64> {
    estimate.and_then(|e| finite(e.value, MAG_DECIMALS))
}

fn sigma(estimate: Option<Estimate>) -> Option<f64> {
    estimate.and_then(|e| finite(e.sigma, MAG_DECIMALS))
}

impl PredictionReport {
    fn new(comparison: &Comparison) -> Self {
        let mag = |value: f64| finite(value, MAG_DECIMALS);
        let charge = |electrons: f64| significant(electrons, CHARGE_DIGITS);
        let (scenario, budget) = (&comparison.scenario, &comparison.budget);
        Self {
            camera: scenario.camera.name.clone(),
            exposure_s: scenario.conditions.exposure_s,
            zenith_distance_deg: to_decimals(
                scenario.conditions.zenith_distance_deg,
                HORIZON_DECIMALS,
            ),
            zenith_distance_known: comparison.zenith_is_known,
            airmass: to_decimals(budget.airmass, AIRMASS_DECIMALS),
            limit50_vmag: mag(comparison.limit_vmag),
            limit90_vmag: mag(comparison.limit90_vmag),
            peak_limit50_vmag: mag(comparison.peak_limit_vmag),
            stars_expected: comparison.faintest.and_then(|f| charge(f.stars_found)),
            zero_point_vmag: mag(comparison.zero_point_vmag),
            zero_point_difference_mag: value(comparison.zero_point_difference_mag),
            zero_point_difference_sigma_mag: sigma(comparison.zero_point_difference_mag),
            sky_camera_mag_arcsec2: comparison.sky_camera_mag_arcsec2.and_then(mag),
            sky_mag_arcsec2: value(comparison.sky_mag_arcsec2),
            sky_sigma_mag: sigma(comparison.sky_mag_arcsec2),
            background_e: charge(budget.background_e),
            background_noise_e: charge(budget.background_noise_e),
            sensor_noise_e: charge(budget.sensor_noise_e),
        }
    }

    /// The lines of the text report.
    pub(super) fn lines(&self, magnitude: Option<&MagnitudeReport>) -> Vec<String> {
        let known = if self.zenith_distance_known {
            ""
        } else {
            ", assuming it points to the zenith"
        };
        let mut lines = vec![labelled(
            "camera",
            &format!(
                "{}; {} s at airmass {:.2}{known}",
                self.camera, self.exposure_s, self.airmass
            ),
        )];
        lines.extend(self.limit50_vmag.map(|limit| {
            let measured = magnitude.and_then(|m| {
                Some(format!(
                    "; measured minus predicted {}",
                    difference(m.limit_difference_mag?, m.limit_difference_sigma_mag)
                ))
            });
            let text = format!(
                "limit V {limit:.2} (brightest pixel V {:.2}){}",
                self.peak_limit50_vmag.unwrap_or(f64::NAN),
                measured.unwrap_or_default()
            );
            labelled("predicted", &text)
        }));
        lines.extend(magnitude.and_then(expected_line));
        lines.extend(self.light_line());
        lines
    }

    fn light_line(&self) -> Option<String> {
        let zero_point = self.zero_point_difference_mag.map(|mag| {
            let off = difference(mag, self.zero_point_difference_sigma_mag);
            format!("zero point {off} mag relative to the prediction")
        });
        let sky = self.sky_mag_arcsec2.or(self.sky_camera_mag_arcsec2);
        let sky = sky.map(|mag| format!("sky V {mag:.2} mag/arcsec²"));
        let text: Vec<String> = zero_point.into_iter().chain(sky).collect();
        (!text.is_empty()).then(|| labelled("", &text.join("; ")))
    }
}

fn expected_line(magnitude: &MagnitudeReport) -> Option<String> {
    let text = format!(
        "expected faintest star V {:.2} ± {:.2}; measured minus predicted {:+.2}",
        magnitude.expected_faintest_vmag?,
        magnitude.expected_faintest_sigma_mag?,
        magnitude.faintest_difference_mag?,
    );
    Some(labelled("", &text))
}

fn difference(mag: f64, sigma: Option<f64>) -> String {
    match sigma {
        Some(sigma) => format!("{mag:+.2} ± {sigma:.2}"),
        None => format!("{mag:+.2}"),
    }
}

impl FrameReport {
    /// Adds the prediction, and the differences from it.
    pub(super) fn add_comparison(&mut self, comparison: &Comparison) {
        self.prediction = Some(PredictionReport::new(comparison));
        let Some(magnitude) = &mut self.magnitude else {
            return;
        };
        let mag = |value: f64| finite(value, MAG_DECIMALS);
        magnitude.predicted_limit_vmag = mag(comparison.limit_vmag);
        magnitude.difference_mag = mag(magnitude.faintest_vmag - comparison.limit_vmag);
        magnitude.expected_faintest_vmag = comparison.faintest.and_then(|f| mag(f.mean_vmag));
        magnitude.expected_faintest_sigma_mag = comparison.faintest.and_then(|f| mag(f.sigma_mag));
        magnitude.faintest_difference_mag = value(comparison.faintest_difference_mag);
        magnitude.limit_difference_mag = value(comparison.limit_difference_mag);
        magnitude.limit_difference_sigma_mag = sigma(comparison.limit_difference_mag);
    }
}

impl StarReport {
    /// Adds flux and peak in electrons.
    pub(super) fn add_electrons(&mut self, gain_e_per_adu: f64) {
        let electrons = |adu: f64| significant(adu * gain_e_per_adu, CHARGE_DIGITS + 1);
        self.flux_e = self.flux.and_then(electrons);
        self.peak_e = self.peak.and_then(electrons);
    }
}
