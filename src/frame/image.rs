//! The image itself.

use super::error::FrameError;
use super::limits::{MAX_PIXELS, MIN_SIDE_PX};
use super::metadata::FrameMetadata;
use super::pixels::Pixels;
use super::row_order::RowOrder;
use crate::base::size::Size;
use std::borrow::Cow;

/// One image of light intensities.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame<'p> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixel values in the file's own units (ADU), row-major, `height * width`; color is converted
    /// to luminance. NaN marks a pixel without a value.
    pub pixels: Pixels<'p>,
    /// Difference between neighboring grey levels, in ADU: 1 for integers, 0 for floats.
    pub step_adu: f32,
    /// Level at and above which a pixel is saturated, in ADU, if the format has one.
    pub saturation_adu: Option<f32>,
    /// How the frame was taken, according to the file.
    pub metadata: FrameMetadata,
}

impl<'p> Frame<'p> {
    /// Makes a frame from `pixels` in ADU, row-major, `height * width`, without quantization or
    /// saturation.
    ///
    /// Pixels may be NaN (no value); infinities become NaN.
    /// # Errors
    /// [`FrameError::WrongLength`], [`FrameError::TooSmall`], [`FrameError::TooLarge`] for sizes
    /// that do not fit; [`FrameError::NoValues`] if no pixel has a value.
    ///
    /// # Example
    /// ```
    /// use starpipe::Frame;
    ///
    /// let mut pixels = vec![100.0; 64 * 48];
    /// pixels[20 * 64 + 30] = 900.0;
    /// let frame = Frame::new(64, 48, pixels)?;
    /// assert_eq!(frame.at(30, 20), 900.0);
    /// // Whole levels of 12 bits.
    /// let frame = frame.with_levels(1.0, Some(4095.0));
    /// assert_eq!(frame.saturation_adu, Some(4095.0));
    /// # Ok::<(), starpipe::frame::FrameError>(())
    /// ```
    pub fn new(width: usize, height: usize, pixels: Vec<f32>) -> Result<Self, FrameError> {
        Self::from_floats(width, height, pixels.into())
    }

    pub(super) fn from_floats(
        width: usize,
        height: usize,
        mut pixels: Cow<'p, [f32]>,
    ) -> Result<Self, FrameError> {
        check_length(width, height, pixels.len())?;
        if pixels.iter().any(|pixel| pixel.is_infinite()) {
            let infinite = pixels.to_mut().iter_mut().filter(|v| v.is_infinite());
            infinite.for_each(|pixel| *pixel = f32::NAN);
        }
        if pixels.iter().all(|pixel| pixel.is_nan()) {
            return Err(FrameError::NoValues);
        }
        Ok(Self::from_checked(width, height, Pixels::F32(pixels)))
    }

    /// Makes a frame from `height * width` pixels that are neither infinite nor all NaN.
    pub(super) fn from_checked(width: usize, height: usize, pixels: impl Into<Pixels<'p>>) -> Self {
        Self {
            width,
            height,
            pixels: pixels.into(),
            step_adu: 0.0,
            saturation_adu: None,
            metadata: FrameMetadata::default(),
        }
    }

