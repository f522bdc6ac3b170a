//! How a frame is recorded: clutter before the sky, eight bits, a mosaic of colors, JPEG.

use super::canvas::ClutterCanvas;
use super::chance::{log_uniform, normal};
use crate::base::statistics::{SIGMA_PER_MAD, median};
use crate::frame::{Frame, FrameError};
use crate::lab::simulate::{color, decoded_jpeg, demosaiced};
use image::ExtendedColorType;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// The quality of JPEGs.
pub(super) const JPEG_QUALITY: u8 = 70;
/// The largest level of eight bits.
const WHITE: f64 = 255.0;

/// The sky of a frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct RecordedSky {
    level: f64,
    /// Standard deviation of a pixel.
    noise: f64,
}

impl RecordedSky {
    /// The median, and the noise from the differences of neighbors.
    pub(super) fn of(frame: &Frame) -> Self {
        /// Standard deviation over the median absolute difference of two neighbors.
        const NOISE_OF_DIFFERENCE: f64 = SIGMA_PER_MAD * std::f64::consts::FRAC_1_SQRT_2;
        const STRIDE: usize = 7;
        let pixels = frame.values();
        let pairs = pixels.windows(2).step_by(STRIDE);
        let mut differences: Vec<f32> = pairs.map(|pair| (pair[1] - pair[0]).abs()).collect();
        let mut levels: Vec<f32> = pixels.iter().step_by(STRIDE).copied().collect();
        let noise = NOISE_OF_DIFFERENCE * f64::from(median(&mut differences));
        Self {
            level: f64::from(median(&mut levels)),
            // Integers: at least the noise of rounding.
            noise: noise.max(0.29),
        }
    }
}

/// `frame` behind `canvas`, which has the sky's noise.
pub(super) fn behind(
    mut frame: Frame<'static>,
    canvas: &ClutterCanvas,
    random: &mut ChaCha8Rng,
) -> Frame<'static> {
    let sky = RecordedSky::of(&frame);
    let most = frame.saturation_adu.unwrap_or(f32::MAX);
    let layers = canvas.opacity.iter().zip(&canvas.light).zip(&canvas.glow);
    for (pixel, ((opacity, light), glow)) in frame.values_mut().iter_mut().zip(layers) {
        if *opacity == 0.0 && *glow == 0.0 {
            continue;
        }
        let [opacity, light, glow] = [*opacity, *light, *glow].map(f64::from);
        let before = sky.level + sky.noise * (light + shot_noise(light, random));
        let seen = f64::from(*pixel) * (1.0 - opacity) + before.max(0.0) * opacity;
        let added = sky.noise * (glow + 0.1 * shot_noise(glow, random) * glow.sqrt());
        *pixel = ((seen + added).round() as f32).clamp(0.0, most);
    }
    frame
}

/// Noise of a surface this much above the sky, in units of the sky's noise.
fn shot_noise(light: f64, random: &mut ChaCha8Rng) -> f64 {
    /// Light of the sky in units of its noise, as in a frame with some hundred electrons of sky.
    const SKY_LIGHT: f64 = 20.0;
    let relative = (1.0 + light / SKY_LIGHT).max(0.05);
    relative.sqrt() * normal(random)
}

/// The bright part of `frame` mirrored in a window, added to it.
pub(super) fn mirrored_in_window(
    mut frame: Frame<'static>,
    random: &mut ChaCha8Rng,
) -> Frame<'static> {
    let sky = RecordedSky::of(&frame);
    let share = random.random_range(0.1..0.6);
    let most = frame.saturation_adu.unwrap_or(f32::MAX);
    let shift: usize = random.random_range(0..frame.width);
    let width = frame.width;
    for row in frame.values_mut().chunks_exact_mut(width) {
        let original = row.to_vec();
        for (x, pixel) in row.iter_mut().enumerate() {
            let mirrored =
                f64::from(original[(2 * original.len() - 1 - x - shift) % original.len()]);
            let light = mirrored - sky.level;
            if light > 4.0 * sky.noise {
                *pixel = ((f64::from(*pixel) + share * light).round() as f32).min(most);
            }
        }
    }
    frame
}

