//! How far apart the observed and the predicted star of a true pair lie, in position and magnitude.

use super::candidate::Candidate;
use crate::identify::field::{ObservedStar, Photometry, StarField};
use std::f64::consts::PI;

/// Position: most true pairs have the stated errors, some have larger ones (unresolved companions,
/// the catalogue's own errors), a few are far off (saturated, bloomed).
const WIDE_SHARE: f64 = 0.04;
const WIDE_SIGMAS: f64 = 4.0;
const FAR_SHARE: f64 = 0.01;
/// Share of the saturated stars that are far off.
const FAR_SHARE_SATURATED: f64 = 0.2;
/// Standard deviation of those on each axis, in units of the gate.
const FAR_SIGMA: f64 = 0.4;
/// Magnitude: most true pairs have the frame's scatter, some have this many times it (variable
/// stars, unusual colours, blends).
const OUTLIER_SHARE: f64 = 0.1;
const OUTLIER_SCATTER: f64 = 3.0;
/// Scatter of the magnitudes before it is measured, and the smallest.
const FIRST_SCATTER_MAG: f64 = 0.6;
const LEAST_SCATTER_MAG: f64 = 0.15;
/// Share of saturated stars that are brighter than measured, by up to this many magnitudes.
const BRIGHTER_SHARE: f64 = 0.5;
const BRIGHTER_MAG: f64 = 6.0;
/// Standard deviation of the slope of catalogue over observed magnitudes about 1, before it is
/// measured: tone curves of JPEGs compress light.
const SLOPE_SIGMA: f64 = 0.3;
/// √(2π).
const ROOT_TAU: f64 = 2.506_628_274_631_000_5;
/// Candidates that are at least this sure measure zero point and scatter.
const MEASURING_CHANCE: f64 = 0.5;
/// Pseudo-stars with the first scatter.
const PRIOR_STARS: f64 = 4.0;

/// Density of the distance between the stars of a true pair, per square pixel, at `distance_px`.
pub fn position_density(candidate: &Candidate, distance_px: f64, is_saturated: bool) -> f64 {
    let far_share = if is_saturated {
        FAR_SHARE_SATURATED
    } else {
        FAR_SHARE
    };
    let distance_sq = distance_px.powi(2);
    let sigma_sq = candidate.sigma_px.powi(2);
    let density = |share: f64, variance: f64, falloff: f64| share * falloff / (2.0 * PI * variance);
    let falloff = |variance: f64| (-distance_sq / (2.0 * variance)).exp();
    let wide_sq = sigma_sq * WIDE_SIGMAS.powi(2);
    let far_sq = (FAR_SIGMA * candidate.gate_px).powi(2).max(sigma_sq);
    let wide = falloff(wide_sq);
    // Of so many times the width, the exponential is the root of the square of that number.
    let narrow = wide.powi((WIDE_SIGMAS * WIDE_SIGMAS) as i32);
    density(1.0 - WIDE_SHARE - far_share, sigma_sq, narrow)
        + density(WIDE_SHARE, wide_sq, wide)
        + density(far_share, far_sq, falloff(far_sq))
}

/// The catalogue's magnitude of a star of a certain observed magnitude: a line, and the scatter
/// about it.
#[derive(Debug, Clone, Copy, Default)]
pub struct MagnitudeRelation {
    /// The observed magnitude where the line is fixed, and V there.
    at_mag: f64,
    v_mag: f64,
    slope: f64,
    scatter_mag: f64,
}

/// Densities of a magnitude difference, per magnitude; their sum is that of all true pairs.
#[derive(Debug, Clone, Copy)]
pub struct MagnitudeDensities {
    /// Of pairs that differ by the frame's scatter.
    pub by_scatter: f64,
    /// Of those that differ by more: variable stars, unusual colours, blends, saturated stars.
    pub otherwise: f64,
}

impl MagnitudeRelation {
    /// Before it is measured.
    pub fn new(zero_point_mag: f64, photometry: Photometry) -> Self {
        Self {
            at_mag: 0.0,
            v_mag: match photometry {
                Photometry::Instrumental => zero_point_mag,
                Photometry::JohnsonV => 0.0,
            },
            slope: 1.0,
            scatter_mag: FIRST_SCATTER_MAG,
        }
    }

