//! The search for a hypothesis: pointing, roll and scale.
//!
//! Triangles of bright observed stars → similar catalogue triangles → hypotheses → confirmed by
//! further stars.

use super::aligned::{AlignedTriangle, InCamera};
use super::confirmation::{ConfirmingStars, PendingHypothesis, Pose};
use super::false_alarm::{FalseAlarm, TESTED_STARS};
use super::plan::{PASSES, SearchPass, SearchPlan, WORK_OF_VOTE};
use super::pose_cells::CameraAxes;
use super::queries::{LookedUp, ObservedStars, ObservedTriangle, Query, Similar};
use super::tiers::Tiers;
use super::unseen::Unseen;
use super::votes::{Vote, Votes};
use super::windows::SearchWindow;
use crate::base::coords::{Rotation, UnitVector};
use crate::base::interrupt::Interrupt;
use crate::camera::{CameraModel, DistortionModel, focal_length_px};
use crate::catalog::sky_grid::GridStar;
use crate::identify::effort::Effort;
use crate::identify::field::{ObservedStar, StarField};
use crate::identify::fit::{
    Growth, MeasuredStar, POSE_PARAMETERS, Refined, Refiner, Seed, Start, WIDE_RAD,
};
use crate::identify::hypothesis::{Hypothesis, Problem};
use crate::identify::pairing::Pair;
use crate::identify::priors::{Priors, SkyRegion};

/// Margin on the fields of view that the index allows, so that a field of exactly that width is
/// found.
const FOV_SLACK: f64 = 1.05;

/// Largest log10 of the false-alarm probability at which a frame counts as identified.
pub const LOG10_FALSE_ALARM_LIMIT: f64 = -8.0;
/// A hypothesis below this ends the search. One between the two limits waits for the end of its
/// pass, in case a better one comes: a few inexact stars may also agree with a neighbor of the
/// truth.
pub const LOG10_SURE: f64 = -14.0;

/// Number of stars, the brightest, with which a hypothesis is tested first. It ends the search where
/// these make it sure. That adds 10⁻¹⁴ to the false-alarm probability at most, to the 10⁻⁸ of the
/// test with [`TESTED_STARS`] that follows where they do not.
const FIRST_TESTED_STARS: usize = 25;

/// Buffers of the search, reused from field to field.
#[derive(Debug, Default)]
pub struct SearchBuffers {
    /// Refines hypotheses.
    pub refiner: Refiner,
    false_alarm: FalseAlarm,
    unseen: Unseen,
    /// The stars of the best fit so far, while others are tried.
    best: Vec<Pair>,
    /// What is looked up for an observed triangle, for all of them where these vote.
    queries: Vec<Query>,
    /// Catalogue triangles that are like an observed one.
    looked_up: LookedUp,
    votes: Votes,
    in_camera: Vec<CameraAxes>,
    /// To confirm answers.
    tiers: Tiers,
    growth: Growth,
    /// The stars of a window.
    seed: Vec<MeasuredStar>,
    /// Ends searches early.
    pub interrupt: Interrupt,
}

/// The search over one field.
pub struct TriangleSearch<'a> {
    problem: Problem<'a>,
    plan: SearchPlan,
    effort: Effort,
    near: Option<SkyRegion>,
    /// Whether the priors have a scale.
    is_scale_known: bool,
    buffers: &'a mut SearchBuffers,
    observed: ObservedStars<'a>,
    /// Position of this search among those over the field, from 1.
    number: u32,
    hypotheses: u64,
    candidates: u64,
    fitted: u64,
    /// Whether the interrupt was due; then it is not asked again.
    interrupted: bool,
    best_log10: Option<f64>,
    /// The best hypothesis that passes the limit but does not end the search.
    provisional: Option<FoundHypothesis>,
}

