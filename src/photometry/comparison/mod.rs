//! What a camera should have seen in a frame, beside what it saw.
//!
//! ([`StatedCamera`], [`FrameMeasurement`]) → [`Comparison`]
//!
//! 1. The sky comes from the frame itself: its level above the bias, in the camera's electrons.
//! 2. With it, the sensitivity model gives the limits and the zero point that the camera should have.
//! 3. The detector's completeness and the stars in the field give the faintest star to be expected: that is what the
//!    faintest star found is held against. The fitted limit is held against the predicted one.
//! 4. Where the frame contradicts its description, a sentence says so.
//!
//! Caveats: limits are those of stars of 5800 K, B−V 0.64; the zero point is that of stars of the colour that the measured one
//! holds for. The sky's brightness, where it is not that of the whole spectrum of moonlight, shifts the predicted limit by less
//! than its own error; a bias that is not the camera's shows as noise that does not fit.

mod contradiction;

use crate::base::statistics::Estimate;
use crate::camera::data_sheet::DataSheet;
use crate::detect::DetectConfig;
use crate::model::sensitivity::{
    Budget, Detector, Extinction, Faintest, Rule, Scenario, SkyBrightness, StarLight,
};
use crate::photometry::zero_point::REFERENCE_BV_MAG;
pub use contradiction::Contradiction;

/// What is stated of the frame.
#[derive(Debug, Clone, PartialEq)]
pub struct StatedCamera {
    /// The camera.
    pub sheet: DataSheet,
    /// Zenith distance of the frame's centre, in degrees; else that of site and date, else that of the header, else 0.
    pub zenith_distance_deg: Option<f64>,
    /// What the air takes away; else the model's own.
    pub extinction: Option<Extinction>,
}

/// What the frame shows; what is not known is `None`.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameMeasurement<'a> {
    /// How stars were detected.
    pub detect: DetectConfig,
    /// Columns and rows.
    pub size_px: [usize; 2],
    /// Exposure, in seconds.
    pub exposure_s: Option<f64>,
    /// Median level of the background, in ADU.
    pub level_adu: f64,
    /// Standard deviation of one pixel, in ADU.
    pub noise_adu: f64,
    /// Standard deviation of a star's spot, in pixels, where stars tell it.
    pub spot_sigma_px: Option<f64>,
    /// The angle that a pixel spans, in radians.
    pub pixel_scale_rad: Option<f64>,
    /// Apparent zenith distance of the centre by site, date and attitude, in degrees; above 90 below the horizon.
    pub zenith_distance_deg: Option<f64>,
    /// Zenith distance of the centre by the file's header, in degrees: where the mount believed it pointed.
    pub header_zenith_distance_deg: Option<f64>,
    /// V magnitude of a star that gives one ADU a second.
    pub zero_point_vmag: Option<Estimate>,
    /// B−V of the stars that it is from, where known.
    pub zero_point_colors_mag: &'a [f64],
    /// Whether it is that of [`REFERENCE_BV_MAG`], with a term linear in the colour, and not that of all those stars.
    pub has_color_term: bool,
    /// V magnitude at which half of the stars are found.
    pub limit_vmag: Option<Estimate>,
    /// V magnitude of the faintest star identified.
    pub faintest_vmag: Option<f64>,
    /// V magnitudes of the catalogue's stars in the field, to its end: what the frame shows does not bound what it should.
    pub field_vmag: &'a [f64],
}

/// What the camera should have seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Camera, conditions as far as they are known, and reading.
    pub scenario: Scenario,
    /// Whether the zenith distance is known and not just taken for 0.
    pub zenith_is_known: bool,
    /// From the star to the limit of the brightest pixel.
    pub budget: Budget,
    /// V magnitude at which half of the stars have a brightest pixel above the wanted signal-to-noise ratio.
    pub peak_limit_vmag: f64,
    /// V magnitude at which half of the stars are found by the detector as built.
    pub limit_vmag: f64,
    /// V magnitude at which nine in ten are found.
    pub limit90_vmag: f64,
    /// The faintest star to be expected among those in the field.
    pub faintest: Option<Faintest>,
    /// V magnitude of the sky in a square arcsecond, as seen from the ground, with the camera's throughput.
    pub sky_camera_mag_arcsec2: Option<f64>,
    /// The same with the measured zero point, and the error of that.
    pub sky_mag_arcsec2: Option<Estimate>,
    /// V magnitude of a star that should give one ADU a second, of the colour for which the measured zero point holds.
    pub zero_point_vmag: f64,
    /// Zero point measured minus predicted: above 0 the camera is more sensitive than described.
    pub zero_point_difference_mag: Option<Estimate>,
    /// The fitted limit minus the predicted one.
    pub limit_difference_mag: Option<Estimate>,
    /// The faintest star found minus the one to be expected; the error is the spread of that.
    pub faintest_difference_mag: Option<Estimate>,
    /// Where the frame contradicts the stated camera.
    pub contradictions: Vec<Contradiction>,
}

