//! What contradicts a place and a time.

use crate::ephemeris::solar_system::BodyKind;

/// What contradicts a place and a time.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Contradiction {
    /// Stars are named that would be below the horizon.
    StarsBelowHorizon {
        /// How many.
        below: usize,
        /// Of how many.
        named: usize,
        /// True altitude of the lowest, in radians.
        lowest_rad: f64,
    },
    /// The air would bend light otherwise.
    Refraction {
        /// By how much the squared misfit is larger than without air, in standard errors.
        excess: f64,
    },
    /// The sky would be brighter than the stars.
    SunIsUp {
        /// True altitude of the Sun, in radians.
        altitude_rad: f64,
    },
    /// A planet is not where it would be, and another one is where there is none.
    Planets {
        /// The one that is missing.
        missing: BodyKind,
        /// The one that another date has where a detection is no star.
        seen: BodyKind,
    },
}

impl Contradiction {
    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::StarsBelowHorizon { .. } => "stars_below_horizon",
            Self::Refraction { .. } => "refraction",
            Self::SunIsUp { .. } => "sun_is_up",
            Self::Planets { .. } => "planets",
        }
    }
}
