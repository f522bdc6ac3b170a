//! The spot size and the noise model of a frame, from its own bright stars.
//!
//! Bright peaks that are neither saturated nor close to others are fitted with a free size. The spot
//! size is the mode of the sizes: hot pixels and cosmic rays are sharper, lamps and comets wider, and
//! none of them need be few. From the residuals of the stars with that size follow the shot noise per
//! ADU and the relative error of the spot model, by least squares of the squared residuals.

use crate::detect::candidates::{Peak, RawPeak};
use crate::detect::fit::{
    Factor, Fit, FitConfig, FitWork, NoiseModel, ONE_SPOT, Pixels, SPOT_RANGE_PX, Scene, SpotLight,
    linearise, sum_of,
};
use crate::detect::psf::{LANES, PIXEL_VARIANCE_PX2};
use arrayvec::ArrayVec;
use multiversion::multiversion;
use std::mem;

/// The spot size where the frame does not tell, in pixels: a well-focused camera.
pub(crate) const DEFAULT_SPOT_PX: f64 = 0.9;
/// Peaks below this signal-to-noise ratio say little about the size.
const MIN_SNR: f32 = 12.0;
/// At most so many of the brightest peaks are fitted.
const MAX_STARS: usize = 30;
/// Peaks closer than this many spot sizes disturb each other.
const ISOLATION_SIGMA: f32 = 6.0;
/// Sizes below this are single pixels, in pixels.
const HOT_PIXEL_PX: f64 = 0.28;
/// Fewer stars than this do not make a mode.
const MIN_STARS: usize = 3;
/// An error of the spot model counts from this many standard errors on: what is below is chance.
const SIGNIFICANT_SIGMA: f64 = 2.0;
/// Squared residuals count at most this many variances: those of close neighbours, which no star's noise explains, would grow with
/// the variance that they make.
const MAX_SQUARED_SIGMA: f32 = 4.0;
/// The mean of squared standard Gaussians that are cut off there.
const CUT_OFF_MEAN: f32 = 0.920_5;
/// Rounds of the noise model's least squares.
const NOISE_ROUNDS: usize = 3;
/// The spot model cannot be worse than this, as a part of the light in a pixel: what is, is no star.
const MAX_MODEL_ERROR: f64 = 0.1;
/// Light beside a star is another's from this many standard deviations of the noise on.
const NEIGHBOUR_SIGMA: f64 = 5.0;
/// Sizes within this factor of the mode are averaged.
const MODE_WIDTH: f64 = 1.25;
/// Rounds of averaging around the mode.
const MODE_ROUNDS: usize = 4;

/// Bright stars, each fitted with a free size.
pub(crate) type BrightStars = ArrayVec<Fit, MAX_STARS>;

/// Fits the brightest peaks with a free size.
pub(crate) fn fit_bright_stars(
    scene: &Scene<'_>,
    peaks: &[Peak],
    work: &mut FitWork,
) -> BrightStars {
    let isolation = ISOLATION_SIGMA * (scene.spot_px + 0.3) as f32;
    let bright = peaks
        .iter()
        .take(4 * MAX_STARS)
        .take_while(|p| p.snr >= MIN_SNR);
    bright
        .filter(|p| !p.saturated && is_isolated(p, &peaks[..peaks.len().min(2000)], isolation))
        .filter_map(|&peak| {
            let size = size_from_curvature(&peak, scene.spot_px);
            let fit = scene.fit_free(
                scene.first_guess(&peak),
                &[],
                (size, NoiseModel::default()),
                work,
            );
            let is_star = fit.converged && fit.spots[0].flux > 0.0 && is_alone(&fit, work);
            is_star.then_some(fit)
        })
        .take(MAX_STARS)
        .collect()
}

/// Fits the brightest peaks of the unfiltered frame with a free size.
pub(crate) fn fit_raw_stars(
    scene: &Scene<'_>,
    peaks: &[RawPeak],
    work: &mut FitWork,
) -> BrightStars {
    let rivals = &peaks[..peaks.len().min(2000)];
    let bright = peaks
        .iter()
        .take(4 * MAX_STARS)
        .take_while(|p| p.snr >= MIN_SNR);
    bright
        .filter(|peak| !peak.saturated)
        .map(|peak| (peak, peak.size_px(&scene.view)))
        .filter(|(peak, size_px)| {
            let reach = ISOLATION_SIGMA * (*size_px as f32 + 0.3);
            let is_near = |other: &RawPeak| {
                let dx = other.x as f32 - peak.x as f32;
                let dy = other.y as f32 - peak.y as f32;
                (dx != 0.0 || dy != 0.0) && dx * dx + dy * dy <= reach * reach
            };
            !rivals.iter().any(|o| is_near(o) && o.snr >= 0.1 * peak.snr)
        })
        .filter_map(|(peak, size_px)| {
            let fit = scene.fit_free(peak.spot(), &[], (size_px, NoiseModel::default()), work);
            let is_star = fit.converged && fit.spots[0].flux > 0.0 && is_alone(&fit, work);
            is_star.then_some(fit)
        })
        .take(MAX_STARS)
        .collect()
}

