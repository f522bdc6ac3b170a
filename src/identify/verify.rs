//! Is a hypothesis about pointing and scale true? The probability that chance does as well, and what agrees.
//!
//! hypothesis (camera, attitude) → catalogue stars in the frame → nearest observed star of each → false-alarm probability
//!
//! Were the hypothesis wrong, each observed star would lie within r of a predicted one of about its brightness with the
//! probability p = ρπr², ρ being the density of such stars around it. The number of stars that do so is then
//! Poisson-binomial, each star having a chance of its own, and the probability of as many as were found or
//! more, times the number of hypotheses, radii and differences in magnitude tried, bounds the number of
//! equally good answers that chance alone would have given (an a-contrario test: Desolneux, Moisan & Morel
//! 2000, IJCV 40, 7). The three stars of the triangle that the hypothesis came from agree because it was
//! looked for, and say nothing; every two parameters fitted beyond pointing, roll and scale use up another star. The stars used
//! up are taken to be those least likely to agree by chance, which makes the most of the others' chances.

use super::predict::{PredictedStar, View};
use super::search::MAX_HYPOTHESES;
use super::{ObservedStar, Photometry, Sky, StarField, StarMatch};
use crate::attitude::POSE_PARAMETERS;
use crate::camera::CameraModel;
use crate::coords::{Camera, Icrs, Rotation};
use crate::statistics::log10_poisson_binomial_tail;
use crate::units::RAD_PER_DEG;
use std::f64::consts::PI;
use std::ops::Range;

/// Observed stars that are tested, the brightest.
pub const TESTED_STARS: usize = 60;
/// Where the zero point of the magnitudes is unknown: catalogue stars predicted for each observed one.
const PREDICTED_PER_OBSERVED: f64 = 1.5;
/// And so many more, so that a few missing ones do no harm in sparse fields.
const PREDICTED_EXTRA: usize = 5;
/// Where it is known: the star that this part of the others are brighter than, so that a few odd ones do not count, ...
const FAINT_SHARE: f64 = 0.95;
/// ... and stars fainter than that by so much, for their colour and for luck at the threshold.
const FAINT_ROOM_MAG: f64 = 1.0;
/// Stars that agree by construction.
const TRIANGLE_STARS: usize = 3;
/// Radii of agreement tried: from the smallest, in pixels, by this factor, to this share of the frame's diagonal.
const SMALLEST_RADIUS_PX: f64 = 0.2;
const RADIUS_FACTOR: f64 = 1.5;
const LARGEST_RADIUS_SHARE: f64 = 0.014;
/// Differences in magnitude tried besides the largest that is tolerated at all.
const MAG_TOLERANCES: [f64; 3] = [0.25, 0.5, 1.0];
/// Radius of the neighbourhood whose density of predicted stars counts, in units of the radius of agreement.
const NEIGHBOURHOOD: f64 = 8.0;

/// Where the camera is supposed to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// The camera.
    pub camera: CameraModel,
    /// The attitude.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Parameters that were fitted to the stars.
    pub parameters: usize,
    /// What must be added to the observed magnitudes to make them V.
    pub zero_point_mag: f64,
}

/// How deep to predict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Depth {
    /// So many of the brightest stars in the frame.
    Count(usize),
    /// All stars in the frame to this V magnitude.
    Magnitude(f64),
}

impl Depth {
    /// The depth that the observed stars, brightest first, ask for.
    pub fn of(observed: &[ObservedStar], photometry: Photometry) -> Self {
        match photometry {
            Photometry::JohnsonV => {
                let faintest = observed.iter().map(|s| s.mag).fold(f64::MIN, f64::max);
                Self::Magnitude(faintest + photometry.tolerance_mag())
            }
            Photometry::Instrumental => {
                let count = observed.len() as f64 * PREDICTED_PER_OBSERVED;
                Self::Count(count.ceil() as usize + PREDICTED_EXTRA)
            }
        }
    }
}

