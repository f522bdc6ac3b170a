//! Frames taken without light, and what they tell of the detector: noise, pattern, dark current, hot pixels.
//!
//! [`Frame`]s → [`FrameStatistics`] each, [`DarkStack`] → [`Darks`]
//!
//! 1. Of each frame mean and standard deviation, over all frames their means: equations 3 and 4 of the defocus paper.
//! 2. Of each pixel mean and variance over the frames of one exposure, frame by frame: the memory needed does not grow with
//!    the number of frames ([`PixelStack`]).
//! 3. Temporal noise: the mean of the pixels' variances without those that stand out, less what the level of the whole frame
//!    varied, less the rounding to whole grey levels.
//! 4. What is the same on every frame: the spread of the pixels' means less the noise left in them, with its
//!    columns and rows ([`Pattern`]).
//! 5. With two exposures or more, the level of every pixel against the exposure ([`DarkCurrent`]).
//! 6. Hot pixels: those whose level, dark current or noise stands out ([`HotPixel`]).
//!
//! Levels are in the file's own units (ADU), times in seconds.
//!
//! Caveats: temporal noise of a pixel is taken to be normal; telegraph noise shows as a hot pixel. A noise below half a
//! grey level cannot be measured in whole grey levels, and is not given. Stars in a dark frame are told by their width, so those
//! that are no wider than a pixel pass for hot pixels, and many cosmic rays pass for stars.
//!
//! # Reference
//! Wang et al. 2019, doi 10.3788/LOP56.101101, sect. 3.1; EMVA Standard 1288, release 4.0 (2021).

mod current;
mod hot;
mod measure;
mod pattern;
mod report;
pub(crate) mod robust;
mod stack;
mod statistics;
mod suspicion;
mod text;

pub use current::DarkCurrent;
pub use hot::{HOT_SIGMA, HotPixel, HotReasons};
pub use measure::{DarkConfig, Darks, ExposureGroup, FullScale, FullScaleSource, Missing};
pub use pattern::Pattern;
pub use report::{DarksReport, FrameRow, HotPixelRow, HotPixelsReport};
pub use stack::PixelStack;
pub(crate) use stack::pooled_variances;
pub use statistics::FrameStatistics;
pub use suspicion::{NotDark, NotDarkReason};

use crate::frame::Frame;

/// The most different exposures: each needs two arrays of the frame's size.
pub const MAX_EXPOSURES: usize = 16;
/// Exposures that differ by less than this part of them are the same.
const SAME_EXPOSURE: f64 = 1e-3;

/// Why frames could not be measured together.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DarksError {
    /// Two frames differ in size.
    #[error(
        "{frame} has {width} x {height} pixels, but {first} has {first_width} x {first_height}: expected frames of one size"
    )]
    SizesDiffer {
        /// The first frame.
        first: String,
        /// Its columns.
        first_width: usize,
        /// Its rows.
        first_height: usize,
        /// The other frame.
        frame: String,
        /// Its columns.
        width: usize,
        /// Its rows.
        height: usize,
    },
    /// Too many different exposures.
    #[error(
        "{frame}: found another exposure, {exposure_s} s, expected at most {MAX_EXPOSURES} different ones"
    )]
    TooManyExposures {
        /// The frame of the last one.
        frame: String,
        /// Its exposure.
        exposure_s: f64,
    },
    /// No memory for as many pixels.
    #[error("no memory for the statistics of {pixels} pixels")]
    Memory {
        /// The pixels of a frame.
        pixels: usize,
    },
    /// No frame at all.
    #[error("found no frame, expected at least one")]
    NoFrames,
}

/// Dark frames as they come in: the statistics of each, and of every pixel over those of one exposure.
#[derive(Debug, Clone, Default)]
pub struct DarkStack {
    frames: Vec<FrameStatistics>,
    groups: Vec<(Option<f64>, PixelStack)>,
    /// The smallest difference of levels and the largest full scale among the frames.
    step_adu: Option<f32>,
    saturation_adu: Option<f32>,
}

impl DarkStack {
    /// A stack without frames.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds `frame`, of which `statistics` are those by [`FrameStatistics::of`].
    /// # Errors
    /// [`DarksError::SizesDiffer`], [`DarksError::TooManyExposures`], [`DarksError::Memory`].
    pub fn add(&mut self, frame: &Frame, statistics: FrameStatistics) -> Result<(), DarksError> {
        if let Some(first) = self.frames.first() {
            check_same_size(first, &statistics)?;
        }
        let exposure_s = statistics.exposure_s;
        let group = match self
            .groups
            .iter()
            .position(|g| is_same_exposure(g.0, exposure_s))
        {
            Some(group) => group,
            None if self.groups.len() == MAX_EXPOSURES => {
                return Err(DarksError::TooManyExposures {
                    frame: statistics.frame,
                    exposure_s: exposure_s.unwrap_or(f64::NAN),
                });
            }
            None => {
                let stack = PixelStack::new(frame.pixels.len())?;
                self.groups.push((exposure_s, stack));
                self.groups.len() - 1
            }
        };
        self.groups[group].1.add(frame.pixels.iter().copied());
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

/// Whether two exposures are the same but for the last digits of a header.
pub(crate) fn is_same_exposure(one: Option<f64>, other: Option<f64>) -> bool {
    match (one, other) {
        (Some(one), Some(other)) => (one - other).abs() <= SAME_EXPOSURE * one.max(other),
        (None, None) => true,
        _ => false,
    }
}

#[cfg(test)]
mod tests;
