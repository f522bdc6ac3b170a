//! Names: which catalogue star each observed star is, and the probability that the name is chance.
//!
//! (observed stars, predicted stars, fit) → candidates: pairs that lie near each other → the
//! probability of each → names
//!
//! An observed star is a catalogue star of the frame, or it is none: noise, an edge, a satellite, a
//! star that the catalogue lacks. The candidate of observed star i and catalogue star j has the odds
//!
//! `o = C f g / ((1 − C) λ)`
//!
//! with the probability C that a star of j's magnitude is detected at its place ([`completeness`]),
//! the densities f and g of the differences in position and magnitude of a true pair
//! ([`likelihood`]), and the density λ of observed stars of i's magnitude, at its place, that are
//! not catalogue stars ([`unrelated`]). Other candidates of i and of j compete with it: its
//! probability is `o / (1 + Σ o)` over all candidates of both.
//!
//! C, λ, and the zero point and scatter of the magnitudes are unknown at first. They are measured
//! in the frame with the probabilities, and the probabilities computed again (expectation
//! maximisation: Dempster, Laird & Rubin 1977, J. R. Stat. Soc. B 39, 1).
//!
//! # Reference
//! Sutherland & Saunders 1992, MNRAS 259, 413, for the likelihood ratio and the reliability of a
//! counterpart; Budavári & Szalay 2008, ApJ 679, 301, for the Bayesian form.

mod candidate;
mod completeness;
mod likelihood;
mod unrelated;

pub use candidate::Candidate;
pub use likelihood::position_density;

use super::field::{ObservedStar, Photometry, StarField};
use super::hypothesis::Hypothesis;
use super::pairing::Pairing;
use super::predict::PredictedStar;
use completeness::Completeness;
use likelihood::MagnitudeRelation;
use std::f64::consts::PI;
use unrelated::Unrelated;

/// Rounds of expectation maximisation in the first fit, and after that, when little changes.
const FIRST_ROUNDS: usize = 5;
const FURTHER_ROUNDS: usize = 2;
/// Candidates lie within this many standard errors, …
const GATE_SIGMAS: f64 = 10.0;
/// … or, where bright stars are rare, so far that this number of unrelated stars as bright as the
/// observed one lies within that distance: saturated and bloomed stars are measured badly, …
const GATE_CHANCE: f64 = 0.01;
/// … but always within these fractions of the frame's diagonal.
const ERROR_GATE_SHARE: f64 = 0.005;
const RARE_GATE_SHARE: f64 = 0.01;

/// Computes the probabilities of names. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Naming {
    /// The candidates, in the order of the observed stars.
    pub candidates: Vec<Candidate>,
    /// The sum of odds of each observed star, and of each predicted star.
    odds_of_observed: Vec<f64>,
    odds_of_predicted: Vec<f64>,
    /// The probability of each predicted star that it is observed, and of each observed star that
    /// it has a name.
    is_observed: Vec<f64>,
    has_name: Vec<f64>,
    by_place: bool,
    completeness: Completeness,
    unrelated: Unrelated,
    magnitudes: MagnitudeRelation,
}

/// The stars of a frame, observed and predicted, both brightest first.
#[derive(Clone, Copy)]
pub struct Stars<'a> {
    /// The observed stars and the frame.
    pub field: &'a StarField,
    /// The predicted stars.
    pub predicted: &'a [PredictedStar],
}

impl Naming {
    /// Starts with a new field and a first estimate of its zero point.
    ///
    /// With `by_place`, the density of unrelated detections and the share of the stars that are
    /// detected are measured from place to place, for which few stars say too little.
    pub fn start(&mut self, stars: Stars, zero_point_mag: f64, by_place: bool) {
        self.by_place = by_place;
        self.unrelated.start(stars.field.stars.len());
        self.magnitudes = MagnitudeRelation::new(zero_point_mag, stars.field.photometry);
        self.has_name.clear();
        self.has_name.resize(stars.field.stars.len(), 0.5);
        self.completeness.start(stars.predicted.len());
    }

    /// Finds the candidates under `hypothesis`; `excess_sigma_px` is what the stated centroid
    /// errors lack.
    pub fn find_candidates(
        &mut self,
        stars: Stars,
        (hypothesis, excess_sigma_px): (&Hypothesis, f64),
        pairing: &mut Pairing,
    ) {
        let Stars { field, predicted } = stars;
        let gate = Gate::new(field, excess_sigma_px);
        let radius_px = |index: usize, star: &ObservedStar| gate.radius_px(index, star);
        let difference =
            |o: &ObservedStar, p: &PredictedStar| hypothesis.mag_difference(o, p, field.photometry);
        let near = pairing.candidates((&field.stars, predicted), radius_px, difference);
        self.candidates.clear();
        let candidates = near.iter().map(|near| {
            let star = &field.stars[near.observed];
            let sigma_px = star.sigma_px.hypot(excess_sigma_px);
            Candidate::new(
                near,
                &predicted[near.predicted],
                (sigma_px, gate.radius_px(near.observed, star)),
            )
        });
        self.candidates.extend(candidates);
    }

