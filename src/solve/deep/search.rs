//! The search for a narrow field.

use super::plan::{Part, attempts, is_narrow};
use super::sky::{DeepSky, Indexed};
use crate::base::size::Size;
use crate::base::units::RAD_PER_DEG;
use crate::catalog::deep::Region;
use crate::identify::diagnosis::Diagnosis;
use crate::identify::{
    Identification, LOG10_FALSE_ALARM_LIMIT, Priors, ScalePrior, SearchFailure, SkyRegion,
};
use crate::solve::context::Context;
use crate::solve::limits::FrameLimits;
use crate::solve::outcome::{Outcome, Reason};

/// What an identification answers.
pub trait Answered {
    /// The stars and the attitude, or why they were not found.
    fn outcome(&self) -> &Outcome;
    /// The same, to change it.
    fn outcome_mut(&mut self) -> &mut Outcome;
}

/// What a frame shows: by which stars, and where.
pub struct InAll<T> {
    /// The answer.
    pub answer: T,
    /// The stars of the deep catalogue that are named.
    pub named: Option<Indexed>,
    /// The direction that was stated, where the frame shows another.
    pub other_than: Option<SkyRegion>,
}

/// Identifies a frame of this size with the catalogue of all frames or with deep ones: with these first where the
/// field is stated to be narrow. A direction that is stated is tried first, and dropped where nothing matches.
/// `identify` identifies it with the catalogue of a context and with priors.
pub fn identify_in_all<T: Answered>(
    (context, priors): (&Context, &Priors),
    size: Size,
    limits: &FrameLimits,
    mut identify: impl FnMut(&Context, &Priors) -> T,
) -> InAll<T> {
    let Some(near) = priors.near else {
        let (answer, named) = search_all((context, priors), size, limits, &mut identify);
        return InAll {
            answer,
            named,
            other_than: None,
        };
    };
    let there = context.unexplained();
    let (answer, named) = search_all((&there, priors), size, limits, &mut identify);
    if answer.outcome().identification().is_some() {
        return InAll {
            answer,
            named,
            other_than: None,
        };
    }
    let anywhere = Priors {
        near: None,
        ..*priors
    };
    let (mut answer, named) = search_all((context, &anywhere), size, limits, &mut identify);
    let other_than = match answer.outcome_mut() {
        Outcome::Identified(found) => {
            // Both searches gave chance an opportunity.
            if !is_sure_after(found, 2.0) {
                let best_log10_false_alarm = Some(found.log10_false_alarm);
                let failure = SearchFailure::NoMatch {
                    best_log10_false_alarm,
                };
                *answer.outcome_mut() = Outcome::NotIdentified(Reason::Search(failure));
            }
            Some(near)
        }
        Outcome::NotIdentified(_) => None,
    };
    InAll {
        answer,
        named,
        other_than,
    }
}

/// The same with these priors. Also returns the stars of the deep catalogue that are named.
fn search_all<T: Answered>(
    (context, priors): (&Context, &Priors),
    size: Size,
    limits: &FrameLimits,
    identify: &mut impl FnMut(&Context, &Priors) -> T,
) -> (T, Option<Indexed>) {
    let Some(deep) = context.deep else {
        return (identify(context, priors), None);
    };
    let frame = DeepSearch {
        deep,
        context,
        priors,
        size,
        limits,
    };
    let is_narrow = is_narrow(priors, size.width as f64);
    if is_narrow && let Some((found, named)) = frame.search(identify) {
        return (found, Some(named));
    }
    let mut found = identify(context, priors);
    if found.outcome().identification().is_some() {
        return (found, None);
    }
    if !is_narrow
        && may_be_narrow(found.outcome())
        && let Some((found, named)) = frame.search(identify)
    {
        return (found, Some(named));
    }
    frame.explain(found.outcome_mut());
    (found, None)
}

/// Whether a frame that is not identified may be of a narrow field: it has stars, and time is left.
fn may_be_narrow(outcome: &Outcome) -> bool {
    !matches!(
        outcome,
        Outcome::NotIdentified(Reason::Search(
            SearchFailure::TooFewStars { .. } | SearchFailure::Interrupted
        ))
    )
}

/// The search of a frame in deep catalogues.
struct DeepSearch<'a> {
    deep: &'a DeepSky,
    context: &'a Context<'a>,
    priors: &'a Priors,
    size: Size,
    limits: &'a FrameLimits,
}

