//! The pixels that no light reaches, which a header names: `BIASSEC = '[x1:x2,y1:y2]'`, counted from 1, both
//! ends included (IRAF; NOAO Image Keyword Dictionary).

use super::keywords::Keywords;
use crate::base::statistics::median_of_rounded;
use crate::frame::error::FrameError;
use crate::frame::image::Frame;
use crate::frame::metadata::FrameMetadata;
use crate::frame::read_budget::ReadBudget;
use std::ops::Range;

const KEYWORD: &str = "BIASSEC";

/// A part of an image as it is stored.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Section {
    columns: Range<usize>,
    rows: Range<usize>,
}

/// Measures the level of these pixels, if `keywords` name some; from then on they have no value.
///
/// # Errors
/// [`FrameError::TooMuchMemory`] if there is no room for pixels without a value.
pub(super) fn take(
    frame: &mut Frame<'static>,
    keywords: &Keywords,
    metadata: &mut FrameMetadata,
    budget: &ReadBudget,
) -> Result<(), FrameError> {
    let Some(text) = keywords.text(KEYWORD) else {
        return Ok(());
    };
    let Some(section) = Section::parse(&text).filter(|section| section.is_part_of(frame)) else {
        metadata.ignore(KEYWORD, &text, "[x1:x2,y1:y2], at most half of the image");
        return Ok(());
    };
    budget.check_image(frame.size(), size_of::<f32>())?;
    let (width, step_adu) = (frame.width, f64::from(frame.step_adu));
    let pixels = frame.values_mut();
    let mut levels = Vec::new();
    for y in section.rows {
        for pixel in &mut pixels[y * width..][section.columns.clone()] {
            levels.push(f64::from(std::mem::replace(pixel, f32::NAN)));
        }
    }
    levels.retain(|level| !level.is_nan());
    metadata.dark_level_adu =
        (!levels.is_empty()).then(|| median_of_rounded(&mut levels, step_adu));
    Ok(())
}

impl Section {
    fn parse(text: &str) -> Option<Self> {
        let text = text.trim().strip_prefix('[')?.strip_suffix(']')?;
        let (columns, rows) = text.split_once(',')?;
        let range = |text: &str| {
            let (from, to) = text.split_once(':')?;
            let number = |text: &str| text.trim().parse::<usize>().ok();
            let (from, to) = (number(from)?, number(to)?);
            // Either may come first.
            let (first, last) = (from.min(to), from.max(to));
            Some(first.checked_sub(1)?..last)
        };
        Some(Self {
            columns: range(columns)?,
            rows: range(rows)?,
        })
    }

    /// Whether it lies in an image and leaves half of it.
    fn is_part_of(&self, frame: &Frame) -> bool {
        let is_inside = self.columns.end <= frame.width && self.rows.end <= frame.height;
        is_inside && 2 * self.columns.len() * self.rows.len() <= frame.size().pixels()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_count_from_one_in_either_direction() {
        let expected = Section {
            columns: 0..3,
            rows: 4..10,
        };
        for text in ["[1:3,5:10]", " [ 3:1 , 10:5 ] "] {
            assert_eq!(Section::parse(text), Some(expected.clone()));
        }
        for text in [
            "",
            "[]",
            "[*,1:2]",
            "[0:3,1:2]",
            "[1:3]",
            "[1:3,-1:2]",
            "1:3,1:2",
        ] {
            assert_eq!(Section::parse(text), None, "{text}");
        }
    }
}
