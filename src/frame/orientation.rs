//! How do the rows of a file lie in its picture? The `Orientation` of Exif and TIFF.
//!
//! Frames in memory are as the picture is drawn. What belongs to the detector (darks, flats, hot
//! pixels, its size) is about the file's own rows: [`Frame::with_stored`], [`Frame::into_stored`].
//!
//! # Reference
//! TIFF 6.0 (1992), sect. 8, tag 274; Exif 2.32 (CIPA DC-008-2019), table 4.

use super::image::Frame;
use super::pixels::Pixels;
use std::borrow::Cow;
use std::fmt;

/// How a file's rows and columns are turned and mirrored to give the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Orientation {
    /// Whether the file's rows are the picture's columns. This comes first.
    is_transposed: bool,
    /// Whether left and right are then exchanged.
    is_flipped_x: bool,
    /// Whether top and bottom are then exchanged.
    is_flipped_y: bool,
}

impl Orientation {
    /// The orientation with this value of the tag; `None` for values that it does not have, which
    /// viewers ignore.
    pub fn of_tag(value: u32) -> Option<Self> {
        let (is_transposed, is_flipped_x, is_flipped_y) = match value {
            1 => (false, false, false),
            2 => (false, true, false),
            3 => (false, true, true),
            4 => (false, false, true),
            5 => (true, false, false),
            6 => (true, true, false),
            7 => (true, true, true),
            8 => (true, false, true),
            _ => return None,
        };
        Some(Self {
            is_transposed,
            is_flipped_x,
            is_flipped_y,
        })
    }

    /// The value of the tag.
    pub fn tag(self) -> u32 {
        match (self.is_transposed, self.is_flipped_x, self.is_flipped_y) {
            (false, false, false) => 1,
            (false, true, false) => 2,
            (false, true, true) => 3,
            (false, false, true) => 4,
            (true, false, false) => 5,
            (true, true, false) => 6,
            (true, true, true) => 7,
            (true, false, true) => 8,
        }
    }

    /// Whether the picture is drawn as it is stored.
    pub fn is_upright(self) -> bool {
        self == Self::default()
    }

    /// What leads from the picture back to the file's rows.
    fn inverse(self) -> Self {
        if !self.is_transposed {
            return self;
        }
        Self {
            is_flipped_x: self.is_flipped_y,
            is_flipped_y: self.is_flipped_x,
            ..self
        }
    }

    /// The values of rows of `width`, turned; in place where rows stay rows.
    fn turn<T: Copy>(self, values: &mut Cow<'_, [T]>, width: usize) {
        let mut row_px = width;
        if self.is_transposed {
            let height = values.len() / width;
            *values = Cow::Owned(transposed(values, width));
            row_px = height;
        }
        match (self.is_flipped_x, self.is_flipped_y) {
            (false, false) => {}
            (true, true) => values.to_mut().reverse(),
            (true, false) => {
                let rows = values.to_mut().chunks_exact_mut(row_px);
                rows.for_each(<[T]>::reverse);
            }
            (false, true) => {
                values.to_mut().reverse();
                let rows = values.to_mut().chunks_exact_mut(row_px);
                rows.for_each(<[T]>::reverse);
            }
        }
    }
}

/// What the picture is, relative to the rows of its file.
impl fmt::Display for Orientation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.tag() {
            2 => "mirrored left to right",
            3 => "turned by 180°",
            4 => "mirrored top to bottom",
            5 => "turned by 90° clockwise and mirrored left to right",
            6 => "turned by 90° clockwise",
            7 => "turned by 90° clockwise and mirrored top to bottom",
            8 => "turned by 90° counterclockwise",
            _ => "as stored",
        })
    }
}

/// The columns of `values` as rows, in squares that stay in the cache.
fn transposed<T: Copy>(values: &[T], width: usize) -> Vec<T> {
    const SQUARE_PX: usize = 32;
    let height = values.len() / width;
    let mut out = values.to_vec();
    for top in (0..height).step_by(SQUARE_PX) {
        for left in (0..width).step_by(SQUARE_PX) {
            for x in left..width.min(left + SQUARE_PX) {
                for y in top..height.min(top + SQUARE_PX) {
                    out[x * height + y] = values[y * width + x];
                }
            }
        }
    }
    out
}

