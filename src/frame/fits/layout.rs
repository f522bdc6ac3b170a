//! Which axes of a header-data unit are columns, rows, colors and planes.
//!
//! Axes of length 1 are skipped. Of three axes that remain, the only one of length 3 or 4 is that of
//! the colors, wherever it stands: NAXIS3 (plane by plane), NAXIS1 (pixel by pixel, as arrays of
//! pictures are saved) or NAXIS2. All other axes after the second count planes.

/// Number of color channels, with and without a fourth that is not used.
const COLORS: [usize; 2] = [3, 4];

/// The axes of one image, or of several planes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FitsLayout {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// 1, or 3 or 4 for color.
    pub channels: usize,
    /// Number of images, of which one is to be chosen. Three planes are one image of three channels;
    /// four are one image if none of them is chosen.
    pub pages: usize,
    /// Distance in the data between neighboring columns, rows and channels.
    strides: [usize; 3],
}

impl FitsLayout {
    /// The layout of these axes; `None` if there are fewer than two or one is empty.
    pub fn from_axes(axes: &[usize]) -> Option<Self> {
        if axes.len() < 2 || axes.contains(&0) {
            return None;
        }
        let long: Vec<usize> = axes.iter().copied().filter(|axis| *axis > 1).collect();
        let used = if long.len() < 2 { axes } else { &long };
        let of_colors = |axis: &usize| COLORS.contains(axis);
        let only_one = used.iter().filter(|axis| of_colors(axis)).count() == 1;
        Some(match *used {
            [channels, width, height] if only_one && of_colors(&channels) => Self {
                width,
                height,
                channels,
                pages: 1,
                strides: [channels, width.saturating_mul(channels), 1],
            },
            [width, channels, height] if only_one && of_colors(&channels) => Self {
                width,
                height,
                channels,
                pages: 1,
                strides: [1, width.saturating_mul(channels), width],
            },
            [width, height, channels] if of_colors(&channels) => Self {
                channels,
                pages: if channels == 3 { 1 } else { channels },
                ..Self::planes(width, height, 1)
            },
            _ => {
                let pages = used[2..].iter().try_fold(1_usize, |n, &l| n.checked_mul(l));
                Self::planes(used[0], used[1], pages.unwrap_or(usize::MAX))
            }
        })
    }

    fn planes(width: usize, height: usize, pages: usize) -> Self {
        Self {
            width,
            height,
            channels: 1,
            pages,
            strides: [1, width, width.saturating_mul(height)],
        }
    }

    /// The layout of one plane of several.
    pub fn plane(self) -> Self {
        Self::planes(self.width, self.height, 1)
    }

    /// Whether the file does not say what the planes are, and which of them is wanted.
    pub fn is_cube(self) -> bool {
        self.channels == 1 && self.pages > 1
    }

    /// Number of values in the image.
    pub fn values(self) -> usize {
        let pixels = self.width.saturating_mul(self.height);
        pixels.saturating_mul(self.channels)
    }

    /// The values with the channels of each pixel side by side.
    pub fn interleaved<T: Copy>(self, values: Vec<T>) -> Vec<T> {
        let [column, row, channel] = self.strides;
        if self.channels == 1 || channel == 1 {
            return values;
        }
        let mut pixels = Vec::with_capacity(values.len());
        for start in (0..self.height).map(|y| y * row) {
            for place in (0..self.width).map(|x| start + x * column) {
                pixels.extend((0..self.channels).map(|c| values[place + c * channel]));
            }
        }
        pixels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes(axes: &[usize]) -> (usize, usize, usize, usize) {
        let layout = FitsLayout::from_axes(axes).unwrap();
        (layout.width, layout.height, layout.channels, layout.pages)
    }

    #[test]
    fn axes_of_one_are_skipped_and_colors_are_found_on_any_axis() {
        for (axes, expected) in [
            (&[8, 6][..], (8, 6, 1, 1)),
            (&[8, 6, 1, 1], (8, 6, 1, 1)),
            (&[1, 8, 6], (8, 6, 1, 1)),
            (&[8, 1, 6], (8, 6, 1, 1)),
            (&[8, 6, 3], (8, 6, 3, 1)),
            (&[8, 6, 1, 3], (8, 6, 3, 1)),
            (&[8, 6, 4], (8, 6, 4, 4)),
            (&[3, 8, 6], (8, 6, 3, 1)),
            (&[4, 8, 6], (8, 6, 4, 1)),
            (&[8, 3, 6], (8, 6, 3, 1)),
            (&[1, 3, 8, 6], (8, 6, 3, 1)),
            // Two axes may be that of the colors: it is the last, as in most files.
            (&[3, 8, 3], (3, 8, 3, 1)),
            (&[8, 6, 5], (8, 6, 1, 5)),
            (&[8, 6, 2], (8, 6, 1, 2)),
            (&[8, 6, 3, 2], (8, 6, 1, 6)),
            (&[8, 1], (8, 1, 1, 1)),
            (&[1, 1, 1], (1, 1, 1, 1)),
        ] {
            assert_eq!(sizes(axes), expected, "{axes:?}");
        }
        for axes in [&[][..], &[8], &[8, 0], &[8, 6, 0]] {
            assert_eq!(FitsLayout::from_axes(axes), None, "{axes:?}");
        }
        let huge = usize::MAX;
        assert_eq!(sizes(&[3, huge, huge]), (huge, huge, 3, 1));
        assert_eq!(sizes(&[huge, huge, huge, 2]).3, huge);
    }

    #[test]
    fn channels_come_side_by_side_from_any_axis() {
        let pixels: Vec<usize> = (0..8 * 6 * 3).collect();
        let at = |x: usize, y: usize, c: usize| (y * 8 + x) * 3 + c;
        let order = |axes: [usize; 3], place: fn(usize, usize, usize) -> [usize; 3]| {
            let mut stored = vec![0; pixels.len()];
            for (x, y, c) in
                (0..8).flat_map(|x| (0..6).flat_map(move |y| (0..3).map(move |c| (x, y, c))))
            {
                let [i, j, k] = place(x, y, c);
                stored[(k * axes[1] + j) * axes[0] + i] = at(x, y, c);
            }
            FitsLayout::from_axes(&axes).unwrap().interleaved(stored)
        };
        assert_eq!(order([8, 6, 3], |x, y, c| [x, y, c]), pixels);
        assert_eq!(order([3, 8, 6], |x, y, c| [c, x, y]), pixels);
        assert_eq!(order([8, 3, 6], |x, y, c| [x, c, y]), pixels);
    }
}
