//! PNG, BMP and PNM, decoded by the `image` crate to 8 or 16 bits per sample.

use super::error::FrameError;
use super::exif;
use super::format::FrameFormat;
use super::image::{Frame, check_size};
use super::levels::{LevelSamples, WholeNumber, frame_from_integers};
use super::read_budget::{FLOATS_BYTES_PER_PIXEL, PIXELS_BETWEEN_CHECKS, ReadBudget};
use crate::base::size::Size;
use image::codecs::bmp::BmpDecoder;
use image::codecs::png::PngDecoder;
use image::codecs::pnm::PnmDecoder;
use image::error::{ImageError, UnsupportedErrorKind};
use image::{ColorType, DynamicImage, ExtendedColorType, ImageDecoder, Limits};
use std::io::{Cursor, ErrorKind};

/// Decodes a PNG of any color type and depth. Depths below 8 bits are scaled to 0-255, as PNG
/// defines.
/// # Errors
/// As [`super::reader::decode`].
pub(super) fn decode_png(bytes: &[u8], budget: &ReadBudget) -> Result<Frame<'static>, FrameError> {
    let format = FrameFormat::Png;
    // Checked first, so that the decoder allocates nothing for absurd sizes.
    if let (Some(width), Some(height)) = (word(bytes, 16), word(bytes, 20)) {
        check_size(
            u32::from_be_bytes(width) as usize,
            u32::from_be_bytes(height) as usize,
        )?;
    }
    let decoder = PngDecoder::with_limits(budget.timed(Cursor::new(bytes)), limits())
        .map_err(|e| budget.why(error_of(e, format, bytes.len())))?;
    let step = match decoder.original_color_type() {
        ExtendedColorType::L1 => 255.0,
        ExtendedColorType::L2 => 85.0,
        ExtendedColorType::L4 => 17.0,
        _ => 1.0,
    };
    let exif = exif_of_png(bytes);
    let mut frame = decode_with(decoder, exif, format, bytes.len(), budget)?;
    frame.step_adu = frame.step_adu.max(step);
    Ok(frame)
}

/// Decodes a Windows bitmap.
/// # Errors
/// As [`super::reader::decode`].
pub(super) fn decode_bmp(bytes: &[u8], budget: &ReadBudget) -> Result<Frame<'static>, FrameError> {
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
    let decoder = BmpDecoder::new(budget.timed(Cursor::new(bytes)))
        .map_err(|e| budget.why(error_of(e, format, bytes.len())))?;
    decode_with(decoder, None, format, bytes.len(), budget)
}

/// Decodes a portable anymap: PBM, PGM, PPM (plain or binary) or PAM, with the levels of the file.
/// # Errors
/// As [`super::reader::decode`].
pub(super) fn decode_pnm(bytes: &[u8], budget: &ReadBudget) -> Result<Frame<'static>, FrameError> {
    let format = FrameFormat::Pnm;
    let decoder = PnmDecoder::new(budget.timed(Cursor::new(bytes)))
        .map_err(|e| budget.why(error_of(e, format, bytes.len())))?;
    let maxval = decoder.header().maximal_sample();
    let mut decoded = Decoded::new(decoder, format, bytes.len(), budget)?;
    // The decoder scales levels from 0..=maxval to all of 8 or 16 bits, and rounds: this is undone.
    let level = |scaled: u16, full: u16| {
        let level = f64::from(scaled) * f64::from(maxval) / f64::from(full);
        level.round() as u16
    };
    match (decoded.depth, u16::try_from(maxval)) {
        (BitDepth::Eight, Ok(maxval @ 0..=0xff)) => {
            for levels in decoded.octets_mut().chunks_mut(PIXELS_BETWEEN_CHECKS) {
                budget.check_time()?;
                let unscaled = |v: &mut u8| *v = level((*v).into(), 0xff) as u8;
                levels.iter_mut().for_each(unscaled);
            }
            decoded.integers(decoded.image.as_bytes(), maxval as u8, budget)
        }
        (BitDepth::Sixteen, Ok(maxval)) => {
            for levels in decoded.words_mut().chunks_mut(PIXELS_BETWEEN_CHECKS) {
                budget.check_time()?;
                levels.iter_mut().for_each(|v| *v = level(*v, u16::MAX));
            }
            decoded.integers(decoded.words(), maxval, budget)
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

/// What the PNG decoder may allocate beside the image: color profiles and texts.
fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_alloc = Some(1 << 26);
    limits
}

/// Most memory that reading takes for each pixel: the decoded one, and the frame's.
fn bytes_per_pixel(color: ColorType) -> usize {
    let both = usize::from(color.bytes_per_pixel()) + size_of::<f32>();
    if color.has_color() {
        both.max(FLOATS_BYTES_PER_PIXEL)
    } else {
        both
    }
}

/// Checks the size, decodes, converts to luminance and adds the Exif metadata.
fn decode_with(
    decoder: impl ImageDecoder,
    exif: Option<&[u8]>,
    format: FrameFormat,
    found_bytes: usize,
    budget: &ReadBudget,
) -> Result<Frame<'static>, FrameError> {
    let decoded = Decoded::new(decoder, format, found_bytes, budget)?;
    let frame = match decoded.depth {
        BitDepth::Eight => decoded.integers(decoded.image.as_bytes(), u8::MAX, budget),
        BitDepth::Sixteen => decoded.integers(decoded.words(), u16::MAX, budget),
    }?;
    drop(decoded);
    let metadata = exif.map(|exif| exif::metadata(exif, frame.width));
    Ok(frame.with_metadata(metadata.unwrap_or_default()).drawn())
}

