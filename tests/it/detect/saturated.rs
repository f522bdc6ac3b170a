//! Saturated stars and plateaus.

use super::{BACKGROUND_E, Sky, check_is_sound, found_in, nearest};
use starpipe::detect::DetectConfig;
use starpipe::frame::Frame;

#[test]
fn a_saturated_star_is_one_source_at_its_position() {
    let mut sky = Sky::flat(200, 200, BACKGROUND_E);
    sky.add_star(100.3, 90.8, 400_000.0, 1.3);
    for i in 0..9 {
        sky.add_star(20.0 + 20.1 * f64::from(i), 30.2, 4000.0, 1.3);
    }
    let mut frame = sky.expose(5);
    frame
        .values_mut()
        .iter_mut()
        .for_each(|p| *p = p.min(4095.0));
    let frame = frame.with_levels(1.0, Some(4095.0));
    let found = found_in(&frame, &DetectConfig::default());
    let star = &found.sources[0];
    assert!(
        star.flags.saturated && star.flags.is_star_like(),
        "{star:?}"
    );
    assert!(
        (star.position.x - 100.3).hypot(star.position.y - 90.8) < 0.05,
        "{star:?}"
    );
    // Only about a ninth of its peak is left, but the flux is that of the whole spot.
    assert!((star.flux_adu / 400_000.0 - 1.0).abs() < 0.1, "{star:?}");
    assert!(star.snr > found.sources[1].snr, "{star:?}");
    assert_eq!(found.sources.len(), 10, "{:?}", found.sources);
}

/// A sky with a star at each place, its light in the core and, `tail_px` aside, in a wider and
/// fainter spot: the coma of a lens.
fn lopsided(side: usize, stars: &[(f64, f64, f64)], tail_px: f64) -> Sky {
    let mut sky = Sky::flat(side, side, BACKGROUND_E);
    for &(x, y, flux) in stars {
        sky.add_star(x, y, 0.7 * flux, 1.2);
        sky.add_star(x + tail_px, y + tail_px, 0.3 * flux, 3.0);
    }
    sky
}

#[test]
fn a_saturated_star_with_coma_is_where_the_faint_ones_would_be() {
    const FULL_SCALE: f32 = 4095.0;
    let faint = (0..64).map(|i| {
        let at = |n: i32| 30.0 + 48.0 * f64::from(n) + 0.013 * f64::from(i);
        (at(i % 8), at(i / 8), 4000.0)
    });
    let bright = [(54.3, 54.1), (150.2, 246.4), (294.4, 102.3), (342.0, 342.2)];
    let saturated = bright.map(|(x, y)| (x, y, 300_000.0));
    let stars: Vec<_> = faint.chain(saturated).collect();
    let mut frame = lopsided(400, &stars, 3.0).expose(3);
    frame
        .values_mut()
        .iter_mut()
        .for_each(|p| *p = p.min(FULL_SCALE));
    let frame = frame.with_levels(1.0, Some(FULL_SCALE));
    let found = found_in(&frame, &DetectConfig::default());
    for (x, y) in bright {
        let star = nearest(&found, x, y, 6.0).unwrap();
        println!("({x}, {y}): {star:?}");
        assert!(star.flags.saturated && star.flags.is_star_like());
        // The coma itself is 4.2 px aside.
        let error_px = (star.position.x - x).hypot(star.position.y - y);
        assert!(error_px < 1.5, "{error_px}");
        assert!(error_px < 3.5 * star.sigma_x_px, "{error_px}: {star:?}");
    }
}

#[test]
fn a_plateau_brighter_than_all_else_is_one_source() {
    // The image of a bright star in a phone's picture: wide and flat, below full scale.
    const SIDE: usize = 320;
    let mut sky = Sky::flat(SIDE, SIDE, BACKGROUND_E);
    for i in 0..25 {
        let at = |n: i32| 20.0 + 70.0 * f64::from(n);
        sky.add_star(at(i % 5), at(i / 5), 3000.0, 1.0);
    }
    let mut frame = sky.expose(6);
    for (i, pixel) in frame.values_mut().iter_mut().enumerate() {
        let (x, y) = ((i % SIDE) as f32 - 125.4, (i / SIDE) as f32 - 124.8);
        // A tilted plateau: the background of a phone's picture is uneven.
        let blob = (4000.0 + 0.5 * x) / (1.0 + ((x * x + y * y) / 90.0).powi(4));
        *pixel += blob.round();
    }
    let found = found_in(&frame, &DetectConfig::default());
    let own = nearest(&found, 125.4, 124.8, 3.0);
    assert!(own.is_some(), "{:?}", &found.sources[..5]);
}

/// A frame of zeros with discs at full scale: (x, y, radius).
fn discs(side: usize, discs: &[(f64, f64, f64)]) -> Frame<'static> {
    let mut pixels = vec![0.0f32; side * side];
    for (i, pixel) in pixels.iter_mut().enumerate() {
        let (x, y) = ((i % side) as f64, (i / side) as f64);
        let is_lit = |d: &&(f64, f64, f64)| (x - d.0).hypot(y - d.1) <= d.2;
        if discs.iter().any(|d| is_lit(&d)) {
            *pixel = 255.0;
        }
    }
    Frame::new(side, side, pixels)
        .unwrap()
        .with_levels(1.0, Some(255.0))
}

#[test]
fn a_fully_saturated_source_has_the_position_of_its_area() {
    // From one pixel to a disc larger than the window of any spot.
    for radius in [0.6, 1.0, 1.5, 2.3, 4.2, 8.1] {
        let centres: Vec<(f64, f64, f64)> = (0..16)
            .map(|i| (f64::from(i % 4), f64::from(i / 4)))
            .map(|(x, y)| (30.0 + 60.1 * x, 32.0 + 59.9 * y, radius))
            .collect();
        let found = found_in(&discs(256, &centres), &DetectConfig::default());
        for &(x, y, _) in &centres {
            let star = nearest(&found, x, y, 1.0);
            let star = star.unwrap_or_else(|| panic!("radius {radius}: nothing at ({x}, {y})"));
            check_is_sound(star, 256, 256).unwrap();
            assert!(star.flags.saturated, "{star:?}");
            let error_px = (star.position.x - x).hypot(star.position.y - y);
            assert!(
                error_px < 0.5,
                "radius {radius}: off by {error_px}: {star:?}"
            );
            let sigmas = star.sigma_x_px.max(star.sigma_y_px);
            assert!(
                sigmas < 1.0 && error_px < 3.5 * sigmas,
                "radius {radius}: {star:?}"
            );
            // The remaining light is a lower limit.
            assert!(star.flux_adu >= 254.0, "radius {radius}: {star:?}");
        }
    }
}
