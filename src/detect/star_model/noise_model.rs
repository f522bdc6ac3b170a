//! How the noise grows with light, from the residuals of bright stars.
//!
//! Shot noise per ADU and the relative error of the spot model follow by least squares of the
//! squared residuals.

use super::bright_stars::MAX_MODEL_ERROR;
use super::non_gaussian::{CommonElongation, are_non_gaussian};
use super::spot_size::{BrightStars, MAX_STARS, MODE_WIDTH, weighted_size};
use crate::base::least_squares::solve_pair;
use crate::detect::fit::{
    AnyLight, BatchStart, CholeskyFactor, FitBuffers, FitConfig, FrameMaps, NoiseModel, ONE_SPOT,
    SpotEstimate, SpotFit, SpotGroup, SpotLight, Window, WindowPixels, linearise, sum_of,
};
use crate::detect::psf::GROUP_PX;
use arrayvec::ArrayVec;
use multiversion::multiversion;
use std::mem;

/// An error of the spot model below this many standard errors is chance.
const SIGNIFICANT_SIGMA: f64 = 2.0;
/// Squared residuals count as at most this many variances. Those of close neighbors, which no
/// star's noise explains, would grow with the variance that they cause.
const MAX_SQUARED_SIGMA: f32 = 4.0;
/// The mean of squared standard Gaussians that are cut off there.
const CUT_OFF_MEAN: f32 = 0.920_5;
/// Fewest electrons that fill the scale of gray levels. A small pixel holds some thousands, of which the
/// highest gain of a camera uses about a fiftieth. Spots whose form is not that of the model, as of
/// pictures with a tone curve, would appear as more noise than that.
const FEWEST_ELECTRONS: f64 = 50.0;
/// Rounds of the least squares.
const NOISE_ROUNDS: usize = 3;

/// Size and noise of the stars of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StarModel {
    /// Standard deviation of the spot, in pixels.
    pub spot_px: f64,
    /// How the noise grows with light.
    pub noise: NoiseModel,
    /// Whether the stars may be no round Gaussians of one size.
    pub is_non_gaussian: bool,
}

/// The noise model from the residuals of stars of about the frame's spot size, and their mean size
/// with the weights that follow from it.
pub(crate) fn star_model(
    maps: &FrameMaps<'_>,
    stars: BrightStars,
    buffers: &mut FitBuffers,
) -> StarModel {
    star_model_in(NOISE_ROUNDS, maps, stars, buffers)
}

/// [`star_model`] in so many rounds.
fn star_model_in(
    rounds: usize,
    maps: &FrameMaps<'_>,
    mut stars: BrightStars,
    buffers: &mut FitBuffers,
) -> StarModel {
    let of_all_sizes = stars.clone();
    stars.retain(|fit| has_size_of(maps, fit));
    // The start must not have too little noise: else a fit follows the brightest pixel wherever it
    // is.
    let brightest = stars.first().map(|fit| fit.spots[0]);
    let mut model = NoiseModel {
        shot_adu: brightest.map_or(0.0, |spot| maps.noise_at(spot.x, spot.y)),
        model_error2: 0.0,
    };
    let mut elongation = CommonElongation::new(maps.view.size());
    // Each round weights the squared residuals by the variance from the round before.
    for round in 1..=rounds {
        let mut sums = NoiseSums::default();
        let config = FitConfig {
            spot_px: stars.iter().map(|s| s.spot_px).fold(0.0, f64::max),
            free_size: true,
            noise: model,
        };
        let mut batch = buffers.batch.take().unwrap_or_default();
        let of_star = |(number, star): (usize, &SpotFit)| BatchStart {
            number,
            spot: star.spots[0],
            spot_px: star.spot_px,
        };
        let starts: ArrayVec<_, MAX_STARS> = stars.iter().enumerate().map(of_star).collect();
        let starts = starts.into_iter();
        batch.fit(maps, starts, &config, |i, fit, window| {
            if let Some(fit) = fit {
                buffers.window.copy_from(window);
                let is_last = round == rounds;
                sums.add_star(buffers, &fit, &config, is_last.then_some(&mut elongation));
                stars[i] = fit;
            }
        });
        buffers.batch = Some(batch);
        model = believable(sums.solve(), maps);
    }
    StarModel {
        spot_px: weighted_size(stars.iter()).unwrap_or(maps.spot_px),
        noise: model,
        is_non_gaussian: are_non_gaussian(&elongation, &model, &of_all_sizes, maps.spot_px),
    }
}

/// Size and noise of the stars that begin at `starts`, which are not fitted yet, in fewer rounds than
/// [`star_model`] needs for the noise of the faintest.
pub(crate) fn rough_star_model(
    maps: &FrameMaps<'_>,
    starts: impl Iterator<Item = SpotEstimate>,
    buffers: &mut FitBuffers,
) -> StarModel {
    const ROUNDS: usize = 2;
    let unfitted = |start: SpotEstimate| SpotFit {
        spots: SpotGroup::from_iter([start]),
        spot_px: maps.spot_px,
        ..SpotFit::default()
    };
    let stars = starts.take(MAX_STARS).map(unfitted).collect();
    star_model_in(ROUNDS, maps, stars, buffers)
}

