//! Frames between the rows of their file and the picture that it is drawn as.

use super::image::Frame;
use super::orientation::Orientation;
use super::pixels::Pixels;
use crate::base::size::Size;

impl Frame<'_> {
    /// Width and height of the file's rows.
    pub fn stored_size(&self) -> Size {
        if self.metadata.orientation.is_transposed {
            Size::new(self.height, self.width)
        } else {
            self.size()
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
            prop_assert_eq!(drawn.stored_size(), Size::new(width, height));
            let seen = drawn.with_stored(|frame| frame.clone());
            prop_assert_eq!(&seen, &before);
            prop_assert_eq!(&drawn, &before.clone().drawn());
            let mut back = drawn.into_stored();
            back.metadata.orientation = orientation;
            prop_assert_eq!(back, before);
        }
    }
}