/// How far apart a pair may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radius {
    /// Any pair, in pixels.
    pub common_px: f64,
    /// Pairs of a star with a large error: so many times that error ...
    pub sigmas: f64,
    /// ... together with this one, in pixels, ...
    pub excess_sigma_px: f64,
    /// ... but no more than so many times the common radius.
    pub at_most: f64,
}

impl Radius {
    /// The same for all stars.
    pub fn common(radius_px: f64) -> Self {
        Self {
            common_px: radius_px,
            sigmas: 0.0,
            excess_sigma_px: 0.0,
            at_most: 1.0,
        }
    }

    /// That of one star, in pixels.
    fn of(&self, star: &ObservedStar) -> f64 {
        let own_px = self.sigmas * star.sigma_px.hypot(self.excess_sigma_px);
        own_px
            .min(self.at_most * self.common_px)
            .max(self.common_px)
    }
}

impl Hypothesis {
    /// The catalogue stars in the frame to the depth that `observed` asks for, brightest first.
    pub fn predict(
        &self,
        sky: &Sky,
        field: &StarField,
        observed: &[ObservedStar],
    ) -> Vec<PredictedStar> {
        let (wanted, mut limit) = match Depth::of(observed, field.photometry) {
            Depth::Magnitude(limit) => (0, limit),
            Depth::Count(count) => (count, sky.magnitude_of_density(self.per_sq_deg(count))),
        };
        loop {
            let mut predicted = self.view(field).stars_to(sky, limit);
            if predicted.len() >= wanted || limit > sky.faintest_v_mag() {
                if wanted > 0 {
                    predicted.truncate(wanted);
                }
                return predicted;
            }
            limit += 0.7;
        }
    }

    /// The catalogue stars in the frame that may be any of its stars, once the zero point is known: to what the faint ones of
    /// these have, and the depth that their number asks for at least.
    pub fn predict_all(&self, sky: &Sky, field: &StarField) -> Vec<PredictedStar> {
        let by_count = self.predict(sky, field, &field.stars);
        let faint = (field.stars.len() as f64 * FAINT_SHARE) as usize;
        let limit = field
            .stars
            .get(faint)
            .map(|star| star.mag + self.zero_point_mag + FAINT_ROOM_MAG);
        let reached = by_count.last().map(|star| f64::from(star.v_mag));
        match limit {
            Some(limit) if reached.is_some_and(|reached| reached < limit) => {
                self.view(field).stars_to(sky, limit)
            }
            _ => by_count,
        }
    }

