//! Step 5b: frames in which all stars are long trails, as the camera or the sky moved.
//!
//! Noise breaks long trails up, and each piece would be a star of its own, up to half a trail away
//! from the star. [`Trails`] are told by the largest regions of the frame, most of which have the same
//! direction. Each star is then a bar of that direction and length (`streak_profile`), with the mean light of all
//! trails along it (`mean`); the pieces that it covers are one detection, whose position is that of
//! the star in the middle of the exposure.

mod largest;
mod light;
mod mean;
mod measurement;
mod profile;
mod shape;
mod streak_profile;
#[cfg(test)]
mod tests;
mod trails;

pub(in crate::detect) use measurement::measure_trailed;
pub(in crate::detect) use trails::Trails;
