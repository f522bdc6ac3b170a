//! How do the rows of a file lie in its picture? The `Orientation` of Exif and TIFF.
//!
//! Frames in memory are as the picture is drawn. What belongs to the detector (darks, flats, hot
//! pixels, its size) is about the file's own rows.
//!
//! # Reference
//! TIFF 6.0 (1992), sect. 8, tag 274; Exif 2.32 (CIPA DC-008-2019), table 4.

use std::borrow::Cow;
use std::fmt;

/// How a file's rows and columns are turned and mirrored to give the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Orientation {
    /// Whether the file's rows are the picture's columns. This comes first.
    pub(super) is_transposed: bool,
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
    pub(super) fn inverse(self) -> Self {
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
    pub(super) fn turn<T: Copy>(self, values: &mut Cow<'_, [T]>, width: usize) {
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