/// A hypothesis that passed.
#[derive(Debug, Clone, Copy)]
pub struct FoundHypothesis {
    /// The hypothesis, fitted.
    pub refined: Refined,
    /// log10 of its false-alarm probability.
    pub log10_false_alarm: f64,
    /// Number of stars, the brightest, with which it was fitted and tested.
    pub stars: usize,
    /// The hypothesis as the triangle gave it.
    first: Hypothesis,
    /// Largest distance of true pairs under it, in pixels.
    radius_px: f64,
}

impl<'a> TriangleSearch<'a> {
    /// A search over `field`.
    pub fn new(
        problem: Problem<'a>,
        plan: SearchPlan,
        priors: &Priors,
        effort: Effort,
        buffers: &'a mut SearchBuffers,
    ) -> Self {
        let Problem { field, sky, .. } = problem;
        buffers.refiner.around.forget();
        let [narrowest_rad, widest_rad] = sky.fov_range_rad();
        let wide = focal_length_px(field.width_px, widest_rad * FOV_SLACK);
        let narrow = focal_length_px(field.width_px, narrowest_rad / FOV_SLACK);
        let focal_px = match priors.pixel_scale_range_rad(field.width_px) {
            Some([smallest, largest]) => [1.0 / largest, 1.0 / smallest],
            None => [wide, narrow],
        };
        Self {
            problem,
            plan,
            effort,
            near: priors.near,
            is_scale_known: priors.scale.is_some(),
            buffers,
            observed: ObservedStars {
                field,
                sky,
                focal_px,
                diagonal_px: libm::hypot(field.width_px, field.height_px),
            },
            number: 1,
            hypotheses: 0,
            candidates: 0,
            fitted: 0,
            interrupted: false,
            best_log10: None,
            provisional: None,
        }
    }

    /// The next search, of another choice of stars.
    pub fn again(self, problem: Problem<'a>, plan: SearchPlan, priors: &Priors) -> Self {
        Self {
            number: self.number + 1,
            ..Self::new(problem, plan, priors, self.effort, self.buffers)
        }
    }

    /// Follows the lens of what was found in a window over the `whole` frame, which the search is of from
    /// then on. `None` where the stars of the frame do not confirm it.
    pub fn follow(
        mut self,
        window: &SearchWindow,
        found: &FoundHypothesis,
        whole: Problem<'a>,
        priors: &Priors,
    ) -> (Self, Option<FoundHypothesis>) {
        let grown = self.grown(window, found, whole);
        let (plan, hypotheses) = (self.plan, self.hypotheses);
        let mut search = self.again(whole, plan, priors);
        search.hypotheses = hypotheses;
        let found = grown.and_then(|hypothesis| search.adopt(&hypothesis));
        (search, found)
    }

    /// The lens of what was found in a window, as far as the stars of the `whole` frame show it.
    fn grown(
        &mut self,
        window: &SearchWindow,
        found: &FoundHypothesis,
        whole: Problem,
    ) -> Option<Hypothesis> {
        let refined = self.refined(&found.first, found.radius_px, TESTED_STARS)?;
        let SearchBuffers {
            refiner,
            growth,
            seed,
            ..
        } = &mut *self.buffers;
        seed.clear();
        seed.extend(refiner.pairs.iter().map(|pair| {
            let star = &window.field.stars[pair.observed];
            let measured = MeasuredStar::new(star, pair, refined.excess_sigma_px);
            MeasuredStar {
                pixel: window.in_frame(&star.position),
                ..measured
            }
        }));
        let seed = Seed::of_window(whole.field, window.centre(), &refined.hypothesis(), seed);
        growth.grow(whole, &seed)
    }

