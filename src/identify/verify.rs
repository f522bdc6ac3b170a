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

use super::predict::{Depth, PredictedStar, Surroundings, View};
use super::search::MAX_HYPOTHESES;
use super::{IndexedCatalog, ObservedStar, Photometry, StarField, StarMatch};
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::base::statistics::{LnProduct, log10_poisson_binomial_tail};
use crate::base::units::RAD_PER_DEG;
use crate::camera::{CameraModel, LANES};
use crate::identify::attitude::POSE_PARAMETERS;
use std::f64::consts::{LN_10, PI};
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
/// Strips that a frame's predicted stars are sorted into.
const STRIPS: usize = 512;

/// Where the camera is supposed to look.
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// An observed star and the catalogue star that it is taken for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Index into [`StarField::stars`].
    pub observed: usize,
    /// Index into the catalogue's stars.
    pub catalog: usize,
    /// V magnitude of the catalogue.
    pub v_mag: f32,
    /// Where its light comes from, at the time of the frame.
    pub direction: UnitVector<Icrs>,
    /// Distance between the observed and the predicted place, in pixels.
    pub residual_px: f64,
}

impl Pair {
    /// The same, without what only the fit needs.
    pub fn star_match(&self) -> StarMatch {
        StarMatch {
            observed: self.observed,
            catalog: self.catalog,
            residual_px: self.residual_px,
        }
    }
}

