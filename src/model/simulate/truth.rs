//! What is truly on a frame.

use super::strays::{CosmicRay, Trail};
use crate::base::coords::PixelPoint;
use crate::sky::catalog::StarIndex;
use nalgebra::Vector3;

/// What is truly on a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Truth {
    /// The stars whose place is on the frame: those of the catalogue in its order, then false ones.
    pub stars: Vec<TrueStar>,
    /// Those just beyond its border that send light into it, in the same order.
    pub beyond: Vec<TrueStar>,
    /// The trails of satellites.
    pub trails: Vec<Trail>,
    /// Where cosmic rays have left charge.
    pub cosmic_rays: Vec<CosmicRay>,
    /// Electrons of sky and dark current in a pixel, on average over the frame; what the pixels' own differences and hot pixels
    /// add is not counted.
    pub background_e: f64,
    /// The camera's angular velocity about its own axes, in radians a second.
    pub angular_rate_rad_s: Vector3<f64>,
    /// How far a star in the middle of the frame moves along x and y during the exposure, in pixels.
    pub motion_px: [f64; 2],
}

/// A star that is on a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueStar {
    /// Counts the stars of a frame: no two have the same.
    pub number: usize,
    /// The catalogue star; a false star has none.
    pub catalog: Option<StarIndex>,
    /// Where it stands; in the middle of its way where it moves.
    pub position: PixelPoint,
    /// Johnson V magnitude, as it truly is.
    pub v_mag: f64,
    /// Electrons to be expected of it, on all its pixels.
    pub electrons: f64,
}
