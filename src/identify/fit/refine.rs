//! Refinement of a hypothesis: camera and attitude are fitted to all stars that agree.
//!
//! pairing → fit → pairing within a smaller radius → … with as much lens distortion as the stars
//! support

use super::camera_fit::fit_with_unshown_terms;
use super::lens_choice::{
    ChosenLens, LensChoice, LensKind, depend_on_place, is_affordable, with_projection,
};
use super::{CameraFit, MeasuredStar, fit_camera, fit_known_lens};
use crate::base::coords::{Camera, Icrs, Rotation};
use crate::base::least_squares::huber_sigma;
use crate::base::statistics::median;
use crate::camera::{CameraModel, DistortionModel, KnownLens};
use crate::identify::field::{ObservedStar, Photometry, StarField};
use crate::identify::hypothesis::{Hypothesis, Problem};
use crate::identify::naming::{Blends, NameCandidate, Naming, NamingStars};
use crate::identify::pairing::{Pair, Pairing};
use crate::identify::predict::{PredictedStar, Surroundings};
use nalgebra::Matrix4;
use std::f64::consts::PI;
use std::sync::Arc;

/// Largest distance of a pair, in typical errors on one axis.
const CLIP_SIGMAS: f64 = 5.0;
/// The median distance of errors with standard deviation 1 on each axis (Rayleigh).
const RAYLEIGH_MEDIAN: f64 = 1.177_41;
/// Smallest pairing radius.
const MIN_RADIUS_PX: f64 = 0.25;
/// Residuals exceed the stated errors if their median does so by this many of its standard errors.
const EXCESS_SIGMAS: f64 = 2.0;
/// Relative standard error of the median of n squared distances, times √n (exponential
/// distribution).
const MEDIAN_ERROR: f64 = 1.0 / std::f64::consts::LN_2;
/// Bisections for the excess error, down to a ten-thousandth of the largest residual.
const EXCESS_BISECTIONS: usize = 14;
/// Rounds of naming and fitting after which only a new distortion model is a reason for another.
const NAMING_ROUNDS: usize = 3;
/// Maximum rounds of naming and fitting.
const MAX_NAMING_ROUNDS: usize = 8;
/// Agreement above chance that a sceptical refinement needs, in standard deviations.
const SCEPTICAL_SIGMAS: f64 = 3.0;
/// Maximum rounds of pairing and fitting.
const MAX_ROUNDS: usize = 8;

/// A fitted hypothesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refined {
    /// The fit.
    pub fit: CameraFit,
    /// Johnson V minus observed magnitude.
    pub zero_point_mag: f64,
    /// Standard deviation on each axis, in pixels, that the stated centroid errors lack to explain
    /// the residuals.
    pub excess_sigma_px: f64,
}

impl Refined {
    /// Camera and attitude.
    pub fn hypothesis(&self) -> Hypothesis {
        Hypothesis {
            camera: self.fit.camera,
            icrs_to_camera: self.fit.icrs_to_camera,
            parameters: self.fit.parameters,
            fitted_stars: self.fit.stars,
            zero_point_mag: self.zero_point_mag,
        }
    }
}

/// Where a refinement starts.
#[derive(Clone, Copy)]
pub struct Start<'a> {
    /// The hypothesis.
    pub hypothesis: &'a Hypothesis,
    /// Largest distance of true pairs under it, in pixels.
    pub radius_px: f64,
    /// Whether to give up at once if no more stars agree than by chance.
    pub sceptical: bool,
    /// Number of stars to use, the brightest.
    pub stars: usize,
    /// Richest distortion model to try.
    pub richest: DistortionModel,
}

/// How stars are named.
#[derive(Debug, Clone, Copy)]
pub struct NamingStart {
    /// The largest probability of a name that it is chance.
    pub most_chance: f64,
    /// Whether to look at how stars and other detections are spread over the frame.
    pub by_place: bool,
    /// The simplest distortion model to fit, where the stars can afford it.
    pub min_distortion: Option<DistortionModel>,
}

/// A hypothesis, and the lens to fit from there.
#[derive(Clone, Copy)]
struct RefineStart<'a> {
    hypothesis: &'a Hypothesis,
    lens: LensKind,
    excess_sigma_px: f64,
}

