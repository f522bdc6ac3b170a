//! Trails, nebulae, and stars drawn out by motion.

use super::{BACKGROUND_E, Sky, found_in, nearest, star_field};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use starpipe::detect::{DetectConfig, Detection};
use starpipe::frame::Frame;

#[test]
fn a_trail_is_one_flagged_source_and_a_nebula_is_extended() {
    let (mut sky, _) = star_field(6);
    for i in 0..240 {
        let along = 0.5 * f64::from(i);
        sky.add_star(200.0 + along, 150.0 + 0.3 * along, 350.0, 0.9);
    }
    sky.add_star(80.0, 300.0, 60_000.0, 3.5);
    let found = found_in(&sky.expose(3), &DetectConfig::default());
    assert!(found.sources.iter().any(|s| s.flags.trail));
    let nebula = nearest(&found, 80.0, 300.0, 2.0).unwrap();
    assert!(nebula.flags.extended, "{nebula:?}");
}

/// Stars that the camera's motion drew out alike, along the diagonal, over `length_px`.
fn drawn_out(side: usize, stars: &[(f64, f64, f64)], length_px: f64, seed: u64) -> Frame<'static> {
    const PARTS: usize = 24;
    let mut sky = Sky::flat(side, side, BACKGROUND_E);
    for &(x, y, flux) in stars {
        for part in 0..PARTS {
            let along = length_px * ((part as f64 + 0.5) / PARTS as f64 - 0.5);
            let step = along * std::f64::consts::FRAC_1_SQRT_2;
            sky.add_star(x + step, y + step, flux / PARTS as f64, 1.2);
        }
    }
    sky.expose(seed)
}

#[test]
fn stars_drawn_out_alike_are_stars_and_one_drawn_out_across_is_a_trail() {
    const SIDE: usize = 400;
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut stars = Vec::new();
    for i in 0..49 {
        let at = |n: i32| 32.0 + 56.0 * f64::from(n);
        let flux = 4000.0 * rng.random_range(1.0f64..4.0).exp();
        stars.push((
            at(i % 7) + rng.random_range(-2.0..2.0),
            at(i / 7) + rng.random_range(-2.0..2.0),
            flux,
        ));
    }
    let mut frame = drawn_out(SIDE, &stars, 9.0, 4);
    // A satellite, across the direction of the stars.
    for i in 0..30 {
        frame.values_mut()[(60 + i) * SIDE + 74 - i] += 400.0;
        frame.values_mut()[(61 + i) * SIDE + 74 - i] += 400.0;
    }
    let found = found_in(&frame, &DetectConfig::default());
    let mut pulls = 0.0;
    let trails: Vec<_> = found.sources.iter().filter(|s| s.flags.trail).collect();
    assert_eq!(trails.len(), 1, "{trails:?}");
    assert!((trails[0].position.x - 59.5).abs() < 3.0, "{:?}", trails[0]);
    for &(x, y, _) in &stars {
        let near = |s: &&Detection| (s.position.x - x).hypot(s.position.y - y) < 9.0;
        let own: Vec<_> = found.sources.iter().filter(near).collect();
        assert_eq!(own.len(), 1, "({x}, {y}): {own:?}");
        assert!(own[0].flags.is_star_like(), "{:?}", own[0]);
        let error_px = (own[0].position.x - x).hypot(own[0].position.y - y);
        let sigma_px = own[0].sigma_x_px;
        pulls += (error_px / sigma_px).powi(2) / 2.0;
        println!(
            "{:.1}: off by {error_px:.4} px, {sigma_px:.4} stated",
            own[0].snr
        );
        assert!(error_px < 0.5, "{error_px}: {:?}", own[0]);
    }
    let pull = (pulls / stars.len() as f64).sqrt();
    println!("RMS of pulls {pull:.2}");
    assert!((0.4..1.6).contains(&pull), "{pull}");
}
