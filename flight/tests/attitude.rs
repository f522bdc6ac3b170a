//! From drawn frames to attitudes: found, never wrong, with true errors, without an allocation.
#![allow(
    clippy::disallowed_methods,
    reason = "tests may differ in the last bit"
)]

mod sky;

use nalgebra::{Matrix3, Vector3};
use sky::{Scene, any_attitude, error_rad, rng};
use starpipe_flight::{
    Attitude, Budget, Catalog, Config, Image, Sky, Spot, Status, Tracker, build,
};

const VELOCITY_KM_S: [f64; 3] = [20.0, -15.0, 8.0];
const SKY: Sky = Sky {
    year: 2026.0,
    velocity_km_s: VELOCITY_KM_S,
};

fn catalog(fov_deg: [f64; 2]) -> Vec<u8> {
    let plan = build::Plan {
        fov_deg,
        v_limit: 6.0,
        epoch_year: 2000.0,
        budget_bytes: 2_000_000,
    };
    build::catalog(&sky::stars(), &plan).unwrap()
}

fn scene<'a>(
    config: &'a Config,
    stars: &'a [starpipe_flight::Star],
    attitude: Matrix3<f64>,
) -> Scene<'a> {
    Scene {
        config,
        stars,
        attitude,
        rate_rad_s: Vector3::zeros(),
        velocity_km_s: VELOCITY_KM_S.into(),
        years: 26.0,
    }
}

/// The squared error over its expectation, about each axis and in all.
fn nees(truth: &Matrix3<f64>, found: &Attitude) -> [f64; 4] {
    let error = error_rad(truth, found.quaternion);
    let covariance = Matrix3::from_fn(|row, column| found.covariance_rad2[row][column]);
    let all = (error.transpose() * covariance.try_inverse().unwrap() * error)[0] / 3.0;
    let about = |axis: usize| error[axis].powi(2) / covariance[(axis, axis)];
    [about(0), about(1), about(2), all]
}

fn mean<const N: usize>(rows: &[[f64; N]]) -> [f64; N] {
    std::array::from_fn(|part| rows.iter().map(|row| row[part]).sum::<f64>() / rows.len() as f64)
}

#[test]
fn frames_of_any_attitude_are_identified_with_true_errors() {
    let (stars, bytes) = (sky::stars(), catalog([12.0, 20.0]));
    let mut all = Vec::new();
    for (number, mirrored) in (0..48).map(|number| (number, u32::from(number % 3 == 0))) {
        let mut config = sky::config(if number % 2 == 0 { 12.5 } else { 19.0 });
        config.camera.mirrored = mirrored;
        let catalog = Catalog::new(&bytes).unwrap();
        let mut block = vec![0; Tracker::words(&config, &catalog).unwrap()];
        let mut tracker = Tracker::new(&mut block, config, catalog).unwrap();
        let mut rng = rng(number);
        let scene = scene(&config, &stars, any_attitude(&mut rng));
        let pixels = scene.image(&mut rng);
        let image = Image::of_16_bits(&pixels, [1024, 1024], 1024).unwrap();
        let mut spots = [Spot::default(); 64];
        let count = tracker.detect(&image, &mut spots).unwrap();
        let found = tracker.lost(&spots[..count], &SKY, &Budget::default());
        if found.status == Status::FOUND {
            let nees = nees(&scene.attitude, &found);
            assert!(nees[3] < 30.0, "{number}: {nees:?} {found:?}");
            all.push(nees);
        }
    }
    let means = mean(&all);
    assert!(all.len() >= 46, "{} of 48", all.len());
    assert!(
        means.iter().all(|mean| (0.5..1.6).contains(mean)),
        "{means:?}"
    );
}

