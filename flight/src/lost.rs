//! Where does the camera look, if nothing is known?
//!
//! Triangles of the brightest spots → triangles of the catalogue with the same sides → the attitude of each → stars that
//! are then where spots are → the probability that chance does as well.
//!
//! The false-alarm probability is that of a binomial distribution: each star that is to be seen has a spot near it by
//! chance with the probability (spots × searched area / area of the frame). The three stars of the triangle do not count,
//! and the probability is multiplied by the number of attitudes that were tried.

use crate::attitude;
use crate::catalog::{SIDE_UNITS, Triangle, class_of};
use crate::chance::log10_tail;
use crate::matching::{self, Pairing, Reach, View, apparent, look_up};
use crate::tracker::Tracker;
use crate::{Attitude, Budget, Sky, Spot, Status, Work};
use nalgebra::{Matrix3, Vector3};

/// Triangles are made of this many of the brightest spots.
const SEARCHED_SPOTS: usize = 24;
/// Stars that an identification needs: a triangle, and one that confirms it.
const MIN_STARS: usize = 4;
/// Sides may differ by this many standard errors.
const SIDE_SIGMAS: f64 = 4.0;
/// What sides of the catalogue lack: aberration, as a share of the side, …
const ABERRATION: f64 = 1e-4;
/// … and proper motions, in radians.
const MOTION_RAD: f64 = 3e-5;
/// Stars that are looked for: as many as there are spots, times this, and a few more.
const STARS_PER_SPOT: usize = 2;
const MORE_STARS: usize = 8;
/// Rounds in which pairs and attitude are made better.
pub(crate) const ROUNDS: usize = 2;
/// Stars may be this far from where rows that are read one after the other show them, in pixels: the rate is not known.
const ROLLING_PX: f64 = 0.5;
/// Under the attitude of a triangle stars may be this much farther from their spots, in pixels.
const FIRST_REACH_PX: f64 = 2.0;
/// Spots stay paired within this many standard errors, …
const PAIR_SIGMAS: f64 = 5.0;
/// … and this.
const MIN_REACH_PX: f64 = 0.3;
/// Residuals that are this much larger than the stated errors are of another sky.
const MAX_REDUCED_CHI_SQUARE: f64 = 25.0;
/// Stars gather, so that chance finds more than an even density says.
const CROWDING: f64 = 2.0;

/// Three spots.
struct Seen {
    /// Their sides, in units of the catalogue, longest first.
    sides: [f64; 3],
    tolerance: [f64; 3],
    /// Their directions, each opposite to a side.
    directions: [Vector3<f64>; 3],
}

