//! PNG, JPEG, BMP and PNM, decoded by the `image` crate to 8 or 16 bits per sample.

use super::account::Account;
use super::error::FrameError;
use super::exif;
use super::format::FrameFormat;
use super::image::{Frame, check_size};
use super::jpeg_rows::check_rows;
use super::jpeg_scans::{Scans, has_end};
use super::levels::{Samples, WholeNumber, frame_from_integers};
use image::codecs::bmp::BmpDecoder;
use image::codecs::jpeg::JpegDecoder;
use image::codecs::png::PngDecoder;
use image::codecs::pnm::PnmDecoder;
use image::error::{ImageError, UnsupportedErrorKind};
use image::{ColorType, DynamicImage, ExtendedColorType, ImageDecoder, Limits};
use std::io::{Cursor, ErrorKind};

/// Decodes a PNG of any colour type and depth. Depths below 8 bits are scaled to 0-255, as PNG
/// defines.
/// # Errors
/// As [`super::reader::decode`].
pub(super) fn decode_png(bytes: &[u8], account: &Account) -> Result<Frame<'static>, FrameError> {
    let format = FrameFormat::Png;
    // Checked first, so that the decoder allocates nothing for absurd sizes.
    if let (Some(width), Some(height)) = (word(bytes, 16), word(bytes, 20)) {
        check_size(
            u32::from_be_bytes(width) as usize,
            u32::from_be_bytes(height) as usize,
        )?;
    }
    let decoder = PngDecoder::with_limits(account.timed(Cursor::new(bytes)), limits())
        .map_err(|e| account.why(error_of(e, format, bytes.len())))?;
    let step = match decoder.original_color_type() {
        ExtendedColorType::L1 => 255.0,
        ExtendedColorType::L2 => 85.0,
        ExtendedColorType::L4 => 17.0,
        _ => 1.0,
    };
    let exif = exif_of_png(bytes);
    let mut frame = decode_with(decoder, exif, format, bytes.len(), account)?;
    frame.step_adu = frame.step_adu.max(step);
    Ok(frame)
}

/// Decodes a baseline or progressive JPEG.
/// # Errors
/// As [`super::reader::decode`].
pub(super) fn decode_jpeg(bytes: &[u8], account: &Account) -> Result<Frame<'static>, FrameError> {
    let format = FrameFormat::Jpeg;
    let mut decoder = JpegDecoder::new(account.timed(Cursor::new(bytes)))
        .map_err(|e| account.why(error_of(e, format, bytes.len())))?;
    // The decoder fills missing data and reports no error.
    if !has_end(bytes) {
        return Err(FrameError::Truncated {
            format,
            found_bytes: bytes.len(),
            detail: "no end-of-image marker (ff d9) after the last scan".to_string(),
        });
    }
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    check_size(width, height)?;
    let scans = Scans::of(bytes);
    scans.check((width, height))?;
    // A progressive image is decoded to coefficients first.
    let coefficients = if scans.count > 1 {
        size_of::<i16>() * usize::from(decoder.color_type().channel_count())
    } else {
        0
    };
    let bytes_per_pixel = decoder_bytes_per_pixel(&decoder) + coefficients;
    account.check_image((width, height), bytes_per_pixel + size_of::<f32>())?;
    check_rows(bytes)?;
    let exif = decoder.exif_metadata().ok().flatten();
    decode_with(decoder, exif.as_deref(), format, bytes.len(), account)
}

/// Decodes a Windows bitmap.
/// # Errors
/// As [`super::reader::decode`].
pub(super) fn decode_bmp(bytes: &[u8], account: &Account) -> Result<Frame<'static>, FrameError> {
    /// Minimum length of a header that stores width and height in four bytes each.
    const LONG_HEADER: u32 = 16;
    let format = FrameFormat::Bmp;
    // The decoder has limits of its own; this reports a large size as in every other format.
    if let (Some(header), Some(width), Some(height)) =
        (word(bytes, 14), word(bytes, 18), word(bytes, 22))
        && u32::from_le_bytes(header) >= LONG_HEADER
    {
        // A negative height means rows from top to bottom.
        let side = |word| i32::from_le_bytes(word).unsigned_abs() as usize;
        check_size(side(width), side(height))?;
    }
    let decoder = BmpDecoder::new(account.timed(Cursor::new(bytes)))
        .map_err(|e| account.why(error_of(e, format, bytes.len())))?;
    decode_with(decoder, None, format, bytes.len(), account)
}

/// Decodes a portable anymap: PBM, PGM, PPM (plain or binary) or PAM, with the levels of the file.
/// # Errors
/// As [`super::reader::decode`].
pub(super) fn decode_pnm(bytes: &[u8], account: &Account) -> Result<Frame<'static>, FrameError> {
    let format = FrameFormat::Pnm;
    let decoder = PnmDecoder::new(account.timed(Cursor::new(bytes)))
        .map_err(|e| account.why(error_of(e, format, bytes.len())))?;
    let maxval = decoder.header().maximal_sample();
    let decoded = Decoded::new(decoder, format, bytes.len(), account)?;
    // The decoder scales levels from 0..=maxval to all of 8 or 16 bits, and rounds: this is undone.
    let level = |scaled: u16, full: u16| {
        let level = f64::from(scaled) * f64::from(maxval) / f64::from(full);
        level.round() as u16
    };
    match (decoded.depth, u16::try_from(maxval)) {
        (Depth::Eight, Ok(maxval @ 0..=0xff)) => {
            let scaled = decoded.image.as_bytes().iter();
            let levels: Vec<u16> = scaled.map(|&v| level(u16::from(v), 0xff)).collect();
            decoded.integers(&levels, maxval)
        }
        (Depth::Sixteen, Ok(maxval)) => {
            let scaled = decoded.words();
            let levels: Vec<u16> = scaled.iter().map(|&v| level(v, u16::MAX)).collect();
            decoded.integers(&levels, maxval)
        }
        _ => Err(unsupported(
            format,
            format!("levels up to {maxval} without a TUPLTYPE"),
        )),
    }
}

