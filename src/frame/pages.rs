//! All images of a file.

use super::error::FrameError;
use super::format::FrameFormat;
use super::image::Frame;
use super::limits::{MAX_FILE_BYTES, MAX_PAGES};
use super::memory::MemoryLimit;
use super::reader::{decode_image, read_limited};
use super::{compressed, fits, tiff};
use crate::base::files;
use std::io::Read;
use std::num::NonZeroUsize;
use std::path::Path;

/// The images of a file in order, each with its number from 1. The file is read and decompressed
/// once. An image that cannot be decoded is an error, and does not end the others.
#[derive(Debug)]
pub struct Pages {
    bytes: Vec<u8>,
    memory: MemoryLimit,
    next: usize,
    count: usize,
    /// Why the images after the last that was counted cannot be found.
    broken: Option<FrameError>,
}

impl Pages {
    /// The images of the file `path`; each may take as much memory as `memory`.
    /// # Errors
    /// [`FrameError::File`] with the path and the error: as [`super::read`], and if the file has no
    /// image, or more than [`MAX_PAGES`].
    pub fn open(path: impl AsRef<Path>, memory: MemoryLimit) -> Result<Self, FrameError> {
        let path = path.as_ref();
        let open = || Self::read(files::open(path)?, memory);
        open().map_err(|error| error.in_file(path))
    }

    /// The images of the file that `stream` gives.
    /// # Errors
    /// As [`Self::open`], without the path.
    pub fn read(stream: impl Read, memory: MemoryLimit) -> Result<Self, FrameError> {
        let mut bytes = Vec::new();
        read_limited(stream, 0, MAX_FILE_BYTES, &mut bytes)?;
        Self::of(bytes, memory)
    }

    /// The images of the file whose content is `bytes`.
    /// # Errors
    /// As [`Self::open`], without the path.
    pub fn of(mut bytes: Vec<u8>, memory: MemoryLimit) -> Result<Self, FrameError> {
        if let Some(format) = FrameFormat::of(&bytes).filter(|format| format.is_compressed()) {
            bytes = compressed::unpack(&bytes, format, memory.content_bytes())?;
        }
        let format = FrameFormat::of(&bytes);
        let (count, broken) = match format {
            Some(FrameFormat::Fits) => fits::count_pages(&bytes),
            Some(FrameFormat::Tiff) => tiff::count_pages(&bytes),
            _ => (1, None),
        };
        match (count, format) {
            // The error that reading the first image gives tells more.
            (0, _) => decode_image(&bytes, None, memory, &mut Vec::new()).map(|_| ())?,
            (MAX_PAGES.., Some(format)) => {
                return Err(FrameError::Unsupported {
                    format,
                    found: format!("{MAX_PAGES} images or more in it"),
                    expected: "fewer, or a page that says which",
                });
            }
            _ => {}
        }
        Ok(Self {
            bytes,
            memory,
            next: 0,
            count,
            broken,
        })
    }
}

impl Iterator for Pages {
    type Item = (NonZeroUsize, Result<Frame<'static>, FrameError>);

    fn next(&mut self) -> Option<Self::Item> {
        self.next += 1;
        let page = NonZeroUsize::new(self.next)?;
        if self.next > self.count {
            return self.broken.take().map(|error| (page, Err(error)));
        }
        let frame = decode_image(&self.bytes, Some(page), self.memory, &mut Vec::new());
        if self.next == self.count && frame.is_err() {
            // What breaks the last image also hides what comes after it.
            self.broken = None;
        }
        Some((page, frame))
    }
}
