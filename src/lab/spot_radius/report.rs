//! The results of a study as plain values, with their units in the names.

use super::noise::Noise;
use super::plan::DefocusPlan;
use super::star::{DefocusStar, PredictedError, RadiusPoint, StarStudy};
use super::surface::{ClosedFormReport, SurfaceReport};
use crate::lab::defocus::{Centroiding, DefocusLens, ErrorCurve, IsoLine, Optimum, Parabola};
use serde::Serialize;

/// The results of a study.
#[derive(Debug, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct DefocusReport {
    pub schema: u32,
    pub normalisation: &'static str,
    pub centroid: Centroiding,
    pub trials: usize,
    pub seed: u64,
    pub noise: Noise,
    pub noise_unit: &'static str,
    pub radii_px: [f64; 2],
    pub radii: usize,
    pub noises: [f64; 2],
    pub noise_count: usize,
    pub lens: Option<DefocusLens>,
    pub stars: Vec<DefocusStarReport>,
}

/// The results of one star. Unless a noise is named they hold at the noise of the study.
#[derive(Debug, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct DefocusStarReport {
    pub vmag: Option<f64>,
    pub peak: Option<f64>,
    pub best: BestRadius,
    pub required: Vec<RequiredError>,
    pub present: Option<SpotRadius>,
    pub curve: Vec<CurveRow>,
    pub best_by_noise: Vec<BestAtNoise>,
    pub best_as_parabola: Option<Parabola>,
    pub equal_error: Vec<IsoLine>,
    pub surface: SurfaceReport,
    pub closed_form: Option<ClosedFormReport>,
}

/// A radius in all units, and its error.
#[derive(Debug, Clone, Copy, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct SpotRadius {
    pub radius_px: f64,
    pub radius_um: Option<f64>,
    pub defocus_um: Option<f64>,
    pub error_px: f64,
}

/// The radius with the least error.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct BestRadius {
    /// The radius.
    #[serde(flatten)]
    pub radius: SpotRadius,
    /// Between these radii the error is at most 5 % larger.
    pub nearly_px: [f64; 2],
    /// Whether it is the first or the last radius: a better one may lie beyond.
    pub is_at_edge: bool,
}

/// The radii that meet a required error.
#[derive(Debug, Clone, Copy, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct RequiredError {
    pub required_error_px: f64,
    pub smallest: Option<SpotRadius>,
    pub largest: Option<SpotRadius>,
    pub is_at_edge: [bool; 2],
}

/// The best radius at one noise.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct BestAtNoise {
    /// The noise.
    pub noise: f64,
    /// The radius; none where too few stars were found.
    #[serde(flatten)]
    pub best: Option<Optimum>,
}

/// The error at one radius: a row of curve.csv.
#[derive(Debug, Clone, Copy, Serialize)]
#[expect(missing_docs, reason = "docs/json.md describes the fields")]
pub struct CurveRow {
    pub vmag: Option<f64>,
    pub radius_px: f64,
    pub error_px: Option<f64>,
    pub error_sigma_px: Option<f64>,
    pub trials: usize,
    pub found: usize,
    pub smooth_error_px: Option<f64>,
    pub expected_px: Option<f64>,
    pub bias_px: Option<f64>,
    pub bound_px: Option<f64>,
    pub limit_vmag: Option<f64>,
    pub peak_of_full_well: Option<f64>,
}

/// The error at one point of the grid: a row of grid.csv.
#[derive(Debug, Serialize)]
pub struct GridRow {
    vmag: Option<f64>,
    radius_px: f64,
    noise_relative: Option<f64>,
    noise_e: Option<f64>,
    error_px: Option<f64>,
    error_sigma_px: Option<f64>,
    trials: usize,
    found: usize,
    expected_px: Option<f64>,
    sampled_px: Option<f64>,
    surface_px: Option<f64>,
}

impl DefocusReport {
    /// The report of `plan`, of which `studies` are the results.
    pub fn new(plan: &DefocusPlan, studies: &[StarStudy]) -> Self {
        let (spots, noises) = (&plan.grid.spots_px, &plan.grid.noises);
        let ends = |values: &[f64]| [values[0], values[values.len() - 1]];
        let (normalisation, centroid, noise_unit) = match &plan.stars[0] {
            DefocusStar::Peak(_) => ("peak", Centroiding::FixedWindow, "part of full scale"),
            DefocusStar::Energy(study) => ("energy", study.centroiding, "e"),
        };
        let stars = studies
            .iter()
            .map(|study| DefocusStarReport::new(plan, study));
        Self {
            schema: 1,
            normalisation,
            centroid,
            trials: plan.stars[0].trials(),
            seed: plan.seed,
            noise: plan.noise.clone(),
            noise_unit,
            radii_px: ends(spots),
            radii: spots.len(),
            noises: ends(noises),
            noise_count: noises.len(),
            lens: plan.lens,
            stars: stars.collect(),
        }
    }

    /// Whether every required error is met by some radius.
    pub fn is_met(&self) -> bool {
        let mut required = self.stars.iter().flat_map(|star| &star.required);
        required.all(|required| required.smallest.is_some())
    }
}

