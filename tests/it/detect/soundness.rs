//! Arbitrary frames: no panic, and every detection is sound.

use super::{Sky, check_is_sound, found_in, gaussian};
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use starpipe::detect::{CentroidMethod, DetectConfig, Workspace, detect};
use starpipe::frame::{Frame, FrameMetadata};

#[test]
fn frames_without_light_give_nothing() {
    for level in [0.0, 255.0] {
        let frame = Frame::new(64, 48, vec![level; 64 * 48])
            .unwrap()
            .with_levels(1.0, Some(255.0));
        assert!(
            found_in(&frame, &DetectConfig::default())
                .sources
                .is_empty()
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn arbitrary_small_frames_never_panic(
        width in 3usize..40,
        height in 3usize..40,
        seed: u64,
        scale in prop::sample::select(vec![0.0f32, 1e-30, 1.0, 255.0, 65535.0, 1e30]),
        odd in prop::sample::select(vec![0usize, 1, 2, 3, 5]),
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let pixels: Vec<f32> = (0..width * height)
            .map(|i| match (odd > 0 && i % (odd + 1) == 0, rng.random_range(0..4)) {
                (true, 0) => f32::NAN,
                (true, 1) => f32::INFINITY,
                (true, 2) => scale,
                _ => scale * rng.random::<f32>().powi(5),
            })
            .collect();
        let frame = Frame { width, height, pixels: pixels.into(), step_adu: 1.0, saturation_adu: Some(250.0), metadata: FrameMetadata::default() };
        let _ = detect(&frame, &DetectConfig::default(), &mut Workspace::new());
    }
}

/// A bright or dark feature: a lamp, a hot column, a dead area or a star.
#[derive(Debug, Clone)]
enum Mark {
    Disc {
        x: f64,
        y: f64,
        radius: f64,
        level: f32,
    },
    Line {
        x: f64,
        y: f64,
        dx: f64,
        dy: f64,
        level: f32,
    },
    Block {
        x: usize,
        y: usize,
        side: usize,
        level: f32,
    },
    Star {
        x: f64,
        y: f64,
        flux: f64,
        sigma: f64,
    },
}

fn mark() -> impl Strategy<Value = Mark> {
    let place = -3.0..75.0f64;
    let level = prop::sample::select(vec![255.0f32, 300.0, 254.0, 90.0, -40.0, f32::NAN]);
    let levels = level.clone();
    prop_oneof![
        (place.clone(), place.clone(), 0.3..9.0f64, level.clone()).prop_map(
            |(x, y, radius, level)| Mark::Disc {
                x,
                y,
                radius,
                level
            }
        ),
        (
            place.clone(),
            place.clone(),
            -1.0..1.0f64,
            -1.0..1.0f64,
            level
        )
            .prop_map(|(x, y, dx, dy, level)| Mark::Line {
                x,
                y,
                dx,
                dy,
                level
            }),
        (0usize..70, 0usize..70, 1usize..20, levels).prop_map(|(x, y, side, level)| Mark::Block {
            x,
            y,
            side,
            level
        }),
        (place.clone(), place, 50.0..50_000.0f64, 0.4..2.5f64)
            .prop_map(|(x, y, flux, sigma)| Mark::Star { x, y, flux, sigma }),
    ]
}

/// Draws `marks` over noise of standard deviation `noise`, rounded and clipped at full scale.
fn marked_frame(
    marks: &[Mark],
    (width, height): (usize, usize),
    noise: f32,
    seed: u64,
) -> Frame<'static> {
    let mut sky = Sky::flat(width, height, 0.0);
    for mark in marks {
        if let &Mark::Star { x, y, flux, sigma } = mark {
            sky.add_star(x, y, flux, sigma);
        }
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut pixels: Vec<f32> = sky
        .mean
        .iter()
        .map(|&m| {
            (m as f32 + gaussian(10.0, noise, &mut rng))
                .round()
                .clamp(0.0, 255.0)
        })
        .collect();
    for (i, pixel) in pixels.iter_mut().enumerate() {
        let (column, row) = (i % width, i / width);
        let (px, py) = (column as f64, row as f64);
        for mark in marks {
            let (is_in, level) = match *mark {
                Mark::Disc {
                    x,
                    y,
                    radius,
                    level,
                } => ((px - x).hypot(py - y) <= radius, level),
                Mark::Line {
                    x,
                    y,
                    dx,
                    dy,
                    level,
                } => {
                    let across = (px - x) * dy - (py - y) * dx;
                    (across.abs() <= 0.5 * dx.hypot(dy), level)
                }
                Mark::Block { x, y, side, level } => (
                    (x..x + side).contains(&column) && (y..y + side).contains(&row),
                    level,
                ),
                Mark::Star { .. } => (false, 0.0),
            };
            if is_in {
                *pixel = level;
            }
        }
    }
    // At least one value, otherwise there is no frame.
    pixels[0] = 10.0;
    Frame::new(width, height, pixels)
        .unwrap()
        .with_levels(1.0, Some(255.0))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn every_detection_is_sound_in_whatever_frame(
        marks in prop::collection::vec(mark(), 0..8),
        size in (8usize..72, 8usize..72),
        noise in prop::sample::select(vec![0.0f32, 0.3, 2.0, 8.0]),
        is_grey in any::<bool>(),
        seed: u64,
    ) {
        let frame = marked_frame(&marks, size, noise, seed);
        let centroid = if is_grey { CentroidMethod::GreyWeighted } else { CentroidMethod::GaussianFit };
        let mut config = DetectConfig::default();
config.centroid = centroid;
        for source in found_in(&frame, &config).sources {
            if let Err(unsound) = check_is_sound(&source, size.0, size.1) {
                prop_assert!(false, "{}", unsound);
            }
        }
    }
}
