//! From decoded samples to a frame: luminance, saturation and the step between grey levels.

use super::error::FrameError;
use super::image::{Frame, check_length, check_size};
use super::pixels::Pixels;
use super::read_budget::ReadBudget;
use crate::base::size::Size;
use multiversion::multiversion;
use std::ops::BitOr;

/// Weights of red, green and blue in luminance: ITU-R BT.601, as in JPEG.
pub const LUMINANCE_WEIGHTS: [f32; 3] = [0.299, 0.587, 0.114];

/// Largest step between grey levels that is recognized in files that store few bits in wide words:
/// 2¹².
const MAX_STEP: i64 = 1 << 12;

/// A sample that is a whole number.
pub trait WholeNumber: Copy + Default + PartialEq + BitOr<Output = Self> + Into<i64> {}

impl<T: Copy + Default + PartialEq + BitOr<Output = Self> + Into<i64>> WholeNumber for T {}

/// Decoded samples of one frame.
pub(super) struct LevelSamples<'a, T> {
    pub width: usize,
    pub height: usize,
    /// Interleaved, `height * width * channels`.
    pub values: &'a [T],
    /// 1: grey; 2: grey and alpha; 3: color; 4: color and alpha.
    pub channels: usize,
}

impl<'p> Frame<'p> {
    /// Makes a frame from samples, row-major, `height * width`, as from a grey image file of them:
    /// whole numbers have steps and a full scale, floats have neither. Borrowed samples are not
    /// copied, unless infinities among them become NaN.
    ///
    /// # Errors
    /// As [`Frame::new`].
    pub fn from_samples(
        width: usize,
        height: usize,
        samples: impl Into<Pixels<'p>>,
    ) -> Result<Self, FrameError> {
        let samples = samples.into();
        check_length(width, height, samples.len())?;
        let (step, full_scale) = match samples {
            Pixels::F32(values) => return Self::from_floats(width, height, values),
            Pixels::U8(ref levels) => (level_step(levels, u8::MAX), u8::MAX.into()),
            Pixels::U16(ref levels) => (level_step(levels, u16::MAX), u16::MAX.into()),
        };
        Ok(Self::from_checked(width, height, samples).with_step(step, full_scale))
    }

    /// Makes a frame from whole numbers of any type, row-major, `height * width`; `full_scale` is
    /// the largest number of the format, where pixels are saturated.
    ///
    /// # Errors
    /// As [`Frame::new`].
    pub fn from_integers<T: WholeNumber>(
        width: usize,
        height: usize,
        values: &[T],
        full_scale: T,
    ) -> Result<Self, FrameError> {
        let samples = LevelSamples {
            width,
            height,
            values,
            channels: 1,
        };
        frame_from_integers(&samples, full_scale, &ReadBudget::default())
    }

    /// The luminance of a picture of 3 colors, whose samples are whole numbers, as of a file: pixel
    /// by pixel, and more `channels` than 3 are left out.
    ///
    /// # Errors
    /// As [`Frame::from_integers`].
    pub fn from_colors<T: WholeNumber>(
        size: Size,
        channels: usize,
        values: &[T],
        full_scale: T,
    ) -> Result<Self, FrameError> {
        let samples = LevelSamples {
            width: size.width,
            height: size.height,
            values,
            channels,
        };
        frame_from_integers(&samples, full_scale, &ReadBudget::default())
    }

    /// The same of samples that are floats, which have no step and no full scale.
    ///
    /// # Errors
    /// As [`Frame::new`].
    pub fn from_float_colors(
        size: Size,
        channels: usize,
        values: Vec<f32>,
    ) -> Result<Self, FrameError> {
        frame_from_floats(size, channels, values, &ReadBudget::default())
    }
}

/// Makes a frame from integer samples; `full_scale` is the largest value of the format, in ADU.
pub(super) fn frame_from_integers<T: WholeNumber>(
    samples: &LevelSamples<'_, T>,
    full_scale: T,
    budget: &ReadBudget,
) -> Result<Frame<'static>, FrameError> {
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
            let colors = values.chunks_exact(channels);
            let pixels: Vec<f32> = match (budget.color_channel(), channels) {
                (None, 3) => luminances::<T, 3>(values, full),
                (None, 4) => luminances::<T, 4>(values, full),
                (None, _) => colors
                    .map(|c| luminance([c[0], c[1], c[2]].map(level), full))
                    .collect(),
                (Some(channel), _) => colors.map(|c| level(c[channel])).collect(),
            };
            pixels.into()
        }
    };
    let step = if samples.channels <= 2 {
        level_step(values, full_scale)
    } else {
        1
    };
    let frame = Frame::from_checked(width, height, pixels);
    Ok(frame.with_step(step, full_scale.into()))
}

