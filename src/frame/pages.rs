//! All images of a file.

use super::error::FrameError;
use super::format::FrameFormat;
use super::image::Frame;
use super::limits::MAX_PAGES;
use super::read_budget::ReadBudget;
use super::reader::{Buffers, decode_image, no_panic, read_limited};
use super::{compressed, fits, tiff};
use crate::base::files;
use std::borrow::Cow;
use std::fmt;
use std::io::Read;
use std::num::NonZeroUsize;
use std::path::Path;
use std::str::FromStr;

/// The images of a file in order, each with its number from 1. The file is read and decompressed
/// once. An image that cannot be decoded is an error, and does not end the others.
#[derive(Debug)]
pub struct Pages {
    bytes: Vec<u8>,
    next: usize,
    count: usize,
    /// Why the images after the last that was counted cannot be found.
    broken: Option<FrameError>,
}

impl Pages {
    /// The images of the file `path`; this and each image may take what the buffers say.
    /// # Errors
    /// [`FrameError::File`] with the path and the error: as [`super::read`], and if the file has no
    /// image, or more than [`MAX_PAGES`].
    pub fn open(path: impl AsRef<Path>, buffers: &mut Buffers) -> Result<Self, FrameError> {
        let path = path.as_ref();
        let pages = match files::open(path) {
            Ok(file) => Self::read(file, buffers),
            Err(error) => Err(error.into()),
        };
        pages.map_err(|error| error.in_file(path))
    }

    /// The images of the file that `stream` gives.
    /// # Errors
    /// As [`Self::open`], without the path.
    pub fn read(stream: impl Read, buffers: &mut Buffers) -> Result<Self, FrameError> {
        let budget = buffers.budget(0)?;
        let mut bytes = Vec::new();
        read_limited(stream, 0, &budget, &mut bytes)?;
        Self::unpacked(bytes, &budget)
    }

    /// The images of the file whose content is `bytes`.
    /// # Errors
    /// As [`Self::open`], without the path.
    pub fn from_bytes(bytes: Vec<u8>, buffers: &mut Buffers) -> Result<Self, FrameError> {
        let budget = buffers.budget(bytes.capacity())?;
        Self::unpacked(bytes, &budget)
    }

    fn unpacked(bytes: Vec<u8>, budget: &ReadBudget) -> Result<Self, FrameError> {
        no_panic(|| Self::counted(bytes, budget))
    }

    fn counted(mut bytes: Vec<u8>, budget: &ReadBudget) -> Result<Self, FrameError> {
        if let Some(format) = FrameFormat::detect(&bytes).filter(|format| format.is_compressed()) {
            let packed = std::mem::take(&mut bytes);
            bytes = compressed::unpack(&packed, format, budget)?;
            budget.release(packed.capacity() as u64);
        }
        let format = FrameFormat::detect(&bytes);
        let (count, broken) = match format {
            Some(FrameFormat::Fits) => fits::count_pages(&bytes, budget),
            Some(FrameFormat::Tiff) => tiff::count_pages(&bytes, budget),
            _ => (1, None),
        };
        match (count, format) {
            // The error that reading the first image gives tells more.
            (0, _) => decode_image(&bytes, None, budget, Vec::new()).map(|_| ())?,
            (MAX_PAGES.., Some(format)) => {
                return Err(FrameError::Unsupported {
                    format,
                    found: format!("{MAX_PAGES} or more images in the file"),
                    expected: "fewer, or a page number that selects one",
                });
            }
            _ => {}
        }
        Ok(Self {
            bytes,
            next: 0,
            count,
            broken,
        })
    }

    /// How many images can be found.
    pub const fn count(&self) -> usize {
        self.count
    }

    /// The number of the next image; `None` after the last. Read it with [`Self::image`].
    pub fn advance(&mut self) -> Option<NonZeroUsize> {
        self.next += 1;
        let is_there = self.next <= self.count || self.broken.is_some();
        NonZeroUsize::new(self.next).filter(|_| is_there)
    }

    /// The image that [`Self::advance`] returned last, within the limits of the buffers.
    /// # Errors
    /// As [`super::decode_page`].
    pub fn image(&mut self, buffers: &mut Buffers) -> Result<Frame<'static>, FrameError> {
        if self.next > self.count
            && let Some(error) = self.broken.take()
        {
            return Err(error);
        }
        let budget = buffers.budget(self.bytes.capacity())?;
        let page = NonZeroUsize::new(self.next);
        let frame = no_panic(|| decode_image(&self.bytes, page, &budget, Vec::new()));
        if self.next == self.count && frame.is_err() {
            // What breaks the last image also hides what comes after it.
            self.broken = None;
        }
        frame
    }
}

/// Which image of a file with several is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PageChoice {
    /// The largest; of equal ones, the first.
    #[default]
    Main,
    /// That with this number, from 1.
    Number(NonZeroUsize),
    /// All of them.
    All,
}

impl PageChoice {
    /// The number, where one is chosen.
    pub const fn number(self) -> Option<NonZeroUsize> {
        match self {
            Self::Number(number) => Some(number),
            Self::Main | Self::All => None,
        }
    }
}

/// As on the command line: a number, or `all`.
impl FromStr for PageChoice {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text == "all" {
            return Ok(Self::All);
        }
        let number = text.parse().map(Self::Number);
        number.map_err(|_| "expected a number from 1, or all")
    }
}

/// The name of an image: that of its file, with the number of a page, as `night.fits[2]`.
#[derive(Debug, Clone, Copy)]
pub struct ImageName<'a> {
    /// The file.
    pub path: &'a Path,
    /// The image's number from 1, where all images of the file are meant.
    pub page: Option<NonZeroUsize>,
}

impl<'a> ImageName<'a> {
    /// The only image of `path` that is meant.
    pub const fn new(path: &'a Path) -> Self {
        Self { path, page: None }
    }

    /// Image number `page` of the file.
    pub const fn page(self, page: NonZeroUsize) -> Self {
        Self {
            page: Some(page),
            ..self
        }
    }

    /// The name as a path.
    pub fn to_path(&self) -> Cow<'a, Path> {
        let Some(page) = self.page else {
            return Cow::Borrowed(self.path);
        };
        let mut name = self.path.as_os_str().to_owned();
        name.push(format!("[{page}]"));
        Cow::Owned(name.into())
    }
}

impl fmt::Display for ImageName<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.to_path().display().fmt(formatter)
    }
}
