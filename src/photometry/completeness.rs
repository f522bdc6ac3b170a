//! The share of stars detected at each magnitude, and the magnitude at which half are detected.
//!
//! (magnitude, detected or not) of single stars → [`Completeness`]
//!
//! The model: a star of magnitude m is detected with the probability
//!
//! ```text
//! C(m) = c + (1 − c − λ) Φ((m₅₀ − m) / w)
//! ```
//!
//! m₅₀ and the width w are fitted. λ is the share of bright stars lost for other reasons (doubles,
//! clouds, trees, catalogue errors); without it, one lost bright star would make w several
//! magnitudes. c is the known probability of an unrelated detection at a star's position. Half of
//! the stars that are not lost are detected at m₅₀. The likelihood of all stars is maximised by
//! Fisher scoring, and the standard errors follow from the information matrix.
//!
//! Few stars do not determine w and λ, so both have weak priors. ln w is normal about
//! [`TYPICAL_WIDTH_MAG`], the noise at the detection threshold (1.0857 / SNR) with a little color
//! and vignetting, with a factor of e either way. λ has a beta distribution, as if a quarter of a
//! star in ten had been lost before. Where bright stars are few (80 in all, or a large w) this
//! shifts m₅₀ by up to 0.3 of its standard error.
//!
//! # Reference
//! Probit regression with a guessing and a lapse rate: Wichmann & Hill 2001, Percept. Psychophys.
//! 63, 1293.

use crate::base::least_squares::LinearFit;
use crate::base::statistics::{LnProduct, normal_cdf, normal_cdf_and_density};
use nalgebra::{Matrix3, Vector3};

/// Centre of the prior of the width, in magnitudes.
pub const TYPICAL_WIDTH_MAG: f64 = 0.3;
/// Standard deviation of the prior of ln w.
const LN_WIDTH_SIGMA: f64 = 1.0;
/// The prior of λ: stars lost and stars kept.
const PRIOR_LOST: f64 = 0.25;
const PRIOR_KEPT: f64 = 9.75;
/// Minimum number of detected stars brighter than m₅₀, and of missed stars fainter than it.
const MIN_PER_SIDE: usize = 4;
/// Largest standard error of a limit, in magnitudes.
const MAX_SIGMA_MAG: f64 = 0.5;
/// Width of a bin of the curve, in magnitudes.
pub const BIN_MAG: f64 = 0.5;

/// A catalogue star that counts in the completeness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CountedStar {
    /// V magnitude.
    pub v_mag: f64,
    /// Whether it was detected.
    pub detected: bool,
}

/// The completeness curve, and the limiting magnitude fitted to it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Completeness {
    /// The curve in bins of [`BIN_MAG`] without gaps, brightest first.
    pub bins: Vec<MagnitudeBin>,
    /// The limit, or the reason why there is none.
    pub limit: Result<Limit, NoLimit>,
    /// Where it falls, as far as the stars tell: also where that is too uncertain for a limit. `None` without stars.
    pub(super) fall: Option<Fall>,
}

/// Where the completeness falls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fall {
    /// V magnitude m₅₀.
    v_mag: f64,
    /// Width w, in magnitudes.
    width_mag: f64,
}

impl Fall {
    /// Whether at least 98 % of the stars of this magnitude are detected that are not otherwise lost.
    pub fn is_complete_at(&self, v_mag: f64) -> bool {
        const COMPLETE_WIDTHS: f64 = 2.0;
        v_mag < self.v_mag - COMPLETE_WIDTHS * self.width_mag
    }

    /// By how much noise of this standard deviation makes the detected ones of the stars of a magnitude brighter,
    /// on average, in magnitudes: the others are not detected.
    pub fn brightening_mag(&self, v_mag: f64, sigma_mag: f64) -> f64 {
        /// Fainter ones, in widths beyond m₅₀, owe their names to chance.
        const FAINTEST_WIDTHS: f64 = 3.0;
        // Noise is a part of the width.
        let width_mag = self.width_mag.max(sigma_mag);
        let brighter = (self.v_mag - v_mag) / width_mag;
        let (detected, density) = normal_cdf_and_density(brighter.max(-FAINTEST_WIDTHS));
        sigma_mag * sigma_mag / width_mag * density / detected
    }
}

