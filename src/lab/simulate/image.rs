//! The expected electrons in each pixel.

/// Expected electrons per pixel, row-major.
#[derive(Debug, Clone)]
pub(super) struct ElectronImage {
    width: usize,
    pixels: Vec<f64>,
}

impl ElectronImage {
    /// An image with this number of electrons in every pixel; both sides are at least 1.
    pub(super) fn new(width: usize, height: usize, electrons: f64) -> Self {
        Self {
            width,
            pixels: vec![electrons; width * height],
        }
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn height(&self) -> usize {
        self.pixels.len() / self.width
    }

    pub(super) fn row_mut(&mut self, y: usize) -> &mut [f64] {
        &mut self.pixels[y * self.width..(y + 1) * self.width]
    }

    /// Rows with their indices, from the top.
    pub(super) fn rows_mut(&mut self) -> impl Iterator<Item = (usize, &mut [f64])> {
        self.pixels.chunks_exact_mut(self.width).enumerate()
    }

    pub(super) fn pixels(&self) -> &[f64] {
        &self.pixels
    }

    pub(super) fn pixels_mut(&mut self) -> &mut [f64] {
        &mut self.pixels
    }

    #[cfg(test)]
    pub(super) fn into_pixels(self) -> Vec<f64> {
        self.pixels
    }
}
