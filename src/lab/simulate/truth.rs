//! The ground truth of a simulated frame.

use super::strays::{CosmicRay, Trail};
use crate::base::coords::PixelPoint;
use crate::catalog::StarIndex;
use nalgebra::Vector3;

/// The ground truth of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Truth {
    /// Stars with positions on the frame: those of the catalogue in its order, then false ones.
    pub stars: Vec<TrueStar>,
    /// Stars just outside the frame whose light reaches it, in the same order.
    pub beyond: Vec<TrueStar>,
    /// Satellite trails.
    pub trails: Vec<Trail>,
    /// Cosmic rays.
    pub cosmic_rays: Vec<CosmicRay>,
    /// Mean electrons of sky and dark current in a pixel, without the fixed pattern and hot pixels.
    pub background_e: f64,
    /// Angular velocity about the camera axes, in radians per second.
    pub angular_rate_rad_s: Vector3<f64>,
    /// Motion of a star at the centre along x and y during the exposure, in pixels.
    pub motion_px: [f64; 2],
}

/// A star on a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TrueStar {
    /// Unique number among the stars of the frame.
    pub number: usize,
    /// The catalogue star; none for a false star.
    pub catalog: Option<StarIndex>,
    /// Position in the middle of the exposure.
    pub position: PixelPoint,
    /// True Johnson V magnitude.
    pub v_mag: f64,
    /// Expected electrons on all its pixels.
    pub electrons: f64,
}
