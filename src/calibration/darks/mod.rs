//! What do dark frames say about a detector? Noise, pattern, dark current and hot pixels.
//!
//! [`Frame`](crate::frame::Frame)s → [`FrameStatistics`] of each; [`DarkStack`] → [`Darks`]
//!
//! 1. Mean and standard deviation of each frame, and their means over all frames: equations 3 and 4
//!    of the defocus paper.
//! 2. Mean and variance of each pixel over the frames of one exposure. Frames are added one at a
//!    time and not kept, so memory does not grow with their number
//!    ([`PixelStack`](crate::calibration::PixelStack)).
//! 3. Temporal noise: the mean variance of the pixels without outliers, minus the variance of the
//!    level of the whole frame, minus the rounding to whole grey levels.
//! 4. Fixed pattern: the variance of the pixels' means minus the noise left in them, with its
//!    columns and rows ([`Pattern`]).
//! 5. Dark current, if there are two or more exposures: a straight line through the level of every
//!    pixel over the exposure ([`DarkCurrent`]).
//! 6. Hot pixels: pixels whose level, dark current or noise is an outlier ([`HotPixel`]).
//!
//! Levels are in the file's own units (ADU), times in seconds.
//!
//! Caveats: the temporal noise of a pixel is assumed to be normal; a pixel with telegraph noise
//! appears as hot. Noise below half a grey level cannot be measured and is not reported. Stars in a
//! dark frame are recognized by their width, so stars no wider than a pixel pass for hot pixels,
//! and many cosmic rays pass for stars.
//!
//! # Reference
//! Wang et al. 2019, doi 10.3788/LOP56.101101, sect. 3.1; EMVA Standard 1288, release 4.0 (2021).

mod current;
mod error;
mod frame_statistics;
mod hot;
mod measure;
mod noise;
mod not_dark;
mod pattern;
mod report;
mod stack;
mod text;

pub use current::{DarkCurrent, FittedValue};
pub use error::{DarksError, MAX_EXPOSURES};
pub use frame_statistics::FrameStatistics;
pub use hot::{HOT_SIGMA, HotPixel, HotReasons};
pub use measure::{DarkConfig, Darks, FullScale, FullScaleSource, MissingQuantity};
pub use noise::ExposureGroup;
pub use not_dark::{NotDark, NotDarkReason};
pub use pattern::Pattern;
pub use report::{DarkFrameRow, DarksReport, HotPixelRow, HotPixelsReport};
pub use stack::DarkStack;

#[cfg(test)]
mod tests;
