//! False alarms in noise of several kinds, against the rate asked for.

use super::{FALSE_ALARM_FACTOR, config_with, gaussian, white_noise};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson};
use starpipe::detect::{DetectConfig, Workspace, detect};
use starpipe::frame::Frame;

/// False alarms per megapixel in `frames` frames of 1024 x 1024 white noise.
fn false_alarm_rate(spot: f64, wanted: f64, frames: u64) -> f64 {
    let config = config_with(spot, wanted);
    let mut workspace = Workspace::new();
    let count: usize = (0..frames)
        .map(|seed| {
            let frame = white_noise(1024, 1024, 7.0, 1000 + seed);
            detect(&frame, &config, &mut workspace)
                .unwrap()
                .sources
                .len()
        })
        .sum();
    count as f64 / (frames as f64 * 1.048_576)
}

#[test]
fn the_false_alarm_rate_is_as_requested() {
    // 100 expected at each spot size: a Poisson error of 10 %, a quarter of the tolerance.
    for spot in [0.7, 1.0, 1.5] {
        let rate = false_alarm_rate(spot, 10.0, 10);
        println!("spot {spot}: wanted 10, had {rate:.2} per Mpx");
        assert!(
            (10.0 / FALSE_ALARM_FACTOR..10.0 * FALSE_ALARM_FACTOR).contains(&rate),
            "{rate}"
        );
    }
    // 30 expected: a Poisson error of 18 %.
    let rate = false_alarm_rate(1.0, 1.0, 29);
    println!("spot 1: wanted 1, had {rate:.2} per Mpx");
    assert!(
        (1.0 / FALSE_ALARM_FACTOR..FALSE_ALARM_FACTOR).contains(&rate),
        "{rate}"
    );
}

/// False alarms per megapixel in frames of `width` x `height` pixels of `pixel`, and the Poisson
/// error at the rate `wanted`.
fn false_alarm_rate_of(
    pixel: impl Fn(&mut ChaCha8Rng) -> f32,
    (width, height): (usize, usize),
    spot: f64,
    wanted: f64,
    megapixels: usize,
) -> (f64, f64) {
    let (config, mut workspace) = (config_with(spot, wanted), Workspace::new());
    let frames = megapixels * 1_048_576 / (width * height);
    let (mut count, area) = (0.0, (frames * width * height) as f64 * 1e-6);
    for seed in 0..frames {
        let mut rng = ChaCha8Rng::seed_from_u64(5000 + seed as u64);
        let pixels = (0..width * height).map(|_| pixel(&mut rng)).collect();
        let frame = Frame::new(width, height, pixels).unwrap();
        let frame = frame.with_levels(1.0, Some(65535.0));
        count += detect(&frame, &config, &mut workspace)
            .unwrap()
            .sources
            .len() as f64;
    }
    (count / area, (wanted / area).sqrt())
}

#[test]
fn skewed_quantised_and_clipped_noise_raise_no_more_false_alarms() {
    const WANTED: f64 = 10.0;
    let whole = (1024, 1024);
    let mut failures = Vec::new();
    let mut check = |name: &str, spot: f64, (rate, error): (f64, f64)| {
        println!("{name}, spot {spot}: wanted {WANTED}, had {rate:.1} ± {error:.1} per Mpx");
        if rate > WANTED * FALSE_ALARM_FACTOR + error {
            failures.push(format!("{name}, spot {spot}: {rate:.1}"));
        }
    };
    for mean in [30.0, 100.0] {
        let photons = Poisson::new(mean).unwrap();
        let noise = |rng: &mut ChaCha8Rng| photons.sample(rng) as f32;
        for spot in [0.5, 0.7] {
            let rate = false_alarm_rate_of(noise, whole, spot, WANTED, 10);
            check(&format!("{mean} photons"), spot, rate);
        }
    }
    for spot in [0.7, 1.5] {
        for sigma in [0.2, 0.4] {
            let noise = |rng: &mut ChaCha8Rng| gaussian(20.0, sigma, rng).round();
            let name = format!("noise of {sigma} steps");
            check(
                &name,
                spot,
                false_alarm_rate_of(noise, whole, spot, WANTED, 10),
            );
        }
        let clipped = |rng: &mut ChaCha8Rng| gaussian(0.0, 3.0, rng).round().max(0.0);
        check(
            "clipped at 0",
            spot,
            false_alarm_rate_of(clipped, whole, spot, WANTED, 10),
        );
    }
    // Frames that consist mostly of border.
    let strip = (1024, 8);
    for spot in [0.7, 1.0, 1.5] {
        let noise = |rng: &mut ChaCha8Rng| gaussian(1000.0, 7.0, rng);
        check(
            "strip, Gaussian",
            spot,
            false_alarm_rate_of(noise, strip, spot, WANTED, 8),
        );
    }
    assert!(failures.is_empty(), "{failures:?}");
}

#[test]
fn noise_clipped_at_zero_gives_hardly_any_false_alarms_by_default() {
    let wanted = DetectConfig::DEFAULT_FALSE_ALARMS_PER_MPX;
    for spot in [0.7, 1.5] {
        let clipped = |rng: &mut ChaCha8Rng| gaussian(0.0, 3.0, rng).round().clamp(0.0, 255.0);
        let (rate, _) = false_alarm_rate_of(clipped, (1024, 1024), spot, wanted, 16);
        println!("clipped at 0, spot {spot}: wanted {wanted}, had {rate:.2} per Mpx");
        assert!(rate < 1.0, "{rate}");
    }
}

#[test]
fn the_circle_of_a_lens_is_no_tail_of_the_noise() {
    const SIDE: usize = 700;
    const ROW: usize = SIDE + 1;
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let white: Vec<f32> = (0..ROW * ROW)
        .map(|_| gaussian(0.0, 20.0, &mut rng))
        .collect();
    let pixel = |at: usize| {
        let (x, y) = (at % SIDE, at / SIDE);
        let from_centre = |at: usize| at as f64 - SIDE as f64 / 2.0;
        let is_sky = from_centre(x).hypot(from_centre(y)) < 330.0;
        // Neighbors are correlated, as by a picture's compression, or by crowded stars.
        let first = y * ROW + x;
        let four = [first, first + 1, first + ROW, first + ROW + 1].map(|at| white[at]);
        let noise = four.iter().sum::<f32>() / 4.0;
        let level = if is_sky {
            400.0 + noise
        } else {
            30.0 + 0.1 * noise
        };
        level.round()
    };
    let pixels = (0..SIDE * SIDE).map(pixel).collect();
    let frame = Frame::new(SIDE, SIDE, pixels).unwrap();
    let frame = frame.with_levels(1.0, Some(65535.0));
    let found = detect(&frame, &DetectConfig::default(), &mut Workspace::new());
    assert_eq!(found.unwrap().noise_tail, None);
}
