//! The camera: which direction each pixel looks in.

mod distortion;

pub use distortion::Distortion;
