//! RMS platepar: the lens and the pointing of a meteor camera (Raspberry Pi Meteor Station).
//!
//! ([`CameraModel`](crate::CameraModel), [`Pointing`]) ↔ JSON of distortion types `radial…-odd` and `poly3+radial…`

mod plate;
mod read;
mod sky;
mod write;

pub use read::{from_platepar, from_platepar_within};
pub(super) use sky::Sky;
pub use write::platepar;

use crate::base::coords::{Camera, Icrs, Rotation};
use crate::base::epoch::ObservationDate;
use crate::ephemeris::observer::Site;

/// Where a camera looked, from where, and when.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pointing {
    /// Attitude relative to the directions of the catalogue, as in reports: what is in the boresight has
    /// these coordinates.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// The site.
    pub site: Site,
    /// The date.
    pub date: ObservationDate,
}

#[cfg(test)]
mod tests;