    fn view(&self, field: &StarField) -> View<'_> {
        View {
            camera: &self.camera,
            icrs_to_camera: &self.icrs_to_camera,
            years_since_j2000: field.years_since_j2000,
        }
    }

    /// The same stars where this hypothesis puts them.
    pub fn predict_again(&self, predicted: &mut [PredictedStar]) {
        for star in predicted {
            let direction = self.icrs_to_camera.apply(&star.direction);
            if let Some(pixel) = self.camera.pixel_of(&direction) {
                star.pixel = pixel;
            }
        }
    }

    /// The density of so many stars in the frame.
    fn per_sq_deg(&self, count: usize) -> f64 {
        count as f64 * RAD_PER_DEG.powi(2) / (self.camera.fov_x_rad() * self.camera.fov_y_rad())
    }

    /// Pairs observed and predicted stars of about the same brightness that lie within `radius_px` of each
    /// other, the most alike in place and brightness first, each star once; in the order of the observed stars.
    pub fn pair_up(
        &self,
        observed: &[ObservedStar],
        predicted: &[PredictedStar],
        photometry: Photometry,
        radius: &Radius,
    ) -> Vec<StarMatch> {
        pair_up(observed, predicted, radius, |o, p| {
            self.mag_difference(o, p, photometry)
        })
    }

    /// The difference in brightness in units of what is tolerated; `None` if it is more. No star is too bright for a
    /// saturated one.
    fn mag_difference(
        &self,
        observed: &ObservedStar,
        predicted: &PredictedStar,
        photometry: Photometry,
    ) -> Option<f64> {
        let difference = f64::from(predicted.v_mag) - observed.mag - self.zero_point_mag;
        if observed.is_saturated && difference < 0.0 {
            return Some(0.0);
        }
        let relative = difference.abs() / photometry.tolerance_mag();
        (relative <= 1.0).then_some(relative)
    }

    /// log10 of the expected number of hypotheses as good as this one among `hypotheses` that chance alone
    /// would give: the false-alarm probability where it is small.
    ///
    /// Agreement is sought within several radii and several differences in magnitude, and the least likely counts: exact
    /// positions and magnitudes say more than rough ones. That so many tests are made is paid for.
    pub fn log10_false_alarm(&self, field: &StarField, sky: &Sky, hypotheses: u64) -> f64 {
        let observed = field.brightest(TESTED_STARS);
        let predicted = self.predict(sky, field, observed);
        let used_up = TRIANGLE_STARS + (self.parameters - POSE_PARAMETERS).div_ceil(2);
        let radii_px = radii_px(field);
        let reach_px = NEIGHBOURHOOD * radii_px.last().copied().unwrap_or(0.0);
        let largest_mag = field.photometry.tolerance_mag();
        let mut pairs = self.near_pairs(observed, &predicted, (reach_px, largest_mag));
        let mut best: f64 = 0.0;
        let mut tests = 0;
        let tried = MAG_TOLERANCES.iter().filter(|&&mag| mag < largest_mag);
        for tolerance_mag in tried.copied().chain([largest_mag]).rev() {
            // From the largest to the smallest: what is not alike at one is not at the next.
            pairs.retain(|pair| pair.mag <= tolerance_mag);
            let alike = observed
                .iter()
                .map(|star| self.alike(star, &predicted, tolerance_mag).len() as f64)
                .collect();
            let mut agreement = Agreement::new(&pairs, alike, predicted.len());
            for &radius_px in &radii_px {
                let log10 = agreement.log10_chance(field, radius_px, (used_up, best));
                best = best.min(log10);
                tests += 1;
            }
        }
        (best + (search_weight(hypotheses) * f64::from(tests)).log10()).min(0.0)
    }

    /// The part of `predicted`, the brightest first, whose stars are as bright as `star` within a tolerance.
    fn alike(
        &self,
        star: &ObservedStar,
        predicted: &[PredictedStar],
        tolerance_mag: f64,
    ) -> Range<usize> {
        let v_mag = star.mag + self.zero_point_mag;
        let v_mag_of = |p: &PredictedStar| f64::from(p.v_mag);
        let from = predicted.partition_point(|p| v_mag_of(p) < v_mag - tolerance_mag);
        let to = predicted.partition_point(|p| v_mag_of(p) <= v_mag + tolerance_mag);
        from..to
    }

    /// All pairs of an observed and a predicted star within a distance in pixels and a difference in magnitude, the closest
    /// first.
    fn near_pairs(
        &self,
        observed: &[ObservedStar],
        predicted: &[PredictedStar],
        (reach_px, tolerance_mag): (f64, f64),
    ) -> Vec<NearPair> {
        let mut pairs = Vec::new();
        for (observed, star) in observed.iter().enumerate() {
            for index in self.alike(star, predicted, tolerance_mag) {
                let candidate = &predicted[index];
                let apart_px = candidate.pixel.distance_to(&star.position);
                if apart_px <= reach_px {
                    pairs.push(NearPair {
                        observed,
                        predicted: index,
                        apart_px,
                        mag: (f64::from(candidate.v_mag) - star.mag - self.zero_point_mag).abs(),
                    });
                }
            }
        }
        pairs.sort_unstable_by(|a, b| {
            let order = a.apart_px.total_cmp(&b.apart_px);
            order.then((a.observed, a.predicted).cmp(&(b.observed, b.predicted)))
        });
        pairs
    }
}