    /// Its columns and rows.
    pub fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }

    /// The value of the pixel in column `x`, row `y`, in ADU.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.pixels.value(y * self.width + x)
    }

    /// All values in ADU, row-major; whole numbers are converted to floats each time.
    pub fn values(&self) -> Cow<'_, [f32]> {
        self.pixels.to_f32()
    }

    /// The values in ADU, to be changed: from then on the frame holds floats.
    pub fn values_mut(&mut self) -> &mut Vec<f32> {
        self.pixels.as_f32_mut()
    }

    /// The frame with pixels of its own: borrowed ones are copied.
    pub fn into_owned(self) -> Frame<'static> {
        Frame {
            width: self.width,
            height: self.height,
            pixels: self.pixels.into_owned(),
            step_adu: self.step_adu,
            saturation_adu: self.saturation_adu,
            metadata: self.metadata,
        }
    }

    /// The negative of the frame: what is highest becomes lowest. It has no saturation level.
    pub(crate) fn inverted(&self) -> Frame<'static> {
        let [lowest, highest] = self.range_adu();
        let pixels = self.pixels.values().map(|value| lowest + (highest - value));
        Frame::from_checked(self.width, self.height, pixels.collect::<Vec<f32>>())
            .with_levels(self.step_adu, None)
    }

    /// The means of blocks of `factor` × `factor` pixels; values without a number are left out, and so
    /// are pixels at the right and at the bottom that fill no block.
    pub(crate) fn binned(&self, factor: usize) -> Frame<'static> {
        let means = match &self.pixels {
            Pixels::U8(values) => means_of_blocks(values, self.width, factor),
            Pixels::U16(values) => means_of_blocks(values, self.width, factor),
            Pixels::F32(values) => means_of_blocks(values, self.width, factor),
        };
        let step_adu = self.step_adu / (factor * factor) as f32;
        Frame::from_checked(self.width / factor, self.height / factor, means)
            .with_levels(step_adu, self.saturation_adu)
    }

    /// The lowest and the highest value.
    pub(crate) fn range_adu(&self) -> [f32; 2] {
        [self.pixels.lowest(), self.pixels.highest()]
    }

    /// Sets the step between grey levels and the saturation level, in ADU.
    #[must_use]
    pub fn with_levels(mut self, step_adu: f32, saturation_adu: Option<f32>) -> Self {
        self.step_adu = step_adu;
        self.saturation_adu = saturation_adu;
        self
    }

    /// Sets the step between grey levels, and saturation at the highest of them up to `full_scale`:
    /// twelve bits in the upper part of sixteen saturate at 65520 instead of 65535.
    #[must_use]
    pub(super) fn with_step(self, step: i64, full_scale: i64) -> Self {
        let saturation = full_scale / step * step;
        self.with_levels(step as f32, Some(saturation as f32))
    }

    /// Sets the metadata.
    #[must_use]
    pub fn with_metadata(mut self, metadata: FrameMetadata) -> Self {
        self.metadata = metadata;
        self
    }

    /// The frame with its rows in the order of the file, as if that were the picture's.
    #[must_use]
    pub fn as_stored(self) -> Self {
        let mut stored = self.upright();
        let metadata = &mut stored.metadata;
        if metadata.row_order == RowOrder::BottomUp {
            let last_row = stored.height as i64 - 1;
            let pattern = metadata.bayer_pattern;
            metadata.bayer_pattern = pattern.map(|pattern| pattern.shifted(0, last_row));
            metadata.row_order = RowOrder::TopDown;
        }
        stored
    }

    /// Puts the top row first, for rows in the order of the file.
    pub(super) fn upright(mut self) -> Self {
        if self.metadata.row_order == RowOrder::BottomUp {
            self.pixels.reverse_rows(self.width);
        }
        self
    }
}

pub(super) fn check_length(width: usize, height: usize, found: usize) -> Result<(), FrameError> {
    check_size(width, height)?;
    let expected = width * height;
    if found == expected {
        Ok(())
    } else {
        Err(FrameError::WrongLength { expected, found })
    }
}

/// Refuses sizes outside [`MIN_SIDE_PX`] and [`MAX_PIXELS`], before anything is allocated.
///
/// # Errors
/// [`FrameError::TooSmall`], [`FrameError::TooLarge`].
pub fn check_size(width: usize, height: usize) -> Result<(), FrameError> {
    if width < MIN_SIDE_PX || height < MIN_SIDE_PX {
        return Err(FrameError::TooSmall { width, height });
    }
    match width.checked_mul(height) {
        Some(count) if count <= MAX_PIXELS => Ok(()),
        _ => Err(FrameError::TooLarge { width, height }),
    }
}

/// The means of blocks of pixels, row by row.
fn means_of_blocks<T: Copy + Into<f32>>(values: &[T], width: usize, factor: usize) -> Vec<f32> {
    let columns = width / factor;
    let bands = values.chunks_exact(width * factor);
    let mut means = Vec::with_capacity(columns * bands.len());
    let mut sums = vec![[0.0_f32; 2]; columns];
    for band in bands {
        sums.fill([0.0; 2]);
        for row in band.chunks_exact(width) {
            for ([sum, count], block) in sums.iter_mut().zip(row.chunks_exact(factor)) {
                for value in block.iter().map(|&value| value.into()) {
                    if !value.is_nan() {
                        *sum += value;
                        *count += 1.0;
                    }
                }
            }
        }
        means.extend(sums.iter().map(|[sum, count]| sum / count));
    }
    means
}
