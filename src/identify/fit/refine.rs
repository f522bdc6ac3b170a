//! Refinement of a hypothesis: camera and attitude are fitted to all stars that agree.
//!
//! pairing → fit → pairing within a smaller radius → … with as much lens distortion as the stars
//! support

use super::{
    CameraFit, MeasuredStar, POSE_PARAMETERS, Predictions, fit_camera, predictions_by_terms,
};
use crate::base::coords::{Camera, Icrs, Rotation};
use crate::base::statistics::median;
use crate::camera::{CameraModel, Distortion, DistortionModel, Projection};
use crate::identify::field::{ObservedStar, Photometry};
use crate::identify::grid::FrameGrid;
use crate::identify::hypothesis::{Hypothesis, Problem};
use crate::identify::naming::{Blends, Candidate, Naming, Stars};
use crate::identify::pairing::{Pair, Pairing};
use crate::identify::predict::{PredictedStar, Surroundings};
use std::f64::consts::PI;

/// Largest distance of a pair, in typical errors on one axis.
const CLIP_SIGMAS: f64 = 5.0;
/// The median distance of errors with standard deviation 1 on each axis (Rayleigh).
const RAYLEIGH_MEDIAN: f64 = 1.177_41;
/// Smallest pairing radius.
const MIN_RADIUS_PX: f64 = 0.25;
/// Equations per parameter that a distortion model needs.
const EQUATIONS_PER_PARAMETER: f64 = 4.0;
/// Gain in likelihood of the stars left out of the fit (twice its logarithm) that each further term
/// of a lens needs. It is small: a term that is missed shifts the focal length by several standard
/// errors, and one that is not needed makes these larger, but not false.
const WORTH_A_TERM: f64 = 3.0;
/// The same that the monomials need together: the stars that are left out tell of terms too many.
const WORTH_MONOMIALS: f64 = 12.0;
/// The same that a lens other than a pinhole needs.
const WORTH_A_PROJECTION: f64 = 6.0;
/// Angle from the boresight to the corners above which projections are compared, in radians. In
/// narrower fields the term r³ is all by which they differ.
const WIDE_RAD: f64 = 0.3;
/// So many times more is needed where the stars do not determine the model as far as the corners:
/// one in 4000 first terms gains that by chance.
const WORTH_A_GUESS: f64 = 4.5;
/// Largest standard error at a corner of a model that the stars determine, in widths of the frame.
const KNOWN_CORNER: f64 = 1e-3;
/// With few equations the required gain is larger: the F distribution has heavier tails than χ².
const TAIL_EQUATIONS: f64 = 8.0;
/// Residuals exceed the stated errors if their median does so by this many of its standard errors.
const EXCESS_SIGMAS: f64 = 2.0;
/// Relative standard error of the median of n squared distances, times √n (exponential
/// distribution).
const MEDIAN_ERROR: f64 = 1.0 / std::f64::consts::LN_2;
/// Bisections for the excess error, down to a ten-thousandth of the largest residual.
const EXCESS_BISECTIONS: usize = 14;
/// Residual in standard errors beyond which a star pulls no harder.
const HUBER_SIGMAS: f64 = 2.5;
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

/// A kind of lens.
#[derive(Clone, Copy, PartialEq)]
struct Lens {
    projection: Projection,
    model: Option<DistortionModel>,
}

impl Lens {
    fn of(camera: &CameraModel) -> Self {
        Self {
            projection: camera.projection(),
            model: camera.distortion_model(),
        }
    }
}

/// A hypothesis, and the lens to fit from there.
#[derive(Clone, Copy)]
struct Guess<'a> {
    hypothesis: &'a Hypothesis,
    lens: Lens,
    excess_sigma_px: f64,
}

impl Guess<'_> {
    /// Camera and attitude to start from.
    fn start(&self) -> (CameraModel, Rotation<Icrs, Camera>) {
        with_projection(self.hypothesis, self.lens.projection)
    }
}

