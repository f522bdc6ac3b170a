//! Pictures that show no sky, in grey levels of eight bits.

use super::canvas::ClutterCanvas;
use super::chance::{log_uniform, normal, place};
use super::kind::ClutterKind;
use super::recording::JPEG_QUALITY;
use super::scenery;
use crate::base::coords::PixelPoint;
use crate::base::size::Size;
use crate::frame::{Frame, FrameError};
use crate::lab::simulate::decoded_jpeg;
use image::ExtendedColorType;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

const WIDTH: usize = 1024;
const HEIGHT: usize = 768;
const WHITE: f64 = 255.0;

/// A picture of a kind that shows no sky; every second one is a JPEG.
pub(super) fn picture(
    kind: ClutterKind,
    random: &mut ChaCha8Rng,
) -> Result<Frame<'static>, FrameError> {
    let mut canvas = ClutterCanvas::new(WIDTH, HEIGHT);
    let ground = Ground::of(kind, random);
    match kind {
        ClutterKind::Dots => dots(&mut canvas, random),
        ClutterKind::Text => text(&mut canvas, &ground, random),
        ClutterKind::Drawings => drawings(&mut canvas, &ground, random),
        ClutterKind::FoliageAlone => scenery::foliage(&mut canvas, random),
        ClutterKind::Windows => facade(&mut canvas, random),
        ClutterKind::Snow => snow(&mut canvas, random),
        ClutterKind::Bokeh => bokeh(&mut canvas, random),
        _ => (),
    }
    let structure = (kind == ClutterKind::ColoredNoise).then(|| structure(random));
    let mut levels = Vec::with_capacity(WIDTH * HEIGHT);
    for at in 0..WIDTH * HEIGHT {
        let added = structure.as_ref().map_or(0.0, |structure| structure[at]);
        let behind = ground.level + ground.noise * (f64::from(canvas.glow[at]) + added);
        let before = ground.level + ground.noise * f64::from(canvas.light[at]);
        let opacity = f64::from(canvas.opacity[at]);
        let level = behind * (1.0 - opacity) + before * opacity;
        let noise = ground.noise * normal(random);
        levels.push((level + noise).round().clamp(0.0, WHITE) as u8);
    }
    if random.random_bool(0.5) {
        return decoded_jpeg(
            &levels,
            Size::new(WIDTH, HEIGHT),
            ExtendedColorType::L8,
            JPEG_QUALITY,
        );
    }
    let pixels = levels.into_iter().map(f32::from).collect();
    let frame = Frame::new(WIDTH, HEIGHT, pixels)?;
    Ok(frame.with_levels(1.0, Some(WHITE as f32)))
}

/// The even ground of a picture, and its noise: the unit of everything that is drawn on it.
struct Ground {
    level: f64,
    noise: f64,
}

impl Ground {
    fn of(kind: ClutterKind, random: &mut ChaCha8Rng) -> Self {
        let is_paper =
            matches!(kind, ClutterKind::Text | ClutterKind::Drawings) && random.random_bool(0.5);
        Self {
            level: if is_paper {
                random.random_range(180.0..250.0)
            } else {
                log_uniform(random, 2.0, 90.0)
            },
            noise: log_uniform(random, 0.5, 8.0),
        }
    }

    /// Ink or chalk: far from the ground, in units of the noise.
    fn contrast(&self) -> f64 {
        let level = if self.level > 0.5 * WHITE {
            20.0
        } else {
            240.0
        };
        (level - self.level) / self.noise
    }
}

/// Star-like spots, few bright and many faint ones.
fn dots(canvas: &mut ClutterCanvas, random: &mut ChaCha8Rng) {
    let sigma_px = log_uniform(random, 0.6, 2.5);
    let slope = random.random_range(0.5..2.0);
    for _ in 0..log_uniform(random, 5.0, 800.0) as usize {
        let at = place(canvas, random);
        let share = random.random_range(0.01..1.0_f64);
        canvas.spot(&at, sigma_px, 6.0 * libm::pow(share, -slope));
    }
}

