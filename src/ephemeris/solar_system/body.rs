//! The Moon and the planets: names, sizes, and how certain their places are.

use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::RAD_PER_ARCSEC;

pub(super) const KM_PER_AU: f64 = 149_597_870.7;
pub(super) const DAYS_PER_JULIAN_YEAR: f64 = 365.25;
/// Days that light takes for an astronomical unit.
pub(super) const LIGHT_DAYS_PER_AU: f64 = 499.004_784 / 86_400.0;

/// The Moon, or a planet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BodyKind {
    /// The Earth's Moon.
    Moon,
    /// Mercury.
    Mercury,
    /// Venus.
    Venus,
    /// Mars.
    Mars,
    /// Jupiter.
    Jupiter,
    /// Saturn.
    Saturn,
    /// Uranus.
    Uranus,
    /// Neptune.
    Neptune,
}

impl BodyKind {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Moon,
        Self::Mercury,
        Self::Venus,
        Self::Mars,
        Self::Jupiter,
        Self::Saturn,
        Self::Uranus,
        Self::Neptune,
    ];

    /// The name in English.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Moon => "Moon",
            Self::Mercury => "Mercury",
            Self::Venus => "Venus",
            Self::Mars => "Mars",
            Self::Jupiter => "Jupiter",
            Self::Saturn => "Saturn",
            Self::Uranus => "Uranus",
            Self::Neptune => "Neptune",
        }
    }

    /// Equatorial radius in kilometres (IAU 2015, Archinal et al. 2018).
    pub(super) const fn radius_km(self) -> f64 {
        match self {
            Self::Moon => 1_737.4,
            Self::Mercury => 2_440.5,
            Self::Venus => 6_051.8,
            Self::Mars => 3_396.2,
            Self::Jupiter => 71_492.0,
            Self::Saturn => 60_268.0,
            Self::Uranus => 25_559.0,
            Self::Neptune => 24_764.0,
        }
    }

    /// Largest error of the direction by theory alone, in radians.
    pub(super) const fn theory_error_rad(self) -> f64 {
        match self {
            Self::Moon => 15.0 * RAD_PER_ARCSEC,
            _ => 5.0 * RAD_PER_ARCSEC,
        }
    }
}

/// How far a date may be from the true one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeError {
    /// The time of day is known, in UTC.
    None,
    /// The time of day is known, but not in which zone.
    Zone,
    /// Only the day is known, and not in which zone.
    Day,
}

impl TimeError {
    /// The largest error in hours: zones are up to 14 h from UTC, midday up to 12 h from the hour.
    pub const fn hours(self) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Zone => 14.0,
            Self::Day => 26.0,
        }
    }

    pub(super) const fn days(self) -> f64 {
        self.hours() / 24.0
    }
}

/// The Moon or a planet at a date.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Body {
    /// Which one.
    pub kind: BodyKind,
    /// Its astrometric direction.
    pub direction: UnitVector<Icrs>,
    /// The true direction is no further away than this, in radians: error of the theory, of the
    /// time, and of the Moon's parallax where no site is known.
    pub uncertainty_rad: f64,
    /// Approximate Johnson V magnitude.
    pub v_mag: f64,
    /// Angular radius in radians.
    pub radius_rad: f64,
}
