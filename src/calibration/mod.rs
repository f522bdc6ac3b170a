//! What does the detector do to a frame, and how is that undone?
//!
//! Master dark, master flat, list of hot pixels → [`Calibration`]; [`Frame`](crate::frame::Frame) →
//! the calibrated frame.
//!
//! calibrated = L + (pixel − dark) / flat, where L is the median of the dark: the dark's pattern is
//! removed, but the level of the frame, bias included, is kept. Without a dark, L is the given
//! bias, or 0.
//!
//! - Hot pixels, and pixels where the dark or the flat has no value, become pixels without a value
//!   (NaN).
//! - Saturated pixels stay saturated: if the division lifts another pixel above full scale, full
//!   scale is raised.
//! - The flat is normalized to a mean of 1.
//! - Pixels that a mask leaves out have no value, either. It is drawn over the picture as it is seen.
//! - A frame whose `Orientation` turns or mirrors it is calibrated in the rows of its file, and then
//!   turned back.
//!
//! [`darks`] and [`flats`] measure the detector from dark frames and flats.
//!
//! Caveats: the dark is not scaled to the frame's exposure. If the exposures differ, the dark
//! current is wrong, which [`Calibration::exposure_mismatch`] reports.

mod apply;
#[doc(hidden)]
pub mod darks;
mod error;
#[doc(hidden)]
pub mod flats;
mod hot_pixels;
mod pixel_stack;
mod robust;

pub use apply::{Applied, Calibration, ExposureMismatch, Master};
pub use error::CalibrationError;
pub use hot_pixels::{HotPixelList, read_hot_pixels};
pub use pixel_stack::{OutOfMemory, PixelStack};

#[cfg(test)]
mod tests;