impl RefineStart<'_> {
    /// Camera and attitude to start from.
    fn start(&self) -> (CameraModel, Rotation<Icrs, Camera>) {
        with_projection(self.hypothesis, self.lens.projection)
    }
}

/// Refines hypotheses. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Refiner {
    /// Catalogue stars of the field.
    pub around: Surroundings,
    /// The pairs of the last refinement.
    pub pairs: Vec<Pair>,
    before: Vec<Pair>,
    predicted: Vec<PredictedStar>,
    pairing: Pairing,
    naming: Naming,
    blends: Blends,
    stars: Vec<MeasuredStar>,
    residuals_px: Vec<[f64; 2]>,
    scratch: Scratch,
    lens: Option<Arc<KnownLens>>,
}

/// Buffers for medians.
#[derive(Debug, Default)]
struct Scratch {
    values: Vec<f64>,
    squares: Vec<(f64, f64)>,
}

impl Scratch {
    fn median(&mut self, values: impl Iterator<Item = f64>) -> f64 {
        self.values.clear();
        self.values.extend(values);
        median(&mut self.values)
    }
}

impl Refiner {
    /// From the next refinement on, this lens is known, in fields of its size.
    pub fn set_known_lens(&mut self, lens: Option<&Arc<KnownLens>>) {
        self.lens = lens.cloned();
    }

    /// The lens that is known of a field.
    fn known_lens(&self, field: &StarField) -> Option<&Arc<KnownLens>> {
        let is_of_field = |lens: &&Arc<KnownLens>| lens.is_of_size(field.width_px, field.height_px);
        self.lens.as_ref().filter(is_of_field)
    }

    /// Pairs and fits in turn from `start`; [`Self::pairs`] are then the stars that agree. `None`
    /// if too few agree to determine the camera.
    pub fn refine(&mut self, problem: Problem, start: &Start) -> Option<Refined> {
        let field = problem.field;
        let observed = field.brightest(start.stars);
        let hypothesis = start.hypothesis;
        hypothesis.predict(problem, observed, &mut self.around, &mut self.predicted);
        let mut radius_px = start.radius_px;
        self.pair_up(problem, hypothesis, observed, radius_px);
        if start.sceptical && !self.is_remarkable(problem, observed.len(), radius_px) {
            return None;
        }
        let mut lens = LensKind::of(&hypothesis.camera);
        let mut current = self.fitted(
            problem,
            &RefineStart {
                hypothesis,
                lens,
                excess_sigma_px: 0.0,
            },
        )?;
        let mut is_lens_chosen = false;
        for _ in 0..MAX_ROUNDS {
            radius_px = self.next_radius_px(radius_px);
            let hypothesis = current.hypothesis();
            hypothesis.predict_again(&mut self.predicted);
            std::mem::swap(&mut self.pairs, &mut self.before);
            self.pair_up(problem, &hypothesis, observed, radius_px);
            let settled = self.are_pairs_the_same();
            if settled && is_lens_chosen {
                std::mem::swap(&mut self.pairs, &mut self.before);
                break;
            }
            let lens_before = lens;
            if settled {
                // The pairs are the same, with the residuals of the fit.
                std::mem::swap(&mut self.pairs, &mut self.before);
                lens = self.choose_lens(problem, &current, start.richest).lens;
                std::mem::swap(&mut self.pairs, &mut self.before);
                is_lens_chosen = true;
            }
            let mut guess = RefineStart {
                hypothesis: &hypothesis,
                lens,
                excess_sigma_px: current.excess_sigma_px,
            };
            let mut refined = self.fitted(problem, &guess);
            if refined.is_none() && lens != lens_before {
                // A lens that cannot be fitted is not the right one.
                lens = lens_before;
                guess.lens = lens;
                refined = self.fitted(problem, &guess);
            }
            current = refined?;
        }
        Some(current)
    }

