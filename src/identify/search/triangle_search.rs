//! The search for a hypothesis: pointing, roll and scale.
//!
//! Triangles of bright observed stars → similar catalogue triangles → hypotheses → confirmed by
//! further stars.
//!
//! A size class of the index corresponds to a range of focal lengths. In wide fields the shape of a
//! triangle depends on the focal length (gnomonic projection), so the range is divided into steps
//! within which it does not change noticeably.

use super::confirmation::{Batch, ConfirmingStars, PendingHypothesis, Pose};
use super::false_alarm::{FalseAlarm, TESTED_STARS};
use super::plan::{AGAIN, BRIGHTEST, PASSES, SearchPass, SearchPlan, TIER};
use super::tiers::Tiers;
use super::votes::{Vote, Votes};
use crate::base::coords::Rotation;
use crate::base::interrupt::Interrupt;
use crate::camera::{CameraModel, DistortionModel, focal_length_px, frame_centre};
use crate::identify::field::{Photometry, StarField};
use crate::identify::fit::{POSE_PARAMETERS, Refined, Refiner, Start};
use crate::identify::hypothesis::{Hypothesis, Problem};
use crate::identify::index::TriangleShape;
use crate::identify::pairing::Pair;
use crate::identify::priors::{Priors, SkyRegion};
use crate::sky::catalog::sky_grid::GridStar;
use arrayvec::ArrayVec;
use nalgebra::{Matrix3, Vector3};

/// Margin on the fields of view that the index allows, so that a field of exactly that width is
/// found.
const FOV_SLACK: f64 = 1.05;

/// Centroid errors in a triangle's tolerance, in standard errors.
const CENTROID_SIGMAS: f64 = 2.0;
/// Smallest longest side of a triangle, in units of the frame's diagonal.
const MIN_TRIANGLE_SHARE: f64 = 0.12;
/// Largest distance of a confirming star from its catalogue star: in distortion tolerances times
/// the frame's diagonal, and in centroid errors extrapolated from the triangle.
const CONFIRMING_TOLERANCES: f64 = 1.5;
const CONFIRMING_SIGMAS: f64 = 3.5;
/// Maximum number of hypotheses for each triangle. Few stars have few triangles, and every pass
/// tries the same ones again, so more hypotheses would hardly find anything.
const HYPOTHESES_PER_TRIANGLE: u64 = 250;
/// Minimum number of hypotheses, however few the triangles.
const MIN_HYPOTHESES: u64 = 30_000;
/// From this number of hypotheses on, a search is long: several are tested together.
const LONG_SEARCH: u64 = 2_000;
/// Margin on the sizes of a triangle that decide which classes of the index can hold it.
const CLASS_SLACK: f64 = 1.01;
/// Most catalogue triangles that are looked up together.
const WEIGHED: usize = 64;
/// Most hypotheses that wait for their test.
const WAITING: usize = 128;
/// Triangles with a larger tolerance of their ratios resemble too many others.
const MAX_TOLERANCE: f64 = 0.03;
/// Largest log10 of the false-alarm probability at which a frame counts as identified.
pub const LOG10_FALSE_ALARM_LIMIT: f64 = -8.0;
/// A hypothesis below this ends the search. One between the two limits waits for the end of its
/// pass, in case a better one comes: a few inexact stars may also agree with a neighbor of the
/// truth.
const LOG10_SURE: f64 = -14.0;

/// Number of stars, the brightest, with which a hypothesis is tested first. It ends the search where
/// these make it sure. That adds 10⁻¹⁴ to the false-alarm probability at most, to the 10⁻⁸ of the
/// test with [`TESTED_STARS`] that follows where they do not.
const FIRST_TESTED_STARS: usize = 25;

/// Buffers of the search, reused from field to field.
#[derive(Debug, Default)]
pub struct SearchBuffers {
    /// Offsets of the brightest stars from the frame's centre, in pixels.
    offsets: Vec<[f64; 2]>,
    /// Refines hypotheses.
    pub refiner: Refiner,
    false_alarm: FalseAlarm,
    /// The stars of the best fit so far, while others are tried.
    best: Vec<Pair>,
    /// Catalogue triangles of the shape of an observed one.
    similar: Vec<[u32; 3]>,
    /// Hypotheses from one triangle that wait for their test.
    waiting: Vec<PendingHypothesis>,
    batch: Batch,
    votes: Votes,
    /// The queries of those who voted.
    queries: Vec<Query>,
    /// To confirm answers.
    tiers: Tiers,
    /// Ends searches early.
    pub interrupt: Interrupt,
}

