//! From a hypothesis that is nearly right to the best camera and attitude, and all the stars that agree.
//!
//! pair up → fit → pair up within a smaller radius → ... with as much lens distortion as the stars support

use super::blends::directions_of_light;
use super::verify::{Hypothesis, Radius};
use super::{Photometry, Sky, StarField, StarMatch};
use crate::attitude::{CameraFit, MeasuredStar, POSE_PARAMETERS, fit_camera, left_out_chi_sq};
use crate::camera::DistortionModel;
use crate::coords::{Icrs, UnitVector};
use crate::statistics::median;
use std::f64::consts::PI;

/// Pairs further apart than so many times the typical error on an axis are no pairs.
const CLIP_SIGMAS: f64 = 5.0;
/// The median distance of errors with standard deviation 1 on each axis (Rayleigh).
const RAYLEIGH_MEDIAN: f64 = 1.177_41;
/// No two stars are told apart by less than this.
const MIN_RADIUS_PX: f64 = 0.25;
/// A distortion model is tried where there are so many equations to each parameter.
const EQUATIONS_PER_PARAMETER: f64 = 4.0;
/// How much likelier (twice the logarithm) a richer model must make the stars left out of the fit to be taken.
const WORTH_IT: f64 = 12.0;
/// With few equations chance does more, as the tails of the F distribution are heavier than those of χ².
const TAIL_EQUATIONS: f64 = 8.0;
/// Residuals exceed the stated errors where their median does so by this many of its standard errors.
const EXCESS_SIGMAS: f64 = 2.0;
/// The relative standard error of the median of n squared distances, times √n: they are distributed exponentially.
const MEDIAN_ERROR: f64 = 1.0 / std::f64::consts::LN_2;
/// Halvings of the interval in which the excess is sought: to a ten-thousandth of the largest residual.
const EXCESS_BISECTIONS: usize = 14;
/// Distance in standard errors from which on a star pulls no harder.
const HUBER_SIGMAS: f64 = 2.5;
/// How much further off than the bright stars faint ones may be.
const FAINT_RADIUS: f64 = 3.0;
/// Farther off than so many times the typical star no star is looked for, however large its error.
const ROUGH_RADIUS: f64 = 5.0;
/// Rounds of fitting to blends: in the first the weights are still those of stars by themselves.
const BLEND_ROUNDS: usize = 2;
/// Rounds of pairing and fitting with all the stars.
const ALL_STARS_ROUNDS: usize = 2;
/// A sceptic wants so many standard deviations more agreement than chance makes.
const SCEPTICAL_SIGMAS: f64 = 3.0;
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

/// Pairs up and fits in turn the `observed_count` brightest stars, starting with pairs within `radius_px`, with
/// distortion models up to `richest` (`None`: no distortion).
///
/// `None` where too few stars agree to determine the camera.
pub fn refine(
    field: &StarField,
    observed_count: usize,
    sky: &Sky,
    start: &Start,
    richest: Option<DistortionModel>,
) -> Option<Refined> {
    let observed = field.brightest(observed_count);
    let hypothesis = start.hypothesis;
    let mut predicted = hypothesis.predict(sky, field, observed);
    let radius = Radius::common(start.radius_px);
    let matches = hypothesis.pair_up(observed, &predicted, field.photometry, &radius);
    if start.sceptical {
        let area_px = field.width_px * field.height_px;
        let discs_px = predicted.len() as f64 * PI * start.radius_px.powi(2);
        let by_chance = observed.len() as f64 * (discs_px / area_px).min(1.0);
        if (matches.len() as f64) < by_chance + SCEPTICAL_SIGMAS * (by_chance + 0.1).sqrt() {
            return None;
        }
    }
    let mut model = hypothesis.camera.distortion_model();
    let mut radius_px = start.radius_px;
    let mut current = fitted(field, sky, matches, 0.0, &Guess { hypothesis, model })?;
    let mut model_chosen = false;
    for _ in 0..MAX_ROUNDS {
        radius_px = next_radius_px(&current.fit, radius_px);
        current.hypothesis.predict_again(&mut predicted);
        let matches = current.hypothesis.pair_up(
            observed,
            &predicted,
            field.photometry,
            &Radius::common(radius_px),
        );
        let settled = same_pairs(&matches, &current.matches);
        if settled && model_chosen {
            break;
        }
        if settled {
            model = choose_model(field, sky, &current, richest);
            model_chosen = true;
        }
        let guess = Guess {
            hypothesis: &current.hypothesis,
            model,
        };
        current = fitted(field, sky, matches, current.excess_sigma_px, &guess)?;
    }
    Some(current)
}

