//! FITS: images of any BITPIX in the primary header-data unit or an extension, in one plane or in
//! three of colour.
//!
//! Levels are BZERO + BSCALE × stored value. Integers that BZERO turns into unsigned ones (32768,
//! and its equivalents for 8 and 32 bits) are exact and saturate at the largest value. Other scaled
//! integers have a step of BSCALE and no saturation. A header may state the saturation level
//! ([`keywords`]). BLANK and NaN mark pixels without a value. Images compressed tile by tile
//! (ZIMAGE) are read as if they were not compressed ([`tiles`]). Rows are stored bottom-up unless
//! ROWORDER is TOP-DOWN.
//!
//! This is a reader of our own. Of the crates under a permissive licence, `fitsrs` 0.4.1 and
//! `fitsio-pure` 0.25.0 both panic on some damaged headers, and `fitsrs` returns the beginning of a
//! truncated image without an error.
//!
//! # Reference
//! FITS Standard 4.0 (2018), sections 3 to 5 and 7.1.

mod cards;
mod error;
mod header;
mod image;
mod keywords;
mod tiles;
mod unit;
mod write;

pub use cards::FitsHeader;
pub use write::{FitsSamples, FitsWriteError, write_fits};

use super::account::Account;
use super::error::FrameError;
use super::format::FrameFormat;
use super::image::Frame;
use image::Image;
use std::num::NonZeroUsize;
use unit::Units;

/// Decodes image `page` of a FITS file, counted from 1; without `page`, the first.
/// # Errors
/// As [`super::reader::decode_page`].
pub(super) fn decode(
    bytes: &[u8],
    page: Option<NonZeroUsize>,
    account: &Account,
) -> Result<Frame<'static>, FrameError> {
    let (mut pages, mut tables) = (0, 0);
    let mut units = Units::new(bytes);
    // The primary header holds the keywords that are common to all units.
    let mut primary = None;
    while let Some(unit) = units.next()? {
        account.check_time()?;
        let plane = page.map_or(0, |page| page.get() - 1 - pages);
        if plane < unit.pages() {
            let image = Image::new(&unit, page.map(|_| plane), account)?;
            let headers = [Some(&unit.header), primary.as_ref()];
            let mut metadata = keywords::metadata(headers.into_iter().flatten());
            let stated = keywords::saturation(headers.into_iter().flatten());
            let mut frame = image.frame(&unit, bytes, account)?;
            if let Some(stated) = stated {
                stated.apply(&mut frame, &mut metadata);
            }
            return Ok(frame.with_metadata(metadata).upright());
        }
        pages += unit.pages();
        tables += usize::from(unit.is_table());
        primary.get_or_insert(unit.header);
    }
    match page {
        Some(page) if pages > 0 => Err(FrameError::NoSuchPage { page, pages }),
        _ => Err(FrameError::Unsupported {
            format: FrameFormat::Fits,
            found: format!(
                "no image in it, and {tables} table{}",
                if tables == 1 { "" } else { "s" }
            ),
            expected: "an image of two axes in the primary header-data unit or an extension",
        }),
    }
}

/// The number of images in a FITS file, and why there may be more that cannot be found.
pub(super) fn count_pages(bytes: &[u8], account: &Account) -> (usize, Option<FrameError>) {
    let (mut pages, mut units) = (0_usize, Units::new(bytes));
    loop {
        let unit = account.check_time().and_then(|()| units.next());
        match unit {
            Ok(Some(unit)) => pages = pages.saturating_add(unit.pages()),
            Ok(None) => return (pages, None),
            Err(error) => return (pages, Some(error)),
        }
    }
}

#[cfg(test)]
mod tests;
