//! Reads files and streams, and decodes them by their format.

use super::error::FrameError;
use super::format::{FrameFormat, first_bytes};
use super::image::Frame;
use super::limits::{HEAD_BYTES, MAX_FILE_BYTES};
use super::memory::MemoryLimit;
use super::pixels::Pixels;
use super::{compressed, fits, foreign, raster, tiff};
use crate::base::files;
use std::borrow::Cow;
use std::io::{self, Read};
use std::num::NonZeroUsize;
use std::path::Path;

/// Buffers for reading, reused from frame to frame. Without them, reading spends most of its time
/// in the operating system, which allocates and clears the memory of each frame.
#[derive(Debug, Default)]
pub struct Buffers {
    /// Content of the file.
    bytes: Vec<u8>,
    /// 16-bit pixels of a discarded frame.
    pixels: Vec<u16>,
    memory: MemoryLimit,
}

impl Buffers {
    /// Empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// How much memory a frame may take.
    pub fn memory(&self) -> MemoryLimit {
        self.memory
    }

    /// From now on a frame may take as much memory as `memory`.
    pub fn set_memory(&mut self, memory: MemoryLimit) {
        self.memory = memory;
    }

    /// Reuses the pixels of a frame that is no longer needed.
    pub fn recycle(&mut self, frame: Frame) {
        if let Pixels::U16(Cow::Owned(pixels)) = frame.pixels {
            self.pixels = pixels;
        }
    }
}

/// Reads the first image of the file `path`. Its extension does not matter.
/// # Errors
/// As [`read_page`].
pub fn read(path: impl AsRef<Path>) -> Result<Frame<'static>, FrameError> {
    read_page(path, None)
}

/// Reads image `page` of the file `path`, counted from 1; without `page`, the first.
/// # Errors
/// [`FrameError::File`] with the path and the error.
pub fn read_page(
    path: impl AsRef<Path>,
    page: Option<NonZeroUsize>,
) -> Result<Frame<'static>, FrameError> {
    read_page_with(path, page, &mut Buffers::new())
}

/// [`read_page`] with buffers that are reused from frame to frame.
/// # Errors
/// As [`read_page`].
pub fn read_page_with(
    path: impl AsRef<Path>,
    page: Option<NonZeroUsize>,
    buffers: &mut Buffers,
) -> Result<Frame<'static>, FrameError> {
    let path = path.as_ref();
    let Buffers {
        bytes,
        pixels,
        memory,
    } = buffers;
    files::open(path)
        .map_err(FrameError::from)
        .and_then(|file| {
            let length = file.metadata().map_or(0, |metadata| metadata.len());
            read_limited(file, length, MAX_FILE_BYTES, bytes)?;
            decode_with(bytes, page, *memory, pixels)
        })
        .map_err(|error| error.in_file(path))
}

/// Reads `stream` to its end and decodes image `page`, counted from 1; without `page`, the first. It
/// may take as much memory as `memory`.
///
/// A stream that does not begin like an image is not read further: it may be endless.
/// # Errors
/// As [`decode_page`]; [`FrameError::Io`], [`FrameError::TooManyBytes`].
pub fn read_stream(
    stream: impl Read,
    page: Option<NonZeroUsize>,
    memory: MemoryLimit,
) -> Result<Frame<'static>, FrameError> {
    let mut bytes = Vec::new();
    read_limited(stream, 0, MAX_FILE_BYTES, &mut bytes)?;
    decode_with(&bytes, page, memory, &mut Vec::new())
}

/// Reads all of `stream` into `bytes`: about `expected` bytes, at most `limit`.
pub(super) fn read_limited(
    mut stream: impl Read,
    expected: u64,
    limit: u64,
    bytes: &mut Vec<u8>,
) -> Result<(), FrameError> {
    bytes.clear();
    stream.by_ref().take(HEAD_BYTES).read_to_end(bytes)?;
    if FrameFormat::of(bytes).is_none() {
        return Err(not_an_image(bytes));
    }
    if expected > limit {
        return Err(FrameError::TooManyBytes { limit });
    }
    let reserved = bytes.try_reserve(expected as usize);
    reserved.map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
    let rest = (limit + 1).saturating_sub(bytes.len() as u64);
    stream.take(rest).read_to_end(bytes)?;
    if bytes.len() as u64 > limit {
        return Err(FrameError::TooManyBytes { limit });
    }
    Ok(())
}

/// The error for `bytes` that do not begin like an image.
fn not_an_image(bytes: &[u8]) -> FrameError {
    if bytes.is_empty() {
        return FrameError::Empty;
    }
    if let Some(known) = foreign::of(bytes) {
        return known.into();
    }
    FrameError::UnknownFormat {
        found: first_bytes(bytes),
    }
}

/// Decodes the first image in `bytes`.
/// # Errors
/// As [`decode_page`].
pub fn decode(bytes: &[u8]) -> Result<Frame<'static>, FrameError> {
    decode_page(bytes, None)
}

/// Decodes image `page` in `bytes`, counted from 1; without `page`, the first.
/// # Errors
/// [`FrameError`], never [`FrameError::File`].
pub fn decode_page(bytes: &[u8], page: Option<NonZeroUsize>) -> Result<Frame<'static>, FrameError> {
    decode_with(bytes, page, MemoryLimit::DEFAULT, &mut Vec::new())
}

fn decode_with(
    bytes: &[u8],
    page: Option<NonZeroUsize>,
    memory: MemoryLimit,
    buffer: &mut Vec<u16>,
) -> Result<Frame<'static>, FrameError> {
    match FrameFormat::of(bytes) {
        Some(format) if format.is_compressed() => {
            let content = compressed::unpack(bytes, format, memory.content_bytes())?;
            decode_image(&content, page, memory, buffer)
        }
        _ => decode_image(bytes, page, memory, buffer),
    }
}

/// Decodes one image that is not compressed as a file.
pub(super) fn decode_image(
    bytes: &[u8],
    page: Option<NonZeroUsize>,
    memory: MemoryLimit,
    buffer: &mut Vec<u16>,
) -> Result<Frame<'static>, FrameError> {
    let single = |read: fn(&[u8], MemoryLimit) -> Result<Frame<'static>, FrameError>| match page {
        Some(page) if page.get() > 1 => Err(FrameError::NoSuchPage { page, pages: 1 }),
        _ => read(bytes, memory),
    };
    match FrameFormat::of(bytes) {
        Some(FrameFormat::Fits) => fits::decode(bytes, page, memory),
        Some(FrameFormat::Tiff) => match foreign::raw_tiff(bytes) {
            Some(known) => Err(known.into()),
            None => tiff::decode(bytes, page, memory, buffer),
        },
        Some(FrameFormat::Png) => single(raster::decode_png),
        Some(FrameFormat::Jpeg) => single(raster::decode_jpeg),
        Some(FrameFormat::Bmp) => single(raster::decode_bmp),
        Some(FrameFormat::Pnm) => single(raster::decode_pnm),
        Some(FrameFormat::Gzip | FrameFormat::Bzip2) | None => Err(not_an_image(bytes)),
    }
}
