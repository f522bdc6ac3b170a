//! Simulated frames compared with their physics.

use starpipe::base::coords::PixelPoint;
use starpipe::camera::data_sheet::Preset;
use starpipe::frame::Frame;
use starpipe::lab::simulate::star_field;
use starpipe::predict::{Budget, Scenario};

/// Tolerance of measured means and variances, in standard errors.
const SIGMAS: f64 = 4.5;

/// The paper's camera, with less noise, so that the light is measurable.
fn scenario() -> Scenario {
    let mut scenario = Scenario::of(Preset::Experiment2);
    scenario.camera.read_noise_e = 12.0;
    scenario.camera.dark_current_e_s = 400.0;
    scenario.camera.gain_e_per_adu = 2.0;
    scenario
}

fn electrons(frame: &Frame, scenario: &Scenario) -> Vec<f64> {
    let sheet = &scenario.camera;
    let electrons = |&adu: &f32| (f64::from(adu) - sheet.bias_adu) * sheet.gain_e_per_adu;
    frame.values().iter().map(electrons).collect()
}

fn mean_and_variance(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares = values.iter().map(|value| (value - mean).powi(2));
    (mean, squares.sum::<f64>() / (count - 1.0))
}

#[test]
fn the_sky_has_its_mean_and_its_noise() {
    let scenario = scenario();
    let budget = Budget::new(&scenario);
    let frame = star_field(&scenario, &[], 5).unwrap();
    let (mean, variance) = mean_and_variance(&electrons(&frame, &scenario));
    let light_e = budget.background_e + budget.dark_e;
    // The paper's budget has no rounding, whose variance is a twelfth of a step squared.
    let gain = scenario.camera.gain_e_per_adu;
    let expected = light_e + 12f64.powi(2) + gain * gain / 12.0;
    let count = frame.pixels.len() as f64;
    assert!(
        (mean - light_e).abs() < SIGMAS * (expected / count).sqrt(),
        "{mean} {light_e}"
    );
    assert!(
        (variance / expected - 1.0).abs() < SIGMAS * (2.0 / count).sqrt(),
        "{variance} {expected}"
    );
}

#[test]
fn a_star_has_its_electrons_and_their_noise() {
    const STARS: u64 = 300;
    let mut scenario = scenario();
    (scenario.camera.width_px, scenario.camera.height_px) = (21, 21);
    let budget = Budget::new(&scenario);
    let v_mag = 7.5;
    let star_e = budget.electrons_of(v_mag, scenario.conditions.exposure_s);
    let flux = |seed: u64| {
        let place = PixelPoint::new(10.0 + 0.003 * seed as f64, 10.4);
        let frame = star_field(&scenario, &[(place, v_mag)], seed).unwrap();
        let light: f64 = electrons(&frame, &scenario).iter().sum();
        light - frame.pixels.len() as f64 * (budget.background_e + budget.dark_e)
    };
    let fluxes: Vec<f64> = (0..STARS).map(flux).collect();
    let (mean, variance) = mean_and_variance(&fluxes);
    let pixel_variance = budget.background_noise_e.powi(2) + 4.0 / 12.0;
    let expected = star_e + 21.0 * 21.0 * pixel_variance;
    let count = STARS as f64;
    assert!(
        (mean - star_e).abs() < SIGMAS * (expected / count).sqrt(),
        "{mean} {star_e}"
    );
    assert!(
        (variance / expected - 1.0).abs() < SIGMAS * (2.0 / count).sqrt(),
        "{variance} {expected}"
    );
}

#[test]
fn the_same_seed_gives_the_same_frame_and_another_one_another() {
    let scenario = scenario();
    let stars = [(PixelPoint::new(200.3, 100.8), 4.0)];
    let frame = |seed| star_field(&scenario, &stars, seed).unwrap();
    assert_eq!(frame(9), frame(9));
    assert_ne!(frame(9), frame(10));
}

#[test]
fn levels_are_whole_and_limited_by_the_detector() {
    let scenario = scenario();
    let stars = [(PixelPoint::new(300.0, 200.0), -3.0)];
    let frame = star_field(&scenario, &stars, 2).unwrap();
    let most = frame.values().iter().copied().fold(0.0, f32::max);
    assert!(frame.values().iter().all(|level| level.fract() == 0.0));
    // 12 bits end below the full well.
    assert_eq!(
        (most, frame.saturation_adu, frame.step_adu),
        (4095.0, Some(4095.0), 1.0)
    );
    let full = frame
        .values()
        .iter()
        .filter(|level| **level == most)
        .count();
    assert!((9..200).contains(&full), "{full}");
}

#[test]
fn motion_smears_along_the_rows() {
    let mut scenario = scenario();
    scenario.conditions.motion_px = 8.0;
    scenario.camera.read_noise_e = 0.0;
    scenario.camera.dark_current_e_s = 0.0;
    let place = PixelPoint::new(300.0, 200.0);
    let frame = star_field(&scenario, &[(place, 5.5)], 4).unwrap();
    let budget = Budget::new(&scenario);
    let background_e = budget.background_e + budget.dark_e;
    let light = electrons(&frame, &scenario);
    let spread = |along_x: bool| {
        let around = (-10i32..=10).flat_map(|dy| (-10i32..=10).map(move |dx| (dx, dy)));
        let (mut sum, mut squares) = (0.0, 0.0);
        for (dx, dy) in around {
            let (x, y) = ((300 + dx) as usize, (200 + dy) as usize);
            let star_e = light[y * frame.width + x] - background_e;
            let offset = f64::from(if along_x { dx } else { dy });
            sum += star_e;
            squares += star_e * offset * offset;
        }
        squares / sum
    };
    // σ² + 1/12 of the pixels; along the rows 8²/12 more.
    let across = 1.16f64.powi(2) + 1.0 / 12.0;
    assert!((spread(false) - across).abs() < 0.3, "{}", spread(false));
    assert!(
        (spread(true) - across - 64.0 / 12.0).abs() < 0.4,
        "{}",
        spread(true)
    );
}