impl Tracker<'_> {
    /// Finds the attitude of spots, the brightest of them first, of which nothing is known.
    pub fn lost(&mut self, spots: &[Spot], sky: &Sky, budget: &Budget) -> Attitude {
        self.work = Work::default();
        let spots = &spots[..spots.len().min(self.config.max_stars as usize)];
        let are_places = spots
            .iter()
            .all(|spot| spot.x_px.is_finite() && spot.y_px.is_finite() && spot.sigma_px > 0.0);
        if spots.len() < MIN_STARS || !are_places {
            return Attitude::failed(Status::TOO_FEW_STARS);
        }
        look_up(spots, &self.lens, &mut self.buffers);
        let searched = spots.len().min(SEARCHED_SPOTS);
        // The brightest triangles first: each new spot with all pairs of brighter ones.
        for third in 2..searched {
            for second in 1..third {
                for first in 0..second {
                    if self.work.triangles >= budget.triangles {
                        return Attitude::failed(Status::BUDGET_SPENT);
                    }
                    self.work.triangles += 1;
                    match self.try_triangle(spots, [first, second, third], sky, budget) {
                        Ok(Some(attitude)) => return attitude,
                        Ok(None) => {}
                        Err(status) => return Attitude::failed(status),
                    }
                }
            }
        }
        Attitude::failed(Status::NOT_IDENTIFIED)
    }

    fn try_triangle(
        &mut self,
        spots: &[Spot],
        numbers: [usize; 3],
        sky: &Sky,
        budget: &Budget,
    ) -> Result<Option<Attitude>, Status> {
        let Some(seen) = self.seen(spots, numbers) else {
            return Ok(None);
        };
        let [longest, middle] = [0, 1].map(|side| {
            let ends = [
                seen.sides[side] - seen.tolerance[side],
                seen.sides[side] + seen.tolerance[side],
            ];
            ends.map(|end| end.clamp(0.0, SIDE_UNITS) as u16)
        });
        for class in class_of(longest[0])..=class_of(longest[1]) {
            for number in self.catalog.triangles_of(class, middle) {
                if self.work.candidates >= budget.candidates
                    || self.work.attitudes >= budget.attitudes
                {
                    return Err(Status::BUDGET_SPENT);
                }
                self.work.candidates += 1;
                let triangle = self.catalog.triangle(number);
                if let Some(attitude) = self.attitude_of(&seen, &triangle, sky) {
                    self.work.attitudes += 1;
                    if let Some(found) = self.verify(spots, &attitude, sky) {
                        return Ok(Some(found));
                    }
                }
            }
        }
        Ok(None)
    }

    /// The triangle of three spots; `None` where the catalogue has none that is as large, or it is too small.
    fn seen(&self, spots: &[Spot], numbers: [usize; 3]) -> Option<Seen> {
        let directions = numbers.map(|number| Vector3::from(self.buffers.directions[number]));
        let variance_px2 = |number: usize| {
            let [sigma, floor] = [spots[number].sigma_px, self.floor_px()];
            sigma * sigma + floor * floor
        };
        // The side opposite to each spot.
        let side = |place: usize| {
            let [a, b] = [(place + 1) % 3, (place + 2) % 3];
            let chord = (directions[a] - directions[b]).norm();
            let of_places = libm::sqrt(variance_px2(numbers[a]) + variance_px2(numbers[b]))
                / self.lens.camera.focal_length_px;
            let of_scale = chord * self.config.scale_error;
            let error =
                SIDE_SIGMAS * libm::hypot(of_places, of_scale) + ABERRATION * chord + MOTION_RAD;
            (
                chord / self.catalog.chord_unit(),
                error / self.catalog.chord_unit() + 0.5,
                place,
            )
        };
        let mut sides = [0, 1, 2].map(side);
        sides.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        let fits = sides[0].0 - sides[0].1 <= SIDE_UNITS && sides[2].0 > 4.0 * sides[2].1;
        fits.then(|| Seen {
            sides: sides.map(|(side, _, _)| side),
            tolerance: sides.map(|(_, tolerance, _)| tolerance),
            directions: sides.map(|(_, _, place)| directions[place]),
        })
    }

    /// The attitude under which three spots are the stars of a triangle; `None` where its sides or its sense of turn are
    /// others.
    fn attitude_of(&self, seen: &Seen, triangle: &Triangle, sky: &Sky) -> Option<Matrix3<f64>> {
        let fits = |side: usize| {
            (f64::from(triangle.sides[side]) - seen.sides[side]).abs() <= seen.tolerance[side]
        };
        if !(fits(0) && fits(2)) {
            return None;
        }
        let stars = triangle
            .stars
            .map(|star| apparent(&self.catalog, usize::from(star), sky));
        let volume = |[a, b, c]: &[Vector3<f64>; 3]| a.cross(b).dot(c);
        if volume(&stars) * volume(&seen.directions) <= 0.0 {
            return None;
        }
        // The ends of the longest side.
        attitude::of_two(
            [&seen.directions[1], &seen.directions[2]],
            [&stars[1], &stars[2]],
        )
    }

    /// The attitude, if chance does not do as well.
    fn verify(&mut self, spots: &[Spot], start: &Matrix3<f64>, sky: &Sky) -> Option<Attitude> {
        let most = STARS_PER_SPOT * spots.len() + MORE_STARS;
        let (pairing, predicted) = self.pair_with(spots, (start, 1.0), most, true, sky);
        let log10_chance = self.log10_chance(&pairing, predicted);
        if log10_chance >= self.config.max_log10_false_alarm || pairing.matches < MIN_STARS {
            return None;
        }
        let (fit, _) = self.fit_agreeing(pairing.matches, start, MIN_STARS)?;
        let (pairing, _) =
            self.pair_with(spots, (&fit.icrs_to_camera, fit.scale), most, false, sky);
        let (fit, stars) = self.fit_agreeing(pairing.matches, &fit.icrs_to_camera, MIN_STARS)?;
        let is_true = fit.reduced_chi_square < MAX_REDUCED_CHI_SQUARE;
        is_true.then(|| Attitude::found(&fit, stars, log10_chance))
    }

    /// Pairs the spots with the brightest stars; at first within the errors of a triangle.
    fn pair_with(
        &mut self,
        spots: &[Spot],
        (icrs_to_camera, scale): (&Matrix3<f64>, f64),
        most: usize,
        is_first: bool,
        sky: &Sky,
    ) -> (Pairing, usize) {
        let view = View {
            lens: &self.lens,
            catalog: &self.catalog,
            sky,
            icrs_to_camera: *icrs_to_camera,
            scale,
        };
        let predicted = view
            .predict(self.buffers.predicted, &mut self.work)
            .min(most);
        let worst = spots.iter().map(|spot| spot.sigma_px).fold(0.0, f64::max);
        let floor_px = self.floor_px();
        let sigma_px = libm::hypot(worst.min(1.0), floor_px);
        let (least_px, growth) = if is_first {
            (FIRST_REACH_PX, 2.0 * self.config.scale_error)
        } else {
            (MIN_REACH_PX, 0.0)
        };
        let reach = Reach {
            base_px: least_px + PAIR_SIGMAS * sigma_px,
            growth,
            floor_px,
        };
        let pairing = matching::pair(spots, predicted, &self.lens, &reach, &mut self.buffers);
        (pairing, predicted)
    }

    /// What the errors of the spots' places lack, in pixels.
    fn floor_px(&self) -> f64 {
        let of_rows = if self.config.sensor.row_time_s > 0.0 {
            ROLLING_PX
        } else {
            0.0
        };
        libm::hypot(self.config.position_floor_px, of_rows)
    }

    /// log10 of the probability that one of the attitudes tried does as well by chance.
    fn log10_chance(&self, pairing: &Pairing, predicted: usize) -> f64 {
        let p = (CROWDING * pairing.p_chance).min(1.0);
        let tail = log10_tail(
            predicted.saturating_sub(3),
            pairing.matches.saturating_sub(3),
            p,
        );
        (tail + libm::log10(self.work.attitudes.max(1) as f64)).min(0.0)
    }
}
