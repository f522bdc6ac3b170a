//! The size of an image.

/// Width and height of an image or of a part of it, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Size {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Size {
    /// So many columns and rows.
    pub const fn new(width: usize, height: usize) -> Self {
        Self { width, height }
    }

    /// How many pixels it has.
    pub const fn pixels(self) -> usize {
        self.width * self.height
    }

    /// Both sides: width, height.
    pub const fn sides(self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// From corner to corner, in pixels.
    pub fn diagonal_px(self) -> f64 {
        libm::hypot(self.width as f64, self.height as f64)
    }
}
