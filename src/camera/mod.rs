//! What is the instrument? The direction in which each pixel looks, and the data sheet.
//!
//! - [`CameraModel`]: pixel ↔ direction in camera axes, any lens with its distortion.
//! - [`data_sheet`]: `camera.toml` → [`DataSheet`](data_sheet::DataSheet), pixels, lens and
//!   detector.
//! - [`KnownLens`]: a camera model that was measured, with its errors.
//! - [`formats`]: lenses in the files of other programs.
//!
//! direction → axes of the lens → [`Projection`] → [`Distortion`] → offset from the frame's centre (x
//! reversed if the frame is mirrored) → pixel; and the same way back.

pub mod data_sheet;
mod distortion;
pub mod formats;
mod frame_size;
mod known_lens;
mod model;
mod plausible;
mod projection;

pub use distortion::{Distortion, DistortionModel, LENS_TERMS};
pub(crate) use distortion::{MAX_TERMS, MONOMIALS, Observed, monomials};
pub use frame_size::FrameSizeError;
pub(crate) use frame_size::agreed_size;
pub use known_lens::KnownLens;
pub use model::CameraModel;
pub use model::focal_length_px;
pub(crate) use model::frame_centre;
pub use plausible::ImplausibleLens;
pub use projection::Projection;
