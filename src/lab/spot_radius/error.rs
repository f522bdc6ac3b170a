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
    #[error(
        "the camera has no limiting magnitude, so no magnitude can be chosen for the star: give one"
    )]
    NoLimit,
    /// An error could not be measured.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// The star is too faint.
    #[error(
        "a star of V {v_mag} is too faint to measure at these radii: at best, half of the stars of V \
         {limit_vmag:.2} are detected"
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
    #[error("the dark frames have no noise, or their full scale is unknown")]
    NoRelativeNoise,
    /// The noise from frame to frame could not be measured.
    #[error(
        "the dark frames have no temporal noise: expected two or more with the same exposure, and a noise \
         above half a gray level"
    )]
    NoTemporalNoise,
    /// The noise is zero.
    #[error("the noise of a dark pixel is 0 e, expected more than 0")]
    Zero,
}
