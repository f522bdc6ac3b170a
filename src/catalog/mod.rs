//! The star catalogue: what is known of each star, and which stars are near a direction.

pub mod sky_grid;

use crate::coords::{Icrs, UnitVector};

/// One catalogue star, at the catalogue's epoch J2000.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Star {
    /// The catalogue's own number for the star (Skymap number in SKY2000).
    pub id: StarId,
    /// Direction at epoch J2000.
    pub direction: UnitVector<Icrs>,
    /// Proper motion in right ascension times cos(declination), in milliarcseconds a year.
    pub pm_ra_mas_per_yr: f32,
    /// Proper motion in declination, in milliarcseconds a year.
    pub pm_dec_mas_per_yr: f32,
    /// Johnson V magnitude.
    pub v_mag: f32,
    /// Johnson B−V, where known.
    pub bv_mag: Option<f32>,
}

/// The number under which a catalogue knows a star.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StarId(pub u32);
