//! HCOMPRESS_1: the H-transform of an image, its bit planes in quadtrees.
//!
//! The decoder is the crate `hcompress`.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sect. 10.4.4. R. L. White, M. Postman and M. G. Lattanzi 1992, in
//! Digitised Optical Sky Surveys, 167.

use super::error::TileError;
use crate::base::size::Size;
use ::hcompress::read::{DecodeError, HCDecoder};

/// Parameters of a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hcompress {
    /// Whether the image is smoothed, which hides the edges of blocks after a lossy compression
    /// (SMOOTH).
    pub smooth: bool,
    /// Whether coefficients need 64 bits: pixels have more than 16.
    pub is_wide: bool,
}

impl Hcompress {
    /// Decodes an image of two axes, `width * height` pixels, row by row.
    pub fn decode(self, data: &[u8], size: Size) -> Result<Vec<i32>, TileError> {
        let count = size.pixels();
        let (found, pixels) = if self.is_wide {
            let mut words = vec![0_i64; count];
            let found = HCDecoder::new().read64(data, self.smooth.into(), &mut words);
            // The pixels fill the first half, two in a word.
            let pixels = words.iter().flat_map(|word| halves(*word)).take(count);
            (found, pixels.collect())
        } else {
            let mut pixels = vec![0_i32; count];
            let found = HCDecoder::new().read(data, self.smooth.into(), &mut pixels);
            (found, pixels)
        };
        // The crate's first axis is the slow one.
        let (slow, fast, _) = found.map_err(|error| match error {
            DecodeError::IncorrectAllocationSize => TileError::Long { pixels: count },
            other => TileError::Corrupt(format!("its HCOMPRESS data are damaged ({other:?})")),
        })?;
        if Size::new(fast, slow) != size {
            return Err(TileError::OtherSize {
                width: fast,
                height: slow,
                expected: format!("{} x {}", size.width, size.height),
            });
        }
        Ok(pixels)
    }
}

/// The two numbers of 32 bits in the memory of one of 64.
fn halves(word: i64) -> [i32; 2] {
    let bytes = word.to_ne_bytes();
    let half = |at: usize| i32::from_ne_bytes([0, 1, 2, 3].map(|i| bytes[at + i]));
    [half(0), half(4)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::hcompress::write::HCEncoder;
    use proptest::prelude::*;

    const EXACT: Hcompress = Hcompress {
        smooth: false,
        is_wide: false,
    };
    const WIDE: Hcompress = Hcompress {
        is_wide: true,
        ..EXACT
    };

    fn stream(pixels: &[i32], width: usize, height: usize) -> Vec<u8> {
        let mut data = Vec::new();
        let mut encoder = HCEncoder::new(&mut data);
        encoder
            .write(&mut pixels.to_vec(), width, height, 0)
            .unwrap();
        data
    }

    #[test]
    fn both_widths_decode_the_same_image() {
        let pixels: Vec<i32> = (0..35).map(|i| i * i % 41 - 7).collect();
        let data = stream(&pixels, 7, 5);
        assert_eq!(EXACT.decode(&data, Size::new(7, 5)).unwrap(), pixels);
        assert_eq!(WIDE.decode(&data, Size::new(7, 5)).unwrap(), pixels);
    }

    #[test]
    fn another_size_is_an_error() {
        let data = stream(&[3; 35], 7, 5);
        assert!(EXACT.decode(&data, Size::new(5, 7)).is_err());
        assert!(EXACT.decode(&data, Size::new(3, 3)).is_err());
        assert!(WIDE.decode(&data, Size::new(9, 9)).is_err());
    }

    proptest! {
        #[test]
        fn arbitrary_streams_never_panic(
            mut data in proptest::collection::vec(any::<u8>(), 0..300),
            (width, height) in (1_u8..20, 1_u8..20),
            (smooth, is_wide, framed) in any::<(bool, bool, bool)>(),
        ) {
            if framed && data.len() > 16 {
                data[..10].copy_from_slice(&[0xdd, 0x99, 0, 0, 0, height, 0, 0, 0, width]);
            }
            let decoder = Hcompress { smooth, is_wide };
            let size = Size::new(width.into(), height.into());
            if let Ok(pixels) = decoder.decode(&data, size) {
                prop_assert_eq!(pixels.len(), size.pixels());
            }
        }
    }
}