/// Whether no other peak of a tenth of the height lies within `reach` pixels.
fn is_isolated(peak: &Peak, peaks: &[Peak], reach: f32) -> bool {
    peaks.iter().all(|other| {
        let dx = other.x as f32 - peak.x as f32;
        let dy = other.y as f32 - peak.y as f32;
        (dx == 0.0 && dy == 0.0) || dx * dx + dy * dy > reach * reach || other.snr < 0.1 * peak.snr
    })
}

/// Whether no light in the fit's window, which is still in `work`, is another star's: more than the spot's imperfection and
/// noise, where there should be next to none.
fn is_alone(fit: &Fit, work: &mut FitWork) -> bool {
    let mut pixels = work.fitter.compare(&work.window, fit);
    let peak = pixels
        .clone()
        .fold(0.0f64, |peak, (_, light)| peak.max(light));
    let faint = MAX_MODEL_ERROR * peak;
    let most = faint + NEIGHBOUR_SIGMA;
    !pixels.any(|(above, light)| light < faint && above - light > most)
}

/// The spot size that the filtered peak's curvature tells: a Gaussian of variance
/// σ² + σ_filter² + 2/12 falls to exp(−1/2S²) at the next pixel.
fn size_from_curvature(peak: &Peak, filter_px: f64) -> f64 {
    let Some((value, around)) = peak.values else {
        return filter_px;
    };
    let log = |value: f32| f64::from(value.max(1e-3)).ln();
    let drop = log(value) - 0.25 * around.into_iter().map(log).sum::<f64>();
    let variance = 0.5 / drop.max(1e-3) - filter_px * filter_px - 2.0 * PIXEL_VARIANCE_PX2;
    variance.max(0.0).sqrt().clamp(0.35, 6.0)
}

/// The frame's spot size from its bright stars, in pixels, and how many of them have about that
/// size; `None` where there are too few.
pub(crate) fn spot_size(stars: &BrightStars) -> Option<(f64, usize)> {
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
    // The mode is robust but rough: move to the mean of what lies around it.
    for _ in 0..MODE_ROUNDS {
        let near = |size: &&f64| (**size / center).max(center / **size) < MODE_WIDTH;
        let (sum, count) = sizes
            .iter()
            .filter(near)
            .fold((0.0, 0.0), |(s, n), size| (s + size, n + 1.0));
        center = sum / count;
        members = count;
    }
    Some((center, members as usize))
}

/// The mode of sorted positive values: the densest half (in ratio), again and again.
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

/// What bright stars of about the frame's spot size tell of all stars.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StarModel {
    /// Standard deviation of the spot, in pixels.
    pub spot_px: f64,
    /// How the noise grows with light.
    pub noise: NoiseModel,
}

/// The noise model from the residuals of stars of about the frame's spot size, and that size by the weights that follow.
pub(crate) fn star_model(
    scene: &Scene<'_>,
    mut usable: BrightStars,
    work: &mut FitWork,
) -> StarModel {
    usable.retain(|fit| (fit.spot_px / scene.spot_px).ln().abs() < MODE_WIDTH.ln());
    // A start from too little noise would let the brightest pixel decide, which a fit then follows wherever it is.
    let brightest = usable.first().map(|fit| fit.spots[0]);
    let mut model = NoiseModel {
        shot_adu: brightest.map_or(0.0, |spot| scene.noise_at(spot.x, spot.y)),
        model_error2: 0.0,
    };
    // Each round weighs the squared residuals by the variance that the round before found.
    for _ in 0..NOISE_ROUNDS {
        let mut sums = Moments::default();
        let config = FitConfig {
            spot_px: usable.iter().map(|s| s.spot_px).fold(0.0, f64::max),
            free_spot: true,
            noise: model,
        };
        let mut side_by_side = mem::take(&mut work.side_by_side);
        let of_star = |(i, star): (usize, &Fit)| (i, star.spots[0], star.spot_px);
        let starts: ArrayVec<_, MAX_STARS> = usable.iter().enumerate().map(of_star).collect();
        let starts = starts.into_iter();
        side_by_side.fit(scene, starts, &config, |i, fit, window| {
            if let Some(fit) = fit {
                work.window.copy_from(window);
                sums.add_star(work, &fit, &config);
                usable[i] = fit;
            }
        });
        work.side_by_side = side_by_side;
        model = sums.solve();
        model.model_error2 = model.model_error2.min(MAX_MODEL_ERROR * MAX_MODEL_ERROR);
    }
    StarModel {
        spot_px: weighted_size(&usable).unwrap_or(scene.spot_px),
        noise: model,
    }
}