    /// The lens of an answer whose named stars the refiner has, followed from the middle of the frame once
    /// more. `None` where few detections are farther out than the named stars: these last ones were named
    /// where the lens predicts them, and can hold it there.
    pub fn followed_outwards(&mut self, problem: Problem, answer: &Refined) -> Option<Hypothesis> {
        /// Detections farther out than the named stars, over these, below which they are no reason.
        const MIN_BEYOND: f64 = 0.05;
        /// The part of the named stars, as an angle from the axis, that the lens is followed from.
        const MIDDLE: f64 = 0.9;
        let hypothesis = answer.hypothesis();
        let Hypothesis {
            camera,
            icrs_to_camera,
            ..
        } = &hypothesis;
        let SearchBuffers {
            refiner,
            growth,
            seed,
            ..
        } = &mut *self.buffers;
        let angle_rad = |pair: &Pair| {
            let direction = icrs_to_camera.apply(&pair.direction);
            direction.angle_to(&UnitVector::BORESIGHT)
        };
        let outermost_rad = refiner.pairs.iter().map(angle_rad).fold(0.0, f64::max);
        let stars = &problem.field.stars;
        let is_beyond = |star: &&ObservedStar| {
            let direction = camera.direction_of(&star.position);
            direction.is_none_or(|seen| seen.angle_to(&UnitVector::BORESIGHT) > outermost_rad)
        };
        let beyond = stars.iter().filter(is_beyond).count();
        if camera.radius_rad() < WIDE_RAD
            || (beyond as f64) < MIN_BEYOND * refiner.pairs.len() as f64
        {
            return None;
        }
        seed.clear();
        let of_middle = refiner.pairs.iter();
        let of_middle = of_middle.filter(|pair| angle_rad(pair) < MIDDLE * outermost_rad);
        let measured = |pair: &Pair| {
            let star = &stars[pair.observed];
            MeasuredStar::new(star, pair, answer.excess_sigma_px)
        };
        seed.extend(of_middle.map(measured));
        growth.grow(problem, &Seed::of_middle(&hypothesis, seed))
    }

    /// A hypothesis that was not found by a triangle, fitted to the stars of the field; `None` where
    /// these do not confirm it. Of what is brightest, most may be leaves and lamps.
    fn adopt(&mut self, hypothesis: &Hypothesis) -> Option<FoundHypothesis> {
        const STARS: [usize; 3] = [TESTED_STARS, 4 * TESTED_STARS, 16 * TESTED_STARS];
        let all = self.problem.field.stars.len();
        let counts = STARS.into_iter().enumerate();
        let mut counts = counts.filter(|(number, _)| *number == 0 || STARS[number - 1] < all);
        counts.find_map(|(number, stars)| {
            let found = self.adopt_with(hypothesis, stars)?;
            let log10_false_alarm = found.log10_false_alarm + libm::log10(number as f64 + 1.0);
            (log10_false_alarm <= LOG10_FALSE_ALARM_LIMIT).then_some(FoundHypothesis {
                log10_false_alarm,
                ..found
            })
        })
    }

    /// [`Self::adopt`] with so many stars.
    fn adopt_with(&mut self, hypothesis: &Hypothesis, stars: usize) -> Option<FoundHypothesis> {
        /// Largest distance of true pairs, in diagonals of the frame.
        const RADIUS_FRACTION: f64 = 0.002;
        let radius_px = RADIUS_FRACTION * self.observed.diagonal_px;
        let start = Start {
            hypothesis,
            radius_px,
            sceptical: false,
            stars,
            richest: DistortionModel::BrownConrady,
        };
        let refined = self.buffers.refiner.refine(self.problem, &start)?;
        let log10 = self.log10_of_agreement(self.problem.field, &refined.hypothesis())?;
        self.best_log10 = Some(log10);
        (log10 <= LOG10_FALSE_ALARM_LIMIT).then_some(FoundHypothesis {
            log10_false_alarm: log10,
            refined,
            stars,
            first: *hypothesis,
            radius_px,
        })
    }

    /// The refiner of hypotheses, with the stars that agreed with the last one.
    pub fn refiner(&mut self) -> &mut Refiner {
        &mut self.buffers.refiner
    }

    /// Keeps the stars of the refiner's last fit.
    pub fn keep_pairs(&mut self) {
        self.buffers.best.clone_from(&self.buffers.refiner.pairs);
    }

