//! The parameters of a trial.

use crate::base::units::RAD_PER_DEG;
use crate::identify::{Photometry, Priors, Scale, ScalePrior};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// The simulated frames of a trial, and the priors of their identification.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrialProtocol {
    /// Horizontal field of view, in degrees.
    pub fov_deg: f64,
    /// Columns of the frame.
    pub width_px: usize,
    /// Rows of the frame.
    pub height_px: usize,
    /// Mean number of catalogue stars above the limit on a frame, over the sky.
    pub mean_stars: f64,
    /// Standard deviation of a centroid on each axis, in pixels.
    pub centroid_sigma_px: f64,
    /// Standard deviation of a magnitude.
    pub mag_sigma: f64,
    /// Share of the stars that is missing, in [0, 1].
    pub missing: f64,
    /// False stars, as a share of the true stars before some are removed.
    pub false_stars: f64,
    /// Further false stars, brighter than all true ones.
    pub bright_false_stars: usize,
    /// Relative error of the scale prior, in (0, 1); `None` for no prior.
    pub scale_error: Option<f64>,
    /// Which frames are mirrored.
    pub mirrored: Mirrored,
    /// The kind of magnitudes in the list.
    pub photometry: Photometry,
}

/// Which frames are mirrored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mirrored {
    /// None.
    Never,
    /// Each with probability one half.
    Half,
    /// All.
    Always,
}

impl Default for TrialProtocol {
    /// A field of 10° with typical errors, known to a tenth.
    fn default() -> Self {
        Self {
            fov_deg: 10.0,
            width_px: 1024,
            height_px: 1024,
            mean_stars: 30.0,
            centroid_sigma_px: 0.3,
            mag_sigma: 0.2,
            missing: 0.15,
            false_stars: 0.15,
            bright_false_stars: 0,
            scale_error: Some(0.1),
            mirrored: Mirrored::Half,
            photometry: Photometry::Instrumental,
        }
    }
}

impl TrialProtocol {
    /// The priors of the identification: the scale, off by a random part of its stated error.
    pub(super) fn priors(&self, rng: &mut ChaCha8Rng) -> Priors {
        let scale = self.scale_error.map(|tolerance| {
            let error = 1.0 + tolerance * rng.random_range(-1.0..1.0);
            let fov_rad = self.fov_deg * RAD_PER_DEG / error;
            ScalePrior::by_user(Scale::FieldOfView(fov_rad), tolerance)
        });
        Priors {
            scale,
            ..Priors::default()
        }
    }
}
