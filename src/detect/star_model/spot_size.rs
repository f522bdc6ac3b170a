//! The spot size of a frame: the mode of the sizes of its bright stars.

use crate::detect::fit::{Fit, SPOT_RANGE_PX};
use arrayvec::ArrayVec;

/// The spot size where the frame has too few stars, in pixels: that of a well-focused camera.
pub(crate) const DEFAULT_SPOT_PX: f64 = 0.9;
/// Sizes within this factor of the mode are of stars.
pub(crate) const MODE_WIDTH: f64 = 1.25;

/// Most bright stars that are fitted.
pub(crate) const MAX_STARS: usize = 30;

/// Bright stars, each fitted with a free size.
pub(crate) type BrightStars = ArrayVec<Fit, MAX_STARS>;

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
    /// Smaller sizes are of single pixels, in pixels.
    const HOT_PIXEL_PX: f64 = 0.28;
    /// Fewer stars than this have no mode.
    const MIN_STARS: usize = 3;
    /// Rounds of averaging around the mode.
    const ROUNDS: usize = 4;
    let mut sizes: ArrayVec<f64, MAX_STARS> = stars
        .iter()
        .map(|star| star.spot_px)
        .filter(|&size| size > HOT_PIXEL_PX && size < SPOT_RANGE_PX.1)
        .collect();
    if sizes.len() < MIN_STARS {
        return None;
    }
    sizes.sort_unstable_by(f64::total_cmp);
    let mut center = half_sample_mode(&sizes);
    let mut members = 0.0;
    // The mode is robust but not precise: move to the mean of the sizes around it.
    for _ in 0..ROUNDS {
        let near = |size: &&f64| (**size / center).max(center / **size) < MODE_WIDTH;
        let (sum, count) = sizes
            .iter()
            .filter(near)
            .fold((0.0, 0.0), |(s, n), size| (s + size, n + 1.0));
        center = sum / count;
        members = count;
    }
    Some(SpotSize {
        spot_px: center,
        stars: members as usize,
    })
}

/// The mode of sorted positive values: the densest half by ratio, repeatedly.
///
/// # Reference
/// Bickel & Frühwirth 2006, doi 10.1016/j.csda.2005.07.011.
fn half_sample_mode(sorted: &[f64]) -> f64 {
    let mut values = sorted;
    while values.len() > 3 {
        let half = values.len().div_ceil(2);
        let start = (0..=values.len() - half)
            .min_by(|&a, &b| {
                let ratio = |i: usize| values[i + half - 1] / values[i];
                ratio(a).total_cmp(&ratio(b))
            })
            .unwrap_or(0);
        values = &values[start..start + half];
    }
    values[values.len() / 2]
}

/// The mean of the stars' sizes in pixels, weighted by their errors and by their scatter beyond
/// these.
///
/// # Reference
/// DerSimonian & Laird 1986, Control. Clin. Trials 7, 177, doi 10.1016/0197-2456(86)90046-2, for
/// the scatter.
pub(crate) fn weighted_size<'a>(stars: impl Iterator<Item = &'a Fit> + Clone) -> Option<f64> {
    let is_known = |fit: &&Fit| fit.sigma_spot_px > 0.0 && fit.sigma_spot_px.is_finite();
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

    #[test]
    fn the_mode_is_neither_hot_pixels_nor_lamps() {
        let mut sizes = vec![0.3; 5];
        sizes.extend((0..20).map(|i| 0.95 + 0.005 * f64::from(i)));
        sizes.extend((0..12).map(|i| 2.0 + 0.4 * f64::from(i)));
        let mode = half_sample_mode(&sizes);
        assert!(
            (0.9..1.1).contains(&mode) || (mode - 0.3).abs() < 1e-9,
            "{mode}"
        );
    }
}
