use super::*;
use crate::base::coords::{Rotation, UnitVector};
use crate::base::units::RAD_PER_DEG;
use crate::camera::DistortionModel;
use crate::camera::data_sheet::{DataSheet, Preset};
use crate::catalog::{StarId, StarIndex};
use crate::ephemeris::places::StarPlaces;

fn pointing() -> Pointing {
    let boresight = UnitVector::from_ra_dec(1.0, 0.3);
    Pointing {
        icrs_to_camera: Rotation::looking_at(&boresight, 40.0 * RAD_PER_DEG),
        places: StarPlaces::default(),
    }
}

/// A star of V = 2 at this position.
fn star_at(camera: &CameraModel, x: f64, y: f64) -> Star {
    let direction = camera.direction_of(&PixelPoint::new(x, y)).unwrap();
    let on_sky = pointing().icrs_to_camera.inverse().apply(&direction);
    Star::new(StarId::Number(1), on_sky, 2.0)
}

fn small() -> Scenario {
    let mut scenario = Scenario::of(Preset::NanosatTracker);
    (scenario.camera.width_px, scenario.camera.height_px) = (300, 200);
    scenario
}

#[test]
fn square_pixels_have_the_area_of_those_that_are_not() {
    let sheet = Preset::Experiment1.data_sheet();
    let scale_rad = 1.0 / camera_of(&sheet).focal_length_px();
    assert!((scale_rad * scale_rad / sheet.pixel_solid_angle_sr() - 1.0).abs() < 1e-12);
}

#[test]
fn distortion_moves_the_corner_by_as_much_as_is_asked_for() {
    let mut sheet = small().camera;
    let plain = camera_of(&sheet);
    let moved = |sheet: &DataSheet, place: PixelPoint| {
        let camera = camera_of(sheet);
        let there = camera
            .pixel_of(&plain.direction_of(&place).unwrap())
            .unwrap();
        [there.x - place.x, there.y - place.y]
    };
    let corner = PixelPoint::new(299.5, 199.5);
    sheet.imperfections.distortion_px = 1.0;
    let [x, y] = moved(&sheet, corner);
    // Outward, except for terms of second order in the displacement.
    assert!(
        (x.hypot(y) - 1.0).abs() < 0.02 && x > 0.0 && y > 0.0,
        "{x} {y}"
    );
    assert!(camera_of(&sheet).distortion_model() == Some(DistortionModel::Radial));
    sheet.imperfections.decentring_x_px = 1.0;
    assert!(camera_of(&sheet).distortion_model() == Some(DistortionModel::BrownConrady));
    let same = moved(&sheet, plain.centre());
    assert!(same[0].abs() < 1e-6 && same[1].abs() < 1e-6);
    sheet.imperfections.distortion_px = 0.0;
    // Along x at the corner's distance: 3u² of three.
    let right = PixelPoint::new(plain.centre().x + 0.9 * plain.radius_px(), plain.centre().y);
    let [x, y] = moved(&sheet, right);
    assert!((x - 0.81).abs() < 0.02 && y.abs() < 1e-6, "{x} {y}");
}

#[test]
fn a_star_is_true_where_its_place_is_on_the_frame_and_drawn_where_its_light_is() {
    let mut scenario = Scenario::of(Preset::Experiment1);
    scenario.camera.read_noise_e = 0.0;
    let camera = camera_of(&scenario.camera);
    let stars = [
        star_at(&camera, -1.5, 300.0),
        star_at(&camera, 100.25, 200.75),
    ];
    let simulator = Simulator::new(&scenario, &Scene::default(), &stars).unwrap();
    let (frame, truth) = simulator.frame(&pointing(), 7).unwrap();
    assert_eq!((truth.stars.len(), truth.beyond.len()), (1, 1));
    let found = &truth.stars[0];
    assert_eq!((found.catalog, found.v_mag), (Some(StarIndex::new(1)), 2.0));
    assert!(found.position.distance_to(&PixelPoint::new(100.25, 200.75)) < 1e-6);
    assert!(frame.at(0, 300) > 2.0 * frame.at(0, 100));
}

#[test]
fn a_detector_without_end_is_refused() {
    let mut scenario = Scenario::of(Preset::Experiment1);
    (scenario.camera.width_px, scenario.camera.height_px) = (100_000, 100_000);
    let refused = star_field(&scenario, &[], 1);
    assert!(matches!(refused, Err(FrameError::TooLarge { .. })));
}

