//! How far apart the observed and the predicted star of a true pair lie, in position and magnitude.

use super::candidate::NameCandidate;
use super::packed::LANES;
use super::packed::{Lanes, Packed};
use crate::base::exponential::exp_of_negative;
use crate::identify::field::Photometry;
use multiversion::multiversion;
use std::f64::consts::PI;

/// Position: most true pairs have the stated errors, some have larger ones (unresolved companions,
/// the catalogue's own errors), a few are far off (saturated, bloomed).
const WIDE_FRACTION: f64 = 0.04;
const WIDE_SIGMAS: f64 = 4.0;
const FAR_FRACTION: f64 = 0.01;
/// Share of the saturated stars that are far off.
const FAR_FRACTION_SATURATED: f64 = 0.2;
/// Standard deviation of those on each axis, in units of the gate.
const FAR_SIGMA: f64 = 0.4;
/// Magnitude: most true pairs have the frame's scatter, some have this many times it (variable
/// stars, unusual colors, blends).
const OUTLIER_FRACTION: f64 = 0.1;
const OUTLIER_SCATTER: f64 = 3.0;
/// Scatter of the magnitudes before it is measured, and the smallest.
const FIRST_SCATTER_MAG: f64 = 0.6;
const MIN_SCATTER_MAG: f64 = 0.15;
/// Share of saturated stars that are brighter than measured, by up to this many magnitudes.
const BRIGHTER_FRACTION: f64 = 0.5;
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
pub fn position_density(candidate: &NameCandidate, distance_px: f64, is_saturated: bool) -> f64 {
    let (sigma_px, gate_px) = ([candidate.sigma_px], [candidate.gate_px]);
    let saturated = [f64::from(u8::from(is_saturated))];
    position_densities(&[distance_px], &sigma_px, &gate_px, &saturated)[0]
}

