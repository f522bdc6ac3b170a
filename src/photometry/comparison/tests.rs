//! Tests of the comparison.

use super::*;
use crate::camera::data_sheet::Preset;
use crate::detect::DetectConfig;

fn stated() -> ObservingSetup {
    ObservingSetup {
        sheet: Preset::Experiment1.data_sheet(),
        zenith_distance_deg: None,
        extinction: None,
    }
}

/// A frame that the camera takes in 0.04 s under a sky of this brightness.
fn measured(sky_mag_arcsec2: f64) -> FrameMeasurement<'static> {
    let mut scenario = Scenario::new(stated().sheet);
    scenario.conditions.exposure_s = 0.04;
    scenario.conditions.sky = SkyBrightness::MagArcsec2(sky_mag_arcsec2);
    let budget = Budget::new(&scenario);
    let sheet = &scenario.camera;
    FrameMeasurement {
        detect: DetectConfig::default(),
        size_px: [752, 582],
        exposure_s: Some(0.04),
        background_adu: sheet.bias_adu + budget.background_e / sheet.gain_e_per_adu,
        noise_adu: budget.background_noise_e / sheet.gain_e_per_adu,
        threshold_sigma: 5.0,
        vignetting: 0.0,
        places: None,
        wings: 0.0,
        spot_sigma_px: Some(1.16),
        pixel_scale_rad: Some(sheet.pixel_scale_rad()),
        zenith_distance_deg: None,
        header_zenith_distance_deg: None,
        zero_point_vmag: None,
        zero_point_colors: &[],
        has_color_term: false,
        limit_vmag: None,
        faintest_vmag: None,
        field: &[],
    }
}

#[test]
fn the_sky_is_recovered_from_the_background_and_from_the_noise() {
    let by_level = compare(&stated(), &measured(16.0)).unwrap();
    assert!((by_level.budget.sky_mag_arcsec2 - 16.0).abs() < 1e-6);
    assert!(
        by_level.contradictions.is_empty(),
        "{:?}",
        by_level.contradictions
    );
    let mut frame = measured(14.0);
    frame.background_adu = 0.0;
    let by_noise = compare(&stated(), &frame).unwrap();
    assert!((by_noise.budget.sky_mag_arcsec2 - 14.0).abs() < 1e-6);
}

#[test]
fn without_an_exposure_there_is_no_prediction() {
    let mut frame = measured(18.0);
    frame.exposure_s = None;
    assert_eq!(compare(&stated(), &frame), None);
}

#[test]
fn differences_compare_like_with_like() {
    let mut frame = measured(18.0);
    let plain = compare(&stated(), &frame).unwrap();
    let star = |i: i32| FieldStar {
        v_mag: 6.0 + 0.1 * f64::from(i),
        bv_mag: None,
    };
    let field: Vec<FieldStar> = (0..60).map(star).collect();
    let at = |value| Some(Estimate { value, sigma: 0.04 });
    frame.field = &field;
    frame.limit_vmag = at(plain.limit_vmag + 0.1);
    frame.zero_point_vmag = at(plain.zero_point_vmag - 0.2);
    frame.faintest_vmag = Some(plain.limit_vmag + 0.3);
    let compared = compare(&stated(), &frame).unwrap();
    let value = |measured: Option<Estimate>| measured.unwrap().value;
    assert!((value(compared.limit_difference_mag) - 0.1).abs() < 1e-9);
    assert!((value(compared.zero_point_difference_mag) + 0.2).abs() < 1e-9);
    let expected = compared.faintest.unwrap().mean_vmag;
    let difference = frame.faintest_vmag.unwrap() - expected;
    assert!((value(compared.faintest_difference_mag) - difference).abs() < 1e-9);
}

#[test]
fn the_zero_point_is_that_of_stars_of_the_same_color() {
    let zero_point = |colors: &[f64], has_color_term| {
        let mut frame = measured(16.0);
        let colors: Vec<WeightedColor> = colors
            .iter()
            .map(|&bv_mag| WeightedColor {
                bv_mag,
                weight: 2.0,
            })
            .collect();
        frame.zero_point_colors = &colors;
        frame.has_color_term = has_color_term;
        compare(&stated(), &frame).unwrap().zero_point_vmag
    };
    let mean = |colors: &[f64]| zero_point(colors, false);
    // A black body of 5800 K has B−V 0.64. Red stars give more electrons than blue ones of the same
    // V.
    assert!((mean(&[]) - mean(&[0.643])).abs() < 1e-3);
    assert!(mean(&[1.4]) > mean(&[0.6]) + 0.1);
    // A straight line through a curve that bends upward at both ends is above it in the middle.
    let line = zero_point(&[0.0, 0.6, 1.2], true);
    assert!((line - mean(&[0.0, 0.6, 1.2])).abs() < 1e-9 && line > mean(&[0.6]) + 0.005);
    assert!((zero_point(&[0.6; 9], true) - mean(&[0.6])).abs() < 1e-9);
}

