//! TIFF: 8 and 16 bit integers, 32 and 64 bit floats; grey, colour or palette, with or without alpha.

use super::{Frame, FrameError, FrameFormat, MAX_PIXELS, Samples, check_size, frame_from_integers};
use std::io::Cursor;
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;
use tiff::{TiffError, TiffFormatError};

/// The most bytes of one decoded sample array: four 16-bit channels of the largest frame.
const MAX_DECODED_BYTES: usize = MAX_PIXELS * 8;

const SUPPORTED: &str = "8 or 16 bit integers or 32 or 64 bit floats; grey, colour or palette";

/// Decodes the first image of a TIFF file.
/// # Errors
/// As [`super::decode`].
pub(super) fn decode(bytes: &[u8]) -> Result<Frame, FrameError> {
    let fail = |e: TiffError| error_of(e, bytes.len());
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(fail)?;
    let (width, height) = decoder.dimensions().map_err(fail)?;
    let (width, height) = (width as usize, height as usize);
    check_size(width, height)?;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_DECODED_BYTES;
    limits.intermediate_buffer_size = MAX_DECODED_BYTES;
    decoder = decoder.with_limits(limits);
    let color = decoder.colortype().map_err(fail)?;
    let channels = channels_of(color)?;
    let planes = decoder.image_buffer_layout().map_err(fail)?.planes;
    if planes > 1 {
        return Err(unsupported(format!("{planes} separate colour planes")));
    }
    let palette = match color {
        ColorType::Palette(_) => Some(decoder.get_tag_u16_vec(Tag::ColorMap).map_err(fail)?),
        _ => None,
    };
    let samples = decoder.read_image().map_err(fail)?;
    if let Some(map) = palette {
        return from_palette(width, height, &samples, &map);
    }
    match samples {
        DecodingResult::U8(values) if color.bit_depth() == 8 => frame_from_integers(&Samples {
            width,
            height,
            values: &values,
            channels,
            full_scale: u8::MAX,
        }),
        DecodingResult::U16(values) if color.bit_depth() == 16 => frame_from_integers(&Samples {
            width,
            height,
            values: &values,
            channels,
            full_scale: u16::MAX,
        }),
        DecodingResult::F32(values) => from_floats(width, height, channels, values),
        DecodingResult::F64(values) => from_floats(
            width,
            height,
            channels,
            values.iter().map(|&v| v as f32).collect(),
        ),
        _ => Err(unsupported(format!("{color:?}"))),
    }
}

/// The number of samples that make a pixel.
fn channels_of(color: ColorType) -> Result<usize, FrameError> {
    match color {
        ColorType::Gray(_) | ColorType::Palette(_) => Ok(1),
        ColorType::GrayA(_) => Ok(2),
        ColorType::RGB(_) => Ok(3),
        ColorType::RGBA(_) => Ok(4),
        other => Err(unsupported(format!("{other:?}"))),
    }
}

/// The frame of float samples, which have neither steps nor a full scale.
fn from_floats(
    width: usize,
    height: usize,
    channels: usize,
    values: Vec<f32>,
) -> Result<Frame, FrameError> {
    let pixels = match channels {
        1 => values,
        2 => values.chunks_exact(2).map(|c| c[0]).collect(),
        _ => values
            .chunks_exact(channels)
            .map(|c| super::luminance([c[0], c[1], c[2]], f32::INFINITY))
            .collect(),
    };
    Frame::new(width, height, pixels)
}

/// The frame of an indexed image: `map` holds all reds, then all greens, then all blues, 16 bits each.
fn from_palette(
    width: usize,
    height: usize,
    samples: &DecodingResult,
    map: &[u16],
) -> Result<Frame, FrameError> {
    let DecodingResult::U8(indices) = samples else {
        return Err(unsupported("a palette of more than 8 bits".to_string()));
    };
    let colors = map.len() / 3;
    if indices.len() < width * height || indices.iter().any(|&i| usize::from(i) >= colors) {
        return Err(FrameError::Malformed {
            format: FrameFormat::Tiff,
            detail: format!("found a colour index beyond the palette's {colors} entries"),
        });
    }
    let values: Vec<u16> = indices
        .iter()
        .flat_map(|&i| {
            let i = usize::from(i);
            [map[i], map[colors + i], map[2 * colors + i]]
        })
        .collect();
    frame_from_integers(&Samples {
        width,
        height,
        values: &values,
        channels: 3,
        full_scale: u16::MAX,
    })
}

fn unsupported(found: String) -> FrameError {
    FrameError::Unsupported {
        format: FrameFormat::Tiff,
        found,
        expected: SUPPORTED,
    }
}

/// Sorts the decoder's errors into truncated, unsupported and damaged.
fn error_of(error: TiffError, found_bytes: usize) -> FrameError {
    let format = FrameFormat::Tiff;
    match error {
        TiffError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            FrameError::Truncated {
                format,
                found_bytes,
                detail: e.to_string(),
            }
        }
        TiffError::UnsupportedError(e) => unsupported(e.to_string()),
        TiffError::FormatError(TiffFormatError::InvalidDimensions(width, height)) => {
            FrameError::TooSmall {
                width: width as usize,
                height: height as usize,
            }
        }
        other => FrameError::Malformed {
            format,
            detail: other.to_string(),
        },
    }
}