/// An observed and a predicted star that are about as bright as each other.
struct NearPair {
    observed: usize,
    predicted: usize,
    /// Their distance, in pixels.
    apart_px: f64,
    /// The difference of their magnitudes, absolute.
    mag: f64,
}

/// The radii of agreement that are tried in this field, smallest first.
fn radii_px(field: &StarField) -> Vec<f64> {
    let largest_px = LARGEST_RADIUS_SHARE * field.width_px.hypot(field.height_px);
    std::iter::successors(Some(SMALLEST_RADIUS_PX), |radius| {
        Some(radius * RADIUS_FACTOR)
    })
    .take_while(|&radius| radius <= largest_px)
    .collect()
}

/// What agrees within a growing radius.
struct Agreement<'a> {
    /// The closest first.
    pairs: &'a [NearPair],
    /// For each observed star: the predicted stars that are alike, ...
    alike: Vec<f64>,
    /// ... and those of them in the neighbourhood, which are the first `near_pairs` of `pairs`.
    near: Vec<f64>,
    near_pairs: usize,
    observed_taken: Vec<bool>,
    predicted_taken: Vec<bool>,
    /// Observed stars with a predicted star of their own within the radius, from the first `hit_pairs` of `pairs`.
    hits: usize,
    hit_pairs: usize,
}

impl<'a> Agreement<'a> {
    fn new(pairs: &'a [NearPair], alike: Vec<f64>, predicted: usize) -> Self {
        let observed = alike.len();
        Self {
            pairs,
            alike,
            near: vec![0.0; observed],
            near_pairs: 0,
            observed_taken: vec![false; observed],
            predicted_taken: vec![false; predicted],
            hits: 0,
            hit_pairs: 0,
        }
    }

    /// log10 of the probability that chance makes as many stars agree within `radius_px`, which must not be smaller
    /// than before. So many stars as are `used_up` agree by construction; they count as the least likely ones. 0 where
    /// there is nothing to gain on `best`.
    fn log10_chance(
        &mut self,
        field: &StarField,
        radius_px: f64,
        (used_up, best): (usize, f64),
    ) -> f64 {
        self.widen(radius_px);
        let hits = self.hits.saturating_sub(used_up);
        if hits == 0 {
            return 0.0;
        }
        let frame_px = field.width_px * field.height_px;
        let mut chances: Vec<f64> = (0..self.alike.len())
            .map(|observed| self.chance(observed, frame_px, radius_px))
            .collect();
        chances.sort_unstable_by(f64::total_cmp);
        // That just the likeliest agree is one of the ways in which so many do.
        let likeliest = &chances[chances.len() - hits..];
        if likeliest.iter().map(|chance| chance.log10()).sum::<f64>() >= best {
            return 0.0;
        }
        log10_poisson_binomial_tail(&chances[used_up..], hits)
    }

    fn widen(&mut self, radius_px: f64) {
        let next_within = |next: usize, radius_px| {
            let pair = self.pairs.get(next)?;
            (pair.apart_px <= radius_px).then_some(pair)
        };
        while let Some(pair) = next_within(self.near_pairs, NEIGHBOURHOOD * radius_px) {
            self.near[pair.observed] += 1.0;
            self.near_pairs += 1;
        }
        while let Some(pair) = next_within(self.hit_pairs, radius_px) {
            let (o, p) = (pair.observed, pair.predicted);
            if !self.observed_taken[o] && !self.predicted_taken[p] {
                self.observed_taken[o] = true;
                self.predicted_taken[p] = true;
                self.hits += 1;
            }
            self.hit_pairs += 1;
        }
    }

