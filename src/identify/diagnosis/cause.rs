//! The causes that diagnosis can name.

use crate::base::coords::{Icrs, UnitVector};
use crate::identify::priors::ScaleSource;
use std::fmt;

/// Why a frame was not identified, in terms that a person can act on.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Diagnosis {
    /// All pixels of the frame have one value.
    NoVariation {
        /// That value, in ADU.
        level_adu: f64,
    },
    /// A large fraction of the frame is at full scale, or the sky is close to it.
    Saturated {
        /// That fraction, in [0, 1].
        share: f64,
        /// The frame's median over full scale.
        sky: f64,
        /// Full scale, in ADU.
        level_adu: f64,
    },
    /// The frame is a negative: its stars are dark.
    Negative {
        /// Number of dark spots.
        spots: usize,
    },
    /// The stars are trails: the camera moved, or the stars did.
    Trails {
        /// Number of detections that are trails.
        trails: usize,
        /// Their angle to the image's x axis, in radians, in (−π/2, π/2]; positive where they rise
        /// to the right.
        angle_rad: f64,
        /// Their median length, in pixels.
        length_px: f64,
    },
    /// The same pattern of stars occurs twice.
    DoubleExposure(DoubleImage),
    /// The stated field of view is too narrow for the stars of the catalogue.
    TooNarrow {
        /// Stated horizontal field of view, from and to, in radians.
        fov_x_rad: [f64; 2],
        /// Who states it.
        source: ScaleSource,
        /// The narrowest horizontal field of view that the catalogue allows, in radians.
        narrowest_rad: f64,
        /// Mean number of its stars in a field in the middle of the range.
        stars: f64,
    },
    /// Without the priors the stars are identified.
    HintsExclude(Box<Excluded>),
    /// The stars are arcs about the celestial pole.
    StarTrails {
        /// Number of arcs.
        trails: usize,
        /// How far the sky turned during the exposure, in radians.
        turn_rad: f64,
        /// The point about which it turned, x and y, in pixels.
        center_px: [f64; 2],
    },
    /// A bright disc outshines the stars: the Moon, the Sun or a lamp.
    BrightDisc {
        /// Its middle, x and y, in pixels.
        middle_px: [f64; 2],
        /// Its diameter, in pixels.
        diameter_px: f64,
    },
    /// The stars are discs or rings.
    OutOfFocus {
        /// Their diameter, in pixels.
        disc_px: f64,
    },
    /// Lines or text.
    Drawing,
    /// A sky with labels, as planetarium programs and charts show it.
    Labels {
        /// Number of words.
        words: usize,
    },
    /// Several pictures side by side.
    Mosaic {
        /// How many of them stand beside each other, and one below the other.
        parts: [usize; 2],
    },
    /// A blue sky, as by day.
    Daylight,
    /// Green light of an aurora.
    Aurora,
    /// The brightness of the sky varies as with clouds.
    Clouds {
        /// Its variation over its level: one standard deviation.
        variation: f64,
    },
    /// Nothing but noise, near the lowest levels.
    Black {
        /// Number of hot pixels.
        hot_pixels: usize,
    },
    /// There are stars, but too few to be sure which they are.
    FewStars {
        /// Number of detections that look like stars.
        stars: usize,
    },
}

/// A pattern of stars that occurs twice. `Display` says how often, and how far apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DoubleImage {
    /// Pairs of stars with this offset.
    pub pairs: usize,
    /// The offset along x and y, in pixels.
    pub offset_px: [f64; 2],
}

impl fmt::Display for DoubleImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pairs, offset_px } = self;
        let [x, y] = offset_px;
        write!(
            f,
            "{pairs} pairs of detections are offset by ({x:+.1}, {y:+.1}) px"
        )
    }
}

/// A solution that the priors exclude.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Excluded {
    /// Its horizontal field of view, in radians.
    pub fov_x_rad: f64,
    /// Its boresight.
    pub boresight: UnitVector<Icrs>,
    /// Number of identified stars.
    pub stars: usize,
    /// The stated field of view, from and to, in radians, where it excludes the solution.
    pub allowed_fov_x_rad: Option<[f64; 2]>,
}

impl Diagnosis {
    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::NoVariation { .. } => "no_variation",
            Self::Saturated { .. } => "saturated",
            Self::Negative { .. } => "negative",
            Self::Trails { .. } => "trails",
            Self::DoubleExposure(_) => "double_exposure",
            Self::TooNarrow { .. } => "too_narrow",
            Self::HintsExclude(_) => "hints_exclude",
            Self::StarTrails { .. } => "star_trails",
            Self::BrightDisc { .. } => "bright_disc",
            Self::OutOfFocus { .. } => "out_of_focus",
            Self::Drawing => "drawing",
            Self::Labels { .. } => "labels",
            Self::Mosaic { .. } => "mosaic",
            Self::Daylight => "daylight",
            Self::Aurora => "aurora",
            Self::Clouds { .. } => "clouds",
            Self::Black { .. } => "black",
            Self::FewStars { .. } => "too_few_stars",
        }
    }
}
