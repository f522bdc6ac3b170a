//! From decoded samples to a frame: luminance, saturation and the step between grey levels.

use super::error::FrameError;
use super::image::{Frame, check_size};
use super::pixels::Pixels;
use multiversion::multiversion;

/// Weights of red, green and blue in luminance: ITU-R BT.601, as in JPEG.
pub const LUMINANCE_WEIGHTS: [f32; 3] = [0.299, 0.587, 0.114];

/// Largest step between grey levels that is recognized in files that store few bits in wide words:
/// 2¹².
const MAX_STEP: i64 = 1 << 12;

/// Decoded samples of one frame.
pub(super) struct Samples<'a, T> {
    pub width: usize,
    pub height: usize,
    /// Interleaved, `height * width * channels`.
    pub values: &'a [T],
    /// 1: grey; 2: grey and alpha; 3: colour; 4: colour and alpha.
    pub channels: usize,
}

/// Makes a frame from integer samples; `full_scale` is the largest value of the format, in ADU.
pub(super) fn frame_from_integers<T: Copy + Into<i64>>(
    samples: &Samples<'_, T>,
    full_scale: T,
) -> Result<Frame, FrameError> {
    let (width, height) = (samples.width, samples.height);
    check_size(width, height)?;
    let expected = width * height * samples.channels;
    let values = samples
        .values
        .get(..expected)
        .ok_or(FrameError::WrongLength {
            expected: width * height,
            found: samples.values.len() / samples.channels,
        })?;
    let level = |v: T| -> f32 { v.into() as f32 };
    let full = level(full_scale);
    let pixels = match samples.channels {
        1 => grey(values.iter().copied(), full_scale),
        2 => grey(values.chunks_exact(2).map(|c| c[0]), full_scale),
        channels => {
            let colours = values.chunks_exact(channels);
            let luminance = |c: &[T]| luminance([level(c[0]), level(c[1]), level(c[2])], full);
            Pixels::F32(colours.map(luminance).collect())
        }
    };
    let step = if samples.channels <= 2 {
        level_step(values, |&v| v.into(), full_scale.into())
    } else {
        1
    };
    let frame = Frame::from_checked(width, height, pixels);
    Ok(with_step(frame, step, full_scale.into()))
}

/// Grey levels in the smallest samples that hold all of the format.
fn grey<T: Into<i64>>(levels: impl Iterator<Item = T>, full_scale: T) -> Pixels {
    let levels = levels.map(Into::into);
    match full_scale.into() {
        // Of signed types, which hold values below 0.
        0x7f | 0x7fff => Pixels::F32(levels.map(|level: i64| level as f32).collect()),
        0..=0xff => Pixels::U8(levels.map(|level: i64| level as u8).collect()),
        0x100..=0xffff => Pixels::U16(levels.map(|level: i64| level as u16).collect()),
        _ => Pixels::F32(levels.map(|level: i64| level as f32).collect()),
    }
}

/// Makes a frame from `height * width` words of 16 bits; its pixels are stored in `buffer`.
pub(super) fn frame_from_words(
    (width, height): (usize, usize),
    words: &[[u8; 2]],
    is_big_endian: bool,
    mut buffer: Vec<u16>,
) -> Result<Frame, FrameError> {
    check_size(width, height)?;
    let expected = width * height;
    let words = words.get(..expected).ok_or(FrameError::WrongLength {
        expected,
        found: words.len(),
    })?;
    // Clears only what is new: all of it is overwritten.
    buffer.resize(expected, 0);
    let bits = numbers_of(words, is_big_endian, &mut buffer);
    let step = step_of(bits.into(), u16::MAX.into());
    let frame = Frame::from_checked(width, height, buffer);
    Ok(with_step(frame, step, u16::MAX.into()))
}

/// Writes the values of `words` into `pixels`. Returns the union of the bits of all values below
/// full scale.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn numbers_of(words: &[[u8; 2]], is_big_endian: bool, pixels: &mut [u16]) -> u16 {
    let mut bits = 0;
    for (pixel, &word) in pixels.iter_mut().zip(words) {
        let value = if is_big_endian {
            u16::from_be_bytes(word)
        } else {
            u16::from_le_bytes(word)
        };
        bits |= if value == u16::MAX { 0 } else { value };
        *pixel = value;
    }
    bits
}

fn with_step(frame: Frame, step: i64, full_scale: i64) -> Frame {
    // Twelve bits in the upper part of sixteen saturate at 65520 instead of 65535.
    let saturation = full_scale / step * step;
    frame.with_levels(step as f32, Some(saturation as f32))
}

/// Makes a frame from `height * width * channels` float samples, which have no step and no full
/// scale.
pub(super) fn frame_from_floats(
    (width, height): (usize, usize),
    channels: usize,
    values: Vec<f32>,
) -> Result<Frame, FrameError> {
    let pixels = match channels {
        1 => values,
        2 => values.chunks_exact(2).map(|c| c[0]).collect(),
        channels => values
            .chunks_exact(channels)
            .map(|c| luminance([c[0], c[1], c[2]], f32::INFINITY))
            .collect(),
    };
    Frame::new(width, height, pixels)
}

/// Interleaves samples that are stored plane by plane.
pub(super) fn interleaved<T: Copy>(planes: &[T], channels: usize) -> Vec<T> {
    let mut values = planes.to_vec();
    for (channel, plane) in planes.chunks_exact(planes.len() / channels).enumerate() {
        let places = values.iter_mut().skip(channel).step_by(channels);
        places.zip(plane).for_each(|(value, level)| *value = *level);
    }
    values
}

/// The luminance of one pixel; `full` if a channel is saturated.
fn luminance(rgb: [f32; 3], full: f32) -> f32 {
    if rgb.iter().any(|&channel| channel >= full) {
        return full;
    }
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
        return rgb[0];
    }
    rgb.iter().zip(LUMINANCE_WEIGHTS).map(|(c, w)| c * w).sum()
}

/// The largest power of two that divides all levels below full scale: 16 if twelve bits are stored
/// in the upper part of sixteen.
fn level_step<S>(samples: &[S], level: impl Fn(&S) -> i64, full_scale: i64) -> i64 {
    /// Values between two checks for an early exit; a check at each would prevent vectorization.
    const CHUNK: usize = 1024;
    let mut bits = MAX_STEP;
    for chunk in samples.chunks(CHUNK) {
        bits |= chunk.iter().map(&level).fold(0, |bits, value| {
            bits | if value == full_scale { 0 } else { value }
        });
        if bits & 1 == 1 {
            return 1;
        }
    }
    step_of(bits, full_scale)
}

/// The step between levels in which only `bits` occur.
fn step_of(bits: i64, full_scale: i64) -> i64 {
    let step = 1 << (bits | MAX_STEP).trailing_zeros();
    // Only zeros and full scale: the step cannot be determined.
    if step >= MAX_STEP.min(full_scale) {
        1
    } else {
        step
    }
}
