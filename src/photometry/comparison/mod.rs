//! What should the stated camera have seen in a frame, compared with what it saw?
//!
//! ([`ObservingSetup`], `FrameMeasurement`) → [`Comparison`]
//!
//! 1. The sky brightness comes from the frame itself: its background above the bias, in electrons.
//! 2. With it, the sensitivity model predicts limiting magnitudes and zero point. The fitted limit
//!    is compared with the predicted one.
//!    In wide fields whose horizon is known, it is that of all altitudes, by the airmass and the detection
//!    threshold of each.
//! 3. The detector's completeness and the stars in the field give the expected faintest star, which
//!    is compared with the faintest identified star.
//! 4. Differences that noise does not explain are reported as [`Contradiction`]s.
//!
//! Caveats: limits are those of stars of 5800 K, B−V 0.64; the predicted zero point is that of
//! stars of the same color as the measured one. A sky spectrum other than moonlight shifts the
//! predicted limit by less than its own error. A wrong bias shows as noise that does not fit.

mod contradiction;
mod measurement;

pub use contradiction::Contradiction;
pub use measurement::ObservingSetup;
pub(crate) use measurement::{FieldPosition, FieldStar, FrameMeasurement};

use super::SUN_BV_MAG;
use super::zero_point::{REFERENCE_BV_MAG, WeightedColor};
use crate::base::statistics::{Estimate, median};
use crate::camera::data_sheet::lens_transmission;
use crate::predict::{Budget, Detector, Faintest, Rule, Scenario, SkyBrightness, StarLight};

/// The prediction for a camera, and its differences from a frame.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Comparison {
    /// The camera, and the conditions as far as known.
    pub scenario: Scenario,
    /// Whether the zenith distance is known and not assumed to be 0.
    pub zenith_is_known: bool,
    /// The signal and noise budget, and the limit of the brightest pixel.
    pub budget: Budget,
    /// V magnitude at which the brightest pixel of half of the stars reaches the required
    /// signal-to-noise ratio.
    pub peak_limit_vmag: f64,
    /// V magnitude at which this detector finds half of the stars of the color for which the fitted
    /// limit holds.
    pub limit_vmag: f64,
    /// The same at the centre of the field, with the threshold that is typical of it.
    pub central_limit_vmag: f64,
    /// V magnitude at which it finds 90 % of the stars.
    pub limit90_vmag: f64,
    /// The expected faintest star among those in the field.
    pub faintest: Option<Faintest>,
    /// Sky brightness in V seen from the ground, with the camera's throughput.
    pub sky_camera_mag_arcsec2: Option<f64>,
    /// The same with the measured zero point, and its standard error.
    pub sky_mag_arcsec2: Option<Estimate>,
    /// Predicted V magnitude of a star that gives 1 ADU/s, of the color for which the measured
    /// zero point holds.
    pub zero_point_vmag: f64,
    /// Measured minus predicted zero point; above 0 the camera is more sensitive than stated.
    pub zero_point_difference_mag: Option<Estimate>,
    /// Fitted minus predicted limit.
    pub limit_difference_mag: Option<Estimate>,
    /// Faintest identified star minus the expected one; sigma is the spread of the expectation.
    pub faintest_difference_mag: Option<Estimate>,
    /// Contradictions between the frame and the stated camera.
    pub contradictions: Vec<Contradiction>,
}

/// Sky brightness of a frame without measurable sky, in mag/arcsec².
const NO_SKY_MAG: f64 = 35.0;

