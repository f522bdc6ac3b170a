//! The part of a frame that holds light: its pixels without the dead borders.

use super::samples::Samples;
use crate::base::interrupt::{Interrupt, Interrupted};
use crate::base::size::Size;
use crate::frame::Frame;
use std::ops::Range;

/// A rectangle of an image. All coordinates inside `detect` are relative to it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View<'a> {
    pixels: Samples<'a>,
    stride: usize,
    /// Column of the frame that is column 0 here.
    pub x0: usize,
    /// Row of the frame that is row 0 here.
    pub y0: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Whether anyone still waits for what is in it.
    interrupt: Option<&'a Interrupt>,
}

impl<'a> View<'a> {
    /// The whole of an image.
    pub fn new(pixels: impl Into<Samples<'a>>, width: usize, height: usize) -> Self {
        Self {
            pixels: pixels.into(),
            stride: width,
            x0: 0,
            y0: 0,
            width,
            height,
            interrupt: None,
        }
    }

    /// The same; work on it ends early when `interrupt` is due.
    pub fn until(self, interrupt: &'a Interrupt) -> Self {
        Self {
            interrupt: Some(interrupt),
            ..self
        }
    }

    /// Its columns and rows.
    pub fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }

    /// Whether work on it is to end now.
    pub fn is_interrupted(&self) -> bool {
        self.interrupt.is_some_and(Interrupt::is_due)
    }

    /// Ends work on it with `?`.
    pub fn check(&self) -> Result<(), Interrupted> {
        self.interrupt.map_or(Ok(()), Interrupt::check)
    }

    /// The frame without the outer rows and columns that hold a single value each, such as zero
    /// padding or overscan: they hold no light, and their edge would be detected as a source.
    pub fn of_live_pixels(frame: &'a Frame) -> Self {
        let mut view = Self::new(&frame.pixels, frame.width, frame.height);
        let is_flat = |values: &mut dyn Iterator<Item = f32>| {
            let mut values = values.filter(|v| !v.is_nan());
            values.next().is_none_or(|first| values.all(|v| v == first))
        };
        let is_flat_row = |view: &Self, y| is_flat(&mut (0..view.width).map(|x| view.at(x, y)));
        let is_flat_column = |view: &Self, x| is_flat(&mut (0..view.height).map(|y| view.at(x, y)));
        while view.height > 0 && is_flat_row(&view, 0) {
            view.y0 += 1;
            view.height -= 1;
        }
        while view.height > 0 && is_flat_row(&view, view.height - 1) {
            view.height -= 1;
        }
        while view.width > 0 && is_flat_column(&view, 0) {
            view.x0 += 1;
            view.width -= 1;
        }
        while view.width > 0 && is_flat_column(&view, view.width - 1) {
            view.width -= 1;
        }
        view
    }

    /// Row `y`.
    #[inline(always)]
    pub fn row(&self, y: usize) -> Samples<'a> {
        let start = (self.y0 + y) * self.stride + self.x0;
        self.pixels.span(start..start + self.width)
    }

    /// Every `step`th of some rows, as floats, in `buffer` if they are none.
    pub fn sampled<'b>(
        &self,
        rows: Range<usize>,
        step: usize,
        buffer: &'b mut Vec<f32>,
    ) -> PixelRows<'b>
    where
        'a: 'b,
    {
        let height = rows.len().div_ceil(step);
        let sampled = |values, stride| PixelRows {
            values,
            stride,
            width: self.width,
            height,
        };
        if let Samples::F32(values) = self.pixels {
            let start = (self.y0 + rows.start) * self.stride + self.x0;
            return sampled(&values[start..], step * self.stride);
        }
        buffer.resize(height * self.width, 0.0);
        let targets = buffer.chunks_exact_mut(self.width);
        for (y, target) in rows.step_by(step).zip(targets) {
            self.row(y).copy_to(target);
        }
        sampled(buffer, self.width)
    }

    /// The pixel in column `x`, row `y`.
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.pixels.at((self.y0 + y) * self.stride + self.x0 + x)
    }
}

/// Rows of pixels, `stride` apart in memory.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PixelRows<'a> {
    /// From the first pixel of the first row on.
    pub values: &'a [f32],
    /// Pixels from the start of a row to that of the next.
    pub stride: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl<'a> PixelRows<'a> {
    /// Row `y`.
    pub fn row(&self, y: usize) -> &'a [f32] {
        &self.values[y * self.stride..][..self.width]
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
