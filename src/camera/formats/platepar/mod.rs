//! RMS platepar: the lens and the pointing of a meteor camera (Raspberry Pi Meteor Station).
//!
//! ([`CameraModel`](crate::CameraModel), [`Pointing`](super::Pointing)) ↔ JSON of distortion types `radial…-odd` and `poly3+radial…`

mod plate;
mod read;
mod write;

pub use read::{from_platepar, from_platepar_within};
pub use write::platepar;

#[cfg(test)]
mod tests;