#[test]
fn a_stated_zenith_distance_has_precedence_and_none_is_below_the_horizon() {
    let zenith_distance = |by_user: Option<f64>, by_site: Option<f64>| {
        let (mut stated, mut frame) = (stated(), measured(16.0));
        stated.zenith_distance_deg = by_user;
        frame.zenith_distance_deg = by_site;
        let compared = compare(&stated, &frame).unwrap();
        let conditions = &compared.scenario.conditions;
        compared
            .zenith_is_known
            .then_some(conditions.zenith_distance_deg)
    };
    assert_eq!(zenith_distance(Some(30.0), Some(60.0)), Some(30.0));
    assert_eq!(zenith_distance(None, Some(60.0)), Some(60.0));
    assert_eq!(zenith_distance(None, Some(95.0)), None);
    assert_eq!(zenith_distance(None, None), None);
}

#[test]
fn each_contradiction_has_its_sentence() {
    let sentences = |change: &dyn Fn(&mut ObservingSetup, &mut FrameMeasurement)| {
        let (mut stated, mut frame) = (stated(), measured(16.0));
        change(&mut stated, &mut frame);
        compare(&stated, &frame)
            .unwrap()
            .contradictions
            .iter()
            .map(Contradiction::to_string)
            .collect::<Vec<_>>()
            .join("; ")
    };
    assert_eq!(sentences(&|_, _| ()), "");
    assert!(
        sentences(&|_, f| f.size_px = [100, 90]).contains("100 × 90 pixels, the camera 752 × 582")
    );
    assert!(
        sentences(&|_, f| f.pixel_scale_rad = Some(1e-4)).contains("the pixel scale is 20.63″")
    );
    assert!(
        sentences(&|_, f| f.spot_sigma_px = Some(3.0))
            .contains("3.00 px; that in the camera's description is 1.16 px")
    );
    assert!(
        sentences(&|_, f| f.background_adu = 100.0)
            .contains("level is 100.0, below the camera's bias of 128")
    );
    assert!(sentences(&|_, f| f.noise_adu *= 2.0).contains("the background noise is"));
    let zero = compare(&stated(), &measured(16.0)).unwrap().zero_point_vmag;
    let off = sentences(&|_, f| {
        let value = zero - 1.0;
        f.zero_point_vmag = Some(Estimate { value, sigma: 0.02 });
    });
    assert!(off.contains("zero point differs by -1.00 mag"), "{off}");
    let off = sentences(&|d, f| {
        d.zenith_distance_deg = Some(0.0);
        f.zenith_distance_deg = Some(56.0);
    });
    assert!(
        off.contains("stated zenith distance is 0.0°, but site, date and attitude give 56.0°"),
        "{off}"
    );
    let off = sentences(&|_, f| {
        f.header_zenith_distance_deg = Some(20.0);
        f.zenith_distance_deg = Some(56.0);
    });
    assert!(off.contains("stated zenith distance is 20.0°"), "{off}");
}

#[test]
fn the_zenith_distance_is_as_stated_else_by_the_site_else_by_the_header() {
    let mut frame = measured(18.0);
    let mut stated = stated();
    let zenith_distance = |stated: &ObservingSetup, frame: &FrameMeasurement| {
        let found = compare(stated, frame).unwrap();
        let zenith_deg = found.scenario.conditions.zenith_distance_deg;
        (zenith_deg, found.zenith_is_known)
    };
    assert_eq!(zenith_distance(&stated, &frame), (0.0, false));
    frame.header_zenith_distance_deg = Some(20.0);
    assert_eq!(zenith_distance(&stated, &frame), (20.0, true));
    frame.zenith_distance_deg = Some(30.0);
    assert_eq!(zenith_distance(&stated, &frame), (30.0, true));
    stated.zenith_distance_deg = Some(40.0);
    assert_eq!(zenith_distance(&stated, &frame), (40.0, true));
}