/// What is seen of which sky.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// The stars seen.
    pub field: &'a StarField,
    /// The catalogue.
    pub sky: &'a IndexedCatalog<'a>,
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
    /// Makes `predicted` the catalogue stars in the frame to the depth that `observed` asks for, brightest first.
    pub fn predict(
        &self,
        scene: Scene,
        observed: &[ObservedStar],
        around: &mut Surroundings,
        predicted: &mut Vec<PredictedStar>,
    ) {
        self.predict_to(scene, observed, f64::NEG_INFINITY, (around, predicted));
    }

    /// Makes `predicted` the catalogue stars in the frame that may be any of its stars, once the zero point is known: to what the
    /// faint ones of these have, and the depth that their number asks for at least.
    pub fn predict_all(
        &self,
        scene: Scene,
        around: &mut Surroundings,
        predicted: &mut Vec<PredictedStar>,
    ) {
        let observed = &scene.field.stars;
        let faint = (observed.len() as f64 * FAINT_SHARE) as usize;
        let limit = observed.get(faint).map_or(f64::NEG_INFINITY, |star| {
            star.mag + self.zero_point_mag + FAINT_ROOM_MAG
        });
        self.predict_to(scene, observed, limit, (around, predicted));
    }

    /// As [`Self::predict`], and to `limit_v_mag` at least.
    fn predict_to(
        &self,
        scene: Scene,
        observed: &[ObservedStar],
        limit_v_mag: f64,
        (around, predicted): (&mut Surroundings, &mut Vec<PredictedStar>),
    ) {
        let Scene { field, sky } = scene;
        let view = self.view(field);
        match field.photometry {
            Photometry::JohnsonV => {
                let faintest = observed.iter().map(|s| s.mag).fold(f64::MIN, f64::max);
                let limit = faintest + field.photometry.tolerance_mag();
                around.stars_to(&view, sky, limit.max(limit_v_mag), predicted);
            }
            Photometry::Instrumental => {
                let count = observed.len() as f64 * PREDICTED_PER_OBSERVED;
                let count = count.ceil() as usize + PREDICTED_EXTRA;
                let likely = sky.magnitude_of_density(self.per_sq_deg(count));
                let least = Depth {
                    count,
                    v_mag: limit_v_mag,
                };
                around.stars_at_least(&view, sky, (least, likely), predicted);
            }
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
        for stars in predicted.chunks_mut(LANES) {
            let mut directions = [UnitVector::BORESIGHT; LANES];
            for (direction, star) in directions.iter_mut().zip(&*stars) {
                *direction = self.icrs_to_camera.apply(&star.direction);
            }
            for (star, pixel) in stars.iter_mut().zip(self.camera.pixels_of(&directions)) {
                star.pixel = pixel.unwrap_or(star.pixel);
            }
        }
    }

    /// The density of so many stars in the frame.
    fn per_sq_deg(&self, count: usize) -> f64 {
        count as f64 * RAD_PER_DEG.powi(2) / (self.camera.fov_x_rad() * self.camera.fov_y_rad())
    }

    /// The difference in brightness in units of what is tolerated; `None` if it is more. No star is too bright for a
    /// saturated one.
    pub fn mag_difference(
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
}

/// Pairs up observed and predicted stars; keeps its buffers.
#[derive(Debug, Default)]
pub struct Pairing {
    /// The predicted stars strip by strip along x, and where each strip begins.
    by_strip: Vec<(PixelPoint, usize)>,
    starts: Vec<usize>,
    close: Vec<Close>,
    of_observed: Vec<Claim>,
    of_predicted: Vec<u32>,
}

/// A pair that may be one.
#[derive(Debug, Clone, Copy)]
struct Close {
    /// How unlike they are in place and brightness.
    apart: f64,
    observed: usize,
    predicted: usize,
}

/// What an observed star may be paired with.
#[derive(Debug, Clone, Copy, Default)]
struct Claim {
    candidates: u32,
    predicted: Option<usize>,
}

impl Pairing {
    /// Makes `pairs` what lies within `radius` and whose `mag_difference` is tolerable, the most alike in place and
    /// brightness first, each star once; in the order of the observed stars.
    pub fn pair_up(
        &mut self,
        (observed, predicted): (&[ObservedStar], &[PredictedStar]),
        radius: &Radius,
        mag_difference: impl Fn(&ObservedStar, &PredictedStar) -> Option<f64>,
        pairs: &mut Vec<Pair>,
    ) {
        self.find_close((observed, predicted), radius, mag_difference);
        self.settle();
        pairs.clear();
        let claims = observed.iter().zip(&self.of_observed).enumerate();
        pairs.extend(claims.filter_map(|(index, (star, claim))| {
            let found = &predicted[claim.predicted?];
            Some(Pair {
                observed: index,
                catalog: found.catalog,
                v_mag: found.v_mag,
                direction: found.direction,
                residual_px: found.pixel.distance_to(&star.position),
            })
        }));
    }

    /// Finds all pairs that may be.
    fn find_close(
        &mut self,
        (observed, predicted): (&[ObservedStar], &[PredictedStar]),
        radius: &Radius,
        mag_difference: impl Fn(&ObservedStar, &PredictedStar) -> Option<f64>,
    ) {
        let strips = Strips::over(predicted);
        self.sort_into(&strips, predicted);
        self.close.clear();
        self.of_observed.clear();
        self.of_observed.resize(observed.len(), Claim::default());
        self.of_predicted.clear();
        self.of_predicted.resize(predicted.len(), 0);
        for (o, star) in observed.iter().enumerate() {
            let radius_px = radius.of(star);
            let x = star.position.x;
            let (first, last) = (strips.of(x - radius_px), strips.of(x + radius_px));
            for &(pixel, p) in &self.by_strip[self.starts[first]..self.starts[last + 1]] {
                let distance_px = pixel.distance_to(&star.position);
                if distance_px <= radius_px
                    && let Some(difference) = mag_difference(star, &predicted[p])
                {
                    // Nearness counts in pixels: a star of which little is known takes none from one of which much is.
                    let apart = distance_px / radius.common_px;
                    self.close.push(Close {
                        apart: apart * apart + difference * difference,
                        observed: o,
                        predicted: p,
                    });
                    self.of_observed[o].candidates += 1;
                    self.of_predicted[p] += 1;
                }
            }
        }
    }

    /// A counting sort by strips.
    fn sort_into(&mut self, strips: &Strips, predicted: &[PredictedStar]) {
        self.starts.clear();
        self.starts.resize(STRIPS + 1, 0);
        for star in predicted {
            self.starts[strips.of(star.pixel.x)] += 1;
        }
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.by_strip.clear();
        self.by_strip
            .resize(predicted.len(), (PixelPoint::new(0.0, 0.0), 0));
        for (p, star) in predicted.iter().enumerate() {
            let start = &mut self.starts[strips.of(star.pixel.x)];
            *start -= 1;
            self.by_strip[*start] = (star.pixel, p);
        }
    }

    /// Pairs those that have no other choice, and then the others, the most alike first.
    fn settle(&mut self) {
        let Self {
            close,
            of_observed,
            of_predicted,
            ..
        } = self;
        close.retain(|pair| {
            let alone =
                of_observed[pair.observed].candidates == 1 && of_predicted[pair.predicted] == 1;
            if alone {
                of_observed[pair.observed].predicted = Some(pair.predicted);
            }
            !alone
        });
        close.sort_unstable_by(|a, b| {
            let order = a.apart.total_cmp(&b.apart);
            order.then((a.observed, a.predicted).cmp(&(b.observed, b.predicted)))
        });
        for pair in close {
            let (claim, claimed) = (
                &mut of_observed[pair.observed].predicted,
                &mut of_predicted[pair.predicted],
            );
            if claim.is_none() && *claimed > 0 {
                *claim = Some(pair.predicted);
                *claimed = 0;
            }
        }
    }
}

/// Strips of equal width between the first and the last of some stars along x.
struct Strips {
    from_px: f64,
    per_px: f64,
}

impl Strips {
    fn over(predicted: &[PredictedStar]) -> Self {
        let x = || predicted.iter().map(|star| star.pixel.x);
        let (low, high) = (x().fold(f64::MAX, f64::min), x().fold(f64::MIN, f64::max));
        Self {
            from_px: low,
            per_px: STRIPS as f64 / (high - low).max(1.0),
        }
    }

    fn of(&self, x: f64) -> usize {
        (((x - self.from_px) * self.per_px).max(0.0) as usize).min(STRIPS - 1)
    }
}

/// An observed and a predicted star that are about as bright as each other.
#[derive(Debug, Clone, Copy)]
struct NearPair {
    observed: usize,
    predicted: usize,
    /// Their distance, in pixels.
    apart_px: f64,
    /// The smallest radius of agreement in whose neighbourhood it is.
    radius: usize,
    /// The difference of their magnitudes, absolute.
    mag: f64,
}

/// How likely it is that chance does as well as a hypothesis; keeps its buffers.
#[derive(Debug, Default)]
pub struct FalseAlarm {
    predicted: Vec<PredictedStar>,
    /// Radii of agreement, smallest first.
    radii_px: Vec<f64>,
    /// All pairs in the neighbourhood of the largest.
    pairs: Vec<NearPair>,
    /// Those within it, the closest first.
    close: Vec<NearPair>,
    /// For each observed star the number of predicted stars that are alike, ...
    alike: Vec<f64>,
    /// ... and those of them in the neighbourhood, radius by radius.
    near: Vec<f64>,
    observed_taken: Vec<bool>,
    predicted_taken: Vec<bool>,
    /// For each radius the most stars that agree within it or a smaller one, with the differences in magnitude tried so far.
    most: Vec<usize>,
    tests: Vec<Test>,
    /// One for each observed star in each test.
    chances: Vec<f64>,
    tail: Vec<f64>,
}

/// Agreement within one radius and one difference in magnitude.
#[derive(Debug, Clone, Copy)]
struct Test {
    /// Observed stars with a predicted star of their own, less those that agree by construction.
    hits: usize,
    /// The natural logarithm of the probability of as many by chance is no less.
    at_least_ln: f64,
    /// Where its chances begin, and how many of them, the least likely, are used up.
    chances: usize,
    used_up: usize,
}

/// What a test is of.
struct Tested<'a> {
    field: &'a StarField,
    tolerance_mag: f64,
    used_up: usize,
}