/// Bits per sample.
#[derive(Clone, Copy)]
enum BitDepth {
    Eight,
    Sixteen,
}

/// A decoded image.
struct Decoded {
    image: DynamicImage,
    channels: usize,
    depth: BitDepth,
}

impl Decoded {
    fn new(
        decoder: impl ImageDecoder,
        format: FrameFormat,
        found_bytes: usize,
        budget: &ReadBudget,
    ) -> Result<Self, FrameError> {
        let (width, height) = decoder.dimensions();
        let (width, height) = (width as usize, height as usize);
        check_size(width, height)?;
        budget.check_image(
            Size::new(width, height),
            bytes_per_pixel(decoder.color_type()),
        )?;
        let color = decoder.color_type();
        let depth = match color {
            ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => BitDepth::Eight,
            ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
                BitDepth::Sixteen
            }
            other => return Err(unsupported(format, format!("{other:?}"))),
        };
        let image = DynamicImage::from_decoder(decoder)
            .map_err(|e| budget.why(error_of(e, format, found_bytes)))?;
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

    /// The same, to be changed.
    fn words_mut(&mut self) -> &mut [u16] {
        match &mut self.image {
            DynamicImage::ImageLuma16(image) => image,
            DynamicImage::ImageLumaA16(image) => image,
            DynamicImage::ImageRgb16(image) => image,
            DynamicImage::ImageRgba16(image) => image,
            _ => &mut [],
        }
    }

    /// The samples of an 8-bit image, to be changed; none of any other.
    fn octets_mut(&mut self) -> &mut [u8] {
        match &mut self.image {
            DynamicImage::ImageLuma8(image) => image,
            DynamicImage::ImageLumaA8(image) => image,
            DynamicImage::ImageRgb8(image) => image,
            DynamicImage::ImageRgba8(image) => image,
            _ => &mut [],
        }
    }

    fn integers<T: WholeNumber>(
        &self,
        values: &[T],
        full_scale: T,
        budget: &ReadBudget,
    ) -> Result<Frame<'static>, FrameError> {
        let samples = LevelSamples {
            width: self.image.width() as usize,
            height: self.image.height() as usize,
            values,
            channels: self.channels,
        };
        frame_from_integers(&samples, full_scale, budget)
    }
}

pub(super) fn unsupported(format: FrameFormat, found: String) -> FrameError {
    FrameError::Unsupported {
        format,
        found,
        expected: "8 or 16 bits per sample, gray or color",
    }
}

/// Sorts the decoder's errors into truncated, unsupported and damaged.
fn error_of(error: ImageError, format: FrameFormat, found_bytes: usize) -> FrameError {
    // Some of the decoders' messages have several lines.
    let message = error.to_string();
    let detail = message.split_whitespace().collect::<Vec<_>>().join(" ");
    match error {
        ImageError::IoError(e) if e.kind() == ErrorKind::UnexpectedEof => FrameError::Truncated {
            format,
            found_bytes,
            detail,
        },
        ImageError::Unsupported(e) => unsupported(
            format,
            match e.kind() {
                UnsupportedErrorKind::Color(color) => format!("{color:?}"),
                _ => detail,
            },
        ),
        _ => damaged(detail, format, found_bytes),
    }
}

/// The error for data that cannot be decoded. The decoders have no common error for their end.
pub(super) fn damaged(detail: String, format: FrameFormat, found_bytes: usize) -> FrameError {
    const OF_THE_END: [&str; 7] = [
        "end of file",
        "eof",
        "exhausted",
        "more bytes",
        "no more",
        "not enough bytes",
        "not enough data",
    ];
    let lower = detail.to_lowercase();
    if OF_THE_END.iter().any(|words| lower.contains(words)) {
        return FrameError::Truncated {
            format,
            found_bytes,
            detail,
        };
    }
    FrameError::Malformed { format, detail }
}
