//! Skies that the black level cuts off.

use super::{FALSE_ALARM_FACTOR, Sky, config_with, found_in, gaussian, nearest};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use starpipe::detect::{DetectConfig, Workspace, detect};
use starpipe::frame::Frame;

/// A sky of Gaussian noise, in grey levels of an 8-bit frame whose black level cuts off what is
/// below 0: its level rises across the frame from `low` to `high`, in units of the noise.
fn sky_through_black(side: usize, sigma: f32, (low, high): (f32, f32), seed: u64) -> Vec<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let pixel = |i: usize, rng: &mut ChaCha8Rng| {
        let part = (i % side) as f32 / side as f32;
        gaussian(sigma * (low + part * (high - low)), sigma, rng)
    };
    (0..side * side).map(|i| pixel(i, &mut rng)).collect()
}

/// The 8-bit frame of these grey levels.
fn eight_bits(side: usize, pixels: impl Iterator<Item = f32>) -> Frame<'static> {
    let pixels = pixels.map(|v| v.round().clamp(0.0, 255.0)).collect();
    let frame = Frame::new(side, side, pixels).unwrap();
    frame.with_levels(1.0, Some(255.0))
}

#[test]
fn a_sky_that_falls_below_black_has_the_false_detections_asked_for() {
    const SIDE: usize = 512;
    let mut failures = Vec::new();
    for (wanted, frames) in [
        (10.0, 40),
        (DetectConfig::DEFAULT_FALSE_ALARMS_PER_MPX, 100),
    ] {
        for (spot, sigma, levels) in [
            (0.7, 2.0, (-3.0, 3.0)),
            (1.5, 4.0, (-3.0, 3.0)),
            (1.0, 3.0, (-1.5, 0.0)),
        ] {
            let config = config_with(spot, wanted);
            let mut workspace = Workspace::new();
            let count: usize = (0..frames)
                .map(|seed| {
                    let sky = sky_through_black(SIDE, sigma, levels, 9000 + seed);
                    let frame = eight_bits(SIDE, sky.into_iter());
                    let found = detect(&frame, &config, &mut workspace).unwrap();
                    found.sources.len()
                })
                .sum();
            let expected = wanted * frames as f64 * (SIDE * SIDE) as f64 * 1e-6;
            println!("{levels:?}, spot {spot}, noise {sigma}: {count}, expected {expected:.1}");
            // Three standard errors beyond the tolerated factor.
            let most = FALSE_ALARM_FACTOR * expected;
            if count as f64 > most + 3.0 * most.sqrt() {
                failures.push(format!("{levels:?}, {spot}: {count} of {expected}"));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}

#[test]
fn stars_are_found_where_the_sky_is_above_black_and_where_it_is_below() {
    const SIDE: usize = 512;
    const SPACING: usize = 24;
    let (spot, sigma, levels) = (1.0, 3.0, (-3.0, 3.0));
    // Over the noise that is cut off: such a star's brightest pixel is 4.5 standard deviations of a
    // pixel above the sky.
    let snr = 12.0;
    let flux = snr * f64::from(sigma) * (4.0 * std::f64::consts::PI * 13.0 / 12.0f64).sqrt();
    let [mut found_above, mut found_below, mut above, mut below] = [0.0; 4];
    for seed in 0..4 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut stars = Sky::flat(SIDE, SIDE, 0.0);
        let mut truth = Vec::new();
        let place = |n: usize| (n * SPACING) as f64;
        for i in 0..(SIDE / SPACING - 1).pow(2) {
            let n = SIDE / SPACING - 1;
            let x = place(i % n + 1) + rng.random_range(-0.5..0.5);
            let y = place(i / n + 1) + rng.random_range(-0.5..0.5);
            stars.add_star(x, y, flux, spot);
            truth.push((x, y));
        }
        let sky = sky_through_black(SIDE, sigma, levels, 800 + seed);
        let both = sky.into_iter().zip(&stars.mean);
        let frame = eight_bits(SIDE, both.map(|(sky, &star)| sky + star as f32));
        let found = found_in(&frame, &DetectConfig::default());
        for (x, y) in truth {
            let is_found = f64::from(u8::from(nearest(&found, x, y, 1.5).is_some()));
            // Two standard deviations above black, and between one and two below.
            let level = -3.0 + 6.0 * x / SIDE as f64;
            if level > 1.0 {
                (found_above, above) = (found_above + is_found, above + 1.0);
            } else if (-2.0..-1.0).contains(&level) {
                (found_below, below) = (found_below + is_found, below + 1.0);
            }
        }
    }
    let (part_above, part_below) = (found_above / above, found_below / below);
    println!("found {part_above:.3} above black, {part_below:.3} below");
    assert!(part_above > 0.99, "{part_above}");
    assert!(part_below > 0.95, "{part_below}");
}