impl FalseAlarm {
    /// log10 of the expected number of hypotheses as good as this one among `hypotheses` that chance alone
    /// would give: the false-alarm probability where it is small.
    ///
    /// Agreement is sought within several radii and several differences in magnitude, and the least likely counts: exact
    /// positions and magnitudes say more than rough ones. That so many tests are made is paid for.
    pub fn log10(
        &mut self,
        hypothesis: &Hypothesis,
        scene: Scene,
        around: &mut Surroundings,
        hypotheses: u64,
    ) -> f64 {
        let field = scene.field;
        let observed = field.brightest(TESTED_STARS);
        hypothesis.predict(scene, observed, around, &mut self.predicted);
        self.set_radii(field);
        self.tests.clear();
        self.chances.clear();
        let largest_mag = field.photometry.tolerance_mag();
        self.find_pairs(hypothesis, observed, largest_mag);
        let used_up = TRIANGLE_STARS + (hypothesis.parameters - POSE_PARAMETERS).div_ceil(2);
        self.most.clear();
        self.most.resize(self.radii_px.len(), used_up);
        let tried = MAG_TOLERANCES.iter().filter(|&&mag| mag < largest_mag);
        let mut tests = 0;
        for tolerance_mag in tried.copied().chain([largest_mag]) {
            let tested = Tested {
                field,
                tolerance_mag,
                used_up,
            };
            self.add_tests(hypothesis, observed, &tested);
            tests += self.radii_px.len();
        }
        let best = self.least_likely(observed.len());
        (best + (search_weight(hypotheses) * tests as f64).log10()).min(0.0)
    }

