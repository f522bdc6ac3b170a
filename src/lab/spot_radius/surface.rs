//! How well the errors agree with a polynomial surface and with the closed form.

use super::star::{DefocusStar, StarStudy};
use crate::lab::defocus::{ErrorGrid, ExpectedError, PAPER_RESIDUAL_PX, Surface};
use serde::Serialize;

/// The surface through the errors of a star.
#[derive(Debug, Clone, Serialize)]
pub struct SurfaceReport {
    /// Its coefficients.
    pub coefficients: Option<Surface>,
    /// Why there is no surface.
    pub missing: Option<String>,
    /// Root mean square of the errors minus the surface.
    pub residual_px: Option<f64>,
    /// Scatter of the errors by chance.
    pub scatter_px: Option<f64>,
    /// Comparison with the paper's surface.
    pub paper: Option<PaperSurface>,
}

/// The paper's surface compared with ours.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct PaperSurface {
    /// The paper's coefficients.
    pub coefficients: Surface,
    /// The paper's residual.
    pub residual_px: f64,
    /// Root mean square over the grid of our surface minus the paper's.
    pub surface_difference_px: f64,
    /// Root mean square over the grid of our errors minus the paper's surface.
    pub errors_difference_px: f64,
}

/// The errors compared with the closed form.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ClosedFormReport {
    /// Mean over the grid of the squared ratio of measured to expected error.
    pub mean_square_ratio: f64,
    /// Standard error of this mean.
    pub mean_square_ratio_sigma: f64,
    /// Root mean square of measured minus expected errors.
    pub difference_px: f64,
    /// Largest part of an expected error that is due to sampling and to the edge of the window.
    pub most_bias_part: f64,
}

impl SurfaceReport {
    pub(super) fn new(study: &StarStudy) -> Self {
        let errors = &study.errors;
        let fitted = study.surface.as_ref().ok().copied();
        let scatter_px = errors.scatter_px();
        let is_peak = matches!(study.star, DefocusStar::Peak(_));
        let paper = fitted.filter(|_| is_peak);
        Self {
            coefficients: fitted,
            missing: study.surface.as_ref().err().map(ToString::to_string),
            residual_px: fitted.map(|surface| surface.residual_px(errors)),
            scatter_px: scatter_px.is_finite().then_some(scatter_px),
            paper: paper.map(|surface| PaperSurface::new(&surface, errors)),
        }
    }
}

impl PaperSurface {
    fn new(surface: &Surface, errors: &ErrorGrid) -> Self {
        let coefficients = Surface::of_paper();
        Self {
            coefficients,
            residual_px: PAPER_RESIDUAL_PX,
            surface_difference_px: surface.difference_px(&coefficients, errors),
            errors_difference_px: coefficients.residual_px(errors),
        }
    }
}

impl ClosedFormReport {
    pub(super) fn new(trials: usize, expected: &[ExpectedError], errors: &ErrorGrid) -> Self {
        let (mut ratios, mut squares, mut most_bias_part) = (0.0, 0.0, 0.0_f64);
        for (point, expected) in errors.points.iter().zip(expected) {
            ratios += (point.rms_px / expected.rms_px).powi(2);
            squares += (point.rms_px - expected.rms_px).powi(2);
            most_bias_part = most_bias_part.max(expected.bias_px / expected.rms_px);
        }
        let count = errors.points.len() as f64;
        Self {
            mean_square_ratio: ratios / count,
            // Squared distances are exponential: their standard deviation is their mean.
            mean_square_ratio_sigma: 1.0 / (count * trials as f64).sqrt(),
            difference_px: (squares / count).sqrt(),
            most_bias_part,
        }
    }
}
