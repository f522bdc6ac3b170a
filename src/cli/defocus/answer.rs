//! What is told: plain values with the units in their names.

use super::noise::Noise;
use super::study::{Plan, Row, Star, Study, Theory};
use serde::Serialize;
use starpipe::model::defocus::{
    Centroiding, ErrorCurve, ErrorGrid, Expected, IsoLine, Lens, Optimum, PAPER_RESIDUAL_PX,
    Parabola, PeakStudy, Surface,
};

/// All of it.
#[derive(Debug, Serialize)]
pub(super) struct Answer {
    pub(super) schema: u32,
    pub(super) normalisation: &'static str,
    pub(super) centroid: Centroiding,
    pub(super) trials: usize,
    pub(super) seed: u64,
    pub(super) noise: Noise,
    /// Of `noises` and `noise` in the tables below.
    pub(super) noise_unit: &'static str,
    pub(super) radii_px: [f64; 2],
    pub(super) radii: usize,
    pub(super) noises: [f64; 2],
    pub(super) noise_count: usize,
    pub(super) lens: Option<Lens>,
    pub(super) stars: Vec<StarAnswer>,
}

/// Of one star.
#[derive(Debug, Serialize)]
pub(super) struct StarAnswer {
    pub(super) vmag: Option<f64>,
    pub(super) peak: Option<f64>,
    /// The radius with the least error at the own noise.
    pub(super) best: Best,
    /// The smallest radius that meets each required error at the own noise.
    pub(super) required: Vec<Required>,
    /// The camera's spot as it is.
    pub(super) present: Option<Radius>,
    /// At the own noise.
    pub(super) curve: Vec<CurveRow>,
    pub(super) best_by_noise: Vec<BestAtNoise>,
    /// Through the best radii that are not the first or the last one.
    pub(super) best_as_parabola: Option<Parabola>,
    pub(super) equal_error: Vec<IsoLine>,
    pub(super) surface: SurfaceAnswer,
    pub(super) closed_form: Option<ClosedForm>,
}

/// A radius in all units.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Radius {
    pub(super) radius_px: f64,
    pub(super) radius_um: Option<f64>,
    /// From the focus, by geometric blur.
    pub(super) defocus_um: Option<f64>,
    pub(super) error_px: f64,
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Best {
    #[serde(flatten)]
    pub(super) radius: Radius,
    /// Between these the error is at most a twentieth larger.
    pub(super) nearly_px: [f64; 2],
    /// The best radius is the first or the last one: a better one may lie beyond.
    pub(super) is_at_edge: bool,
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Required {
    pub(super) required_error_px: f64,
    /// None where no radius meets it.
    pub(super) smallest: Option<Radius>,
    pub(super) largest: Option<Radius>,
    /// Whether the first and the last radius meet it: smaller and larger ones may as well.
    pub(super) is_at_edge: [bool; 2],
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct BestAtNoise {
    pub(super) noise: f64,
    #[serde(flatten)]
    pub(super) best: Option<Optimum>,
}

/// A radius at the own noise: a row of curve.csv.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct CurveRow {
    pub(super) vmag: Option<f64>,
    pub(super) radius_px: f64,
    pub(super) error_px: Option<f64>,
    pub(super) error_sigma_px: Option<f64>,
    pub(super) trials: usize,
    pub(super) found: usize,
    pub(super) smooth_error_px: Option<f64>,
    pub(super) expected_px: Option<f64>,
    pub(super) bias_px: Option<f64>,
    pub(super) bound_px: Option<f64>,
    pub(super) limit_vmag: Option<f64>,
    pub(super) peak_of_full_well: Option<f64>,
}

/// A point of the grid: a row of grid.csv.
#[derive(Debug, Serialize)]
pub(super) struct GridRow {
    vmag: Option<f64>,
    radius_px: f64,
    noise_relative: Option<f64>,
    noise_e: Option<f64>,
    error_px: Option<f64>,
    error_sigma_px: Option<f64>,
    trials: usize,
    found: usize,
    expected_px: Option<f64>,
    surface_px: Option<f64>,
}

#[derive(Debug, Serialize)]
pub(super) struct SurfaceAnswer {
    pub(super) coefficients: Option<Surface>,
    /// Why there is none.
    pub(super) missing: Option<String>,
    pub(super) residual_px: Option<f64>,
    /// How far the points scatter by chance.
    pub(super) scatter_px: Option<f64>,
    pub(super) paper: Option<PaperSurface>,
}

#[derive(Debug, Serialize)]
pub(super) struct PaperSurface {
    pub(super) coefficients: Surface,
    pub(super) residual_px: f64,
    /// Root mean square over the grid of what our surface differs from the paper's.
    pub(super) surface_difference_px: f64,
    /// The same of the errors themselves.
    pub(super) errors_difference_px: f64,
}

/// How well the errors agree with the closed form.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct ClosedForm {
    /// Mean over the grid of squared errors over those expected.
    pub(super) mean_square_ratio: f64,
    /// Its standard error.
    pub(super) mean_square_ratio_sigma: f64,
    /// Root mean square of errors less those expected.
    pub(super) difference_px: f64,
    /// The largest part of the expected error that sampling and the window's edge are.
    pub(super) most_bias_part: f64,
}