/// A sky that gives no light to speak of, in mag/arcsec².
const NO_SKY_MAG: f64 = 35.0;

/// What `description` predicts of a frame that shows `seen`; `None` where the exposure is not known.
pub fn compare(description: &StatedCamera, seen: &FrameMeasurement) -> Option<Comparison> {
    let exposure_s = seen.exposure_s?;
    let mut scenario = Scenario::new(description.sheet.clone());
    let conditions = &mut scenario.conditions;
    conditions.exposure_s = exposure_s;
    let by_site_deg = seen.zenith_distance_deg.filter(|z| *z < 90.0);
    let stated_deg = description.zenith_distance_deg;
    let known_zenith_deg = stated_deg
        .or(by_site_deg)
        .or(seen.header_zenith_distance_deg);
    // Of the horizon itself there is no limit.
    conditions.zenith_distance_deg = known_zenith_deg.filter(|z| *z < 90.0).unwrap_or(0.0);
    conditions.extinction = description.extinction.unwrap_or(conditions.extinction);
    scenario.conditions.sky = SkyBrightness::MagArcsec2(sky_mag_arcsec2(&scenario, seen));
    let [width_px, height_px] = seen.size_px;
    (scenario.camera.width_px, scenario.camera.height_px) = (width_px, height_px);
    let budget = Budget::new(&scenario);
    let detector = Detector::matched_filter(&seen.detect, &scenario, &budget);
    let peak = Detector::new(Rule::PeakPixel, &scenario, &budget);
    let zero_point_vmag = zero_point_vmag(&scenario, seen);
    let limit_vmag = detector.vmag_at(0.5);
    let faintest = Faintest::among(seen.field_vmag.iter().copied(), &detector);
    let minus = |measured: Option<Estimate>, predicted: f64| {
        measured.map(|Estimate { value, sigma }| Estimate {
            value: value - predicted,
            sigma,
        })
    };
    let sky = scenario.conditions.sky.mag_arcsec2();
    let sky_camera_mag_arcsec2 = (sky < NO_SKY_MAG).then_some(sky);
    let zero_point_difference_mag = minus(seen.zero_point_vmag, zero_point_vmag);
    let comparison = Comparison {
        zenith_is_known: known_zenith_deg.is_some(),
        peak_limit_vmag: peak.vmag_at(0.5),
        limit_vmag,
        limit90_vmag: detector.vmag_at(0.9),
        zero_point_vmag,
        sky_camera_mag_arcsec2,
        // The zero point's difference is the camera's in throughput, and the sky's light goes through it as the stars' does.
        sky_mag_arcsec2: zero_point_difference_mag.and_then(|off| {
            Some(Estimate {
                value: sky_camera_mag_arcsec2? + off.value,
                ..off
            })
        }),
        zero_point_difference_mag,
        limit_difference_mag: minus(seen.limit_vmag, limit_vmag),
        faintest_difference_mag: faintest.and_then(|faintest| {
            Some(Estimate {
                value: seen.faintest_vmag? - faintest.mean_vmag,
                sigma: faintest.sigma_mag,
            })
        }),
        faintest,
        contradictions: Vec::new(),
        budget,
        scenario,
    };
    let contradictions = contradictions(description, seen, &comparison);
    Some(Comparison {
        contradictions,
        ..comparison
    })
}

/// V magnitude that stars of the colours seen, treated as the frame's are, would give for one ADU a second.
fn zero_point_vmag(scenario: &Scenario, seen: &FrameMeasurement) -> f64 {
    let gain_e_per_adu = scenario.camera.gain_e_per_adu;
    let light = StarLight::new(scenario);
    let of_a_second = light.budget().vmag_of(gain_e_per_adu, 1.0);
    let zero_point = |bv_mag: &f64| of_a_second + light.color_effect_mag(*bv_mag);
    let colors = seen.zero_point_colors_mag;
    let mean = |value: &dyn Fn(&f64) -> f64| {
        colors.iter().map(value).sum::<f64>() / colors.len().max(1) as f64
    };
    if colors.is_empty() {
        return of_a_second;
    }
    let (mean_bv_mag, mean_vmag) = (mean(&|bv| *bv), mean(&zero_point));
    if !seen.has_color_term {
        return mean_vmag;
    }
    let off = |bv: &f64| bv - mean_bv_mag;
    let spread = mean(&|bv| off(bv).powi(2));
    let slope = mean(&|bv| off(bv) * zero_point(bv)) / spread.max(f64::MIN_POSITIVE);
    mean_vmag + slope * (REFERENCE_BV_MAG - mean_bv_mag)
}