/// The search over one field.
pub struct Search<'a> {
    problem: Problem<'a>,
    plan: SearchPlan,
    near: Option<SkyRegion>,
    buffers: &'a mut SearchBuffers,
    /// Smallest and largest focal length, in pixels.
    focal_px: [f64; 2],
    diagonal_px: f64,
    /// Position of this search among those over the field, from 1.
    number: u32,
    hypotheses: u64,
    most_hypotheses: u64,
    candidates: u64,
    /// Number of observed triangles that were asked to vote, where hypotheses are votes.
    voters: Option<u32>,
    /// Whether the interrupt was due; then it is not asked again.
    interrupted: bool,
    /// How often it was asked whether the search is to end.
    asked: u32,
    best_log10: Option<f64>,
    /// The best hypothesis that passes the limit but does not end the search.
    provisional: Option<Found>,
}

/// A hypothesis that passed.
#[derive(Debug, Clone, Copy)]
pub struct Found {
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

/// A triangle of observed stars.
#[derive(Debug, Clone, Copy)]
struct ObservedTriangle {
    stars: [usize; 3],
    /// Largest distance of a corner from the frame's centre, in pixels.
    reach_px: f64,
    /// Tolerance of its ratios.
    tolerance: f64,
    /// Largest distance of a confirming star from its catalogue star, in pixels.
    confirming_px: f64,
    /// Probability that another star confirms a true hypothesis, see [`SearchPass`].
    true_confirmation: f64,
}

/// A triangle with its corners in the order of its shape, and the focal lengths for which it has
/// that shape.
#[derive(Debug, Clone, Copy)]
struct Query {
    triangle: ObservedTriangle,
    /// Its longest side, as a chord, at the focal length `middle_px`.
    longest: f64,
    middle_px: f64,
    range_px: [f64; 2],
}

/// A catalogue triangle beside an observed one.
#[derive(Clone, Copy)]
struct Weighed {
    /// Johnson V minus observed magnitude; `None` where the corners disagree.
    zero_point_mag: Option<f64>,
    /// The focal length at which both are of the same size.
    focal_px: f64,
}

impl<'a> Search<'a> {
    /// A search over `field`.
    pub fn new(problem: Problem<'a>, priors: &Priors, buffers: &'a mut SearchBuffers) -> Self {
        let Problem { field, sky, .. } = problem;
        let plan = if problem.brighter > 0 {
            TIER
        } else {
            BRIGHTEST
        };
        let centre = frame_centre(field.width_px, field.height_px);
        let passes = plan.passes.iter().chain(plan.votes);
        let most = passes.map(|p| p.stars).max().unwrap_or(0);
        let brightest = field.brightest(most).iter();
        buffers.offsets.clear();
        buffers
            .offsets
            .extend(brightest.map(|s| [s.position.x - centre.x, s.position.y - centre.y]));
        buffers.refiner.around.forget();
        let [narrowest_rad, widest_rad] = sky.fov_range_rad();
        let wide = focal_length_px(field.width_px, widest_rad * FOV_SLACK);
        let narrow = focal_length_px(field.width_px, narrowest_rad / FOV_SLACK);
        let focal_px = match priors.pixel_scale_range_rad(field.width_px) {
            Some([smallest, largest]) => [1.0 / largest, 1.0 / smallest],
            None => [wide, narrow],
        };
        let stars = buffers.offsets.len() as u64;
        let triangles = stars * stars.saturating_sub(1) * stars.saturating_sub(2) / 6;
        let most_hypotheses = (HYPOTHESES_PER_TRIANGLE * triangles)
            .max(MIN_HYPOTHESES)
            .min(plan.max_hypotheses);
        Self {
            problem,
            plan,
            near: priors.near,
            buffers,
            focal_px,
            diagonal_px: field.width_px.hypot(field.height_px),
            number: 1,
            hypotheses: 0,
            most_hypotheses,
            candidates: 0,
            voters: None,
            interrupted: false,
            asked: 0,
            best_log10: None,
            provisional: None,
        }
    }

