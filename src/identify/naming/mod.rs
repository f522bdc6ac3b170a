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
//! probability is `o / (1 + Σ o)` over all candidates of both. So do the other stars of an unresolved
//! blend, where j itself lies outside the detected spot (`blends`).
//!
//! C, λ, and the zero point and scatter of the magnitudes are unknown at first. They are measured
//! in the frame with the probabilities, and the probabilities computed again (expectation
//! maximisation: Dempster, Laird & Rubin 1977, J. R. Stat. Soc. B 39, 1).
//!
//! # Reference
//! Sutherland & Saunders 1992, MNRAS 259, 413, for the likelihood ratio and the reliability of a
//! counterpart; Budavári & Szalay 2008, ApJ 679, 301, for the Bayesian form.

mod blends;
mod candidate;
mod completeness;
mod conspicuous;
mod likelihood;
mod odds;
mod packed;
mod unrelated;

pub use blends::Blends;
pub use candidate::NameCandidate;
pub use conspicuous::Posed;
pub use likelihood::position_density;

use crate::identify::field::{ObservedStar, Photometry, StarField};
use crate::identify::hypothesis::Hypothesis;
use crate::identify::pairing::Pairing;
use crate::identify::predict::PredictedStar;
use completeness::DetectionProbabilities;
use likelihood::MagnitudeRelation;
use odds::{OddsInputs, pack, set_chances, set_odds};
use packed::Packed;
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
const ERROR_GATE_FRACTION: f64 = 0.005;
const RARE_GATE_FRACTION: f64 = 0.01;

/// Computes the probabilities of names. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Naming {
    /// The candidates, in the order of the observed stars.
    pub candidates: Vec<NameCandidate>,
    packed: Vec<Packed>,
    /// The sum of odds of each observed star, and of each predicted star, and of empty lanes.
    odds_of_observed: Vec<f64>,
    odds_of_predicted: Vec<f64>,
    /// The probability of each predicted star that it is observed, and of each observed star that
    /// it has a name, and the same for empty lanes.
    is_observed: Vec<f64>,
    has_name: Vec<f64>,
    /// V magnitudes of the predicted stars.
    v_mags: Vec<f64>,
    /// The share by brightness of the predicted stars as bright as each observed one.
    apparent_fractions: Vec<f64>,
    by_place: bool,
    completeness: DetectionProbabilities,
    unrelated: Unrelated,
    magnitudes: MagnitudeRelation,
}