/// `frame` in eight bits, with a black level that is above the sky in parts of it: the sky becomes
/// brighter across the frame.
pub(super) fn cut_off(mut frame: Frame<'static>, random: &mut ChaCha8Rng) -> Frame<'static> {
    let sky = RecordedSky::of(&frame);
    // Levels in one standard deviation of the noise.
    let levels = random.random_range(0.6..2.5);
    let gain = levels / sky.noise;
    let gradient_sigmas = log_uniform(random, 1.0, 12.0);
    // The share of the frame whose sky is above black.
    let above = random.random_range(0.2..0.8);
    let (sin, cos) = libm::sincos(random.random_range(0.0..std::f64::consts::TAU));
    let (width, height) = (frame.width as f64, frame.height as f64);
    let columns = frame.width;
    for (index, pixel) in frame.values_mut().iter_mut().enumerate() {
        let x = (index % columns) as f64 / width - 0.5;
        let y = (index / columns) as f64 / height - 0.5;
        let along = x * cos + y * sin + above - 0.5;
        let shifted = f64::from(*pixel) - sky.level + gradient_sigmas * sky.noise * along;
        *pixel = (gain * shifted).round().clamp(0.0, WHITE) as f32;
    }
    frame.with_levels(1.0, Some(WHITE as f32))
}

/// `frame` as a phone records it: a mosaic of colors, demosaiced, a tone curve, JPEG.
pub(super) fn as_jpeg(
    frame: &Frame,
    random: &mut ChaCha8Rng,
) -> Result<Frame<'static>, FrameError> {
    /// Response of red, green and blue pixels to the light of a grey surface.
    const RESPONSE: [f64; 3] = [0.5, 1.0, 0.6];
    let sky = RecordedSky::of(frame);
    let black = sky.level - sky.noise * random.random_range(2.0..8.0);
    let white = sky.level + sky.noise * log_uniform(random, 60.0, 1000.0);
    let mosaic: Vec<f64> = frame
        .values()
        .iter()
        .enumerate()
        .map(|(index, pixel)| {
            let response = RESPONSE[color(index % frame.width, index / frame.width)];
            // White balance: the noise of weak colors is amplified.
            let extra = (1.0 / response - 1.0).sqrt() * sky.noise * normal(random);
            (f64::from(*pixel) + extra - black) / (white - black)
        })
        .collect();
    let colors = demosaiced(&mosaic, frame.width, frame.height);
    let gamma = 1.0 / random.random_range(1.8..2.4);
    let tone = |linear: f64| (WHITE * libm::pow(linear.clamp(0.0, 1.0), gamma)).round() as u8;
    let bytes: Vec<u8> = colors.into_iter().flatten().map(tone).collect();
    decoded_jpeg(&bytes, frame.size(), ExtendedColorType::Rgb8, JPEG_QUALITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn noisy(level: f64, noise: f64) -> Frame<'static> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let pixel = |_| (level + noise * normal(&mut random)).round() as f32;
        let pixels = (0..200 * 160).map(pixel).collect();
        Frame::new(200, 160, pixels)
            .unwrap()
            .with_levels(1.0, Some(4095.0))
    }

    #[test]
    fn level_and_noise_of_a_sky_are_measured() {
        // The median difference of whole levels is a whole number: 12 for 11.4.
        let sky = RecordedSky::of(&noisy(300.0, 12.0));
        assert!(
            (sky.level - 300.0).abs() < 1.0 && (sky.noise - 12.0).abs() < 0.7,
            "{sky:?}"
        );
    }

    #[test]
    fn an_opaque_shape_replaces_the_sky() {
        let mut canvas = ClutterCanvas::new(200, 160);
        canvas.below([0.0, 200.0], |_| 80.0, |_| 10.0);
        let sky = RecordedSky::of(&noisy(300.0, 12.0));
        let frame = behind(
            noisy(300.0, 12.0),
            &canvas,
            &mut ChaCha8Rng::seed_from_u64(2),
        );
        let mean = |rows: std::ops::Range<usize>| {
            let part = &frame.values()[rows.start * 200..rows.end * 200];
            f64::from(part.iter().sum::<f32>()) / part.len() as f64
        };
        assert!((mean(0..79) - 300.0).abs() < 1.0);
        let expected = sky.level + 10.0 * sky.noise;
        assert!((mean(82..160) - expected).abs() < 1.0);
    }

    #[test]
    fn parts_of_a_cut_off_frame_are_black() {
        let frame = cut_off(noisy(300.0, 12.0), &mut ChaCha8Rng::seed_from_u64(3));
        let black = frame.values().iter().filter(|pixel| **pixel == 0.0).count();
        let share = black as f64 / frame.pixels.len() as f64;
        assert!((0.1..0.9).contains(&share), "{share}");
        assert_eq!(frame.saturation_adu, Some(255.0));
        let whole = |pixel: &f32| pixel.fract() == 0.0 && (0.0..=255.0).contains(pixel);
        assert!(frame.values().iter().all(whole));
    }

    #[test]
    fn a_jpeg_is_read_as_a_frame_of_eight_bits() {
        let frame = as_jpeg(&noisy(300.0, 12.0), &mut ChaCha8Rng::seed_from_u64(4)).unwrap();
        assert_eq!((frame.width, frame.height), (200, 160));
        let most = frame.values().iter().copied().fold(0.0, f32::max);
        assert!((1.0..=255.0).contains(&most));
    }
}