/// Tracks a camera that turns, and returns the mean squared errors over their expectations, and how many images of how
/// many were tracked.
fn track(config: &Config, rate_deg_s: Vector3<f64>, seed: u64) -> ([f64; 4], usize, usize) {
    const IMAGES: usize = 40;
    const INTERVAL_S: f64 = 0.25;
    let (stars, bytes) = (sky::stars(), catalog([12.0, 20.0]));
    let catalog = Catalog::new(&bytes).unwrap();
    let mut block = vec![0; Tracker::words(config, &catalog).unwrap()];
    let mut tracker = Tracker::new(&mut block, *config, catalog).unwrap();
    let mut rng = rng(seed);
    let mut attitude = any_attitude(&mut rng);
    let rate_rad_s = rate_deg_s.map(f64::to_radians);
    let turn = nalgebra::Rotation3::new(-rate_rad_s * INTERVAL_S);
    let (mut all, mut tracked) = (Vec::new(), 0);
    for number in 0..IMAGES {
        let scene = Scene {
            rate_rad_s,
            ..scene(config, &stars, attitude)
        };
        let pixels = scene.image(&mut rng);
        let image = Image::of_16_bits(&pixels, [1024, 1024], 1024).unwrap();
        let time_s = number as f64 * INTERVAL_S;
        let found = tracker.track(&image, time_s, &SKY).unwrap();
        if found.status == Status::FOUND {
            tracked += 1;
            if tracked > 3 {
                all.push(nees(&attitude, &found));
            }
        } else {
            let mut spots = [Spot::default(); 64];
            let count = tracker.detect(&image, &mut spots).unwrap();
            let found = tracker.lost(&spots[..count], &SKY, &Budget::default());
            assert!(
                error_rad(&attitude, found.quaternion).norm() < 2e-3
                    || found.status != Status::FOUND
            );
            tracker.start(&found, time_s);
        }
        attitude = turn.matrix() * attitude;
    }
    (mean(&all), tracked, IMAGES)
}

#[test]
fn slow_and_fast_turns_are_tracked_with_true_errors() {
    for (seed, rate) in [(1, 0.0), (2, 0.1), (3, 0.3)] {
        let rate_deg_s = Vector3::new(0.6, -0.7, 0.4) * rate;
        let (means, tracked, of) = track(&sky::config(16.0), rate_deg_s, seed);
        assert!(tracked + 4 >= of, "{rate}: {tracked} of {of}");
        assert!(
            means.iter().all(|mean| (0.4..1.8).contains(mean)),
            "{rate}: {means:?}"
        );
    }
}

#[test]
fn rows_that_are_read_one_after_the_other_make_no_error() {
    let mut config = sky::config(16.0);
    config.sensor.row_time_s = 1e-4;
    let (means, tracked, of) = track(&config, Vector3::new(0.15, -0.1, 0.1), 4);
    assert!(tracked + 4 >= of, "{tracked} of {of}");
    assert!(
        means.iter().all(|mean| (0.4..1.8).contains(mean)),
        "{means:?}"
    );
}

#[test]
fn nothing_is_allocated_after_the_start() {
    let (stars, bytes, config) = (sky::stars(), catalog([12.0, 20.0]), sky::config(16.0));
    let catalog = Catalog::new(&bytes).unwrap();
    let mut block = vec![0; Tracker::words(&config, &catalog).unwrap()];
    let mut rng = rng(7);
    let scene = scene(&config, &stars, any_attitude(&mut rng));
    let pixels = scene.image(&mut rng);
    let image = Image::of_16_bits(&pixels, [1024, 1024], 1024).unwrap();
    let allocated = allocation_counter::measure(|| {
        let mut tracker = Tracker::new(&mut block, config, Catalog::new(&bytes).unwrap()).unwrap();
        let mut spots = [Spot::default(); 64];
        let count = tracker.detect(&image, &mut spots).unwrap();
        let found = tracker.lost(&spots[..count], &SKY, &Budget::default());
        assert_eq!(found.status, Status::FOUND);
        tracker.start(&found, 0.0);
        for time_s in [0.1, 0.2, 0.3] {
            assert_eq!(
                tracker.track(&image, time_s, &SKY).unwrap().status,
                Status::FOUND
            );
        }
    });
    assert_eq!(allocated.count_total, 0);
}
