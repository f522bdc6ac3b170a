//! TIFF, decoded by the `tiff` crate.
//!
//! Signed and unsigned integers of 1 to 64 bits, floats of 16 to 64 bits; grey or colour, with or
//! without alpha; in strips or tiles, interleaved or plane by plane.

use super::account::{Account, Timed};
use super::error::FrameError;
use super::exif;
use super::format::FrameFormat;
use super::image::{Frame, check_size};
use super::levels::{
    Samples, WholeNumber, frame_from_floats, frame_from_integers, frame_from_words, interleaved,
};
use super::limits::MAX_PAGES;
use std::io::Cursor;
use std::num::NonZeroUsize;
use tiff::decoder::{BufferLayoutPreference, Decoder, DecodingResult, Limits};
use tiff::tags::{ByteOrder, SampleFormat, Tag};
use tiff::{ColorType, TiffError, TiffFormatError};

const SUPPORTED: &str = "grey or colour of 1 to 64 bits per sample, uncompressed or with LZW, deflate, PackBits, JPEG or fax";

/// Decodes image `page` of a TIFF file, counted from 1; without `page`, the first.
/// # Errors
/// As [`super::reader::decode_page`].
pub(super) fn decode(
    bytes: &[u8],
    page: Option<NonZeroUsize>,
    account: &Account,
    buffer: Vec<u16>,
) -> Result<Frame<'static>, FrameError> {
    let fail = |e: TiffError| account.why(error_of(e, bytes.len()));
    let mut decoder = Decoder::new(account.timed(Cursor::new(bytes))).map_err(fail)?;
    if let Some(page) = page {
        seek(&mut decoder, page, bytes.len())?;
    }
    let (width, height) = decoder.dimensions().map_err(fail)?;
    let (width, height) = (width as usize, height as usize);
    check_size(width, height)?;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = usize::try_from(account.left_bytes()).unwrap_or(usize::MAX);
    limits.intermediate_buffer_size = limits.decoding_buffer_size;
    decoder = decoder.with_limits(limits);
    let color = decoder.colortype().map_err(fail)?;
    let stored = decoder.image_buffer_layout().map_err(fail)?;
    let layout = Layout {
        width,
        height,
        bits: color.bit_depth(),
        channels: channels_of(color)?,
        planes: stored.planes,
    };
    account.check_image((width, height), layout.bytes_per_pixel())?;
    let words = if layout.is_grey_words(&stored) {
        plain_words(&mut decoder, bytes)
    } else {
        None
    };
    let frame = if let Some(words) = words {
        let is_big_endian = decoder.byte_order() == ByteOrder::BigEndian;
        frame_from_words((width, height), words, is_big_endian, buffer)
    } else {
        drop(buffer);
        let mut samples = DecodingResult::U8(Vec::new());
        decoder.read_image_to_buffer(&mut samples).map_err(fail)?;
        layout.frame(samples)
    };
    Ok(frame?.with_metadata(exif::metadata(bytes, width)))
}

/// The number of images in a TIFF file, at most [`MAX_PAGES`], and why there may be more that cannot
/// be found.
pub(super) fn count_pages(bytes: &[u8], account: &Account) -> (usize, Option<FrameError>) {
    let fail = |e: TiffError| Some(account.why(error_of(e, bytes.len())));
    let mut decoder = match Decoder::new(account.timed(Cursor::new(bytes))) {
        Ok(decoder) => decoder,
        Err(error) => return (0, fail(error)),
    };
    let mut pages = 1;
    while decoder.more_images() && pages < MAX_PAGES {
        if let Err(error) = decoder.next_image() {
            return (pages, fail(error));
        }
        pages += 1;
    }
    (pages, None)
}

/// The 16-bit samples as stored in the file, if they are contiguous, uncompressed, and 0 is black.
fn plain_words<'a>(
    decoder: &mut Decoder<Timed<Cursor<&[u8]>>>,
    bytes: &'a [u8],
) -> Option<&'a [[u8; 2]]> {
    const UNCOMPRESSED: u16 = 1;
    const BLACK_IS_ZERO: u16 = 1;
    // Tag, its default, and the value required.
    let plain = [
        (Tag::Compression, 1, UNCOMPRESSED),
        (Tag::PhotometricInterpretation, 0, BLACK_IS_ZERO),
        (Tag::Predictor, 1, 1),
        (Tag::FillOrder, 1, 1),
    ];
    for (tag, default, required) in plain {
        let found: Option<u16> = decoder.find_tag_unsigned(tag).ok()?;
        if found.unwrap_or(default) != required {
            return None;
        }
    }
    let offsets = decoder.get_tag_u64_vec(Tag::StripOffsets).ok()?;
    let counts = decoder.get_tag_u64_vec(Tag::StripByteCounts).ok()?;
    let mut end = *offsets.first()?;
    for (offset, count) in offsets.iter().zip(&counts) {
        if *offset != end {
            return None;
        }
        end = end.checked_add(*count)?;
    }
    let range = usize::try_from(offsets[0]).ok()?..usize::try_from(end).ok()?;
    let (width, height) = decoder.dimensions().ok()?;
    let words = bytes.get(range)?.as_chunks().0;
    (words.len() == width as usize * height as usize).then_some(words)
}

