//! PLIO_1: runs of pixels of equal value, in words of 16 bits. Written for masks.
//!
//! The upper four bits of a word say what to do, the lower twelve are a number n. A high value, 1 at
//! first, is kept:
//!
//! | code | effect |
//! |---|---|
//! | 0 | n pixels of 0 |
//! | 1 | the high value is n and, above these 12 bits, the next word |
//! | 2, 3 | the high value grows, falls by n |
//! | 4 | n pixels of the high value |
//! | 5 | n − 1 pixels of 0 and one of the high value |
//! | 6, 7 | as 2 and 3, and one pixel of the high value |
//!
//! Pixels after the last word are 0.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sect. 10.4.3; D. Tody, IRAF's pixel list format.

use super::error::TileError;
use crate::frame::read_budget::ReadBudget;

/// Instructions between two looks at the time. Each gives 4095 pixels or fewer.
const WORDS_BETWEEN_CHECKS: usize = 256;

/// Decodes `count` pixels.
pub(super) fn decode(
    data: &[u8],
    count: usize,
    budget: &ReadBudget,
) -> Result<Vec<i32>, TileError> {
    let words: Vec<u16> = data
        .as_chunks()
        .0
        .iter()
        .map(|b| u16::from_be_bytes(*b))
        .collect();
    let short = TileError::Short { pixels: count };
    let instructions = instructions(&words).ok_or(short)?;
    let mut pixels = Vec::with_capacity(count);
    let mut high = 1_i32;
    let mut words = instructions.iter();
    while let Some(word) = words.next() {
        if words.len().is_multiple_of(WORDS_BETWEEN_CHECKS) {
            budget.check_interrupt()?;
        }
        let (code, number) = (word >> 12, usize::from(word & 0xfff));
        let step = number as i32;
        let (zeros, highs) = match code {
            0 => (number, 0),
            1 => {
                let upper = words.next().ok_or(TileError::Short { pixels: count })?;
                high = i32::from(*upper) << 12 | step;
                (0, 0)
            }
            2 | 6 => {
                high = high.wrapping_add(step);
                (0, usize::from(code == 6))
            }
            3 | 7 => {
                high = high.wrapping_sub(step);
                (0, usize::from(code == 7))
            }
            4 => (0, number),
            5 => (number.saturating_sub(1), number.min(1)),
            _ => {
                let detail = format!("found the PLIO code {code}, expected 0 to 7");
                return Err(TileError::Corrupt(detail));
            }
        };
        if pixels.len() + zeros + highs > count {
            return Err(TileError::Long { pixels: count });
        }
        pixels.resize(pixels.len() + zeros, 0);
        pixels.resize(pixels.len() + highs, high);
    }
    pixels.resize(count, 0);
    Ok(pixels)
}

/// The words after the header, as many as it says.
fn instructions(words: &[u16]) -> Option<&[u16]> {
    // The third word is the length in the older format, and 0 or less in the newer.
    let (first, length) = match *words {
        [_, _, length @ 1..0x8000, ..] => (3, length.into()),
        [_, first, _, low, high, ..] => (
            usize::from(first),
            usize::from(high) << 15 | usize::from(low),
        ),
        _ => return None,
    };
    words.get(first..length.max(first))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn list(instructions: &[u16]) -> Vec<u8> {
        let header = [0, 7, 0xff9c, 7 + instructions.len() as u16, 0, 0, 0];
        let words = header.iter().chain(instructions);
        words.flat_map(|word| word.to_be_bytes()).collect()
    }

    #[test]
    fn each_code_is_decoded() {
        let data = list(&[
            0x0002, 0x4002, 0x1005, 0x0001, 0x4001, 0x2003, 0x5003, 0x3001, 0x6002, 0x7009,
        ]);
        let expected = [0, 0, 1, 1, 4101, 0, 0, 4104, 4105, 4096, 0, 0];
        assert_eq!(decode(&data, 12, &ReadBudget::default()).unwrap(), expected);
        assert_eq!(
            decode(&data, 9, &ReadBudget::default()),
            Err(TileError::Long { pixels: 9 })
        );
    }

    #[test]
    fn the_older_header_is_read() {
        let words: [u16; 5] = [0, 0, 5, 0x4003, 0x0001];
        let data: Vec<u8> = words.iter().flat_map(|word| word.to_be_bytes()).collect();
        assert_eq!(
            decode(&data, 5, &ReadBudget::default()).unwrap(),
            [1, 1, 1, 0, 0]
        );
    }

    #[test]
    fn damage_is_an_error() {
        assert!(decode(&list(&[0x8001]), 4, &ReadBudget::default()).is_err());
        assert!(decode(&list(&[0x1001]), 4, &ReadBudget::default()).is_err());
        let data = list(&[0x4001, 0x4001]);
        assert!(decode(&data[..data.len() - 2], 4, &ReadBudget::default()).is_err());
        assert!(decode(&[], 4, &ReadBudget::default()).is_err());
    }

    proptest! {
        #[test]
        fn arbitrary_lists_give_their_pixels_or_an_error(
            instructions in proptest::collection::vec(any::<u16>(), 0..60),
            raw in proptest::collection::vec(any::<u8>(), 0..60),
            count in 0_usize..5000,
        ) {
            for data in [list(&instructions), raw] {
                if let Ok(pixels) = decode(&data, count, &ReadBudget::default()) {
                    prop_assert_eq!(pixels.len(), count);
                }
            }
        }
    }
}
