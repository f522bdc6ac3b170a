//! Noise, random dots, drawings, black and white frames must not be identified.

use crate::common::{Ran, starpipe};
use image::{DynamicImage, GrayImage, ImageBuffer, Luma};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::fmt::Write;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

const SIDE: u32 = 512;

fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

fn noise(seed: u64) -> GrayImage {
    let mut random = random(seed);
    let normal = Normal::new(40.0, 6.0).unwrap();
    GrayImage::from_fn(SIDE, SIDE, |_, _| {
        let level: f64 = normal.sample(&mut random);
        Luma([level.round().clamp(0.0, 255.0) as u8])
    })
}

/// Star-like spots at random positions over noise.
fn random_dots(seed: u64, count: usize) -> GrayImage {
    let mut image = noise(seed);
    let mut random = random(seed + 1000);
    for _ in 0..count {
        let mut place = || random.random_range(10.0..f64::from(SIDE) - 10.0);
        let (x, y) = (place(), place());
        let peak = 50.0 / random.random_range(0.05..1.0_f64);
        for row in y as u32 - 5..y as u32 + 6 {
            for column in x as u32 - 5..x as u32 + 6 {
                let r_sq = (f64::from(column) - x).powi(2) + (f64::from(row) - y).powi(2);
                let pixel = &mut image.get_pixel_mut(column, row).0[0];
                *pixel = pixel.saturating_add((peak * (-r_sq / 2.0).exp()) as u8);
            }
        }
    }
    image
}

/// A house with a lit window under a gradient, and a chequered floor.
fn house() -> GrayImage {
    GrayImage::from_fn(SIDE, SIDE, |x, y| {
        let wall = (120..400).contains(&x) && (200..420).contains(&y);
        let roof = y > 100 && y < 200 && x.abs_diff(260) < (y - 100) * 3 / 2;
        let window = (180..240).contains(&x) && (260..320).contains(&y);
        let floor = y >= 420;
        Luma([match (window, wall, roof, floor) {
            (true, ..) => 250,
            (_, true, ..) => 120,
            (_, _, true, _) => 60,
            (.., true) => 40 + 150 * ((x / 32 + y / 32) % 2) as u8,
            _ => (y / 3) as u8,
        }])
    })
}

/// A regular grid of dots.
fn grid_of_dots() -> GrayImage {
    let mut image = noise(7);
    for y in (32..SIDE - 32).step_by(48) {
        for x in (32..SIDE - 32).step_by(48) {
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                image.put_pixel(x + dx, y + dy, Luma([230]));
            }
        }
    }
    image
}

/// Frames of one kind in the tests of many.
const MANY: u64 = 100;

type SensorFrame = ImageBuffer<Luma<u16>, Vec<u16>>;

/// Noise of a 16-bit sensor.
fn sensor_noise(random: &mut ChaCha8Rng) -> SensorFrame {
    let level = log_uniform(random, 200.0, 20_000.0);
    let normal = Normal::new(level, log_uniform(random, 2.0, 300.0)).unwrap();
    SensorFrame::from_fn(SIDE, SIDE, |_, _| Luma([normal.sample(random) as u16]))
}

/// Noise with 5 to 500 spots of any size and brightness.
fn sensor_dots(random: &mut ChaCha8Rng) -> SensorFrame {
    let mut image = sensor_noise(random);
    let sigma_px = log_uniform(random, 0.5, 3.0);
    for _ in 0..log_uniform(random, 5.0, 501.0) as usize {
        let peak = log_uniform(random, 100.0, 60_000.0);
        let mut place = || random.random_range(15.0..f64::from(SIDE) - 15.0);
        let (x, y) = (place(), place());
        for row in y as u32 - 14..y as u32 + 15 {
            for column in x as u32 - 14..x as u32 + 15 {
                let r_sq = (f64::from(column) - x).powi(2) + (f64::from(row) - y).powi(2);
                let light = peak * (-r_sq / (2.0 * sigma_px * sigma_px)).exp();
                let pixel = &mut image.get_pixel_mut(column, row).0[0];
                *pixel = pixel.saturating_add(light as u16);
            }
        }
    }
    image
}