impl DefocusStarReport {
    fn new(plan: &DefocusPlan, study: &StarStudy) -> Self {
        let curve = &study.curve;
        let optimum = curve.optimum();
        let at = |radius_px: f64| SpotRadius::new(radius_px, curve.at(radius_px), plan.lens);
        let [first, last] = curve.range_px();
        let present = plan.present_px.filter(|px| (first..=last).contains(px));
        let required = plan.required_px.iter();
        let best_by_noise = best_by_noise(plan, study);
        let peak = match &study.star {
            DefocusStar::Peak(study) => Some(study),
            DefocusStar::Energy(_) => None,
        };
        let closed_form = peak.zip(study.expected.as_deref());
        Self {
            vmag: study.star.v_mag(),
            peak: peak.map(|study| study.peak),
            best: BestRadius {
                radius: SpotRadius::new(optimum.spot_px, optimum.rms_px, plan.lens),
                nearly_px: optimum.nearly_px,
                is_at_edge: optimum.is_at_edge,
            },
            required: required
                .map(|&px| RequiredError::new(px, curve, at))
                .collect(),
            present: present.map(at),
            curve: study
                .points
                .iter()
                .map(|point| CurveRow::new(study, point))
                .collect(),
            best_as_parabola: best_as_parabola(&best_by_noise),
            best_by_noise,
            equal_error: study.isolines.clone(),
            surface: SurfaceReport::new(study),
            closed_form: closed_form.map(|(peak, expected)| {
                ClosedFormReport::new(peak.trials, expected, &study.errors)
            }),
        }
    }
}

fn best_by_noise(plan: &DefocusPlan, study: &StarStudy) -> Vec<BestAtNoise> {
    let noises = plan.grid.noises.iter().zip(&study.curves);
    let best = noises.map(|(&noise, curve)| BestAtNoise {
        noise,
        best: curve.as_ref().map(ErrorCurve::optimum),
    });
    best.collect()
}

/// Through the best radii that are not at the edge of the grid.
fn best_as_parabola(best_by_noise: &[BestAtNoise]) -> Option<Parabola> {
    let inside = best_by_noise.iter().filter_map(|at| {
        let best = at.best.filter(|best| !best.is_at_edge)?;
        Some((at.noise, best.spot_px))
    });
    Parabola::nearest_to(&inside.collect::<Vec<_>>())
}

impl SpotRadius {
    fn new(radius_px: f64, error_px: f64, lens: Option<DefocusLens>) -> Self {
        Self {
            radius_px,
            radius_um: lens.map(|lens| lens.spot_um(radius_px)),
            defocus_um: lens.and_then(|lens| lens.distance_um(radius_px)),
            error_px,
        }
    }
}

impl RequiredError {
    /// `at` describes a radius in pixels.
    fn new(required_error_px: f64, curve: &ErrorCurve, at: impl Fn(f64) -> SpotRadius) -> Self {
        let [first, last] = curve.range_px();
        let smallest_px = curve.smallest_within(required_error_px);
        let largest_px = curve.largest_within(required_error_px);
        Self {
            required_error_px,
            smallest: smallest_px.map(&at),
            largest: largest_px.map(&at),
            is_at_edge: [smallest_px == Some(first), largest_px == Some(last)],
        }
    }
}

impl CurveRow {
    fn new(study: &StarStudy, at: &RadiusPoint) -> Self {
        let (expected, reach) = match &at.theory {
            PredictedError::Expected(expected) => (Some(expected), None),
            PredictedError::Reach(reach) => (None, Some(reach)),
        };
        let [first, last] = study.curve.range_px();
        let is_inside = (first..=last).contains(&at.spot_px);
        Self {
            vmag: study.star.v_mag(),
            radius_px: at.spot_px,
            error_px: finite(at.point.rms_px),
            error_sigma_px: finite(at.point.rms_sigma_px),
            trials: at.point.trials,
            found: at.point.found,
            smooth_error_px: is_inside.then(|| study.curve.at(at.spot_px)),
            expected_px: expected.map(|expected| expected.rms_px),
            bias_px: expected.map(|expected| expected.bias_px),
            bound_px: reach.map(|reach| reach.bound_px),
            limit_vmag: reach.and_then(|reach| reach.limit_vmag),
            peak_of_full_well: reach.map(|reach| reach.peak_part),
        }
    }
}

impl GridRow {
    /// The rows of a star, one for each point of the grid.
    pub fn rows(study: &StarStudy) -> impl Iterator<Item = Self> {
        let is_peak = matches!(study.star, DefocusStar::Peak(_));
        let points = study.errors.rows().enumerate();
        points.map(move |(number, (radius_px, noise, point))| Self {
            vmag: study.star.v_mag(),
            radius_px,
            noise_relative: is_peak.then_some(noise),
            noise_e: (!is_peak).then_some(noise),
            error_px: finite(point.rms_px),
            error_sigma_px: finite(point.rms_sigma_px),
            trials: point.trials,
            found: point.found,
            expected_px: study.expected.as_ref().map(|all| all[number].rms_px),
            sampled_px: study.sampled.as_ref().map(|all| all[number].rms_px),
            surface_px: study.surface.as_ref().ok().map(|s| s.at(radius_px, noise)),
        })
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