    fn set_radii(&mut self, field: &StarField) {
        let largest_px = LARGEST_RADIUS_SHARE * field.width_px.hypot(field.height_px);
        // There is one in the smallest frame.
        let largest_px = largest_px.max(SMALLEST_RADIUS_PX);
        let radii = std::iter::successors(Some(SMALLEST_RADIUS_PX), |radius| {
            Some(radius * RADIUS_FACTOR)
        });
        self.radii_px.clear();
        self.radii_px
            .extend(radii.take_while(|&radius| radius <= largest_px));
    }

    /// All pairs within the neighbourhood of the largest radius whose magnitudes differ by no more than is tolerated.
    fn find_pairs(&mut self, hypothesis: &Hypothesis, observed: &[ObservedStar], largest_mag: f64) {
        let largest_px = self.radii_px.last().copied().unwrap_or(0.0);
        let radii_px = &self.radii_px;
        let near_px = |radius: usize| NEIGHBOURHOOD * radii_px[radius];
        let reach_px = NEIGHBOURHOOD * largest_px;
        self.pairs.clear();
        for (index, star) in observed.iter().enumerate() {
            let alike = hypothesis.alike(star, &self.predicted, largest_mag);
            for (candidate, predicted) in self.predicted[alike.clone()].iter().zip(alike) {
                if (candidate.pixel.x - star.position.x).abs() > reach_px {
                    continue;
                }
                let apart_px = candidate.pixel.distance_to(&star.position);
                if apart_px > reach_px {
                    continue;
                }
                let mut radius = radii_px.len() - 1;
                while radius > 0 && apart_px <= near_px(radius - 1) {
                    radius -= 1;
                }
                let mag = f64::from(candidate.v_mag) - star.mag - hypothesis.zero_point_mag;
                self.pairs.push(NearPair {
                    observed: index,
                    predicted,
                    apart_px,
                    radius,
                    mag: mag.abs(),
                });
            }
        }
        self.close.clear();
        let close = self.pairs.iter().filter(|pair| pair.apart_px <= largest_px);
        self.close.extend(close);
        self.close.sort_unstable_by(|a, b| {
            let order = a.apart_px.total_cmp(&b.apart_px);
            order.then((a.observed, a.predicted).cmp(&(b.observed, b.predicted)))
        });
    }

    /// One test for each radius at which more stars agree than do so by construction, and than agree within a smaller radius
    /// or a smaller difference in magnitude: as many in more room are no less likely.
    fn add_tests(&mut self, hypothesis: &Hypothesis, observed: &[ObservedStar], tested: &Tested) {
        self.count_alike(hypothesis, observed, tested.tolerance_mag);
        self.count_near(observed.len(), tested.tolerance_mag);
        let mut hits = Hits::new(self, observed.len());
        let mut most = 0;
        for radius in 0..self.radii_px.len() {
            let agreeing = hits.within(self.radii_px[radius], tested.tolerance_mag, &self.close);
            most = most.max(self.most[radius]);
            if agreeing > most {
                most = agreeing;
                let test = self.test(radius, agreeing - tested.used_up, tested);
                self.tests.push(test);
            }
            self.most[radius] = most;
        }
        (self.observed_taken, self.predicted_taken) = (hits.observed_taken, hits.predicted_taken);
    }

