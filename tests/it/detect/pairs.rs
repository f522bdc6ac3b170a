//! Stars that touch each other, and near neighbors.

use super::{BACKGROUND_E, Sky, config_with, found_in, nearest};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use starpipe::detect::DetectConfig;

#[test]
fn touching_stars_are_separated_and_flagged() {
    // Eighteen pairs among eighteen single stars, from which the spot is measured.
    let mut sky = Sky::flat(256, 256, BACKGROUND_E);
    let places: Vec<(f64, f64)> = (0..36)
        .map(|i| {
            (
                20.3 + 40.0 * f64::from(i % 6),
                20.7 + 40.0 * f64::from(i / 6),
            )
        })
        .collect();
    for (i, &(x, y)) in places.iter().enumerate() {
        sky.add_star(x, y, 8000.0, 1.0);
        if i % 2 == 0 {
            sky.add_star(x + 2.9, y + 1.1, 5000.0, 1.0);
        }
    }
    let found = found_in(&sky.expose(4), &config_with(1.0, 0.1));
    assert_eq!(found.sources.len(), 54);
    assert_eq!(found.sources.iter().filter(|s| s.flags.blended).count(), 36);
    for &(x, y) in places.iter().step_by(2) {
        let faint = nearest(&found, x + 2.9, y + 1.1, 0.4).expect("the fainter of the pair");
        assert!(
            (faint.flux_adu / 5000.0 - 1.0).abs() < 0.15,
            "{}",
            faint.flux_adu
        );
    }
}

/// Pairs among single stars: the mean error of the brighter star towards the fainter in pixels, the
/// shares of brighter stars detected and flagged as blended, and detections over stars.
fn pairs(spot: f64, separation: f64, ratio: f64) -> [f64; 4] {
    let mut sky = Sky::flat(512, 512, BACKGROUND_E);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut truth = Vec::new();
    for i in 0..100u32 {
        let mut place = |n: u32| 25.0 + 50.0 * f64::from(n) + rng.random_range(-0.5..0.5);
        let (x, y) = (place(i % 10), place(i / 10));
        let angle: f64 = rng.random_range(0.0..std::f64::consts::TAU);
        sky.add_star(x, y, 20_000.0 + 10.0 * f64::from(i), spot);
        if i % 3 == 0 {
            let (dx, dy) = (angle.cos(), angle.sin());
            sky.add_star(
                x + separation * dx,
                y + separation * dy,
                20_000.0 / ratio,
                spot,
            );
            truth.push((x, y, dx, dy));
        }
    }
    let found = found_in(&sky.expose(3), &DetectConfig::default());
    let (mut bias, mut count, mut blended) = (0.0, 0.0, 0.0);
    for &(x, y, dx, dy) in &truth {
        if let Some(star) = nearest(&found, x, y, 1.0) {
            bias += (star.position.x - x) * dx + (star.position.y - y) * dy;
            count += 1.0;
            blended += if star.flags.blended { 1.0 } else { 0.0 };
        }
    }
    let stars = (100 + truth.len()) as f64;
    let pairs = truth.len() as f64;
    [
        bias / count,
        count / pairs,
        blended / pairs,
        found.sources.len() as f64 / stars,
    ]
}

#[test]
fn a_neighbor_four_spot_sizes_away_does_not_bias_a_star() {
    const MAX_BIAS_PX: f64 = 0.03;
    let mut failures = Vec::new();
    for spot in [1.0, 1.5] {
        for (sigmas, ratio) in [4.0, 5.0, 6.0, 8.0]
            .into_iter()
            .flat_map(|s| [1.0, 2.0, 4.4].map(|r| (s, r)))
        {
            let [bias, found, blended, sources] = pairs(spot, sigmas * spot, ratio);
            let name = format!("spot {spot}, {sigmas} sizes apart, ratio {ratio}");
            println!(
                "{name}: bias {bias:+.4} px, found {found:.2}, blended {blended:.2}, sources over stars {sources:.2}"
            );
            let is_flagged = if sigmas < 4.5 {
                blended > 0.95
            } else {
                sigmas < 7.0 || blended < 0.05
            };
            if !(bias.abs() < MAX_BIAS_PX
                && found > 0.99
                && is_flagged
                && (sources - 1.0).abs() < 0.02)
            {
                failures.push(name);
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
