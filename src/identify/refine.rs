//! From a hypothesis that is nearly right to the best camera and attitude, and all the stars that agree.
//!
//! pair up → fit → pair up within a smaller radius → ... with as much lens distortion as the stars support

use super::verify::Hypothesis;
use super::{Photometry, Sky, StarField, StarMatch};
use crate::attitude::{CameraFit, MeasuredStar, fit_camera};
use crate::camera::DistortionModel;

/// Pairs further apart than so many times the typical distance are no pairs.
const CLIP: f64 = 3.5;
/// The median distance of errors with standard deviation 1 on each axis (Rayleigh).
const RAYLEIGH_MEDIAN: f64 = 1.177_41;
/// No two stars are told apart by less than this.
const MIN_RADIUS_PX: f64 = 0.25;
/// A distortion model is tried where there are so many equations to each parameter.
const EQUATIONS_PER_PARAMETER: f64 = 2.5;
/// A richer model must lower the left-out χ² to this share to be taken.
const WORTH_IT: f64 = 0.9;
/// Rounds of pairing and fitting at the most.
const MAX_ROUNDS: usize = 8;

/// A fitted hypothesis and what agrees with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Refined {
    /// Camera and attitude.
    pub hypothesis: Hypothesis,
    /// The fit behind them.
    pub fit: CameraFit,
    /// The stars that agree.
    pub matches: Vec<StarMatch>,
    /// Standard deviation on each axis, in pixels, that must be added to the stated centroid errors to explain the residuals.
    pub excess_sigma_px: f64,
}

/// Pairs up and fits in turn, starting with pairs within `radius_px`, with distortion models up to `richest`
/// (`None`: no distortion); `None` where too few stars agree to determine the camera.
pub fn refine(
    field: &StarField,
    observed_count: usize,
    sky: &Sky,
    start: &Hypothesis,
    radius_px: f64,
    richest: Option<DistortionModel>,
) -> Option<Refined> {
    let observed = &field.stars[..observed_count.min(field.stars.len())];
    let mut hypothesis = start.clone();
    let mut radius_px = radius_px;
    let mut excess_px = 0.0;
    let mut last: Option<Refined> = None;
    for _ in 0..MAX_ROUNDS {
        let predicted = hypothesis.predict(sky, observed, field.photometry);
        let matches = hypothesis.pair_up(observed, &predicted, field.photometry, radius_px);
        let stars = measured(field, sky, &matches, excess_px);
        let fit = best_fit(&stars, &hypothesis, richest)?;
        excess_px = excess_sigma_px(field, &matches, &fit);
        hypothesis = Hypothesis {
            camera: fit.camera.clone(),
            icrs_to_camera: fit.icrs_to_camera,
            parameters: fit.parameters,
            zero_point_mag: zero_point_mag(field, sky, &matches),
        };
        let settled = last.as_ref().is_some_and(|l| same_pairs(&l.matches, &matches));
        radius_px = radius_px.min(agreement_radius_px(&fit, radius_px));
        last = Some(with_residuals(hypothesis.clone(), fit, matches, excess_px));
        if settled {
            break;
        }
    }
    last
}

fn same_pairs(a: &[StarMatch], b: &[StarMatch]) -> bool {
    let pair = |m: &StarMatch| (m.observed, m.catalog);
    a.iter().map(pair).eq(b.iter().map(pair))
}

/// The median difference between catalogue and observed magnitudes.
fn zero_point_mag(field: &StarField, sky: &Sky, matches: &[StarMatch]) -> f64 {
    match field.photometry {
        Photometry::JohnsonV => 0.0,
        Photometry::Instrumental => median(
            matches
                .iter()
                .map(|m| f64::from(sky.stars()[m.catalog].v_mag) - field.stars[m.observed].mag)
                .collect(),
        ),
    }
}

fn measured(
    field: &StarField,
    sky: &Sky,
    matches: &[StarMatch],
    excess_px: f64,
) -> Vec<MeasuredStar> {
    let measured = |m: &StarMatch| {
        let star = &field.stars[m.observed];
        MeasuredStar {
            pixel: star.position,
            icrs: sky.stars()[m.catalog].direction,
            sigma_px: star.sigma_px.hypot(excess_px).max(1e-3),
        }
    };
    matches.iter().map(measured).collect()
}

/// The simplest fit that richer models do not clearly surpass in predicting stars left out of it.
fn best_fit(
    stars: &[MeasuredStar],
    start: &Hypothesis,
    richest: Option<DistortionModel>,
) -> Option<CameraFit> {
    let fit = |model| fit_camera(stars, &start.camera, &start.icrs_to_camera, model);
    let mut best = fit(None)?;
    for model in DistortionModel::ALL {
        let parameters = model.terms() + best.covariance.nrows();
        let affordable = 2.0 * stars.len() as f64 >= EQUATIONS_PER_PARAMETER * parameters as f64;
        if Some(model) > richest || !affordable {
            break;
        }
        if let Some(richer) = fit(Some(model))
            && richer.left_out_chi_sq < WORTH_IT * best.left_out_chi_sq
        {
            best = richer;
        }
    }
    Some(best)
}

fn distances_px(fit: &CameraFit) -> Vec<f64> {
    fit.residuals_px.iter().map(|[x, y]| x.hypot(*y)).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The radius that holds practically all true pairs, by the typical residual of this fit.
fn agreement_radius_px(fit: &CameraFit, before_px: f64) -> f64 {
    let sigma_px = median(distances_px(fit)) / RAYLEIGH_MEDIAN;
    (CLIP * sigma_px * 1.5).max(MIN_RADIUS_PX).max(before_px / 4.0)
}

/// What must be added to the stated errors so that the residuals' median is as expected.
fn excess_sigma_px(field: &StarField, matches: &[StarMatch], fit: &CameraFit) -> f64 {
    let free = (2.0 * matches.len() as f64 - fit.parameters as f64).max(1.0)
        / (2.0 * matches.len() as f64).max(1.0);
    let distances = distances_px(fit);
    let typical = |excess_px: f64| {
        let scaled = distances.iter().zip(matches).map(|(d, m)| {
            d / field.stars[m.observed].sigma_px.hypot(excess_px).max(1e-3)
        });
        median(scaled.collect()) / (RAYLEIGH_MEDIAN * free.sqrt())
    };
    if typical(0.0) <= 1.0 {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, distances.iter().fold(1e-3, |a: f64, &b| a.max(b)) * 2.0);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if typical(middle) > 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

fn with_residuals(
    hypothesis: Hypothesis,
    fit: CameraFit,
    mut matches: Vec<StarMatch>,
    excess_sigma_px: f64,
) -> Refined {
    for (found, distance) in matches.iter_mut().zip(distances_px(&fit)) {
        found.residual_px = distance;
    }
    Refined {
        hypothesis,
        fit,
        matches,
        excess_sigma_px,
    }
}
