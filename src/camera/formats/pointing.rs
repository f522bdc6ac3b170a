//! The attitude of a camera that does not move.

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
