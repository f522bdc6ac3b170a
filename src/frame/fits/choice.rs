//! Which image of a file is read: the page asked for, or else the largest.

use super::error::unsupported;
use super::layout::FitsLayout;
use super::unit::{FitsUnit, Units};
use crate::frame::read_budget::ReadBudget;
use crate::frame::{Assumption, FrameError, ImageChoice, MIN_SIDE_PX};
use std::num::NonZeroUsize;

/// The image that is read.
pub(super) struct ChosenFitsImage<'a> {
    pub unit: FitsUnit<'a>,
    pub layout: FitsLayout,
    /// Its plane in the unit, if a page was asked for.
    pub plane: Option<usize>,
    /// Which image it is, if no page was asked for and it is not the first.
    pub image: Option<ImageChoice>,
    /// What is assumed of it, if no page was asked for.
    pub assumed: Option<Assumption>,
}

impl<'a> ChosenFitsImage<'a> {
    /// Image `page` of a file, counted from 1; without `page`, the largest that can be read alone,
    /// and of several of that size the first.
    pub fn of(
        bytes: &'a [u8],
        page: Option<NonZeroUsize>,
        budget: &ReadBudget,
    ) -> Result<Self, FrameError> {
        match page {
            Some(page) => Self::page(bytes, page, budget),
            None => Self::largest(bytes, budget),
        }
    }

    fn page(bytes: &'a [u8], page: NonZeroUsize, budget: &ReadBudget) -> Result<Self, FrameError> {
        let mut pages = 0;
        let mut units = Units::new(bytes);
        while let Some(unit) = units.next()? {
            budget.check_time()?;
            let plane = page.get() - 1 - pages;
            match unit.layout() {
                Some(layout) if plane < layout.pages => {
                    return Ok(Self {
                        unit,
                        layout,
                        plane: Some(plane),
                        image: None,
                        assumed: None,
                    });
                }
                layout => pages += layout.map_or(0, |layout| layout.pages),
            }
        }
        Err(match pages {
            0 => no_image(bytes),
            _ => FrameError::NoSuchPage { page, pages },
        })
    }

    fn largest(bytes: &'a [u8], budget: &ReadBudget) -> Result<Self, FrameError> {
        let mut pages = 0_usize;
        let mut first: Option<FitsLayout> = None;
        let mut best: Option<(FitsUnit, FitsLayout, usize)> = None;
        let mut units = Units::new(bytes);
        loop {
            budget.check_time()?;
            let unit = match units.next() {
                Ok(Some(unit)) => unit,
                Err(error) if best.is_none() => return Err(error),
                // What is damaged behind an image does not matter to it.
                Ok(None) | Err(_) => break,
            };
            let Some(layout) = unit.layout() else {
                continue;
            };
            first.get_or_insert(layout);
            let is_better = best
                .as_ref()
                .is_none_or(|(_, best, _)| size(layout) > size(*best));
            let page = pages.saturating_add(1);
            pages = pages.saturating_add(layout.pages);
            if is_better {
                best = Some((unit, layout, page));
            }
        }
        let (Some((unit, layout, page)), Some(first)) = (best, first) else {
            return Err(no_image(bytes));
        };
        let image = (page > 1).then_some(ImageChoice {
            images: pages,
            page,
            is_attached: false,
            size_px: [layout.width, layout.height],
            first_px: [first.width, first.height],
        });
        let has_planes = layout.pages > 1 && !layout.is_cube();
        Ok(Self {
            unit,
            layout,
            plane: None,
            image,
            assumed: has_planes.then_some(Assumption::FourPlanes),
        })
    }
}

/// Number of pixels of an image that can be read alone; 0 for a cube, and for what is too small.
fn size(layout: FitsLayout) -> usize {
    let is_small = layout.width.min(layout.height) < MIN_SIDE_PX;
    if layout.is_cube() || is_small {
        0
    } else {
        layout.width.saturating_mul(layout.height)
    }
}

/// The error for a file without an image.
fn no_image(bytes: &[u8]) -> FrameError {
    let mut units = Units::new(bytes);
    let mut tables = 0;
    while let Ok(Some(unit)) = units.next() {
        tables += usize::from(unit.is_table());
    }
    let plural = if tables == 1 { "" } else { "s" };
    unsupported(
        format!("no image in it, and {tables} table{plural}"),
        "an image of two axes in the primary header-data unit or an extension",
    )
}
