//! The stars of a zero point, and the zero point.

use crate::base::statistics::Estimate;

/// Reference B−V of the zero point where there is a color term: about that of the Sun and of many
/// field stars.
pub const REFERENCE_BV_MAG: f64 = 0.6;
/// Minimum number of stars for a zero point.
pub const MIN_STARS: usize = 5;
/// A star of known V magnitude with its measured flux.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandardStar {
    /// V magnitude from the catalogue.
    pub v_mag: f64,
    /// B−V, where known.
    pub bv_mag: Option<f64>,
    /// −2.5 log10(flux).
    pub instrumental_mag: f64,
    /// Its standard error from the flux alone.
    pub sigma_mag: f64,
    /// Distance from the frame's centre over that of the corner, squared.
    pub off_centre_sq: f64,
}

/// The conversion from instrumental to V magnitudes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ZeroPoint {
    /// V magnitude of a star with a flux of 1.
    pub v_mag: f64,
    /// Its standard error.
    pub sigma_mag: f64,
    /// Robust standard deviation of a star about the relation, flux noise included.
    pub scatter_mag: f64,
    /// Number of stars.
    pub stars: usize,
    /// The B−V for which it holds; `None` where no star has one.
    pub bv_mag: Option<f64>,
    /// The colors of its stars, where known.
    pub colors: Vec<WeightedColor>,
    /// k, in magnitudes per magnitude of B−V, where it is significant.
    pub color_term: Option<Estimate>,
    /// Magnitudes by which stars in the corner are dimmer than in the centre, where it is
    /// significant.
    pub corner_loss_mag: Option<Estimate>,
    /// Instrumental magnitudes per magnitude of V: 1 where grey levels are proportional to light.
    /// `None` with too few stars.
    pub linearity: Option<Estimate>,
    /// Mean V magnitude of the stars, at which the zero point of a nonlinear frame holds.
    pub mean_v_mag: f64,
    /// Whether [`Self::linearity`] differs significantly from 1.
    pub is_nonlinear: bool,
}

/// Why there is no zero point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NoZeroPoint {
    /// Too few stars.
    #[error(
        "too few stars: {detected} isolated catalog stars were detected, and a zero point needs {MIN_STARS}"
    )]
    FewDetected {
        /// Stars that stand alone and were detected.
        detected: usize,
    },
    /// Too few stars whose light is known and whole.
    #[error(
        "too few stars: of {detected} isolated stars detected, {fit} are single, not variable, not saturated and not blended, and a zero point needs {MIN_STARS}"
    )]
    FewFit {
        /// Stars that stand alone and were detected.
        detected: usize,
        /// Those of them that are fit for a zero point.
        fit: usize,
    },
}

impl NoZeroPoint {
    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::FewDetected { .. } => "few_stars_detected",
            Self::FewFit { .. } => "few_stars_fit",
        }
    }
}

/// The color of a star of the zero point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightedColor {
    /// B−V.
    pub bv_mag: f64,
    /// The star's weight in the fit.
    pub weight: f64,
}
