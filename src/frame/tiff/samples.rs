//! From the rows of strips and tiles to the samples of an image.

use super::decompress::{ChunkSource, StripRows};
use super::layout::{Chunk, Color, Layout, Predictor, SampleFormat};
use crate::frame::error::FrameError;
use crate::frame::read_budget::PIXELS_BETWEEN_CHECKS;
use std::ops::BitXor;

/// An unsigned word that samples are unpacked to; signed numbers and floats keep their bits.
pub(super) trait Word: Copy + Default + BitXor<Output = Self> {
    /// The lowest bits of `bits`.
    fn of(bits: u64) -> Self;
    /// The sum without its overflow.
    fn plus(self, other: Self) -> Self;
}

macro_rules! word {
    ($($word:ty),*) => {$(
        impl Word for $word {
            fn of(bits: u64) -> Self {
                bits as $word
            }

            fn plus(self, other: Self) -> Self {
                self.wrapping_add(other)
            }
        }
    )*};
}

word!(u8, u16, u32, u64);

impl Layout<'_> {
    /// The samples of all channels that are read, interleaved.
    /// # Errors
    /// As [`Self::decompress`].
    pub fn samples<T: Word>(&self, source: ChunkSource) -> Result<Vec<T>, FrameError> {
        let count = self.width * self.height * self.channels;
        let mut samples = Vec::with_capacity(count);
        let mut row = Vec::new();
        for chunk in self.chunks() {
            let rows = self.decompress(source, &chunk)?;
            self.unpack_chunk(&chunk, &rows, source, &mut row, &mut samples)?;
        }
        samples.resize(count, T::default());
        if self.color == Color::WhiteIsZero && self.depth.format == SampleFormat::Unsigned {
            let full = T::of(self.depth.full_scale());
            samples
                .iter_mut()
                .for_each(|sample| *sample = *sample ^ full);
        }
        Ok(samples)
    }

    /// Writes the samples of a chunk to their places in the image; `row` is scratch.
    fn unpack_chunk<T: Word>(
        &self,
        chunk: &Chunk,
        rows: &StripRows,
        source: ChunkSource,
        row: &mut Vec<T>,
        samples: &mut Vec<T>,
    ) -> Result<(), FrameError> {
        // Its bytes are there: a pixel of a damaged file may have any number of samples before that.
        row.resize(chunk.columns * self.chunk_samples, T::default());
        let planes = if self.chunk_samples == 1 {
            1
        } else {
            self.channels
        };
        let row_samples = self.width * self.channels;
        let lines = rows.bytes.chunks_exact(rows.row_bytes).take(chunk.rows);
        let rows_between_checks = PIXELS_BETWEEN_CHECKS.div_ceil(row.len());
        for (line, y) in lines.zip(chunk.top..) {
            if y.is_multiple_of(rows_between_checks) {
                source.budget.check_time()?;
            }
            let start = y * row_samples + chunk.left * self.channels + chunk.plane;
            let end = (y + 1) * row_samples;
            // Cleared row by row: while they are in the processor's cache.
            samples.resize(samples.len().max(end), T::default());
            let out = &mut samples[start..end];
            let is_little_endian = source.file.is_little_endian;
            if self.channels == self.chunk_samples {
                self.unpack_row(line, is_little_endian, &mut out[..row.len()]);
                continue;
            }
            self.unpack_row(line, is_little_endian, row);
            let pixels = row.chunks_exact(self.chunk_samples);
            for (place, pixel) in out.chunks_mut(self.channels).zip(pixels) {
                place[..planes].copy_from_slice(&pixel[..planes]);
            }
        }
        Ok(())
    }

    /// Unpacks the first samples of a row of a chunk.
    fn unpack_row<T: Word>(&self, line: &[u8], is_little_endian: bool, row: &mut [T]) {
        match self.predictor {
            Predictor::None => unpack(line, self.depth.bits, is_little_endian, row),
            Predictor::Differences => {
                unpack(line, self.depth.bits, is_little_endian, row);
                for i in self.chunk_samples..row.len() {
                    row[i] = row[i].plus(row[i - self.chunk_samples]);
                }
            }
            Predictor::Floats => {
                let bytes = (self.depth.bits / 8) as usize;
                let line = joined_floats(line, bytes, self.chunk_samples);
                unpack(&line, self.depth.bits, false, row);
            }
        }
    }
}