    /// Computes the probabilities of the candidates.
    pub fn compute(&mut self, stars: Stars, is_first: bool) {
        for candidate in &mut self.candidates {
            let star = &stars.field.stars[candidate.observed];
            let density = position_density(candidate, candidate.distance_px, star.is_saturated);
            candidate.position_density = candidate.share * density;
        }
        let rounds = if is_first {
            FIRST_ROUNDS
        } else {
            FURTHER_ROUNDS
        };
        for round in 0..rounds {
            // What depends on place changes little from round to round.
            let is_by_place = self.by_place && (round == 0 || (is_first && round + 1 == rounds));
            if is_by_place {
                let (field, has_name) = (stars.field, &self.has_name);
                self.unrelated.measure_crowding(field, has_name);
            }
            self.expect(stars);
            self.maximise(stars, is_by_place);
        }
        self.expect(stars);
    }

    /// Probabilities of the candidates from what was measured in the frame.
    fn expect(&mut self, stars: Stars) {
        let Stars { field, predicted } = stars;
        self.unrelated.measure(field, &self.has_name);
        clear(&mut self.odds_of_observed, field.stars.len());
        clear(&mut self.odds_of_predicted, predicted.len());
        // Candidates of the same star follow each other.
        let (mut last, mut as_bright) = (usize::MAX, 0);
        for candidate in &mut self.candidates {
            let (i, j) = (candidate.observed, candidate.predicted);
            let star = &field.stars[i];
            let densities = self.magnitudes.densities(star, candidate.v_mag);
            if i != last {
                let expected_v_mag = self.magnitudes.expected_v_mag(star);
                as_bright = predicted.partition_point(|p| f64::from(p.v_mag) < expected_v_mag);
                last = i;
            }
            let like = self.completeness.odds_as(j, as_bright) * densities.by_scatter
                + self.completeness.odds(j) * densities.otherwise;
            candidate.odds = candidate.position_density * like / self.unrelated.density(i);
            self.odds_of_observed[i] += candidate.odds;
            self.odds_of_predicted[j] += candidate.odds;
        }
        clear(&mut self.has_name, field.stars.len());
        clear(&mut self.is_observed, predicted.len());
        for candidate in &mut self.candidates {
            let (i, j) = (candidate.observed, candidate.predicted);
            let all = self.odds_of_observed[i] + self.odds_of_predicted[j];
            // The candidate's own odds are in both sums.
            let others = (all - 2.0 * candidate.odds).max(0.0);
            candidate.p_chance = (1.0 + others) / (1.0 + others + candidate.odds);
            self.has_name[i] += 1.0 - candidate.p_chance;
            self.is_observed[j] += 1.0 - candidate.p_chance;
        }
    }

    /// What the frame shows, from the probabilities.
    fn maximise(&mut self, stars: Stars, is_by_place: bool) {
        let Stars { field, predicted } = stars;
        self.completeness.measure_shares(&self.is_observed);
        if is_by_place {
            self.completeness
                .measure_visibility(field, predicted, &self.is_observed);
        }
        self.completeness.set_odds();
        if stars.field.photometry == Photometry::Instrumental {
            self.magnitudes
                .fit_zero_point(stars.field, &self.candidates);
        }
        self.magnitudes.fit_scatter(stars.field, &self.candidates);
    }
}

/// How far a candidate may lie from an observed star.
struct Gate {
    excess_sigma_px: f64,
    /// Of the brightest star.
    rare_px: f64,
    diagonal_px: f64,
}

impl Gate {
    fn new(field: &StarField, excess_sigma_px: f64) -> Self {
        let area_px2 = field.width_px * field.height_px;
        Self {
            excess_sigma_px,
            rare_px: (GATE_CHANCE * area_px2 / PI).sqrt(),
            diagonal_px: field.width_px.hypot(field.height_px),
        }
    }

    fn radius_px(&self, rank: usize, star: &ObservedStar) -> f64 {
        let by_error_px = GATE_SIGMAS * star.sigma_px.hypot(self.excess_sigma_px);
        let by_rarity_px = self.rare_px / ((rank + 1) as f64).sqrt();
        let by_error_px = by_error_px.min(ERROR_GATE_SHARE * self.diagonal_px);
        let by_rarity_px = by_rarity_px.min(RARE_GATE_SHARE * self.diagonal_px);
        by_error_px.max(by_rarity_px)
    }
}

fn clear(values: &mut Vec<f64>, count: usize) {
    values.clear();
    values.resize(count, 0.0);
}
