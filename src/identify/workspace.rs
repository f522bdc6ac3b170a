//! Identification of one star field: search, then the final fit with all the stars.

use super::attitude::CameraFit;
use super::field::StarField;
use super::hypothesis::Problem;
use super::identification::{Identification, MIN_STARS, SearchFailure, StarMatch};
use super::indexed_catalog::IndexedCatalog;
use super::pairing::Pair;
use super::priors::Priors;
use super::refine::{Refined, Start};
use super::search::{Buffers, Found, LOG10_FALSE_ALARM_LIMIT, Search};
use crate::camera::DistortionModel;

/// Number of stars, the brightest, that decide how much distortion is fitted.
const CALIBRATION_STARS: usize = 120;
/// First pairing radius of the final fit, in units of the frame's diagonal.
const FINAL_RADIUS_SHARE: f64 = 0.005;

/// Identifies the stars of `field`. For many fields, [`Workspace::identify`] does the same without
/// allocating.
///
/// # Errors
/// The [`SearchFailure`] where they are not identified.
pub fn identify(
    field: &StarField,
    priors: &Priors,
    sky: &IndexedCatalog,
) -> Result<Identification, SearchFailure> {
    Workspace::new().identify(field, priors, sky).cloned()
}

/// Buffers for identification, reused from field to field: after the largest field nothing is
/// allocated.
#[derive(Debug, Default)]
pub struct Workspace {
    buffers: Buffers,
    answer: Option<Identification>,
}

impl Workspace {
    /// Empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Identifies the stars of `field`. The answer is kept in the workspace.
    ///
    /// # Errors
    /// The [`SearchFailure`] where they are not identified.
    pub fn identify(
        &mut self,
        field: &StarField,
        priors: &Priors,
        sky: &IndexedCatalog,
    ) -> Result<&Identification, SearchFailure> {
        if field.stars.len() < MIN_STARS {
            return Err(SearchFailure::TooFewStars {
                found: field.stars.len(),
                needed: MIN_STARS,
            });
        }
        let problem = Problem { field, sky };
        let mut search = Search::new(problem, priors, &mut self.buffers);
        let Some(found) = search.run() else {
            return Err(SearchFailure::NoMatch {
                best_log10_false_alarm: search.best_log10_false_alarm(),
            });
        };
        let completed = with_all_stars(problem, &mut search, &found);
        let (refined, log10, pairs) = match completed {
            Some((refined, log10)) => (refined, log10, &self.buffers.refiner.pairs),
            None => (found.refined, found.log10_false_alarm, &self.buffers.found),
        };
        let mut matches = self.answer.take().map_or_else(Vec::new, |old| old.matches);
        matches.clear();
        matches.extend(pairs.iter().map(|pair| star_match(pair, field)));
        Ok(self
            .answer
            .insert(identification(&refined.fit, log10, matches)))
    }
}

/// The final fit, with all stars and as much distortion as they support. `None` where the search's
/// own answer is the surer one.
fn with_all_stars(problem: Problem, search: &mut Search, found: &Found) -> Option<(Refined, f64)> {
    let field = problem.field;
    let hypothesis = found.refined.hypothesis();
    let start = Start {
        hypothesis: &hypothesis,
        radius_px: FINAL_RADIUS_SHARE * field.width_px.hypot(field.height_px),
        sceptical: false,
        stars: CALIBRATION_STARS,
        richest: DistortionModel::Quintic,
    };
    let refiner = search.refiner();
    let settled = refiner.refine(problem, &start)?;
    let settled = refiner.with_all_stars(problem, &settled)?;
    let refined = refiner.with_blends(problem, settled)?;
    let log10 = search.log10_false_alarm(&refined.hypothesis())?;
    (log10 <= LOG10_FALSE_ALARM_LIMIT).then_some((refined, log10))
}

fn star_match(pair: &Pair, field: &StarField) -> StarMatch {
    StarMatch {
        source: field.stars[pair.observed].source,
        star: pair.star,
        light: pair.direction,
        residual_px: pair.residual_px,
    }
}

fn identification(
    fit: &CameraFit,
    log10_false_alarm: f64,
    matches: Vec<StarMatch>,
) -> Identification {
    let covariance = &fit.covariance;
    let sum_sq: f64 = matches.iter().map(|m| m.residual_px.powi(2)).sum();
    Identification {
        attitude_covariance_rad2: covariance.fixed_view::<3, 3>(0, 0).into_owned(),
        focal_length_sigma_px: covariance[(3, 3)].sqrt() * fit.camera.focal_length_px,
        camera: fit.camera,
        icrs_to_camera: fit.icrs_to_camera,
        rms_px: (sum_sq / matches.len().max(1) as f64).sqrt(),
        matches,
        log10_false_alarm,
    }
}