/// The same for several pairs, with the errors and gates of the observed stars, and 1 for those that
/// are saturated.
#[inline(always)]
pub fn position_densities<const N: usize>(
    distances_px: &[f64; N],
    sigmas_px: &[f64; N],
    gates_px: &[f64; N],
    saturated: &[f64; N],
) -> [f64; N] {
    /// Of so many times the width, the exponential is the root of the square of that number.
    const WIDE_ROOT: i32 = (WIDE_SIGMAS * WIDE_SIGMAS) as i32;
    let (mut of_wide, mut of_far) = ([0.0; N], [0.0; N]);
    let (mut sigmas_sq, mut far_sq) = ([0.0; N], [0.0; N]);
    for n in 0..N {
        let distance_sq = distances_px[n] * distances_px[n];
        sigmas_sq[n] = sigmas_px[n] * sigmas_px[n];
        let far_px = FAR_SIGMA * gates_px[n];
        far_sq[n] = (far_px * far_px).max(sigmas_sq[n]);
        of_wide[n] = -distance_sq / (2.0 * (sigmas_sq[n] * WIDE_SIGMAS.powi(2)));
        of_far[n] = -distance_sq / (2.0 * far_sq[n]);
    }
    let (wide, far) = (exp_of_negative(of_wide), exp_of_negative(of_far));
    let density = |share: f64, variance: f64, falloff: f64| share * falloff / (2.0 * PI * variance);
    let mut densities = [0.0; N];
    for n in 0..N {
        let far_share = FAR_FRACTION + saturated[n] * (FAR_FRACTION_SATURATED - FAR_FRACTION);
        let narrow = wide[n].powi(WIDE_ROOT);
        densities[n] = density(1.0 - WIDE_FRACTION - far_share, sigmas_sq[n], narrow)
            + density(WIDE_FRACTION, sigmas_sq[n] * WIDE_SIGMAS.powi(2), wide[n])
            + density(far_share, far_sq[n], far[n]);
    }
    densities
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

/// Densities of magnitude differences, per magnitude; their sum is that of all true pairs.
#[derive(Debug, Clone, Copy)]
pub struct MagnitudeDensities {
    /// Of pairs that differ by the frame's scatter.
    pub by_scatter: Lanes,
    /// Of those that differ by more: variable stars, unusual colors, blends, saturated stars.
    pub otherwise: Lanes,
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

    /// The catalogue's magnitude that is expected of an observed star of this magnitude.
    #[inline(always)]
    pub fn expected_v_mag(&self, mag: f64) -> f64 {
        self.v_mag + self.slope * (mag - self.at_mag)
    }

    /// Catalogue magnitudes minus those that are expected of the observed stars.
    #[inline(always)]
    fn differences(&self, packed: &Packed) -> Lanes {
        let mut differences = packed.v_mag;
        for (difference, mag) in differences.iter_mut().zip(packed.mag) {
            *difference -= self.expected_v_mag(mag);
        }
        differences
    }

    /// Densities of the magnitude differences of true pairs, per magnitude.
    #[inline(always)]
    pub fn densities(&self, packed: &Packed) -> MagnitudeDensities {
        let differences = self.differences(packed);
        let outlying = OUTLIER_SCATTER * self.scatter_mag;
        let mut of_outliers = differences;
        for exponent in &mut of_outliers {
            let relative = *exponent / outlying;
            *exponent = -0.5 * (relative * relative);
        }
        let of_outliers = exp_of_negative(of_outliers);
        let density = |share: f64, sigma: f64, falloff: f64| share * falloff / (ROOT_TAU * sigma);
        let (mut by_scatter, mut otherwise) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let as_measured = 1.0 - BRIGHTER_FRACTION * packed.saturated[lane];
            let (outlier, difference) = (of_outliers[lane], differences[lane]);
            let is_brighter = (-BRIGHTER_MAG..0.0).contains(&difference);
            let brighter = if is_brighter {
                BRIGHTER_FRACTION / BRIGHTER_MAG
            } else {
                0.0
            };
            // Of three times the scatter: the exponential is the ninth root.
            let plain = density(1.0 - OUTLIER_FRACTION, self.scatter_mag, outlier.powi(9));
            by_scatter[lane] = as_measured * plain;
            otherwise[lane] = as_measured * density(OUTLIER_FRACTION, outlying, outlier)
                + packed.saturated[lane] * brighter;
        }
        MagnitudeDensities {
            by_scatter,
            otherwise,
        }
    }

    /// Fits the scatter to the candidates that are likely true, and with `has_line` first the line.
    pub fn fit(&mut self, candidates: &[Packed], has_line: bool) {
        fit_in_lanes(self, candidates, has_line);
    }

    /// The line through the candidates that are likely true.
    #[inline(always)]
    fn fit_line(&mut self, candidates: &[Packed]) {
        let [weight, mag, v_mag] = sums(candidates, |packed, lane| {
            let weight = packed.weight(lane);
            [
                weight,
                weight * packed.mag[lane],
                weight * packed.v_mag[lane],
            ]
        });
        if weight < 1.0 {
            return;
        }
        let (mag, v_mag) = (mag / weight, v_mag / weight);
        // Of outliers, only the sign and a limit count.
        let limit = 2.0 * self.scatter_mag;
        let [xx, xy] = sums(candidates, |packed, lane| {
            let x = packed.mag[lane] - mag;
            let residual = (packed.v_mag[lane] - v_mag - x).max(-limit).min(limit);
            let weighted = packed.weight(lane) * x;
            [weighted * x, weighted * residual]
        });
        let prior = (self.scatter_mag / SLOPE_SIGMA).powi(2);
        (self.at_mag, self.v_mag) = (mag, v_mag);
        self.slope = 1.0 + xy / (xx + prior);
    }

    /// The scatter about the line of the candidates that are likely true.
    #[inline(always)]
    fn fit_scatter(&mut self, candidates: &[Packed]) {
        let limit_sq = (OUTLIER_SCATTER * self.scatter_mag).powi(2);
        let [squares, weights] = sums(candidates, |packed, lane| {
            let difference = packed.v_mag[lane] - self.expected_v_mag(packed.mag[lane]);
            let weight = packed.weight(lane);
            [weight * (difference * difference).min(limit_sq), weight]
        });
        let sum = PRIOR_STARS * FIRST_SCATTER_MAG.powi(2) + squares;
        self.scatter_mag = (sum / (PRIOR_STARS + weights)).sqrt().max(MIN_SCATTER_MAG);
    }
}

impl Packed {
    /// The weight of a candidate where zero point and scatter are measured: its probability, where it
    /// is likely and the observed star is not saturated.
    #[inline(always)]
    fn weight(&self, lane: usize) -> f64 {
        let p_chance = self.p_chance[lane];
        let is_measuring = (p_chance <= MEASURING_CHANCE) & (self.saturated[lane] == 0.0);
        if is_measuring { 1.0 - p_chance } else { 0.0 }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn fit_in_lanes(relation: &mut MagnitudeRelation, candidates: &[Packed], has_line: bool) {
    if has_line {
        relation.fit_line(candidates);
    }
    relation.fit_scatter(candidates);
}

/// Sums of `terms` over all candidates.
#[inline(always)]
fn sums<const N: usize>(
    candidates: &[Packed],
    terms: impl Fn(&Packed, usize) -> [f64; N],
) -> [f64; N] {
    let mut sums = [[0.0; LANES]; N];
    for packed in candidates {
        for lane in 0..LANES {
            let terms = terms(packed, lane);
            for (sum, term) in sums.iter_mut().zip(terms) {
                sum[lane] += term;
            }
        }
    }
    sums.map(|lanes| lanes.iter().sum())
}
