//! Reads files and streams, and decodes them by their format.

use super::error::FrameError;
use super::format::{FrameFormat, first_bytes};
use super::image::Frame;
use super::limits::{HEAD_BYTES, MAX_FILE_BYTES};
use super::memory::MemoryLimit;
use super::pixels::Pixels;
use super::read_budget::ReadBudget;
use super::{compressed, fits, jpeg, raster, tiff, unsupported_formats};
use crate::base::files;
use crate::base::interrupt::Interrupt;
use crate::base::panics::caught;
use std::borrow::Cow;
use std::io::Read;
use std::num::NonZeroUsize;
use std::path::Path;

/// Buffers for reading, reused from frame to frame, and what a frame may take. Without them, reading
/// spends most of its time in the operating system, which allocates and clears the memory of each
/// frame.
#[derive(Debug, Default)]
pub struct Buffers {
    /// Content of the file.
    bytes: Vec<u8>,
    /// 16-bit pixels of a discarded frame.
    pixels: Vec<u16>,
    memory: MemoryLimit,
    interrupt: Interrupt,
    /// What is held beside the frame that was read last.
    beside_bytes: u64,
    /// The page of the file in `bytes` that was read last, if it has colors.
    color_page: Option<Option<NonZeroUsize>>,
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

    /// From now on reading ends with [`FrameError::Interrupted`] when `interrupt` is due.
    pub fn set_interrupt(&mut self, interrupt: Interrupt) {
        self.interrupt = interrupt;
    }

    /// Reuses the pixels of a frame that is no longer needed.
    pub fn recycle(&mut self, frame: Frame) {
        if let Pixels::U16(Cow::Owned(pixels)) = frame.pixels {
            self.pixels = pixels;
        }
    }

    /// From now on no frame was read.
    pub(crate) fn forget(&mut self) {
        self.color_page = None;
    }

    /// Red and blue of the file of which `held` was read last, with rows as it had then. `None` if it has no colors,
    /// or there is no room for them.
    pub(crate) fn red_and_blue(&self, held: &Frame) -> Option<[Frame<'static>; 2]> {
        const RED: usize = 0;
        const BLUE: usize = 2;
        let page = self.color_page?;
        let decode = |channel: usize, held_bytes: u64| {
            let budget = ReadBudget::new(self.memory, Interrupt::default()).of_channel(channel);
            budget.hold(self.beside_bytes + held_bytes).ok()?;
            decode_with(&self.bytes, page, &budget, Vec::new()).ok()
        };
        let held_bytes = held.pixels.bytes();
        let red = decode(RED, held_bytes)?;
        let blue = decode(BLUE, held_bytes + red.pixels.bytes())?;
        Some([red, blue])
    }

    /// The memory for the frame that was read last and the work on it.
    pub(crate) fn memory_of_frame(&self) -> MemoryLimit {
        MemoryLimit::of_bytes(self.memory.bytes().saturating_sub(self.beside_bytes))
    }

    /// Whether there is room for the values of `frame`, which was read last, as floats beside it.
    pub(crate) fn check_floats(&self, frame: &Frame) -> Result<(), FrameError> {
        let budget = ReadBudget::new(self.memory_of_frame(), self.interrupt.clone());
        budget.hold(frame.pixels.bytes())?;
        budget.check_image(frame.size(), size_of::<f32>())
    }

    /// A budget for one frame, whose file is in `bytes`.
    pub(super) fn budget(&mut self, bytes: usize) -> Result<ReadBudget, FrameError> {
        self.beside_bytes = bytes as u64;
        let budget = ReadBudget::new(self.memory, self.interrupt.clone());
        budget.hold(self.beside_bytes)?;
        Ok(budget)
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
    files::open(path)
        .map_err(FrameError::from)
        .and_then(|file| {
            let length = file.metadata().map_or(0, |metadata| metadata.len());
            read_expected(file, length, page, buffers)
        })
        .map_err(|error| error.in_file(path))
}

/// Reads `stream` to its end and decodes image `page`, counted from 1; without `page`, the first. It
/// may take what the buffers say.
///
/// A stream that does not begin like an image is not read further: it may be endless.
/// # Errors
/// As [`decode_page`]; [`FrameError::Io`], [`FrameError::TooManyBytes`].
pub fn read_stream(
    stream: impl Read,
    page: Option<NonZeroUsize>,
    buffers: &mut Buffers,
) -> Result<Frame<'static>, FrameError> {
    read_expected(stream, 0, page, buffers)
}

/// Reads a stream of about `expected` bytes, and decodes an image of it.
fn read_expected(
    stream: impl Read,
    expected: u64,
    page: Option<NonZeroUsize>,
    buffers: &mut Buffers,
) -> Result<Frame<'static>, FrameError> {
    // Whatever was read before, this frame has all of the memory.
    buffers.forget();
    let mut bytes = std::mem::take(&mut buffers.bytes);
    let mut pixels = std::mem::take(&mut buffers.pixels);
    bytes.clear();
    bytes.shrink_to(usize::try_from(expected).unwrap_or(usize::MAX));
    let budget = buffers.budget(bytes.capacity())?;
    if expected > budget.left_bytes() / 2 {
        pixels = Vec::new();
    } else {
        pixels.clear();
        pixels.shrink_to(expected as usize / size_of::<u16>());
    }
    read_limited(stream, expected, &budget, &mut bytes)?;
    buffers.beside_bytes = bytes.capacity() as u64;
    let frame = decode_with(&bytes, page, &budget, pixels);
    buffers.bytes = bytes;
    buffers.color_page = budget.has_colors().then_some(page);
    frame
}