    /// Gives the refiner the stars that were kept.
    pub fn restore_pairs(&mut self) {
        self.buffers.refiner.pairs.clone_from(&self.buffers.best);
    }

    /// Lowest log10 of the false-alarm probabilities computed so far.
    pub fn best_log10_false_alarm(&self) -> Option<f64> {
        self.best_log10
    }

    /// Tries triangles until a hypothesis passes. Returns it, fitted to the brightest stars.
    pub fn run(&mut self) -> Option<FoundHypothesis> {
        let plan = self.plan;
        plan.passes
            .iter()
            .find_map(|pass| self.sweep(pass).or_else(|| self.provisional.take()))
            .or_else(|| self.vote())
    }

    /// Lets the triangles of more and more stars vote, and tests the poses with most votes. Every vote
    /// counts as a hypothesis.
    fn vote(&mut self) -> Option<FoundHypothesis> {
        let tested = self.hypotheses;
        self.candidates = 0;
        self.buffers.queries.clear();
        let ObservedStars {
            field, focal_px, ..
        } = self.observed;
        self.buffers
            .votes
            .begin(field.width_px, focal_px, self.near);
        let mut from = 2;
        self.plan.votes.iter().find_map(|pass| {
            // All triangles of fewer stars have voted.
            let has_more = from < self.problem.field.stars.len();
            if !has_more || self.is_spent() || self.interrupted {
                return None;
            }
            self.gather(pass, from);
            from = pass.stars;
            let votes = &mut self.buffers.votes;
            self.hypotheses = tested + votes.len() as u64;
            votes.count();
            self.try_leading().or_else(|| self.provisional.take())
        })
    }

    /// Whether as much was looked up as the plan allows.
    fn is_spent(&self) -> bool {
        self.candidates + WORK_OF_VOTE * self.buffers.votes.len() as u64 > self.plan.max_work
            || self.fitted >= self.plan.max_fitted
    }

    /// Lets the triangles of a pass vote whose faintest star is not one of the brightest `from`.
    fn gather(&mut self, pass: &SearchPass, from: usize) {
        for stars in triangles(from, self.stars_of(pass)) {
            if self.is_spent() || self.is_interrupted() {
                return;
            }
            let Some(triangle) = self.observed.triangle(stars, pass) else {
                continue;
            };
            let SearchBuffers {
                queries,
                looked_up,
                in_camera,
                votes,
                ..
            } = &mut *self.buffers;
            let first = queries.len();
            self.observed.add_queries(&triangle, queries);
            let of_triangle = &queries[first..];
            self.candidates += self.observed.look_up(of_triangle, looked_up);
            in_camera.clear();
            in_camera.extend(of_triangle.iter().map(|query| {
                let vectors = self.observed.vectors(&query.triangle, query.middle_px);
                CameraAxes::new(InCamera::new(&vectors).as_ref())
            }));
            let stars = &self.observed.sky.vectors;
            votes.add_all(in_camera, &looked_up.similar, first as u32, stars);
        }
    }

    /// Tests the poses with most votes.
    fn try_leading(&mut self) -> Option<FoundHypothesis> {
        let mut number = 0;
        while let Some(vote) = self.buffers.votes.leading(number)
            && self.fitted < self.plan.max_fitted
            && !self.is_interrupted()
        {
            if let Some(found) = self.try_vote(&vote) {
                return Some(found);
            }
            number += 1;
        }
        None
    }

    fn try_vote(&mut self, vote: &Vote) -> Option<FoundHypothesis> {
        let query = self.buffers.queries[vote.query()];
        let pending = self.pending(&query, &vote.similar)?;
        self.decide_pending(&pending, &query.triangle)
    }

    fn stars_of(&self, pass: &SearchPass) -> usize {
        pass.stars.min(self.problem.field.stars.len())
    }