/// Adds the stars that were too faint for the refinement so far, and fits the same distortion model to all of them. Each is
/// looked for as far off as its own error allows: that of the faintest is many times the typical one.
///
/// `None` where they do not determine the camera.
pub fn with_all_stars(field: &StarField, sky: &Sky, settled: &Refined) -> Option<Refined> {
    let model = settled.hypothesis.camera.distortion_model();
    let mut predicted = settled.hypothesis.predict_all(sky, field);
    let mut radius_px = FAINT_RADIUS * agreement_radius_px(&settled.fit);
    let mut current = settled.clone();
    for _ in 0..ALL_STARS_ROUNDS {
        let Refined {
            hypothesis,
            excess_sigma_px,
            ..
        } = &current;
        let radius = Radius {
            common_px: radius_px,
            sigmas: CLIP_SIGMAS * error_scale(field, &current),
            excess_sigma_px: *excess_sigma_px,
            at_most: ROUGH_RADIUS,
        };
        let matches = hypothesis.pair_up(&field.stars, &predicted, field.photometry, &radius);
        if same_pairs(&matches, &current.matches) {
            break;
        }
        let guess = Guess { hypothesis, model };
        current = fitted(field, sky, matches, *excess_sigma_px, &guess)?;
        current.hypothesis.predict_again(&mut predicted);
        radius_px = next_radius_px(&current.fit, radius_px);
    }
    Some(current)
}

/// Fits the same stars again, each where its light is seen together with that of those which the camera does not tell from it.
///
/// `None` where they do not determine the camera.
pub fn with_blends(field: &StarField, sky: &Sky, settled: Refined) -> Option<Refined> {
    let Some(directions) = directions_of_light(field, sky, &settled.hypothesis, &settled.matches)
    else {
        return Some(settled);
    };
    let model = settled.hypothesis.camera.distortion_model();
    let mut current = settled;
    for _ in 0..BLEND_ROUNDS {
        let Refined {
            hypothesis,
            matches,
            excess_sigma_px,
            ..
        } = current;
        let guess = Guess {
            hypothesis: &hypothesis,
            model,
        };
        current = fitted_to(field, sky, matches, (&directions, excess_sigma_px), &guess)?;
    }
    Some(current)
}

/// Where a refinement starts.
pub struct Start<'a> {
    /// The hypothesis.
    pub hypothesis: &'a Hypothesis,
    /// How far true pairs may be apart under it.
    pub radius_px: f64,
    /// Whether to give up at once where no more stars agree than chance would have agree.
    pub sceptical: bool,
}

/// A hypothesis, and the distortion model to fit from there.
struct Guess<'a> {
    hypothesis: &'a Hypothesis,
    model: Option<DistortionModel>,
}

fn fitted(
    field: &StarField,
    sky: &Sky,
    matches: Vec<StarMatch>,
    excess_sigma_px: f64,
    guess: &Guess,
) -> Option<Refined> {
    let directions = catalog_directions(field, sky, &matches);
    fitted_to(field, sky, matches, (&directions, excess_sigma_px), guess)
}

