//! The spot size of a frame: the mode of the sizes of its bright stars.

use crate::detect::contrast::HOT_PIXEL_PX;
use crate::detect::fit::{SPOT_RANGE_PX, SpotFit};
use arrayvec::ArrayVec;

/// The spot size where the frame has too few stars, in pixels: that of a well-focused camera.
pub(crate) const DEFAULT_SPOT_PX: f64 = 0.9;
/// Sizes within this factor of the mode are of stars.
pub(crate) const MODE_WIDTH: f64 = 1.25;

/// Most bright stars that are fitted.
pub(crate) const MAX_STARS: usize = 30;

/// Bright stars, each fitted with a free size.
pub(crate) type BrightStars = ArrayVec<SpotFit, MAX_STARS>;

/// The mode of the sizes of bright stars.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SpotSize {
    /// Standard deviation of the spot, in pixels.
    pub spot_px: f64,
    /// Number of stars with about that size.
    pub stars: usize,
}

/// The frame's spot size from its bright stars; `None` where there are too few.
pub(crate) fn spot_size(stars: &BrightStars) -> Option<SpotSize> {
    /// Fewer stars than this have no mode.
    const MIN_STARS: usize = 3;
    /// Rounds of averaging around the mode.
    const ROUNDS: usize = 4;
    let is_spot = |size: f64| size > HOT_PIXEL_PX && size < SPOT_RANGE_PX.1;
    let weighted = stars.iter().enumerate().map(|(rank, star)| WeightedSize {
        px: star.spot_px,
        weight: weight_of(rank, stars.len()),
    });
    let mut sizes: ArrayVec<WeightedSize, MAX_STARS> =
        weighted.filter(|size| is_spot(size.px)).collect();
    if sizes.len() < MIN_STARS {
        return None;
    }
    sizes.sort_unstable_by(|a, b| a.px.total_cmp(&b.px));
    let mut center = densest_cluster(&sizes);
    let mut members = 0.0;
    // The mode is robust but not precise: move to the mean of the sizes around it.
    for _ in 0..ROUNDS {
        let near = |px: &f64| (px / center).max(center / px) < MODE_WIDTH;
        let near_sizes = sizes.iter().map(|size| size.px).filter(near);
        let (sum, count) = near_sizes.fold((0.0, 0.0), |(s, n), px| (s + px, n + 1.0));
        center = sum / count;
        members = count;
    }
    Some(SpotSize {
        spot_px: center,
        stars: members as usize,
    })
}

/// A size, and how much it counts.
#[derive(Debug, Clone, Copy)]
struct WeightedSize {
    px: f64,
    weight: f64,
}

/// How much a star counts that has this rank among so many, brightest first: the brightest are the
/// least likely to be noise. 1 on average.
fn weight_of(rank: usize, stars: usize) -> f64 {
    1.5 - (rank as f64 + 0.5) / stars as f64
}

/// The mode of sorted sizes: the middle of the densest cluster by ratio, of those of up to
/// [`MODE_WIDTH`] the one that chance explains least.
///
/// # Reference
/// Kulldorff 1997, Commun. Stat. Theory Methods 26, 1481, doi 10.1080/03610929708831995: the scan
/// statistic, here along the logarithm of the size.
fn densest_cluster(sorted: &[WeightedSize]) -> f64 {
    /// Narrower clusters are no denser: sizes have errors, as a ratio.
    const MIN_RATIO: f64 = 1.1;
    let count: f64 = sorted.iter().map(|size| size.weight).sum();
    let range = libm::log(SPOT_RANGE_PX.1 / HOT_PIXEL_PX);
    // The log likelihood ratio of a cluster in this share of the range.
    let surplus = |members: f64, share: f64| {
        let term = |n: f64, share: f64| {
            if n > 0.0 {
                n * libm::log(n / (count * share))
            } else {
                0.0
            }
        };
        term(members, share) + term(count - members, 1.0 - share)
    };
    let (mut most, mut mode) = (f64::NEG_INFINITY, DEFAULT_SPOT_PX);
    for first in 0..sorted.len() {
        let mut members = 0.0;
        for last in first..sorted.len() {
            members += sorted[last].weight;
            let ratio = sorted[last].px / sorted[first].px;
            if ratio > MODE_WIDTH * MODE_WIDTH {
                break;
            }
            let share = libm::log(ratio.max(MIN_RATIO)) / range;
            let of_cluster = surplus(members, share);
            // Fewer than expected are no cluster.
            if members > count * share && of_cluster > most {
                (most, mode) = (of_cluster, sorted[usize::midpoint(first, last)].px);
            }
        }
    }
    mode
}

/// The mean of the stars' sizes in pixels, weighted by their errors and by their scatter beyond
/// these.
///
/// # Reference
/// DerSimonian & Laird 1986, Control. Clin. Trials 7, 177, doi 10.1016/0197-2456(86)90046-2, for
/// the scatter.
pub(crate) fn weighted_size<'a>(stars: impl Iterator<Item = &'a SpotFit> + Clone) -> Option<f64> {
    let is_known = |fit: &&SpotFit| fit.sigma_spot_px > 0.0 && fit.sigma_spot_px.is_finite();
    let sizes = || {
        let known = stars.clone().filter(is_known);
        known.map(|fit| (fit.spot_px, fit.sigma_spot_px.powi(2)))
    };
    let mean = |scatter2: f64| {
        let weight = |variance: f64| 1.0 / (variance + scatter2);
        let [sum, squares, sizes] = sizes().fold([0.0; 3], |[s, q, m], (size, variance)| {
            let w = weight(variance);
            [s + w, q + w * w, m + w * size]
        });
        (sizes / sum, sum, squares)
    };
    let (first, sum, squares) = mean(0.0);
    let chi2: f64 = sizes().map(|(size, v)| (size - first).powi(2) / v).sum();
    let scatter2 = (chi2 - (sizes().count() as f64 - 1.0)) / (sum - squares / sum);
    let (size, _, _) = mean(scatter2.max(0.0));
    size.is_finite().then_some(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mode of sizes that come brightest first.
    fn mode(sizes: &[f64]) -> f64 {
        let ranks = sizes.iter().enumerate();
        let mut sizes: Vec<WeightedSize> = ranks
            .map(|(rank, &px)| WeightedSize {
                px,
                weight: weight_of(rank, sizes.len()),
            })
            .collect();
        sizes.sort_unstable_by(|a, b| a.px.total_cmp(&b.px));
        densest_cluster(&sizes)
    }

    #[test]
    fn the_mode_is_neither_hot_pixels_nor_lamps() {
        let lamps = (0..12).map(|i| 2.0 + 0.4 * f64::from(i));
        let stars = (0..20).map(|i| 0.95 + 0.005 * f64::from(i));
        let sizes: Vec<f64> = lamps.chain([0.3; 5]).chain(stars).collect();
        let mode = mode(&sizes);
        assert!((0.95..1.05).contains(&mode), "{mode}");
    }

    #[test]
    fn bright_stars_of_one_size_outweigh_more_specks_of_many_sizes() {
        // Eleven stars, and nineteen specks of noise that are sharper than any star.
        let stars = [
            2.03, 1.83, 1.57, 1.74, 1.92, 1.86, 1.64, 1.57, 1.59, 1.53, 1.46,
        ];
        let specks = (0..19).map(|i| 0.3 + 0.8 * f64::from(7 * i % 19) / 19.0);
        let mode = mode(&stars.into_iter().chain(specks).collect::<Vec<_>>());
        assert!((1.5..2.0).contains(&mode), "{mode}");
    }
}