#[test]
fn a_frame_depends_on_its_seed_and_the_pattern_on_the_cameras() {
    let mut scenario = small();
    scenario.camera.imperfections.hot_pixels_per_mpx = 2000.0;
    let dark = |scenario: &Scenario, seed| {
        let simulator = Simulator::new(scenario, &Scene::default(), &[]).unwrap();
        simulator.dark(seed).unwrap().pixels
    };
    assert_eq!(dark(&scenario, 1), dark(&scenario, 1));
    assert_ne!(dark(&scenario, 1), dark(&scenario, 2));
    let hot = |pixels: crate::frame::Pixels| -> Vec<usize> {
        let pixels = pixels.to_f32();
        let mut order: Vec<usize> = (0..pixels.len()).collect();
        order.sort_by(|a, b| pixels[*b].total_cmp(&pixels[*a]));
        order.truncate(20);
        order
    };
    // The order of the brightest pixels changes with the noise.
    let first = hot(dark(&scenario, 1));
    let common = |others: Vec<usize>| others.iter().filter(|at| first.contains(at)).count();
    assert!(common(hot(dark(&scenario, 2))) > 12);
    scenario.camera.imperfections.pattern_seed = 2.0;
    assert!(common(hot(dark(&scenario, 1))) < 4);
}

#[test]
fn missing_stars_are_missing_and_false_ones_are_of_no_catalogue() {
    let scenario = small();
    let camera = camera_of(&scenario.camera);
    let places = (0..100).map(|i| (f64::from(i % 10), f64::from(i / 10)));
    let stars: Vec<Star> = places
        .map(|(x, y)| star_at(&camera, 30.0 * x + 10.0, 20.0 * y + 5.0))
        .collect();
    let scene = Scene {
        missing: 0.3,
        false_stars: 40.0,
        vmag_sigma: 0.5,
        ..Scene::default()
    };
    let simulator = Simulator::new(&scenario, &scene, &stars).unwrap();
    let (_, truth) = simulator.frame(&pointing(), 1).unwrap();
    let of_catalog = truth.stars.iter().filter(|star| star.catalog.is_some());
    let magnitudes: Vec<f64> = of_catalog.map(|star| star.v_mag).collect();
    // 70 ± 4.6 and 40 ± 6.3; five standard errors.
    assert!(
        (47..=93).contains(&magnitudes.len()),
        "{}",
        magnitudes.len()
    );
    assert!((9..=71).contains(&(truth.stars.len() - magnitudes.len())));
    let mean_square = magnitudes.iter().map(|v| (v - 2.0).powi(2)).sum::<f64>();
    let sigma = (mean_square / magnitudes.len() as f64).sqrt();
    assert!((sigma - 0.5).abs() < 0.25, "{sigma}");
}

#[test]
fn a_turning_camera_smears_its_stars_and_keeps_their_light() {
    let mut scenario = small();
    scenario.camera.read_noise_e = 0.0;
    scenario.camera.full_well_e = 1e9;
    scenario.camera.bits = 32;
    scenario.camera.gain_e_per_adu = 0.01;
    let camera = camera_of(&scenario.camera);
    let stars = [star_at(&camera, 150.0, 100.0)];
    let light = |scene: Scene| {
        let simulator = Simulator::new(&scenario, &scene, &stars).unwrap();
        let (frame, truth) = simulator.frame(&pointing(), 1).unwrap();
        let empty = Simulator::new(&scenario, &scene, &[]).unwrap();
        let (sky, _) = empty.frame(&pointing(), 1).unwrap();
        let sum = |frame: &Frame| frame.values().iter().map(|p| f64::from(*p)).sum::<f64>();
        let electrons = (sum(&frame) - sum(&sky)) * 0.01;
        let peak = frame.values().iter().copied().fold(0.0, f32::max);
        (electrons / truth.stars[0].electrons, peak)
    };
    let (still, peak) = light(Scene::default());
    // Half a degree a second for a tenth of a second: 6.3 px.
    let (moving, smeared_peak) = light(Scene {
        rate_y_deg_s: 0.5,
        ..Scene::default()
    });
    assert!(
        (still - 1.0).abs() < 0.03 && (moving - 1.0).abs() < 0.03,
        "{still} {moving}"
    );
    assert!(smeared_peak < 0.6 * peak, "{smeared_peak} {peak}");
}

#[test]
fn cosmic_rays_and_trails_are_where_the_truth_says() {
    let mut scenario = small();
    scenario.camera.read_noise_e = 1.0;
    let scene = Scene {
        cosmic_rays_cm2_s: 2e4,
        trails: 1.0,
        trail_vmag: 1.0,
        ..Scene::default()
    };
    let simulator = Simulator::new(&scenario, &scene, &[]).unwrap();
    let lit = (0..20).find_map(|seed| {
        let (frame, truth) = simulator.frame(&pointing(), seed).unwrap();
        (!truth.trails.is_empty() && !truth.cosmic_rays.is_empty()).then_some((frame, truth))
    });
    let (frame, truth) = lit.unwrap();
    let mut sorted = frame.values().into_owned();
    sorted.sort_by(f32::total_cmp);
    let median = sorted[sorted.len() / 2];
    let level = |place: PixelPoint| {
        let (x, y) = (place.x.round() as usize, place.y.round() as usize);
        frame.at(x.min(299), y.min(199))
    };
    assert!(level(truth.cosmic_rays[0].from) > median + 20.0);
    assert!(level(truth.trails[0].at(0.5)) > median + 5.0);
}