/// A random number between the two, uniform in its logarithm.
fn log_uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.random())
}

fn assert_none_is_identified(command: &[&str], inputs: &[PathBuf]) {
    let ran = Ran::new(
        starpipe()
            .args(command)
            .args(["--format", "json"])
            .args(inputs),
    );
    assert!(!ran.stdout.contains("\"identified\""));
    for report in ran.reports() {
        assert_eq!(report["status"], "not_identified", "{}", report["frame"]);
        assert!(
            report["reason"]
                .as_str()
                .is_some_and(|reason| reason.len() > 20)
        );
        let code = report["reason_code"].as_str().unwrap();
        let strange = ["trails", "double_exposure", "hints_exclude"];
        assert!(
            !strange.contains(&code),
            "{}: {}",
            report["frame"],
            report["reason"]
        );
        for part in ["attitude", "optics", "match", "magnitude"] {
            assert!(report[part].is_null());
        }
    }
    assert_eq!(ran.reports().len(), inputs.len(), "{}", ran.stderr);
    assert_eq!(ran.status, 3, "{}", ran.stderr);
}

fn saved(directory: &Path, images: impl IntoIterator<Item = DynamicImage>) -> Vec<PathBuf> {
    let save = |(number, image): (usize, DynamicImage)| {
        let path = directory.join(format!("{number}.png"));
        image.save(&path).unwrap();
        path
    };
    images.into_iter().enumerate().map(save).collect()
}

#[test]
fn pictures_other_than_the_sky_are_not_identified() {
    let directory = tempfile::tempdir().unwrap();
    let images = vec![
        noise(1),
        noise(2),
        random_dots(3, 5),
        random_dots(4, 30),
        random_dots(5, 200),
        house(),
        grid_of_dots(),
        GrayImage::from_pixel(SIDE, SIDE, Luma([0])),
        GrayImage::from_pixel(SIDE, SIDE, Luma([255])),
    ];
    let images = images.into_iter().map(DynamicImage::from);
    assert_none_is_identified(&["process"], &saved(directory.path(), images));
}

#[test]
fn a_hundred_frames_of_noise_are_not_identified() {
    let directory = tempfile::tempdir().unwrap();
    let frames = (0..MANY).map(|seed| sensor_noise(&mut random(seed)).into());
    assert_none_is_identified(&["process"], &saved(directory.path(), frames));
}

#[test]
fn a_hundred_frames_of_random_dots_are_not_identified() {
    let directory = tempfile::tempdir().unwrap();
    let frames = (0..MANY).map(|seed| sensor_dots(&mut random(seed)).into());
    assert_none_is_identified(&["process"], &saved(directory.path(), frames));
}

/// Lists of up to `most` random positions and magnitudes.
fn random_lists(directory: &Path, seeds: Range<u64>, most: usize) -> Vec<PathBuf> {
    let list = |seed: u64| {
        let mut random = random(seed);
        let mut text = "x,y,mag\n".to_owned();
        for _ in 0..random.random_range(1..=most) {
            let mut draw = |most: f64| random.random_range(0.0..most);
            writeln!(text, "{},{},{}", draw(1024.0), draw(768.0), draw(6.0)).unwrap();
        }
        let path = directory.join(format!("{seed}.csv"));
        fs::write(&path, text).unwrap();
        path
    };
    seeds.map(list).collect()
}

#[test]
fn random_positions_are_not_identified_with_nothing_known() {
    let directory = tempfile::tempdir().unwrap();
    let lists = random_lists(directory.path(), 0..20, 25);
    assert_none_is_identified(&["identify"], &lists);
}

#[test]
fn random_positions_are_not_identified_with_a_scale_given() {
    let directory = tempfile::tempdir().unwrap();
    let lists = random_lists(directory.path(), 100..140, 60);
    assert_none_is_identified(&["identify", "--fov", "15"], &lists);
}
