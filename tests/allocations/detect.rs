//! Detection allocates nothing from the second frame of a kind on.

use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use starpipe::detect::{CentroidMethod, DetectConfig, Detections, Workspace, detect_into};
use starpipe::frame::Frame;

const WIDTH: usize = 640;
const HEIGHT: usize = 480;

/// A sky with faint and bright, single, touching and saturated stars, a hot pixel, a trail and
/// pixels without a value.
fn frame(spot_px: f32, level: f32, noise: f32, seed: u64) -> Frame<'static> {
    const FULL: f32 = 4095.0;
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut pixels: Vec<f32> = (0..WIDTH * HEIGHT)
        .map(|_| level + noise * rng.sample::<f32, _>(StandardNormal))
        .collect();
    let mut add = |x: f32, y: f32, peak: f32| {
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let (dx, dy) = ((i % WIDTH) as f32 - x, (i / WIDTH) as f32 - y);
            let distance2 = dx * dx + dy * dy;
            if distance2 < 200.0 {
                *pixel += peak * (-0.5 * distance2 / (spot_px * spot_px)).exp();
            }
        }
    };
    for i in 0..90u8 {
        let (x, y) = (rng.random_range(0.0..640.0), rng.random_range(0.0..480.0));
        add(x, y, 8.0 * noise * 1.07f32.powi(i32::from(i)));
    }
    for step in 0..6u8 {
        let step = f32::from(step);
        add(100.0 + 2.5 * spot_px * step, 100.0, 30.0 * noise);
        add(300.0 + step, 200.0 + 0.5 * step, 60.0 * noise);
    }
    add(500.0, 400.0, 20_000.0);
    pixels[WIDTH * 50 + 60] += 40.0 * noise;
    for pixel in pixels.iter_mut().skip(7).step_by(1009) {
        *pixel = f32::NAN;
    }
    let whole = |p: f32| {
        if p.is_nan() {
            p
        } else {
            p.round().clamp(0.0, FULL)
        }
    };
    let pixels = pixels.into_iter().map(whole).collect();
    Frame::new(WIDTH, HEIGHT, pixels)
        .unwrap()
        .with_levels(1.0, Some(FULL))
}

#[test]
fn detection_allocates_nothing_in_steady_state() {
    let frames = [
        frame(0.6, 100.0, 8.0, 1),
        frame(1.3, 100.0, 8.0, 2),
        // Coarsely quantised, and clipped at zero.
        frame(1.0, 1.0, 0.7, 3),
    ];
    for centroid in [CentroidMethod::GaussianFit, CentroidMethod::GreyWeighted] {
        let mut config = DetectConfig::default();
        config.centroid = centroid;
        let mut workspace = Workspace::new();
        let mut found = Detections::default();
        let first = allocation_counter::measure(|| {
            for frame in &frames {
                detect_into(frame, &config, &mut workspace, &mut found).unwrap();
            }
        });
        assert!(first.count_total > 0, "the counter does not count");
        for frame in &frames {
            let steady = allocation_counter::measure(|| {
                detect_into(frame, &config, &mut workspace, &mut found).unwrap();
            });
            let flags = found.sources.iter().map(|s| s.flags);
            assert!(flags.clone().any(|f| f.blended) && flags.clone().any(|f| f.saturated));
            assert!(found.sources.len() > 50, "{}", found.sources.len());
            assert_eq!(steady.count_total, 0, "{centroid:?}: {steady:?}");
        }
    }
}