    /// Tries the triangles of one pass in the order of their faintest star, then of the second.
    fn sweep(&mut self, pass: &SearchPass) -> Option<FoundHypothesis> {
        triangles(2, self.stars_of(pass)).find_map(|stars| {
            if self.is_exhausted() || self.is_interrupted() {
                return None;
            }
            let triangle = self.observed.triangle(stars, pass)?;
            self.try_triangle(&triangle)
        })
    }

    /// Whether the search is to end without a result, as its caller wants.
    pub fn is_interrupted(&mut self) -> bool {
        self.interrupted = self.interrupted || self.buffers.interrupt.is_due();
        self.interrupted
    }

    /// Whether no more hypotheses are to be tested.
    fn is_exhausted(&self) -> bool {
        self.hypotheses > self.plan.max_tested
            || self.candidates > self.plan.max_work
            || self.fitted >= self.plan.max_fitted
    }

    fn try_triangle(&mut self, triangle: &ObservedTriangle) -> Option<FoundHypothesis> {
        let mut queries = std::mem::take(&mut self.buffers.queries);
        let mut looked_up = std::mem::take(&mut self.buffers.looked_up);
        queries.clear();
        self.observed.add_queries(triangle, &mut queries);
        self.candidates += self.observed.look_up(&queries, &mut looked_up);
        let found = looked_up.similar.iter().find_map(|similar| {
            let query = &queries[similar.query as usize];
            self.try_similar(query, similar)
        });
        (self.buffers.queries, self.buffers.looked_up) = (queries, looked_up);
        found
    }

    /// Tests one hypothesis: the three observed stars are these three of the catalogue.
    fn try_similar(&mut self, query: &Query, similar: &Similar) -> Option<FoundHypothesis> {
        if self.is_exhausted() {
            return None;
        }
        let mut pending = self.pending(query, similar)?;
        self.hypotheses += 1;
        let triangle = &query.triangle;
        self.confirming_stars(triangle).test(&mut pending);
        if !pending.is_confirmed() {
            return None;
        }
        self.decide_pending(&pending, triangle)
    }

    fn pending(&self, query: &Query, similar: &Similar) -> Option<PendingHypothesis> {
        let pose = self.pose(query, similar)?;
        let zero_point_mag = f64::from(similar.zero_point_mag);
        let confirming_px = query.triangle.confirming_px;
        Some(PendingHypothesis::new(pose, zero_point_mag, confirming_px))
    }

    /// The pose in which the observed triangle is that of the catalogue; `None` where the priors
    /// exclude it.
    fn pose(&self, query: &Query, similar: &Similar) -> Option<Pose> {
        let sky = similar
            .corners
            .map(|c| self.problem.sky.grid.star(c))
            .map(GridStar::vector);
        let longest = (sky[0] - sky[1]).norm();
        let focal_px = libm::exp(query.ln_size - libm::log(longest));
        if let Some(SkyRegion { centre, radius_rad }) = &self.near {
            let reach_rad = libm::atan(self.observed.diagonal_px / focal_px) + radius_rad;
            if centre.as_vector().dot(&sky[0]) < libm::cos(reach_rad.min(std::f64::consts::PI)) {
                return None;
            }
        }
        let in_camera = InCamera::new(&self.observed.vectors(&query.triangle, focal_px))?;
        let AlignedTriangle {
            mirrored,
            of_camera,
            of_sky,
        } = in_camera.aligned(&sky)?;
        Some(Pose {
            sky_to_camera: of_camera * of_sky.transpose(),
            focal_px,
            mirrored,
        })
    }