    fn count_alike(
        &mut self,
        hypothesis: &Hypothesis,
        observed: &[ObservedStar],
        tolerance_mag: f64,
    ) {
        let predicted = &self.predicted;
        self.alike.clear();
        let alike = |star| hypothesis.alike(star, predicted, tolerance_mag).len() as f64;
        self.alike.extend(observed.iter().map(alike));
    }

    fn count_near(&mut self, observed: usize, tolerance_mag: f64) {
        let radii = self.radii_px.len();
        self.near.clear();
        self.near.resize(observed * radii, 0.0);
        for pair in self.pairs.iter().filter(|pair| pair.mag <= tolerance_mag) {
            self.near[pair.observed * radii + pair.radius] += 1.0;
        }
        for of_star in self.near.chunks_exact_mut(radii) {
            for radius in 1..radii {
                of_star[radius] += of_star[radius - 1];
            }
        }
    }

    /// The test of so many `hits` within one radius: the chance of each observed star, and what they amount to at the least.
    ///
    /// The probability P of just as many hits is the product of all 1 − p, times the sum over all subsets of the
    /// product of their p / (1 − p). The sum is no less than if all p were their geometric mean (Maclaurin's inequality), and
    /// ln(1 − p) no less than −p − p² for p below 0.68.
    fn test(&mut self, radius: usize, hits: usize, tested: &Tested) -> Test {
        let (radius_px, radii) = (self.radii_px[radius], self.radii_px.len());
        let frame_px = tested.field.width_px * tested.field.height_px;
        let chances = self.chances.len();
        let (mut product, mut lost, mut possible, mut largest) = (LnProduct::ONE, 0.0, 0, 0.0_f64);
        for (of_star, &alike) in self.near.chunks_exact(radii).zip(&self.alike) {
            // Less the one that may be its match: what counts is how many others chance could have put there.
            let crowd = (of_star[radius] - 1.0) / NEIGHBOURHOOD.powi(2);
            let strewn = alike * PI * radius_px * radius_px / frame_px;
            let chance = strewn.max(crowd).min(1.0);
            self.chances.push(chance);
            if chance > 0.0 {
                product.multiply(chance);
                lost += chance + chance * chance;
                largest = largest.max(chance);
                possible += 1;
            }
        }
        let counted = possible.min(self.alike.len() - tested.used_up);
        let at_least_ln = if largest < 0.68 && hits <= counted {
            ln_binomial(counted, hits) + hits as f64 * product.ln() / possible as f64 - lost
        } else {
            f64::NEG_INFINITY
        };
        Test {
            hits,
            at_least_ln,
            chances,
            used_up: tested.used_up,
        }
    }

    /// log10 of the lowest probability of any test. Those that cannot be lower are left out.
    fn least_likely(&mut self, observed: usize) -> f64 {
        self.tests
            .sort_unstable_by(|a, b| a.at_least_ln.total_cmp(&b.at_least_ln));
        let mut best: f64 = 0.0;
        for test in &self.tests {
            if test.at_least_ln >= best * LN_10 {
                break;
            }
            let chances = &mut self.chances[test.chances..test.chances + observed];
            // Those that agree by construction count as the least likely ones.
            chances.sort_unstable_by(f64::total_cmp);
            let counted = &chances[test.used_up..];
            best = best.min(log10_poisson_binomial_tail(
                counted,
                test.hits,
                &mut self.tail,
            ));
        }
        best
    }
}

/// Observed stars with a predicted star of their own within a growing radius.
struct Hits {
    observed_taken: Vec<bool>,
    predicted_taken: Vec<bool>,
    count: usize,
    /// Pairs looked at.
    done: usize,
}