/// One bin of the curve.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct MagnitudeBin {
    /// V magnitude of its centre.
    pub v_mag: f64,
    /// Number of catalogue stars.
    pub stars: usize,
    /// Number of detected stars.
    pub detected: usize,
}

/// The limiting magnitude, where the completeness falls.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Limit {
    /// V magnitude m₅₀ at which half of the stars that are not otherwise lost are detected.
    pub v_mag: f64,
    /// Its standard error, in magnitudes.
    pub sigma_mag: f64,
    /// Width w of the fall (standard deviation), in magnitudes.
    pub width_mag: f64,
    /// The share λ of bright stars that is not detected.
    pub lost: f64,
}

impl Limit {
    /// The probability that a star is detected.
    pub(crate) fn probability(&self, v_mag: f64) -> f64 {
        (1.0 - self.lost) * normal_cdf((self.v_mag - v_mag) / self.width_mag)
    }
}

/// Why there is no limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NoLimit {
    /// Completeness does not fall before the catalogue ends.
    #[error(
        "the catalog is not deep enough: too few of its stars are fainter than the limit of the frame"
    )]
    CatalogEnds,
    /// Too few stars are bright enough.
    #[error("too few catalog stars in the field are bright enough to be detected")]
    TooFewDetected,
    /// There are more detections than may be measured.
    #[error("not known, because only the brightest {measured} detections were measured")]
    StarsLeftOut {
        /// How many were measured.
        measured: usize,
    },
    /// The fall is not clear.
    #[error("too few stars to measure the magnitude at which half of them are detected")]
    Uncertain,
}

/// Measures the completeness of `stars`, in any order. `chance` is c, the probability that an
/// undetected star has an unrelated detection at its position.
pub(crate) fn measure(stars: &[CountedStar], chance: f64) -> Completeness {
    let mut stars = stars.to_vec();
    stars.sort_unstable_by(|a, b| {
        let order = a.v_mag.total_cmp(&b.v_mag);
        order.then(b.detected.cmp(&a.detected))
    });
    let fit = CompletenessCurve::fit(&stars, chance);
    Completeness {
        bins: bins(&stars),
        limit: limit(&stars, fit.as_ref()),
        fall: fit.map(|fit| fit.curve.fall()),
    }
}

/// The bins of `stars`, brightest first.
fn bins(stars: &[CountedStar]) -> Vec<MagnitudeBin> {
    let step = |star: &CountedStar| (star.v_mag / BIN_MAG).floor();
    let (Some(first), Some(last)) = (stars.first().map(step), stars.last().map(step)) else {
        return Vec::new();
    };
    let bin = |offset: usize| {
        let own = first + offset as f64;
        let from = stars.partition_point(|star| step(star) < own);
        let to = stars.partition_point(|star| step(star) <= own);
        let inside = &stars[from..to];
        MagnitudeBin {
            v_mag: (own + 0.5) * BIN_MAG,
            stars: inside.len(),
            detected: inside.iter().filter(|star| star.detected).count(),
        }
    };
    (0..=(last - first) as usize).map(bin).collect()
}

fn limit(stars: &[CountedStar], fit: Option<&CurveFit>) -> Result<Limit, NoLimit> {
    let detected = stars.iter().filter(|star| star.detected).count();
    if detected < MIN_PER_SIDE {
        return Err(NoLimit::TooFewDetected);
    }
    if stars.len() - detected < MIN_PER_SIDE {
        return Err(NoLimit::CatalogEnds);
    }
    let fit = fit.ok_or(NoLimit::Uncertain)?;
    let sigma_mag = fit.sigma_mag.ok_or(NoLimit::Uncertain)?;
    let fall = fit.curve.fall();
    let brighter = stars.partition_point(|star| star.v_mag < fall.v_mag);
    let detected = stars[..brighter].iter().filter(|t| t.detected).count();
    let missed = stars[brighter..].iter().filter(|t| !t.detected).count();
    if missed < MIN_PER_SIDE {
        return Err(NoLimit::CatalogEnds);
    }
    if detected < MIN_PER_SIDE {
        return Err(NoLimit::TooFewDetected);
    }
    if sigma_mag > MAX_SIGMA_MAG {
        return Err(NoLimit::Uncertain);
    }
    Ok(Limit {
        v_mag: fall.v_mag,
        sigma_mag,
        width_mag: fall.width_mag,
        lost: fit.curve.lost(),
    })
}

