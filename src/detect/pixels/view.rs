//! The part of a frame that holds light: its pixels without the dead borders.

use crate::frame::Frame;
use std::ops::Range;

/// A rectangle of an image. All coordinates inside `detect` are relative to it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View<'a> {
    pixels: &'a [f32],
    stride: usize,
    /// Column of the frame that is column 0 here.
    pub x0: usize,
    /// Row of the frame that is row 0 here.
    pub y0: usize,
    /// Columns.
    pub width: usize,
    /// PixelRows.
    pub height: usize,
}

impl<'a> View<'a> {
    /// The whole of an image.
    pub fn new(pixels: &'a [f32], width: usize, height: usize) -> Self {
        Self::with_stride(pixels, width, width, height)
    }

    /// An image of `width` columns whose rows are stored `stride` apart.
    pub fn with_stride(pixels: &'a [f32], stride: usize, width: usize, height: usize) -> Self {
        Self {
            pixels,
            stride,
            x0: 0,
            y0: 0,
            width,
            height,
        }
    }

    /// The frame without the outer rows and columns that hold a single value each, such as zero
    /// padding or overscan: they hold no light, and their edge would be detected as a source.
    pub fn of_live_pixels(frame: &'a Frame) -> Self {
        let mut view = Self::new(&frame.pixels, frame.width, frame.height);
        let is_flat = |values: &mut dyn Iterator<Item = f32>| {
            let mut values = values.filter(|v| !v.is_nan());
            values.next().is_none_or(|first| values.all(|v| v == first))
        };
        while view.height > 0 && is_flat(&mut view.row(0).iter().copied()) {
            view.y0 += 1;
            view.height -= 1;
        }
        while view.height > 0 && is_flat(&mut view.row(view.height - 1).iter().copied()) {
            view.height -= 1;
        }
        while view.width > 0 && is_flat(&mut (0..view.height).map(|y| view.row(y)[0])) {
            view.x0 += 1;
            view.width -= 1;
        }
        while view.width > 0 && is_flat(&mut (0..view.height).map(|y| view.row(y)[view.width - 1]))
        {
            view.width -= 1;
        }
        view
    }

    /// Row `y`.
    #[inline]
    pub fn row(&self, y: usize) -> &'a [f32] {
        let start = (self.y0 + y) * self.stride + self.x0;
        &self.pixels[start..start + self.width]
    }

    /// A range of rows.
    pub fn rows(&self, rows: Range<usize>) -> PixelRows<'a> {
        PixelRows {
            values: &self.pixels[(self.y0 + rows.start) * self.stride + self.x0..],
            stride: self.stride,
            width: self.width,
            height: rows.len(),
        }
    }

    /// The pixel in column `x`, row `y`.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.row(y)[x]
    }
}

/// PixelRows of pixels, `stride` apart in memory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PixelRows<'a> {
    /// From the first pixel of the first row on.
    pub values: &'a [f32],
    /// Pixels from the start of a row to that of the next.
    pub stride: usize,
    /// Columns.
    pub width: usize,
    /// PixelRows.
    pub height: usize,
}

impl<'a> PixelRows<'a> {
    /// Row `y`.
    pub fn row(&self, y: usize) -> &'a [f32] {
        &self.values[y * self.stride..][..self.width]
    }

    /// Every `step`th row.
    pub fn step_by(self, step: usize) -> Self {
        Self {
            stride: step * self.stride,
            height: self.height.div_ceil(step),
            ..self
        }
    }

    /// A range of columns.
    pub fn columns(self, columns: Range<usize>) -> Self {
        Self {
            values: &self.values[columns.start.min(self.values.len())..],
            width: columns.len(),
            ..self
        }
    }
}
