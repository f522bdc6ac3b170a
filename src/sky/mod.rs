//! What is in the sky, and where does the observer see it? Star catalogue; site and atmosphere.
//!
//! - [`catalog`]: a catalogue file → stars, brightest first, and search by position.
//! - [`observer`]: site, date and direction → zenith distance, azimuth and airmass.

pub mod catalog;
pub mod observer;