    /// Names all stars, the faint ones, too, and fits camera and attitude to those with a name that
    /// is chance with at most the `wanted` probability; [`Self::pairs`] are then these. `None` if they
    /// do not determine the camera.
    pub fn with_names(
        &mut self,
        problem: Problem,
        settled: &Refined,
        wanted: &NamingStart,
    ) -> Option<Refined> {
        let hypothesis = settled.hypothesis();
        hypothesis.predict_all(problem, &mut self.around, &mut self.predicted);
        let stars = NamingStars {
            field: problem.field,
            predicted: &self.predicted,
        };
        self.naming
            .start(stars, hypothesis.zero_point_mag, wanted.by_place);
        self.blends.start(self.predicted.len());
        let mut lens = LensKind::of(&hypothesis.camera);
        lens.model = lens.model.max(wanted.min_distortion);
        let mut current = *settled;
        let mut among_lenses = Matrix4::zeros();
        for round in 0..MAX_NAMING_ROUNDS {
            let hypothesis = current.hypothesis();
            if round > 0 {
                hypothesis.predict_again(&mut self.predicted);
            }
            self.name(problem, &current, round == 0);
            self.take_names(wanted.most_chance);
            let settled = self.are_pairs_the_same();
            let mut guess = RefineStart {
                hypothesis: &hypothesis,
                lens,
                excess_sigma_px: current.excess_sigma_px,
            };
            current = self.fitted(problem, &guess)?;
            let lens_before = lens;
            // The names are more stars than those that the model was chosen for.
            let is_open = round == 0
                || (!settled && self.are_residuals_unexplained(problem, &current))
                || self.depend_on_place(problem);
            if is_open {
                let choice = self.choose_lens(problem, &current, DistortionModel::Irregular5);
                among_lenses = choice.covariance;
                let mut chosen = choice.lens;
                chosen.model = chosen.model.max(wanted.min_distortion);
                guess.lens = chosen;
                // A lens that cannot be fitted is not the right one.
                if chosen != lens
                    && let Some(refined) = self.fitted(problem, &guess)
                {
                    (lens, current) = (chosen, refined);
                }
            }
            if lens == lens_before && (settled || round + 1 >= NAMING_ROUNDS) {
                break;
            }
        }
        let mut whole = self
            .with_unshown_terms(problem, &current)
            .unwrap_or(current);
        whole.fit.covariance += among_lenses;
        Some(whole)
    }

    /// The fit with the terms of the lens, too, that the stars do not show. `None` where there are none, and of a
    /// pinhole: its attitude is that of the frame's centre, which these hardly move.
    fn with_unshown_terms(&mut self, problem: Problem, current: &Refined) -> Option<Refined> {
        let CameraFit {
            camera,
            icrs_to_camera,
            ..
        } = &current.fit;
        let shows_all = camera.distortion_model() >= Some(DistortionModel::Stretched);
        if shows_all || camera.is_pinhole() || self.known_lens(problem.field).is_some() {
            return None;
        }
        self.measure(problem, current.excess_sigma_px);
        let residuals_px = &mut self.residuals_px;
        let fit = fit_with_unshown_terms(&self.stars, camera, icrs_to_camera, residuals_px)?;
        Some(self.refined(problem, fit))
    }

    /// Computes the probabilities of all candidates for a name under `current`.
    fn name(&mut self, problem: Problem, current: &Refined, is_first: bool) {
        let hypothesis = current.hypothesis();
        let stars = NamingStars {
            field: problem.field,
            predicted: &self.predicted,
        };
        let excess_sigma_px = current.excess_sigma_px;
        self.naming
            .find_candidates(stars, &hypothesis, excess_sigma_px, &mut self.pairing);
        let taken = self.pairs.iter().map(|pair| pair.star);
        let candidates = &mut self.naming.candidates;
        self.blends
            .redirect(problem, &hypothesis, taken, candidates);
        self.naming.compute(stars, is_first);
    }

    /// Whether most of the residuals is not explained by the centroid errors: the lens model may be
    /// too simple.
    fn are_residuals_unexplained(&mut self, problem: Problem, current: &Refined) -> bool {
        let stars = &problem.field.stars;
        let sigma_px = self.pairs.iter().map(|pair| stars[pair.observed].sigma_px);
        current.excess_sigma_px > self.scratch.median(sigma_px)
    }

    /// Makes the sure names the pairs.
    fn take_names(&mut self, most_chance: f64) {
        std::mem::swap(&mut self.pairs, &mut self.before);
        self.pairs.clear();
        let sure = self.naming.candidates.iter();
        let sure = sure.filter(|candidate| candidate.p_chance <= most_chance);
        self.pairs.extend(sure.map(NameCandidate::pair));
    }