/// Seven rows of five bits: capital letters.
const LETTERS: [[u8; 7]; 12] = [
    [0x1f, 0x10, 0x10, 0x1e, 0x10, 0x10, 0x1f],
    [0x1f, 0x04, 0x04, 0x04, 0x04, 0x04, 0x04],
    [0x0e, 0x11, 0x11, 0x1f, 0x11, 0x11, 0x11],
    [0x0e, 0x11, 0x11, 0x11, 0x11, 0x11, 0x0e],
    [0x0e, 0x04, 0x04, 0x04, 0x04, 0x04, 0x0e],
    [0x11, 0x19, 0x15, 0x15, 0x13, 0x11, 0x11],
    [0x0f, 0x10, 0x10, 0x0e, 0x01, 0x01, 0x1e],
    [0x11, 0x11, 0x11, 0x1f, 0x11, 0x11, 0x11],
    [0x1e, 0x11, 0x11, 0x1e, 0x14, 0x12, 0x11],
    [0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x1f],
    [0x00, 0x00, 0x00, 0x00, 0x00, 0x0c, 0x0c],
    [0x00, 0x04, 0x00, 0x00, 0x00, 0x04, 0x00],
];

fn text(canvas: &mut ClutterCanvas, ground: &Ground, random: &mut ChaCha8Rng) {
    let dot_px = log_uniform(random, 0.8, 5.0);
    let light = ground.contrast();
    let margin = random.random_range(10.0..120.0);
    let mut y = margin;
    while y + 7.0 * dot_px < HEIGHT as f64 - margin {
        let mut x = margin;
        let end = WIDTH as f64 - margin * random.random_range(1.0..3.0);
        while x + 5.0 * dot_px < end {
            // A blank ends a word.
            if random.random_bool(0.83) {
                let letter = &LETTERS[random.random_range(0..LETTERS.len())];
                draw_letter(canvas, letter, &PixelPoint::new(x, y), dot_px, light);
            }
            x += 6.0 * dot_px;
        }
        y += 10.0 * dot_px;
    }
}

fn draw_letter(
    canvas: &mut ClutterCanvas,
    letter: &[u8; 7],
    at: &PixelPoint,
    dot_px: f64,
    light: f64,
) {
    for (row, bits) in letter.iter().enumerate() {
        for column in (0..5).filter(|column| bits >> (4 - column) & 1 == 1) {
            let low = PixelPoint::new(
                at.x + f64::from(column) * dot_px,
                at.y + row as f64 * dot_px,
            );
            let high = PixelPoint::new(low.x + dot_px, low.y + dot_px);
            canvas.rectangle(&low, &high, light);
        }
    }
}

fn drawings(canvas: &mut ClutterCanvas, ground: &Ground, random: &mut ChaCha8Rng) {
    let light = ground.contrast();
    for _ in 0..random.random_range(3..60) {
        let width_px = log_uniform(random, 0.8, 6.0);
        let (from, to) = (place(canvas, random), place(canvas, random));
        match random.random_range(0..4) {
            0 => canvas.line(&from, &to, width_px, light),
            1 => circle(
                canvas,
                &from,
                random.random_range(4.0..150.0),
                width_px,
                light,
            ),
            2 => {
                let corners = [
                    from,
                    PixelPoint::new(to.x, from.y),
                    to,
                    PixelPoint::new(from.x, to.y),
                ];
                for side in 0..4 {
                    canvas.line(&corners[side], &corners[(side + 1) % 4], width_px, light);
                }
            }
            _ => canvas.ellipse(&from, [width_px; 2], 0.0, light),
        }
    }
}

fn circle(canvas: &mut ClutterCanvas, centre: &PixelPoint, radius: f64, width_px: f64, light: f64) {
    const PARTS: u32 = 48;
    let at = |part: u32| {
        let (sin, cos) = libm::sincos(TAU * f64::from(part) / f64::from(PARTS));
        PixelPoint::new(centre.x + radius * cos, centre.y + radius * sin)
    };
    for part in 0..PARTS {
        canvas.line(&at(part), &at(part + 1), width_px, light);
    }
}

