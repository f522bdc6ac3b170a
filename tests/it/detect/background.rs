//! Uneven backgrounds, lit walls, hot and missing pixels.

use super::{BACKGROUND_E, Sky, count_found, found_in, nearest, star_field};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use starpipe::detect::{DetectConfig, Detection};
use starpipe::frame::Frame;

#[test]
fn vignetting_glow_and_dead_borders_hide_no_stars_and_make_none() {
    let (mut sky, truth) = star_field(3);
    for (i, mean) in sky.mean.iter_mut().enumerate() {
        let (x, y) = ((i % 512) as f64, (i / 512) as f64);
        *mean += 400.0 * (1.0 - ((x - 256.0).powi(2) + (y - 192.0).powi(2)) / 1.2e5) + 0.5 * y;
    }
    let bare = sky.expose(1);
    let mut padded = vec![0.0f32; 700 * 600];
    for y in 0..384 {
        padded[(y + 100) * 700 + 90..][..512].copy_from_slice(&bare.values()[y * 512..][..512]);
    }
    let frame = Frame::new(700, 600, padded)
        .unwrap()
        .with_levels(1.0, Some(65535.0));
    let found = found_in(&frame, &DetectConfig::default());
    let shifted: Vec<_> = truth.iter().map(|t| (t.0 + 90.0, t.1 + 100.0)).collect();
    assert_eq!(count_found(&found, &shifted), 60);
    assert!(found.sources.len() <= 61, "{} found", found.sources.len());
}

#[test]
fn hot_pixels_are_flagged_and_stars_are_not() {
    let (sky, truth) = star_field(5);
    let mut frame = sky.expose(2);
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let hot: Vec<(usize, usize)> = (0..40)
        .map(|_| (rng.random_range(5..507), rng.random_range(5..379)))
        .filter(|h| {
            truth
                .iter()
                .all(|t| (t.0 - h.0 as f64).hypot(t.1 - h.1 as f64) > 8.0)
        })
        .collect();
    for &(x, y) in &hot {
        frame.values_mut()[y * 512 + x] += 600.0;
    }
    let found = found_in(&frame, &DetectConfig::default());
    let flagged = hot
        .iter()
        .filter(|h| nearest(&found, h.0 as f64, h.1 as f64, 0.7).is_some_and(|s| s.flags.hot_pixel))
        .count();
    println!("{flagged} of {} hot pixels flagged", hot.len());
    assert!(
        flagged as f64 > 0.95 * hot.len() as f64,
        "{flagged} of {}",
        hot.len()
    );
    assert_eq!(count_found(&found, &truth), 60);
    assert!(
        (found.spot_sigma_px - 0.9).abs() < 0.05,
        "{}",
        found.spot_sigma_px
    );
}

#[test]
fn a_lit_wall_has_no_stars_and_its_windows_do_not_hide_the_sky() {
    let mut sky = Sky::flat(640, 480, BACKGROUND_E);
    for y in 0..160 {
        for x in 0..640 {
            let is_window = x % 20 < 11 && y % 16 < 9;
            sky.mean[y * 640 + x] = if is_window { 4000.0 } else { 400.0 };
        }
    }
    let stars: Vec<(f64, f64)> = (0..40)
        .map(|i| {
            (
                20.3 + 61.0 * f64::from(i % 10),
                200.4 + 66.0 * f64::from(i / 10),
            )
        })
        .collect();
    for &(x, y) in &stars {
        sky.add_star(x, y, 3000.0, 1.0);
    }
    let found = found_in(&sky.expose(5), &DetectConfig::default());
    assert!(
        (found.spot_sigma_px - 1.0).abs() < 0.05,
        "{}",
        found.spot_sigma_px
    );
    let (of_sky, of_wall): (Vec<&Detection>, Vec<&Detection>) =
        found.sources.iter().partition(|s| s.position.y > 165.0);
    assert_eq!(of_sky.len(), stars.len());
    assert!(of_sky.iter().all(|s| s.flags.is_star_like()));
    let stars_of_wall = of_wall.iter().filter(|s| s.flags.is_star_like()).count();
    assert!(
        stars_of_wall * 10 < of_wall.len(),
        "{stars_of_wall} of {}",
        of_wall.len()
    );
}

#[test]
fn missing_pixels_do_not_disturb_others() {
    let (sky, truth) = star_field(11);
    let mut frame = sky.expose(7);
    for i in (0..frame.pixels.len()).step_by(97) {
        frame.values_mut()[i] = f32::NAN;
    }
    let found = found_in(&frame, &DetectConfig::default());
    assert!(count_found(&found, &truth) >= 58);
    assert!(
        found
            .sources
            .iter()
            .all(|s| s.position.x.is_finite() && s.snr.is_finite())
    );
}
