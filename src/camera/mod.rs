//! What is the instrument? The direction in which each pixel looks, and the data sheet.
//!
//! - [`CameraModel`]: pixel ↔ direction in camera axes, a pinhole with lens distortion.
//! - [`data_sheet`]: `camera.toml` → [`DataSheet`](data_sheet::DataSheet), pixels, lens and
//!   detector.
//!
//! pixel → offset from the frame's centre (x reversed if the frame is mirrored) → distortion
//! removed → pinhole → direction; and the same way back.
//!
//! Caveat: the optical axis goes through the centre of the frame.

pub mod data_sheet;
mod distortion;
mod model;

pub(crate) use distortion::{
    CUBIC_MONOMIALS, LANES, LENS_TERMS, QUINTIC_MONOMIALS, lens_terms, monomials_in_lanes,
};
pub use distortion::{Distortion, DistortionModel};
pub use model::CameraModel;
#[doc(hidden)]
pub use model::focal_length_px;
pub(crate) use model::frame_centre;
