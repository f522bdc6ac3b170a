//! Detection limit at one false detection per megapixel, compared with the ideal matched filter:
//! the one with the true spot, background and noise, and the threshold that gives this rate.

use super::stars::{Field, Star, data_sheet, found_at};
use rayon::prelude::*;
use starpipe::base::coords::PixelPoint;
use starpipe::base::statistics::normal_cdf;
use starpipe::detect::{DetectConfig, Workspace, detect};
use starpipe::frame::Frame;

pub const SIDE_PX: usize = 1024;
/// Requested false detections per megapixel.
const FALSE_PER_MPX: f64 = 1.0;
/// Signal-to-noise ratios of the faint stars, uniform in this range, and of those from which the
/// spot is measured.
pub const FAINT: (f64, f64) = (2.0, 9.0);
const BRIGHT: (f64, f64) = (50.0, 50.0);
/// One star in this many is bright.
const BRIGHT_EVERY: usize = 8;
/// A detection farther than this from all stars is false.
const FALSE_BEYOND_PX: f64 = 8.0;

pub fn field(spot_sigma_px: f64) -> Field {
    Field::new(data_sheet(SIDE_PX, spot_sigma_px), 100.0)
}

/// Faint stars, the first class, and some bright ones.
pub fn frame(field: &Field, seed: u64) -> (Vec<Star>, Frame<'static>) {
    let mut ranges = [FAINT; BRIGHT_EVERY];
    ranges[BRIGHT_EVERY - 1] = BRIGHT;
    field.frame(&ranges, seed)
}

fn is_faint(star: &Star) -> bool {
    star.class != BRIGHT_EVERY - 1
}

/// Detections of one detector.
#[derive(Debug, Clone, Copy, Default)]
struct Found {
    stars: f64,
    found: f64,
    false_detections: f64,
    pixels: f64,
}

impl Found {
    fn merge(self, other: Self) -> Self {
        Self {
            stars: self.stars + other.stars,
            found: self.found + other.found,
            false_detections: self.false_detections + other.false_detections,
            pixels: self.pixels + other.pixels,
        }
    }

    /// The signal-to-noise ratio at which half of the stars are detected, and its standard error:
    /// of stars uniform in this ratio, the share detected is that beyond it (Spearman 1908, Br. J.
    /// Psychol. 2, 227; Kärber 1931).
    fn snr_50(&self) -> (f64, f64) {
        let range = FAINT.1 - FAINT.0;
        // Detection is random only within about a standard deviation: the mean of Φ(1 − Φ) is 1/√π
        // of it.
        let variance = range / (self.stars * std::f64::consts::PI.sqrt());
        (FAINT.1 - range * self.found / self.stars, variance.sqrt())
    }

    fn false_per_mpx(&self) -> f64 {
        1e6 * self.false_detections / self.pixels
    }
}

fn judged(stars: &[Star], places: &[PixelPoint], is_found: impl Fn(&Star) -> bool) -> Found {
    let far = |place: &&PixelPoint| {
        stars
            .iter()
            .all(|star| star.place.distance_to(place) > FALSE_BEYOND_PX)
    };
    let faint = || stars.iter().filter(|star| is_faint(star));
    Found {
        stars: faint().count() as f64,
        found: faint().filter(|star| is_found(star)).count() as f64,
        false_detections: places.iter().filter(far).count() as f64,
        pixels: (SIDE_PX * SIDE_PX) as f64
            - stars.len() as f64 * std::f64::consts::PI * FALSE_BEYOND_PX.powi(2),
    }
}

/// Detections in this many frames.
fn measured(field: &Field, frames: u64) -> Found {
    let mut config = DetectConfig::default();
    config.false_alarms_per_mpx = FALSE_PER_MPX;
    let one = |workspace: &mut Workspace, seed: u64| {
        let (stars, frame) = frame(field, seed);
        let found = detect(&frame, &config, workspace).unwrap();
        let places: Vec<_> = found.sources.iter().map(|source| source.position).collect();
        judged(&stars, &places, |star| {
            found_at(&found, &star.place).is_some()
        })
    };
    let seeds = (0..frames).into_par_iter();
    seeds
        .map_init(Workspace::new, one)
        .reduce(Found::default, Found::merge)
}

/// Output of the ideal matched filter in units of the noise, row-major.
fn ideal_filter(field: &Field, frame: &Frame) -> Vec<f64> {
    let sheet = &field.scenario.camera;
    let radius = (4.0 * sheet.spot_sigma_px).ceil() as usize + 1;
    let share = |i: usize| {
        let edge = |half: f64| normal_cdf((i as f64 + half) / sheet.spot_sigma_px);
        edge(0.5) - edge(-0.5)
    };
    let half: Vec<f64> = (0..=radius).map(share).collect();
    let norm: f64 = half[0].powi(2) + 2.0 * half[1..].iter().map(|p| p * p).sum::<f64>();
    let level_e = field.background_e() + sheet.bias_adu;
    let data: Vec<f64> = frame
        .values()
        .iter()
        .map(|p| (f64::from(*p) - level_e) / field.pixel_noise_e())
        .collect();
    let at = |data: &[f64], x: isize, y: isize| {
        let inside = |v: isize| (0..SIDE_PX as isize).contains(&v);
        if inside(x) && inside(y) {
            data[y as usize * SIDE_PX + x as usize]
        } else {
            0.0
        }
    };
    let pass = |data: &[f64], dx: isize, dy: isize| -> Vec<f64> {
        let value = |i: usize| {
            let (x, y) = ((i % SIDE_PX) as isize, (i / SIDE_PX) as isize);
            let pair =
                |j: isize| at(data, x + j * dx, y + j * dy) + at(data, x - j * dx, y - j * dy);
            let sum: f64 = (1..=radius).map(|j| half[j] * pair(j as isize)).sum();
            (sum + half[0] * data[i]) / norm.sqrt()
        };
        (0..data.len()).map(value).collect()
    };
    pass(&pass(&data, 1, 0), 0, 1)
}