    /// The next search, of another choice of stars, whose triangles only vote.
    pub fn again(self, problem: Problem<'a>, priors: &Priors) -> Self {
        let next = Self::new(problem, priors, self.buffers);
        let plan = if problem.brighter > 0 { TIER } else { AGAIN };
        Self {
            number: self.number + 1,
            plan,
            ..next
        }
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
    pub fn run(&mut self) -> Option<Found> {
        let plan = self.plan;
        plan.passes
            .iter()
            .find_map(|pass| self.sweep(pass).or_else(|| self.provisional.take()))
            .or_else(|| self.vote())
    }

    /// Lets the triangles of a pass vote, and tests the poses with most votes. Every vote counts as a
    /// hypothesis.
    fn vote(&mut self) -> Option<Found> {
        self.buffers.votes.clear();
        self.buffers.queries.clear();
        self.candidates = 0;
        self.most_hypotheses = self.hypotheses + self.plan.max_votes;
        let mut voters = 0;
        self.plan.votes.iter().find_map(|pass| {
            self.voters = Some(voters);
            self.sweep(pass);
            voters = self.voters.take().unwrap_or(voters);
            self.buffers.votes.count();
            let leaders = 0..self.buffers.votes.leaders();
            leaders
                .take_while(|_| !self.interrupted)
                .flat_map(|rank| self.buffers.votes.votes_for(rank))
                .collect::<Vec<Vote>>()
                .iter()
                .find_map(|vote| self.try_vote(vote))
                .or_else(|| self.provisional.take())
        })
    }

    fn try_vote(&mut self, vote: &Vote) -> Option<Found> {
        let query = self.buffers.queries[vote.query as usize];
        let weighed = self.weigh(&query, &vote.corners);
        let pose = self.pose(&query, &vote.corners, weighed.focal_px)?;
        let pending = PendingHypothesis::new(
            pose,
            weighed.zero_point_mag?,
            self.hypotheses,
            query.triangle.confirming_px,
        );
        self.decide_pending(&pending, &query.triangle)
    }

    /// Tries the triangles of one pass in the order of their faintest star, then of the second.
    fn sweep(&mut self, pass: &SearchPass) -> Option<Found> {
        let stars = pass.stars.min(self.buffers.offsets.len());
        for faintest in pass.from..stars {
            for middle in 1..faintest {
                for brightest in 0..middle {
                    if self.is_to_end() {
                        return None;
                    }
                    let triangle = self.triangle([brightest, middle, faintest], pass);
                    if let Some(found) = triangle.and_then(|triangle| self.try_triangle(&triangle))
                    {
                        return Some(found);
                    }
                }
            }
        }
        None
    }

    /// Whether the search is to end without a result, as its caller wants.
    pub fn is_interrupted(&mut self) -> bool {
        self.interrupted = self.interrupted || self.buffers.interrupt.is_due();
        self.interrupted
    }

    /// Whether the search ends without a result. To ask the clock takes as long as some candidates.
    fn is_to_end(&mut self) -> bool {
        const ASKED_EACH: u32 = 4;
        self.asked = self.asked.wrapping_add(1);
        let is_turn = self.asked.is_multiple_of(ASKED_EACH);
        self.is_exhausted() || self.interrupted || (is_turn && self.is_interrupted())
    }

    fn is_exhausted(&self) -> bool {
        self.hypotheses > self.most_hypotheses || self.candidates > self.plan.max_candidates
    }

    fn triangle(&self, stars: [usize; 3], pass: &SearchPass) -> Option<ObservedTriangle> {
        let [a, b, c] = stars.map(|s| self.buffers.offsets[s]);
        let side = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
        let longest_px = side(a, b).max(side(b, c)).max(side(c, a));
        let shares = MIN_TRIANGLE_SHARE..=pass.largest_share;
        if !shares.contains(&(longest_px / self.diagonal_px)) {
            return None;
        }
        let sigma_px = stars
            .iter()
            .map(|&s| self.problem.field.stars[s].sigma_px)
            .fold(0.0, f64::max);
        let centroid_tolerance = CENTROID_SIGMAS * sigma_px / longest_px;
        let tolerance = pass.tolerance.hypot(centroid_tolerance);
        if tolerance > MAX_TOLERANCE {
            return None;
        }
        let leverage = 1.0 + 0.5 * self.diagonal_px / longest_px;
        let distortion_px = CONFIRMING_TOLERANCES * pass.tolerance * self.diagonal_px;
        Some(ObservedTriangle {
            stars,
            reach_px: [a, b, c]
                .iter()
                .map(|p| p[0].hypot(p[1]))
                .fold(0.0, f64::max),
            tolerance,
            true_confirmation: pass.true_confirmation,
            confirming_px: distortion_px.hypot(CONFIRMING_SIGMAS * leverage * sigma_px),
        })
    }

    fn try_triangle(&mut self, triangle: &ObservedTriangle) -> Option<Found> {
        if let Some(voters) = &mut self.voters {
            *voters += 1;
        }
        // Its size at the longest and the shortest focal length.
        let (smallest, largest) = (
            self.longest_side(triangle, self.focal_px[1]) / CLASS_SLACK,
            self.longest_side(triangle, self.focal_px[0]) * CLASS_SLACK,
        );
        let classes = &self.problem.sky.triangles.classes;
        let is_of_size = |number: &usize| {
            let class = &classes[*number];
            class.high >= smallest && class.low <= largest
        };
        (0..classes.len())
            .filter(is_of_size)
            .find_map(|class| self.try_class(triangle, class))
            .or_else(|| self.try_waiting(triangle))
    }

    fn try_class(&mut self, triangle: &ObservedTriangle, number: usize) -> Option<Found> {
        let class = &self.problem.sky.triangles.classes[number];
        let low_px = self
            .focal_of_chord(triangle, class.high)?
            .max(self.focal_px[0]);
        let high_px = self
            .focal_of_chord(triangle, class.low)?
            .min(self.focal_px[1]);
        if low_px >= high_px {
            return None;
        }
        // Half a step changes the shape by at most half the tolerance.
        let stretch = (triangle.reach_px / low_px).powi(2);
        let step = (triangle.tolerance / stretch).max(1e-3);
        let steps = ((high_px / low_px).ln() / step).ceil().max(1.0);
        let factor = (high_px / low_px).powf(1.0 / steps);
        (0..steps as i32).find_map(|i| {
            let from_px = low_px * factor.powi(i);
            self.try_focal(triangle, number, [from_px, from_px * factor])
        })
    }

    /// Unit vectors of the triangle's stars for this focal length, not mirrored.
    fn vectors(&self, triangle: &ObservedTriangle, focal_px: f64) -> [Vector3<f64>; 3] {
        triangle.stars.map(|s| {
            let [u, v] = self.buffers.offsets[s];
            Vector3::new(u, v, focal_px).normalize()
        })
    }

    /// The triangle's longest side at this focal length, as a chord.
    fn longest_side(&self, triangle: &ObservedTriangle, focal_px: f64) -> f64 {
        let [a, b, c] = self.vectors(triangle, focal_px);
        (a - b).norm().max((b - c).norm()).max((c - a).norm())
    }

    /// The focal length at which the triangle's longest side is `chord`.
    fn focal_of_chord(&self, triangle: &ObservedTriangle, chord: f64) -> Option<f64> {
        let mut focal_px = self.diagonal_px;
        for _ in 0..8 {
            let ratio = self.longest_side(triangle, focal_px) / chord;
            focal_px *= ratio;
            if (ratio - 1.0).abs() < 1e-3 {
                break;
            }
        }
        focal_px.is_finite().then_some(focal_px)
    }

    fn try_focal(
        &mut self,
        triangle: &ObservedTriangle,
        class: usize,
        range_px: [f64; 2],
    ) -> Option<Found> {
        if self.is_to_end() {
            return None;
        }
        let middle_px = (range_px[0] * range_px[1]).sqrt();
        let vectors = self.vectors(triangle, middle_px);
        let shape = TriangleShape::new([&vectors[0], &vectors[1], &vectors[2]])?;
        let query = Query {
            triangle: ObservedTriangle {
                stars: shape.order.map(|i| triangle.stars[i]),
                ..*triangle
            },
            longest: shape.longest,
            middle_px,
            range_px,
        };
        if self.voters.is_some() {
            self.buffers.queries.push(query);
        }
        let mut similar = std::mem::take(&mut self.buffers.similar);
        similar.clear();
        let sky = self.problem.sky;
        sky.for_each_similar(class, shape.ratios, triangle.tolerance, |corners| {
            similar.push(*corners);
        });
        let found = similar
            .chunks(WEIGHED)
            .find_map(|corners| self.try_similar(&query, corners));
        self.buffers.similar = similar;
        found
    }

    /// Tries catalogue triangles in turn. Size and brightness of several are looked up first, so that
    /// the processor fetches for all of them at once.
    fn try_similar(&mut self, query: &Query, similar: &[[u32; 3]]) -> Option<Found> {
        // Of a small frame's inexact triangles one alone may resemble millions.
        if self.is_to_end() {
            return None;
        }
        let weighed: ArrayVec<Weighed, WEIGHED> = similar
            .iter()
            .map(|corners| self.weigh(query, corners))
            .collect();
        similar.iter().zip(weighed).find_map(|(corners, weighed)| {
            self.candidates += 1;
            if self.is_exhausted() {
                return None;
            }
            self.try_hypothesis(query, corners, &weighed)
        })
    }

    /// Size and brightness of a catalogue triangle beside those of the observed one.
    #[inline]
    fn weigh(&self, query: &Query, corners: &[u32; 3]) -> Weighed {
        let stars = corners.map(|c| self.problem.sky.grid.star(c));
        let difference = |i: usize| {
            f64::from(stars[i].v_mag) - self.problem.field.stars[query.triangle.stars[i]].mag
        };
        let longest = (stars[0].vector() - stars[1].vector()).norm();
        Weighed {
            zero_point_mag: self.zero_point([0, 1, 2].map(difference)),
            focal_px: query.middle_px * query.longest / longest,
        }
    }

    /// Tests one hypothesis: the three observed stars are these three of the catalogue.
    fn try_hypothesis(
        &mut self,
        query: &Query,
        corners: &[u32; 3],
        weighed: &Weighed,
    ) -> Option<Found> {
        let triangle = &query.triangle;
        let zero_point = weighed.zero_point_mag?;
        let focal_px = weighed.focal_px;
        let slack = 1.0 + 2.0 * triangle.tolerance;
        if focal_px < query.range_px[0] / slack || focal_px > query.range_px[1] * slack {
            return None;
        }
        let pose = self.pose(query, corners, focal_px)?;
        self.hypotheses += 1;
        if let Some(voter) = self.voters {
            let query = self.buffers.queries.len() as u32 - 1;
            let width_px = self.problem.field.width_px;
            self.buffers
                .votes
                .add(&pose, width_px, voter, query, *corners);
            return None;
        }
        let mut pending =
            PendingHypothesis::new(pose, zero_point, self.hypotheses, triangle.confirming_px);
        if self.hypotheses > LONG_SEARCH {
            self.buffers.waiting.push(pending);
            return if self.buffers.waiting.len() < WAITING {
                None
            } else {
                self.try_waiting(triangle)
            };
        }
        self.confirming_stars(triangle).test(&mut pending);
        if !pending.is_confirmed() {
            return None;
        }
        self.decide_pending(&pending, triangle)
    }

    /// The pose in which the observed triangle is that of the catalogue; `None` where the priors
    /// exclude it.
    fn pose(&self, query: &Query, corners: &[u32; 3], focal_px: f64) -> Option<Pose> {
        let sky = corners
            .map(|c| self.problem.sky.grid.star(c))
            .map(GridStar::vector);
        let mut observed = self.vectors(&query.triangle, focal_px);
        if let Some(SkyRegion { centre, radius_rad }) = &self.near {
            let reach_rad = (self.diagonal_px / focal_px).atan() + radius_rad;
            if centre.as_vector().dot(&sky[0]) < reach_rad.min(std::f64::consts::PI).cos() {
                return None;
            }
        }
        let mirrored = triple(&observed) * triple(&sky) < 0.0;
        if mirrored {
            observed.iter_mut().for_each(|v| v.x = -v.x);
        }
        Some(Pose {
            sky_to_camera: two_star_rotation(&observed, &sky)?,
            focal_px,
            mirrored,
        })
    }

    /// The median zero point of the triangle's stars, if all three agree.
    fn zero_point(&self, of_stars: [f64; 3]) -> Option<f64> {
        let [a, b, c] = of_stars;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let spread = self.problem.field.photometry.tolerance_mag();
        let consistent = match self.problem.field.photometry {
            Photometry::Instrumental => high - low <= spread,
            Photometry::JohnsonV => low >= -spread && high <= spread,
        };
        let zero_point = match self.problem.field.photometry {
            Photometry::Instrumental => a + b + c - low - high,
            Photometry::JohnsonV => 0.0,
        };
        consistent.then_some(zero_point)
    }

    /// Those who confirm or refute hypotheses from a triangle.
    fn confirming_stars(&self, triangle: &ObservedTriangle) -> ConfirmingStars<'_> {
        ConfirmingStars {
            field: self.problem.field,
            sky: self.problem.sky,
            offsets: &self.buffers.offsets,
            triangle: triangle.stars,
            true_confirmation: triangle.true_confirmation,
        }
    }