impl DeepSearch<'_> {
    /// Searches part by part of the sky. Returns the answer, and the stars that it names.
    fn search<T: Answered>(
        &self,
        identify: &mut impl FnMut(&Context, &Priors) -> T,
    ) -> Option<(T, Indexed)> {
        // The catalogue of all frames, first or later.
        let mut searches = 1.0;
        for number in 0..self.deep.catalogs().len() {
            let contents = &self.deep.catalogs()[number].1;
            for attempt in attempts(self.priors, self.size, contents) {
                if self.limits.of_frame.is_due() {
                    return None;
                }
                let Some(indexed) = self.deep.indexed(number, &attempt, self.limits) else {
                    continue;
                };
                let near = match attempt.part {
                    Part::Near(_, near) => Some(near),
                    Part::Sweep(_) => None,
                };
                let priors = Priors {
                    near,
                    ..*self.priors
                };
                let mut found = identify(&self.context.over(&indexed), &priors);
                searches += 1.0;
                if let Outcome::Identified(first) = found.outcome_mut()
                    && is_sure_after(first, searches)
                {
                    let first = &*first;
                    let named = self.named(number, first, identify);
                    return Some(named.unwrap_or((found, indexed)));
                }
            }
        }
        None
    }

    /// A field that is too narrow for the catalogue of all frames may be wide enough for the densest of the deep ones:
    /// then it has another cause that it is not identified.
    fn explain(&self, outcome: &mut Outcome) {
        let Outcome::NotIdentified(Reason::Diagnosis(Diagnosis::TooNarrow {
            fov_x_rad,
            narrowest_rad,
            stars,
            ..
        })) = outcome
        else {
            return;
        };
        let Some((_, contents)) = self.deep.catalogs().first() else {
            return;
        };
        let width_deg = (fov_x_rad[0] + fov_x_rad[1]) / 2.0 / RAD_PER_DEG;
        let aspect = self.size.height as f64 / self.size.width as f64;
        *narrowest_rad = contents.narrowest_fov_deg() * RAD_PER_DEG;
        *stars = width_deg * width_deg * aspect * contents.per_sq_deg();
        if fov_x_rad[1] >= *narrowest_rad {
            let best_log10_false_alarm = None;
            let failure = SearchFailure::NoMatch {
                best_log10_false_alarm,
            };
            *outcome = Outcome::NotIdentified(Reason::Search(failure));
        }
    }

    /// What was found first, with all stars around it; `None` where these do not confirm it.
    fn named<T: Answered>(
        &self,
        number: usize,
        first: &Identification,
        identify: &mut impl FnMut(&Context, &Priors) -> T,
    ) -> Option<(T, Indexed)> {
        /// How far the frame's centre and its scale may be from those that were found.
        const APART: f64 = 0.02;
        let (fov_rad, radius_rad) = (first.camera.fov_x_rad()?, first.camera.radius_rad());
        let region = region_around(first);
        let known = self.context.indexed.catalog();
        let interrupt = &self.limits.of_frame;
        let indexed = self
            .deep
            .around(number, region, fov_rad, known, interrupt)?;
        let scale_rad = 1.0 / first.camera.central_focal_length_px();
        let priors = Priors {
            near: Some(SkyRegion {
                centre: region.centre,
                radius_rad: APART * radius_rad,
            }),
            scale: Some(ScalePrior::between(
                scale_rad * (1.0 - APART),
                scale_rad * (1.0 + APART),
            )),
            ..*self.priors
        };
        let mut again = identify(&self.context.over(&indexed), &priors);
        let Outcome::Identified(second) = again.outcome_mut() else {
            return None;
        };
        // The first search had to choose among many more hypotheses.
        second.log10_false_alarm = second.log10_false_alarm.max(first.log10_false_alarm);
        Some((again, indexed))
    }
}

/// Whether an answer is still sure after so many searches: each gives chance as much opportunity as the first.
fn is_sure_after(found: &mut Identification, searches: f64) -> bool {
    found.log10_false_alarm += libm::log10(searches);
    found.log10_false_alarm <= LOG10_FALSE_ALARM_LIMIT
}

/// The part of the sky around an answer, with as many stars as detections can be.
fn region_around(found: &Identification) -> Region {
    /// Room beyond the corners, over their distance from the centre.
    const ROOM: f64 = 1.1;
    /// Most stars in a frame that are of use.
    const MOST: f64 = 6000.0;
    let area_sq_deg = found.camera.solid_angle_sr() / RAD_PER_DEG.powi(2);
    Region {
        centre: found.icrs_to_camera.boresight(),
        radius_rad: ROOM * found.camera.radius_rad(),
        per_sq_deg: MOST / area_sq_deg,
    }
}
