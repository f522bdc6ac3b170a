//! The false-alarm probability of a hypothesis about pointing and scale.
//!
//! hypothesis (camera, attitude) → catalogue stars in the frame → nearest observed star of each →
//! false-alarm probability
//!
//! If the hypothesis is wrong, an observed star lies within r of a predicted star of similar
//! brightness with probability p = ρπr², where ρ is the density of such stars around it. The number
//! of stars that do so is Poisson-binomial, as each star has its own p. The probability of at least
//! the number found, times the number of hypotheses, radii and magnitude differences tried, bounds
//! the expected number of equally good answers by chance (an a-contrario test: Desolneux, Moisan &
//! Morel 2000, IJCV 40, 7). The three stars of the triangle agree by construction and do not count.
//! Every two parameters fitted beyond pointing, roll and scale use up another of the stars fitted. The stars used
//! up are assumed to be those least likely to agree by chance, which is the pessimistic choice.

use super::plan::MAX_HYPOTHESES;
use crate::base::statistics::{LnProduct, log10_poisson_binomial_tail};
use crate::identify::field::{ObservedStar, StarField};
use crate::identify::fit::POSE_PARAMETERS;
use crate::identify::hypothesis::{Hypothesis, Problem};
use crate::identify::predict::{PredictedStar, Surroundings};
use std::f64::consts::{LN_10, PI};
use std::sync::LazyLock;

/// Number of observed stars that are tested, the brightest.
pub const TESTED_STARS: usize = 60;
/// The test is made with these numbers of them: where most detections are none (foliage, clouds),
/// the brightest alone show the agreement that all together hide.
const BRIGHTEST: [usize; 3] = [TESTED_STARS, 30, 15];
/// Stars that agree by construction.
const TRIANGLE_STARS: usize = 3;
/// Radii of agreement tried: from the smallest, in pixels, by this factor, up to this fraction of
/// the frame's diagonal.
const MIN_RADIUS_PX: f64 = 0.2;
const RADIUS_FACTOR: f64 = 1.5;
const MAX_RADIUS_FRACTION: f64 = 0.014;
/// Magnitude differences tried, besides the largest that is tolerated.
const MAG_TOLERANCES: [f64; 3] = [0.25, 0.5, 1.0];
/// Radius of the neighborhood in which the density of predicted stars is measured, in units of the
/// radius of agreement.
const NEIGHBORHOOD: f64 = 8.0;
/// An observed and a predicted star of similar brightness.
#[derive(Debug, Clone, Copy)]
struct SimilarPair {
    observed: usize,
    predicted: usize,
    /// Their distance, in pixels.
    apart_px: f64,
    /// The smallest radius of agreement whose neighborhood contains it.
    radius: usize,
    /// Absolute difference of their magnitudes.
    mag: f64,
}

/// Computes false-alarm probabilities. Its buffers are reused.
#[derive(Debug, Default)]
pub struct FalseAlarm {
    predicted: Vec<PredictedStar>,
    /// Radii of agreement, smallest first.
    radii_px: Vec<f64>,
    /// All pairs in the neighborhood of the largest radius.
    pairs: Vec<SimilarPair>,
    /// The pairs within the largest radius, closest first.
    close: Vec<SimilarPair>,
    /// For each observed star, the number of predicted stars of similar brightness, …
    alike: Vec<f64>,
    /// … and how many of them lie in the neighborhood, radius by radius.
    near: Vec<f64>,
    observed_taken: Vec<bool>,
    predicted_taken: Vec<bool>,
    /// For each radius, the largest number of agreeing stars so far within it or a smaller one.
    most: Vec<usize>,
    tests: Vec<Test>,
    /// The chance of each observed star in each test.
    chances: Vec<f64>,
    tail: Vec<f64>,
}

/// A test of agreement of some of the stars within one radius and one magnitude difference.
#[derive(Debug, Clone, Copy)]
struct Test {
    /// Observed stars with a predicted star of their own, minus those that agree by construction.
    hits: usize,
    /// Lower bound of the natural logarithm of the probability.
    at_least_ln: f64,
    /// Start of its chances, their number, and how many of them, the least likely, are used up.
    chances: usize,
    stars: usize,
    used_up: usize,
}