/// Local maxima above `threshold`, without the border, where the ideal filter differs.
fn maxima(filtered: &[f64], threshold: f64) -> Vec<(PixelPoint, f64)> {
    const BORDER: usize = 8;
    let inside = || BORDER..SIDE_PX - BORDER;
    let mut found = Vec::new();
    for y in inside() {
        for x in inside() {
            let value = filtered[y * SIDE_PX + x];
            let is_highest =
                || (0..9).all(|i| filtered[(y + i / 3 - 1) * SIDE_PX + x + i % 3 - 1] <= value);
            if value > threshold && is_highest() {
                found.push((PixelPoint::new(x as f64, y as f64), value));
            }
        }
    }
    found
}

/// The threshold at which the ideal filter has the requested rate of false detections, from this
/// many frames of noise.
fn ideal_threshold(field: &Field, frames: u64) -> f64 {
    let mut heights: Vec<f64> = (0..frames)
        .into_par_iter()
        .flat_map_iter(|seed| maxima(&ideal_filter(field, &field.draw(&[], seed)), 4.0))
        .map(|(_, height)| height)
        .collect();
    heights.sort_by(|a, b| b.total_cmp(a));
    heights[(FALSE_PER_MPX * frames as f64 * (SIDE_PX * SIDE_PX) as f64 / 1e6) as usize]
}

fn ideal(field: &Field, threshold: f64, frames: u64) -> Found {
    let one = |seed: u64| {
        let (stars, frame) = frame(field, seed);
        let found = maxima(&ideal_filter(field, &frame), threshold);
        let places: Vec<_> = found.into_iter().map(|(place, _)| place).collect();
        judged(&stars, &places, |star| {
            places
                .iter()
                .any(|place| place.distance_to(&star.place) < 2.0)
        })
    };
    (0..frames)
        .into_par_iter()
        .map(one)
        .reduce(Found::default, Found::merge)
}

/// Magnitudes by which one limit is brighter than another.
fn loss_mag(snr: f64, ideal: f64) -> f64 {
    2.5 * (snr / ideal).log10()
}

#[test]
fn the_limit_is_that_of_the_ideal_filter_at_the_requested_rate() {
    const FRAMES: u64 = 24;
    const MAX_LOSS_MAG: f64 = 0.1;
    for (spot_px, ideal) in IDEAL {
        let found = measured(&field(spot_px), FRAMES);
        let (snr, sigma) = found.snr_50();
        assert!(
            loss_mag(snr - 3.0 * sigma, ideal) < MAX_LOSS_MAG,
            "{spot_px}: {snr}"
        );
        // Within a factor of 1.5, and three standard errors of a Poisson count.
        let wanted = FALSE_PER_MPX * found.pixels / 1e6;
        let count = found.false_detections;
        assert!(
            (wanted / 1.5 - 3.0 * (wanted / 1.5).sqrt()
                ..=1.5 * wanted + 3.0 * (1.5 * wanted).sqrt())
                .contains(&count),
            "{spot_px}: {count} for {wanted}"
        );
    }
}

/// Spot sizes in pixels, and the signal-to-noise ratio at which the ideal filter detects half of
/// the stars; from 60 Mpx of noise and 12 000 stars, see the table.
const IDEAL: [(f64, f64); 4] = [(0.5, 5.340), (0.7, 5.040), (1.0, 4.685), (1.5, 4.515)];

#[test]
#[ignore = "minutes of frames; prints the table"]
fn table_of_detection() {
    const FRAMES: u64 = 60;
    println!(
        "sigma  ideal threshold, SNR at 50 %   detector: SNR at 50 %, loss mag, false per Mpx"
    );
    for spot_px in [0.5, 0.7, 1.0, 1.25, 1.5] {
        let field = field(spot_px);
        let threshold = ideal_threshold(&field, FRAMES);
        let (best, best_sigma) = ideal(&field, threshold, FRAMES).snr_50();
        let found = measured(&field, FRAMES);
        let (snr, sigma) = found.snr_50();
        let loss = loss_mag(snr, best);
        println!(
            "{spot_px:5.2}  {threshold:.3} {best:.3} ± {best_sigma:.3}   {snr:.3} ± {sigma:.3}  {loss:+.3}  {:.2} ± {:.2}",
            found.false_per_mpx(),
            1e6 * found.false_detections.sqrt() / found.pixels
        );
    }
}