    /// Catalogue magnitude minus that which is expected of the observed star.
    fn difference(&self, star: &ObservedStar, v_mag: f64) -> f64 {
        v_mag - self.expected_v_mag(star)
    }

    /// The catalogue's magnitude that is expected of the observed star.
    pub fn expected_v_mag(&self, star: &ObservedStar) -> f64 {
        self.v_mag + self.slope * (star.mag - self.at_mag)
    }

    /// Densities of the magnitude difference of a true pair, per magnitude.
    pub fn densities(&self, star: &ObservedStar, v_mag: f64) -> MagnitudeDensities {
        let difference = self.difference(star, v_mag);
        let density = |share: f64, sigma: f64, falloff: f64| share * falloff / (ROOT_TAU * sigma);
        let outlying = OUTLIER_SCATTER * self.scatter_mag;
        let of_outliers = (-0.5 * (difference / outlying).powi(2)).exp();
        // Of three times the scatter: the exponential is the ninth root.
        let plain = MagnitudeDensities {
            by_scatter: density(1.0 - OUTLIER_SHARE, self.scatter_mag, of_outliers.powi(9)),
            otherwise: density(OUTLIER_SHARE, outlying, of_outliers),
        };
        if !star.is_saturated {
            return plain;
        }
        let is_brighter = (-BRIGHTER_MAG..0.0).contains(&difference);
        let brighter = f64::from(u8::from(is_brighter)) / BRIGHTER_MAG;
        MagnitudeDensities {
            by_scatter: (1.0 - BRIGHTER_SHARE) * plain.by_scatter,
            otherwise: (1.0 - BRIGHTER_SHARE) * plain.otherwise + BRIGHTER_SHARE * brighter,
        }
    }

    /// The line through the candidates that are likely true.
    pub fn fit_zero_point(&mut self, field: &StarField, candidates: &[Candidate]) {
        let likely = || measuring(field, candidates);
        let weight: f64 = likely().map(|(_, _, weight)| weight).sum();
        if weight < 1.0 {
            return;
        }
        let mean = |of: &dyn Fn(&ObservedStar, f64) -> f64| {
            likely().map(|(s, v, w)| w * of(s, v)).sum::<f64>() / weight
        };
        let (mag, v_mag) = (mean(&|s, _| s.mag), mean(&|_, v| v));
        let (mut xx, mut xy) = (0.0, 0.0);
        for (star, v, w) in likely() {
            // Of outliers, only the sign and a limit count.
            let limit = 2.0 * self.scatter_mag;
            let residual = (v - v_mag - (star.mag - mag)).clamp(-limit, limit);
            xx += w * (star.mag - mag).powi(2);
            xy += w * (star.mag - mag) * residual;
        }
        let prior = (self.scatter_mag / SLOPE_SIGMA).powi(2);
        (self.at_mag, self.v_mag) = (mag, v_mag);
        self.slope = 1.0 + xy / (xx + prior);
    }

    /// The scatter about the line of the candidates that are likely true.
    pub fn fit_scatter(&mut self, field: &StarField, candidates: &[Candidate]) {
        let limit_sq = (OUTLIER_SCATTER * self.scatter_mag).powi(2);
        let mut sum = PRIOR_STARS * FIRST_SCATTER_MAG.powi(2);
        let mut weights = PRIOR_STARS;
        for (star, v_mag, weight) in measuring(field, candidates) {
            sum += weight * self.difference(star, v_mag).powi(2).min(limit_sq);
            weights += weight;
        }
        self.scatter_mag = (sum / weights).sqrt().max(LEAST_SCATTER_MAG);
    }
}

/// The unsaturated observed stars of likely candidates, their V magnitude and probability.
fn measuring<'a>(
    field: &'a StarField,
    candidates: &'a [Candidate],
) -> impl Iterator<Item = (&'a ObservedStar, f64, f64)> {
    candidates
        .iter()
        .filter(|candidate| candidate.p_chance <= MEASURING_CHANCE)
        .map(|candidate| {
            let star = &field.stars[candidate.observed];
            (star, candidate.v_mag, 1.0 - candidate.p_chance)
        })
        .filter(|(star, ..)| !star.is_saturated)
}