/// Number of the `tested` stars that the parameters beyond pointing, roll and scale use up: half of
/// these parameters where no other stars were fitted, and a share of that where others were.
fn used_up_by_fit(hypothesis: &Hypothesis, tested: usize) -> usize {
    let stars = (hypothesis.parameters - POSE_PARAMETERS) as f64 / 2.0;
    let share = tested as f64 / hypothesis.fitted_stars.max(1) as f64;
    (stars * share.min(1.0)).ceil() as usize
}

/// The parameters of a test.
struct TestParameters<'a> {
    field: &'a StarField,
    /// Number of observed stars, the brightest.
    stars: usize,
    tolerance_mag: f64,
    used_up: usize,
}

impl FalseAlarm {
    /// log10 of the expected number of hypotheses as good as this one, among `hypotheses`, by
    /// chance: the false-alarm probability where it is small. The brightest `stars` are tested, at
    /// most [`TESTED_STARS`].
    ///
    /// Agreement is tested within several radii and magnitude differences, and the least likely
    /// result counts, as exact positions and magnitudes say more than rough ones. The number of
    /// tests is corrected for.
    pub fn log10(
        &mut self,
        hypothesis: &Hypothesis,
        hypotheses: u64,
        problem: Problem,
        stars: usize,
        around: &mut Surroundings,
    ) -> f64 {
        let field = problem.field;
        let observed = field.brightest(stars);
        hypothesis.predict(problem, observed, around, &mut self.predicted);
        self.set_radii(field);
        self.tests.clear();
        self.chances.clear();
        let largest_mag = field.photometry.tolerance_mag();
        self.find_pairs(hypothesis, observed, largest_mag);
        let used_up = TRIANGLE_STARS + used_up_by_fit(hypothesis, observed.len());
        let mut tests = 0;
        for (index, count) in BRIGHTEST.into_iter().enumerate() {
            if index > 0 && count >= observed.len() {
                continue;
            }
            let observed = &observed[..count.min(observed.len())];
            self.most.clear();
            self.most.resize(self.radii_px.len(), used_up);
            let tried = MAG_TOLERANCES.iter().filter(|&&mag| mag < largest_mag);
            for tolerance_mag in tried.copied().chain([largest_mag]) {
                let tested = TestParameters {
                    field,
                    stars: observed.len(),
                    tolerance_mag,
                    used_up,
                };
                self.add_tests(hypothesis, observed, &tested);
                tests += self.radii_px.len();
            }
        }
        let best = self.least_likely();
        (best + libm::log10(search_weight(hypotheses) * tests as f64)).min(0.0)
    }

    fn set_radii(&mut self, field: &StarField) {
        let largest_px = MAX_RADIUS_FRACTION * libm::hypot(field.width_px, field.height_px);
        // At least one radius, also in the smallest frame.
        let largest_px = largest_px.max(MIN_RADIUS_PX);
        let radii =
            std::iter::successors(Some(MIN_RADIUS_PX), |radius| Some(radius * RADIUS_FACTOR));
        self.radii_px.clear();
        self.radii_px
            .extend(radii.take_while(|&radius| radius <= largest_px));
    }