/// The Exif attributes of a PNG file: the data of its chunk `eXIf`, which the decoder does not find after
/// those of the image.
fn exif_of_png(bytes: &[u8]) -> Option<&[u8]> {
    const SIGNATURE_BYTES: usize = 8;
    let mut rest = bytes.get(SIGNATURE_BYTES..)?;
    loop {
        let (length, chunk) = rest.split_first_chunk()?;
        let (kind, chunk) = chunk.split_first_chunk()?;
        let length = u32::from_be_bytes(*length) as usize;
        let (data, after) = chunk.split_at_checked(length)?;
        match kind {
            b"eXIf" => return Some(data),
            b"IEND" => return None,
            _ => {}
        }
        let (_crc, next) = after.split_first_chunk::<4>()?;
        rest = next;
    }
}

/// The four bytes at `at`.
fn word(bytes: &[u8], at: usize) -> Option<[u8; 4]> {
    bytes.get(at..)?.first_chunk().copied()
}

/// What the PNG decoder may allocate beside the image: colour profiles and texts.
fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_alloc = Some(1 << 26);
    limits
}

/// Bytes of a decoded pixel.
fn decoder_bytes_per_pixel(decoder: &impl ImageDecoder) -> usize {
    usize::from(decoder.color_type().bytes_per_pixel())
}

/// Checks the size, decodes, converts to luminance and adds the Exif metadata.
fn decode_with(
    decoder: impl ImageDecoder,
    exif: Option<&[u8]>,
    format: FrameFormat,
    found_bytes: usize,
    account: &Account,
) -> Result<Frame<'static>, FrameError> {
    let decoded = Decoded::new(decoder, format, found_bytes, account)?;
    let frame = match decoded.depth {
        Depth::Eight => decoded.integers(decoded.image.as_bytes(), u8::MAX),
        Depth::Sixteen => decoded.integers(decoded.words(), u16::MAX),
    }?;
    let metadata = exif.map(|exif| exif::metadata(exif, frame.width));
    Ok(frame.with_metadata(metadata.unwrap_or_default()).drawn())
}

/// Bits per sample.
#[derive(Clone, Copy)]
enum Depth {
    Eight,
    Sixteen,
}

/// A decoded image.
struct Decoded {
    image: DynamicImage,
    channels: usize,
    depth: Depth,
}

impl Decoded {
    fn new(
        decoder: impl ImageDecoder,
        format: FrameFormat,
        found_bytes: usize,
        account: &Account,
    ) -> Result<Self, FrameError> {
        let (width, height) = decoder.dimensions();
        let (width, height) = (width as usize, height as usize);
        check_size(width, height)?;
        let bytes_per_pixel = decoder_bytes_per_pixel(&decoder) + size_of::<f32>();
        account.check_image((width, height), bytes_per_pixel)?;
        let color = decoder.color_type();
        let depth = match color {
            ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => Depth::Eight,
            ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
                Depth::Sixteen
            }
            other => return Err(unsupported(format, format!("{other:?}"))),
        };
        let image = DynamicImage::from_decoder(decoder)
            .map_err(|e| account.why(error_of(e, format, found_bytes)))?;
        Ok(Self {
            image,
            channels: usize::from(color.channel_count()),
            depth,
        })
    }

    /// The samples of a 16-bit image; none of any other.
    fn words(&self) -> &[u16] {
        match &self.image {
            DynamicImage::ImageLuma16(image) => image.as_raw(),
            DynamicImage::ImageLumaA16(image) => image.as_raw(),
            DynamicImage::ImageRgb16(image) => image.as_raw(),
            DynamicImage::ImageRgba16(image) => image.as_raw(),
            _ => &[],
        }
    }

    fn integers<T: WholeNumber>(
        &self,
        values: &[T],
        full_scale: T,
    ) -> Result<Frame<'static>, FrameError> {
        let samples = Samples {
            width: self.image.width() as usize,
            height: self.image.height() as usize,
            values,
            channels: self.channels,
        };
        frame_from_integers(&samples, full_scale)
    }
}

fn unsupported(format: FrameFormat, found: String) -> FrameError {
    FrameError::Unsupported {
        format,
        found,
        expected: "8 or 16 bits per sample, grey or colour",
    }
}

/// Sorts the decoder's errors into truncated, unsupported and damaged.
fn error_of(error: ImageError, format: FrameFormat, found_bytes: usize) -> FrameError {
    // Some of the decoders' messages have several lines.
    let message = error.to_string();
    let detail = message.split_whitespace().collect::<Vec<_>>().join(" ");
    let truncated = |detail| FrameError::Truncated {
        format,
        found_bytes,
        detail,
    };
    match error {
        ImageError::IoError(e) if e.kind() == ErrorKind::UnexpectedEof => truncated(detail),
        ImageError::Unsupported(e) => unsupported(
            format,
            match e.kind() {
                UnsupportedErrorKind::Color(color) => format!("{color:?}"),
                _ => detail,
            },
        ),
        // The decoders have no common error for the end of the data.
        _ if [
            "end of file",
            "eof",
            "exhausted",
            "more bytes",
            "no more",
            "not enough bytes",
            "not enough data",
        ]
        .iter()
        .any(|words| detail.to_lowercase().contains(words)) =>
        {
            truncated(detail)
        }
        _ => FrameError::Malformed { format, detail },
    }
}