/// The sky's brightness by the frame's level, else by its noise.
fn sky_mag_arcsec2(scenario: &Scenario, seen: &FrameMeasurement) -> f64 {
    let sheet = &scenario.camera;
    let mut standard = scenario.clone();
    standard.conditions.sky = SkyBrightness::MagArcsec2(0.0);
    let of_mag_0 = Budget::new(&standard);
    let by_level_e = (seen.level_adu - sheet.bias_adu) * sheet.gain_e_per_adu - of_mag_0.dark_e;
    let noise_e = seen.noise_adu * sheet.gain_e_per_adu;
    let by_noise_e = noise_e.powi(2) - of_mag_0.sensor_noise_e.powi(2);
    [by_level_e, by_noise_e]
        .into_iter()
        .find(|sky_e| *sky_e > 0.0)
        .map_or(NO_SKY_MAG, |sky_e| {
            2.5 * (of_mag_0.background_e / sky_e).log10()
        })
}

/// A scale off by more than this part is another lens, or binned pixels.
const SCALE_TOLERANCE: f64 = 0.05;
/// Noise off by more than this factor is another gain or another bias.
const NOISE_TOLERANCE: f64 = 1.5;
/// A spot off by more than this factor is another focus.
const SPOT_TOLERANCE: f64 = 1.5;
/// A zero point off by more than this has a reason.
const ZERO_POINT_TOLERANCE_MAG: f64 = 0.5;
/// Zenith distances this far apart, beyond the field itself, are not of one frame, in degrees.
const ZENITH_TOLERANCE_DEG: f64 = 1.0;

fn contradictions(
    description: &StatedCamera,
    seen: &FrameMeasurement,
    found: &Comparison,
) -> Vec<Contradiction> {
    let sheet = &description.sheet;
    let noise_e = seen.noise_adu * sheet.gain_e_per_adu;
    let stated_px = [sheet.width_px, sheet.height_px];
    let stated_scale_rad = sheet.pixel_scale_rad();
    let size = (seen.size_px != stated_px).then_some(Contradiction::Size {
        frame_px: seen.size_px,
        camera_px: stated_px,
    });
    let scale = seen
        .pixel_scale_rad
        .filter(|scale_rad| is_off(*scale_rad, stated_scale_rad, 1.0 + SCALE_TOLERANCE))
        .map(|measured_rad| Contradiction::PixelScale {
            measured_rad,
            camera_rad: stated_scale_rad,
        });
    let spot = seen
        .spot_sigma_px
        .filter(|spot_px| is_off(*spot_px, sheet.spot_sigma_px, SPOT_TOLERANCE))
        .map(|measured_px| Contradiction::SpotSize {
            measured_px,
            camera_px: sheet.spot_sigma_px,
        });
    let is_below_bias = seen.level_adu < sheet.bias_adu - seen.noise_adu;
    let level = is_below_bias.then_some(Contradiction::BelowBias {
        background_adu: seen.level_adu,
        bias_adu: sheet.bias_adu,
    });
    let noise = is_off(noise_e, found.budget.background_noise_e, NOISE_TOLERANCE).then_some(
        Contradiction::Noise {
            measured_e: noise_e,
            expected_e: found.budget.background_noise_e,
        },
    );
    let all = [
        size,
        scale,
        spot,
        level,
        noise,
        found.zero_point_difference_mag.and_then(zero_point_off),
        zenith_distance_off(description, seen),
    ];
    all.into_iter().flatten().collect()
}

fn is_off(found: f64, stated: f64, factor: f64) -> bool {
    found > stated * factor || found < stated / factor
}

fn zero_point_off(difference: Estimate) -> Option<Contradiction> {
    let Estimate { value, sigma } = difference;
    let is_off = value.abs() > ZERO_POINT_TOLERANCE_MAG.max(5.0 * sigma);
    is_off.then_some(Contradiction::ZeroPoint {
        difference_mag: value,
    })
}