    fn pair_up(
        &mut self,
        problem: Problem,
        hypothesis: &Hypothesis,
        observed: &[ObservedStar],
        radius_px: f64,
    ) {
        let photometry = problem.field.photometry;
        self.pairing.pair_up(
            observed,
            &self.predicted,
            radius_px,
            |o, p| hypothesis.mag_difference(o, p, photometry),
            &mut self.pairs,
        );
    }

    /// Whether clearly more stars agree within `radius_px` than by chance.
    fn is_remarkable(&self, problem: Problem, observed: usize, radius_px: f64) -> bool {
        let area_px = problem.field.width_px * problem.field.height_px;
        let discs_px = self.predicted.len() as f64 * PI * radius_px.powi(2);
        let by_chance = observed as f64 * (discs_px / area_px).min(1.0);
        let wanted = by_chance + SCEPTICAL_SIGMAS * (by_chance + 0.1).sqrt();
        self.pairs.len() as f64 >= wanted
    }

    fn are_pairs_the_same(&self) -> bool {
        let stars = |pair: &Pair| (pair.observed, pair.star);
        self.pairs
            .iter()
            .map(stars)
            .eq(self.before.iter().map(stars))
    }

    /// The fit to the pairs, from `guess`.
    fn fitted(&mut self, problem: Problem, guess: &RefineStart) -> Option<Refined> {
        self.measure(problem, guess.excess_sigma_px);
        let fit = match self.known_lens(problem.field).cloned() {
            Some(lens) => self.fit_known_lens(&lens, guess.hypothesis),
            None => self.fit_lens(guess),
        }?;
        Some(self.refined(problem, fit))
    }

    /// What a fit to the pairs says.
    fn refined(&mut self, problem: Problem, mut fit: CameraFit) -> Refined {
        let excess_sigma_px = self.excess_sigma_of(problem, fit.parameters);
        if self.known_lens(problem.field).is_none() && excess_sigma_px == 0.0 {
            fit.covariance *= self.overstated(fit.parameters);
        }
        for (pair, [x, y]) in self.pairs.iter_mut().zip(&self.residuals_px) {
            pair.residual_px = (x * x + y * y).sqrt();
        }
        Refined {
            fit,
            zero_point_mag: self.zero_point_mag(problem),
            excess_sigma_px,
        }
    }

    /// The fit of a lens to the stars.
    fn fit_lens(&mut self, guess: &RefineStart) -> Option<CameraFit> {
        let model = guess.lens.model;
        let affordable = model.filter(|m| is_affordable(*m, self.stars.len()));
        let (camera, icrs_to_camera) = guess.start();
        let residuals_px = &mut self.residuals_px;
        fit_camera(
            &self.stars,
            &camera,
            &icrs_to_camera,
            affordable,
            residuals_px,
        )
    }

    fn fit_known_lens(&mut self, lens: &KnownLens, guess: &Hypothesis) -> Option<CameraFit> {
        if lens.camera().mirrored != guess.camera.mirrored {
            return None;
        }
        let attitude = lens.attitude_like(&guess.camera, &guess.icrs_to_camera)?;
        fit_known_lens(&self.stars, lens, &attitude, &mut self.residuals_px)
    }

    /// The median difference between catalogue and observed magnitudes.
    fn zero_point_mag(&mut self, problem: Problem) -> f64 {
        let observed = &problem.field.stars;
        match problem.field.photometry {
            Photometry::JohnsonV => 0.0,
            Photometry::Instrumental => self.scratch.median(
                self.pairs
                    .iter()
                    .map(|pair| f64::from(pair.v_mag) - observed[pair.observed].mag),
            ),
        }
    }

    /// Converts the pairs to the input of the fit.
    fn measure(&mut self, problem: Problem, excess_px: f64) {
        let measured = |pair: &Pair| {
            let star = &problem.field.stars[pair.observed];
            let mut measured = MeasuredStar::new(star, pair, excess_px);
            measured.sigma_px = huber_sigma(measured.sigma_px, pair.residual_px);
            measured
        };
        self.stars.clear();
        self.stars.extend(self.pairs.iter().map(measured));
    }

    /// The lens to fit to the pairs.
    fn choose_lens(
        &mut self,
        problem: Problem,
        current: &Refined,
        richest: DistortionModel,
    ) -> ChosenLens {
        if self.known_lens(problem.field).is_some() {
            return LensKind::of(&current.fit.camera).into();
        }
        self.measure(problem, current.excess_sigma_px);
        let mut choice = LensChoice {
            field: problem.field,
            stars: &self.stars,
            residuals_px: &mut self.residuals_px,
        };
        choice.choose(&current.hypothesis(), richest)
    }

