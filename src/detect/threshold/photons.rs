//! The skewness of photon noise, and the threshold for it.
//!
//! The threshold does not follow from the measured tail itself: that is mostly of stars too faint
//! to be detected, and a threshold raised for these would lose a third of the stars that can be
//! detected. The skewness of the noise can be separated from that of faint stars.

use super::filter_weights::{FilterWeights, sum_of_powers};
use super::saddlepoint::{CumulantTable, MAX_RAISE, after_clipping, saddlepoint_quantile};
use super::star_free::{MIN_SAMPLES, NoiseBuffers, StarFree};
use crate::detect::background::Mesh;
use crate::detect::filter::normalise;
use crate::detect::pixels::{View, pairwise_sum};
use crate::detect::psf::{AxisProfile, MAX_WINDOW_PX};
use multiversion::multiversion;

/// Pixels further off than this many standard deviations are hot or a star's.
const CLIP_SIGMA: f32 = 6.0;
/// Number of pixels that are sampled, about: the standard error of the skewness is then some 0.01.
const SAMPLES: usize = 75_000;
/// Noise of neighbors with a higher correlation is not counted photons; faint stars make 0.02.
const MAX_CORRELATION: f64 = 0.1;

/// The threshold that filtered photon noise, of pixels with this skewness, exceeds as often as
/// Gaussian noise exceeds `u`; at least `u`. It is in units of the noise that a mesh measures in
/// the filtered frame.
///
/// Poisson noise of standard deviation 1 and skewness s has `K(t) = (exp(st) − 1 − st)/s²`.
pub(crate) fn threshold_for_photons(u: f64, skewness: f64, filter: &FilterWeights) -> f64 {
    /// Below this the threshold changes by less than a hundredth of the noise.
    const MIN_SKEWNESS: f64 = 1e-3;
    if skewness <= MIN_SKEWNESS {
        return u;
    }
    let step = CumulantTable::step_for(filter);
    let cumulants = |i: usize| {
        let st = skewness * step * i as f64;
        let above = libm::expm1(st);
        [
            (above - st) / (skewness * skewness),
            above / skewness,
            above + 1.0,
        ]
    };
    let table = CumulantTable::new(step, cumulants);
    let cubes = sum_of_powers(&filter.inside, 3);
    let fourths = sum_of_powers(&filter.inside, 4);
    let (mean, sigma) = after_clipping(cubes * skewness, fourths * skewness * skewness);
    let quantile = |weights: &[(f64, f64)]| saddlepoint_quantile(&table, weights, u);
    let of_frame = filter.quantile_of_frame(u, 0.0, quantile);
    of_frame.map_or(u, |of_frame| {
        (((of_frame - mean) / sigma).min(u + MAX_RAISE * u)).max(u)
    })
}

/// The skewness of the pixels' noise, without that of stars too faint to be detected; `None` for
/// too few pixels without stars, and where the noise of neighbors is correlated (JPEG,
/// demosaicing).
///
/// Faint stars skew the pixels, too, but neighbors together. For noise that is independent from
/// pixel to pixel the cumulant `κ(z, z, z')` of neighbors is 0; for stars it is `ΣP²P'/ΣP³` of
/// `κ(z, z, z)`.
pub(crate) fn photon_skewness(
    view: &View<'_>,
    mesh: &Mesh,
    star_free: &StarFree<'_>,
    spot_px: f64,
    buffers: &mut NoiseBuffers,
) -> Option<f64> {
    let mut sums = [0.0f64; MOMENTS];
    let NoiseBuffers {
        standardised,
        pieces,
        nodes,
        ..
    } = buffers;
    standardised.resize(view.width, 0.0);
    let step = (view.width * view.height / SAMPLES).max(1);
    for y in (step / 2..view.height).step_by(step) {
        mesh.row_pieces(y, pieces);
        normalise(view.row(y), pieces, standardised);
        star_free.spans(y, view, nodes, |span| {
            let of_span = moments(&standardised[span]);
            for (sum, part) in sums.iter_mut().zip(of_span) {
                *sum += f64::from(part);
            }
        });
    }
    let [count, ..] = sums;
    if count < MIN_SAMPLES {
        return None;
    }
    let [_, mean, square, cube, product, mixed] = sums.map(|sum| sum / count);
    let variance = square - mean * mean;
    let own = cube - 3.0 * mean * square + 2.0 * mean.powi(3);
    let of_neighbors = mixed - mean * square - 2.0 * mean * product + 2.0 * mean.powi(3);
    let skewness = (own - own_per_mixed(spot_px) * of_neighbors) / libm::pow(variance, 1.5);
    let is_independent = product - mean * mean < MAX_CORRELATION * variance;
    (is_independent && skewness.is_finite()).then_some(skewness)
}

