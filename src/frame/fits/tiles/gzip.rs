//! GZIP_1 and GZIP_2: the bytes of the pixels, compressed with gzip.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sect. 10.4.2.

use super::error::TileError;
use crate::frame::read_budget::ReadBudget;
use flate2::bufread::MultiGzDecoder;
use std::io::Read;

/// Decompresses the bytes of `count` pixels of at most `max_width` bytes each. The stream is not
/// read further than that.
pub(super) fn inflate(
    data: &[u8],
    count: usize,
    max_width: usize,
    budget: &ReadBudget,
) -> Result<Vec<u8>, TileError> {
    let limit = count * max_width;
    let mut bytes = Vec::with_capacity(limit + 1);
    let reader = MultiGzDecoder::new(budget.timed(data));
    reader
        .take(limit as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| {
            let detail = format!("its data cannot be decompressed with gzip ({error})");
            TileError::Corrupt(detail)
        })?;
    if bytes.len() > limit {
        return Err(TileError::Long { pixels: count });
    }
    if !bytes.len().is_multiple_of(count) {
        return Err(TileError::Short { pixels: count });
    }
    Ok(bytes)
}

/// Puts the bytes of each pixel side by side that are stored as all first bytes, all second bytes
/// and so on.
pub(super) fn unshuffle(bytes: &[u8], count: usize) -> Vec<u8> {
    let Some(width @ 1..) = bytes.len().checked_div(count) else {
        return Vec::new();
    };
    let mut pixels = vec![0; count * width];
    for (place, plane) in bytes.chunks_exact(count).enumerate() {
        let places = pixels.iter_mut().skip(place).step_by(width);
        places.zip(plane).for_each(|(pixel, byte)| *pixel = *byte);
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::read::GzEncoder;

    fn deflate(bytes: &[u8]) -> Vec<u8> {
        let mut data = Vec::new();
        let mut encoder = GzEncoder::new(bytes, Compression::best());
        encoder.read_to_end(&mut data).unwrap();
        data
    }

    #[test]
    fn no_more_than_the_pixels_is_decompressed() {
        let bomb = deflate(&vec![0; 10_000_000]);
        let refused = inflate(&bomb, 100, 4, &ReadBudget::default());
        assert_eq!(refused, Err(TileError::Long { pixels: 100 }));
        assert_eq!(
            inflate(&deflate(&[7; 400]), 100, 4, &ReadBudget::default()).unwrap(),
            [7; 400]
        );
    }

    #[test]
    fn damage_is_an_error() {
        let mut data = deflate(b"some pixels, and more of them");
        assert!(inflate(&data[..20], 100, 4, &ReadBudget::default()).is_err());
        data[14] ^= 0x55;
        assert!(inflate(&data, 100, 4, &ReadBudget::default()).is_err());
    }

    #[test]
    fn shuffled_bytes_return_to_their_pixels() {
        assert_eq!(unshuffle(&[1, 2, 3, 11, 12, 13], 3), [1, 11, 2, 12, 3, 13]);
        assert!(unshuffle(&[1, 2, 3], 0).is_empty());
    }
}
