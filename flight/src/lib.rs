//! From an image to an attitude, without `std`, without an allocator, and with a bound on the work.
//!
//! [`Image`] → [`Tracker::detect`] → [`Spot`]s → [`Tracker::lost`] → [`Attitude`]; and then, from image to image,
//! [`Tracker::track`].
//!
//! - Everything that is kept lies in one block of memory that the caller gives; [`Tracker::words`] says how large it is.
//! - The stars and their triangles are a [`Catalog`], read in place, so that it can stay in flash memory.
//! - [`Budget`]s count work, not time: the same input gives the same output on every machine with IEEE 754
//!   arithmetic. [`Work`] tells what was done, and [`Tracker::most_work`] what can be done at most.
//!
//! # Conventions
//! Pixels: x to the right, y down, the centre of the first pixel is (0, 0). Camera axes: x along image x, y along
//! image y, z out along the boresight. Quaternions are [w, x, y, z], w ≥ 0, and turn a vector of the ICRS into camera
//! axes.
#![no_std]
#![cfg_attr(
    test,
    allow(
        clippy::disallowed_methods,
        reason = "tests may differ in the last bit"
    )
)]

#[cfg(feature = "build")]
extern crate alloc;
#[cfg(any(test, feature = "build"))]
extern crate std;

mod agreement;
mod attitude;
mod block;
#[cfg(feature = "build")]
pub mod build;
mod camera;
mod catalog;
mod centroid;
mod chance;
mod config;
mod detect;
mod error;
mod image;
mod lost;
mod matching;
mod motion;
mod sensitivity;
mod track;
mod tracker;

pub use attitude::Attitude;
pub use camera::Camera;
pub use catalog::{Catalog, Star};
pub use config::{Config, Sensor};
pub use detect::Spot;
pub use error::{Error, Status};
pub use image::Image;
pub use motion::{Measured, Motion, MotionPrediction, turn_between};
pub use sensitivity::limiting_v_mag;
pub use tracker::{Budget, Sky, Tracker, Work};
