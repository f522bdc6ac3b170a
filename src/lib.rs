//! From a photograph of the night sky to the stars in it, where the camera pointed, and how sure that is.

pub mod attitude;
pub mod camera;
pub mod catalog;
pub mod coords;
pub mod detect;
pub mod frame;
pub mod identify;
pub mod units;