    /// Whether the residuals of the last fit show that the lens model is too simple.
    fn depend_on_place(&self, problem: Problem) -> bool {
        depend_on_place(problem.field, &self.stars, &self.residuals_px)
    }

    /// The radius that contains practically all true pairs, from the median residual of the last
    /// fit.
    fn agreement_radius_px(&mut self) -> f64 {
        let distances_px = self.pairs.iter().map(|pair| pair.residual_px);
        let sigma_px = self.scratch.median(distances_px) / RAYLEIGH_MEDIAN;
        (CLIP_SIGMAS * sigma_px).max(MIN_RADIUS_PX)
    }

    /// The same, but at most as large as before, and not so small that a bad fit would lose good
    /// pairs.
    fn next_radius_px(&mut self, before_px: f64) -> f64 {
        self.agreement_radius_px().clamp(before_px / 4.0, before_px)
    }

    /// The share of the stated squared errors that the residuals of the better measured half of the stars
    /// leave; 1 where chance explains a lower one. The light of faint stars is in the noise that errors are
    /// stated for, and disturbs few of the stars.
    fn overstated(&self, parameters: usize) -> f64 {
        /// Larger residuals are of wrong names, in errors.
        const MAX_SIGMAS: f64 = 3.0;
        let squares = &self.scratch.squares;
        let count = squares.len().max(1) as f64;
        let in_errors = |&(square, stated): &(f64, f64)| {
            (0.5 * square / stated.max(1e-6)).min(MAX_SIGMAS.powi(2))
        };
        let mean = squares.iter().map(in_errors).sum::<f64>() / count;
        let share = mean / self.free_fraction(parameters);
        // The standard error of the mean of an exponential distribution is 1.
        if share < 1.0 - EXCESS_SIGMAS / count.sqrt() {
            share
        } else {
            1.0
        }
    }

    /// Degrees of freedom over equations.
    fn free_fraction(&self, parameters: usize) -> f64 {
        let equations = 2.0 * self.pairs.len() as f64;
        (equations - parameters as f64).max(1.0) / equations.max(1.0)
    }

    /// The error in pixels that must be added in quadrature to the stated ones to explain the
    /// median residual; 0 where chance explains it. Only the better measured half of the stars
    /// counts: the faintest were detected because noise made them brighter, and it moved them, too.
    fn excess_sigma_of(&mut self, problem: Problem, parameters: usize) -> f64 {
        let expected_sq = RAYLEIGH_MEDIAN.powi(2) * self.free_fraction(parameters);
        let stars = &problem.field.stars;
        let stated_sq = |pair: &Pair| pair.sigma_px(&stars[pair.observed]).powi(2);
        let worst_sq = self.scratch.median(self.pairs.iter().map(stated_sq));
        let residuals = self.residuals_px.iter().zip(&self.pairs);
        let squares = &mut self.scratch.squares;
        squares.clear();
        squares.extend(
            residuals
                .map(|([x, y], pair)| (x * x + y * y, stated_sq(pair)))
                .filter(|(_, stated_sq)| *stated_sq <= worst_sq),
        );
        // Whether the median squared residual, in units of the squared errors, is above a limit.
        let is_median_above = |excess_sq: f64, limit: f64| {
            let is_below = |&(d, s): &(f64, f64)| d / (s + excess_sq).max(1e-6) <= limit;
            let below = squares.iter().map(|pair| usize::from(is_below(pair)));
            below.sum::<usize>() <= squares.len() / 2
        };
        let chance = EXCESS_SIGMAS * MEDIAN_ERROR / (squares.len().max(1) as f64).sqrt();
        if !is_median_above(0.0, expected_sq * (1.0 + chance)) {
            return 0.0;
        }
        let largest_sq = squares.iter().fold(1e-6, |a: f64, s| a.max(s.0));
        let (mut low, mut high) = (0.0, largest_sq.sqrt() * 2.0);
        for _ in 0..EXCESS_BISECTIONS {
            let middle = 0.5 * (low + high);
            if is_median_above(middle * middle, expected_sq) {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }
}
