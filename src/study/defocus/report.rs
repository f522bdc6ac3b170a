//! The results of a study as plain values, with their units in the names.

use super::noise::Noise;
use super::plan::Plan;
use super::star::{RadiusPoint, StarModel, StarStudy, Theory};
use super::surface::{ClosedFormReport, SurfaceReport};
use crate::model::defocus::{Centroiding, ErrorCurve, IsoLine, Lens, Optimum, Parabola};
use serde::Serialize;

/// The results of a study.
#[derive(Debug, Serialize)]
pub struct DefocusReport {
    /// Version of these fields.
    pub schema: u32,
    /// What all spots have in common: `peak` or `energy`.
    pub normalisation: &'static str,
    /// How centroids are measured.
    pub centroid: Centroiding,
    /// Trials at each point of the grid.
    pub trials: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// The noise for which radii are reported.
    pub noise: Noise,
    /// Unit of `noises` and of each `noise` of the stars.
    pub noise_unit: &'static str,
    /// First and last radius of the grid.
    pub radii_px: [f64; 2],
    /// Number of radii.
    pub radii: usize,
    /// First and last noise of the grid.
    pub noises: [f64; 2],
    /// Number of noises.
    pub noise_count: usize,
    /// The lens, if there is a camera.
    pub lens: Option<Lens>,
    /// One report for each star.
    pub stars: Vec<StarReport>,
}

/// The results of one star. Unless a noise is named they hold at the noise of the study.
#[derive(Debug, Serialize)]
pub struct StarReport {
    /// Johnson V, if the star's light is given.
    pub vmag: Option<f64>,
    /// Brightest pixel as a part of full scale, if that is given.
    pub peak: Option<f64>,
    /// The radius with the least error.
    pub best: BestRadius,
    /// The radii that meet each required error.
    pub required: Vec<RequiredError>,
    /// The camera's spot as it is.
    pub present: Option<SpotRadius>,
    /// Errors over the radius.
    pub curve: Vec<CurveRow>,
    /// The best radius at each noise of the grid.
    pub best_by_noise: Vec<BestAtNoise>,
    /// Best radius over noise, without those at the edge of the grid.
    pub best_as_parabola: Option<Parabola>,
    /// Lines of equal error.
    pub equal_error: Vec<IsoLine>,
    /// The surface through the errors.
    pub surface: SurfaceReport,
    /// Comparison with the closed form, if there is one.
    pub closed_form: Option<ClosedFormReport>,
}

/// A radius in all units, and its error.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct SpotRadius {
    /// In pixels.
    pub radius_px: f64,
    /// In µm, if there is a lens.
    pub radius_um: Option<f64>,
    /// Distance from the focus, by geometric blur; none if the spot in focus is wider.
    pub defocus_um: Option<f64>,
    /// Error of the centroid.
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
pub struct RequiredError {
    /// The required error.
    pub required_error_px: f64,
    /// The smallest radius; none if no radius meets the error.
    pub smallest: Option<SpotRadius>,
    /// The largest radius; none if no radius meets the error.
    pub largest: Option<SpotRadius>,
    /// Whether the first and the last radius meet it: smaller or larger ones may as well.
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
pub struct CurveRow {
    /// Johnson V of the star.
    pub vmag: Option<f64>,
    /// The radius.
    pub radius_px: f64,
    /// Measured error, root mean square.
    pub error_px: Option<f64>,
    /// Its standard error.
    pub error_sigma_px: Option<f64>,
    /// Stars measured.
    pub trials: usize,
    /// Stars found.
    pub found: usize,
    /// Error by the smooth curve.
    pub smooth_error_px: Option<f64>,
    /// Error by the closed form.
    pub expected_px: Option<f64>,
    /// The part of it that is due to sampling and to the edge of the window.
    pub bias_px: Option<f64>,
    /// Cramér-Rao bound of the error.
    pub bound_px: Option<f64>,
    /// V magnitude at which half of the stars are detected.
    pub limit_vmag: Option<f64>,
    /// Charge of the brightest pixel over the full well.
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
    pub fn new(plan: &Plan, studies: &[StarStudy]) -> Self {
        let (spots, noises) = (&plan.grid.spots_px, &plan.grid.noises);
        let ends = |values: &[f64]| [values[0], values[values.len() - 1]];
        let (normalisation, centroid, noise_unit) = match &plan.stars[0] {
            StarModel::Peak(_) => ("peak", Centroiding::FixedWindow, "part of full scale"),
            StarModel::Energy(study) => ("energy", study.centroiding, "e"),
        };
        let stars = studies.iter().map(|study| StarReport::new(plan, study));
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

impl StarReport {
    fn new(plan: &Plan, study: &StarStudy) -> Self {
        let curve = &study.curve;
        let optimum = curve.optimum();
        let at = |radius_px: f64| SpotRadius::new(radius_px, curve.at(radius_px), plan.lens);
        let [first, last] = curve.range_px();
        let present = plan.present_px.filter(|px| (first..=last).contains(px));
        let required = plan.required_px.iter();
        let best_by_noise = best_by_noise(plan, study);
        let peak = match &study.star {
            StarModel::Peak(study) => Some(study),
            StarModel::Energy(_) => None,
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

fn best_by_noise(plan: &Plan, study: &StarStudy) -> Vec<BestAtNoise> {
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
    fn new(radius_px: f64, error_px: f64, lens: Option<Lens>) -> Self {
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
            Theory::Expected(expected) => (Some(expected), None),
            Theory::Reach(reach) => (None, Some(reach)),
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
        let is_peak = matches!(study.star, StarModel::Peak(_));
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
