//! FITS: images of any BITPIX in the primary header-data unit or an extension, in one plane or in
//! color, whichever axis the colors are on ([`layout`]). Of several images the largest is read if
//! none is chosen ([`choice`]).
//!
//! Levels are BZERO + BSCALE × stored value. Integers that BZERO turns into unsigned ones (32768,
//! and its equivalents for 8 and 32 bits) are exact and saturate at the largest value. Those of 64
//! bits are exact, too. Other scaled integers have a step of BSCALE and no saturation. A header may
//! state the saturation level ([`keywords`]). BLANK and NaN mark pixels without a value; a BLANK that
//! no pixel can have is ignored. Images compressed tile by tile (ZIMAGE) are read as if they were not
//! compressed ([`tiles`]). Rows are stored bottom-up unless ROWORDER is TOP-DOWN.
//!
//! This is a reader of our own. Of the crates under a permissive licence, `fitsrs` 0.4.1 and
//! `fitsio-pure` 0.25.0 both panic on some damaged headers, and `fitsrs` returns the beginning of a
//! truncated image without an error.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sections 3 to 5 and 7.1.

mod calendar;
mod cards;
mod choice;
mod dates;
mod error;
mod header;
mod image;
mod keywords;
mod layout;
mod overscan;
mod tiles;
mod time_scale;
mod unit;
mod write;

pub use cards::FitsHeader;
pub(crate) use header::BLOCK_BYTES;
pub(crate) use write::write_rows;
pub use write::{FitsSamples, FitsWriteError, write_fits};

use super::error::FrameError;
use super::image::Frame;
use super::read_budget::ReadBudget;
use choice::ChosenFitsImage;
use header::UnitHeader;
use image::FitsImage;
use keywords::Keywords;
use std::num::NonZeroUsize;
use unit::Units;

/// Decodes image `page` of a FITS file, counted from 1; without `page`, the largest, and of several
/// of that size the first.
/// # Errors
/// As [`super::reader::decode_page`].
pub(super) fn decode(
    bytes: &[u8],
    page: Option<NonZeroUsize>,
    budget: &ReadBudget,
) -> Result<Frame<'static>, FrameError> {
    let ChosenFitsImage {
        unit,
        layout,
        plane,
        image: choice,
        assumed,
    } = ChosenFitsImage::of(bytes, page, budget)?;
    let image = FitsImage::new(&unit, layout, plane, budget)?;
    // The primary header holds the keywords that are common to all units.
    let (primary, _) = UnitHeader::parse(bytes, 0)?;
    let keywords = Keywords::new([&unit.header, &primary].into_iter());
    let mut metadata = keywords::metadata(&keywords);
    metadata.ignored.extend(unit.ignored_blanks());
    metadata.choice = choice;
    metadata.assumed.extend(assumed);
    let mut frame = image.frame(&unit, bytes)?;
    overscan::take(&mut frame, &keywords, &mut metadata, budget)?;
    if let Some(stated) = keywords::saturation(&keywords) {
        stated.apply(&mut frame, &mut metadata);
    }
    Ok(frame.with_metadata(metadata).upright())
}

/// The number of images in a FITS file, and why there may be more that cannot be found.
pub(super) fn count_pages(bytes: &[u8], budget: &ReadBudget) -> (usize, Option<FrameError>) {
    let (mut pages, mut units) = (0_usize, Units::new(bytes));
    loop {
        let unit = budget.check_time().and_then(|()| units.next());
        match unit {
            Ok(Some(unit)) => pages = pages.saturating_add(unit.pages()),
            Ok(None) => return (pages, None),
            Err(error) => return (pages, Some(error)),
        }
    }
}

#[cfg(test)]
mod tests;
