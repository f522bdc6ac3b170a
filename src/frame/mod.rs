//! The image as the detector gave it, and the files that hold one.
//!
//! file or bytes → [`Frame`]: grey levels as `f32` at the file's full depth, row-major, (0, 0) the
//! centre of the first stored pixel, no flip; and what the file says of how it was taken ([`FrameMetadata`]).
//!
//! 1. The kind of file is told from its first bytes, never from its name. One compressed with gzip is
//!    what is inside.
//! 2. The size in the header is checked against [`MAX_PIXELS`] before anything is allocated.
//! 3. Colour becomes luminance with the weights of ITU-R BT.601 ([`LUMINANCE_WEIGHTS`]): they undo
//!    JPEG's own colour transform, so that a colour JPEG gives back the luma that it stores.
//! 4. A colour pixel is saturated where any of its channels is; it then takes the full scale as its
//!    value, since its luminance is not known.
//! 5. Infinities become NaN, a pixel without a value.
//!
//! Of a file with several images the first is read, or the one asked for. Pages, counted from 1, are the
//! images of a TIFF file in its own order; in FITS each header-data unit with an image of two axes, and each
//! plane of a cube, unless it has three: these are red, green and blue.
//!
//! A FITS image is not flipped either: its first row is y = 0, though programs for display put it at the
//! bottom, whatever `ROWORDER` says. So x and y are those of FITS less 1, and a frame that such a program
//! shows upright counts as mirrored.
//!
//! Caveats: transparency is ignored; JPEG's gamma is not undone, so fluxes from JPEG are not linear. Integers
//! and floats of more than 24 bits are rounded to 24.

mod directory;
mod error;
mod exif;
mod fits;
mod gzip;
mod levels;
mod metadata;
mod raster;
mod tiff;
mod tiff_write;

#[cfg(feature = "overlay")]
pub(crate) use directory::OVERLAY_TEXT;
pub use directory::{CALIBRATION_CREATOR, files_in, is_calibration_frame, is_overlay};
pub use error::{FrameError, FrameFormat};
pub use fits::{FitsHeader, FitsSamples, FitsWriteError, write_fits};
pub use metadata::{FrameMetadata, IgnoredValue};
pub use tiff_write::{TiffOptions, TiffSamples, write_tiff};

use std::io::{self, Read};
use std::num::NonZeroUsize;
use std::path::Path;

/// The most pixels that a frame may have; beyond it, reading refuses before it allocates.
pub const MAX_PIXELS: usize = 200_000_000;

/// The most bytes of a file: the largest frame in three colours of 64 bits, and some headers.
const MAX_FILE_BYTES: u64 = MAX_PIXELS as u64 * 24 + (1 << 24);

/// What has to be read of a file to tell whether it is a frame; a gzip file can hold a long name before its data.
const HEAD_BYTES: u64 = 4096;

/// The shortest side that a frame may have, in pixels: no star can be told from its background on less.
pub const MIN_SIDE_PX: usize = 3;

/// The parts of red, green and blue in luminance: ITU-R BT.601, as in JPEG.
pub const LUMINANCE_WEIGHTS: [f32; 3] = [0.299, 0.587, 0.114];

/// One image of light intensities.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row-major, `height * width`, in the file's own units (ADU); colour has become luminance.
    /// NaN marks a pixel without a value.
    pub pixels: Vec<f32>,
    /// The difference between neighbouring levels that the file can express (1 for integers, 0 for floats), in ADU.
    pub step_adu: f32,
    /// The level from which on a pixel is saturated, in ADU, where the format has one.
    pub saturation_adu: Option<f32>,
    /// What the file says of how it was taken.
    pub metadata: FrameMetadata,
}

impl Frame {
    /// A frame from `pixels`, row-major, `height * width`, in ADU, without quantisation or saturation.
    ///
    /// Pixels may be NaN (no value); infinities become NaN.
    /// # Errors
    /// [`FrameError::WrongLength`], [`FrameError::TooSmall`], [`FrameError::TooLarge`] where the sizes do
    /// not fit, [`FrameError::NoValues`] where no pixel has a value.
    pub fn new(width: usize, height: usize, mut pixels: Vec<f32>) -> Result<Self, FrameError> {
        check_size(width, height)?;
        if pixels.len() != width * height {
            return Err(FrameError::WrongLength {
                expected: width * height,
                found: pixels.len(),
            });
        }
        let mut any_value = false;
        for pixel in &mut pixels {
            if pixel.is_infinite() {
                *pixel = f32::NAN;
            }
            any_value |= !pixel.is_nan();
        }
        if !any_value {
            return Err(FrameError::NoValues);
        }
        Ok(Self::of_numbers(width, height, pixels))
    }

