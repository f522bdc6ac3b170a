//! TIFF: its images, how each is stored, and their samples.
//!
//! Grey or color, with or without alpha; in strips or tiles, interleaved or plane by plane; unsigned
//! integers of 1 to 32 or 64 bits, signed ones of 8 to 64, floats of 16 to 64. The layout is known
//! before anything is decoded: what is not read is refused by its name.
//!
//! # Reference
//! TIFF 6.0 (1992); Adobe Photoshop TIFF Technical Notes 2 and 3 (JPEG, floats); BigTIFF as in libtiff.

mod chosen;
mod decompress;
mod directory;
mod layout;
mod samples;
mod write;

use super::error::FrameError;
use super::exif;
use super::image::Frame;
use super::levels::{
    LevelSamples, WholeNumber, frame_from_floats, frame_from_integers, frame_from_words,
};
use super::limits::MAX_PAGES;
use super::read_budget::ReadBudget;
use crate::base::size::Size;
use chosen::Chosen;
use decompress::ChunkSource;
use layout::{Color, Layout, SampleFormat};
use samples::float_of_half;
use std::num::NonZeroUsize;

pub(super) use chosen::has_picture_in_sub_directories;
pub(super) use directory::TiffFile;
pub use write::{TiffOptions, TiffSamples, write_tiff};

/// Decodes image `page` of a TIFF file, counted from 1; without `page`, the largest.
/// # Errors
/// As [`super::reader::decode_page`].
pub(super) fn decode(
    bytes: &[u8],
    page: Option<NonZeroUsize>,
    budget: &ReadBudget,
    buffer: Vec<u16>,
) -> Result<Frame<'static>, FrameError> {
    let file = TiffFile::parse(bytes)?;
    let chosen = match page {
        Some(page) => Chosen::page(file, page)?,
        None => Chosen::largest(file, budget)?,
    };
    let layout = Layout::parse(&chosen.directory)?;
    let size = Size::new(layout.width, layout.height);
    budget.check_image(size, layout.bytes_per_pixel())?;
    let frame = match layout.plain_words() {
        Some((start, length)) => {
            let words = file.range(start, length)?.as_chunks().0;
            frame_from_words(size, words, !file.is_little_endian, buffer)
        }
        None => {
            drop(buffer);
            layout.frame(ChunkSource { file, budget })
        }
    };
    let mut metadata = exif::metadata(bytes, layout.width);
    metadata.orientation = chosen.orientation();
    metadata.choice = chosen.choice;
    Ok(frame?.with_metadata(metadata).drawn())
}

/// The number of images in a TIFF file, at most [`MAX_PAGES`], and why there may be more that cannot
/// be found.
pub(super) fn count_pages(bytes: &[u8], budget: &ReadBudget) -> (usize, Option<FrameError>) {
    let file = match TiffFile::parse(bytes) {
        Ok(file) => file,
        Err(error) => return (0, Some(error)),
    };
    let mut pages = 0;
    for directory in file.directories().take(MAX_PAGES) {
        if let Err(error) = directory.and_then(|_| budget.check_time()) {
            return (pages, Some(error));
        }
        pages += 1;
    }
    (pages, None)
}

impl Layout<'_> {
    fn frame(&self, source: ChunkSource) -> Result<Frame<'static>, FrameError> {
        let budget = source.budget;
        let full = self.depth.full_scale();
        // Values of more than 24 bits are rounded.
        let rounded = |values: Vec<f32>| Ok(self.floats(values, budget)?.with_levels(1.0, None));
        match (self.depth.format, self.depth.bits) {
            (SampleFormat::Unsigned, ..=8) => {
                self.integers(&self.samples::<u8>(source)?, full as u8, budget)
            }
            (SampleFormat::Unsigned, ..=16) => {
                self.integers(&self.samples::<u16>(source)?, full as u16, budget)
            }
            (SampleFormat::Unsigned, ..=32) => {
                self.integers(&self.samples::<u32>(source)?, full as u32, budget)
            }
            (SampleFormat::Unsigned, _) => rounded(self.samples_as(source, |v: u64| v as f32)?),
            (SampleFormat::Signed, ..=8) => {
                self.integers(&self.samples_as(source, |v: u8| v as i8)?, i8::MAX, budget)
            }
            (SampleFormat::Signed, ..=16) => self.integers(
                &self.samples_as(source, |v: u16| v as i16)?,
                i16::MAX,
                budget,
            ),
            (SampleFormat::Signed, ..=32) => self.integers(
                &self.samples_as(source, |v: u32| v as i32)?,
                i32::MAX,
                budget,
            ),
            (SampleFormat::Signed, _) => {
                rounded(self.samples_as(source, |v: u64| v as i64 as f32)?)
            }
            (SampleFormat::Float, ..=16) => {
                self.floats(self.samples_as(source, float_of_half)?, budget)
            }
            (SampleFormat::Float, ..=32) => {
                self.floats(self.samples_as(source, f32::from_bits)?, budget)
            }
            (SampleFormat::Float, _) => self.floats(
                self.samples_as(source, |v: u64| f64::from_bits(v) as f32)?,
                budget,
            ),
        }
    }

    /// The samples, each made of its bits by `of`.
    fn samples_as<T: samples::Word, S>(
        &self,
        source: ChunkSource,
        of: impl Fn(T) -> S,
    ) -> Result<Vec<S>, FrameError> {
        Ok(self.samples(source)?.into_iter().map(of).collect())
    }

    fn integers<T: WholeNumber>(
        &self,
        values: &[T],
        full_scale: T,
        budget: &ReadBudget,
    ) -> Result<Frame<'static>, FrameError> {
        let samples = LevelSamples {
            width: self.width,
            height: self.height,
            values,
            channels: self.channels,
        };
        frame_from_integers(&samples, full_scale, budget)
    }

    fn floats(
        &self,
        mut values: Vec<f32>,
        budget: &ReadBudget,
    ) -> Result<Frame<'static>, FrameError> {
        if self.color == Color::WhiteIsZero {
            values.iter_mut().for_each(|value| *value = 1.0 - *value);
        }
        let size = Size::new(self.width, self.height);
        frame_from_floats(size, self.channels, values, budget)
    }
}

#[cfg(test)]
mod tests;
