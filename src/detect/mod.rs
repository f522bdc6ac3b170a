//! From a frame to its stars: positions with standard errors, fluxes and flags.

use crate::coords::PixelPoint;

/// One detected source, in the frame's own units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// The centroid.
    pub position: PixelPoint,
    /// Standard error of the centroid in x, in pixels.
    pub sigma_x_px: f64,
    /// Standard error of the centroid in y, in pixels.
    pub sigma_y_px: f64,
    /// Flux above the background, in ADU.
    pub flux_adu: f64,
    /// Brightest pixel above the background, in ADU.
    pub peak_adu: f64,
    /// Flux over its standard error.
    pub snr: f64,
    /// What is unusual about it.
    pub flags: DetectionFlags,
}

/// What is unusual about a detection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DetectionFlags {
    /// The core reaches the detector's full scale.
    pub saturated: bool,
    /// Sharper than any spot of this camera: a hot pixel or a cosmic ray.
    pub hot_pixel: bool,
    /// Elongated well beyond the spot: a satellite, an aircraft, a streak.
    pub trail: bool,
    /// Wider than a spot: a galaxy, a comet, a lamp, an edge of the landscape.
    pub extended: bool,
    /// Touches another detection, and was fitted together with it.
    pub blended: bool,
    /// Cut by the frame's border.
    pub border: bool,
}

impl DetectionFlags {
    /// Whether the source may be a star at the position given.
    pub fn is_star_like(&self) -> bool {
        !(self.hot_pixel || self.trail || self.extended)
    }
}

/// All sources of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Detections {
    /// Brightest first.
    pub sources: Vec<Detection>,
    /// Median background, in ADU.
    pub background_adu: f64,
    /// Median standard deviation of a pixel's background, in ADU.
    pub noise_adu: f64,
    /// Standard deviation of the Gaussian spot before pixel integration, in pixels.
    pub spot_sigma_px: f64,
}