/// A camera with another projection, which sees the same near the axis of its lens, and its attitude.
fn with_projection(
    hypothesis: &Hypothesis,
    projection: Projection,
) -> (CameraModel, Rotation<Icrs, Camera>) {
    let Hypothesis {
        camera,
        icrs_to_camera,
        ..
    } = hypothesis;
    if camera.projection() == projection {
        return (*camera, *icrs_to_camera);
    }
    let other = camera.reprojected(projection);
    let of_axes = other.lens_axes().transpose() * camera.lens_axes();
    (
        other,
        Rotation::from_matrix(of_axes * icrs_to_camera.matrix()),
    )
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
        let mut lens = Lens::of(&hypothesis.camera);
        let mut current = self.fitted(
            problem,
            &Guess {
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
            if settled {
                // The pairs are the same, with the residuals of the fit.
                std::mem::swap(&mut self.pairs, &mut self.before);
                lens = self.choose_lens(problem, &current, start.richest);
                std::mem::swap(&mut self.pairs, &mut self.before);
                is_lens_chosen = true;
            }
            current = self.fitted(
                problem,
                &Guess {
                    hypothesis: &hypothesis,
                    lens,
                    excess_sigma_px: current.excess_sigma_px,
                },
            )?;
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
        let stars = Stars {
            field: problem.field,
            predicted: &self.predicted,
        };
        self.naming
            .start(stars, hypothesis.zero_point_mag, wanted.by_place);
        self.blends.start(self.predicted.len());
        let mut lens = Lens::of(&hypothesis.camera);
        lens.model = lens.model.max(wanted.min_distortion);
        let mut current = *settled;
        for round in 0..MAX_NAMING_ROUNDS {
            let hypothesis = current.hypothesis();
            if round > 0 {
                hypothesis.predict_again(&mut self.predicted);
            }
            self.name(problem, &current, round == 0);
            self.take_names(wanted.most_chance);
            let settled = self.are_pairs_the_same();
            let mut guess = Guess {
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
                let mut chosen = self.choose_lens(problem, &current, DistortionModel::Irregular5);
                chosen.model = chosen.model.max(wanted.min_distortion);
                if chosen != lens {
                    lens = chosen;
                    guess.lens = chosen;
                    current = self.fitted(problem, &guess)?;
                }
            }
            if lens == lens_before && (settled || round + 1 >= NAMING_ROUNDS) {
                break;
            }
        }
        Some(current)
    }

    /// Computes the probabilities of all candidates for a name under `current`.
    fn name(&mut self, problem: Problem, current: &Refined, is_first: bool) {
        let hypothesis = current.hypothesis();
        let stars = Stars {
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
        self.pairs.extend(sure.map(Candidate::pair));
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
    fn fitted(&mut self, problem: Problem, guess: &Guess) -> Option<Refined> {
        self.measure(problem, guess.excess_sigma_px);
        let model = guess.lens.model;
        let affordable = model.filter(|m| is_affordable(*m, self.stars.len()));
        let (camera, icrs_to_camera) = guess.start();
        let residuals_px = &mut self.residuals_px;
        let fit = fit_camera(
            &self.stars,
            &camera,
            &icrs_to_camera,
            affordable,
            residuals_px,
        )?;
        let excess_sigma_px = self.excess_sigma_of(problem, fit.parameters);
        for (pair, [x, y]) in self.pairs.iter_mut().zip(&self.residuals_px) {
            pair.residual_px = (x * x + y * y).sqrt();
        }
        Some(Refined {
            fit,
            zero_point_mag: self.zero_point_mag(problem),
            excess_sigma_px,
        })
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

    /// Converts the pairs to the input of the fit. The error of an outlier (with an unresolved
    /// companion, for example) grows with its residual, so that it pulls no harder than other stars
    /// (Huber 1964, Ann. Math. Stat. 35, 73).
    fn measure(&mut self, problem: Problem, excess_px: f64) {
        let measured = |pair: &Pair| {
            let star = &problem.field.stars[pair.observed];
            let sigma_px = (star.sigma_px.powi(2) + excess_px.powi(2)).sqrt().max(1e-3);
            let excess = pair.residual_px / (HUBER_SIGMAS * sigma_px);
            MeasuredStar {
                pixel: star.position,
                icrs: pair.direction,
                sigma_px: sigma_px * excess.max(1.0).sqrt(),
            }
        };
        self.stars.clear();
        self.stars.extend(self.pairs.iter().map(measured));
    }

    /// The lens that predicts left-out stars best, for its number of terms. Only a wide field tells
    /// projections apart.
    fn choose_lens(
        &mut self,
        problem: Problem,
        current: &Refined,
        richest: DistortionModel,
    ) -> Lens {
        self.measure(problem, current.excess_sigma_px);
        let is_regular = !self.depend_on_place(problem);
        let least = DistortionModel::Stretched;
        let affordable = |model: &DistortionModel| is_affordable(*model, self.stars.len());
        let of_all = DistortionModel::ALL.into_iter().filter(affordable);
        let richest = of_all.fold(least, DistortionModel::max).min(richest);
        let richest = if is_regular {
            richest.min(least)
        } else {
            richest
        };
        let hypothesis = current.hypothesis();
        let is_wide = hypothesis.camera.radius_rad() > WIDE_RAD;
        if is_wide && richest > DistortionModel::Radial {
            return self.choose_projection(&hypothesis, richest);
        }
        let projection = Projection::Pinhole;
        let (camera, icrs_to_camera) = with_projection(&hypothesis, projection);
        let hypothesis = Hypothesis {
            camera,
            icrs_to_camera,
            ..hypothesis
        };
        let linear = self.choose_model(&hypothesis, richest);
        let model = hypothesis.camera.distortion_model();
        let (model, misfit) = linear.unwrap_or((model, f64::INFINITY));
        if is_regular || richest <= DistortionModel::Radial || model >= Some(least) {
            return Lens { projection, model };
        }
        // A lens that is far from the present one shows what it is worth only once it is fitted.
        let fitted = self.fitted_lens(&hypothesis, projection);
        let richer = fitted.and_then(|fitted| self.choose_model(&fitted, richest));
        let better = richer.filter(|(richer, less)| *richer > model && *less < misfit);
        Lens {
            projection,
            model: better.map_or(model, |(model, _)| model),
        }
    }

    /// The lens whose projection, with the distortion that it needs, predicts left-out stars best. One
    /// that needs more distortion than a pinhole is no better than a pinhole.
    fn choose_projection(&mut self, hypothesis: &Hypothesis, richest: DistortionModel) -> Lens {
        let mut best: Option<(f64, Lens)> = None;
        let mut pinhole_px = f64::INFINITY;
        for projection in Projection::ALL {
            let Some(fitted) = self.fitted_lens(hypothesis, projection) else {
                continue;
            };
            let Some((model, misfit)) = self.choose_model(&fitted, richest) else {
                continue;
            };
            let distortion = fitted.camera.distortion().filter(|_| model.is_some());
            let largest_px = distortion.map_or(0.0, Distortion::largest_px);
            let is_pinhole = projection == Projection::Pinhole;
            if is_pinhole {
                pinhole_px = largest_px;
            } else if largest_px > pinhole_px {
                continue;
            }
            let penalty = if is_pinhole { 0.0 } else { WORTH_A_PROJECTION };
            if best.is_none_or(|(least, _)| misfit + penalty < least) {
                best = Some((misfit + penalty, Lens { projection, model }));
            }
        }
        best.map_or(Lens::of(&hypothesis.camera), |(_, lens)| lens)
    }

    /// The best lens of a projection, with all the terms of lenses that the stars can afford.
    fn fitted_lens(
        &mut self,
        hypothesis: &Hypothesis,
        projection: Projection,
    ) -> Option<Hypothesis> {
        let affordable = |model: &DistortionModel| is_affordable(*model, self.stars.len());
        let model = DistortionModel::LENSES.into_iter().filter(affordable).max();
        let (camera, icrs_to_camera) = with_projection(hypothesis, projection);
        let residuals_px = &mut self.residuals_px;
        let fit = fit_camera(&self.stars, &camera, &icrs_to_camera, model, residuals_px)?;
        Some(Hypothesis {
            camera: fit.camera,
            icrs_to_camera: fit.icrs_to_camera,
            ..*hypothesis
        })
    }

    /// Whether the residuals of the last fit are alike in places next to each other: a lens model is
    /// too simple then.
    fn depend_on_place(&self, problem: Problem) -> bool {
        const CELLS_ALONG: usize = 6;
        const CELLS: usize = (CELLS_ALONG + 2) * (CELLS_ALONG + 2);
        /// Standard deviations of the sum of squares that chance does not reach.
        const SIGMAS: f64 = 4.0;
        let grid = FrameGrid::new(problem.field, CELLS_ALONG);
        let mut sums = [[0.0; 3]; CELLS];
        let mut squares = 0.0;
        for (star, [x, y]) in self.stars.iter().zip(&self.residuals_px) {
            let [x, y] = [x / star.sigma_px, y / star.sigma_px];
            if let Some(sums) = sums.get_mut(grid.cell_of(star.pixel.x, star.pixel.y)) {
                *sums = [sums[0] + x, sums[1] + y, sums[2] + 1.0];
            }
            squares += x * x + y * y;
        }
        let variance = squares / (2.0 * self.stars.len() as f64);
        let filled = sums.iter().filter(|[_, _, stars]| *stars > 0.0);
        let (mut of_cells, mut freedoms) = (0.0, 0.0);
        for [x, y, stars] in filled {
            of_cells += (x * x + y * y) / (stars * variance);
            freedoms += 2.0;
        }
        of_cells > freedoms + SIGMAS * (2.0_f64 * freedoms).sqrt()
    }

    /// The simplest distortion model that no richer one clearly surpasses in predicting left-out stars;
    /// and by how much it misses them, with a penalty for its terms.
    fn choose_model(
        &mut self,
        hypothesis: &Hypothesis,
        richest: DistortionModel,
    ) -> Option<(Option<DistortionModel>, f64)> {
        let Hypothesis {
            camera,
            icrs_to_camera,
            ..
        } = hypothesis;
        let predictions = predictions_by_terms(&self.stars, camera, icrs_to_camera, richest)?;
        let equations = 2.0 * self.stars.len() as f64;
        let heavier_tails = equations / (equations - TAIL_EQUATIONS).max(1.0);
        let known_corner_px = KNOWN_CORNER * camera.width_px;
        let mut best = (None, predictions[0].left_out_chi_sq);
        let mut is_best_a_guess = false;
        for model in DistortionModel::ALL {
            if model > richest || !is_affordable(model, self.stars.len()) {
                break;
            }
            let is_guess = |found: &Predictions| found.corner_sigma_px > known_corner_px;
            let is_better = |found: &Predictions| {
                let of_guess = match (is_guess(found), is_best_a_guess) {
                    (false, _) => 1.0,
                    (true, false) => WORTH_A_GUESS,
                    // The simplest guess brings more stars, and these tell whether it is enough.
                    (true, true) => WORTH_A_GUESS.powi(2),
                };
                let worth = heavier_tails * of_guess * least_gain(model, best.0);
                equations * (best.1 / found.left_out_chi_sq).ln() > worth
            };
            let found = &predictions[model.terms()];
            if is_better(found) {
                is_best_a_guess = is_guess(found);
                best = (Some(model), found.left_out_chi_sq);
            }
        }
        let (model, left_out_chi_sq) = best;
        let penalty = model.map_or(0.0, |model| least_gain(model, None));
        Some((
            model,
            equations * left_out_chi_sq.ln() + heavier_tails * penalty,
        ))
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

    /// The error in pixels that must be added in quadrature to the stated ones to explain the
    /// median residual; 0 where chance explains it. Only the better measured half of the stars
    /// counts: the faintest were detected because noise made them brighter, and it moved them, too.
    fn excess_sigma_of(&mut self, problem: Problem, parameters: usize) -> f64 {
        let equations = 2.0 * self.pairs.len() as f64;
        let free = (equations - parameters as f64).max(1.0) / equations.max(1.0);
        let expected_sq = RAYLEIGH_MEDIAN.powi(2) * free;
        let stated_sq = |pair: &Pair| problem.field.stars[pair.observed].sigma_px.powi(2);
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

/// The gain in likelihood over a simpler model that a model needs.
fn least_gain(model: DistortionModel, simpler: Option<DistortionModel>) -> f64 {
    if model >= DistortionModel::Irregular3 {
        return WORTH_MONOMIALS + least_gain(DistortionModel::Stretched, simpler).max(0.0);
    }
    let terms = simpler.map_or(0, DistortionModel::terms);
    WORTH_A_TERM * (model.terms() as f64 - terms as f64)
}

fn is_affordable(model: DistortionModel, stars: usize) -> bool {
    2.0 * stars as f64 >= EQUATIONS_PER_PARAMETER * (model.terms() + POSE_PARAMETERS) as f64
}
