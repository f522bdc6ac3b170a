//! The image of a sensor.

use crate::{Camera, Error};

/// Rows of pixels, the upper one first.
#[derive(Debug, Clone, Copy)]
pub struct Image<'a> {
    levels: Levels<'a>,
    width: usize,
    height: usize,
    /// Pixels from one row to the next.
    stride: usize,
}

#[derive(Debug, Clone, Copy)]
enum Levels<'a> {
    Bits8(&'a [u8]),
    Bits16(&'a [u16]),
}

impl<'a> Image<'a> {
    /// An image of 8 bits. `stride` are the pixels from one row to the next.
    ///
    /// # Errors
    /// [`Error::Image`] where rows overlap, or the last ones are missing.
    pub fn of_8_bits(
        pixels: &'a [u8],
        [width, height]: [usize; 2],
        stride: usize,
    ) -> Result<Self, Error> {
        check([width, height], stride, pixels.len())?;
        Ok(Self {
            levels: Levels::Bits8(pixels),
            width,
            height,
            stride,
        })
    }

    /// An image of 16 bits. `stride` are the pixels from one row to the next.
    ///
    /// # Errors
    /// [`Error::Image`] where rows overlap, or the last ones are missing.
    pub fn of_16_bits(
        pixels: &'a [u16],
        [width, height]: [usize; 2],
        stride: usize,
    ) -> Result<Self, Error> {
        check([width, height], stride, pixels.len())?;
        Ok(Self {
            levels: Levels::Bits16(pixels),
            width,
            height,
            stride,
        })
    }

    pub(crate) fn check_camera(&self, camera: &Camera) -> Result<(), Error> {
        let size = [camera.width_px as usize, camera.height_px as usize];
        if size == [self.width, self.height] {
            Ok(())
        } else {
            Err(Error::Image)
        }
    }

    pub(crate) fn width(&self) -> usize {
        self.width
    }

    pub(crate) fn height(&self) -> usize {
        self.height
    }

    pub(crate) fn at(&self, x: usize, y: usize) -> f32 {
        let index = y * self.stride + x;
        match self.levels {
            Levels::Bits8(pixels) => pixels.get(index).map_or(0.0, |level| f32::from(*level)),
            Levels::Bits16(pixels) => pixels.get(index).map_or(0.0, |level| f32::from(*level)),
        }
    }

    /// Copies a row.
    pub(crate) fn read_row(&self, y: usize, row: &mut [f32]) {
        let start = y * self.stride;
        match self.levels {
            Levels::Bits8(pixels) => copy(&pixels[start..start + self.width], row),
            Levels::Bits16(pixels) => copy(&pixels[start..start + self.width], row),
        }
    }
}

fn copy<T: Copy + Into<f32>>(from: &[T], to: &mut [f32]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = (*from).into();
    }
}

fn check([width, height]: [usize; 2], stride: usize, count: usize) -> Result<(), Error> {
    let needed = stride
        .checked_mul(height.saturating_sub(1))
        .and_then(|before| before.checked_add(width));
    let fits =
        width > 0 && height > 0 && stride >= width && needed.is_some_and(|needed| needed <= count);
    if fits { Ok(()) } else { Err(Error::Image) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_that_are_cut_short_are_refused() {
        let pixels = [1_u16; 12];
        assert!(Image::of_16_bits(&pixels, [3, 4], 3).is_ok());
        assert!(Image::of_16_bits(&pixels, [2, 4], 3).is_ok());
        for (size, stride) in [
            ([3, 5], 3),
            ([4, 3], 3),
            ([0, 4], 3),
            ([3, 0], 3),
            ([3, usize::MAX], usize::MAX),
        ] {
            assert_eq!(
                Image::of_16_bits(&pixels, size, stride).unwrap_err(),
                Error::Image
            );
        }
    }

    #[test]
    fn rows_begin_a_stride_apart() {
        let pixels = [1_u8, 2, 9, 3, 4, 9];
        let image = Image::of_8_bits(&pixels, [2, 2], 3).unwrap();
        let mut row = [0.0; 2];
        image.read_row(1, &mut row);
        assert_eq!((row, image.at(1, 0)), ([3.0, 4.0], 2.0));
    }
}
