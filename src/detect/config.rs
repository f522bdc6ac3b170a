//! Options of detection.

use crate::frame::{Frame, SaturationFinder};
use serde::{Deserialize, Serialize};

/// How centroids are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum CentroidMethod {
    /// Variance-weighted fit of a pixel-integrated Gaussian: the most accurate.
    #[default]
    GaussianFit,
    /// Mean of the pixels' positions, weighted by their grey level above a threshold: the fastest.
    GreyWeighted,
}

/// Options of [`detect`](super::detect).
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct DetectConfig {
    /// Wanted number of false detections in a million pixels of pure noise.
    pub false_alarms_per_mpx: f64,
    /// Threshold in standard deviations of the filtered noise; overrides `false_alarms_per_mpx`.
    pub threshold_sigma: Option<f64>,
    /// Standard deviation of the spot before pixel integration, in pixels; measured where `None`.
    pub spot_sigma_px: Option<f64>,
    /// How centroids are measured.
    pub centroid: CentroidMethod,
    /// Side of the cells in which background and noise are measured, in pixels.
    pub cell_px: usize,
    /// Most detections that are kept, the strongest.
    pub max_detections: usize,
    /// The level from which on a pixel is saturated, in ADU, where it is below that of the frame
    /// ([`Frame::saturation_level_adu`]).
    pub saturation_adu: Option<f64>,
}

impl DetectConfig {
    /// Default of [`Self::false_alarms_per_mpx`]: one in ten frames of a megapixel.
    pub const DEFAULT_FALSE_ALARMS_PER_MPX: f64 = 0.1;
    /// Default of [`Self::cell_px`]: much larger than a spot, much smaller than vignetting.
    pub const DEFAULT_CELL_PX: usize = 64;
    /// Default of [`Self::max_detections`].
    pub const DEFAULT_MAX_DETECTIONS: usize = 20_000;
}

impl Default for DetectConfig {
    fn default() -> Self {
        Self {
            false_alarms_per_mpx: Self::DEFAULT_FALSE_ALARMS_PER_MPX,
            threshold_sigma: None,
            spot_sigma_px: None,
            centroid: CentroidMethod::default(),
            cell_px: Self::DEFAULT_CELL_PX,
            max_detections: Self::DEFAULT_MAX_DETECTIONS,
            saturation_adu: None,
        }
    }
}

impl DetectConfig {
    /// The level from which on a pixel of `frame` is saturated, in ADU: the lower of the stated one
    /// and that of the frame; infinite where none is known.
    pub(crate) fn saturation_adu(&self, frame: &Frame, finder: &mut SaturationFinder) -> f32 {
        self.or_stated_saturation_adu(finder.level_adu(frame))
    }

    /// The lower of the stated level and that `of_frame`.
    pub(super) fn or_stated_saturation_adu(&self, of_frame: Option<f32>) -> f32 {
        let stated = self.saturation_adu.map_or(f32::INFINITY, |adu| adu as f32);
        of_frame.unwrap_or(f32::INFINITY).min(stated)
    }
}
