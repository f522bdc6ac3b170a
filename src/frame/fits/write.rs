//! Writes a frame as a FITS file with only a primary header-data unit.

use super::cards::FitsHeader;
use super::header::BLOCK_BYTES;
use crate::frame::{Frame, RowOrder};
use std::io::{self, Write};

/// Keywords that the writer sets itself.
const RESERVED: [&str; 12] = [
    "SIMPLE", "BITPIX", "NAXIS", "NAXIS1", "NAXIS2", "EXTEND", "BSCALE", "BZERO", "BLANK", "END",
    "XTENSION", "ROWORDER",
];

/// How pixels are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FitsSamples {
    /// Floats of 32 bits (BITPIX −32), unchanged; NaN marks a pixel without a value.
    Float32,
    /// Unsigned integers of 16 bits (BITPIX 16, BZERO 32768): whole levels from 0 to 65535.
    Unsigned16,
}

/// Error of writing an image.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitsWriteError {
    /// The writer failed.
    #[error("cannot be written: {0}")]
    Io(#[from] io::Error),
    /// A pixel does not fit into 16 bits.
    #[error("pixel ({x}, {y}): found {found}, expected a whole level from 0 to 65535")]
    NoLevel {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// Its value.
        found: f32,
    },
    /// A keyword that is invalid or reserved for the writer.
    #[error("keyword {keyword:?}: found {found}, expected {expected}")]
    Keyword {
        /// The keyword.
        keyword: String,
        /// What is wrong with it.
        found: &'static str,
        /// What is allowed.
        expected: &'static str,
    },
}

/// Writes the pixels of `frame` as a FITS image, with the cards of `header` after the mandatory
/// ones.
///
/// The top row of the frame is the first in the file, and ROWORDER says so.
/// Everything is checked before the first byte is written. The frame's metadata are not written;
/// put them into `header`.
///
/// ```
/// use starpipe::frame::{self, FitsHeader, FitsSamples, Frame};
///
/// let pixels = vec![100.0, 101.0, 99.0, 100.0, 300.0, 98.0, 100.0, 102.0, 101.0];
/// let frame = Frame::new(3, 3, pixels)?;
/// let mut header = FitsHeader::default();
/// header.real("EXPTIME", 0.1, "[s] exposure");
/// let mut file = Vec::new();
/// frame::write_fits(&mut file, &frame, FitsSamples::Unsigned16, &header)?;
/// let back = frame::decode(&file)?;
/// assert_eq!(back.pixels, frame.pixels);
/// assert_eq!(back.metadata.exposure_s, Some(0.1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
/// # Errors
/// [`FitsWriteError::NoLevel`] with 16 bits, if a pixel has no value, a fraction, or is out of
/// range; [`FitsWriteError::Keyword`]; [`FitsWriteError::Io`].
/// # Reference
/// FITS Standard 4.0 (2018), sect. 4.4 and 5.
pub fn write_fits(
    writer: impl Write,
    frame: &Frame,
    samples: FitsSamples,
    header: &FitsHeader,
) -> Result<(), FitsWriteError> {
    write_rows(writer, frame, samples, header, RowOrder::TopDown)
}

/// [`write_fits`] for a frame whose rows have this order.
pub(crate) fn write_rows(
    mut writer: impl Write,
    frame: &Frame,
    samples: FitsSamples,
    header: &FitsHeader,
    row_order: RowOrder,
) -> Result<(), FitsWriteError> {
    check_keywords(header)?;
    if samples == FitsSamples::Unsigned16 {
        check_levels(frame)?;
    }
    let mut cards = mandatory(frame, samples, row_order);
    cards.extend(header);
    writer.write_all(&cards.to_bytes())?;
    let mut length = 0;
    let mut bytes = Vec::with_capacity(frame.width * 4);
    for row in frame.values().chunks(frame.width) {
        bytes.clear();
        for &pixel in row {
            match samples {
                FitsSamples::Float32 => bytes.extend(pixel.to_be_bytes()),
                // Subtracts BZERO: unsigned and signed integers differ by their highest bit.
                FitsSamples::Unsigned16 => bytes.extend((pixel as u16 ^ 1 << 15).to_be_bytes()),
            }
        }
        writer.write_all(&bytes)?;
        length += bytes.len();
    }
    let padding = length.next_multiple_of(BLOCK_BYTES) - length;
    writer.write_all(&[0; BLOCK_BYTES][..padding])?;
    Ok(writer.flush()?)
}

/// The cards that describe the image.
fn mandatory(frame: &Frame, samples: FitsSamples, row_order: RowOrder) -> FitsHeader {
    let mut header = FitsHeader::default();
    header.logical("SIMPLE", true, "FITS Standard 4.0");
    let bits = match samples {
        FitsSamples::Float32 => -32,
        FitsSamples::Unsigned16 => 16,
    };
    header.integer("BITPIX", bits, "bits of a pixel; below 0: float");
    header.integer("NAXIS", 2, "");
    header.integer("NAXIS1", frame.width as i64, "columns");
    header.integer("NAXIS2", frame.height as i64, "rows");
    let first = match row_order {
        RowOrder::TopDown => "the first row is the top",
        RowOrder::BottomUp => "the first row is the bottom",
    };
    header.text("ROWORDER", row_order.keyword_value(), first);
    if samples == FitsSamples::Unsigned16 {
        header.integer("BZERO", 1 << 15, "levels are unsigned");
        header.integer("BSCALE", 1, "");
    }
    header
}

