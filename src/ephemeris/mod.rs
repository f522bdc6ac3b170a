//! From where and when does one look? Site and atmosphere; places of stars; Moon and planets; meteor showers.
//!
//! - [`observer`]: site, date and direction → zenith distance, azimuth and airmass.
//! - [`places`]: a star, date, site and velocity → where the star appears.
//! - [`solar_system`]: date and site → the Moon and the planets.
//! - `meteor_showers`: date → the radiants of the showers that are active.

pub(crate) mod meteor_showers;
pub mod observer;
pub mod places;
pub mod solar_system;

use crate::base::units::RAD_PER_ARCSEC;

/// Obliquity of the ecliptic of J2000.0, that of VSOP87, which is turned by less than 0.1″ against the ICRS's.
const OBLIQUITY_J2000_RAD: f64 = 84_381.448 * RAD_PER_ARCSEC;
