//! A pair of stars that may be one.

use crate::base::coords::{Icrs, PixelPoint, UnitVector};
use crate::catalog::StarIndex;
use crate::identify::pairing::{NearPair, Pair};
use crate::identify::predict::PredictedStar;

/// An observed star and the catalogue star that it may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NameCandidate {
    /// Position in [`StarField::stars`](crate::identify::StarField::stars).
    pub observed: usize,
    /// Position in the list of predicted stars.
    pub predicted: usize,
    /// The catalogue star.
    pub star: StarIndex,
    /// Its own V magnitude.
    pub own_v_mag: f32,
    /// V magnitude of its light: its own, or that of the blend.
    pub v_mag: f64,
    /// Position of its light in the frame.
    pub light: PixelPoint,
    /// Direction of its light: its own, or that of the blend.
    pub direction: UnitVector<Icrs>,
    /// Standard error of the place of its light on each axis, in pixels: 0 for a single star.
    pub light_sigma_px: f64,
    /// Distance between the observed position and that of the light, in pixels.
    pub distance_px: f64,
    /// Standard error of that distance on each axis, in pixels.
    pub sigma_px: f64,
    /// The largest distance of a candidate of this observed star, in pixels.
    pub gate_px: f64,
    /// Probability that a star among such neighbors is measured by this light.
    pub probability: f64,
    /// Odds that another star of its blend was seen rather than this one.
    pub rivals: f64,
    /// Probability that it is no true pair.
    pub p_chance: f64,
}

impl NameCandidate {
    /// A candidate whose star is single. `sigma_px` and `gate_px` are those of the observed star.
    pub fn new(near: &NearPair, predicted: &PredictedStar, sigma_px: f64, gate_px: f64) -> Self {
        Self {
            observed: near.observed,
            predicted: near.predicted,
            star: predicted.star,
            own_v_mag: predicted.v_mag,
            v_mag: f64::from(predicted.v_mag),
            light: predicted.pixel,
            direction: predicted.direction,
            light_sigma_px: 0.0,
            distance_px: near.distance_px,
            sigma_px,
            gate_px,
            probability: 1.0,
            rivals: 0.0,
            p_chance: 1.0,
        }
    }

    /// The candidate as a pair.
    pub fn pair(&self) -> Pair {
        Pair {
            observed: self.observed,
            star: self.star,
            v_mag: self.own_v_mag,
            direction: self.direction,
            light_sigma_px: self.light_sigma_px,
            residual_px: self.distance_px,
            p_chance: self.p_chance,
        }
    }
}