/// The parameters of the curve, transformed so that they are unbounded.
#[derive(Debug, Clone, Copy)]
struct CompletenessCurve {
    v_mag: f64,
    ln_width: f64,
    logit_lost: f64,
    chance: f64,
}

/// A fitted curve, and the standard error of its m₅₀.
struct CurveFit {
    curve: CompletenessCurve,
    sigma_mag: Option<f64>,
}

/// The logarithm of a posterior probability, and the equations of a step: its gradient, and the expected
/// information.
struct Likelihood {
    log: f64,
    fit: LinearFit<3>,
}

impl CompletenessCurve {
    /// Fits the curve to `stars`, brightest first, by damped Fisher scoring.
    fn fit(stars: &[CountedStar], chance: f64) -> Option<CurveFit> {
        const MAX_ROUNDS: usize = 60;
        /// Converged where a step is below a hundredth of the standard errors (squared).
        const CONVERGED: f64 = 1e-4;
        let (v_mag, lost) = best_step(stars)?;
        let lost = lost.clamp(PRIOR_LOST / (PRIOR_LOST + PRIOR_KEPT), 0.9);
        let mut curve = Self {
            v_mag,
            ln_width: libm::log(TYPICAL_WIDTH_MAG),
            logit_lost: libm::log(lost / (1.0 - lost)),
            chance: chance.clamp(1e-6, 0.25),
        };
        let mut current = curve.likelihood(stars);
        let mut damping = 1e-3;
        for _ in 0..MAX_ROUNDS {
            let step = current.fit.damped(damping).solve()?;
            if step.dot(&current.fit.vector) < CONVERGED {
                break;
            }
            let next = curve.moved(&step);
            let there = next.likelihood(stars);
            if there.log > current.log {
                (curve, current) = (next, there);
                damping *= 0.2;
            } else {
                damping = damping.max(1e-3) * 5.0;
            }
        }
        let covariance = current.fit.matrix.try_inverse();
        Some(CurveFit {
            curve,
            sigma_mag: covariance
                .map(|c| c[(0, 0)].sqrt())
                .filter(|sigma| sigma.is_finite()),
        })
    }

    fn moved(&self, step: &Vector3<f64>) -> Self {
        Self {
            v_mag: self.v_mag + step[0],
            ln_width: (self.ln_width + step[1]).clamp(-5.0, 3.0),
            logit_lost: (self.logit_lost + step[2]).clamp(-20.0, 20.0),
            chance: self.chance,
        }
    }

    fn fall(&self) -> Fall {
        Fall {
            v_mag: self.v_mag,
            width_mag: libm::exp(self.ln_width),
        }
    }

    fn lost(&self) -> f64 {
        1.0 / (1.0 + libm::exp(-self.logit_lost))
    }

    /// The prior of width and λ.
    fn prior(&self) -> Likelihood {
        let lost = self.lost();
        let off = (self.ln_width - libm::log(TYPICAL_WIDTH_MAG)) / LN_WIDTH_SIGMA;
        Likelihood {
            log: -0.5 * off.powi(2)
                + PRIOR_LOST * libm::log(lost)
                + PRIOR_KEPT * libm::log(1.0 - lost),
            fit: LinearFit {
                matrix: Matrix3::from_diagonal(&Vector3::new(
                    0.0,
                    LN_WIDTH_SIGMA.powi(-2),
                    (PRIOR_LOST + PRIOR_KEPT) * lost * (1.0 - lost),
                )),
                vector: Vector3::new(
                    0.0,
                    -off / LN_WIDTH_SIGMA,
                    PRIOR_LOST - (PRIOR_LOST + PRIOR_KEPT) * lost,
                ),
            },
        }
    }

