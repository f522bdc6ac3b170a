//! Which image of a TIFF file is the frame?

use super::directory::{TiffDirectory, TiffFile, malformed};
use super::layout::{stated_size, tag};
use crate::frame::error::FrameError;
use crate::frame::limits::MAX_PAGES;
use crate::frame::metadata::ImageChoice;
use crate::frame::orientation::Orientation;
use crate::frame::read_budget::ReadBudget;
use std::num::NonZeroUsize;

/// The image that is read.
pub(super) struct Chosen<'a> {
    pub directory: TiffDirectory<'a>,
    /// The page that the image is, or belongs to.
    page: TiffDirectory<'a>,
    /// What was chosen, where it is not the first image.
    pub choice: Option<ImageChoice>,
}

/// An image of the file.
struct ImageCandidate<'a> {
    directory: TiffDirectory<'a>,
    page: TiffDirectory<'a>,
    /// Number of the page, from 1.
    number: usize,
    size_px: [usize; 2],
}

impl<'a> Chosen<'a> {
    /// Image `page` of the file, counted from 1.
    /// # Errors
    /// [`FrameError::NoSuchPage`]; as [`TiffFile::directories`].
    pub fn page(file: TiffFile<'a>, page: NonZeroUsize) -> Result<Self, FrameError> {
        let mut pages = 0;
        for directory in file.directories() {
            let directory = directory?;
            pages += 1;
            if pages == page.get() {
                return Ok(Self {
                    directory,
                    page: directory,
                    choice: None,
                });
            }
        }
        Err(FrameError::NoSuchPage { page, pages })
    }

    /// The largest image among the pages and those attached to them; of equally large ones, the
    /// first.
    /// # Errors
    /// As [`TiffFile::directories`], if there is no image before the error; [`FrameError::Interrupted`].
    pub fn largest(file: TiffFile<'a>, budget: &ReadBudget) -> Result<Self, FrameError> {
        let mut candidates = Vec::new();
        for (number, page) in (1..).zip(file.directories()) {
            budget.check_time()?;
            let page = match page {
                Ok(page) => page,
                Err(error) if number == 1 => return Err(error),
                // What is before it can be read.
                Err(_) => break,
            };
            let images = std::iter::once(page).chain(sub_directories(&page));
            let candidates_of_page = images.filter_map(|directory| {
                Some(ImageCandidate {
                    directory,
                    page,
                    number,
                    size_px: picture_size(&directory)?,
                })
            });
            candidates.extend(candidates_of_page);
            if candidates.len() >= MAX_PAGES {
                break;
            }
        }
        let area = |candidate: &ImageCandidate| {
            let [width, height] = candidate.size_px;
            width.saturating_mul(height)
        };
        let largest = candidates.iter().map(area).max();
        let (Some(first), Some(index)) = (
            candidates.first(),
            candidates.iter().position(|c| Some(area(c)) == largest),
        ) else {
            // A file of nothing but masks, or without a size: the error of its first page says more.
            let page = file.directories().next();
            let directory = page.unwrap_or_else(|| Err(malformed("no directory".to_owned())))?;
            return Ok(Self {
                directory,
                page: directory,
                choice: None,
            });
        };
        let largest = &candidates[index];
        let choice = (index > 0).then_some(ImageChoice {
            images: candidates.len(),
            page: largest.number,
            is_attached: largest.directory.place != largest.page.place,
            size_px: largest.size_px,
            first_px: first.size_px,
        });
        Ok(Self {
            directory: largest.directory,
            page: largest.page,
            choice,
        })
    }

    /// How the image is drawn: as it says, else as its page says.
    pub fn orientation(&self) -> Orientation {
        let of = |directory: &TiffDirectory| -> Option<Orientation> {
            let value = directory.first(tag::ORIENTATION, 0).ok()?;
            Orientation::of_tag(u32::try_from(value).ok()?)
        };
        of(&self.directory)
            .or_else(|| of(&self.page))
            .unwrap_or_default()
    }
}

/// The images attached to a page that can be found.
fn sub_directories<'a>(page: &TiffDirectory<'a>) -> impl Iterator<Item = TiffDirectory<'a>> {
    let file = page.file;
    let places = page.numbers(tag::SUB_IFDS).unwrap_or_default();
    let places = places.iter().take(MAX_PAGES);
    places.filter_map(move |place| file.directory(place).ok())
}

/// The size of the picture that a directory describes; `None` for masks, maps of depth, and
/// directories without a size.
fn picture_size(directory: &TiffDirectory) -> Option<[usize; 2]> {
    const MASK_OR_DEPTH: u64 = 4 | 8;
    let kind = directory.first(tag::NEW_SUBFILE_TYPE, 0).ok()?;
    let size = stated_size(directory).ok()?;
    (kind & MASK_OR_DEPTH == 0).then_some(size.sides())
}

/// Whether an image attached to a page is a picture and no raw data of a detector.
pub(in crate::frame) fn has_picture_in_sub_directories(page: &TiffDirectory) -> bool {
    const PICTURES: [u64; 4] = [0, 1, 2, 6];
    sub_directories(page).any(|directory| {
        let photometric = directory.first(tag::PHOTOMETRIC, u64::MAX);
        let is_picture = photometric.is_ok_and(|value| PICTURES.contains(&value));
        is_picture && picture_size(&directory).is_some()
    })
}