/// A regular facade with some lit windows.
fn facade(canvas: &mut ClutterCanvas, random: &mut ChaCha8Rng) {
    let side = log_uniform(random, 2.0, 24.0);
    let [across, down] = [0, 1].map(|_| side * random.random_range(1.5..5.0));
    let lit = random.random_range(0.02..0.7);
    let skew = random.random_range(-0.2..0.2);
    let mut y = -0.2 * HEIGHT as f64;
    while y < 1.2 * HEIGHT as f64 {
        let mut x = 0.0;
        while x < WIDTH as f64 {
            if random.random_bool(lit) {
                let low = PixelPoint::new(x, y + skew * x);
                let high = PixelPoint::new(x + side, low.y + 1.4 * side);
                canvas.rectangle(&low, &high, log_uniform(random, 5.0, 300.0));
            }
            x += across;
        }
        y += down;
    }
}

/// Flakes near and far, in and out of focus.
fn snow(canvas: &mut ClutterCanvas, random: &mut ChaCha8Rng) {
    for _ in 0..log_uniform(random, 30.0, 800.0) as usize {
        let at = place(canvas, random);
        let near = random.random::<f64>();
        let radius_px = 0.8 + 12.0 * libm::pow(near, 4.0);
        let light = 60.0 * random.random_range(0.1..1.0) / radius_px;
        if radius_px < 2.0 {
            canvas.spot(&at, radius_px, 3.0 * light);
        } else {
            canvas.disc_of_light(&at, radius_px, 0.4 * radius_px, 0.0, light);
        }
    }
}

/// Lamps as discs of about one size, which overlap.
fn bokeh(canvas: &mut ClutterCanvas, random: &mut ChaCha8Rng) {
    let radius_px = log_uniform(random, 4.0, 60.0);
    let rim = random.random_range(0.0..1.5);
    for _ in 0..log_uniform(random, 8.0, 200.0) as usize {
        let at = place(canvas, random);
        let own_px = radius_px * random.random_range(0.7..1.2);
        canvas.disc_of_light(&at, own_px, 1.5, rim, log_uniform(random, 3.0, 80.0));
    }
}

/// Noise with structure of all sizes: a sum of smooth noises, each of half the size of the last.
fn structure(random: &mut ChaCha8Rng) -> Vec<f64> {
    const OCTAVES: usize = 8;
    let fall = random.random_range(0.5..1.3);
    let strength = log_uniform(random, 0.5, 8.0);
    let mut sum = vec![0.0; WIDTH * HEIGHT];
    for octave in 0..OCTAVES {
        let cell = 2usize << octave;
        let columns = WIDTH / cell + 2;
        let rows = HEIGHT / cell + 2;
        let knots: Vec<f64> = (0..columns * rows).map(|_| normal(random)).collect();
        // Larger structures are stronger, by the power `fall` of their size.
        let weight = strength * libm::pow(cell as f64 / 16.0, fall - 0.5);
        for (at, value) in sum.iter_mut().enumerate() {
            let (x, y) = (at % WIDTH, at / WIDTH);
            let (column, row) = (x / cell, y / cell);
            let [u, v] = [x % cell, y % cell].map(|part| part as f64 / cell as f64);
            let knot = |dx: usize, dy: usize| knots[(row + dy) * columns + column + dx];
            let upper = knot(0, 0) * (1.0 - u) + knot(1, 0) * u;
            let lower = knot(0, 1) * (1.0 - u) + knot(1, 1) * u;
            *value += weight * (upper * (1.0 - v) + lower * v);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn every_picture_shows_something_and_no_two_are_the_same() {
        for kind in ClutterKind::ALL.into_iter().filter(|kind| !kind.is_sky()) {
            let make = |seed| picture(kind, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            let (one, other) = (make(1), make(2));
            assert_eq!(one.pixels, make(1).pixels);
            assert_ne!(one.pixels, other.pixels, "{kind:?}");
            let first = one.pixels.value(0);
            assert!(one.values().iter().any(|pixel| *pixel != first), "{kind:?}");
        }
    }
}