/// The directions of the stars themselves.
fn catalog_directions(
    field: &StarField,
    sky: &Sky,
    matches: &[StarMatch],
) -> Vec<UnitVector<Icrs>> {
    let direction = |m: &StarMatch| sky.stars()[m.catalog].direction_at(field.years_since_j2000);
    matches.iter().map(direction).collect()
}

/// The fit to stars whose light comes from these directions.
fn fitted_to(
    field: &StarField,
    sky: &Sky,
    mut matches: Vec<StarMatch>,
    (directions, excess_sigma_px): (&[UnitVector<Icrs>], f64),
    guess: &Guess,
) -> Option<Refined> {
    let stars = measured(field, &matches, directions, excess_sigma_px);
    let Hypothesis {
        camera,
        icrs_to_camera,
        ..
    } = guess.hypothesis;
    let affordable = guess.model.filter(|m| is_affordable(*m, stars.len()));
    let fit = fit_camera(&stars, camera, icrs_to_camera, affordable)?;
    let excess_sigma_px = excess_sigma_of(field, &matches, &fit);
    for (found, distance) in matches.iter_mut().zip(distances_px(&fit)) {
        found.residual_px = distance;
    }
    Some(Refined {
        hypothesis: Hypothesis {
            camera: fit.camera.clone(),
            icrs_to_camera: fit.icrs_to_camera,
            parameters: fit.parameters,
            zero_point_mag: zero_point_mag(field, sky, &matches),
        },
        fit,
        matches,
        excess_sigma_px,
    })
}

fn same_pairs(a: &[StarMatch], b: &[StarMatch]) -> bool {
    let pair = |m: &StarMatch| (m.observed, m.catalog);
    a.iter().map(pair).eq(b.iter().map(pair))
}

/// The median difference between catalogue and observed magnitudes.
fn zero_point_mag(field: &StarField, sky: &Sky, matches: &[StarMatch]) -> f64 {
    match field.photometry {
        Photometry::JohnsonV => 0.0,
        Photometry::Instrumental => {
            let difference = |m: &StarMatch| {
                f64::from(sky.stars()[m.catalog].v_mag) - field.stars[m.observed].mag
            };
            median(&mut matches.iter().map(difference).collect::<Vec<f64>>())
        }
    }
}

/// The stars as the fit takes them. The error of one that is further off than its own error and the common
/// excess explain (an unresolved companion, say) is raised with its distance, so that it pulls no harder than one that is not
/// (Huber 1964, Ann. Math. Stat. 35, 73).
fn measured(
    field: &StarField,
    matches: &[StarMatch],
    directions: &[UnitVector<Icrs>],
    excess_px: f64,
) -> Vec<MeasuredStar> {
    let measured = |(m, icrs): (&StarMatch, &UnitVector<Icrs>)| {
        let star = &field.stars[m.observed];
        let sigma_px = (star.sigma_px.powi(2) + excess_px.powi(2)).sqrt().max(1e-3);
        let excess = m.residual_px / (HUBER_SIGMAS * sigma_px);
        MeasuredStar {
            pixel: star.position,
            icrs: *icrs,
            sigma_px: sigma_px * excess.max(1.0).sqrt(),
        }
    };
    matches.iter().zip(directions).map(measured).collect()
}

fn is_affordable(model: DistortionModel, stars: usize) -> bool {
    2.0 * stars as f64 >= EQUATIONS_PER_PARAMETER * (model.terms() + POSE_PARAMETERS) as f64
}

