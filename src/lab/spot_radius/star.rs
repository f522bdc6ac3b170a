//! What is measured of one star.

use super::caller::Caller;
use super::error::DefocusError;
use crate::lab::defocus::{
    EnergyStudy, ErrorCurve, ErrorGrid, ErrorPoint, ExpectedError, IsoLine, MeasureError,
    PeakStudy, SpotLimits, SpotNoiseGrid, Surface, SurfaceError,
};
use crate::predict::{Budget, Detector, Rule, Scenario};

/// A star and how its centroid is measured.
#[derive(Debug, Clone)]
pub enum DefocusStar {
    /// Its brightest pixel is given: the paper's experiment.
    Peak(PeakStudy),
    /// Its light is given: a star of a camera.
    Energy(Box<EnergyStudy>),
}

/// Default difference of a star from the camera's limit, in magnitudes: such a star is found at any
/// reasonable radius.
pub const BRIGHTER_THAN_LIMIT_MAG: f64 = 1.5;

/// V magnitude of a star that is [`BRIGHTER_THAN_LIMIT_MAG`] brighter than the limit of the camera.
///
/// # Errors
/// [`DefocusError::Scenario`], [`DefocusError::NoLimit`].
pub fn default_v_mag(scenario: &Scenario) -> Result<f64, DefocusError> {
    let budget = Budget::checked(scenario)?;
    let limit = Detector::new(Rule::MatchedFilter, scenario, &budget).vmag_at(0.5);
    if !limit.is_finite() {
        return Err(DefocusError::NoLimit);
    }
    Ok(((limit - BRIGHTER_THAN_LIMIT_MAG) * 10.0).round() / 10.0)
}

impl DefocusStar {
    /// Measures the errors on `grid`, see [`ErrorGrid::measure`].
    pub(super) fn measure(
        &self,
        grid: SpotNoiseGrid,
        seed: u64,
        caller: &Caller<'_>,
    ) -> Result<ErrorGrid, MeasureError> {
        let interrupt = caller.interrupt;
        match self {
            Self::Peak(study) => {
                let measure = |spot: f64, noise: f64, random: &mut _| {
                    interrupt.check()?;
                    Ok(study.measure(spot, noise, random))
                };
                ErrorGrid::measure(grid, seed, measure, caller.done)
            }
            Self::Energy(study) => {
                let measure = |spot: f64, noise: f64, random: &mut _| {
                    study.measure(spot, noise, random, interrupt)
                };
                ErrorGrid::measure(grid, seed, measure, caller.done)
            }
        }
    }

    /// The same star with another number of trials.
    pub(super) fn with_trials(&self, trials: usize) -> Self {
        let mut star = self.clone();
        match &mut star {
            Self::Peak(study) => study.trials = trials,
            Self::Energy(study) => study.trials = trials,
        }
        star
    }

    /// Trials at each point of the grid.
    pub fn trials(&self) -> usize {
        match self {
            Self::Peak(study) => study.trials,
            Self::Energy(study) => study.trials,
        }
    }

    /// Johnson V of the star, if its light is given.
    pub fn v_mag(&self) -> Option<f64> {
        match self {
            Self::Peak(_) => None,
            Self::Energy(study) => Some(study.v_mag),
        }
    }

    /// What theory predicts at a radius in pixels and a noise in the unit of the grid.
    pub(super) fn theory(&self, spot_px: f64, noise: f64) -> PredictedError {
        match self {
            Self::Peak(study) => PredictedError::Expected(study.expected(spot_px, noise)),
            Self::Energy(study) => PredictedError::Reach(study.reach(spot_px, noise)),
        }
    }
}

/// The error at one radius, at the noise of the study.
#[derive(Debug, Clone, Copy)]
pub struct RadiusPoint {
    /// The radius, in pixels.
    pub spot_px: f64,
    /// The measured error.
    pub point: ErrorPoint,
    /// The prediction.
    pub theory: PredictedError,
}

/// What theory predicts of the error.
#[derive(Debug, Clone, Copy)]
pub enum PredictedError {
    /// The closed form of the paper's experiment.
    Expected(ExpectedError),
    /// Cramér-Rao bound and limit of a camera.
    Reach(SpotLimits),
}

/// The results of one star.
#[derive(Debug)]
pub struct StarStudy {
    /// The star.
    pub star: DefocusStar,
    /// Errors on the grid.
    pub errors: ErrorGrid,
    /// The closed form at each point of the grid, if there is one.
    pub expected: Option<Vec<ExpectedError>>,
    /// The same for spots that are sampled instead of integrated.
    pub sampled: Option<Vec<ExpectedError>>,
    /// The surface through the errors.
    pub surface: Result<Surface, SurfaceError>,
    /// The curve over the radius at each noise of the grid.
    pub curves: Vec<Option<ErrorCurve>>,
    /// Errors over the radius at the noise of the study.
    pub points: Vec<RadiusPoint>,
    /// The curve through `points`.
    pub curve: ErrorCurve,
    /// Lines of equal error.
    pub isolines: Vec<IsoLine>,
}
