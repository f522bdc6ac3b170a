//! Why a defocus study has no result.

use crate::lab::defocus::MeasureError;
use crate::predict::ScenarioError;

/// Why there is no study of a star.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DefocusError {
    /// The camera or its conditions are invalid.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The camera has no limiting magnitude.
    #[error("the camera has no limit from which a magnitude follows")]
    NoLimit,
    /// An error could not be measured.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// The star is too faint.
    #[error(
        "a star of V {v_mag} is found too seldom at these radii to measure it: half of the stars are found at V {limit_vmag:.2} at best"
    )]
    TooFaint {
        /// V magnitude of the star.
        v_mag: f64,
        /// The faintest V magnitude at which half of the stars are found, over all radii.
        limit_vmag: f64,
    },
}

/// Why the noise of a pixel without light is not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NoiseError {
    /// The dark frames have no noise, or their full scale is unknown.
    #[error("the dark frames have no noise, or no full scale")]
    NoRelativeNoise,
    /// The noise from frame to frame could not be measured.
    #[error(
        "the dark frames have no temporal noise: expected two or more of one exposure, with a noise above half a gray level"
    )]
    NoTemporalNoise,
    /// The noise is zero.
    #[error("the noise of a pixel in the dark is 0 e, expected more")]
    Zero,
}