    /// Tests the hypotheses that wait, all from this triangle, and decides on those that are
    /// confirmed, in their order. The result is that of testing each when it came.
    fn try_waiting(&mut self, triangle: &ObservedTriangle) -> Option<Found> {
        if self.buffers.waiting.is_empty() {
            return None;
        }
        let mut waiting = std::mem::take(&mut self.buffers.waiting);
        let mut batch = std::mem::take(&mut self.buffers.batch);
        self.confirming_stars(triangle)
            .test_all(&mut waiting, &mut batch);
        let last = self.hypotheses;
        let found = waiting
            .iter()
            .filter(|pending| pending.is_confirmed())
            .find_map(|pending| {
                self.hypotheses = pending.number;
                self.decide_pending(pending, triangle)
            });
        if found.is_none() {
            self.hypotheses = last;
        }
        waiting.clear();
        (self.buffers.waiting, self.buffers.batch) = (waiting, batch);
        found
    }

    fn decide_pending(
        &mut self,
        pending: &PendingHypothesis,
        triangle: &ObservedTriangle,
    ) -> Option<Found> {
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
            zero_point_mag: pending.zero_point_mag,
        };
        self.decide(&hypothesis, triangle)
    }

    /// Fits the hypothesis to the stars that agree and computes its false-alarm probability. Returns
    /// it if it ends the search.
    ///
    /// The brightest stars are asked first: mostly they alone are enough.
    fn decide(&mut self, hypothesis: &Hypothesis, triangle: &ObservedTriangle) -> Option<Found> {
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
    ) -> Option<Found> {
        let radius_px = triangle.confirming_px;
        let refined = self.refined(hypothesis, radius_px, stars)?;
        Some(Found {
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
    pub fn with_more_stars(&mut self, found: &Found) -> Refined {
        let more = (found.stars < TESTED_STARS)
            .then(|| self.refined(&found.first, found.radius_px, TESTED_STARS));
        more.flatten().unwrap_or(found.refined)
    }

    /// The stars that are searched, and the catalogue.
    pub fn problem(&self) -> Problem<'a> {
        self.problem
    }

    /// log10 of the false-alarm probability of an answer for the whole `field`; `None` where it
    /// contradicts the priors. Where the stars that were searched do not show it, those below
    /// brighter detections may.
    pub fn log10_of_answer(&mut self, field: &StarField, hypothesis: &Hypothesis) -> Option<f64> {
        /// Searches of other choices of stars, before those of the tiers.
        const BEFORE_TIERS: u32 = 2;
        let log10 = self.log10_with(hypothesis, TESTED_STARS)?;
        if log10 <= LOG10_FALSE_ALARM_LIMIT {
            return Some(log10);
        }
        let mut tiers = std::mem::take(&mut self.buffers.tiers);
        let of_tiers = tiers.below(field).iter().zip(BEFORE_TIERS + 1..);
        let of_tiers = of_tiers.filter_map(|(tier, number)| {
            let problem = Problem {
                field: &tier.field,
                brighter: tier.brighter,
                ..self.problem
            };
            let log10 = self.log10_in(problem, hypothesis, TESTED_STARS)?;
            Some(log10 + searches_weight(number).log10())
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
        let focal_px = hypothesis.camera.focal_length_px;
        let slack = 1.0 + 2.0 * PASSES[1].tolerance;
        if focal_px < self.focal_px[0] / slack || focal_px > self.focal_px[1] * slack {
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
        Some((log10 + searches_weight(self.number).log10()).min(0.0))
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

fn triple([a, b, c]: &[Vector3<f64>; 3]) -> f64 {
    a.cross(b).dot(c)
}

/// The rotation from the sky to the camera by two stars (TRIAD, with the middle of AB as the first
/// vector).
fn two_star_rotation(
    observed: &[Vector3<f64>; 3],
    sky: &[Vector3<f64>; 3],
) -> Option<Matrix3<f64>> {
    let frame = |a: &Vector3<f64>, b: &Vector3<f64>| {
        let first = (a + b).try_normalize(1e-12)?;
        let third = a.cross(b).try_normalize(1e-15)?;
        Some(Matrix3::from_columns(&[first, third.cross(&first), third]))
    };
    let camera = frame(&observed[0], &observed[1])?;
    Some(camera * frame(&sky[0], &sky[1])?.transpose())
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