    /// Those who confirm or refute hypotheses from a triangle.
    fn confirming_stars(&self, triangle: &ObservedTriangle) -> ConfirmingStars<'_> {
        ConfirmingStars {
            stars: &self.observed,
            triangle: triangle.stars,
            true_confirmation: triangle.true_confirmation,
        }
    }

    fn decide_pending(
        &mut self,
        pending: &PendingHypothesis,
        triangle: &ObservedTriangle,
    ) -> Option<FoundHypothesis> {
        let (width_px, height_px) = (self.problem.field.width_px, self.problem.field.height_px);
        let Pose {
            sky_to_camera,
            focal_px,
            mirrored,
        } = pending.pose;
        let hypothesis = Hypothesis {
            camera: CameraModel::pinhole(width_px, height_px, focal_px, mirrored),
            icrs_to_camera: Rotation::from_matrix(sky_to_camera),
            parameters: POSE_PARAMETERS,
            fitted_stars: 0,
            zero_point_mag: pending.zero_point_mag,
        };
        self.decide(&hypothesis, triangle)
    }

    /// Fits the hypothesis to the stars that agree and computes its false-alarm probability. Returns
    /// it if it ends the search.
    ///
    /// The brightest stars are asked first: mostly they alone are enough.
    fn decide(
        &mut self,
        hypothesis: &Hypothesis,
        triangle: &ObservedTriangle,
    ) -> Option<FoundHypothesis> {
        self.fitted += 1;
        if let Some(found) = self.tested(hypothesis, triangle, FIRST_TESTED_STARS)
            && found.log10_false_alarm <= LOG10_SURE
        {
            return Some(found);
        }
        let found = self.tested(hypothesis, triangle, TESTED_STARS)?;
        let log10 = found.log10_false_alarm;
        let is_best = self.best_log10.is_none_or(|best| log10 < best);
        if is_best {
            self.best_log10 = Some(log10);
        }
        if log10 <= LOG10_SURE {
            return Some(found);
        }
        if is_best && log10 <= LOG10_FALSE_ALARM_LIMIT {
            self.provisional = Some(found);
        }
        None
    }

    /// The hypothesis, fitted to the brightest `stars`, and its false-alarm probability.
    fn tested(
        &mut self,
        hypothesis: &Hypothesis,
        triangle: &ObservedTriangle,
        stars: usize,
    ) -> Option<FoundHypothesis> {
        let radius_px = triangle.confirming_px;
        let refined = self.refined(hypothesis, radius_px, stars)?;
        Some(FoundHypothesis {
            log10_false_alarm: self.log10_with(&refined.hypothesis(), stars)?,
            refined,
            stars,
            first: *hypothesis,
            radius_px,
        })
    }

    fn refined(
        &mut self,
        hypothesis: &Hypothesis,
        radius_px: f64,
        stars: usize,
    ) -> Option<Refined> {
        let start = Start {
            hypothesis,
            radius_px,
            sceptical: true,
            stars,
            richest: DistortionModel::Radial,
        };
        self.buffers.refiner.refine(self.problem(), &start)
    }

    /// What was found, fitted to all [`TESTED_STARS`], for the fit to all stars to start from.
    pub fn with_more_stars(&mut self, found: &FoundHypothesis) -> Refined {
        let more = (found.stars < TESTED_STARS)
            .then(|| self.refined(&found.first, found.radius_px, TESTED_STARS));
        more.flatten().unwrap_or(found.refined)
    }

    /// The stars that are searched, and the catalogue.
    pub fn problem(&self) -> Problem<'a> {
        self.problem
    }

    /// log10 of the false-alarm probability of an answer for the whole `field`, whose named stars the
    /// refiner has; `None` where it contradicts the priors. Bright stars that should be seen and are
    /// not speak against it.
    pub fn log10_of_answer(&mut self, field: &StarField, hypothesis: &Hypothesis) -> Option<f64> {
        let log10 = self.log10_of_agreement(field, hypothesis)?;
        Some((log10 - self.log10_unseen(field, hypothesis)).min(0.0))
    }

    /// log10 of the probability that so few of the brightest stars are seen in `field`, under a right
    /// hypothesis whose named stars the refiner has.
    pub fn log10_unseen(&mut self, field: &StarField, hypothesis: &Hypothesis) -> f64 {
        let SearchBuffers {
            refiner, unseen, ..
        } = &mut *self.buffers;
        let Refiner { around, pairs, .. } = refiner;
        let whole = Problem::new(field, self.problem.sky);
        unseen.log10(hypothesis, whole, pairs, around)
    }

    /// log10 of the probability that as many stars agree by chance. Where the stars that were searched
    /// do not show it, those below brighter detections may.
    fn log10_of_agreement(&mut self, field: &StarField, hypothesis: &Hypothesis) -> Option<f64> {
        /// Searches of other choices of stars and of windows, before those of the tiers.
        const BEFORE_TIERS: u32 = 22;
        let log10 = self.log10_with(hypothesis, TESTED_STARS)?;
        if log10 <= LOG10_FALSE_ALARM_LIMIT {
            return Some(log10);
        }
        let mut tiers = std::mem::take(&mut self.buffers.tiers);
        let of_tiers = tiers
            .below(field, self.effort.tiers())
            .iter()
            .zip(BEFORE_TIERS + 1..);
        let of_tiers = of_tiers.filter_map(|(tier, number)| {
            let problem = Problem {
                field: &tier.field,
                brighter: tier.brighter,
                ..self.problem
            };
            let log10 = self.log10_in(problem, hypothesis, TESTED_STARS)?;
            Some(log10 + libm::log10(searches_weight(number)))
        });
        let best_log10 = of_tiers.fold(log10, f64::min);
        self.buffers.tiers = tiers;
        Some(best_log10)
    }

    /// log10 of the false-alarm probability of `hypothesis` by the brightest `stars` that are
    /// searched; `None` where it contradicts the priors.
    fn log10_with(&mut self, hypothesis: &Hypothesis, stars: usize) -> Option<f64> {
        self.log10_in(self.problem, hypothesis, stars)
    }

    /// The same, by the stars of `problem`.
    fn log10_in(&mut self, problem: Problem, hypothesis: &Hypothesis, stars: usize) -> Option<f64> {
        let focal_px = hypothesis.camera.focal_length_px();
        let slack = 1.0 + 2.0 * PASSES[1].tolerance;
        let [shortest_px, longest_px] = self.observed.focal_px;
        // The catalogue sets no limit to what else than a pinhole sees.
        let is_free = !hypothesis.camera.is_pinhole() && !self.is_scale_known;
        if !is_free && (focal_px < shortest_px / slack || focal_px > longest_px * slack) {
            return None;
        }
        if let Some(SkyRegion { centre, radius_rad }) = &self.near {
            let (boresight, _) = hypothesis.icrs_to_camera.boresight_and_up();
            if boresight.angle_to(centre) > *radius_rad {
                return None;
            }
        }
        let hypotheses = self.hypotheses;
        let SearchBuffers {
            refiner,
            false_alarm,
            ..
        } = self.buffers;
        let log10 = false_alarm.log10(hypothesis, hypotheses, problem, stars, &mut refiner.around);
        Some((log10 + libm::log10(searches_weight(self.number))).min(0.0))
    }
}

/// Factor on the probability of a hypothesis of the search with this number over a field.
///
/// The inverses of those after the first add up to one: all of them together give chance as much
/// opportunity as the first.
fn searches_weight(number: u32) -> f64 {
    let number = f64::from(number);
    (number * (number - 1.0)).max(1.0)
}

/// The triangles of `stars` stars whose faintest is not one of the brightest `from`: in the order of
/// their faintest star, then of the second.
fn triangles(from: usize, stars: usize) -> impl Iterator<Item = [usize; 3]> {
    let pairs = |faintest| (1..faintest).flat_map(|b| (0..b).map(move |a| [a, b]));
    (from..stars).flat_map(move |c| pairs(c).map(move |[a, b]| [a, b, c]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_further_searches_together_give_chance_as_much_opportunity_as_the_first() {
        assert_eq!(searches_weight(1), 1.0);
        let sum: f64 = (2..1000).map(|n| 1.0 / searches_weight(n)).sum();
        assert!((0.99..=1.0).contains(&sum), "{sum}");
    }
}
