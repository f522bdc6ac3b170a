//! Detection and centroids on simulated frames whose truth is known: false alarms, completeness,
//! accuracy against the Cramér-Rao bound, honesty of the standard errors, flags, hostile frames.

mod accuracy;
mod background;
mod below_black;
mod false_alarms;
mod pairs;
mod passes;
mod saturated;
mod soundness;
mod trails;
mod workspace;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, Poisson, StandardNormal};
use starpipe::detect::{DetectConfig, Detection, Detections, Workspace, detect};
use starpipe::frame::Frame;

/// Background of the simulated frames, in electrons per pixel.
const BACKGROUND_E: f64 = 100.0;
/// Read noise of the simulated frames, in electrons.
const READ_NOISE_E: f64 = 5.0;
/// Half side of the stamps into which stars are drawn, in pixels: six spot sizes at σ = 2 px.
const STAMP_PX: i64 = 12;

/// erf, by its series (exact to 1e-12 where it is used).
fn erf(x: f64) -> f64 {
    if x.abs() > 4.0 {
        return x.signum();
    }
    let (mut term, mut sum) = (x, x);
    for n in 1..80 {
        term *= -x * x / f64::from(n);
        sum += term / f64::from(2 * n + 1);
    }
    sum * 2.0 / std::f64::consts::PI.sqrt()
}

/// Share of a spot's light in pixel `i`, along one axis.
fn pixel_part(i: f64, center: f64, sigma: f64) -> f64 {
    let edge = |e: f64| erf((e - center) / (sigma * std::f64::consts::SQRT_2));
    0.5 * (edge(i + 0.5) - edge(i - 0.5))
}

/// The expected light of each pixel of a frame.
struct Sky {
    width: usize,
    height: usize,
    mean: Vec<f64>,
}

impl Sky {
    fn flat(width: usize, height: usize, level: f64) -> Self {
        Self {
            width,
            height,
            mean: vec![level; width * height],
        }
    }

    fn add_star(&mut self, x: f64, y: f64, flux: f64, sigma: f64) {
        let parts = |center: f64, side: usize| -> Vec<(usize, f64)> {
            let middle = center.round() as i64;
            let span = (middle - STAMP_PX).max(0)..=(middle + STAMP_PX).min(side as i64 - 1);
            span.map(|i| (i as usize, pixel_part(i as f64, center, sigma)))
                .collect()
        };
        let across = parts(x, self.width);
        for (row, part_y) in parts(y, self.height) {
            for &(column, part_x) in &across {
                self.mean[row * self.width + column] += flux * part_y * part_x;
            }
        }
    }

    /// The frame with photon and read noise.
    fn expose(&self, seed: u64) -> Frame<'static> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let pixels = self
            .mean
            .iter()
            .map(|&mean| {
                let photons: f64 = if mean > 0.0 {
                    Poisson::new(mean).unwrap().sample(&mut rng)
                } else {
                    0.0
                };
                let read: f64 = rng.sample(StandardNormal);
                (photons + READ_NOISE_E * read) as f32
            })
            .collect();
        Frame::new(self.width, self.height, pixels).unwrap()
    }
}

fn white_noise(width: usize, height: usize, sigma: f32, seed: u64) -> Frame<'static> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let normal = Normal::new(1000.0f32, sigma).unwrap();
    let pixels = (0..width * height)
        .map(|_| normal.sample(&mut rng))
        .collect();
    Frame::new(width, height, pixels).unwrap()
}

fn found_in(frame: &Frame, config: &DetectConfig) -> Detections {
    detect(frame, config, &mut Workspace::new()).unwrap()
}

fn config_with(spot_sigma_px: f64, false_alarms_per_mpx: f64) -> DetectConfig {
    let mut config = DetectConfig::default();
    config.spot_sigma_px = Some(spot_sigma_px);
    config.false_alarms_per_mpx = false_alarms_per_mpx;
    config
}

/// The detection nearest to a point, within `reach` pixels.
fn nearest(found: &Detections, x: f64, y: f64, reach: f64) -> Option<&Detection> {
    found
        .sources
        .iter()
        .map(|s| (s, (s.position.x - x).hypot(s.position.y - y)))
        .filter(|(_, d)| *d < reach)
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(s, _)| s)
}

/// Tolerated ratio of the measured to the requested rate.
const FALSE_ALARM_FACTOR: f64 = 1.5;

/// 60 stars on noise, for tests of disturbances that must not affect them.
fn star_field(seed: u64) -> (Sky, Vec<(f64, f64)>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut sky = Sky::flat(512, 384, BACKGROUND_E);
    let mut truth: Vec<(f64, f64)> = Vec::new();
    while truth.len() < 60 {
        let (x, y) = (rng.random_range(12.0..500.0), rng.random_range(12.0..372.0));
        if truth.iter().all(|t| (t.0 - x).hypot(t.1 - y) > 25.0) {
            sky.add_star(x, y, 3000.0 * 1.06f64.powi(truth.len() as i32), 0.9);
            truth.push((x, y));
        }
    }
    (sky, truth)
}

fn count_found(found: &Detections, truth: &[(f64, f64)]) -> usize {
    truth
        .iter()
        .filter(|t| nearest(found, t.0, t.1, 0.5).is_some_and(|s| s.flags.is_star_like()))
        .count()
}

/// Asserts what holds for every detection on any frame.
fn check_is_sound(s: &Detection, width: usize, height: usize) -> Result<(), String> {
    let is_inside = |at: f64, side: usize| (-0.5..=side as f64 - 0.5).contains(&at);
    let is_sigma = |sigma: f64| sigma > 0.0 && sigma <= width.max(height) as f64;
    let is_sound = is_inside(s.position.x, width)
        && is_inside(s.position.y, height)
        && is_sigma(s.sigma_x_px)
        && is_sigma(s.sigma_y_px)
        && s.flux_adu > 0.0
        && s.flux_adu.is_finite()
        && s.peak_adu.is_finite()
        && s.snr > 0.0
        && s.snr.is_finite();
    if is_sound {
        Ok(())
    } else {
        Err(format!("{s:?}"))
    }
}

/// Gaussian noise in units of the quantisation step, not rounded.
fn gaussian(level: f32, sigma: f32, rng: &mut ChaCha8Rng) -> f32 {
    level + sigma * rng.sample::<f32, _>(StandardNormal)
}
