use super::*;
use crate::detect::{DetectConfig, Workspace, detect};
use crate::frame::Frame;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const WIDTH: usize = 480;
const HEIGHT: usize = 400;
/// Standard deviation of stars and trails, without the pixels, and of the noise.
const SPOT_PX: f64 = 1.2;
const NOISE_ADU: f64 = 5.0;

/// Stars, most of them faint: x, y, flux.
fn stars(random: &mut ChaCha8Rng, count: usize) -> Vec<[f64; 3]> {
    let star = |random: &mut ChaCha8Rng| {
        let x = random.random_range(0.0..WIDTH as f64);
        let y = random.random_range(0.0..HEIGHT as f64);
        [x, y, 100.0 / random.random_range(0.003_f64..1.0)]
    };
    (0..count).map(|_| star(random)).collect()
}

/// The trails in a frame of noise, stars and `light`.
fn found(seed: u64, count: usize, light: impl Fn(f64, f64) -> f64) -> Vec<Trail> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut pixels: Vec<f64> = (0..WIDTH * HEIGHT)
        .map(|at| {
            let noise: f64 = StandardNormal.sample(&mut random);
            100.0 + NOISE_ADU * noise + light((at % WIDTH) as f64, (at / WIDTH) as f64)
        })
        .collect();
    for [x, y, flux] in stars(&mut random, count) {
        let near =
            |at: f64, side: usize| (at - 8.0).max(0.0) as usize..((at + 9.0) as usize).min(side);
        for row in near(y, HEIGHT) {
            for column in near(x, WIDTH) {
                let (dx, dy) = (column as f64 - x, row as f64 - y);
                pixels[row * WIDTH + column] += flux * profile(dx) * profile(dy);
            }
        }
    }
    // Of 12 bits.
    let pixels = pixels.into_iter().map(|p| p.round().min(4095.0) as f32);
    let frame = Frame::new(WIDTH, HEIGHT, pixels.collect()).unwrap();
    let frame = frame.with_levels(1.0, Some(4095.0));
    let mut workspace = Workspace::new();
    let found = detect(&frame, &DetectConfig::default(), &mut workspace).unwrap();
    workspace.find_trails(&frame, &found)
}

/// A Gaussian of area 1.
fn profile(across: f64) -> f64 {
    (-0.5 * (across / SPOT_PX).powi(2)).exp() / (SPOT_PX * std::f64::consts::TAU.sqrt())
}

/// The light of a straight trail at a place, of `flux` ADU a pixel of length.
fn trail([x0, y0]: [f64; 2], [x1, y1]: [f64; 2], flux: f64) -> impl Fn(f64, f64) -> f64 {
    let length = (x1 - x0).hypot(y1 - y0);
    let (tx, ty) = ((x1 - x0) / length, (y1 - y0) / length);
    move |x, y| {
        let (dx, dy) = (x - x0, y - y0);
        let along = dx * tx + dy * ty;
        let is_on = (0.0..length).contains(&along);
        if is_on {
            flux * profile(dy * tx - dx * ty)
        } else {
            0.0
        }
    }
}

#[test]
fn noise_and_stars_have_no_trails() {
    for seed in 0..20 {
        let trails = found(seed, 150, |_, _| 0.0);
        assert!(trails.is_empty(), "seed {seed}: {trails:?}");
    }
}

#[test]
fn correlated_noise_has_no_trails() {
    // Blocks whose pixels have the same noise, as those of JPEG files nearly have.
    for seed in 0..10 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let blocks: Vec<f64> = (0..WIDTH * HEIGHT / 50)
            .map(|_| StandardNormal.sample(&mut random))
            .collect();
        let trails = found(seed, 80, |x, y| {
            let block = (y as usize / 8) * (WIDTH / 8) + x as usize / 8;
            NOISE_ADU * blocks[block]
        });
        assert!(trails.is_empty(), "seed {seed}: {trails:?}");
    }
}

#[test]
fn a_trail_that_no_pixel_shows_is_found_if_it_is_long() {
    // Four tenths of the noise at its ridge.
    let flux = 0.4 * NOISE_ADU / profile(0.0);
    let trails = found(5, 80, trail([-20.0, 61.0], [500.0, 330.0], flux));
    assert_eq!(trails.len(), 1, "{trails:?}");
    assert!(trails[0].length_px() > 400.0, "{trails:?}");
}

#[test]
fn two_crossing_trails_are_two() {
    let first = trail([20.0, 30.0], [450.0, 380.0], 40.0);
    let second = trail([30.0, 370.0], [440.0, 50.0], 25.0);
    let trails = found(6, 80, |x, y| first(x, y) + second(x, y));
    assert_eq!(trails.len(), 2, "{trails:?}");
}

#[test]
fn edges_columns_and_spikes_are_no_trails() {
    let edge = found(7, 50, |x, y| if y > 120.0 + 0.4 * x { 40.0 } else { 0.0 });
    assert!(edge.is_empty(), "{edge:?}");
    let column = found(8, 50, |x, _| if x == 200.0 { 15.0 } else { 0.0 });
    assert!(column.is_empty(), "{column:?}");
    // A star far beyond saturation, with four spikes that fade.
    let spikes = found(9, 50, |x, y| {
        let (dx, dy) = (x - 240.0, y - 200.0);
        let star = 2e6 * profile(dx) * profile(dy);
        let arm = |along: f64, across: f64| 800.0 * profile(across) * (-along.abs() / 40.0).exp();
        let (u, v) = ((dx + dy) / 2.0_f64.sqrt(), (dy - dx) / 2.0_f64.sqrt());
        star + arm(u, v) + arm(v, u)
    });
    assert!(spikes.is_empty(), "{spikes:?}");
}

#[test]
fn the_tail_of_the_normal_distribution_is_bounded_from_above() {
    for (snr, expected) in [
        (3.0, 1.349_898e-3),
        (5.0, 2.866_516e-7),
        (7.0, 1.279_813e-12),
    ] {
        let bound = 10.0_f64.powf(radon::log10_tail(snr));
        assert!(
            (1.0..1.12).contains(&(bound / expected)),
            "{snr}: {bound:e}"
        );
    }
}