fn check_levels(frame: &Frame) -> Result<(), FitsWriteError> {
    const MAX: f32 = u16::MAX as f32;
    let fits = |&pixel: &f32| (0.0..=MAX).contains(&pixel) && pixel.fract() == 0.0;
    match frame.values().iter().position(|pixel| !fits(pixel)) {
        None => Ok(()),
        Some(at) => Err(FitsWriteError::NoLevel {
            x: at % frame.width,
            y: at / frame.width,
            found: frame.pixels.value(at),
        }),
    }
}

fn check_keywords(header: &FitsHeader) -> Result<(), FitsWriteError> {
    const ALLOWED: &str = "1 to 8 capital letters, digits, hyphens and underscores";
    let allowed = |c: char| matches!(c, 'A'..='Z' | '0'..='9' | '-' | '_');
    for keyword in header.keywords() {
        let (found, expected) = if keyword.is_empty() || !keyword.chars().all(allowed) {
            ("another character, or none", ALLOWED)
        } else if keyword.len() > 8 {
            ("a longer one", ALLOWED)
        } else if RESERVED.contains(&keyword) {
            ("one that the image's form decides", "another")
        } else {
            continue;
        };
        let keyword = keyword.to_owned();
        return Err(FitsWriteError::Keyword {
            keyword,
            found,
            expected,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn written(
        frame: &Frame,
        samples: FitsSamples,
        header: &FitsHeader,
    ) -> Result<Vec<u8>, FitsWriteError> {
        let mut bytes = Vec::new();
        write_fits(&mut bytes, frame, samples, header).map(|()| bytes)
    }

    fn frame_of(pixels: Vec<f32>) -> Frame<'static> {
        Frame::new(pixels.len() / 3, 3, pixels).unwrap()
    }

    #[test]
    fn invalid_and_reserved_keywords_are_refused() {
        let frame = frame_of(vec![1.0; 9]);
        for keyword in [
            "",
            "gain",
            "TOO LONG",
            "TOOLONGER",
            "ÄRGER",
            "NAXIS1",
            "BZERO",
            "ROWORDER",
        ] {
            let mut header = FitsHeader::default();
            header.integer(keyword, 1, "");
            let refused = written(&frame, FitsSamples::Float32, &header);
            assert!(
                matches!(refused, Err(FitsWriteError::Keyword { .. })),
                "{keyword}"
            );
        }
    }

    #[test]
    fn a_level_outside_16_bits_is_reported() {
        for value in [-1.0, 65536.0, 0.5, f32::NAN] {
            let mut pixels = vec![0.0; 12];
            pixels[7] = value;
            let frame = frame_of(pixels);
            let refused = written(&frame, FitsSamples::Unsigned16, &FitsHeader::default());
            let message = refused.unwrap_err().to_string();
            let expected =
                format!("pixel (3, 1): found {value}, expected a whole level from 0 to 65535");
            assert_eq!(message, expected);
        }
    }

    #[test]
    fn keywords_come_back() {
        let frame = frame_of(vec![1.5; 9]);
        let mut header = FitsHeader::default();
        header.real("EXPTIME", 0.25, "[s]");
        header.text("INSTRUME", &"a long name's ".repeat(20), "");
        header.history("made by hand");
        let bytes = written(&frame, FitsSamples::Float32, &header).unwrap();
        assert_eq!(bytes.len(), 2 * BLOCK_BYTES);
        let back = crate::frame::decode(&bytes).unwrap();
        assert_eq!(back.metadata.exposure_s, Some(0.25));
        assert_eq!((back.step_adu, back.saturation_adu), (0.0, None));
    }

    #[test]
    fn rows_as_stored_are_drawn_as_the_file_says() {
        let frame = frame_of((0..9_u8).map(f32::from).collect());
        let mut bytes = Vec::new();
        let header = FitsHeader::default();
        let order = RowOrder::BottomUp;
        write_rows(&mut bytes, &frame, FitsSamples::Unsigned16, &header, order).unwrap();
        let drawn = crate::frame::decode(&bytes).unwrap();
        assert_eq!(drawn.at(0, 0), 6.0);
        assert_eq!(drawn.as_stored().pixels, frame.pixels);
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back(
            width in 3..200_usize,
            height in 3..20_usize,
            seed in any::<u32>(),
        ) {
            let words: Vec<u32> = (0..width * height)
                .map(|i| (i as u32).wrapping_mul(2_654_435_761) ^ seed)
                .collect();
            let whole = words.iter().map(|w| (w >> 16) as f32).collect();
            let whole = Frame::new(width, height, whole).unwrap();
            let bytes = written(&whole, FitsSamples::Unsigned16, &FitsHeader::default()).unwrap();
            prop_assert_eq!(bytes.len() % BLOCK_BYTES, 0);
            prop_assert_eq!(crate::frame::decode(&bytes).unwrap().pixels, whole.pixels);
            let bits = |frame: &Frame| frame.values().iter().map(|p| p.to_bits()).collect::<Vec<_>>();
            let any = words.iter().map(|w| f32::from_bits(*w)).collect();
            // Infinities become NaN, and all NaN count as equal.
            let mut any: Vec<f32> = any;
            any[0] = 1.0;
            any.iter_mut().filter(|p| !p.is_finite()).for_each(|p| *p = f32::NAN);
            let any = Frame::new(width, height, any).unwrap();
            let bytes = written(&any, FitsSamples::Float32, &FitsHeader::default()).unwrap();
            prop_assert_eq!(bits(&crate::frame::decode(&bytes).unwrap()), bits(&any));
        }
    }
}