    /// A frame of pixels of which none is infinite and not all are NaN, `height * width` of them.
    fn of_numbers(width: usize, height: usize, pixels: Vec<f32>) -> Self {
        Self {
            width,
            height,
            pixels,
            step_adu: 0.0,
            saturation_adu: None,
            metadata: FrameMetadata::default(),
        }
    }

    /// The same frame with the format's level difference and full scale, in ADU.
    #[must_use]
    pub fn with_levels(mut self, step_adu: f32, saturation_adu: Option<f32>) -> Self {
        self.step_adu = step_adu;
        self.saturation_adu = saturation_adu;
        self
    }

    /// The same frame with what the file says of it.
    #[must_use]
    pub fn with_metadata(mut self, metadata: FrameMetadata) -> Self {
        self.metadata = metadata;
        self
    }
}

/// Room that reading takes, kept from frame to frame. Most of the time of reading is else the system's, which has to find
/// and clear that memory anew for each.
#[derive(Debug, Default)]
pub struct Buffers {
    /// The file.
    bytes: Vec<u8>,
    /// Of a frame that is no longer needed.
    pixels: Vec<f32>,
}

impl Buffers {
    /// None yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes back the pixels of a frame that is no longer needed.
    pub fn recycle(&mut self, frame: Frame) {
        self.pixels = frame.pixels;
    }
}

/// Reads the first image in the file `path`, whatever its name ends in.
/// # Errors
/// As [`read_page`].
pub fn read(path: impl AsRef<Path>) -> Result<Frame, FrameError> {
    read_page(path, None)
}

/// Reads one image of the file `path`: `page`, counted from 1, else the first.
/// # Errors
/// [`FrameError::File`] with the path, around what is wrong.
pub fn read_page(path: impl AsRef<Path>, page: Option<NonZeroUsize>) -> Result<Frame, FrameError> {
    read_page_with(path, page, &mut Buffers::new())
}

/// The same, with room kept from the last frame.
/// # Errors
/// As [`read_page`].
pub fn read_page_with(
    path: impl AsRef<Path>,
    page: Option<NonZeroUsize>,
    buffers: &mut Buffers,
) -> Result<Frame, FrameError> {
    let path = path.as_ref();
    let Buffers { bytes, pixels } = buffers;
    std::fs::File::open(path)
        .map_err(FrameError::from)
        .and_then(|file| {
            let length = file.metadata().map_or(0, |metadata| metadata.len());
            read_limited(file, length, MAX_FILE_BYTES, bytes)?;
            decode_with(bytes, page, pixels)
        })
        .map_err(|error| error.in_file(path))
}

/// Reads one image from `stream` to its end: `page`, counted from 1, else the first.
///
/// What does not begin like an image is not read further: it may have no end.
/// # Errors
/// As [`decode_page`]; [`FrameError::Io`], [`FrameError::TooManyBytes`].
pub fn read_stream(stream: impl Read, page: Option<NonZeroUsize>) -> Result<Frame, FrameError> {
    let mut bytes = Vec::new();
    read_limited(stream, 0, MAX_FILE_BYTES, &mut bytes)?;
    decode_page(&bytes, page)
}

/// Makes `bytes` all those of `stream`, in which `expected` are to be expected, at most `limit`.
fn read_limited(
    mut stream: impl Read,
    expected: u64,
    limit: u64,
    bytes: &mut Vec<u8>,
) -> Result<(), FrameError> {
    bytes.clear();
    stream.by_ref().take(HEAD_BYTES).read_to_end(bytes)?;
    if format_of(bytes).is_none() {
        return Err(no_image(bytes));
    }
    if expected > limit {
        return Err(FrameError::TooManyBytes { limit });
    }
    let room = bytes.try_reserve(expected as usize);
    room.map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
    let rest = (limit + 1).saturating_sub(bytes.len() as u64);
    stream.take(rest).read_to_end(bytes)?;
    if bytes.len() as u64 > limit {
        return Err(FrameError::TooManyBytes { limit });
    }
    Ok(())
}

/// Why `bytes`, which do not begin like an image, are none.
fn no_image(bytes: &[u8]) -> FrameError {
    if bytes.is_empty() {
        return FrameError::Empty;
    }
    FrameError::UnknownFormat {
        found: first_bytes(bytes),
    }
}

/// Decodes the first image in `bytes`; the format is told from the first of them.
/// # Errors
/// As [`decode_page`].
pub fn decode(bytes: &[u8]) -> Result<Frame, FrameError> {
    decode_page(bytes, None)
}