/// The luminance of pixels of so many `CHANNELS`, of which the first three are colors.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn luminances<T: WholeNumber, const CHANNELS: usize>(values: &[T], full: f32) -> Vec<f32> {
    let colors = values.as_chunks::<CHANNELS>().0.iter();
    let level = |v: T| -> f32 { v.into() as f32 };
    colors
        .map(|c| luminance([c[0], c[1], c[2]].map(level), full))
        .collect()
}

/// Grey levels in the smallest samples that hold all of the format.
fn grey<T: Into<i64>>(levels: impl Iterator<Item = T>, full_scale: T) -> Pixels<'static> {
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
    size: Size,
    words: &[[u8; 2]],
    is_big_endian: bool,
    mut buffer: Vec<u16>,
) -> Result<Frame<'static>, FrameError> {
    check_size(size.width, size.height)?;
    let expected = size.pixels();
    let words = words.get(..expected).ok_or(FrameError::WrongLength {
        expected,
        found: words.len(),
    })?;
    // Clears only what is new: all of it is overwritten.
    buffer.resize(expected, 0);
    let bits = numbers_of(words, is_big_endian, &mut buffer);
    let step = step_of(bits.into(), u16::MAX.into());
    let frame = Frame::from_checked(size.width, size.height, buffer);
    Ok(frame.with_step(step, u16::MAX.into()))
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

/// Makes a frame from `height * width * channels` float samples, which have no step and no full
/// scale.
pub(super) fn frame_from_floats(
    size: Size,
    channels: usize,
    values: Vec<f32>,
    budget: &ReadBudget,
) -> Result<Frame<'static>, FrameError> {
    let samples = values.chunks_exact(channels);
    let pixels = match channels {
        1 => values,
        2 => samples.map(|c| c[0]).collect(),
        _ => match budget.color_channel() {
            None => samples
                .map(|c| luminance([c[0], c[1], c[2]], f32::INFINITY))
                .collect(),
            Some(channel) => samples.map(|c| c[channel]).collect(),
        },
    };
    Frame::new(size.width, size.height, pixels)
}

/// The luminance of one pixel; `full` if a channel is saturated.
#[inline(always)]
pub(crate) fn luminance([red, green, blue]: [f32; 3], full: f32) -> f32 {
    // Without branches, so that several pixels go through a register at once.
    let is_full = (red >= full) | (green >= full) | (blue >= full);
    let is_grey = (red == green) & (green == blue);
    let [of_red, of_green, of_blue] = LUMINANCE_WEIGHTS;
    let weighted = red * of_red + green * of_green + blue * of_blue;
    let unsaturated = if is_grey { red } else { weighted };
    if is_full { full } else { unsaturated }
}

/// The largest power of two that divides all levels below full scale: 16 if twelve bits are stored
/// in the upper part of sixteen.
pub(super) fn level_step<T: WholeNumber>(samples: &[T], full_scale: T) -> i64 {
    /// Values between two checks for an early exit; a check at each would prevent vectorization.
    const CHUNK: usize = 4096;
    let below = |level: T| {
        if level == full_scale {
            T::default()
        } else {
            level
        }
    };
    let mut bits = 0;
    for chunk in samples.chunks(CHUNK) {
        // In samples as wide as they are, the most of them go through a register at once.
        let union = chunk
            .iter()
            .fold(T::default(), |bits, &level| bits | below(level));
        bits |= union.into();
        if bits & 1 == 1 {
            return 1;
        }
    }
    step_of(bits, full_scale.into())
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::borrow::Cow;

    #[test]
    fn borrowed_samples_are_as_those_of_a_file_and_are_not_copied() {
        let words: Vec<u16> = (0..12).map(|i| 16 * i).collect();
        let frame = Frame::from_samples(4, 3, &words[..]).unwrap();
        assert_eq!(
            (frame.step_adu, frame.saturation_adu),
            (16.0, Some(65_520.0))
        );
        assert!(matches!(frame.pixels, Pixels::U16(Cow::Borrowed(_))));
        let wide: Vec<i32> = words.iter().map(|&level| level.into()).collect();
        let frame = Frame::from_integers(4, 3, &wide, i32::MAX).unwrap();
        assert_eq!((frame.step_adu, frame.at(1, 2)), (16.0, 144.0));
    }

    #[test]
    fn borrowed_floats_are_copied_only_where_infinities_become_nan() {
        let mut floats = [1.5; 12];
        let frame = Frame::from_samples(4, 3, &floats[..]).unwrap();
        assert!(matches!(frame.pixels, Pixels::F32(Cow::Borrowed(_))));
        floats[5] = f32::INFINITY;
        let frame = Frame::from_samples(4, 3, &floats[..]).unwrap();
        assert!(frame.at(1, 1).is_nan() && frame.at(2, 1) == 1.5);
        let nothing = [f32::NAN; 12];
        let refused = Frame::from_samples(4, 3, &nothing[..]);
        assert!(matches!(refused, Err(FrameError::NoValues)));
    }
}
