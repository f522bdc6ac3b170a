//! From a frame to what detection sees of it: without defective columns, and without a mosaic.

use crate::detect::{DetectConfig, DetectError};
use crate::frame::{DefectiveColumn, Frame, MemoryLimit, Mosaic, SaturationFinder};
use crate::photometry::ColorFrame;

/// A frame as detection sees it. Where nothing is to be done, nothing is copied.
pub(super) struct Prepared<'a> {
    raw: &'a Frame<'a>,
    masked: Option<Frame<'static>>,
    mosaic: Option<Mosaic>,
    grey: Option<Frame<'static>>,
    /// The columns that are left out.
    pub defects: Vec<DefectiveColumn>,
    /// What is left for the work on it beside the copies.
    pub memory: MemoryLimit,
}

impl<'a> Prepared<'a> {
    /// Leaves out the defective columns of a frame that takes a part of `memory`, and smooths its
    /// mosaic.
    ///
    /// # Errors
    /// [`DetectError::TooMuchMemory`] where there is no room for copies.
    pub fn new(
        raw: &'a Frame<'a>,
        mosaic: Option<Mosaic>,
        config: &DetectConfig,
        memory: MemoryLimit,
    ) -> Result<Self, DetectError> {
        let defects = raw.defective_columns();
        let mut prepared = Self {
            raw,
            masked: None,
            mosaic,
            grey: None,
            defects,
            memory,
        };
        if !prepared.defects.is_empty() {
            prepared.book_copy(1)?;
            prepared.masked = Some(raw.without_columns(&prepared.defects));
        }
        if let Some(mosaic) = mosaic {
            // Whole numbers are copied as floats, too.
            prepared.book_copy(2)?;
            let raw = prepared.raw();
            // Of the raw pixels: smoothing blurs the level.
            let saturation_adu = config.saturation_adu(raw, &mut SaturationFinder::default());
            prepared.grey = Some(mosaic.grey(raw, saturation_adu));
        }
        Ok(prepared)
    }

    /// The frame with its own pixels, without the defective columns.
    pub fn raw(&self) -> &Frame<'_> {
        self.masked.as_ref().unwrap_or(self.raw)
    }

    /// The raw frame of a color camera.
    pub fn color(&self) -> Option<ColorFrame<'_>> {
        let raw = self.raw();
        self.mosaic.map(|mosaic| ColorFrame { mosaic, raw })
    }

    /// The frame that detection sees.
    pub fn frame(&self) -> &Frame<'_> {
        self.grey.as_ref().unwrap_or(self.raw())
    }

    /// Books copies of the frame as floats.
    fn book_copy(&mut self, copies: u64) -> Result<(), DetectError> {
        let bytes = copies * self.raw.pixels.len() as u64 * size_of::<f32>() as u64;
        let limit_bytes = self.memory.bytes();
        let needed_bytes = self.raw.pixels.bytes() + bytes;
        if needed_bytes > limit_bytes {
            return Err(DetectError::TooMuchMemory {
                needed_bytes,
                limit_bytes,
            });
        }
        self.memory = MemoryLimit::of_bytes(limit_bytes - bytes);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise with a dead column.
    fn frame() -> Frame<'static> {
        let pixel = |i: usize| match i % 64 {
            20 => 7,
            x => ((x * x * 7919 + (i / 64).pow(2) * 104_729 + x * i) % 1009 % 53) as u16,
        };
        let mut frame = Frame::new(64, 200, vec![0.0; 64 * 200]).unwrap();
        let pixels: Vec<u16> = (0..64 * 200).map(pixel).collect();
        frame.pixels = pixels.into();
        frame
    }

    #[test]
    fn copies_are_booked_and_refused_where_there_is_no_room() {
        let (frame, config) = (frame(), DetectConfig::default());
        let of_pixels = |bytes: u64| MemoryLimit::of_bytes(bytes * 64 * 200);
        let prepared = Prepared::new(&frame, None, &config, of_pixels(10)).unwrap();
        assert_eq!(prepared.defects.len(), 1);
        assert!(prepared.frame().at(20, 0).is_nan());
        assert_eq!(prepared.memory, of_pixels(6));
        let refused = Prepared::new(&frame, None, &config, of_pixels(5));
        assert!(matches!(
            refused.err(),
            Some(DetectError::TooMuchMemory { .. })
        ));
    }
}