/// The simplest model that richer ones do not clearly surpass in predicting stars left out of the fit.
fn choose_model(
    field: &StarField,
    sky: &Sky,
    current: &Refined,
    richest: Option<DistortionModel>,
) -> Option<DistortionModel> {
    let directions = catalog_directions(field, sky, &current.matches);
    let stars = measured(
        field,
        &current.matches,
        &directions,
        current.excess_sigma_px,
    );
    let CameraFit {
        camera,
        icrs_to_camera,
        ..
    } = &current.fit;
    let left_out = |model| left_out_chi_sq(&stars, camera, icrs_to_camera, model);
    let equations = 2.0 * stars.len() as f64;
    let worth_it = WORTH_IT * equations / (equations - TAIL_EQUATIONS).max(1.0);
    let mut best = (None, left_out(None)?);
    for model in DistortionModel::ALL {
        if Some(model) > richest || !is_affordable(model, stars.len()) {
            break;
        }
        match left_out(Some(model)) {
            Some(chi_sq) if equations * (best.1 / chi_sq).ln() > worth_it => {
                best = (Some(model), chi_sq);
            }
            // The quintic is not tried where the cubic is no better than what is simpler.
            _ if model == DistortionModel::Cubic => break,
            _ => {}
        }
    }
    best.0
}

fn distances_px(fit: &CameraFit) -> Vec<f64> {
    fit.residuals_px
        .iter()
        .map(|[x, y]| (x * x + y * y).sqrt())
        .collect()
}

/// What the stated errors must be multiplied by to be those that the residuals show: at most 1, as the excess is one of them.
fn error_scale(field: &StarField, current: &Refined) -> f64 {
    let relative = |m: &StarMatch| {
        let sigma_px = field.stars[m.observed]
            .sigma_px
            .hypot(current.excess_sigma_px);
        m.residual_px / sigma_px.max(1e-3)
    };
    let mut relative: Vec<f64> = current.matches.iter().map(relative).collect();
    (median(&mut relative) / RAYLEIGH_MEDIAN).min(1.0)
}

/// The radius that holds practically all true pairs, by the typical residual of this fit.
fn agreement_radius_px(fit: &CameraFit) -> f64 {
    let sigma_px = median(&mut distances_px(fit)) / RAYLEIGH_MEDIAN;
    (CLIP_SIGMAS * sigma_px).max(MIN_RADIUS_PX)
}

/// The same, but no larger than before and not so much smaller that a bad fit would throw good pairs away.
fn next_radius_px(fit: &CameraFit, before_px: f64) -> f64 {
    agreement_radius_px(fit).clamp(before_px / 4.0, before_px)
}

/// What must be added to the stated errors so that the residuals' median is as expected, in pixels; nothing where chance
/// explains that they are larger. The better measured half of the stars tells: what is to be added shows in them, and the faintest
/// were found where noise made them bright, and moved them.
fn excess_sigma_of(field: &StarField, matches: &[StarMatch], fit: &CameraFit) -> f64 {
    let equations = 2.0 * matches.len() as f64;
    let free = (equations - fit.parameters as f64).max(1.0) / equations.max(1.0);
    let expected_sq = RAYLEIGH_MEDIAN.powi(2) * free;
    let stated_sq = |m: &StarMatch| field.stars[m.observed].sigma_px.powi(2);
    let worst_sq = median(&mut matches.iter().map(stated_sq).collect::<Vec<f64>>());
    let squares: Vec<(f64, f64)> = fit
        .residuals_px
        .iter()
        .zip(matches)
        .map(|([x, y], m)| (x * x + y * y, stated_sq(m)))
        .filter(|(_, stated_sq)| *stated_sq <= worst_sq)
        .collect();
    let mut scaled = Vec::with_capacity(squares.len());
    let mut median_sq = |excess_sq: f64| {
        scaled.clear();
        scaled.extend(squares.iter().map(|(d, s)| d / (s + excess_sq).max(1e-6)));
        median(&mut scaled)
    };
    let chance = EXCESS_SIGMAS * MEDIAN_ERROR / (squares.len().max(1) as f64).sqrt();
    if median_sq(0.0) <= expected_sq * (1.0 + chance) {
        return 0.0;
    }
    let largest_sq = squares.iter().fold(1e-6, |a: f64, s| a.max(s.0));
    let (mut low, mut high) = (0.0, largest_sq.sqrt() * 2.0);
    for _ in 0..EXCESS_BISECTIONS {
        let middle = 0.5 * (low + high);
        if median_sq(middle * middle) > expected_sq {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}
