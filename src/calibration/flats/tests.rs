use super::*;
use crate::frame::Frame;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const GAIN_E_PER_ADU: f64 = 2.5;
const READ_NOISE_ADU: f64 = 3.0;
const BIAS_ADU: f64 = 100.0;
const SIDE: usize = 300;

/// A lens that darkens towards the corners, and pixels that differ by one percent.
fn response() -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(77);
    let of = |i: usize| {
        let (x, y) = (
            (i % SIDE) as f64 / SIDE as f64 - 0.5,
            (i / SIDE) as f64 / SIDE as f64 - 0.5,
        );
        let pixel: f64 = StandardNormal.sample(&mut random);
        (1.0 - 0.6 * (x * x + y * y)) * (1.0 + 0.01 * pixel)
    };
    (0..SIDE * SIDE).map(of).collect()
}

fn flat(level_adu: f64, seed: u64) -> Frame<'static> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let pixels = response().into_iter().map(|response| {
        let signal = level_adu * response;
        let sigma = (signal / GAIN_E_PER_ADU + READ_NOISE_ADU * READ_NOISE_ADU).sqrt();
        let noise: f64 = StandardNormal.sample(&mut random);
        (BIAS_ADU + signal + sigma * noise).round() as f32
    });
    let frame = Frame::new(SIDE, SIDE, pixels.collect()).unwrap();
    frame.with_levels(1.0, Some(65535.0))
}

fn flats(levels_adu: &[f64], config: FlatConfig) -> Flats {
    let mut stack = FlatStack::new(FlatConfig {
        bias_adu: BIAS_ADU,
        ..config
    });
    for (number, level_adu) in levels_adu.iter().enumerate() {
        stack
            .add(&format!("{number}"), &flat(*level_adu, number as u64))
            .unwrap();
    }
    stack.measure().unwrap()
}

#[test]
fn gain_and_read_noise_follow_from_pairs_of_different_light() {
    let levels = [
        300.0, 305.0, 1000.0, 990.0, 5000.0, 5100.0, 12_000.0, 12_000.0,
    ];
    let found = flats(&levels, FlatConfig::default()).gain.unwrap();
    assert_eq!(found.method, GainMethod::Line);
    assert!(found.sigma < 0.01 * GAIN_E_PER_ADU, "{found:?}");
    assert!(
        (found.e_per_adu - GAIN_E_PER_ADU).abs() < 5.0 * found.sigma,
        "{found:?}"
    );
    assert!(
        (found.read_noise_adu.unwrap() - READ_NOISE_ADU).abs() < 0.5,
        "{found:?}"
    );
}

#[test]
fn with_one_light_the_read_noise_must_be_known() {
    let known = FlatConfig {
        read_noise_e: Some(READ_NOISE_ADU * GAIN_E_PER_ADU),
        ..FlatConfig::default()
    };
    let levels = [400.0; 8];
    let found = flats(&levels, known).gain.unwrap();
    assert!(
        (found.e_per_adu - GAIN_E_PER_ADU).abs() < 5.0 * found.sigma,
        "{found:?}"
    );
    let neglected = flats(&levels, FlatConfig::default()).gain.unwrap();
    assert_eq!(neglected.method, GainMethod::ShotNoiseAlone);
    assert!(neglected.e_per_adu < found.e_per_adu - 5.0 * found.sigma);
    assert_eq!(flats(&[400.0, 800.0], FlatConfig::default()).gain, None);
}

#[test]
fn the_master_is_the_response_and_its_unevenness_that_of_the_pixels() {
    let found = flats(&[20_000.0; 10], FlatConfig::default());
    let truth = response();
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    // Noise of ten frames at the level of the corners: 0.2 %.
    let worst = found
        .master
        .iter()
        .zip(&truth)
        .map(|(m, t)| (f64::from(*m) / (t / mean) - 1.0).abs());
    assert!(worst.fold(0.0, f64::max) < 6.0 * 0.002);
    let pixel = found.pixel_nonuniformity.unwrap();
    assert!((pixel / (0.01 * 0.9 / mean) - 1.0).abs() < 0.02, "{pixel}");
    assert!(found.nonuniformity > 3.0 * pixel);
}

#[test]
fn frames_that_are_no_flats_are_refused() {
    let refused = |frame: Frame, config: FlatConfig| {
        FlatStack::new(config)
            .add("a.fits", &frame)
            .unwrap_err()
            .to_string()
    };
    let over = Frame::new(3, 3, vec![255.0; 9])
        .unwrap()
        .with_levels(1.0, Some(255.0));
    assert_eq!(
        refused(over, FlatConfig::default()),
        "a.fits is overexposed: found 100.0 % of its pixels saturated, expected at most 1 %"
    );
    let dark = Frame::new(3, 3, vec![100.0; 9]).unwrap();
    let config = FlatConfig {
        dark: Some(("d.fits".to_owned(), dark.clone())),
        ..FlatConfig::default()
    };
    assert_eq!(
        refused(dark, config.clone()),
        "a.fits shows no light: found a mean of 0 ADU above the dark, expected more than 0"
    );
    let wide = Frame::new(4, 3, vec![200.0; 12]).unwrap();
    assert_eq!(
        refused(wide, config),
        "a.fits has 4 x 3 pixels: expected 3 x 3, as the dark d.fits"
    );
    assert!(FlatStack::new(FlatConfig::default()).measure().is_err());
}