    /// The posterior of `stars`, brightest first.
    fn likelihood(&self, stars: &[CountedStar]) -> Likelihood {
        /// Stars further from m₅₀ than this many widths are treated alike.
        const FAR_WIDTHS: f64 = 5.0;
        let (width, lost) = (libm::exp(self.ln_width), self.lost());
        let mut sum = self.prior();
        let full = 1.0 - self.chance - lost;
        // Adds `count` stars to gradient and information, and returns the probability of each one's
        // outcome.
        let mut add = |z: f64, detected: bool, count: usize| {
            let (above, density) = normal_cdf_and_density(z);
            let p = (self.chance + full * above).clamp(1e-12, 1.0 - 1e-12);
            let change = Vector3::new(
                full * density / width,
                -full * density * z,
                -above * lost * (1.0 - lost),
            );
            let (probability, sign) = if detected { (p, 1.0) } else { (1.0 - p, -1.0) };
            let count = count as f64;
            let information = count / (p * (1.0 - p));
            sum.fit
                .add(&change, information, count * sign / probability);
            probability
        };
        let brighter_than = |v_mag: f64| stars.partition_point(|star| star.v_mag < v_mag);
        let near = brighter_than(self.v_mag - FAR_WIDTHS * width)
            ..brighter_than(self.v_mag + FAR_WIDTHS * width);
        let mut log = 0.0;
        for (z, far) in [
            (FAR_WIDTHS, &stars[..near.start]),
            (-FAR_WIDTHS, &stars[near.end..]),
        ] {
            let detected = far.iter().filter(|star| star.detected).count();
            for (is_detected, count) in [(true, detected), (false, far.len() - detected)] {
                log += count as f64 * libm::log(add(z, is_detected, count));
            }
        }
        let mut product = LnProduct::ONE;
        for star in &stars[near] {
            let z = (self.v_mag - star.v_mag) / width;
            product.multiply(add(z, star.detected, 1));
        }
        sum.log += log + product.ln();
        sum
    }
}