/// Moves the decoder to image `page`, counted from 1.
fn seek(
    decoder: &mut Decoder<Timed<Cursor<&[u8]>>>,
    page: NonZeroUsize,
    found_bytes: usize,
) -> Result<(), FrameError> {
    let absent = |e: &TiffError| {
        matches!(
            e,
            TiffError::FormatError(TiffFormatError::ImageFileDirectoryNotFound)
        )
    };
    match decoder.seek_to_image(page.get() - 1) {
        Err(e) if absent(&e) => {
            let exists =
                |index: &usize| !matches!(decoder.seek_to_image(*index), Err(e) if absent(&e));
            let pages = (0..page.get()).take_while(exists).count();
            Err(FrameError::NoSuchPage { page, pages })
        }
        other => other.map_err(|e| error_of(e, found_bytes)),
    }
}

/// The number of samples per pixel.
fn channels_of(color: ColorType) -> Result<usize, FrameError> {
    match color {
        ColorType::Gray(_) => Ok(1),
        // The decoder reports grey and alpha as two bands.
        ColorType::GrayA(_) | ColorType::Multiband { num_samples: 2, .. } => Ok(2),
        ColorType::RGB(_) => Ok(3),
        ColorType::RGBA(_) => Ok(4),
        other => Err(unsupported(format!("{other:?}"))),
    }
}

/// How decoded samples are arranged.
struct Layout {
    width: usize,
    height: usize,
    bits: u8,
    channels: usize,
    /// 1 if the channels are interleaved, otherwise one plane per channel.
    planes: usize,
}

impl Layout {
    /// Whether the image is grey with unsigned 16-bit samples, as most cameras write.
    fn is_grey_words(&self, stored: &BufferLayoutPreference) -> bool {
        let is_unsigned = stored.sample_format == SampleFormat::Uint;
        self.bits == 16 && is_unsigned && self.channels == 1 && self.planes == 1
    }

    /// Decoded samples, which are copied where they are packed or wider than a frame's values, and
    /// the frame.
    fn bytes_per_pixel(&self) -> usize {
        let samples = self.channels * usize::from(self.bits).div_ceil(8);
        let copied = match self.bits {
            8 | 16 | 32 => 0,
            _ => self.channels * size_of::<f32>(),
        };
        samples + copied + size_of::<f32>()
    }

    fn frame(&self, samples: DecodingResult) -> Result<Frame<'static>, FrameError> {
        // Values of more than 24 bits are rounded.
        let rounded = |values: Vec<f32>| Ok(self.floats(values)?.with_levels(1.0, None));
        match samples {
            DecodingResult::U8(packed) if self.bits < 8 => {
                let full_scale = u8::MAX >> (8 - self.bits);
                self.integers(self.unpacked(&packed), full_scale)
            }
            DecodingResult::U8(values) => self.integers(values, u8::MAX),
            DecodingResult::U16(values) => self.integers(values, u16::MAX),
            DecodingResult::U32(values) => self.integers(values, u32::MAX),
            DecodingResult::U64(values) => rounded(values.iter().map(|v| *v as f32).collect()),
            DecodingResult::I8(values) => self.integers(values, i8::MAX),
            DecodingResult::I16(values) => self.integers(values, i16::MAX),
            DecodingResult::I32(values) => self.integers(values, i32::MAX),
            DecodingResult::I64(values) => rounded(values.iter().map(|v| *v as f32).collect()),
            DecodingResult::F16(values) => self.floats(values.iter().map(|v| v.to_f32()).collect()),
            DecodingResult::F32(values) => self.floats(values),
            DecodingResult::F64(values) => self.floats(values.iter().map(|v| *v as f32).collect()),
        }
    }

    fn integers<T: WholeNumber>(
        &self,
        values: Vec<T>,
        full_scale: T,
    ) -> Result<Frame<'static>, FrameError> {
        let samples = Samples {
            width: self.width,
            height: self.height,
            values: &self.interleaved(values),
            channels: self.channels,
        };
        frame_from_integers(&samples, full_scale)
    }

    fn floats(&self, values: Vec<f32>) -> Result<Frame<'static>, FrameError> {
        let size = (self.width, self.height);
        frame_from_floats(size, self.channels, self.interleaved(values))
    }

    /// The samples of all channels, interleaved.
    fn interleaved<T: Copy>(&self, values: Vec<T>) -> Vec<T> {
        let wanted = self.width * self.height * self.channels;
        match values.get(..wanted) {
            Some(planes) if self.planes > 1 => interleaved(planes, self.channels),
            _ => values,
        }
    }

    /// Unpacks samples of less than 8 bits. Each row begins at a byte; the highest bits come first.
    fn unpacked(&self, packed: &[u8]) -> Vec<u8> {
        let bits = usize::from(self.bits);
        let row_samples = self.width * self.channels;
        let row_bytes = (row_samples * bits).div_ceil(8);
        let sample = |row: &[u8], i: usize| {
            let bit = i * bits;
            row[bit / 8] << (bit % 8) >> (8 - bits)
        };
        packed
            .chunks_exact(row_bytes)
            .flat_map(|row| (0..row_samples).map(move |i| sample(row, i)))
            .collect()
    }
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
        TiffError::UnsupportedError(e) => {
            unsupported(e.to_string().trim_end_matches(" is unsupported").to_owned())
        }
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
