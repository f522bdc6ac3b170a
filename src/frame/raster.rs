//! PNG and JPEG, decoded by the `image` crate to 8 or 16 bits a sample.

use super::{Frame, FrameError, FrameFormat, MAX_PIXELS, Samples, check_size, frame_from_integers};
use image::codecs::jpeg::JpegDecoder;
use image::codecs::png::PngDecoder;
use image::error::{ImageError, UnsupportedErrorKind};
use image::{ColorType, DynamicImage, ExtendedColorType, ImageDecoder, Limits};
use std::io::{Cursor, ErrorKind};

/// Decodes a PNG of any colour type and depth; depths below 8 bits are spread over 0-255, as PNG defines.
/// # Errors
/// As [`super::decode`].
pub(super) fn decode_png(bytes: &[u8]) -> Result<Frame, FrameError> {
    let format = FrameFormat::Png;
    // The size stands at bytes 16-23; looked at first, so that the decoder allocates nothing for absurd ones.
    if let Some(Ok(size)) = bytes.get(16..24).map(<[u8; 8]>::try_from) {
        let side = |b: &[u8]| b.iter().fold(0usize, |n, &byte| n << 8 | usize::from(byte));
        check_size(side(&size[..4]), side(&size[4..]))?;
    }
    let decoder = PngDecoder::with_limits(Cursor::new(bytes), limits())
        .map_err(|e| error_of(e, format, bytes.len()))?;
    let step = match decoder.original_color_type() {
        ExtendedColorType::L1 => 255.0,
        ExtendedColorType::L2 => 85.0,
        ExtendedColorType::L4 => 17.0,
        _ => 1.0,
    };
    let mut frame = decode_with(decoder, format, bytes.len())?;
    frame.step_adu = frame.step_adu.max(step);
    Ok(frame)
}

/// Decodes a baseline or progressive JPEG.
/// # Errors
/// As [`super::decode`].
pub(super) fn decode_jpeg(bytes: &[u8]) -> Result<Frame, FrameError> {
    let format = FrameFormat::Jpeg;
    let decoder =
        JpegDecoder::new(Cursor::new(bytes)).map_err(|e| error_of(e, format, bytes.len()))?;
    // The decoder paints what is missing grey, without a word.
    if !has_jpeg_end(bytes) {
        return Err(FrameError::Truncated {
            format,
            found_bytes: bytes.len(),
            detail: "no end-of-image marker (ff d9) after the last scan".to_string(),
        });
    }
    decode_with(decoder, format, bytes.len())
}

/// Whether an end-of-image marker follows the last start of a scan; scan data cannot contain either.
fn has_jpeg_end(bytes: &[u8]) -> bool {
    let last = |marker: u8| bytes.windows(2).rposition(|pair| pair == [0xff, marker]);
    match (last(0xda), last(0xd9)) {
        (Some(scan), Some(end)) => end > scan,
        _ => false,
    }
}

fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_PIXELS as u64 * 8);
    limits
}

/// Checks the size, decodes, and makes luminance of it.
fn decode_with(
    decoder: impl ImageDecoder,
    format: FrameFormat,
    found_bytes: usize,
) -> Result<Frame, FrameError> {
    let (width, height) = decoder.dimensions();
    check_size(width as usize, height as usize)?;
    let color = decoder.color_type();
    let image =
        DynamicImage::from_decoder(decoder).map_err(|e| error_of(e, format, found_bytes))?;
    let (width, height) = (width as usize, height as usize);
    let channels = usize::from(color.channel_count());
    match color {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {
            frame_from_integers(&Samples {
                width,
                height,
                values: image.as_bytes(),
                channels,
                full_scale: u8::MAX,
            })
        }
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
            let values: Vec<u16> = image
                .as_bytes()
                .chunks_exact(2)
                .map(|pair| u16::from_ne_bytes([pair[0], pair[1]]))
                .collect();
            frame_from_integers(&Samples {
                width,
                height,
                values: &values,
                channels,
                full_scale: u16::MAX,
            })
        }
        other => Err(FrameError::Unsupported {
            format,
            found: format!("{other:?}"),
            expected: "8 or 16 bits a sample",
        }),
    }
}

/// Sorts the decoder's errors into truncated, unsupported and damaged.
fn error_of(error: ImageError, format: FrameFormat, found_bytes: usize) -> FrameError {
    let detail = error.to_string();
    let truncated = |detail| FrameError::Truncated {
        format,
        found_bytes,
        detail,
    };
    match error {
        ImageError::IoError(e) if e.kind() == ErrorKind::UnexpectedEof => truncated(detail),
        ImageError::Unsupported(e) => FrameError::Unsupported {
            format,
            found: match e.kind() {
                UnsupportedErrorKind::Color(color) => format!("{color:?}"),
                _ => detail,
            },
            expected: "8 or 16 bits a sample, grey or colour",
        },
        // The decoders below word the end of the data in their own ways.
        _ if ["end of file", "eof", "exhausted", "more bytes", "no more"]
            .iter()
            .any(|words| detail.to_lowercase().contains(words)) =>
        {
            truncated(detail)
        }
        _ => FrameError::Malformed { format, detail },
    }
}