/// The magnitude that best separates stars of which many are detected from those of which few are,
/// and the share that is lost of the brighter ones; `stars` are sorted, brightest first.
fn best_step(stars: &[CountedStar]) -> Option<(f64, f64)> {
    // The logarithm of the likelihood of stars that are all detected with the same probability.
    let log_likelihood = |stars: usize, detected: usize| {
        let part = |count: usize| match count {
            0 => 0.0,
            _ => count as f64 * libm::log(count as f64 / stars as f64),
        };
        part(detected) + part(stars - detected)
    };
    let all = stars.iter().filter(|star| star.detected).count();
    let first = (f64::NEG_INFINITY, (stars.first()?.v_mag, 0.0));
    let mut detected = 0;
    let steps = stars.iter().enumerate().map(|(i, star)| {
        detected += usize::from(star.detected);
        let (brighter, fainter) = (i + 1, stars.len() - i - 1);
        let next = stars.get(i + 1);
        // Between stars that are alike, the likelihood is convex: largest at one of the ends.
        let may_be_best = next.is_none_or(|next| next.detected != star.detected);
        // Fainter stars are not detected more often.
        let falls = detected * fainter >= (all - detected) * brighter;
        let log = if may_be_best && falls {
            log_likelihood(brighter, detected) + log_likelihood(fainter, all - detected)
        } else {
            f64::NEG_INFINITY
        };
        let next_v_mag = next.map_or(star.v_mag, |next| next.v_mag);
        let lost = 1.0 - detected as f64 / brighter as f64;
        (log, (0.5 * (star.v_mag + next_v_mag), lost))
    });
    let better = |best: (f64, _), step: (f64, _)| if step.0 > best.0 { step } else { best };
    Some(steps.fold(first, better).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::statistics::normal_cdf;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    #[test]
    fn where_no_star_is_missed_all_are_bright_enough_and_stars_near_a_fall_are_seen_too_bright() {
        let star = |number: u32| CountedStar {
            v_mag: 4.0 + 0.05 * f64::from(number),
            detected: true,
        };
        let all = measure(&(0..60).map(star).collect::<Vec<_>>(), 0.001);
        assert_eq!(all.limit, Err(NoLimit::CatalogEnds));
        assert!(all.fall.unwrap().is_complete_at(6.0), "{all:?}");
        let fall = Fall {
            v_mag: 8.0,
            width_mag: 0.3,
        };
        assert!(fall.is_complete_at(7.3) && !fall.is_complete_at(7.5));
        let mut random = ChaCha8Rng::seed_from_u64(7);
        for (v_mag, sigma_mag) in [(6.5, 0.2), (7.8, 0.2), (8.0, 0.3), (8.3, 0.25)] {
            // The rest of the width is not of the flux.
            let rest_mag = f64::sqrt(0.3 * 0.3 - sigma_mag * sigma_mag);
            let (mut brighter_mag, mut detected) = (0.0, 0.0);
            for _ in 0..40_000 {
                let [noise, other] = [(); 2].map(|()| random.sample::<f64, _>(StandardNormal));
                if v_mag + sigma_mag * noise + rest_mag * other < fall.v_mag {
                    brighter_mag -= sigma_mag * noise;
                    detected += 1.0;
                }
            }
            let (found_mag, expected_mag) = (
                brighter_mag / detected,
                fall.brightening_mag(v_mag, sigma_mag),
            );
            assert!(
                (found_mag - expected_mag).abs() < 0.012,
                "{found_mag} {expected_mag}"
            );
        }
    }

    /// The parameters of simulated stars.
    #[derive(Debug, Clone, Copy)]
    struct Sky {
        stars: usize,
        limit: f64,
        width: f64,
        lost: f64,
        chance: f64,
    }

    const TYPICAL: Sky = Sky {
        stars: 300,
        limit: 8.5,
        width: 0.35,
        lost: 0.02,
        chance: 0.003,
    };

    impl Sky {
        fn with(mut self, change: impl Fn(&mut Self)) -> Self {
            change(&mut self);
            self
        }

        /// Stars from 5.5 to 10 mag, three times as many per fainter magnitude.
        fn draw(&self, seed: u64) -> Vec<CountedStar> {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let faintest = 3_f64.powf(4.5);
            let mut star = || {
                let v_mag = 5.5 + random.random_range(1.0..faintest).ln() / 3_f64.ln();
                let above = normal_cdf((self.limit - v_mag) / self.width);
                let seen = random.random_bool((1.0 - self.lost) * above);
                CountedStar {
                    v_mag,
                    detected: seen || random.random_bool(self.chance),
                }
            };
            (0..self.stars).map(|_| star()).collect()
        }

        /// Mean and standard deviation of (found − true) / standard error.
        fn pulls(&self) -> (f64, f64) {
            const FRAMES: u64 = 600;
            let pulls: Vec<f64> = (0..FRAMES)
                .filter_map(|seed| measure(&self.draw(seed), self.chance).limit.ok())
                .map(|limit| (limit.v_mag - self.limit) / limit.sigma_mag)
                .collect();
            assert!(pulls.len() as f64 > 0.97 * FRAMES as f64, "{}", pulls.len());
            let count = pulls.len() as f64;
            let mean = pulls.iter().sum::<f64>() / count;
            let variance = pulls.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / count;
            (mean, variance.sqrt())
        }
    }

    #[test]
    fn the_limit_is_found_within_its_standard_error() {
        // 600 frames determine a mean to 0.04 and a standard deviation to 0.03.
        let well_determined = [
            TYPICAL,
            TYPICAL.with(|sky| sky.stars = 1500),
            TYPICAL.with(|sky| sky.width = 0.15),
            TYPICAL.with(|sky| sky.chance = 0.05),
        ];
        // With few bright stars, losses and the fall are hard to separate, and the priors show.
        let poorly_determined = [
            TYPICAL.with(|sky| sky.stars = 80),
            TYPICAL.with(|sky| sky.width = 0.7),
            TYPICAL.with(|sky| sky.lost = 0.15),
        ];
        for (skies, mean_tolerance, spread_tolerance) in [
            (&well_determined[..], 0.15, 0.1),
            (&poorly_determined[..], 0.5, 0.25),
        ] {
            for sky in skies {
                let (mean, spread) = sky.pulls();
                println!("{sky:?}: pulls {mean:+.3} ± {spread:.3}");
                assert!(mean.abs() < mean_tolerance, "{sky:?}: {mean}");
                assert!((spread - 1.0).abs() < spread_tolerance, "{sky:?}: {spread}");
            }
        }
    }

    #[test]
    fn width_and_lost_stars_are_found_as_well() {
        let sky = TYPICAL.with(|sky| (sky.stars, sky.lost) = (20_000, 0.1));
        let limit = measure(&sky.draw(1), sky.chance).limit.unwrap();
        assert!((limit.width_mag / sky.width - 1.0).abs() < 0.1, "{limit:?}");
        assert!((limit.lost - sky.lost).abs() < 0.02, "{limit:?}");
    }

    #[test]
    fn most_stars_may_be_hidden_at_all_magnitudes() {
        let sky = TYPICAL.with(|sky| (sky.stars, sky.lost) = (40_000, 0.65));
        for seed in 0..20 {
            let limit = measure(&sky.draw(seed), sky.chance).limit.unwrap();
            let off = (limit.v_mag - sky.limit) / limit.sigma_mag;
            assert!(
                off.abs() < 4.0 && (limit.lost - 0.65).abs() < 0.05,
                "{limit:?}"
            );
        }
    }

    #[test]
    fn one_bright_star_that_is_lost_moves_nothing() {
        let mut stars = TYPICAL.draw(7);
        let before = measure(&stars, TYPICAL.chance).limit.unwrap();
        stars.push(CountedStar {
            v_mag: 3.0,
            detected: false,
        });
        let after = measure(&stars, TYPICAL.chance).limit.unwrap();
        assert!((after.v_mag - before.v_mag).abs() < before.sigma_mag);
        assert!(after.width_mag < 1.1 * before.width_mag);
    }

    #[test]
    fn a_faint_star_at_the_place_of_another_detection_moves_nothing() {
        let mut stars = TYPICAL.draw(8);
        let before = measure(&stars, TYPICAL.chance).limit.unwrap();
        stars.push(CountedStar {
            v_mag: 12.0,
            detected: true,
        });
        let after = measure(&stars, TYPICAL.chance).limit.unwrap();
        assert!((after.v_mag - before.v_mag).abs() < 0.3 * before.sigma_mag);
    }

    #[test]
    fn a_sharp_edge_is_found_between_the_stars_on_either_side() {
        let stars: Vec<CountedStar> = (0..40)
            .map(|i| CountedStar {
                v_mag: 6.0 + 0.1 * f64::from(i),
                detected: i < 20,
            })
            .collect();
        let limit = measure(&stars, 0.0).limit.unwrap();
        assert!((limit.v_mag - 7.95).abs() < 0.1, "{limit:?}");
        assert!((0.02..0.3).contains(&limit.sigma_mag), "{limit:?}");
    }

    #[test]
    fn there_is_no_limit_where_completeness_does_not_fall_or_nothing_is_seen() {
        let all = |detected| -> Vec<CountedStar> {
            let stars = TYPICAL.draw(3).into_iter();
            stars.map(|star| CountedStar { detected, ..star }).collect()
        };
        assert_eq!(measure(&all(true), 0.0).limit, Err(NoLimit::CatalogEnds));
        assert_eq!(
            measure(&all(false), 0.0).limit,
            Err(NoLimit::TooFewDetected)
        );
        assert_eq!(measure(&[], 0.0).limit, Err(NoLimit::TooFewDetected));
        // A tenth is lost at any magnitude.
        let mut some = all(true);
        some.iter_mut()
            .step_by(10)
            .for_each(|star| star.detected = false);
        assert_eq!(measure(&some, 0.0).limit, Err(NoLimit::CatalogEnds));
    }

    #[test]
    fn the_curve_holds_every_star_once_and_has_no_gap() {
        let mut stars = TYPICAL.draw(4);
        stars.push(CountedStar {
            v_mag: 2.5,
            detected: true,
        });
        let bins = measure(&stars, 0.0).bins;
        assert_eq!(bins[0].v_mag, 2.75);
        assert!(
            bins.windows(2)
                .all(|pair| pair[1].v_mag - pair[0].v_mag == BIN_MAG)
        );
        assert_eq!(bins.iter().map(|bin| bin.stars).sum::<usize>(), stars.len());
        let detected = stars.iter().filter(|star| star.detected).count();
        assert_eq!(bins.iter().map(|bin| bin.detected).sum::<usize>(), detected);
        assert!(measure(&[], 0.0).bins.is_empty());
    }
}
