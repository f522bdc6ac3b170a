//! JPEG, decoded by `zune-jpeg`, which reads as it decodes and can be ended in between.

use super::error::FrameError;
use super::exif;
use super::format::FrameFormat;
use super::image::{Frame, check_size};
use super::jpeg_rows::check_rows;
use super::jpeg_scans::{Scans, has_end};
use super::levels::{LevelSamples, frame_from_integers};
use super::raster::{damaged, unsupported};
use super::read_budget::{FLOATS_BYTES_PER_PIXEL, ReadBudget};
use crate::base::size::Size;
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

const FORMAT: FrameFormat = FrameFormat::Jpeg;

/// Longest side of a block of pixels that are stored together.
const BLOCK_PX: usize = 32;

/// Decodes a baseline or progressive JPEG.
/// # Errors
/// As [`super::reader::decode`].
pub(super) fn decode(bytes: &[u8], budget: &ReadBudget) -> Result<Frame<'static>, FrameError> {
    let jpeg = Jpeg::open(bytes, budget)?;
    // The decoder fills missing data and reports no error.
    if !has_end(bytes) {
        return Err(FrameError::Truncated {
            format: FORMAT,
            found_bytes: bytes.len(),
            detail: "no end-of-image marker (ff d9) after the last scan".to_string(),
        });
    }
    let (width, height) = (jpeg.width, jpeg.height);
    check_size(width, height)?;
    let bytes_per_pixel = jpeg.bytes_per_pixel() + size_of::<f32>();
    let bytes_per_pixel = match jpeg.channels {
        1 => bytes_per_pixel,
        _ => bytes_per_pixel.max(FLOATS_BYTES_PER_PIXEL),
    };
    let padded = |side: usize| side.next_multiple_of(BLOCK_PX);
    budget.check_image(Size::new(padded(width), padded(height)), bytes_per_pixel)?;
    let values = jpeg.samples(budget)?;
    let samples = LevelSamples {
        width,
        height,
        values: &values,
        channels: jpeg.channels,
    };
    let frame = frame_from_integers(&samples, u8::MAX, budget)?;
    drop(values);
    let metadata = jpeg.exif.map(|exif| exif::metadata(&exif, width));
    Ok(frame.with_metadata(metadata.unwrap_or_default()).drawn())
}

/// A JPEG file whose header has been read.
pub(super) struct Jpeg<'a> {
    bytes: &'a [u8],
    pub width: usize,
    pub height: usize,
    /// 1: grey; 3: color.
    pub channels: usize,
    scans: Scans,
    exif: Option<Vec<u8>>,
}

impl<'a> Jpeg<'a> {
    /// Reads the header of the file `bytes`.
    pub fn open(bytes: &'a [u8], budget: &ReadBudget) -> Result<Self, FrameError> {
        let source = budget.timed(ZCursor::new(bytes));
        let mut decoder = JpegDecoder::new_with_options(source, options());
        let opened = decoder.decode_headers();
        opened.map_err(|error| budget.why(error_of(error, bytes.len())))?;
        let (width, height) = decoder.dimensions().unwrap_or_default();
        Ok(Self {
            bytes,
            width,
            height,
            channels: match decoder.input_colorspace() {
                Some(ColorSpace::Luma) => 1,
                _ => 3,
            },
            scans: Scans::parse(bytes),
            exif: decoder.exif().cloned(),
        })
    }

    /// The memory of each pixel while samples are decoded.
    pub fn bytes_per_pixel(&self) -> usize {
        // A progressive image is decoded to coefficients first.
        let coefficient = if self.scans.are_collected() {
            size_of::<i16>()
        } else {
            0
        };
        self.channels * (1 + coefficient)
    }

    /// The samples, interleaved. Every row of them is in the file.
    pub fn samples(&self, budget: &ReadBudget) -> Result<Vec<u8>, FrameError> {
        self.scans.check(Size::new(self.width, self.height))?;
        check_rows(self.bytes, budget)?;
        let color = match self.channels {
            1 => ColorSpace::Luma,
            _ => ColorSpace::RGB,
        };
        let source = budget.timed(ZCursor::new(self.bytes));
        let options = options().jpeg_set_out_colorspace(color);
        let mut values = vec![0; self.width * self.height * self.channels];
        let decoded = JpegDecoder::new_with_options(source, options).decode_into(&mut values);
        decoded.map_err(|error| budget.why(error_of(error, self.bytes.len())))?;
        // Ended in the middle, the decoder is content with what it has.
        budget.check_time()?;
        Ok(values)
    }
}

/// Small damage is no error; sizes are checked here.
fn options() -> DecoderOptions {
    let options = DecoderOptions::default().set_strict_mode(false);
    options.set_max_width(usize::MAX).set_max_height(usize::MAX)
}

fn error_of(error: DecodeErrors, found_bytes: usize) -> FrameError {
    match error {
        DecodeErrors::Unsupported(scheme) => unsupported(FORMAT, format!("{scheme:?}")),
        other => damaged(other.to_string(), FORMAT, found_bytes),
    }
}
