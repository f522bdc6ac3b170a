//! Centroids against the Cramér-Rao bound, their standard errors, and the share of stars found.

use super::{BACKGROUND_E, READ_NOISE_E, Sky, config_with, found_in, nearest, pixel_part};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use starpipe::detect::{CentroidMethod, DetectConfig};
use starpipe::frame::Frame;

/// The Cramér-Rao bound of x for a star at this place, flux and background unknown.
fn cramer_rao_px(x: f64, y: f64, flux: f64, sigma: f64) -> f64 {
    let (mut information, step) = (0.0, 1e-4);
    let parts = |center: f64| -> Vec<f64> {
        (-10..=10)
            .map(|i| pixel_part(f64::from(i), center, sigma))
            .collect()
    };
    let (x, y) = (x - x.round(), y - y.round());
    let (low, middle, high, down) = (parts(x - step), parts(x), parts(x + step), parts(y));
    for row in &down {
        for column in 0..middle.len() {
            let slope = flux * row * (high[column] - low[column]) / (2.0 * step);
            let light = flux * row * middle[column];
            information += slope * slope / (BACKGROUND_E + READ_NOISE_E.powi(2) + light);
        }
    }
    information.powf(-0.5)
}

/// RMS error over the bound, RMS pull and mean error of many stars of one flux.
struct Accuracy {
    rms_over_bound: f64,
    pull_rms: f64,
    found: f64,
    spot_px: f64,
}

/// The flux that gives a matched-filter signal-to-noise ratio, averaged over phases.
fn flux_for(snr: f64, spot: f64) -> f64 {
    // Effective number of pixels, averaged over phases; 4π(s² + 1/12) from 0.7 px on.
    let effective_px = if spot < 0.6 {
        4.25
    } else {
        4.0 * std::f64::consts::PI * (spot * spot + 1.0 / 12.0)
    };
    snr * (BACKGROUND_E + READ_NOISE_E.powi(2)).sqrt() * effective_px.sqrt()
}

fn accuracy(spot: f64, snr: f64, frames: u64, config: &DetectConfig) -> Accuracy {
    accuracy_on_grid(spot, snr, frames, config, 27)
}

/// The same for stars `spacing` pixels apart.
fn accuracy_on_grid(
    spot: f64,
    snr: f64,
    frames: u64,
    config: &DetectConfig,
    spacing: usize,
) -> Accuracy {
    const SIDE: usize = 640;
    let flux = flux_for(snr, spot);
    let (mut errors, mut bounds, mut pulls, mut count, mut stars) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let mut spot_sum = 0.0;
    for seed in 0..frames {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut sky = Sky::flat(SIDE, SIDE, BACKGROUND_E);
        let mut truth = Vec::new();
        for i in 0..(SIDE / spacing - 1).pow(2) {
            let n = SIDE / spacing - 1;
            let x = ((i % n + 1) * spacing) as f64 + rng.random_range(-0.5..0.5);
            let y = ((i / n + 1) * spacing) as f64 + rng.random_range(-0.5..0.5);
            sky.add_star(x, y, flux, spot);
            truth.push((x, y));
        }
        let found = found_in(&sky.expose(seed + 77), config);
        spot_sum += found.spot_sigma_px;
        for &(x, y) in &truth {
            stars += 1.0;
            let Some(star) = nearest(&found, x, y, 1.5) else {
                continue;
            };
            count += 1.0;
            errors += (star.position.x - x).powi(2) + (star.position.y - y).powi(2);
            bounds +=
                cramer_rao_px(x, y, flux, spot).powi(2) + cramer_rao_px(y, x, flux, spot).powi(2);
            pulls += ((star.position.x - x) / star.sigma_x_px).powi(2)
                + ((star.position.y - y) / star.sigma_y_px).powi(2);
        }
    }
    Accuracy {
        rms_over_bound: (errors / bounds).sqrt(),
        pull_rms: (pulls / (2.0 * count)).sqrt(),
        found: count / stars,
        spot_px: spot_sum / frames as f64,
    }
}

/// Tolerated RMS error over the Cramér-Rao bound.
const MAX_RMS_OVER_BOUND: f64 = 1.05;
/// Tolerance of the RMS of pulls, which should be 1.
const PULL_TOLERANCE: f64 = 0.1;