impl Hits {
    /// None yet, in the buffers of `from`.
    fn new(from: &mut FalseAlarm, observed: usize) -> Self {
        let cleared = |mut taken: Vec<bool>, count: usize| {
            taken.clear();
            taken.resize(count, false);
            taken
        };
        Self {
            observed_taken: cleared(std::mem::take(&mut from.observed_taken), observed),
            predicted_taken: cleared(
                std::mem::take(&mut from.predicted_taken),
                from.predicted.len(),
            ),
            count: 0,
            done: 0,
        }
    }

    /// How many there are within `radius_px`, which must not be smaller than before; `pairs` are the closest first.
    fn within(&mut self, radius_px: f64, tolerance_mag: f64, pairs: &[NearPair]) -> usize {
        while let Some(pair) = pairs.get(self.done).filter(|p| p.apart_px <= radius_px) {
            let (o, p) = (pair.observed, pair.predicted);
            let is_alike = pair.mag <= tolerance_mag;
            if is_alike && !self.observed_taken[o] && !self.predicted_taken[p] {
                self.observed_taken[o] = true;
                self.predicted_taken[p] = true;
                self.count += 1;
            }
            self.done += 1;
        }
        self.count
    }
}

/// ln of the number of ways to choose `some` of `all`.
fn ln_binomial(all: usize, some: usize) -> f64 {
    let ln_factorial = |n: usize| libm::lgamma(n as f64 + 1.0);
    ln_factorial(all) - ln_factorial(some) - ln_factorial(all - some)
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
    use crate::base::neighbors::PointTree;
    use proptest::prelude::*;

    #[test]
    fn a_whole_search_has_a_bounded_chance() {
        let sum: f64 = (1..=MAX_HYPOTHESES).map(|n| 1.0 / search_weight(n)).sum();
        assert!(sum <= 1.0, "{sum}");
    }

    fn observed_at((x, y): (f64, f64)) -> ObservedStar {
        ObservedStar {
            position: PixelPoint::new(x, y),
            sigma_px: 0.1,
            mag: 0.0,
            is_saturated: false,
        }
    }

    fn predicted_at((x, y): (f64, f64)) -> PredictedStar {
        PredictedStar {
            pixel: PixelPoint::new(x, y),
            direction: UnitVector::from_ra_dec(0.0, 0.0),
            v_mag: 0.0,
            catalog: x.max(0.0) as usize,
        }
    }

    #[test]
    fn each_star_is_paired_once_with_its_closest() {
        let observed = [(10.0, 10.0), (13.0, 10.0), (50.0, 50.0)].map(observed_at);
        let predicted = [(12.5, 10.0), (10.0, 11.0), (90.0, 50.0)].map(predicted_at);
        let mut pairs = Vec::new();
        let stars = (&observed[..], &predicted[..]);
        Pairing::default().pair_up(stars, &Radius::common(4.0), |_, _| Some(0.0), &mut pairs);
        let found: Vec<(usize, usize)> = pairs.iter().map(|p| (p.observed, p.catalog)).collect();
        assert_eq!(found, [(0, 10), (1, 12)]);
    }

    proptest! {
        #[test]
        fn close_pairs_are_those_that_a_k_d_tree_finds(
            observed in prop::collection::vec((0.0..900.0f64, 0.0..700.0f64), 0..60),
            predicted in prop::collection::vec((-50.0..950.0f64, -50.0..750.0f64), 0..200),
            radius_px in 0.5..80.0f64,
        ) {
            let observed: Vec<_> = observed.into_iter().map(observed_at).collect();
            let predicted: Vec<_> = predicted.into_iter().map(predicted_at).collect();
            let mut pairing = Pairing::default();
            let stars = (&observed[..], &predicted[..]);
            pairing.find_close(stars, &Radius::common(radius_px), |_, _| Some(0.0));
            let mut found: Vec<_> =
                pairing.close.iter().map(|c| (c.observed, c.predicted)).collect();
            found.sort_unstable();
            let tree = PointTree::new(predicted.iter().map(|star| star.pixel));
            let mut expected = Vec::new();
            for (o, star) in observed.iter().enumerate() {
                let near = tree.within(&star.position, radius_px);
                expected.extend(near.iter().map(|near| (o, near.index)));
            }
            expected.sort_unstable();
            prop_assert_eq!(found, expected);
        }
    }
}
