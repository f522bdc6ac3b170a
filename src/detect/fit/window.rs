//! The pixels of a fit.

use crate::base::size::Size;
use crate::detect::psf::{GROUP_PX, LocalPsf, MAX_WINDOW_PX, PIXEL_VARIANCE_PX2, PixelGroup};

/// A rectangle of pixels cut out of the frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct Window {
    /// Column of the first.
    pub x0: usize,
    /// Row of the first.
    pub y0: usize,
    /// Columns, at most [`MAX_WINDOW_PX`].
    pub width: usize,
    /// Rows, at most [`MAX_WINDOW_PX`].
    pub height: usize,
    /// Row by row, each in whole groups: the pixels above the background map, in units of the
    /// noise. NaN where a pixel is left out, and beyond the end of a row.
    pub data: Vec<PixelGroup>,
    /// Standard deviation of the background noise, in ADU.
    pub noise_adu: f64,
    /// Standard error of the background map, in ADU.
    pub background_error: f64,
    /// The part of `background_error` that is noise, in ADU.
    pub background_noise: f64,
    /// The spot at this place.
    pub psf: LocalPsf,
}

impl Window {
    /// Its columns and rows.
    pub fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }

    /// Groups of pixels in a row.
    pub fn groups(&self) -> usize {
        self.width.div_ceil(GROUP_PX)
    }

    /// The pixel in a column and a row of the window, in units of the noise.
    pub fn at(&self, column: usize, row: usize) -> f64 {
        f64::from(self.data[row * self.groups() + column / GROUP_PX][column % GROUP_PX])
    }

    /// Column, row and value in ADU of each pixel.
    pub fn pixels_adu(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let pixels =
            (0..self.height).flat_map(|row| (0..self.width).map(move |column| (column, row)));
        pixels.map(|(column, row)| {
            let value = self.noise_adu * self.at(column, row);
            (column as f64, row as f64, value)
        })
    }

    /// Its middle, as a column and a row.
    pub fn middle(&self) -> [f64; 2] {
        [self.width, self.height].map(|side| 0.5 * (side as f64 - 1.0))
    }

    /// Subtracts light in ADU that depends on the place, from the middle; leaves out where it is NaN.
    pub fn subtract_adu(&mut self, light_adu: impl Fn([f64; 2]) -> f64) {
        let (groups, [x, y]) = (self.groups(), self.middle());
        for row in 0..self.height {
            for column in 0..self.width {
                let light_adu = light_adu([column as f64 - x, row as f64 - y]);
                let pixel = &mut self.data[row * groups + column / GROUP_PX][column % GROUP_PX];
                *pixel -= (light_adu / self.noise_adu) as f32;
            }
        }
    }

    /// Becomes a copy of another window, without a new allocation where the pixels fit.
    pub fn copy_from(&mut self, other: &Self) {
        let mut data = std::mem::take(&mut self.data);
        let mut psf = std::mem::take(&mut self.psf);
        data.clone_from(&other.data);
        psf.copy_from(&other.psf);
        *self = Self {
            data,
            psf,
            ..*other
        };
    }
}

/// Half the side of the window for a spot, in pixels: three standard deviations.
pub(crate) fn window_radius(spot_px: f64) -> usize {
    let width_px = (spot_px * spot_px + PIXEL_VARIANCE_PX2).sqrt();
    ((3.0 * width_px).ceil() as usize).clamp(2, (MAX_WINDOW_PX - 1) / 2)
}
