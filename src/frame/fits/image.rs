//! Decodes one image of a header-data unit.

use super::error::{truncated, unsupported};
use super::layout::FitsLayout;
use super::tiles;
use super::unit::{FitsUnit, StoredType};
use crate::base::size::Size;
use crate::frame::levels::{LevelSamples, WholeNumber, frame_from_floats, frame_from_integers};
use crate::frame::read_budget::{FLOATS_BYTES_PER_PIXEL, ReadBudget};
use crate::frame::{Frame, FrameError, check_size};

/// Location and scaling of one image in a file.
pub(super) struct FitsImage<'a> {
    layout: FitsLayout,
    /// Its plane in the header-data unit, from 0.
    plane: usize,
    stored: StoredType,
    scale: f64,
    zero: f64,
    /// The stored integer that marks a pixel without a value.
    blank: Option<i64>,
    budget: &'a ReadBudget,
}

impl<'a> FitsImage<'a> {
    /// The image `plane` of `unit`, which has this layout. A cube has several planes, and one must be
    /// chosen.
    pub fn new(
        unit: &FitsUnit,
        layout: FitsLayout,
        plane: Option<usize>,
        budget: &'a ReadBudget,
    ) -> Result<Self, FrameError> {
        if plane.is_none() && layout.is_cube() {
            let axes: Vec<String> = unit.axes.iter().map(usize::to_string).collect();
            let found = format!("a cube of {} planes ({})", layout.pages, axes.join(" x "));
            let expected =
                "one plane, three or four color planes, or a page number that selects one";
            return Err(unsupported(found, expected));
        }
        let layout = if plane.is_some() && layout.pages > 1 {
            layout.plane()
        } else {
            layout
        };
        let FitsLayout { width, height, .. } = layout;
        check_size(width, height)?;
        let scale = unit.header.number_or("BSCALE", 1.0)?;
        if scale == 0.0 {
            return Err(unit.header.invalid("BSCALE", "a number other than 0"));
        }
        let image = Self {
            layout,
            plane: plane.unwrap_or(0),
            stored: unit.stored,
            scale,
            zero: unit.header.number_or("BZERO", 0.0)?,
            blank: unit.blank().filter(|_| !unit.stored.is_float()),
            budget,
        };
        let bytes_per_pixel = image.bytes_per_pixel(unit.is_compressed_image());
        budget.check_image(Size::new(width, height), bytes_per_pixel)?;
        Ok(image)
    }

    /// Most memory that decoding takes for each pixel, without that for single tiles.
    fn bytes_per_pixel(&self, is_compressed: bool) -> usize {
        const FRAME: usize = size_of::<f32>();
        let stored = self.stored.bytes();
        let unpacked = if is_compressed {
            self.layout.channels * stored
        } else {
            0
        };
        let values = match self.layout.channels {
            1 => stored + FRAME,
            // As they are interleaved.
            channels => 2 * channels * stored.max(FRAME),
        };
        let blanked = if self.blank.is_some() { FRAME } else { 0 };
        (unpacked + values + blanked).max(FLOATS_BYTES_PER_PIXEL)
    }

