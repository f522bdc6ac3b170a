//! How tiles share an image.
//!
//! Tiles are counted along the first axis first. Those at the end of an axis may be shorter.

use crate::base::size::Size;
use crate::frame::FrameError;
use crate::frame::fits::header::UnitHeader;
use std::ops::Range;

/// The tiles of an image.
#[derive(Debug, PartialEq)]
pub(super) struct TileGrid {
    /// Pixels along each axis.
    axes: Vec<usize>,
    /// Pixels of a tile along each axis.
    tile: Vec<usize>,
}

/// One tile.
#[derive(Debug, PartialEq)]
pub(super) struct Tile {
    /// Its row in the table, from 0.
    pub row: usize,
    /// The pixel of the image at its beginning, along each axis.
    start: Vec<usize>,
    /// Its pixels along each axis.
    pub lengths: Vec<usize>,
}

impl TileGrid {
    /// The grid of an image with these axes, none of them empty. Without ZTILEn tiles are rows.
    pub fn new(axes: &[usize], header: &UnitHeader) -> Result<Self, FrameError> {
        let length = |(axis, &pixels): (usize, &usize)| {
            let keyword = format!("ZTILE{}", axis + 1);
            let expected = "a length of 1 or more";
            let default = if axis == 0 { pixels } else { 1 };
            match header.optional(&keyword, expected)? {
                None => Ok(default),
                Some(length @ 1..) => {
                    Ok(usize::try_from(length).map_or(pixels, |length| length.min(pixels)))
                }
                Some(_) => Err(header.invalid(&keyword, expected)),
            }
        };
        let tile = axes
            .iter()
            .enumerate()
            .map(length)
            .collect::<Result<_, _>>()?;
        Ok(Self {
            axes: axes.to_vec(),
            tile,
        })
    }

    /// The number of tiles, if there are not too many to count.
    pub fn tiles(&self) -> Option<usize> {
        let mut counts = self.counts();
        counts.try_fold(1_usize, |all, count| all.checked_mul(count))
    }

    /// The largest number of pixels in a tile, if it can be counted.
    pub fn tile_pixels(&self) -> Option<usize> {
        let mut lengths = self.tile.iter();
        lengths.try_fold(1_usize, |all, length| all.checked_mul(*length))
    }

    /// Tile `row`, from 0.
    pub fn tile(&self, row: usize) -> Tile {
        let mut rest = row;
        let place = |count: usize| {
            let place = rest % count;
            rest /= count;
            place
        };
        let places: Vec<usize> = self.counts().map(place).collect();
        let starts = places.iter().zip(&self.tile);
        let start: Vec<usize> = starts.map(|(place, length)| place * length).collect();
        let ends = self.tile.iter().zip(&self.axes).zip(&start);
        let lengths = ends.map(|((&length, axis), start)| length.min(axis - start));
        Tile {
            row,
            lengths: lengths.collect(),
            start,
        }
    }

    /// The rows of `tile`: for each the place of its first pixel in the image.
    pub fn rows(&self, tile: &Tile) -> impl Iterator<Item = usize> {
        let upper: usize = tile.lengths[1..].iter().product();
        (0..upper).map(|row| {
            let (mut rest, mut place, mut stride) = (row, tile.start[0], self.axes[0]);
            for axis in 1..self.axes.len() {
                place += (tile.start[axis] + rest % tile.lengths[axis]) * stride;
                rest /= tile.lengths[axis];
                stride *= self.axes[axis];
            }
            place
        })
    }

    /// Whether part of `tile` may lie within these pixels of the image.
    pub fn may_touch(&self, tile: &Tile, pixels: &Range<usize>) -> bool {
        let place = |at: &dyn Fn(usize) -> usize| {
            let places = (0..self.axes.len()).rev();
            places.fold(0, |place, axis| place * self.axes[axis] + at(axis))
        };
        let first = place(&|axis| tile.start[axis]);
        let last = place(&|axis| tile.start[axis] + tile.lengths[axis] - 1);
        first < pixels.end && last >= pixels.start
    }

    /// Tiles along each axis.
    fn counts(&self) -> impl Iterator<Item = usize> {
        let axes = self.axes.iter().zip(&self.tile);
        axes.map(|(axis, length)| axis.div_ceil(*length))
    }
}

impl Tile {
    /// Its number of pixels.
    pub fn pixels(&self) -> usize {
        self.lengths.iter().product()
    }

    /// Its columns and rows, if it has two axes or the others have one pixel.
    pub fn size(&self) -> Option<Size> {
        let mut long = self.lengths.get(2..).unwrap_or_default().iter();
        let height = self.lengths.get(1).copied().unwrap_or(1);
        long.all(|length| *length == 1)
            .then_some(Size::new(self.lengths[0], height))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> TileGrid {
        TileGrid {
            axes: vec![5, 4, 2],
            tile: vec![3, 2, 1],
        }
    }

    #[test]
    fn tiles_cover_the_image_once() {
        let grid = grid();
        let mut seen = [0; 40];
        for row in 0..grid.tiles().unwrap() {
            let tile = grid.tile(row);
            for start in grid.rows(&tile) {
                seen[start..start + tile.lengths[0]]
                    .iter_mut()
                    .for_each(|n| *n += 1);
            }
        }
        assert_eq!(seen, [1; 40]);
        assert_eq!((grid.tiles(), grid.tile_pixels()), (Some(8), Some(6)));
    }

    #[test]
    fn tiles_at_the_end_are_shorter() {
        let tile = grid().tile(3);
        assert_eq!((tile.start.as_slice(), tile.pixels()), (&[3, 2, 0][..], 4));
        assert_eq!(tile.size(), Some(Size::new(2, 2)));
        assert_eq!(grid().rows(&tile).collect::<Vec<_>>(), [13, 18]);
    }

    #[test]
    fn a_plane_is_touched_by_its_own_tiles() {
        let grid = grid();
        let touching = |pixels| {
            (0..8)
                .filter(|&row| grid.may_touch(&grid.tile(row), &pixels))
                .collect()
        };
        let of = |pixels: Range<usize>| -> Vec<usize> { touching(pixels) };
        assert_eq!(of(0..20), [0, 1, 2, 3]);
        assert_eq!(of(20..40), [4, 5, 6, 7]);
    }
}
