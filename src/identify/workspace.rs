//! Identification of one star field: search, then the final fit with all the stars.

use super::field::StarField;
use super::hypothesis::Problem;
use super::identification::{Identification, MIN_STARS, SearchFailure, StarMatch};
use super::indexed_catalog::IndexedCatalog;
use super::pairing::Pair;
use super::priors::Priors;
use super::refine::{Refined, Start};
use super::search::{Buffers, LOG10_FALSE_ALARM_LIMIT, Search};
use crate::camera::DistortionModel;

/// Number of stars, the brightest, that decide how much distortion is fitted.
const CALIBRATION_STARS: usize = 120;
/// First pairing radius of the final fit, in units of the frame's diagonal.
const FINAL_RADIUS_SHARE: f64 = 0.005;

/// A name is given where the odds that it is right are at least these, unless others are stated.
pub const NAME_ODDS: f64 = 100.0;

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
#[derive(Debug)]
pub struct Workspace {
    name_odds: f64,
    buffers: Buffers,
    answer: Option<Identification>,
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}

impl Workspace {
    /// Empty buffers; names of [`NAME_ODDS`].
    pub fn new() -> Self {
        Self {
            name_odds: NAME_ODDS,
            buffers: Buffers::default(),
            answer: None,
        }
    }

    /// The same, but a name is given where the odds that it is right are at least `odds` to 1.
    /// Names less sure than 1 to 1 are never given: a star would have several.
    #[must_use]
    pub fn with_name_odds(self, odds: f64) -> Self {
        Self {
            name_odds: odds.max(1.0),
            ..self
        }
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
        let most_chance = 1.0 / (1.0 + self.name_odds);
        let named = with_names(problem, &mut search, (&found, most_chance));
        let Some((refined, log10)) = named else {
            return Err(SearchFailure::NoMatch {
                best_log10_false_alarm: search.best_log10_false_alarm(),
            });
        };
        let pairs = &self.buffers.refiner.pairs;
        let mut matches = self.answer.take().map_or_else(Vec::new, |old| old.matches);
        matches.clear();
        matches.extend(pairs.iter().map(|pair| star_match(pair, field)));
        Ok(self.answer.insert(identification(&refined, log10, matches)))
    }
}

/// The final fit, to all stars with a sure name, with as much distortion as they support. It starts
/// from the search's own answer where a richer one fails. `None` where there are too few names.
fn with_names(
    problem: Problem,
    search: &mut Search,
    (found, most_chance): (&Refined, f64),
) -> Option<(Refined, f64)> {
    let field = problem.field;
    let hypothesis = found.hypothesis();
    let start = Start {
        hypothesis: &hypothesis,
        radius_px: FINAL_RADIUS_SHARE * field.width_px.hypot(field.height_px),
        sceptical: false,
        stars: CALIBRATION_STARS,
        richest: DistortionModel::Quintic,
    };
    let richer = search.refiner().refine(problem, &start);
    let starts = [richer, Some(*found)].into_iter().flatten();
    let mut named = starts.filter_map(|settled| {
        let refiner = search.refiner();
        let refined = refiner.with_names(problem, &settled, most_chance)?;
        let names = refiner.pairs.len();
        let log10 = search.log10_false_alarm(&refined.hypothesis())?;
        let is_sure = names >= MIN_STARS && log10 <= LOG10_FALSE_ALARM_LIMIT;
        is_sure.then_some((refined, log10))
    });
    named.next()
}

fn star_match(pair: &Pair, field: &StarField) -> StarMatch {
    StarMatch {
        source: field.stars[pair.observed].source,
        star: pair.star,
        light: pair.direction,
        residual_px: pair.residual_px,
        p_chance: pair.p_chance,
    }
}

fn identification(
    refined: &Refined,
    log10_false_alarm: f64,
    matches: Vec<StarMatch>,
) -> Identification {
    let fit = &refined.fit;
    let covariance = &fit.covariance;
    let sum_sq: f64 = matches.iter().map(|m| m.residual_px.powi(2)).sum();
    Identification {
        attitude_covariance_rad2: covariance.fixed_view::<3, 3>(0, 0).into_owned(),
        focal_length_sigma_px: covariance[(3, 3)].sqrt() * fit.camera.focal_length_px,
        camera: fit.camera,
        icrs_to_camera: fit.icrs_to_camera,
        excess_sigma_px: refined.excess_sigma_px,
        rms_px: (sum_sq / matches.len().max(1) as f64).sqrt(),
        matches,
        log10_false_alarm,
    }
}