    /// Decodes the image from `unit`, of which it was made, in `bytes`, the content of the file.
    pub fn frame(&self, unit: &FitsUnit, bytes: &[u8]) -> Result<Frame<'static>, FrameError> {
        let values = self.layout.values();
        let first = values.saturating_mul(self.plane);
        if unit.is_compressed_image() {
            let range = first..first.saturating_add(values);
            return self.frame_of(&tiles::unpack(unit, bytes, range, self.budget)?);
        }
        let before = first.saturating_mul(self.stored.bytes());
        let start = unit.data.saturating_add(before);
        let end = start.saturating_add(values * self.stored.bytes());
        let data = bytes.get(start..end).ok_or_else(|| {
            let FitsLayout { width, height, .. } = self.layout;
            let detail = format!("the image of {width} x {height} pixels ends at byte {end}");
            truncated(bytes.len(), detail)
        })?;
        self.frame_of(data)
    }

    /// Decodes the image from its stored values.
    fn frame_of(&self, data: &[u8]) -> Result<Frame<'static>, FrameError> {
        if self.scale == 1.0 && !self.stored.is_float() {
            const HALF_8: f64 = (1_u8 << 7) as f64;
            const HALF_16: f64 = (1_u16 << 15) as f64;
            const HALF_32: f64 = (1_u32 << 31) as f64;
            // Signed and unsigned integers differ by their highest bit.
            match (self.stored, self.zero) {
                (StoredType::U8, 0.0) => return self.integers(data, |[b]| b, u8::MAX),
                (StoredType::U8, zero) if zero == -HALF_8 => {
                    return self.integers(data, |[b]| (b ^ 1 << 7) as i8, i8::MAX);
                }
                (StoredType::I16, 0.0) => return self.integers(data, i16::from_be_bytes, i16::MAX),
                (StoredType::I16, HALF_16) => {
                    return self.integers(data, |b| u16::from_be_bytes(b) ^ 1 << 15, u16::MAX);
                }
                (StoredType::I32, 0.0) => return self.integers(data, i32::from_be_bytes, i32::MAX),
                (StoredType::I32, HALF_32) => {
                    return self.integers(data, |b| u32::from_be_bytes(b) ^ 1 << 31, u32::MAX);
                }
                _ => {}
            }
        }
        match self.stored {
            StoredType::U8 => self.scaled(data, |[b]: [u8; 1]| i64::from(b)),
            StoredType::I16 => self.scaled(data, |b| i64::from(i16::from_be_bytes(b))),
            StoredType::I32 => self.scaled(data, |b| i64::from(i32::from_be_bytes(b))),
            StoredType::I64 => self.long_integers(data),
            StoredType::F32 => self.floats(data, |b| f64::from(f32::from_be_bytes(b))),
            StoredType::F64 => self.floats(data, f64::from_be_bytes),
        }
    }

    /// Decodes unscaled integers; `full_scale` is the largest value of the type.
    fn integers<const N: usize, T: WholeNumber>(
        &self,
        data: &[u8],
        level: impl Fn([u8; N]) -> T,
        full_scale: T,
    ) -> Result<Frame<'static>, FrameError> {
        let FitsLayout {
            width,
            height,
            channels,
            ..
        } = self.layout;
        let levels = data.as_chunks().0.iter().map(|b| level(*b));
        let values = self.layout.interleaved(levels.collect());
        let samples = LevelSamples {
            width,
            height,
            values: &values,
            channels,
        };
        let frame = frame_from_integers(&samples, full_scale, self.budget)?;
        let Some(blank) = self.blank else {
            return Ok(frame);
        };
        let blank = blank.saturating_add(self.zero as i64);
        let mut pixels = frame.values().into_owned();
        for (pixel, levels) in pixels.iter_mut().zip(values.chunks_exact(channels)) {
            if levels.iter().any(|level| (*level).into() == blank) {
                *pixel = f32::NAN;
            }
        }
        Ok(Frame::new(width, height, pixels)?.with_levels(frame.step_adu, frame.saturation_adu))
    }

    /// Decodes integers with a scale and an offset.
    fn scaled<const N: usize>(
        &self,
        data: &[u8],
        integer: impl Fn([u8; N]) -> i64,
    ) -> Result<Frame<'static>, FrameError> {
        let value = |bytes| match integer(bytes) {
            stored if Some(stored) == self.blank => f64::NAN,
            stored => stored as f64,
        };
        let frame = self.floats(data, value)?;
        Ok(frame.with_levels(self.scale.abs() as f32, None))
    }

    /// Decodes integers of 64 bits with a scale and an offset.
    fn long_integers(&self, data: &[u8]) -> Result<Frame<'static>, FrameError> {
        const HALF: i64 = 1 << 32;
        let level = |bytes: &[u8; 8]| {
            let stored = i64::from_be_bytes(*bytes);
            if Some(stored) == self.blank {
                return f32::NAN;
            }
            // Each half is exact as a float. The upper one comes first: an offset of 2⁶³, which makes
            // the integers unsigned, leaves a small number to which the lower one is added.
            let (upper, lower) = ((stored / HALF * HALF) as f64, (stored % HALF) as f64);
            ((self.zero + self.scale * upper) + self.scale * lower) as f32
        };
        let frame = self.frame_of_levels(data.as_chunks().0.iter().map(level).collect())?;
        Ok(frame.with_levels(self.scale.abs() as f32, None))
    }

    /// Decodes values with a scale and an offset.
    fn floats<const N: usize>(
        &self,
        data: &[u8],
        value: impl Fn([u8; N]) -> f64,
    ) -> Result<Frame<'static>, FrameError> {
        let level = |bytes: &[u8; N]| (self.zero + self.scale * value(*bytes)) as f32;
        self.frame_of_levels(data.as_chunks().0.iter().map(level).collect())
    }

    fn frame_of_levels(&self, levels: Vec<f32>) -> Result<Frame<'static>, FrameError> {
        let FitsLayout {
            width,
            height,
            channels,
            ..
        } = self.layout;
        let values = self.layout.interleaved(levels);
        frame_from_floats(Size::new(width, height), channels, values, self.budget)
    }
}