#[test]
fn the_fit_reaches_the_cramer_rao_bound_with_honest_errors() {
    let mut failures = Vec::new();
    // 2 x 484 x 6 errors a case: the RMS is known to 0.9 %.
    for spot in [0.5, 0.7, 1.0, 1.5] {
        for snr in [12.0, 40.0, 200.0] {
            let config = DetectConfig::default();
            let a = accuracy(spot, snr, 6, &config);
            println!(
                "spot {spot} snr {snr}: RMS/CRLB {:.3}, pulls {:.3}, found {:.3}, spot {:.3}",
                a.rms_over_bound, a.pull_rms, a.found, a.spot_px
            );
            if a.rms_over_bound > MAX_RMS_OVER_BOUND || (a.pull_rms - 1.0).abs() > PULL_TOLERANCE {
                failures.push(format!(
                    "spot {spot} snr {snr}: {:.3} {:.3}",
                    a.rms_over_bound, a.pull_rms
                ));
            }
            assert!(a.found > 0.99);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}

#[test]
fn half_the_stars_at_the_threshold_are_found() {
    // SNR50 of the ideal matched filter at 1 false alarm per Mpx: 4.91, 4.69, 4.45 for σ = 0.7, 1,
    // 1.5; 0.1 mag is a factor 1.096.
    const MAX_SNR50_RATIO: f64 = 1.096;
    for (spot, simulated) in [(0.7, 4.91), (1.0, 4.69), (1.5, 4.45)] {
        let config = config_with(spot, 1.0);
        let fraction = |snr: f64| accuracy_on_grid(spot, snr, 5, &config, 60).found;
        let (low, high) = (simulated - 0.4, simulated + 0.4);
        let (at_low, at_high) = (fraction(low), fraction(high));
        let snr50 = low + (0.5 - at_low) / (at_high - at_low) * (high - low);
        println!("spot {spot}: SNR50 {snr50:.2}, simulated matched filter {simulated}");
        assert!(snr50 / simulated < MAX_SNR50_RATIO, "{snr50}");
    }
}

#[test]
fn bright_stars_without_noise_have_no_bias() {
    // From σ = 0.5 px on.
    const MAX_BIAS_PX: f64 = 0.002;
    for spot in [0.5, 0.7, 1.0, 1.5] {
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        let mut sky = Sky::flat(400, 400, BACKGROUND_E);
        let truth: Vec<(f64, f64)> = (0..144)
            .map(|i| {
                let place = |n: i32| 30.0 + 30.0 * f64::from(n);
                (
                    place(i % 12) + rng.random_range(-0.5..0.5),
                    place(i / 12) + rng.random_range(-0.5..0.5),
                )
            })
            .collect();
        for &(x, y) in &truth {
            sky.add_star(x, y, 20_000.0, spot);
        }
        let pixels = sky
            .mean
            .iter()
            .map(|&m| (m + 0.1 * rng.sample::<f64, _>(StandardNormal)) as f32);
        let frame = Frame::new(400, 400, pixels.collect()).unwrap();
        let found = found_in(&frame, &DetectConfig::default());
        let worst = truth
            .iter()
            .map(|t| {
                nearest(&found, t.0, t.1, 1.0)
                    .map_or(1.0, |s| (s.position.x - t.0).hypot(s.position.y - t.1))
            })
            .fold(0.0, f64::max);
        println!(
            "spot {spot}: worst error without noise {worst:.5} px, spot found {:.4}",
            found.spot_sigma_px
        );
        assert!(worst < MAX_BIAS_PX, "spot {spot}: {worst}");
    }
}

#[test]
fn snr_depends_on_the_noise_not_on_spot_misfit() {
    // Stars of two spot sizes, so that no single spot fits all.
    let mut sky = Sky::flat(400, 400, BACKGROUND_E);
    for i in 0..36u32 {
        let (x, y) = (
            30.3 + 60.0 * f64::from(i % 6),
            30.6 + 60.0 * f64::from(i / 6),
        );
        sky.add_star(x, y, 50_000.0, if i % 2 == 0 { 0.9 } else { 1.1 });
    }
    let found = found_in(&sky.expose(12), &DetectConfig::default());
    // Shot noise alone gives √50 000 = 224; part of the misfit is counted as shot noise.
    assert!(
        found.sources.iter().all(|s| s.snr > 80.0 && s.snr < 230.0),
        "{:?}",
        found.sources
    );
    // The standard errors of the position include the misfit: noise alone would give 0.0046 px.
    assert!(
        found.sources.iter().all(|s| s.sigma_x_px > 0.0048),
        "{:?}",
        found.sources[0]
    );
}

#[test]
fn the_grey_weighted_centroid_is_near_the_bound_for_bright_stars() {
    // At most 1.2 for a peak SNR of 10 and more.
    const MAX_GREY_OVER_BOUND: f64 = 1.2;
    let mut config = DetectConfig::default();
    config.centroid = CentroidMethod::GreyWeighted;
    let a = accuracy(1.0, 30.0, 3, &config);
    println!(
        "grey-weighted: RMS/CRLB {:.3}, pulls {:.3}",
        a.rms_over_bound, a.pull_rms
    );
    assert!(
        a.rms_over_bound < MAX_GREY_OVER_BOUND,
        "{}",
        a.rms_over_bound
    );
}
