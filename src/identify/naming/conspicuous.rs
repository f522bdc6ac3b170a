//! Names of bright stars whose spots are saturated, by the pose alone.
//!
//! The place and the brightness of a saturated spot are off by more than they state, so that the odds of its name
//! are poor. But once the pose is known to a small part of a pixel, a bright star needs no odds: what is saturated
//! at its place, where no other star is as bright and nothing else is saturated, is its light. Such names are given
//! after the fit, which they do not change.
//!
//! The probability of chance is that of unrelated saturated light at the place: by its density in the frame or
//! around the place, whichever is larger.

use crate::base::coords::PixelPoint;
use crate::catalog::StarIndex;
use crate::catalog::sky_grid::GridStar;
use crate::identify::field::ObservedStar;
use crate::identify::hypothesis::{Hypothesis, Problem};
use crate::identify::pairing::Pair;
use std::f64::consts::PI;

/// The faintest star that is named so.
const FAINTEST_MAG: f32 = 5.0;
/// The centre of a saturated spot is off by so much on each axis, in pixels, beside its stated error.
const SPOT_SIGMA_PX: f64 = 0.4;
/// A star is at its place within so many standard errors, …
const SIGMAS: f64 = 3.0;
/// … and has no rival within so many times that.
const RIVALS: f64 = 10.0;
/// A star that is fainter by more than this is no rival.
const RIVAL_MAG: f64 = 1.5;
/// A saturated star is at most so much fainter than it was measured.
const FAINTER_MAG: f64 = 1.0;
/// The surroundings in which other saturated light is counted, as a share of the frame's diagonal.
const AROUND: f64 = 0.04;
/// The probability that a bright star is seen at its place, rather than hidden.
const SEEN: f64 = 0.5;
/// How far stars move by aberration and their own motion, in radians.
const MOTION_RAD: f64 = 1e-3;

/// What is known when the fit is done.
pub struct Posed<'a> {
    problem: Problem<'a>,
    hypothesis: Hypothesis,
    excess_sigma_px: f64,
    /// The stars that have a name.
    named: &'a [Pair],
    /// Saturated light without a name: its number among the observed stars, and its place.
    unnamed: Vec<(usize, PixelPoint)>,
}

/// A catalogue star near a spot.
struct Candidate {
    star: StarIndex,
    v_mag: f32,
    distance_px: f64,
}

impl<'a> Posed<'a> {
    /// After a fit that ended with the pairs `named`; `excess_sigma_px` is what the stated centroid errors lack.
    pub fn new(
        problem: Problem<'a>,
        hypothesis: Hypothesis,
        excess_sigma_px: f64,
        named: &'a [Pair],
    ) -> Self {
        let stars = problem.field.stars.iter().enumerate();
        let saturated = stars.filter(|(_, star)| star.is_saturated);
        let has_name = |observed: usize| named.iter().any(|pair| pair.observed == observed);
        let unnamed = saturated.filter(|(observed, _)| !has_name(*observed));
        Self {
            problem,
            hypothesis,
            excess_sigma_px,
            named,
            unnamed: unnamed
                .map(|(observed, star)| (observed, star.position))
                .collect(),
        }
    }

    /// The pairs of saturated spots without a name that are at most by this probability chance.
    pub fn pairs(&self, most_chance: f64) -> Vec<Pair> {
        let spots = self.unnamed.iter();
        let pairs = spots.filter_map(|(observed, _)| self.pair(*observed));
        pairs.filter(|pair| pair.p_chance <= most_chance).collect()
    }

    /// The star that a spot is, if it is at its place and has no rivals.
    fn pair(&self, observed: usize) -> Option<Pair> {
        let spot = &self.problem.field.stars[observed];
        let own_sigma_px = libm::hypot(spot.sigma_px, self.excess_sigma_px);
        let error_px = SIGMAS * libm::hypot(own_sigma_px, SPOT_SIGMA_PX);
        let near = self.near(spot, RIVALS * error_px)?;
        let brightest = near.first()?;
        let v_mag = f64::from(brightest.v_mag);
        let is_it = brightest.distance_px <= error_px
            && !self.named.iter().any(|pair| pair.star == brightest.star)
            && v_mag < spot.mag + self.hypothesis.zero_point_mag + FAINTER_MAG;
        let mut others = near.iter().skip(1);
        let has_rival = others.any(|other| f64::from(other.v_mag) < v_mag + RIVAL_MAG);
        let reach_px = RIVALS * error_px;
        let is_alone = self
            .unnamed
            .iter()
            .filter(|(_, place)| place.distance_to(&spot.position) < reach_px)
            .count()
            == 1;
        if !is_it || has_rival || !is_alone {
            return None;
        }
        let star = self.problem.sky.catalog().star(brightest.star);
        Some(Pair {
            observed,
            star: brightest.star,
            v_mag: brightest.v_mag,
            direction: self.problem.field.places.of(star),
            light_sigma_px: 0.0,
            residual_px: brightest.distance_px,
            p_chance: self.p_chance(spot, error_px),
        })
    }

    /// The stars within `reach_px` of a spot, brightest first.
    fn near(&self, spot: &ObservedStar, reach_px: f64) -> Option<Vec<Candidate>> {
        let Hypothesis {
            camera,
            icrs_to_camera,
            ..
        } = &self.hypothesis;
        let direction = icrs_to_camera
            .inverse()
            .apply(&camera.direction_of(&spot.position)?);
        let radius_rad = reach_px / camera.focal_length_px() + MOTION_RAD;
        let faintest = FAINTEST_MAG + RIVAL_MAG as f32;
        let sky = self.problem.sky;
        let mut near = Vec::new();
        let mut keep = |star: &GridStar| {
            let direction = self.problem.field.places.of(sky.catalog().star(star.index));
            let pixel = camera.pixel_of(&icrs_to_camera.apply(&direction));
            let distance_px =
                pixel.map_or(f64::INFINITY, |pixel| pixel.distance_to(&spot.position));
            if distance_px < reach_px {
                near.push(Candidate {
                    star: star.index,
                    v_mag: star.v_mag,
                    distance_px,
                });
            }
        };
        sky.grid
            .for_each_within(&direction, radius_rad, faintest, &mut keep);
        // The catalogue is sorted by brightness.
        near.sort_unstable_by_key(|candidate| candidate.star);
        let is_bright = near
            .first()
            .is_some_and(|first| first.v_mag <= FAINTEST_MAG);
        is_bright.then_some(near)
    }

    /// The probability that unrelated saturated light is within the error of the place.
    fn p_chance(&self, spot: &ObservedStar, error_px: f64) -> f64 {
        let field = self.problem.field;
        let around_px = AROUND * libm::hypot(field.width_px, field.height_px);
        let within = |near: &&(usize, PixelPoint)| near.1.distance_to(&spot.position) < around_px;
        let around = self.unnamed.iter().filter(within).count() as f64;
        // One of them is the spot itself; that none other was found does not mean that there can be none.
        let everywhere = self.unnamed.len() as f64 / (field.width_px * field.height_px);
        let density = everywhere.max((around - 1.0) / (PI * around_px * around_px));
        let by_chance = density * PI * error_px * error_px;
        by_chance / (by_chance + SEEN)
    }
}