/// Unpacks numbers of 1 to 32 or 64 bits. Whole bytes are in the order of the file; other numbers
/// follow each other with their highest bit first.
fn unpack<T: Word>(line: &[u8], bits: u32, is_little_endian: bool, row: &mut [T]) {
    match bits {
        8 => unpack_bytes::<T, 1>(line, is_little_endian, row),
        16 => unpack_bytes::<T, 2>(line, is_little_endian, row),
        24 => unpack_bytes::<T, 3>(line, is_little_endian, row),
        32 => unpack_bytes::<T, 4>(line, is_little_endian, row),
        64 => unpack_bytes::<T, 8>(line, is_little_endian, row),
        _ => unpack_bits(line, bits, row),
    }
}

fn unpack_bytes<T: Word, const N: usize>(line: &[u8], is_little_endian: bool, row: &mut [T]) {
    let words = line.as_chunks::<N>().0;
    let append = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
    for (sample, word) in row.iter_mut().zip(words) {
        *sample = T::of(if is_little_endian {
            word.iter().rev().fold(0, append)
        } else {
            word.iter().fold(0, append)
        });
    }
}

/// Unpacks numbers of at most 32 bits.
fn unpack_bits<T: Word>(line: &[u8], bits: u32, row: &mut [T]) {
    let mask = u64::MAX >> (u64::BITS - bits);
    let mut bytes = line.iter();
    // The last `count` bits of `window` are not used yet.
    let (mut window, mut count) = (0_u64, 0);
    for sample in row {
        while count < bits {
            window = window << 8 | u64::from(bytes.next().copied().unwrap_or(0));
            count += 8;
        }
        count -= bits;
        *sample = T::of(window >> count & mask);
    }
}

/// The floats of a row, big-endian. They are stored as differences of bytes: first the highest byte of
/// each, then the next.
///
/// # Reference
/// Adobe Photoshop TIFF Technical Note 3 (2005).
fn joined_floats(line: &[u8], float_bytes: usize, samples: usize) -> Vec<u8> {
    let mut sums = line.to_vec();
    for i in samples..sums.len() {
        sums[i] = sums[i].wrapping_add(sums[i - samples]);
    }
    let count = sums.len() / float_bytes;
    let byte = |i: usize| sums[i % float_bytes * count + i / float_bytes];
    (0..count * float_bytes).map(byte).collect()
}

/// The number that 16 bits stand for as a float (IEEE 754, binary16).
pub(super) fn float_of_half(bits: u16) -> f32 {
    const FRACTION: f32 = 1024.0;
    const BIAS: i32 = 15;
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let fraction = f32::from(bits & 0x3ff) / FRACTION;
    let magnitude = match i32::from(bits >> 10 & 0x1f) {
        0 => fraction * 2_f32.powi(1 - BIAS),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        exponent => (1.0 + fraction) * 2_f32.powi(exponent - BIAS),
    };
    sign * magnitude
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn floats_of_16_bits_are_as_the_standard_has_them() {
        let known = [
            (0x0000, 0.0),
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65504.0),
            (0x0400, 6.103_515_6e-5),
            (0x0001, 5.960_464_5e-8),
            (0x3555, 0.333_251_95),
            (0x7c00, f32::INFINITY),
        ];
        for (bits, value) in known {
            assert_eq!(float_of_half(bits), value, "{bits:04x}");
        }
        assert!(float_of_half(0x7e00).is_nan());
    }

    proptest! {
        #[test]
        fn numbers_of_any_bits_are_unpacked_as_they_were_packed(
            bits in 1_u32..=32,
            numbers in proptest::collection::vec(any::<u32>(), 1..40),
        ) {
            let numbers: Vec<u32> = numbers.iter().map(|n| n >> (32 - bits)).collect();
            let digits: String = numbers.iter().map(|n| format!("{n:032b}")[32 - bits as usize..].to_owned()).collect();
            let bytes: Vec<u8> = digits.as_bytes().chunks(8).map(|byte| {
                let digits = format!("{:0<8}", String::from_utf8_lossy(byte));
                u8::from_str_radix(&digits, 2).unwrap()
            }).collect();
            let mut row = vec![0_u32; numbers.len()];
            unpack(&bytes, bits, false, &mut row);
            prop_assert_eq!(row, numbers);
        }
    }
}
