//! The bands of magnitudes, and how well V follows from them.

use std::fmt;

/// What the magnitudes of a catalogue are, which V is derived from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Band {
    /// Johnson V.
    JohnsonV,
    /// BT and VT of Tycho.
    Tycho,
    /// G, BP and RP of Gaia.
    GaiaColors,
    /// G of Gaia alone.
    GaiaG,
    /// BP of Gaia alone.
    GaiaBp,
    /// J of 2MASS.
    TwoMassJ,
    /// A band that the catalogue does not tell.
    Unknown,
    /// There are only ranks of brightness.
    Ranks,
}

impl Band {
    /// How far the V magnitudes of all stars may be off together: the error of the relations between the bands, or
    /// where there is no color, the difference that the stars of one part of the sky may make.
    pub const fn v_sigma_mag(self) -> f64 {
        match self {
            Self::JohnsonV | Self::Tycho | Self::GaiaColors => 0.02,
            Self::GaiaG | Self::GaiaBp => 0.1,
            Self::TwoMassJ => 0.3,
            Self::Unknown => 0.5,
            Self::Ranks => 1.0,
        }
    }
}

impl fmt::Display for Band {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::JohnsonV => "Johnson V",
            Self::Tycho => "Tycho BT and VT",
            Self::GaiaColors => "Gaia G, BP and RP",
            Self::GaiaG => "Gaia G",
            Self::GaiaBp => "Gaia BP",
            Self::TwoMassJ => "2MASS J",
            Self::Unknown => "an unknown band",
            Self::Ranks => "none; estimated from ranks of brightness",
        })
    }
}