fn zenith_distance_off(
    description: &StatedCamera,
    seen: &FrameMeasurement,
) -> Option<Contradiction> {
    let stated_deg = description.zenith_distance_deg;
    let stated_deg = stated_deg.or(seen.header_zenith_distance_deg)?;
    let observed_deg = seen.zenith_distance_deg?;
    let half_px = seen.size_px[0].max(seen.size_px[1]) as f64 / 2.0;
    let half_field_deg = seen
        .pixel_scale_rad
        .map_or(0.0, |rad| (half_px * rad).to_degrees());
    let apart_deg = (stated_deg - observed_deg).abs();
    (apart_deg > ZENITH_TOLERANCE_DEG + half_field_deg).then_some(Contradiction::ZenithDistance {
        stated_deg,
        observed_deg,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;

    fn description() -> StatedCamera {
        StatedCamera {
            sheet: Preset::Experiment1.data_sheet(),
            zenith_distance_deg: None,
            extinction: None,
        }
    }

    /// A frame such as the camera takes under a sky of this brightness in 0.04 s.
    fn seen(sky_mag_arcsec2: f64) -> FrameMeasurement<'static> {
        let mut scenario = Scenario::new(description().sheet);
        scenario.conditions.exposure_s = 0.04;
        scenario.conditions.sky = SkyBrightness::MagArcsec2(sky_mag_arcsec2);
        let budget = Budget::new(&scenario);
        let sheet = &scenario.camera;
        FrameMeasurement {
            detect: DetectConfig::default(),
            size_px: [752, 582],
            exposure_s: Some(0.04),
            level_adu: sheet.bias_adu + budget.background_e / sheet.gain_e_per_adu,
            noise_adu: budget.background_noise_e / sheet.gain_e_per_adu,
            spot_sigma_px: Some(1.2),
            pixel_scale_rad: Some(sheet.pixel_scale_rad()),
            zenith_distance_deg: None,
            header_zenith_distance_deg: None,
            zero_point_vmag: None,
            zero_point_colors_mag: &[],
            has_color_term: false,
            limit_vmag: None,
            faintest_vmag: None,
            field_vmag: &[],
        }
    }

    #[test]
    fn the_sky_is_read_back_from_the_level_and_from_the_noise() {
        let by_level = compare(&description(), &seen(16.0)).unwrap();
        assert!((by_level.budget.sky_mag_arcsec2 - 16.0).abs() < 1e-6);
        assert!(
            by_level.contradictions.is_empty(),
            "{:?}",
            by_level.contradictions
        );
        let mut frame = seen(14.0);
        frame.level_adu = 0.0;
        let by_noise = compare(&description(), &frame).unwrap();
        assert!((by_noise.budget.sky_mag_arcsec2 - 14.0).abs() < 1e-6);
    }

    #[test]
    fn without_an_exposure_there_is_no_prediction() {
        let mut frame = seen(18.0);
        frame.exposure_s = None;
        assert_eq!(compare(&description(), &frame), None);
    }

    #[test]
    fn differences_are_of_like_with_like() {
        let mut frame = seen(18.0);
        let plain = compare(&description(), &frame).unwrap();
        let field: Vec<f64> = (0..60).map(|i| 6.0 + 0.1 * f64::from(i)).collect();
        let at = |value| Some(Estimate { value, sigma: 0.04 });
        frame.field_vmag = &field;
        frame.limit_vmag = at(plain.limit_vmag + 0.1);
        frame.zero_point_vmag = at(plain.zero_point_vmag - 0.2);
        frame.faintest_vmag = Some(plain.limit_vmag + 0.3);
        let held = compare(&description(), &frame).unwrap();
        let value = |measured: Option<Estimate>| measured.unwrap().value;
        assert!((value(held.limit_difference_mag) - 0.1).abs() < 1e-9);
        assert!((value(held.zero_point_difference_mag) + 0.2).abs() < 1e-9);
        let expected = held.faintest.unwrap().mean_vmag;
        let difference = frame.faintest_vmag.unwrap() - expected;
        assert!((value(held.faintest_difference_mag) - difference).abs() < 1e-9);
    }

    #[test]
    fn the_zero_point_is_that_of_stars_of_the_same_color() {
        let zero_point = |colors: &[f64], has_color_term| {
            let mut frame = seen(16.0);
            frame.zero_point_colors_mag = colors;
            frame.has_color_term = has_color_term;
            compare(&description(), &frame).unwrap().zero_point_vmag
        };
        let mean = |colors: &[f64]| zero_point(colors, false);
        // A black body of 5800 K has B−V 0.64. Red stars give more electrons than blue ones of the same V.
        assert!((mean(&[]) - mean(&[0.643])).abs() < 1e-3);
        assert!(mean(&[1.4]) > mean(&[0.6]) + 0.1);
        // A straight line through a curve that bends upward at both ends is above it in the middle.
        let line = zero_point(&[0.0, 0.6, 1.2], true);
        assert!((line - mean(&[0.0, 0.6, 1.2])).abs() < 1e-9 && line > mean(&[0.6]) + 0.005);
        assert!((zero_point(&[0.6; 9], true) - mean(&[0.6])).abs() < 1e-9);
    }

    #[test]
    fn a_zenith_distance_that_is_stated_counts_before_one_that_follows_and_none_is_below_the_horizon()
     {
        let reckoned = |stated: Option<f64>, by_site: Option<f64>| {
            let (mut description, mut frame) = (description(), seen(16.0));
            description.zenith_distance_deg = stated;
            frame.zenith_distance_deg = by_site;
            let held = compare(&description, &frame).unwrap();
            let conditions = &held.scenario.conditions;
            held.zenith_is_known
                .then_some(conditions.zenith_distance_deg)
        };
        assert_eq!(reckoned(Some(30.0), Some(60.0)), Some(30.0));
        assert_eq!(reckoned(None, Some(60.0)), Some(60.0));
        assert_eq!(reckoned(None, Some(95.0)), None);
        assert_eq!(reckoned(None, None), None);
    }

    #[test]
    fn each_contradiction_has_its_sentence() {
        let told = |change: &dyn Fn(&mut StatedCamera, &mut FrameMeasurement)| {
            let (mut stated, mut frame) = (description(), seen(16.0));
            change(&mut stated, &mut frame);
            compare(&stated, &frame)
                .unwrap()
                .contradictions
                .iter()
                .map(Contradiction::to_string)
                .collect::<Vec<_>>()
                .join("; ")
        };
        assert_eq!(told(&|_, _| ()), "");
        assert!(
            told(&|_, f| f.size_px = [100, 90]).contains("100 × 90 pixels, the camera 752 × 582")
        );
        assert!(told(&|_, f| f.pixel_scale_rad = Some(1e-4)).contains("a pixel spans 20.63″"));
        assert!(
            told(&|_, f| f.spot_sigma_px = Some(3.0)).contains("3.00 px, the camera's 1.16 px")
        );
        assert!(
            told(&|_, f| f.level_adu = 100.0)
                .contains("level is 100.0, below the camera's bias of 128")
        );
        assert!(told(&|_, f| f.noise_adu *= 2.0).contains("the background's noise is"));
        let zero = compare(&description(), &seen(16.0))
            .unwrap()
            .zero_point_vmag;
        let off = told(&|_, f| {
            let value = zero - 1.0;
            f.zero_point_vmag = Some(Estimate { value, sigma: 0.02 });
        });
        assert!(off.contains("zero point is -1.00 mag off"), "{off}");
        let off = told(&|d, f| {
            d.zenith_distance_deg = Some(0.0);
            f.zenith_distance_deg = Some(56.0);
        });
        assert!(
            off.contains("stated as 0.0°, by site, date and attitude it is 56.0°"),
            "{off}"
        );
        let off = told(&|_, f| {
            f.header_zenith_distance_deg = Some(20.0);
            f.zenith_distance_deg = Some(56.0);
        });
        assert!(off.contains("stated as 20.0°"), "{off}");
    }

    #[test]
    fn the_zenith_distance_is_as_stated_else_by_the_site_else_by_the_header() {
        let mut frame = seen(18.0);
        let mut stated = description();
        let reckoned = |stated: &StatedCamera, frame: &FrameMeasurement| {
            let found = compare(stated, frame).unwrap();
            let zenith_deg = found.scenario.conditions.zenith_distance_deg;
            (zenith_deg, found.zenith_is_known)
        };
        assert_eq!(reckoned(&stated, &frame), (0.0, false));
        frame.header_zenith_distance_deg = Some(20.0);
        assert_eq!(reckoned(&stated, &frame), (20.0, true));
        frame.zenith_distance_deg = Some(30.0);
        assert_eq!(reckoned(&stated, &frame), (30.0, true));
        stated.zenith_distance_deg = Some(40.0);
        assert_eq!(reckoned(&stated, &frame), (40.0, true));
    }
}
