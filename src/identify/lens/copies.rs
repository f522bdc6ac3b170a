//! Frames that are one observation: copies of a file, in whatever format and scale.
//!
//! The noise of two exposures differs, and so the places of their stars do, by about their errors. In a
//! copy they do not: after the motion of the one picture to the other, the stars are where they were.

use super::frames::{LeftOutFrame, LensFrame, Unfit};
use crate::base::statistics::log10_binomial_tail;
use crate::identify::fit::MeasuredStar;
use nalgebra::Complex;

/// Errors may be stated too large by this factor: in pictures that are compressed strongly they are.
const OVERSTATED: f64 = 2.0;
/// log10 of the probability with which two observations have places that are as equal.
const CERTAIN_LOG10: f64 = -9.0;
/// Squared distances, in the variance of their difference, below which stars are counted.
const NEAR: [f64; 7] = [0.5, 0.2, 0.1, 1e-2, 1e-3, 1e-5, 1e-6];
/// Stars whose differences the motion takes: four parameters.
const TAKEN: usize = 2;

/// The frames without copies of others: the first of each observation is kept.
pub(super) fn without_copies(
    frames: Vec<LensFrame>,
    left_out: &mut Vec<LeftOutFrame>,
) -> Vec<LensFrame> {
    let mut kept: Vec<LensFrame> = Vec::with_capacity(frames.len());
    for frame in frames {
        match kept.iter().find(|other| are_copies(other, &frame)) {
            Some(other) => left_out.push(LeftOutFrame {
                name: frame.name,
                why: Unfit::Copy {
                    of: other.name.clone(),
                },
            }),
            None => kept.push(frame),
        }
    }
    kept
}

/// Whether the stars of two frames are off by the same noise.
fn are_copies(a: &LensFrame, b: &LensFrame) -> bool {
    let shared = a.shared_stars(b);
    if 2 * shared.len() < a.stars().min(b.stars()) {
        return false;
    }
    let stars = shared
        .iter()
        .map(|[i, j]| [&a.joint.stars[*i], &b.joint.stars[*j]]);
    has_same_noise(&stars.collect::<Vec<_>>())
}

/// Whether pairs of stars are nearer to each other than two measurements of them can be.
fn has_same_noise(pairs: &[[&MeasuredStar; 2]]) -> bool {
    if pairs.len() <= TAKEN {
        return false;
    }
    let distances = distances_sq(pairs);
    NEAR.iter().any(|near| {
        let hits = distances.iter().filter(|distance| *distance < near).count();
        // Half the square of a distance has an exponential distribution.
        let chance = -libm::expm1(-0.5 * near * OVERSTATED * OVERSTATED);
        let trials = pairs.len() - TAKEN;
        log10_binomial_tail(trials, hits.saturating_sub(TAKEN), chance) < CERTAIN_LOG10
    })
}

/// The squared distances of pairs of stars after the motion of the one frame to the other (a turn, a scale
/// and a shift), in the variance of their difference on each axis.
fn distances_sq(pairs: &[[&MeasuredStar; 2]]) -> Vec<f64> {
    const ROUNDS: usize = 5;
    let at = |star: &MeasuredStar| Complex::new(star.pixel.x, star.pixel.y);
    let variance = |[a, b]: &[&MeasuredStar; 2]| a.sigma_px.powi(2) + b.sigma_px.powi(2);
    let mut distances = vec![0.0; pairs.len()];
    for _ in 0..ROUNDS {
        // Stars that are far off pull less (Cauchy's weights).
        let weights = pairs.iter().zip(&distances);
        let weights = weights.map(|(pair, distance)| 1.0 / (variance(pair) * (1.0 + distance)));
        let weights: Vec<f64> = weights.collect();
        let total: f64 = weights.iter().sum();
        let mean = |side: usize| {
            let terms = pairs.iter().zip(&weights);
            terms
                .map(|(pair, weight)| at(pair[side]) * *weight)
                .sum::<Complex<f64>>()
                / total
        };
        let means = [mean(0), mean(1)];
        let (mut product, mut square) = (Complex::new(0.0, 0.0), 0.0);
        for (pair, weight) in pairs.iter().zip(&weights) {
            let [from, to] = [0, 1].map(|side| at(pair[side]) - means[side]);
            product += from.conj() * to * *weight;
            square += from.norm_sqr() * weight;
        }
        let turn = product / square;
        for (pair, distance) in pairs.iter().zip(&mut distances) {
            let [from, to] = [0, 1].map(|side| at(pair[side]) - means[side]);
            *distance = (to - turn * from).norm_sqr() / variance(pair);
        }
    }
    distances
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, UnitVector};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    fn star([x, y]: [f64; 2], sigma_px: f64) -> MeasuredStar {
        MeasuredStar {
            pixel: PixelPoint::new(x, y),
            icrs: UnitVector::from_ra_dec(0.0, 0.0),
            sigma_px,
        }
    }

    /// Stars of an exposure with errors of `SIGMA_PX`, and the same with further errors of `noise_px`,
    /// turned by half a turn, where an error of `stated_px` is stated.
    fn exposures(
        count: usize,
        [first_px, noise_px, stated_px]: [f64; 3],
        rng: &mut ChaCha8Rng,
    ) -> [Vec<MeasuredStar>; 2] {
        let mut pair = [Vec::new(), Vec::new()];
        for _ in 0..count {
            let place = [rng.random_range(0.0..1e3), rng.random_range(0.0..1e3)];
            let mut off = |sigma_px: f64, place: [f64; 2]| {
                place.map(|along| along + sigma_px * rng.sample::<f64, _>(StandardNormal))
            };
            let seen = off(first_px, place);
            let [x, y] = off(noise_px, if first_px == 0.0 { place } else { seen });
            let first = if first_px == 0.0 {
                off(noise_px, place)
            } else {
                seen
            };
            pair[0].push(star(first, stated_px));
            pair[1].push(star([1003.0 - x, 999.0 - y], stated_px));
        }
        pair
    }

    fn found(pair: &[Vec<MeasuredStar>; 2]) -> bool {
        let pairs: Vec<_> = pair[0].iter().zip(&pair[1]).map(|(a, b)| [a, b]).collect();
        has_same_noise(&pairs)
    }

    #[test]
    fn copies_are_found_and_exposures_are_not() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for count in [4, 5, 10, 50, 500] {
            for _ in 0..20 {
                // A copy, exact but for rounding.
                assert!(found(&exposures(count, [0.1, 1e-9, 0.1], &mut rng)));
                // Two exposures, with errors that are stated as they are, and 1.8 times too large.
                assert!(!found(&exposures(count, [0.0, 0.1, 0.1], &mut rng)));
                assert!(!found(&exposures(count, [0.0, 0.1, 0.18], &mut rng)));
            }
        }
        // A tenth of the noise is new, as where a picture is compressed.
        for count in [50, 500] {
            assert!(found(&exposures(count, [0.1, 0.03, 0.1], &mut rng)));
        }
    }
}