/// Whether a star has about the frame's spot size.
fn has_size_of(maps: &FrameMaps<'_>, fit: &SpotFit) -> bool {
    libm::log(fit.spot_px / maps.spot_px).abs() < libm::log(MODE_WIDTH)
}

/// The noise model with no more shot noise than cameras have.
fn believable(model: NoiseModel, maps: &FrameMaps<'_>) -> NoiseModel {
    let most_adu = f64::from(maps.saturation_adu) / FEWEST_ELECTRONS;
    NoiseModel {
        shot_adu: model.shot_adu.min(most_adu),
        ..model
    }
}

/// The noise model from the residuals of the stars in these windows, with spots of one size. The
/// stars' fits begin, and end, with the estimates given.
pub(crate) fn noise_of(
    stars: &mut [(Window, SpotEstimate)],
    spot_px: f64,
    buffers: &mut FitBuffers,
) -> NoiseModel {
    let mut model = NoiseModel {
        shot_adu: stars.first().map_or(0.0, |(window, _)| window.noise_adu),
        model_error2: 0.0,
    };
    for _ in 0..NOISE_ROUNDS {
        let mut sums = NoiseSums::default();
        let config = FitConfig {
            spot_px,
            free_size: false,
            noise: model,
        };
        for (window, spot) in stars.iter_mut() {
            mem::swap(&mut buffers.window, window);
            let fit = buffers.fitter.fit(&buffers.window, &[*spot], &config);
            if fit.converged {
                *spot = fit.spots[0];
                sums.add_star(buffers, &fit, &config, None);
            }
            mem::swap(&mut buffers.window, window);
        }
        model = sums.solve();
    }
    model
}

/// Sums over pixels for `Σ [r² − (1 − h) v] ∂v / v² = 0`, with `v = n² + shot·m + ε²·m²` and the
/// leverage h, the part of a pixel's variance that the star's own parameters absorb.
///
/// # Reference
/// Davidian & Carroll 1987, J. Am. Stat. Assoc. 82, 1079, doi 10.1080/01621459.1987.10478543:
/// pseudo-likelihood, corrected for leverage.
#[derive(Debug, Default)]
struct NoiseSums {
    /// Σ w m², Σ w m³, Σ w m⁴.
    matrix: [f64; 3],
    /// Σ w m d, Σ w m² d.
    right: [f64; 2],
}

impl NoiseSums {
    /// Adds the pixels of one star in which its light is significant, and all of them to
    /// `elongation`.
    fn add_star(
        &mut self,
        buffers: &mut FitBuffers,
        fit: &SpotFit,
        config: &FitConfig,
        elongation: Option<&mut CommonElongation>,
    ) {
        let FitBuffers { fitter, window, .. } = buffers;
        let Some((factor, spot, pixels)) = fitter.factorised(window, fit, config) else {
            return;
        };
        let per_noise = pixels.per_noise;
        let [a, b, c, p, q] = match spot {
            AnyLight::Gaussian(spot) => {
                if let Some(elongation) = elongation {
                    elongation.add(&spot, fit, &pixels);
                }
                sums_of(&factor, &spot, &pixels)
            }
            AnyLight::Mixture(spot) => sums_of(&factor, &spot, &pixels),
        };
        self.matrix[0] += a * per_noise * per_noise;
        self.matrix[1] += b * per_noise;
        self.matrix[2] += c;
        self.right[0] += p * per_noise;
        self.right[1] += q;
    }

    /// The non-negative solution; the error of the spot model is 0 where chance explains it, and at
    /// most [`MAX_MODEL_ERROR`].
    fn solve(&self) -> NoiseModel {
        let [a, b, c] = self.matrix;
        let [p, q] = self.right;
        let finite = |v: f64| if v.is_finite() { v.max(0.0) } else { 0.0 };
        let noise_model = |shot: f64, error2: f64| NoiseModel {
            shot_adu: finite(shot),
            model_error2: finite(error2).min(MAX_MODEL_ERROR * MAX_MODEL_ERROR),
        };
        let ([shot, error2], determinant) = solve_pair([[a, b], [b, c]], [p, q]);
        if determinant <= 1e-9 * a * c || !determinant.is_finite() {
            return noise_model(0.0, q / c);
        }
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

/// The sums of [`NoiseSums`] over the pixels of one star, in units of the noise.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn sums_of<L: SpotLight>(
    factor: &CholeskyFactor<ONE_SPOT>,
    spot: &L,
    pixels: &WindowPixels,
) -> [f64; 5] {
    let mut sums = [[0.0f32; GROUP_PX]; 5];
    for group in 0..pixels.groups {
        for (row, data) in pixels.column_of_groups(group).enumerate() {
            let light_of_group = spot.in_group(group, row);
            for lane in 0..GROUP_PX {
                let (light, gradient) = linearise(&light_of_group, lane);
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