    /// The probability that chance puts a predicted star that is alike within `radius_px` of an observed one.
    fn chance(&self, observed: usize, frame_px: f64, radius_px: f64) -> f64 {
        // Less the one that may be its match: what counts is how many others chance could have put there.
        let crowd = (self.near[observed] - 1.0) / NEIGHBOURHOOD.powi(2);
        let strewn = self.alike[observed] * PI * radius_px * radius_px / frame_px;
        strewn.max(crowd).min(1.0)
    }
}

/// Pairs what lies within `radius_px` and whose `mag_difference` is tolerable, the most alike first, each star once.
fn pair_up(
    observed: &[ObservedStar],
    predicted: &[PredictedStar],
    radius: &Radius,
    mag_difference: impl Fn(&ObservedStar, &PredictedStar) -> Option<f64>,
) -> Vec<StarMatch> {
    let mut by_x: Vec<usize> = (0..predicted.len()).collect();
    by_x.sort_unstable_by(|&a, &b| predicted[a].pixel.x.total_cmp(&predicted[b].pixel.x));
    let mut close: Vec<(f64, usize, usize)> = Vec::new();
    for (o, star) in observed.iter().enumerate() {
        let radius_px = radius.of(star);
        let first = by_x.partition_point(|&p| predicted[p].pixel.x < star.position.x - radius_px);
        for &p in &by_x[first..] {
            let pixel = &predicted[p].pixel;
            if pixel.x > star.position.x + radius_px {
                break;
            }
            let distance_px = pixel.distance_to(&star.position);
            if distance_px <= radius_px
                && let Some(difference) = mag_difference(star, &predicted[p])
            {
                // Nearness counts in pixels: a star of which little is known takes none from one of which much is.
                let apart = distance_px / radius.common_px;
                close.push((apart * apart + difference * difference, o, p));
            }
        }
    }
    close.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut observed_taken = vec![false; observed.len()];
    let mut predicted_taken = vec![false; predicted.len()];
    let mut pairs = Vec::new();
    for (_, o, p) in close {
        if !observed_taken[o] && !predicted_taken[p] {
            observed_taken[o] = true;
            predicted_taken[p] = true;
            pairs.push(StarMatch {
                observed: o,
                catalog: predicted[p].catalog,
                residual_px: predicted[p].pixel.distance_to(&observed[o].position),
            });
        }
    }
    pairs.sort_unstable_by_key(|pair| pair.observed);
    pairs
}

/// What the chance of one hypothesis is multiplied by when it is the last of so many.
///
/// The weights' inverses add up to no more than one over the longest search there is, so that the probability
/// that any hypothesis at all of a search passes by chance is bounded, and not only that of one.
fn search_weight(hypotheses: u64) -> f64 {
    hypotheses.max(1) as f64 * (1.0 + (MAX_HYPOTHESES as f64).ln())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coords::{PixelPoint, UnitVector};

    #[test]
    fn a_whole_search_has_a_bounded_chance() {
        let sum: f64 = (1..=MAX_HYPOTHESES).map(|n| 1.0 / search_weight(n)).sum();
        assert!(sum <= 1.0, "{sum}");
    }

    #[test]
    fn each_star_is_paired_once_with_its_closest() {
        let observed = [(10.0, 10.0), (13.0, 10.0), (50.0, 50.0)].map(|(x, y)| ObservedStar {
            position: PixelPoint::new(x, y),
            sigma_px: 0.1,
            mag: 0.0,
            is_saturated: false,
        });
        let predicted = [(12.5, 10.0), (10.0, 11.0), (90.0, 50.0)].map(|(x, y)| PredictedStar {
            pixel: PixelPoint::new(x, y),
            direction: UnitVector::from_ra_dec(0.0, 0.0),
            v_mag: 0.0,
            catalog: x as usize,
        });
        let pairs = pair_up(&observed, &predicted, &Radius::common(4.0), |_, _| {
            Some(0.0)
        });
        let found: Vec<(usize, usize)> = pairs.iter().map(|p| (p.observed, p.catalog)).collect();
        assert_eq!(found, [(0, 10), (1, 12)]);
    }
}