/// Compares a frame with the prediction for the stated camera; `None` if the exposure is unknown.
pub(crate) fn compare(stated: &ObservingSetup, frame: &FrameMeasurement) -> Option<Comparison> {
    let exposure_s = frame.exposure_s?;
    let transmissions = transmissions(frame);
    let typical = median(&mut transmissions.clone());
    let (scenario, zenith_is_known) = scenario(stated, frame, exposure_s, typical);
    let budget = Budget::new(&scenario);
    let central = central_detector(frame, &scenario, &budget);
    let differences_mag = match &frame.places {
        Some(places) => differences_by_air(places, &budget),
        None => differences_by_lens(&budget, &transmissions, typical),
    };
    let detector = central.clone().over(&differences_mag);
    let peak = Detector::new(Rule::PeakPixel, &scenario, &budget);
    let colors = frame.zero_point_colors;
    let zero_point_vmag = expected_zero_point_vmag(&scenario, colors, frame.has_color_term);
    let light = StarLight::new(&scenario);
    let at_bv_mag = frame.has_color_term.then_some(SUN_BV_MAG);
    let color_mag = fitted_color_effect_mag(&light, colors, at_bv_mag);
    let limit_vmag = detector.vmag_at(0.5) + color_mag;
    let found = |star: &FieldStar| {
        let color_mag = star.bv_mag.map_or(0.0, |bv| light.color_effect_mag(bv));
        (star.v_mag, detector.probability(star.v_mag - color_mag))
    };
    let faintest = Faintest::of(frame.field.iter().map(found));
    let minus = |measured: Option<Estimate>, predicted: f64| {
        measured.map(|Estimate { value, sigma }| Estimate {
            value: value - predicted,
            sigma,
        })
    };
    let sky = scenario.conditions.sky.mag_arcsec2();
    let sky_camera_mag_arcsec2 = (sky < NO_SKY_MAG).then_some(sky);
    let zero_point_difference_mag = minus(frame.zero_point_vmag, zero_point_vmag);
    Some(Comparison {
        zenith_is_known,
        peak_limit_vmag: peak.vmag_at(0.5),
        limit_vmag,
        central_limit_vmag: central.vmag_at(0.5) + color_mag,
        limit90_vmag: detector.vmag_at(0.9) + color_mag,
        zero_point_vmag,
        sky_camera_mag_arcsec2,
        // The difference of the zero points is one of throughput, which applies to the sky as well.
        sky_mag_arcsec2: zero_point_difference_mag.and_then(|difference| {
            Some(Estimate {
                value: sky_camera_mag_arcsec2? + difference.value,
                ..difference
            })
        }),
        zero_point_difference_mag,
        limit_difference_mag: minus(frame.limit_vmag, limit_vmag),
        faintest_difference_mag: faintest.and_then(|faintest| {
            Some(Estimate {
                value: frame.faintest_vmag? - faintest.mean_vmag,
                sigma: faintest.sigma_mag,
            })
        }),
        faintest,
        contradictions: contradiction::find(stated, frame, &budget, zero_point_difference_mag),
        budget,
        scenario,
    })
}

/// The scenario of the frame, and whether its zenith distance is known. `typical` is the median part
/// of the centre's light that arrives.
fn scenario(
    stated: &ObservingSetup,
    frame: &FrameMeasurement,
    exposure_s: f64,
    typical: f64,
) -> (Scenario, bool) {
    let mut scenario = Scenario::new(stated.sheet.clone());
    let is_above_horizon = |zenith_deg: &f64| *zenith_deg < 90.0;
    let by_site_deg = frame.zenith_distance_deg.filter(is_above_horizon);
    let zenith_deg = stated
        .zenith_distance_deg
        .or(by_site_deg)
        .or(frame.header_zenith_distance_deg);
    let conditions = &mut scenario.conditions;
    conditions.exposure_s = exposure_s;
    conditions.zenith_distance_deg = zenith_deg.filter(is_above_horizon).unwrap_or(0.0);
    conditions.extinction = stated.extinction.unwrap_or(conditions.extinction);
    // Stars are found with the spots that they have, whatever smears them.
    let sheet = &mut scenario.camera;
    sheet.spot_sigma_px = frame.spot_sigma_px.unwrap_or(sheet.spot_sigma_px);
    scenario.conditions.sky = SkyBrightness::MagArcsec2(sky_mag_arcsec2(&scenario, frame, typical));
    [scenario.camera.width_px, scenario.camera.height_px] = frame.size_px;
    (scenario, zenith_deg.is_some())
}

/// The detector with the frame's own threshold and noise, at the centre of the field.
fn central_detector(frame: &FrameMeasurement, scenario: &Scenario, budget: &Budget) -> Detector {
    let noise_e = frame.noise_adu * scenario.camera.gain_e_per_adu;
    // A frame without light has no threshold.
    let detector = match frame.threshold_sigma > 0.0 {
        true => {
            let threshold_sigma = frame.threshold_sigma;
            Detector::on_frame(threshold_sigma, noise_e, &frame.detect, scenario, budget)
        }
        false => Detector::matched_filter(&frame.detect, scenario, budget),
    };
    // The filter sees the spots alone.
    let wings_mag = -2.5 * libm::log10(1.0 + frame.wings);
    detector.over(&[wings_mag])
}

/// By how many magnitudes limits over the field differ from that of its centre, with the parts of the centre's
/// light that arrive there and their median.
fn differences_by_lens(budget: &Budget, transmissions: &[f64], typical: f64) -> Vec<f64> {
    // Where less light arrives, the sky's noise is smaller, too.
    let noise_where = |transmission: f64| {
        let sky_variance_e2 = transmission * budget.background_e;
        (budget.sensor_noise_e.powi(2) + sky_variance_e2).sqrt()
    };
    let typical_noise_e = noise_where(typical);
    let difference_mag = |&part: &f64| {
        let signal_to_noise = part * typical_noise_e / noise_where(part);
        2.5 * libm::log10(signal_to_noise.max(1e-6))
    };
    transmissions.iter().map(difference_mag).collect()
}