/// The stars of a frame, observed and predicted, both brightest first.
#[derive(Clone, Copy)]
pub struct NamingStars<'a> {
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
    pub fn start(&mut self, stars: NamingStars, zero_point_mag: f64, by_place: bool) {
        let NamingStars { field, predicted } = stars;
        self.by_place = by_place;
        self.unrelated.start(field, by_place);
        self.magnitudes = MagnitudeRelation::new(zero_point_mag, field.photometry);
        self.has_name.clear();
        self.has_name.resize(field.stars.len() + 1, 0.5);
        self.completeness.start(predicted.len());
        self.v_mags.clear();
        self.v_mags
            .extend(predicted.iter().map(|star| f64::from(star.v_mag)));
    }

    /// Finds the candidates under `hypothesis`; `excess_sigma_px` is what the stated centroid
    /// errors lack.
    pub fn find_candidates(
        &mut self,
        stars: NamingStars,
        hypothesis: &Hypothesis,
        excess_sigma_px: f64,
        pairing: &mut Pairing,
    ) {
        let NamingStars { field, predicted } = stars;
        let gate = Gate::new(field, excess_sigma_px);
        let radius_px = |index: usize, star: &ObservedStar| gate.radius_px(index, star);
        let difference =
            |o: &ObservedStar, p: &PredictedStar| hypothesis.mag_difference(o, p, field.photometry);
        let near = pairing.candidates(&field.stars, predicted, radius_px, difference);
        self.candidates.clear();
        let candidates = near.iter().map(|near| {
            let star = &field.stars[near.observed];
            let sigma_px = gate.sigma_px(star);
            let gate_px = gate.radius_px(near.observed, star);
            NameCandidate::new(near, &predicted[near.predicted], sigma_px, gate_px)
        });
        self.candidates.extend(candidates);
    }

    /// Computes the probabilities of the candidates.
    pub fn compute(&mut self, stars: NamingStars, is_first: bool) {
        let NamingStars { field, predicted } = stars;
        pack(&self.candidates, field, predicted.len(), &mut self.packed);
        if self.by_place {
            self.completeness.place(stars.field, stars.predicted);
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
                let has_name = &self.has_name[..stars.field.stars.len()];
                self.unrelated.measure_crowding(stars.field, has_name);
            }
            self.expect(stars);
            self.maximise(stars, is_by_place);
        }
        self.expect(stars);
        let chances = self.packed.iter().flat_map(|packed| packed.p_chance);
        for (candidate, p_chance) in self.candidates.iter_mut().zip(chances) {
            candidate.p_chance = p_chance;
        }
    }

    /// Probabilities of the candidates from what was measured in the frame.
    fn expect(&mut self, stars: NamingStars) {
        let (observed, predicted) = (stars.field.stars.len(), stars.predicted.len());
        self.unrelated.measure(&self.has_name[..observed]);
        self.find_apparent_fractions(stars.field);
        let (shares, visibility) = self.completeness.fractions_and_visibility();
        let known = OddsInputs {
            fractions: shares,
            visibility,
            apparent_fractions: &self.apparent_fractions,
            unrelated: self.unrelated.densities(),
            magnitudes: &self.magnitudes,
        };
        set_odds(&mut self.packed, &known);
        clear(&mut self.odds_of_observed, observed + 1);
        clear(&mut self.odds_of_predicted, predicted + 1);
        for packed in &self.packed {
            for ((i, j), odds) in packed.places().zip(packed.odds) {
                self.odds_of_observed[i] += odds;
                self.odds_of_predicted[j] += odds;
            }
        }
        let (of_observed, of_predicted) = (&self.odds_of_observed, &self.odds_of_predicted);
        set_chances(&mut self.packed, of_observed, of_predicted);
        clear(&mut self.has_name, observed + 1);
        clear(&mut self.is_observed, predicted + 1);
        for packed in &self.packed {
            for ((i, j), p_chance) in packed.places().zip(packed.p_chance) {
                self.has_name[i] += 1.0 - p_chance;
                self.is_observed[j] += 1.0 - p_chance;
            }
        }
    }

    /// Finds the share by brightness of the predicted stars as bright as each observed one.
    fn find_apparent_fractions(&mut self, field: &StarField) {
        let (shares, _) = self.completeness.fractions_and_visibility();
        let v_mags = &self.v_mags;
        self.apparent_fractions.clear();
        // Both are sorted, so each search begins where the last one ended.
        let mut at = 0;
        self.apparent_fractions
            .extend(field.stars.iter().map(|star| {
                let expected_v_mag = self.magnitudes.expected_v_mag(star.mag);
                while at < v_mags.len() && v_mags[at] < expected_v_mag {
                    at += 1;
                }
                while at > 0 && v_mags[at - 1] >= expected_v_mag {
                    at -= 1;
                }
                shares[at]
            }));
        self.apparent_fractions.push(0.0);
    }

    /// What the frame shows, from the probabilities.
    fn maximise(&mut self, stars: NamingStars, is_by_place: bool) {
        let NamingStars { field, predicted } = stars;
        let is_observed = &self.is_observed[..predicted.len()];
        self.completeness.measure_fractions(is_observed);
        if is_by_place {
            self.completeness.measure_visibility(field, is_observed);
        }
        let has_line = field.photometry == Photometry::Instrumental;
        self.magnitudes.fit(&self.packed, has_line);
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
            diagonal_px: libm::hypot(field.width_px, field.height_px),
        }
    }

    /// Standard error of a star's position on each axis.
    fn sigma_px(&self, star: &ObservedStar) -> f64 {
        (star.sigma_px.powi(2) + self.excess_sigma_px.powi(2)).sqrt()
    }

    fn radius_px(&self, rank: usize, star: &ObservedStar) -> f64 {
        let by_error_px = GATE_SIGMAS * self.sigma_px(star);
        let by_rarity_px = self.rare_px / ((rank + 1) as f64).sqrt();
        let by_error_px = by_error_px.min(ERROR_GATE_FRACTION * self.diagonal_px);
        let by_rarity_px = by_rarity_px.min(RARE_GATE_FRACTION * self.diagonal_px);
        by_error_px.max(by_rarity_px)
    }
}

fn clear(values: &mut Vec<f64>, count: usize) {
    values.clear();
    values.resize(count, 0.0);
}
