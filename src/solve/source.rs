//! One source of a frame or of a list of centroids.

use crate::base::coords::PixelPoint;
use crate::centroids::ListedCentroid;
use crate::detect::{Detection, DetectionFlags};
use crate::photometry::instrumental_mag;

/// One source: a detection, or a line of a centroid list.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Source {
    /// Its centroid.
    pub position: PixelPoint,
    /// What only a detection has.
    pub measured: Option<Measured>,
    /// Flux above the background, in the frame's own units, if known.
    pub flux: Option<f64>,
}

/// What only a detection has.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Measured {
    /// Standard errors of the centroid in x and y, in pixels.
    pub sigma_px: [f64; 2],
    /// Brightest pixel above the background, in the frame's own units.
    pub peak: f64,
    /// Flux over its standard error.
    pub snr: f64,
    /// What is unusual about it.
    pub flags: DetectionFlags,
}

impl Source {
    /// Its instrumental magnitude, if the flux is known.
    pub(crate) fn instrumental_mag(&self) -> Option<f64> {
        self.flux.filter(|flux| *flux > 0.0).map(instrumental_mag)
    }
}

impl From<&Detection> for Source {
    fn from(detection: &Detection) -> Self {
        Self {
            position: detection.position,
            measured: Some(Measured {
                sigma_px: [detection.sigma_x_px, detection.sigma_y_px],
                peak: detection.peak_adu,
                snr: detection.snr,
                flags: detection.flags,
            }),
            flux: Some(detection.flux_adu),
        }
    }
}

impl From<&ListedCentroid> for Source {
    fn from(centroid: &ListedCentroid) -> Self {
        Self {
            position: centroid.position,
            measured: None,
            flux: centroid.flux,
        }
    }
}
