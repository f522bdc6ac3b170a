//! What is studied, and how.

use super::caller::Caller;
use super::error::DefocusError;
use super::noise::Noise;
use super::star::{DefocusStar, RadiusPoint, StarStudy, default_v_mag};
use crate::lab::defocus::{
    DefocusLens, EnergyStudy, ErrorCurve, ErrorGrid, ExpectedError, IsoLine, PeakStudy,
    SpotInWindow, SpotNoiseGrid, Surface,
};
use crate::predict::Scenario;
use rayon::prelude::*;

/// Least number of trials at the noise of the study: the reported radii depend on them.
const MIN_TRIALS: usize = 1000;
/// Seed of the random numbers unless another is stated.
const DEFAULT_SEED: u64 = 1;

/// Stars, radii and noises of a study.
pub struct DefocusPlan {
    /// The stars, all of one kind.
    pub stars: Vec<DefocusStar>,
    /// Radii and noises.
    pub grid: SpotNoiseGrid,
    /// The noise for which radii are reported.
    pub noise: Noise,
    /// The lens, if there is a camera.
    pub lens: Option<DefocusLens>,
    /// The camera's spot radius, in pixels.
    pub present_px: Option<f64>,
    /// Required errors, in pixels.
    pub required_px: Vec<f64>,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl DefocusPlan {
    /// Stars of these magnitudes, or one of [`default_v_mag`], under a camera; errors over radii and noises
    /// around `noise`.
    ///
    /// # Errors
    /// [`DefocusError::NoLimit`] if a magnitude is to be chosen and there is no limit.
    pub fn of_camera(
        scenario: Scenario,
        noise: Noise,
        v_mags: &[f64],
    ) -> Result<Self, DefocusError> {
        let scenario = noise.replacing_in(scenario);
        let v_mags = match v_mags {
            [] => vec![default_v_mag(&scenario)?],
            given => given.to_vec(),
        };
        let star = |v_mag| DefocusStar::Energy(Box::new(EnergyStudy::new(scenario.clone(), v_mag)));
        Ok(Self {
            stars: v_mags.into_iter().map(star).collect(),
            grid: SpotNoiseGrid::around(noise.value()),
            lens: Some(DefocusLens::of(&scenario.camera, 0.0)),
            present_px: Some(scenario.camera.spot_sigma_px),
            noise,
            required_px: Vec::new(),
            seed: DEFAULT_SEED,
        })
    }

    /// The paper's experiment.
    pub fn of_paper(noise: Noise) -> Self {
        Self {
            stars: vec![DefocusStar::Peak(PeakStudy::default())],
            grid: SpotNoiseGrid::of_paper(),
            noise,
            lens: None,
            present_px: None,
            required_px: Vec::new(),
            seed: DEFAULT_SEED,
        }
    }

    /// The same with so many trials at each point of the grid.
    #[must_use]
    pub fn with_trials(self, trials: usize) -> Self {
        let stars = self.stars.iter();
        Self {
            stars: stars.map(|star| star.with_trials(trials)).collect(),
            ..self
        }
    }

    /// Number of points that are measured: how often [`Self::run`] calls [`Caller::done`].
    pub fn point_count(&self) -> usize {
        self.stars.len() * self.grid.spots_px.len() * (self.grid.noises.len() + 1)
    }

    /// Studies all stars on the threads of the current pool.
    ///
    /// # Errors
    /// [`DefocusError::TooFaint`], [`DefocusError::Measure`].
    pub fn run(&self, caller: &Caller<'_>) -> Result<Vec<StarStudy>, DefocusError> {
        let stars = self.stars.iter();
        stars.map(|star| self.study(star, caller)).collect()
    }

    fn study(&self, star: &DefocusStar, caller: &Caller<'_>) -> Result<StarStudy, DefocusError> {
        let points = self.points(star, caller)?;
        let curve = ErrorCurve::through(points.iter().map(|at| (at.spot_px, &at.point)))
            .ok_or_else(|| self.too_faint(star))?;
        let errors = star.measure(self.grid.clone(), self.seed, caller)?;
        let noises = (0..self.grid.noises.len()).into_par_iter();
        let curves: Vec<_> = noises
            .map(|number| ErrorCurve::through(errors.at_noise(number)))
            .collect();
        let levels = isoline_levels_px(&errors, &self.required_px);
        let isolines = levels
            .par_iter()
            .map(|&level| IsoLine::trace(&errors, &curves, level))
            .collect();
        Ok(StarStudy {
            star: star.clone(),
            expected: self.expected(star, PeakStudy::spot),
            sampled: self.expected(star, PeakStudy::sampled_spot),
            surface: Surface::fit(&errors),
            errors,
            curves,
            points,
            curve,
            isolines,
        })
    }

    /// Measures the errors over the radius at the noise of the study.
    fn points(
        &self,
        star: &DefocusStar,
        caller: &Caller<'_>,
    ) -> Result<Vec<RadiusPoint>, DefocusError> {
        let noise = self.noise.value();
        let grid = SpotNoiseGrid {
            spots_px: self.grid.spots_px.clone(),
            noises: vec![noise],
        };
        let precise = star.with_trials(star.trials().max(MIN_TRIALS));
        // Another seed: these random numbers are not those of the grid.
        let errors = precise.measure(grid, !self.seed, caller)?;
        let points = errors.grid.spots_px.par_iter().zip(&errors.points);
        let points = points.map(|(&spot_px, &point)| RadiusPoint {
            spot_px,
            point,
            theory: star.theory(spot_px, noise),
        });
        Ok(points.collect())
    }

    /// The closed form over the grid, in the order of its points, for spots of this kind.
    fn expected(
        &self,
        star: &DefocusStar,
        spot: fn(&PeakStudy, f64) -> SpotInWindow,
    ) -> Option<Vec<ExpectedError>> {
        let DefocusStar::Peak(study) = star else {
            return None;
        };
        let at_radius = |&spot_px: &f64| -> Vec<ExpectedError> {
            let spot = spot(study, spot_px);
            let noises = self.grid.noises.iter();
            noises.map(|&noise| spot.expected(noise)).collect()
        };
        let rows: Vec<_> = self.grid.spots_px.par_iter().map(at_radius).collect();
        Some(rows.concat())
    }

    fn too_faint(&self, star: &DefocusStar) -> DefocusError {
        let limits = self.grid.spots_px.iter().filter_map(|&spot_px| match star {
            DefocusStar::Energy(study) => study.reach(spot_px, self.noise.value()).limit_vmag,
            DefocusStar::Peak(_) => None,
        });
        DefocusError::TooFaint {
            v_mag: star.v_mag().unwrap_or(f64::NAN),
            limit_vmag: limits.fold(f64::NEG_INFINITY, f64::max),
        }
    }
}

/// Errors of the isolines, in pixels: those required, and round numbers within the errors of the
/// grid.
fn isoline_levels_px(errors: &ErrorGrid, required_px: &[f64]) -> Vec<f64> {
    /// Mantissas of round numbers.
    const ROUND: [f64; 3] = [1.0, 2.0, 5.0];
    /// Most round numbers.
    const MAX: usize = 6;
    let sound = errors.points.iter().filter(|point| point.is_sound());
    let mut sorted: Vec<f64> = sound.map(|point| point.rms_px).collect();
    sorted.sort_by(f64::total_cmp);
    let (Some(&least), Some(&most)) = (sorted.first(), sorted.get(sorted.len() * 19 / 20)) else {
        return required_px.to_vec();
    };
    let decades = -5..2;
    let round = decades.flat_map(|decade| ROUND.map(|mantissa| format!("{mantissa}e{decade}")));
    let round = round.filter_map(|text| text.parse::<f64>().ok());
    let mut levels: Vec<f64> = round
        .filter(|level| (least..most).contains(level))
        .collect();
    levels.truncate(MAX);
    levels.extend(required_px);
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}