    /// Finds all pairs within the neighborhood of the largest radius and the tolerated magnitude
    /// difference.
    fn find_pairs(&mut self, hypothesis: &Hypothesis, observed: &[ObservedStar], largest_mag: f64) {
        let largest_px = self.radii_px.last().copied().unwrap_or(0.0);
        let radii_px = &self.radii_px;
        let near_px = |radius: usize| NEIGHBORHOOD * radii_px[radius];
        let reach_px = NEIGHBORHOOD * largest_px;
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
                self.pairs.push(SimilarPair {
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

    /// Adds a test for each radius at which more stars agree than by construction, within a smaller
    /// radius or a smaller magnitude difference. As many stars in more room are no less likely.
    fn add_tests(
        &mut self,
        hypothesis: &Hypothesis,
        observed: &[ObservedStar],
        tested: &TestParameters,
    ) {
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
        let counts = |pair: &&SimilarPair| pair.observed < observed && pair.mag <= tolerance_mag;
        for pair in self.pairs.iter().filter(counts) {
            self.near[pair.observed * radii + pair.radius] += 1.0;
        }
        for of_star in self.near.chunks_exact_mut(radii) {
            for radius in 1..radii {
                of_star[radius] += of_star[radius - 1];
            }
        }
    }

    /// The test of `hits` within one radius: the chance of each observed star, and a lower bound of
    /// the probability.
    ///
    /// The probability of exactly this number is the product of all 1 − p, times the sum over all
    /// subsets of the product of their p / (1 − p). The sum is at least that of equal p, their
    /// geometric mean (Maclaurin's inequality), and ln(1 − p) is at least −p − p² for p below 0.68.
    fn test(&mut self, radius: usize, hits: usize, tested: &TestParameters) -> Test {
        let (radius_px, radii) = (self.radii_px[radius], self.radii_px.len());
        let frame_px = tested.field.width_px * tested.field.height_px;
        let chances = self.chances.len();
        let (mut product, mut lost, mut possible, mut largest) = (LnProduct::ONE, 0.0, 0, 0.0_f64);
        for (of_star, &alike) in self.near.chunks_exact(radii).zip(&self.alike) {
            // Without the one that may be its match: what counts is how many others chance could
            // put there.
            let crowd = (of_star[radius] - 1.0) / NEIGHBORHOOD.powi(2);
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
            stars: tested.stars,
            used_up: tested.used_up,
        }
    }

    /// log10 of the lowest probability of all tests. Tests whose bound is higher are skipped.
    fn least_likely(&mut self) -> f64 {
        self.tests
            .sort_unstable_by(|a, b| a.at_least_ln.total_cmp(&b.at_least_ln));
        let mut best: f64 = 0.0;
        for test in &self.tests {
            if test.at_least_ln >= best * LN_10 {
                break;
            }
            let chances = &mut self.chances[test.chances..test.chances + test.stars];
            // Stars that agree by construction count as the least likely ones.
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

/// Counts observed stars with a predicted star of their own within a growing radius.
struct Hits {
    observed_taken: Vec<bool>,
    predicted_taken: Vec<bool>,
    count: usize,
    /// Number of pairs processed.
    done: usize,
}

impl Hits {
    /// Starts at zero, with the buffers of `from`.
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

    /// The number within `radius_px`, which must not decrease between calls; `pairs` are sorted by
    /// distance.
    fn within(&mut self, radius_px: f64, tolerance_mag: f64, pairs: &[SimilarPair]) -> usize {
        while let Some(pair) = pairs.get(self.done).filter(|p| p.apart_px <= radius_px) {
            let (o, p) = (pair.observed, pair.predicted);
            let is_alike = o < self.observed_taken.len() && pair.mag <= tolerance_mag;
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

/// Natural logarithm of the binomial coefficient, of at most [`TESTED_STARS`].
fn ln_binomial(all: usize, some: usize) -> f64 {
    static LN_FACTORIALS: LazyLock<[f64; TESTED_STARS + 1]> =
        LazyLock::new(|| std::array::from_fn(|n| libm::lgamma(n as f64 + 1.0)));
    let ln_factorial = |n: usize| LN_FACTORIALS[n];
    ln_factorial(all) - ln_factorial(some) - ln_factorial(all - some)
}

/// Factor on the probability of the last of this number of hypotheses.
///
/// The inverses of the weights add up to at most one over the longest search, so the probability
/// that any hypothesis of a search passes by chance is bounded.
fn search_weight(hypotheses: u64) -> f64 {
    hypotheses.max(1) as f64 * (1.0 + libm::log(MAX_HYPOTHESES as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_whole_search_has_a_bounded_chance() {
        let sum: f64 = (1..=MAX_HYPOTHESES).map(|n| 1.0 / search_weight(n)).sum();
        assert!(sum <= 1.0, "{sum}");
    }
}
