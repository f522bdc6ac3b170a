//! Accumulates dark frames.

use super::error::{DarksError, MAX_EXPOSURES};
use super::frame_statistics::{FrameStatistics, is_same_exposure};
use crate::calibration::pixel_stack::PixelStack;
use crate::frame::Frame;

/// Accumulates dark frames: the statistics of each frame, and of every pixel for each exposure.
#[derive(Debug, Clone, Default)]
pub struct DarkStack {
    pub(super) frames: Vec<FrameStatistics>,
    pub(super) exposures: Vec<ExposureStack>,
    /// The smallest step between grey levels among the frames.
    pub(super) step_adu: Option<f32>,
    /// The largest saturation level among the frames.
    pub(super) saturation_adu: Option<f32>,
}

/// The pixels of all frames of one exposure.
#[derive(Debug, Clone)]
pub(super) struct ExposureStack {
    pub exposure_s: Option<f64>,
    pub pixels: PixelStack,
}

impl DarkStack {
    /// An empty stack.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds `frame` with its `statistics` from [`FrameStatistics::of`].
    /// # Errors
    /// [`DarksError::SizesDiffer`], [`DarksError::TooManyExposures`], [`DarksError::Memory`].
    pub fn add(&mut self, frame: &Frame, statistics: FrameStatistics) -> Result<(), DarksError> {
        if let Some(first) = self.frames.first() {
            check_same_size(first, &statistics)?;
        }
        let stack = self.stack_for(&statistics, frame.pixels.len())?;
        stack.add(frame.values().iter().copied());
        self.step_adu = Some(
            self.step_adu
                .map_or(frame.step_adu, |s| s.min(frame.step_adu)),
        );
        self.saturation_adu = match (self.saturation_adu, frame.saturation_adu) {
            (Some(one), Some(other)) => Some(one.max(other)),
            (one, other) => one.or(other),
        };
        self.frames.push(statistics);
        Ok(())
    }

    /// The stack for the exposure of a frame, which is made if the exposure is new.
    fn stack_for(
        &mut self,
        frame: &FrameStatistics,
        pixels: usize,
    ) -> Result<&mut PixelStack, DarksError> {
        let exposure_s = frame.exposure_s;
        let known = self
            .exposures
            .iter()
            .position(|stack| is_same_exposure(stack.exposure_s, exposure_s));
        let index = match known {
            Some(index) => index,
            None if self.exposures.len() == MAX_EXPOSURES => {
                return Err(DarksError::TooManyExposures {
                    frame: frame.frame.clone(),
                    exposure_s: exposure_s.unwrap_or(f64::NAN),
                });
            }
            None => {
                let pixels = PixelStack::new(pixels)?;
                self.exposures.push(ExposureStack { exposure_s, pixels });
                self.exposures.len() - 1
            }
        };
        Ok(&mut self.exposures[index].pixels)
    }
}

fn check_same_size(first: &FrameStatistics, other: &FrameStatistics) -> Result<(), DarksError> {
    if (first.width, first.height) == (other.width, other.height) {
        return Ok(());
    }
    Err(DarksError::SizesDiffer {
        first: first.frame.clone(),
        first_width: first.width,
        first_height: first.height,
        frame: other.frame.clone(),
        width: other.width,
        height: other.height,
    })
}