/// The number of pairs of neighbors z, z', and the sums of z, z², z³, zz' and (z²z' + zz'²)/2.
const MOMENTS: usize = 6;

/// The moments of the pairs of neighbors in a row; outliers count as background.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn moments(row: &[f32]) -> [f32; MOMENTS] {
    const LANES: usize = 16;
    let mut sums = [[0.0f32; LANES]; MOMENTS];
    let kept = |z: f32| if z.abs() <= CLIP_SIGMA { z } else { 0.0 };
    let pairs = row.len().saturating_sub(1) / LANES * LANES;
    for start in (0..pairs).step_by(LANES) {
        let (Some(first), Some(second)) = (
            row[start..].first_chunk::<LANES>(),
            row[start + 1..].first_chunk::<LANES>(),
        ) else {
            continue;
        };
        for lane in 0..LANES {
            let (a, b) = (kept(first[lane]), kept(second[lane]));
            let (square, product) = (a * a, a * b);
            sums[1][lane] += a;
            sums[2][lane] += square;
            sums[3][lane] += square * a;
            sums[4][lane] += product;
            sums[5][lane] += 0.5 * product * (a + b);
        }
    }
    let mut total = sums.map(pairwise_sum);
    total[0] = pairs as f32;
    total
}

/// `ΣP³ / ΣP²P'` of a spot along a row, each averaged over positions of the spot within a pixel.
fn own_per_mixed(spot_px: f64) -> f64 {
    const POSITIONS: usize = 8;
    let radius = ((4.0 * spot_px).ceil() as usize + 1).min(MAX_WINDOW_PX / 2);
    let mut profile = AxisProfile::default();
    let [mut own, mut mixed] = [0.0; 2];
    for i in 0..POSITIONS {
        let center = radius as f64 + (i as f64 + 0.5) / POSITIONS as f64 - 0.5;
        profile.fill(center, spot_px, 2 * radius + 1);
        for pair in profile.values()[..2 * radius + 1].windows(2) {
            let [first, second] = [pair[0], pair[1]].map(f64::from);
            own += first.powi(3);
            mixed += 0.5 * first * second * (first + second);
        }
    }
    own / mixed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photons_have_the_tail_of_the_poisson_distribution() {
        // 16 pixels of 25 photons each: 400 together, and P(> 497.7) is that of a Gaussian beyond
        // 4.5.
        let filter = FilterWeights {
            inside: [(16.0, 0.25)].into_iter().collect(),
            at_border: [(16.0, 0.25)].into_iter().collect(),
            largest: 0.25,
            border_part: 0.0,
        };
        let skewness = 1.0 / 25f64.sqrt();
        let (mean, sigma) = after_clipping(skewness / 4.0, (skewness / 4.0).powi(2));
        let at = threshold_for_photons(4.5, skewness, &filter) * sigma + mean;
        let tail = poisson_tail(400.0, 400.0 + 20.0 * at);
        let wanted = 3.398e-6;
        assert!((tail / wanted - 1.0).abs() < 0.1, "{at}: {tail}");
        assert_eq!(threshold_for_photons(4.5, 0.0, &filter), 4.5);
    }

    /// The probability of more than `beyond` photons; steps are interpolated.
    fn poisson_tail(mean: f64, beyond: f64) -> f64 {
        let log_chance = |n: f64| n * mean.ln() - mean - libm::lgamma(n + 1.0);
        let first = (beyond + 0.5).floor();
        let whole: f64 = (1..400)
            .map(|i| log_chance(first + f64::from(i)).exp())
            .sum();
        whole + (first + 0.5 - beyond) * log_chance(first).exp()
    }

    #[test]
    fn stars_skew_neighbors_as_their_own_pixels() {
        // A spot of one pixel has no neighbors; a wide one has equal ones.
        assert!(own_per_mixed(0.2) > 5.0);
        assert!((own_per_mixed(4.0) - 1.0).abs() < 0.05);
        let row: Vec<f32> = (0..33).map(|i| if i == 8 { 2.0 } else { 1.0 }).collect();
        assert_eq!(moments(&row), [32.0, 33.0, 35.0, 39.0, 34.0, 36.0]);
    }
}
