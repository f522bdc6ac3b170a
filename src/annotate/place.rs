//! How far may something be from its predicted place? As far as the named stars around it are from theirs.

use crate::base::coords::PixelPoint;
use crate::identify::Identification;
use crate::solve::Solution;

/// Named stars around a place that tell its error.
const AROUND: usize = 6;
/// An error is stated as this many root mean squares of their distances.
const SIGMAS: f64 = 3.0;
/// The light of a bright star may be so far from its middle, in pixels: saturated spots are lopsided.
const SPOT_PX: f64 = 1.0;
/// Beyond this distance from the nearest of the named stars, as a share of the frame's diagonal, the error
/// grows with the square of it: the lens was not measured there.
const REACH_FRACTION: f64 = 0.15;
/// Larger errors than this share of the diagonal tell nothing.
const MAX_FRACTION: f64 = 0.006;

/// The errors of predicted places in a frame.
#[derive(Debug)]
pub(super) struct PlaceErrors {
    /// The named stars, and the square of their distance from their place on each axis.
    stars: Vec<(PixelPoint, f64)>,
    diagonal_px: f64,
    /// Whether the lens is known everywhere: a pinhole without distortion needs no star nearby.
    is_simple: bool,
    spot_px: f64,
}

impl PlaceErrors {
    pub fn new(solution: &Solution, found: &Identification) -> Self {
        let stars = found.matches.iter().filter_map(|named| {
            let predicted = found.pixel_of(&named.light)?;
            let position = solution.source(named.source).position;
            let distance_px = predicted.distance_to(&position);
            Some((position, distance_px * distance_px / 2.0))
        });
        let camera = &found.camera;
        Self {
            stars: stars.collect(),
            diagonal_px: 2.0 * camera.radius_px(),
            is_simple: camera.is_pinhole() && camera.distortion().is_none(),
            spot_px: SPOT_PX.max(solution.spot_sigma_px.unwrap_or(0.0)),
        }
    }

    /// The light of what is predicted at `place` is within so many pixels of it.
    pub fn at(&self, place: &PixelPoint) -> f64 {
        let distance_sq = |(star, _): &(PixelPoint, f64)| {
            let (dx, dy) = (star.x - place.x, star.y - place.y);
            dx * dx + dy * dy
        };
        let mut around: Vec<(f64, f64)> = self
            .stars
            .iter()
            .map(|star| (distance_sq(star), star.1))
            .collect();
        let count = AROUND.min(around.len());
        if count == 0 {
            return f64::INFINITY;
        }
        around.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0));
        let nearest_sq = around[..count]
            .iter()
            .map(|star| star.0)
            .fold(f64::INFINITY, f64::min);
        let mean_sq = around[..count].iter().map(|star| star.1).sum::<f64>() / count as f64;
        let reach = nearest_sq.sqrt() / (REACH_FRACTION * self.diagonal_px);
        let growth = if self.is_simple {
            1.0
        } else {
            reach.max(1.0).powi(2)
        };
        SIGMAS * libm::sqrt(mean_sq) * growth + self.spot_px
    }

    /// Whether an error is too large for a name.
    pub fn is_large(&self, error_px: f64) -> bool {
        error_px > (MAX_FRACTION * self.diagonal_px).max(4.0 * self.spot_px)
    }
}
