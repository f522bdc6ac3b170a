//! What is in the sky, and where does the observer see it? Star catalogue; Moon and
//! planets; site and atmosphere.
//!
//! - [`catalog`]: a catalogue file → stars, brightest first, and search by position.
//! - `objects`: constellations, and the brightest clusters, nebulae and galaxies.
//! - [`observer`]: site, date and direction → zenith distance, azimuth and airmass.
//! - [`places`]: a star, date, site and velocity → where the star appears.
//! - [`solar_system`]: date and site → the Moon and the planets.

pub mod catalog;
#[cfg(feature = "overlay")]
pub(crate) mod objects;
pub mod observer;
pub mod places;
pub mod solar_system;
