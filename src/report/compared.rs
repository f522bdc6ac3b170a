//! What the camera should have seen, beside what it saw.

use super::build::{AIRMASS_DECIMALS, HORIZON_DECIMALS};
use super::text::labelled;
use super::{FrameReport, MagnitudeReport, StarReport};
use crate::base::format::{finite, significant, to_decimals};
use crate::base::statistics::Estimate;
use crate::photometry::comparison::Comparison;
use serde::Serialize;

/// Decimals of a magnitude.
const MAG_DECIMALS: i32 = 3;
/// Significant digits of a charge.
const CHARGE_DIGITS: i32 = 5;

/// What the sensitivity model makes of the camera, the exposure, and the frame's own sky.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictionReport {
    /// What the camera is called.
    pub camera: String,
    /// Exposure, in seconds.
    pub exposure_s: f64,
    /// Zenith distance that was reckoned with, in degrees.
    pub zenith_distance_deg: f64,
    /// Whether it is known, and not just taken for 0.
    pub zenith_distance_known: bool,
    /// Airmass that was reckoned with.
    pub airmass: f64,
    /// V magnitude at which the detector finds half of the stars.
    pub limit50_vmag: Option<f64>,
    /// V magnitude at which it finds nine in ten.
    pub limit90_vmag: Option<f64>,
    /// V magnitude at which half of the stars have a brightest pixel that stands out by a signal-to-noise ratio of 6.
    pub peak_limit50_vmag: Option<f64>,
    /// Stars of the catalogue in the field that should be found.
    pub stars_expected: Option<f64>,
    /// V magnitude of a star that should give one ADU a second, of the B−V for which the measured zero point holds.
    pub zero_point_vmag: Option<f64>,
    /// The measured zero point minus that.
    pub zero_point_difference_mag: Option<f64>,
    /// Its standard error.
    pub zero_point_difference_sigma_mag: Option<f64>,
    /// V magnitude of the sky in a square arcsecond, as seen from the ground, with the camera's throughput.
    pub sky_camera_mag_arcsec2: Option<f64>,
    /// The same with the measured zero point: by the stars in the frame.
    pub sky_mag_arcsec2: Option<f64>,
    /// Its standard error, that of the zero point.
    pub sky_sigma_mag: Option<f64>,
    /// Electrons of the sky in a pixel.
    pub background_e: Option<f64>,
    /// Noise of a pixel without a star, in electrons.
    pub background_noise_e: Option<f64>,
    /// Noise of the sensor in it: dark current, reading, rounding.
    pub sensor_noise_e: Option<f64>,
}

fn value(estimate: Option<Estimate>) -> Option<f64> {
    estimate.and_then(|e| finite(e.value, MAG_DECIMALS))
}

fn sigma(estimate: Option<Estimate>) -> Option<f64> {
    estimate.and_then(|e| finite(e.sigma, MAG_DECIMALS))
}

impl PredictionReport {
    pub(super) fn new(compared: &Comparison) -> Self {
        let mag = |value: f64| finite(value, MAG_DECIMALS);
        let charge = |electrons: f64| significant(electrons, CHARGE_DIGITS);
        let (scenario, budget) = (&compared.scenario, &compared.budget);
        Self {
            camera: scenario.camera.name.clone(),
            exposure_s: scenario.conditions.exposure_s,
            zenith_distance_deg: to_decimals(
                scenario.conditions.zenith_distance_deg,
                HORIZON_DECIMALS,
            ),
            zenith_distance_known: compared.zenith_is_known,
            airmass: to_decimals(budget.airmass, AIRMASS_DECIMALS),
            limit50_vmag: mag(compared.limit_vmag),
            limit90_vmag: mag(compared.limit90_vmag),
            peak_limit50_vmag: mag(compared.peak_limit_vmag),
            stars_expected: compared.faintest.and_then(|f| charge(f.stars_found)),
            zero_point_vmag: mag(compared.zero_point_vmag),
            zero_point_difference_mag: value(compared.zero_point_difference_mag),
            zero_point_difference_sigma_mag: sigma(compared.zero_point_difference_mag),
            sky_camera_mag_arcsec2: compared.sky_camera_mag_arcsec2.and_then(mag),
            sky_mag_arcsec2: value(compared.sky_mag_arcsec2),
            sky_sigma_mag: sigma(compared.sky_mag_arcsec2),
            background_e: charge(budget.background_e),
            background_noise_e: charge(budget.background_noise_e),
            sensor_noise_e: charge(budget.sensor_noise_e),
        }
    }

    /// Lines of the report for people.
    pub(super) fn lines(&self, magnitude: Option<&MagnitudeReport>) -> Vec<String> {
        let known = if self.zenith_distance_known {
            ""
        } else {
            ", taken to be at the zenith"
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
                "limit V {limit:.2}, brightest pixel V {:.2}{}",
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
            format!("zero point {off} mag off the camera's")
        });
        let sky = self.sky_mag_arcsec2.or(self.sky_camera_mag_arcsec2);
        let sky = sky.map(|mag| format!("sky V {mag:.2} in a square arcsecond"));
        let text: Vec<String> = zero_point.into_iter().chain(sky).collect();
        (!text.is_empty()).then(|| labelled("", &text.join("; ")))
    }
}

fn expected_line(magnitude: &MagnitudeReport) -> Option<String> {
    let text = format!(
        "faintest V {:.2} ± {:.2}; found minus expected {:+.2}",
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
    /// Adds what `compared` says.
    pub(super) fn add_comparison(&mut self, compared: &Comparison) {
        self.prediction = Some(PredictionReport::new(compared));
        let Some(magnitude) = &mut self.magnitude else {
            return;
        };
        let mag = |value: f64| finite(value, MAG_DECIMALS);
        magnitude.predicted_limit_vmag = mag(compared.limit_vmag);
        magnitude.difference_mag = mag(magnitude.faintest_vmag - compared.limit_vmag);
        magnitude.expected_faintest_vmag = compared.faintest.and_then(|f| mag(f.mean_vmag));
        magnitude.expected_faintest_sigma_mag = compared.faintest.and_then(|f| mag(f.sigma_mag));
        magnitude.faintest_difference_mag = value(compared.faintest_difference_mag);
        magnitude.limit_difference_mag = value(compared.limit_difference_mag);
        magnitude.limit_difference_sigma_mag = sigma(compared.limit_difference_mag);
    }
}

impl StarReport {
    /// Adds the light in electrons.
    pub(super) fn add_electrons(&mut self, gain_e_per_adu: f64) {
        let electrons = |adu: f64| significant(adu * gain_e_per_adu, CHARGE_DIGITS + 1);
        self.flux_e = self.flux.and_then(electrons);
        self.peak_e = self.peak.and_then(electrons);
    }
}