/// Decodes one image in `bytes`: `page`, counted from 1, else the first.
/// # Errors
/// [`FrameError`], never [`FrameError::File`].
pub fn decode_page(bytes: &[u8], page: Option<NonZeroUsize>) -> Result<Frame, FrameError> {
    decode_with(bytes, page, &mut Vec::new())
}

fn decode_with(
    bytes: &[u8],
    page: Option<NonZeroUsize>,
    room: &mut Vec<f32>,
) -> Result<Frame, FrameError> {
    match format_of(bytes) {
        Some(FrameFormat::Gzip) => decode_image(&gzip::unpack(bytes)?, page, room),
        _ => decode_image(bytes, page, room),
    }
}

/// The format of what is inside the gzip file that begins with `head`, which is not gzip again; and its first bytes.
fn format_inside(head: &[u8]) -> (Option<FrameFormat>, Vec<u8>) {
    const SIGNATURE_BYTES: usize = 16;
    let inside = gzip::unpack_beginning(head, SIGNATURE_BYTES);
    let format = format_of(&inside).filter(|format| *format != FrameFormat::Gzip);
    (format, inside)
}

/// Decodes one image that is not packed, or no longer.
fn decode_image(
    bytes: &[u8],
    page: Option<NonZeroUsize>,
    room: &mut Vec<f32>,
) -> Result<Frame, FrameError> {
    let only_page = |read: fn(&[u8]) -> Result<Frame, FrameError>| match page {
        Some(page) if page.get() > 1 => Err(FrameError::NoSuchPage { page, pages: 1 }),
        _ => read(bytes),
    };
    match format_of(bytes) {
        Some(FrameFormat::Fits) => fits::decode(bytes, page),
        Some(FrameFormat::Tiff) => tiff::decode(bytes, page, room),
        Some(FrameFormat::Png) => only_page(raster::decode_png),
        Some(FrameFormat::Jpeg) => only_page(raster::decode_jpeg),
        Some(FrameFormat::Bmp) => only_page(raster::decode_bmp),
        Some(FrameFormat::Pnm) => only_page(raster::decode_pnm),
        Some(FrameFormat::Gzip) | None => Err(no_image(bytes)),
    }
}

/// The format whose signature `bytes` begin with.
fn format_of(bytes: &[u8]) -> Option<FrameFormat> {
    const SIGNATURES: [(&[u8], FrameFormat); 8] = [
        (b"SIMPLE  =", FrameFormat::Fits),
        (b"II*\0", FrameFormat::Tiff),
        (b"MM\0*", FrameFormat::Tiff),
        (b"II+\0", FrameFormat::Tiff),
        (b"MM\0+", FrameFormat::Tiff),
        (b"\x89PNG\r\n\x1a\n", FrameFormat::Png),
        (b"\xff\xd8\xff", FrameFormat::Jpeg),
        (b"\x1f\x8b", FrameFormat::Gzip),
    ];
    match bytes {
        [b'P', b'1'..=b'7', space, ..] if space.is_ascii_whitespace() => Some(FrameFormat::Pnm),
        // Two letters are little: the four bytes after the file's size, which have no use, are zero, too.
        [b'B', b'M', _, _, _, _, 0, 0, 0, 0, ..] => Some(FrameFormat::Bmp),
        _ => SIGNATURES
            .iter()
            .find(|(signature, _)| bytes.starts_with(signature))
            .map(|&(_, format)| format),
    }
}

/// The first bytes for an error message: quoted where they are text, else in hexadecimal.
fn first_bytes(bytes: &[u8]) -> String {
    let head = &bytes[..bytes.len().min(8)];
    if head
        .iter()
        .all(|b| b.is_ascii_graphic() || b.is_ascii_whitespace())
    {
        return format!("the text {:?}", String::from_utf8_lossy(head));
    }
    let hex: Vec<String> = head.iter().map(|b| format!("{b:02x}")).collect();
    format!("the bytes {}", hex.join(" "))
}

/// Refuses sizes that are too small or too large, before anything is allocated.
pub(crate) fn check_size(width: usize, height: usize) -> Result<(), FrameError> {
    if width < MIN_SIDE_PX || height < MIN_SIDE_PX {
        return Err(FrameError::TooSmall { width, height });
    }
    match width.checked_mul(height) {
        Some(count) if count <= MAX_PIXELS => Ok(()),
        _ => Err(FrameError::TooLarge { width, height }),
    }
}

#[cfg(test)]
mod tests;