impl Answer {
    pub(super) fn of(plan: &Plan, studies: &[Study]) -> Self {
        let (spots, noises) = (&plan.grid.spots_px, &plan.grid.noises);
        let ends = |values: &[f64]| [values[0], values[values.len() - 1]];
        let (normalisation, centroid, noise_unit) = match &plan.stars[0] {
            Star::Peak(_) => ("peak", Centroiding::FixedWindow, "part of full scale"),
            Star::Energy(study) => ("energy", study.centroiding, "e"),
        };
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
            stars: studies.iter().map(|study| star(plan, study)).collect(),
        }
    }

    /// Whether every required error is met by some radius.
    pub(super) fn is_met(&self) -> bool {
        let required = self.stars.iter().flat_map(|star| &star.required);
        required
            .into_iter()
            .all(|required| required.smallest.is_some())
    }
}

fn star(plan: &Plan, study: &Study) -> StarAnswer {
    let optimum = study.own.optimum();
    let radius = |radius_px: f64, error_px: f64| Radius {
        radius_px,
        radius_um: plan.lens.map(|lens| lens.spot_um(radius_px)),
        defocus_um: plan.lens.and_then(|lens| lens.distance_um(radius_px)),
        error_px,
    };
    let [first, last] = study.own.range_px();
    let required = plan.required_px.iter().map(|&required_error_px| {
        let smallest = study.own.smallest_within(required_error_px);
        let largest = study.own.largest_within(required_error_px);
        let told = |px: Option<f64>| px.map(|px| radius(px, study.own.at(px)));
        Required {
            required_error_px,
            smallest: told(smallest),
            largest: told(largest),
            is_at_edge: [smallest == Some(first), largest == Some(last)],
        }
    });
    let present = plan.present_px.filter(|px| (first..=last).contains(px));
    let best_by_noise: Vec<_> = plan
        .grid
        .noises
        .iter()
        .zip(&study.curves)
        .map(|(&noise, curve)| BestAtNoise {
            noise,
            best: curve.as_ref().map(ErrorCurve::optimum),
        })
        .collect();
    let inside = best_by_noise.iter().filter_map(|at| {
        let best = at.best.filter(|best| !best.is_at_edge)?;
        Some((at.noise, best.spot_px))
    });
    let best_as_parabola = Parabola::nearest_to(&inside.collect::<Vec<_>>());
    let peak = match &study.star {
        Star::Peak(study) => Some(*study),
        Star::Energy(_) => None,
    };
    StarAnswer {
        vmag: study.star.v_mag(),
        peak: peak.map(|study| study.peak),
        best: Best {
            radius: radius(optimum.spot_px, optimum.rms_px),
            nearly_px: optimum.nearly_px,
            is_at_edge: optimum.is_at_edge,
        },
        required: required.collect(),
        present: present.map(|spot_px| radius(spot_px, study.own.at(spot_px))),
        curve: study.rows.iter().map(|row| curve_row(study, row)).collect(),
        best_by_noise,
        best_as_parabola,
        equal_error: study.isolines.clone(),
        surface: surface(study),
        closed_form: peak
            .zip(study.expected.as_deref())
            .map(|(peak, expected)| closed_form(&peak, expected, &study.errors)),
    }
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn curve_row(study: &Study, row: &Row) -> CurveRow {
    let (expected, reach) = match &row.theory {
        Theory::Expected(expected) => (Some(expected), None),
        Theory::Reach(reach) => (None, Some(reach)),
    };
    let [first, last] = study.own.range_px();
    let is_inside = (first..=last).contains(&row.spot_px);
    CurveRow {
        vmag: study.star.v_mag(),
        radius_px: row.spot_px,
        error_px: known(row.point.rms_px),
        error_sigma_px: known(row.point.rms_sigma_px),
        trials: row.point.trials,
        found: row.point.found,
        smooth_error_px: is_inside.then(|| study.own.at(row.spot_px)),
        expected_px: expected.map(|expected| expected.rms_px),
        bias_px: expected.map(|expected| expected.bias_px),
        bound_px: reach.map(|reach| reach.bound_px),
        limit_vmag: reach.and_then(|reach| reach.limit_vmag),
        peak_of_full_well: reach.map(|reach| reach.peak_part),
    }
}

/// The points of the grid.
pub(super) fn grid_rows(study: &Study) -> impl Iterator<Item = GridRow> {
    let points = study.errors.rows().enumerate();
    points.map(|(number, (radius_px, noise, point))| {
        let (relative, e) = match &study.star {
            Star::Peak(_) => (Some(noise), None),
            Star::Energy(_) => (None, Some(noise)),
        };
        GridRow {
            vmag: study.star.v_mag(),
            radius_px,
            noise_relative: relative,
            noise_e: e,
            error_px: known(point.rms_px),
            error_sigma_px: known(point.rms_sigma_px),
            trials: point.trials,
            found: point.found,
            expected_px: study.expected.as_ref().map(|all| all[number].rms_px),
            surface_px: study
                .surface
                .as_ref()
                .ok()
                .map(|surface| surface.at(radius_px, noise)),
        }
    })
}

fn surface(study: &Study) -> SurfaceAnswer {
    let errors = &study.errors;
    let fitted = study.surface.as_ref().ok().copied();
    let missing = study.surface.as_ref().err().map(ToString::to_string);
    let is_peak = matches!(study.star, Star::Peak(_));
    let paper = fitted.filter(|_| is_peak).map(|surface| {
        let coefficients = Surface::of_paper();
        PaperSurface {
            coefficients,
            residual_px: PAPER_RESIDUAL_PX,
            surface_difference_px: surface.difference_px(&coefficients, errors),
            errors_difference_px: coefficients.residual_px(errors),
        }
    });
    SurfaceAnswer {
        coefficients: fitted,
        missing,
        residual_px: fitted.map(|surface| surface.residual_px(errors)),
        scatter_px: known(errors.scatter_px()),
        paper,
    }
}

fn closed_form(study: &PeakStudy, expected: &[Expected], errors: &ErrorGrid) -> ClosedForm {
    let (mut ratios, mut squares, mut most_bias_part) = (0.0, 0.0, 0.0_f64);
    for (point, expected) in errors.points.iter().zip(expected) {
        ratios += (point.rms_px / expected.rms_px).powi(2);
        squares += (point.rms_px - expected.rms_px).powi(2);
        most_bias_part = most_bias_part.max(expected.bias_px / expected.rms_px);
    }
    let count = errors.points.len() as f64;
    ClosedForm {
        mean_square_ratio: ratios / count,
        // Squared distances are exponential: their standard deviation is their mean.
        mean_square_ratio_sigma: 1.0 / (count * study.trials as f64).sqrt(),
        difference_px: (squares / count).sqrt(),
        most_bias_part,
    }
}