/// The same by the thresholds of places, and the air.
fn differences_by_air(places: &[FieldPosition], budget: &Budget) -> Vec<f64> {
    let central_mag = -2.5 * libm::log10(budget.atmosphere_transmission);
    let difference_mag =
        |place: &FieldPosition| -place.brighter_mag - central_mag * (place.airmass_ratio - 1.0);
    places.iter().map(difference_mag).collect()
}

/// Part of the centre's light that arrives, at places all over the frame.
fn transmissions(frame: &FrameMeasurement) -> Vec<f64> {
    /// Places along each side. With an odd number squared, draws in their order meet all places.
    const PLACES: usize = 15;
    let [width, height] = frame.size_px.map(|side| side as f64);
    let offset = |place: usize| (place as f64 + 0.5) / PLACES as f64 - 0.5;
    let places = (0..PLACES).flat_map(|y| (0..PLACES).map(move |x| (offset(x), offset(y))));
    let off_centre_sq = |(x, y): (f64, f64)| {
        let radius_sq = (width * width + height * height) / 4.0;
        ((x * width).powi(2) + (y * height).powi(2)) / radius_sq
    };
    places
        .map(|place| lens_transmission(frame.vignetting, off_centre_sq(place)))
        .collect()
}

/// Predicted V magnitude of a star that gives 1 ADU/s, by the same fit as the measured one: `colors`
/// and weights are those of the stars of the zero point, and `has_color_term` is whether it holds
/// for [`REFERENCE_BV_MAG`] instead of for their mean.
pub(crate) fn expected_zero_point_vmag(
    scenario: &Scenario,
    colors: &[WeightedColor],
    has_color_term: bool,
) -> f64 {
    let light = StarLight::new(scenario);
    let at_bv_mag = has_color_term.then_some(REFERENCE_BV_MAG);
    light.budget().vmag_of(scenario.camera.gain_e_per_adu, 1.0)
        + fitted_color_effect_mag(&light, colors, at_bv_mag)
}

/// By how much fainter stars are as bright as one of the scenario's temperature, according to the
/// fit of the zero point: at a color on the line through the colors of its stars, or on their
/// average.
pub(crate) fn fitted_color_effect_mag(
    light: &StarLight,
    colors: &[WeightedColor],
    at_bv_mag: Option<f64>,
) -> f64 {
    let effect_mag = |bv_mag: f64| light.color_effect_mag(bv_mag);
    let weight: f64 = colors.iter().map(|color| color.weight).sum();
    let mean = |value: &dyn Fn(f64) -> f64| {
        let weighted = colors.iter().map(|c| c.weight * value(c.bv_mag));
        weighted.sum::<f64>() / weight
    };
    if weight <= 0.0 {
        return 0.0;
    }
    let (mean_bv_mag, mean_mag) = (mean(&|bv| bv), mean(&effect_mag));
    let Some(at_bv_mag) = at_bv_mag else {
        return mean_mag;
    };
    let deviation = |bv: f64| bv - mean_bv_mag;
    let variance = mean(&|bv| deviation(bv).powi(2));
    let slope = mean(&|bv| deviation(bv) * effect_mag(bv)) / variance.max(f64::MIN_POSITIVE);
    mean_mag + slope * (at_bv_mag - mean_bv_mag)
}

/// Sky brightness of the frame's centre from its background, else from its noise; `typical` is the
/// median part of the centre's light that arrives.
fn sky_mag_arcsec2(scenario: &Scenario, frame: &FrameMeasurement, typical: f64) -> f64 {
    let sheet = &scenario.camera;
    let mut standard = scenario.clone();
    standard.conditions.sky = SkyBrightness::MagArcsec2(0.0);
    let of_mag_0 = Budget::new(&standard);
    let by_background_e =
        (frame.background_adu - sheet.bias_adu) * sheet.gain_e_per_adu - of_mag_0.dark_e;
    let noise_e = frame.noise_adu * sheet.gain_e_per_adu;
    let by_noise_e = noise_e.powi(2) - of_mag_0.sensor_noise_e.powi(2);
    // Both are medians over the frame; the sky is that of its centre.
    [by_background_e, by_noise_e]
        .into_iter()
        .map(|sky_e| sky_e / typical)
        .find(|sky_e| *sky_e > 0.0 && sky_e.is_finite())
        .map_or(NO_SKY_MAG, |sky_e| {
            2.5 * libm::log10(of_mag_0.background_e / sky_e)
        })
}

#[cfg(test)]
mod tests;
