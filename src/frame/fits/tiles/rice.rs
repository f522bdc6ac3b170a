//! RICE_1: differences of neighboring pixels, in blocks that share the number of their low bits.
//!
//! A stream begins with a value from which the first difference counts. Each block begins with a
//! code for its number of low bits: none of its differences is other than 0, or all differences are
//! stored in full, or each has its high bits as a count of zeros before a one, and then its low
//! bits. A difference d is stored as 2 d, or as −2 d − 1 below 0.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sect. 10.4.1. R. Rice, P.-S. Yeh and W. Miller 1993, AIAA-93-4541.

use super::error::TileError;
use crate::frame::read_budget::{PIXELS_BETWEEN_CHECKS, ReadBudget};

/// Parameters of a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rice {
    /// Pixels that share the number of their low bits, at least 1.
    pub block: usize,
    /// Size of a pixel.
    pub width: RiceWidth,
}

/// Size of a pixel in a stream (BYTEPIX).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RiceWidth {
    One,
    Two,
    Four,
}

impl RiceWidth {
    /// The width of `bytes`, if streams have it.
    pub fn from_byte_count(bytes: i64) -> Option<Self> {
        match bytes {
            1 => Some(Self::One),
            2 => Some(Self::Two),
            4 => Some(Self::Four),
            _ => None,
        }
    }

    /// Bits of a pixel, bits of a block's code, and the code of blocks that are stored in full.
    fn bits(self) -> (u32, u32, u32) {
        match self {
            Self::One => (8, 3, 6),
            Self::Two => (16, 4, 14),
            Self::Four => (32, 5, 25),
        }
    }

    /// The pixel in the low bits of `value`: single bytes have no sign.
    fn pixel(self, value: u32) -> i32 {
        match self {
            Self::One => (value as u8).into(),
            Self::Two => (value as i16).into(),
            Self::Four => value as i32,
        }
    }
}

impl Rice {
    /// Decodes `count` pixels.
    pub fn decode(
        self,
        data: &[u8],
        count: usize,
        budget: &ReadBudget,
    ) -> Result<Vec<i32>, TileError> {
        let mut bits = RiceBits::new(data);
        let short = TileError::Short { pixels: count };
        let (pixel_bits, ..) = self.width.bits();
        let mut value = bits.take(pixel_bits).ok_or(short)?;
        let mut pixels = Vec::with_capacity(count);
        let blocks = PIXELS_BETWEEN_CHECKS.next_multiple_of(self.block);
        while pixels.len() < count {
            budget.check_interrupt()?;
            let end = count.min(pixels.len().saturating_add(blocks));
            let decoded = self.extend(&mut pixels, end, &mut bits, &mut value);
            decoded.ok_or(TileError::Short { pixels: count })?;
        }
        Ok(pixels)
    }

    /// Decodes the pixels up to `count`; the last was `value`. `None` if the stream ends early.
    fn extend(
        self,
        pixels: &mut Vec<i32>,
        count: usize,
        bits: &mut RiceBits,
        last: &mut u32,
    ) -> Option<()> {
        let (pixel_bits, code_bits, full) = self.width.bits();
        let mut value = *last;
        let mut next = |stored: u32| {
            let difference = (stored >> 1) ^ (stored & 1).wrapping_neg();
            value = value.wrapping_add(difference);
            self.width.pixel(value)
        };
        while pixels.len() < count {
            let block = 0..self.block.min(count - pixels.len());
            // 0 for differences of 0, otherwise one more than the number of low bits.
            let code = bits.take(code_bits)?;
            if code == 0 {
                pixels.extend(block.map(|_| next(0)));
            } else if code > full {
                for _ in block {
                    pixels.push(next(bits.take(pixel_bits)?));
                }
            } else {
                for _ in block {
                    pixels.push(next(bits.take_split(code - 1)?));
                }
            }
        }
        *last = value;
        Some(())
    }
}

/// The bits of a stream, the highest of each byte first.
struct RiceBits<'a> {
    rest: &'a [u8],
    /// The next bits, from the highest; zeros after them.
    buffer: u64,
    /// How many bits of the buffer are of the stream.
    buffered: u32,
}

impl<'a> RiceBits<'a> {
    fn new(data: &'a [u8]) -> Self {
        Self {
            rest: data,
            buffer: 0,
            buffered: 0,
        }
    }

