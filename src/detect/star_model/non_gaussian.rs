//! Whether a frame's stars depart from round Gaussians of one size: cheap tests that decide whether
//! their PSF is measured.

use super::spot_size::{MODE_WIDTH, weighted_size};
use crate::base::size::Size;
use crate::detect::fit::{GaussianLight, NoiseModel, SpotFit, WindowPixels};
use crate::detect::psf::{FieldFrame, GROUP_PX};

/// Smallest log axis ratio that counts as elongated.
const MIN_ELONGATION: f64 = 0.06;
/// Nor are smaller ones that there are in the corners alone.
const MIN_ELONGATION_IN_CORNER: f64 = 2.0 * MIN_ELONGATION;
/// The form of sharper spots is lost in the pixels, in pixels,
const MIN_SPOT_PX: f64 = 0.65;
/// unless they are elongated by more than this.
const MIN_ELONGATION_OF_SHARP: f64 = 0.3;
/// Smallest error of the spot model that counts, relative to the light.
const MIN_MODEL_ERROR: f64 = 0.015;
/// Nor is a smaller scatter of the sizes, relative to the size.
const MIN_SIZE_SCATTER: f64 = 0.04;
/// A departure below this many standard errors is chance.
const SIGNIFICANT_SIGMA: f64 = 5.0;

/// The elongation that most stars share, and that which grows with the square of the distance from
/// the centre, radially or across (astigmatism), from the residuals of fits of round spots: score
/// tests.
#[derive(Debug, Clone, Copy)]
pub(super) struct CommonElongation {
    field: FieldFrame,
    /// Of `[e₁, e₂]` as in [`SpotMoments`](crate::detect::psf::SpotMoments): sums of
    /// residual times derivative, and of the squares of the derivatives, over the variance.
    sums: [[f64; 2]; 2],
    /// The same of the radial elongation in the corner.
    radial: [f64; 2],
}

impl CommonElongation {
    /// Nothing is known of the stars in a frame of this size.
    pub fn new(size: Size) -> Self {
        Self {
            field: FieldFrame::new(size),
            sums: [[0.0; 2]; 2],
            radial: [0.0; 2],
        }
    }

    /// Adds the pixels of a star, whose fit is given.
    #[allow(
        clippy::needless_range_loop,
        reason = "lanes of several arrays read best as indices"
    )]
    pub fn add(&mut self, light: &GaussianLight<'_>, fit: &SpotFit, pixels: &WindowPixels<'_>) {
        let [across, down] = light.axes;
        let mut sums = [[0.0f32; 2]; 2];
        let sigma = fit.spot_px as f32;
        for group in 0..pixels.groups {
            let across = across.group(group);
            for (row, data) in pixels.column_of_groups(group).enumerate() {
                let down = down.pixel(row);
                for lane in 0..GROUP_PX {
                    if data[lane].is_nan() {
                        continue;
                    }
                    let a = across.lane(lane);
                    let share = light.flux * a.value * down.value;
                    let residual = data[lane] - share - pixels.background;
                    let weight = 1.0 / pixels.variance(share);
                    let scale = light.flux * sigma;
                    let by_e1 = 0.5 * scale * (a.by_sigma * down.value - a.value * down.by_sigma);
                    let by_e2 = scale * sigma * a.by_center * down.by_center;
                    for (sums, by) in sums.iter_mut().zip([by_e1, by_e2]) {
                        sums[0] += weight * by * residual;
                        sums[1] += weight * by * by;
                    }
                }
            }
        }
        let [_, x, y, ..] = self.field.terms(fit.spots[0].x, fit.spots[0].y);
        for (part, [score, information]) in [x * x - y * y, 2.0 * x * y].into_iter().zip(sums) {
            self.radial[0] += part * f64::from(score);
            self.radial[1] += part * part * f64::from(information);
        }
        for (sums, of_star) in self.sums.iter_mut().zip(sums) {
            for (sum, of_star) in sums.iter_mut().zip(of_star) {
                *sum += f64::from(of_star);
            }
        }
    }

    /// Whether it is certain, and above a limit.
    fn exceeds(&self, limit: f64) -> bool {
        let [e1, e2] = self.sums.map(|[score, information]| score / information);
        let information = self.sums[0][1].min(self.sums[1][1]);
        let e = libm::hypot(e1, e2);
        e > limit && e > SIGNIFICANT_SIGMA / information.sqrt()
    }

    /// Whether it grows from the centre, for certain.
    fn grows(&self) -> bool {
        let [score, information] = self.radial;
        let in_corner = (score / information).abs();
        in_corner > MIN_ELONGATION_IN_CORNER && in_corner > SIGNIFICANT_SIGMA / information.sqrt()
    }
}

/// Whether the stars depart from round Gaussians of one size. `stars` have free sizes.
pub(super) fn are_non_gaussian(
    elongation: &CommonElongation,
    noise: &NoiseModel,
    stars: &[SpotFit],
    spot_px: f64,
) -> bool {
    if elongation.exceeds(MIN_ELONGATION_OF_SHARP) {
        return true;
    }
    let is_misfitted = noise.model_error2 > MIN_MODEL_ERROR * MIN_MODEL_ERROR;
    let has_form = || {
        is_misfitted
            || elongation.exceeds(MIN_ELONGATION)
            || elongation.grows()
            || have_scattered_sizes(stars, spot_px)
    };
    spot_px > MIN_SPOT_PX && has_form()
}

/// Whether the sizes of stars differ by more than their errors.
fn have_scattered_sizes(stars: &[SpotFit], spot_px: f64) -> bool {
    /// Sizes beyond this factor of the frame's are not of stars.
    const MAX_FACTOR: f64 = MODE_WIDTH * MODE_WIDTH;
    let is_star = |fit: &&SpotFit| libm::log(fit.spot_px / spot_px).abs() < libm::log(MAX_FACTOR);
    let stars = stars.iter().filter(is_star);
    let scatter = MIN_SIZE_SCATTER * spot_px;
    let Some(mean_px) = weighted_size(stars.clone()) else {
        return false;
    };
    let squares = stars.map(|fit| {
        let variance = fit.sigma_spot_px.powi(2) + scatter * scatter;
        (fit.spot_px - mean_px).powi(2) / variance
    });
    let (chi2, count) = squares.fold((0.0, 0.0), |(sum, n), square| (sum + square, n + 1.0));
    let freedom: f64 = count - 1.0;
    chi2 > freedom + SIGNIFICANT_SIGMA * (2.0 * freedom).sqrt()
}
