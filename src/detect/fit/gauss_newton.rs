//! One Gauss-Newton step of a fit: solution of the normal equations, convergence, standard errors.

use super::normal::NormalEquations;
use super::parameters::{FitConfig, ONE_SPOT, SPOT_RANGE_PX, SpotEstimate, SpotFit};
use super::window::Window;

/// Maximum number of steps of a fit.
pub(super) const MAX_STEPS: usize = 15;
/// Maximum length of a step, in px: the model is not linear beyond it.
const MAX_STEP_PX: f64 = 0.5;
/// After so many steps of a fit of spots of known size, one of that length says that it jumps to and
/// fro, or goes astray.
const PATIENCE: usize = MAX_STEPS / 2;

/// A fit has converged when its step is short.
struct Convergence;

impl Convergence {
    /// Steps shorter than this, in px, end the fit. Convergence is quadratic, so little is left
    /// after one.
    const STEP_PX: f64 = 2e-3;
    /// So do steps shorter than this fraction of the standard error: at most a fifth of it is left,
    const STEP_SIGMA: f64 = 0.1;
    /// but not longer than this, in px: sharp spots are far from linear.
    const MAX_STEP_PX: f64 = 0.02;
    /// The same where the size is free: the flux depends on it, most where the core is saturated.
    const MAX_STEP_FREE_SIZE_PX: f64 = 0.005;
    /// The first step ends the fit only where it changes the flux by less than this fraction,
    /// because the weights follow from the flux.
    const FLUX_CHANGE: f64 = 0.02;

    /// Steps shorter than this end the fit, in px; `information` is the inverse variance of the
    /// best known coordinate.
    fn step_px(information: f64, config: &FitConfig) -> f64 {
        let longest = if config.free_size {
            Self::MAX_STEP_FREE_SIZE_PX
        } else {
            Self::MAX_STEP_PX
        };
        (Self::STEP_SIGMA / information.sqrt()).clamp(Self::STEP_PX, longest)
    }
}

/// Result of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StepOutcome {
    /// Another step is needed.
    Continue,
    /// The step was short: the fit is complete.
    Converged,
    /// The equations have no solution, or lead away from the initial guess.
    Failed,
}

/// Adds the background map as a measurement of the background.
pub(super) fn add_background_map<const N: usize>(
    normal: &mut NormalEquations<N>,
    window: &Window,
    fit: &SpotFit,
) {
    let b = 3 * fit.spots.len();
    let weight = 1.0 / (window.background_error * window.background_error);
    normal.matrix[b][b] += weight;
    normal.right[b] -= weight * fit.background;
    normal.chi2 += weight * fit.background * fit.background;
}

/// Whether a step of so many spots needs no derivatives by the size: the first is hardly ever the last, so that
/// the size's excess is not needed.
pub(super) fn is_rough(step: usize, spots: usize, config: &FitConfig) -> bool {
    step == 0 && spots == 1 && !config.free_size
}

/// Solves the equations at `fit` and takes step number `step`; completes the fit if it converged.
pub(super) fn advance<const N: usize>(
    fit: &mut SpotFit,
    start: &[SpotEstimate],
    normal: &mut NormalEquations<N>,
    step: usize,
    config: &FitConfig,
) -> StepOutcome {
    let fitted = config.parameter_count(start.len());
    let is_rough = is_rough(step, start.len(), config);
    let tests_size = start.len() == 1 && !is_rough;
    let all = fitted.max(if tests_size { ONE_SPOT } else { 0 });
    let information = (0..start.len()).flat_map(|i| [3 * i, 3 * i + 1]);
    let information = information.map(|i| normal.matrix[i][i]).fold(0.0, f64::max);
    let known = normal.factorise(all);
    if known < fitted {
        return StepOutcome::Failed;
    }
    let change = normal.solve(fitted);
    // The step lowers chi² by its scalar product with the right-hand side.
    let gain: f64 = (0..fitted).map(|i| change[i] * normal.right[i]).sum();
    fit.chi2 = normal.chi2 - gain;
    let is_flux_settled = (0..start.len())
        .all(|i| change[3 * i + 2].abs() <= Convergence::FLUX_CHANGE * fit.spots[i].flux.abs());
    let length = apply(fit, &change, config);
    let is_jumping = !config.free_size && step >= PATIENCE && length >= MAX_STEP_PX;
    if is_jumping || has_strayed(fit, start, config) {
        return StepOutcome::Failed;
    }
    let is_short = length < Convergence::step_px(information, config);
    if is_short && (step > 0 || is_flux_settled) && !is_rough {
        fit.converged = true;
        finish(fit, normal, fitted, known);
        return StepOutcome::Converged;
    }
    StepOutcome::Continue
}

/// Whether a spot is farther from its initial position than its width, or its flux is not finite.
fn has_strayed(fit: &SpotFit, start: &[SpotEstimate], config: &FitConfig) -> bool {
    let reach2 = (1.0 + config.spot_px).powi(2);
    fit.spots.iter().zip(start).any(|(now, then)| {
        let distance2 = (now.x - then.x).powi(2) + (now.y - then.y).powi(2);
        !(distance2 <= reach2 && now.flux.is_finite())
    })
}

/// Adds a step, shortened to [`MAX_STEP_PX`]; returns the length of the longest full move in px.
fn apply(fit: &mut SpotFit, change: &[f64], config: &FitConfig) -> f64 {
    let spots = fit.spots.len();
    let squares = (0..spots).map(|i| change[3 * i].powi(2) + change[3 * i + 1].powi(2));
    let mut length = squares.fold(0.0, f64::max).sqrt();
    let factor = (MAX_STEP_PX / length).min(1.0);
    for (i, spot) in fit.spots.iter_mut().enumerate() {
        spot.x += factor * change[3 * i];
        spot.y += factor * change[3 * i + 1];
        spot.flux += factor * change[3 * i + 2];
    }
    fit.background += factor * change[3 * spots];
    if config.free_size {
        let size = (fit.spot_px + factor * change[3 * spots + 1])
            .clamp(0.6 * fit.spot_px, 1.6 * fit.spot_px)
            .clamp(SPOT_RANGE_PX.0, SPOT_RANGE_PX.1);
        length = length.max((size - fit.spot_px).abs());
        fit.spot_px = size;
    }
    length
}

/// Sets standard errors and the size's excess from the last linearised step.
///
/// `fitted` parameters were fitted; of these and the size, the first `known` are determined.
pub(super) fn finish<const N: usize>(
    fit: &mut SpotFit,
    normal: &NormalEquations<N>,
    fitted: usize,
    known: usize,
) {
    let spots = fit.spots.len();
    let all = 3 * spots + 2;
    fit.degrees_of_freedom = normal.pixels as f64 + 2.0 - all as f64;
    let variances = if known >= fitted {
        normal.variances(fitted)
    } else {
        [f64::INFINITY; N]
    };
    for (i, spot) in fit.spots.iter_mut().enumerate() {
        spot.sigma_x = variances[3 * i].sqrt();
        spot.sigma_y = variances[3 * i + 1].sqrt();
        spot.sigma_flux = variances[3 * i + 2].sqrt();
        spot.noise_flux = spot.sigma_flux;
    }
    fit.sigma_spot_px = variances[all - 1].sqrt();
    // The size comes last: the leading block of the factor is that of a fit without it.
    if known == all {
        fit.size_excess_px = normal.solve_last(all);
        fit.size_error_px = normal.inverse[all - 1].sqrt();
    }
}
