//! The image itself.

use super::error::FrameError;
use super::limits::{MAX_PIXELS, MIN_SIDE_PX};
use super::metadata::FrameMetadata;
use super::pixels::Pixels;
use super::row_order::RowOrder;
use std::borrow::Cow;

/// One image of light intensities.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixel values in the file's own units (ADU), row-major, `height * width`; colour is converted
    /// to luminance. NaN marks a pixel without a value.
    pub pixels: Pixels,
    /// Difference between neighbouring grey levels, in ADU: 1 for integers, 0 for floats.
    pub step_adu: f32,
    /// Level at and above which a pixel is saturated, in ADU, if the format has one.
    pub saturation_adu: Option<f32>,
    /// How the frame was taken, according to the file.
    pub metadata: FrameMetadata,
}

impl Frame {
    /// Makes a frame from `pixels` in ADU, row-major, `height * width`, without quantization or
    /// saturation.
    ///
    /// Pixels may be NaN (no value); infinities become NaN.
    /// # Errors
    /// [`FrameError::WrongLength`], [`FrameError::TooSmall`], [`FrameError::TooLarge`] for sizes
    /// that do not fit; [`FrameError::NoValues`] if no pixel has a value.
    pub fn new(width: usize, height: usize, mut pixels: Vec<f32>) -> Result<Self, FrameError> {
        check_size(width, height)?;
        if pixels.len() != width * height {
            return Err(FrameError::WrongLength {
                expected: width * height,
                found: pixels.len(),
            });
        }
        let mut any_value = false;
        for pixel in &mut pixels {
            if pixel.is_infinite() {
                *pixel = f32::NAN;
            }
            any_value |= !pixel.is_nan();
        }
        if !any_value {
            return Err(FrameError::NoValues);
        }
        Ok(Self::from_checked(width, height, pixels))
    }

    /// Makes a frame of whole numbers, row-major, `height * width`, in steps of 1 ADU, without
    /// saturation.
    ///
    /// # Errors
    /// [`FrameError::WrongLength`], [`FrameError::TooSmall`], [`FrameError::TooLarge`] for sizes
    /// that do not fit.
    pub fn from_words(width: usize, height: usize, pixels: Vec<u16>) -> Result<Self, FrameError> {
        check_size(width, height)?;
        if pixels.len() != width * height {
            return Err(FrameError::WrongLength {
                expected: width * height,
                found: pixels.len(),
            });
        }
        Ok(Self::from_checked(width, height, pixels).with_levels(1.0, None))
    }

    /// Makes a frame from `height * width` pixels that are neither infinite nor all NaN.
    pub(super) fn from_checked(width: usize, height: usize, pixels: impl Into<Pixels>) -> Self {
        Self {
            width,
            height,
            pixels: pixels.into(),
            step_adu: 0.0,
            saturation_adu: None,
            metadata: FrameMetadata::default(),
        }
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

    /// Sets the step between grey levels and the saturation level, in ADU.
    #[must_use]
    pub fn with_levels(mut self, step_adu: f32, saturation_adu: Option<f32>) -> Self {
        self.step_adu = step_adu;
        self.saturation_adu = saturation_adu;
        self
    }

    /// Sets the metadata.
    #[must_use]
    pub fn with_metadata(mut self, metadata: FrameMetadata) -> Self {
        self.metadata = metadata;
        self
    }

    /// Puts the top row first, for rows in the order of the file.
    pub(super) fn upright(mut self) -> Self {
        if self.metadata.row_order == RowOrder::BottomUp {
            self.pixels.reverse_rows(self.width);
        }
        self
    }
}

/// Refuses sizes outside [`MIN_SIDE_PX`] and [`MAX_PIXELS`], before anything is allocated.
pub(crate) fn check_size(width: usize, height: usize) -> Result<(), FrameError> {
    if width < MIN_SIDE_PX || height < MIN_SIDE_PX {
        return Err(FrameError::TooSmall { width, height });
    }
    match width.checked_mul(height) {
        Some(count) if count <= MAX_PIXELS => Ok(()),
        _ => Err(FrameError::TooLarge { width, height }),
    }
}