impl Frame<'_> {
    /// Width and height of the file's rows.
    pub fn stored_size(&self) -> [usize; 2] {
        if self.metadata.orientation.is_transposed {
            [self.height, self.width]
        } else {
            [self.width, self.height]
        }
    }

    /// Does `work` with the frame in the rows of its file, and then turns it back to the picture.
    pub fn with_stored<R>(&mut self, work: impl FnOnce(&mut Self) -> R) -> R {
        let orientation = self.metadata.orientation;
        self.turn(orientation.inverse());
        let result = work(self);
        self.turn(orientation);
        result
    }

    /// The frame in the rows of its file, as the detector recorded it.
    #[must_use]
    pub fn into_stored(mut self) -> Self {
        let orientation = std::mem::take(&mut self.metadata.orientation);
        self.turn(orientation.inverse());
        self
    }

    /// The picture, of pixels in the rows of the file.
    pub(crate) fn drawn(mut self) -> Self {
        self.turn(self.metadata.orientation);
        self
    }

    fn turn(&mut self, orientation: Orientation) {
        let width = self.width;
        match &mut self.pixels {
            Pixels::U8(values) => orientation.turn(values, width),
            Pixels::U16(values) => orientation.turn(values, width),
            Pixels::F32(values) => orientation.turn(values, width),
        }
        if orientation.is_transposed {
            std::mem::swap(&mut self.width, &mut self.height);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Where the file's first row, and its first column, are in the picture (TIFF 6.0, tag 274).
    const FIRST_ROW_AND_COLUMN: [(&str, &str); 8] = [
        ("top", "left"),
        ("top", "right"),
        ("bottom", "right"),
        ("bottom", "left"),
        ("left", "top"),
        ("right", "top"),
        ("right", "bottom"),
        ("left", "bottom"),
    ];

    fn stored(width: usize, height: usize, orientation: Orientation) -> Frame<'static> {
        let values: Vec<u16> = (0..(width * height) as u16).collect();
        let mut frame = Frame::from_samples(width, height, values).unwrap();
        frame.metadata.orientation = orientation;
        frame
    }

    #[test]
    fn first_row_and_first_column_are_where_the_standard_says() {
        for (tag, (row, column)) in (1..).zip(FIRST_ROW_AND_COLUMN) {
            let orientation = Orientation::of_tag(tag).unwrap();
            let (width, height) = (40, 5);
            let frame = stored(width, height, orientation).drawn();
            let edge = |side: &str| -> Vec<usize> {
                let (w, h) = (frame.width, frame.height);
                let at = |x: usize, y: usize| frame.at(x, y) as usize;
                match side {
                    "top" => (0..w).map(|x| at(x, 0)).collect(),
                    "bottom" => (0..w).map(|x| at(x, h - 1)).collect(),
                    "left" => (0..h).map(|y| at(0, y)).collect(),
                    _ => (0..h).map(|y| at(w - 1, y)).collect(),
                }
            };
            let sorted = |side: &str| {
                let mut values = edge(side);
                values.sort_unstable();
                values
            };
            let first_row: Vec<usize> = (0..width).collect();
            let first_column: Vec<usize> = (0..height).map(|y| y * width).collect();
            assert_eq!(sorted(row), first_row, "{tag}");
            assert_eq!(sorted(column), first_column, "{tag}");
            assert_eq!(orientation.tag(), tag);
        }
        assert_eq!([0, 9, 65_535].map(Orientation::of_tag), [None; 3]);
    }

    proptest! {
        #[test]
        fn every_turn_is_undone(tag in 1_u32..=8, width in 3_usize..80, height in 3_usize..80) {
            let orientation = Orientation::of_tag(tag).unwrap();
            let before = stored(width, height, orientation);
            let mut drawn = before.clone().drawn();
            prop_assert_eq!(drawn.stored_size(), [width, height]);
            let seen = drawn.with_stored(|frame| frame.clone());
            prop_assert_eq!(&seen, &before);
            prop_assert_eq!(&drawn, &before.clone().drawn());
            let mut back = drawn.into_stored();
            back.metadata.orientation = orientation;
            prop_assert_eq!(back, before);
        }
    }
}