    /// Fills the buffer to at least 56 bits, or with all that is left.
    #[inline]
    fn fill(&mut self) {
        if let Some((word, _)) = self.rest.split_first_chunk() {
            self.buffer |= u64::from_be_bytes(*word) >> self.buffered;
            let bytes = (63 - self.buffered) / 8;
            self.rest = &self.rest[bytes as usize..];
            self.buffered += bytes * 8;
            // Bits beyond those that count as held are of a byte that is read again.
            self.buffer &= !(u64::MAX >> self.buffered);
            return;
        }
        while self.buffered <= 56 {
            let Some((byte, rest)) = self.rest.split_first() else {
                return;
            };
            self.buffer |= u64::from(*byte) << (56 - self.buffered);
            self.buffered += 8;
            self.rest = rest;
        }
    }

    #[inline]
    fn drop(&mut self, count: u32) {
        self.buffer <<= count;
        self.buffered -= count;
    }

    /// The next `count` bits, at most 32, as a number.
    #[inline]
    fn take(&mut self, count: u32) -> Option<u32> {
        if self.buffered < count {
            self.fill();
            if self.buffered < count {
                return None;
            }
        }
        // In two steps, because a shift by 64 is none.
        let number = self.buffer >> 1 >> (63 - count);
        self.drop(count);
        Some(number as u32)
    }

    /// A number whose high bits are a count of zeros before a one, and then `low` bits, at most 24.
    #[inline]
    fn take_split(&mut self, low: u32) -> Option<u32> {
        if self.buffered < 32 {
            self.fill();
        }
        let zeros = self.buffer.leading_zeros();
        let used = zeros + 1 + low;
        if used <= self.buffered {
            let after = self.buffer << zeros << 1;
            self.buffer = after << low;
            self.buffered -= used;
            // In two steps, because a shift by 64 is none.
            let low_bits = after >> 1 >> (63 - low);
            return Some(zeros << low | low_bits as u32);
        }
        self.take_long(low)
    }

    /// As [`Self::take_split`], for numbers that are longer than what is held.
    #[cold]
    fn take_long(&mut self, low: u32) -> Option<u32> {
        let mut high = 0_u32;
        while self.buffer == 0 {
            high = high.wrapping_add(self.buffered);
            self.buffered = 0;
            self.fill();
            if self.buffered == 0 {
                return None;
            }
        }
        let zeros = self.buffer.leading_zeros();
        self.drop(zeros);
        self.drop(1);
        high = high.wrapping_add(zeros);
        let low_bits = self.take(low)?;
        Some(high << low | low_bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SHORT: Rice = Rice {
        block: 4,
        width: RiceWidth::Two,
    };

    /// Bytes of a string of zeros and ones, filled up with zeros.
    fn bytes(bits: &str) -> Vec<u8> {
        let bits: Vec<u8> = bits.bytes().filter(|b| *b != b' ').collect();
        let byte = |bits: &[u8]| (0..8).fold(0, |n, i| n << 1 | (bits.get(i) == Some(&b'1')) as u8);
        bits.chunks(8).map(byte).collect()
    }

    #[test]
    fn each_kind_of_block_is_decoded() {
        // From 5: no differences; 0, −1, 1, 3 with one low bit; in full.
        let stream = "0000000000000101 0000 \
            0010 1 0 1 1 01 0 0001 0 \
            1111 0000000000000001 0000000000000010 1111111111111111 0000000000000000";
        let pixels = SHORT
            .decode(&bytes(stream), 12, &ReadBudget::default())
            .unwrap();
        assert_eq!(pixels, [5, 5, 5, 5, 5, 4, 5, 8, 7, 8, -32760, -32760]);
    }

    #[test]
    fn a_stream_that_ends_early_is_short() {
        let stream = bytes("0000000000000101 0010 1 0 1 1");
        assert_eq!(
            SHORT.decode(&stream, 4, &ReadBudget::default()),
            Err(TileError::Short { pixels: 4 })
        );
        assert!(SHORT.decode(&[], 4, &ReadBudget::default()).is_err());
        // Zeros without a one after them.
        assert!(
            SHORT
                .decode(&[0, 0, 0x30, 0, 0, 0, 0, 0, 0], 4, &ReadBudget::default())
                .is_err()
        );
    }

    proptest! {
        #[test]
        fn arbitrary_streams_give_their_pixels_or_an_error(
            data in proptest::collection::vec(any::<u8>(), 0..200),
            bytes in 0_i64..5,
            (block, count) in (1_usize..70, 0_usize..500),
        ) {
            if let Some(width) = RiceWidth::from_byte_count(bytes)
                && let Ok(pixels) = (Rice { block, width }).decode(&data, count, &ReadBudget::default()) {
                prop_assert_eq!(pixels.len(), count);
            }
        }
    }
}