/// Reads all of `stream`, about `expected` bytes, into `bytes`, whose capacity is booked.
pub(super) fn read_limited(
    stream: impl Read,
    expected: u64,
    budget: &ReadBudget,
    bytes: &mut Vec<u8>,
) -> Result<(), FrameError> {
    let mut stream = budget.timed(stream);
    budget.reserve(bytes, HEAD_BYTES as usize)?;
    stream
        .by_ref()
        .take(HEAD_BYTES)
        .read_to_end(bytes)
        .map_err(|error| budget.why(error.into()))?;
    if FrameFormat::detect(bytes).is_none() {
        return Err(not_an_image(bytes));
    }
    let limit = MAX_FILE_BYTES;
    if expected > limit {
        return Err(FrameError::TooManyBytes { limit });
    }
    budget.reserve(bytes, expected as usize)?;
    let rest = (limit + 1).saturating_sub(bytes.len() as u64);
    budget.append(&mut stream.take(rest), bytes)?;
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
    if let Some(known) = unsupported_formats::detect(bytes) {
        return known.into();
    }
    FrameError::UnknownFormat {
        found: first_bytes(bytes),
    }
}

/// Decodes the first image in `bytes`.
/// # Errors
/// As [`decode_page`].
///
/// # Example
/// ```
/// use starpipe::frame;
///
/// let bytes = std::fs::read("fixtures/cygnus/cygnus.tif")?;
/// let frame = frame::decode(&bytes)?;
/// assert_eq!((frame.width, frame.height), (512, 384));
/// assert_eq!(frame.saturation_adu, Some(65535.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn decode(bytes: &[u8]) -> Result<Frame<'static>, FrameError> {
    decode_page(bytes, None)
}

/// Decodes image `page` in `bytes`, counted from 1; without `page`, the first.
/// # Errors
/// [`FrameError`], never [`FrameError::File`].
pub fn decode_page(bytes: &[u8], page: Option<NonZeroUsize>) -> Result<Frame<'static>, FrameError> {
    decode_page_with(bytes, page, &mut Buffers::new())
}

/// [`decode_page`] with buffers that say what it may take.
/// # Errors
/// As [`decode_page`].
pub fn decode_page_with(
    bytes: &[u8],
    page: Option<NonZeroUsize>,
    buffers: &mut Buffers,
) -> Result<Frame<'static>, FrameError> {
    let budget = buffers.budget(bytes.len())?;
    decode_with(bytes, page, &budget, std::mem::take(&mut buffers.pixels))
}

fn decode_with(
    bytes: &[u8],
    page: Option<NonZeroUsize>,
    budget: &ReadBudget,
    buffer: Vec<u16>,
) -> Result<Frame<'static>, FrameError> {
    no_panic(|| match FrameFormat::detect(bytes) {
        Some(format) if format.is_compressed() => {
            let content = compressed::unpack(bytes, format, budget)?;
            decode_image(&content, page, budget, buffer)
        }
        _ => decode_image(bytes, page, budget, buffer),
    })
}

/// Calls `decode`; a panic in it is an error of the file.
pub(super) fn no_panic<R>(decode: impl FnOnce() -> Result<R, FrameError>) -> Result<R, FrameError> {
    caught(decode).unwrap_or_else(|panicked| Err(panicked.into()))
}

/// Decodes one image that is not compressed as a file; `bytes` are booked. Its 16-bit pixels may be
/// stored in `buffer`.
pub(super) fn decode_image(
    bytes: &[u8],
    page: Option<NonZeroUsize>,
    budget: &ReadBudget,
    buffer: Vec<u16>,
) -> Result<Frame<'static>, FrameError> {
    let single = |read: fn(&[u8], &ReadBudget) -> Result<Frame<'static>, FrameError>| match page {
        Some(page) if page.get() > 1 => Err(FrameError::NoSuchPage { page, pages: 1 }),
        _ => read(bytes, budget),
    };
    let format = FrameFormat::detect(bytes);
    let buffer = match format {
        Some(FrameFormat::Tiff) => buffer,
        _ => Vec::new(),
    };
    match format {
        Some(FrameFormat::Fits) => fits::decode(bytes, page, budget),
        Some(FrameFormat::Tiff) => match unsupported_formats::raw_tiff(bytes) {
            Some(known) => Err(known.into()),
            None => tiff::decode(bytes, page, budget, buffer),
        },
        Some(FrameFormat::Png) => single(raster::decode_png),
        Some(FrameFormat::Jpeg) => single(jpeg::decode),
        Some(FrameFormat::Bmp) => single(raster::decode_bmp),
        Some(FrameFormat::Pnm) => single(raster::decode_pnm),
        Some(FrameFormat::Gzip | FrameFormat::Bzip2) | None => Err(not_an_image(bytes)),
    }
}