/// The mean of the stars' sizes, weighted with their errors and with what they scatter beyond these, in pixels.
///
/// # Reference
/// DerSimonian & Laird 1986, Control. Clin. Trials 7, 177, doi 10.1016/0197-2456(86)90046-2, for the scatter.
fn weighted_size(stars: &[Fit]) -> Option<f64> {
    let is_known = |fit: &&Fit| fit.sigma_spot_px > 0.0 && fit.sigma_spot_px.is_finite();
    let sizes = || {
        let known = stars.iter().filter(is_known);
        known.map(|fit| (fit.spot_px, fit.sigma_spot_px.powi(2)))
    };
    let mean = |beyond: f64| {
        let weight = |variance: f64| 1.0 / (variance + beyond);
        let [sum, squares, sizes] = sizes().fold([0.0; 3], |[s, q, m], (size, variance)| {
            let w = weight(variance);
            [s + w, q + w * w, m + w * size]
        });
        (sizes / sum, sum, squares)
    };
    let (first, sum, squares) = mean(0.0);
    let chi2: f64 = sizes().map(|(size, v)| (size - first).powi(2) / v).sum();
    let beyond = (chi2 - (sizes().count() as f64 - 1.0)) / (sum - squares / sum);
    let (size, _, _) = mean(beyond.max(0.0));
    size.is_finite().then_some(size)
}

/// Sums for `Σ [r² − (1 − h) v] ∂v / v² = 0` over pixels, with `v = n² + shot·m + ε²·m²` and the leverage h: what
/// is left of a pixel's variance is the part that the star's own parameters have not taken up.
///
/// # Reference
/// Davidian & Carroll 1987, J. Am. Stat. Assoc. 82, 1079, doi 10.1080/01621459.1987.10478543: pseudo-likelihood, corrected for leverage.
#[derive(Debug, Default)]
struct Moments {
    /// Σ w m², Σ w m³, Σ w m⁴.
    matrix: [f64; 3],
    /// Σ w m d, Σ w m² d.
    right: [f64; 2],
}

impl Moments {
    /// Adds the pixels of one star that its light stands out in.
    fn add_star(&mut self, work: &mut FitWork, fit: &Fit, config: &FitConfig) {
        let FitWork { fitter, window, .. } = work;
        let Some((factor, spot, pixels)) = fitter.factorised(window, fit, config) else {
            return;
        };
        let per_noise = pixels.per_noise;
        let [a, b, c, p, q] = sums_of(&factor, &spot, &pixels);
        self.matrix[0] += a * per_noise * per_noise;
        self.matrix[1] += b * per_noise;
        self.matrix[2] += c;
        self.right[0] += p * per_noise;
        self.right[1] += q;
    }

    /// The non-negative solution, without an error of the spot model that chance explains.
    fn solve(&self) -> NoiseModel {
        let [a, b, c] = self.matrix;
        let [p, q] = self.right;
        let finite = |v: f64| if v.is_finite() { v.max(0.0) } else { 0.0 };
        let noise_model = |shot: f64, error2: f64| NoiseModel {
            shot_adu: finite(shot),
            model_error2: finite(error2),
        };
        let determinant = a * c - b * b;
        if determinant <= 1e-9 * a * c || !determinant.is_finite() {
            return noise_model(0.0, q / c);
        }
        let shot = (p * c - q * b) / determinant;
        let error2 = (q * a - p * b) / determinant;
        let chance = SIGNIFICANT_SIGMA * (2.0 * a / determinant).sqrt();
        if error2 < chance {
            noise_model(p / a, 0.0)
        } else if shot < 0.0 {
            noise_model(0.0, q / c)
        } else {
            noise_model(shot, error2)
        }
    }
}

/// The sums of [`Moments`] over the pixels of one star, in units of the noise.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn sums_of(factor: &Factor<ONE_SPOT>, spot: &SpotLight, pixels: &Pixels) -> [f64; 5] {
    let mut sums = [[0.0f32; LANES]; 5];
    for group in 0..pixels.groups {
        for (row, data) in pixels.column_of_groups(group).enumerate() {
            let lights = [spot.in_group(group, row)];
            for lane in 0..LANES {
                let (light, gradient) = linearise(&lights, 1, lane);
                let m2 = light * light;
                let variance = pixels.variance(light);
                let stands_out = light >= 0.0 && m2 >= 0.25 && !data[lane].is_nan();
                let residual = data[lane] - light - pixels.background;
                let free = (1.0 - factor.leverage(&gradient) / variance).max(0.0);
                let squared = (residual * residual).min(MAX_SQUARED_SIGMA * free * variance);
                let above_noise = squared / CUT_OFF_MEAN - free;
                let weight = 1.0 / (variance * variance);
                let terms = [
                    free * m2,
                    free * m2 * light,
                    free * m2 * m2,
                    light * above_noise,
                    m2 * above_noise,
                ];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    sum[lane] += if stands_out { weight * term } else { 0.0 };
                }
            }
        }
    }
    sums.map(sum_of)
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
