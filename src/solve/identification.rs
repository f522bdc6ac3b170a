//! Identification of a frame's stars, with priors that may be wrong, and the reason where it fails.

use super::context::{Context, Workspace};
use super::other_stars::OtherStars;
use super::outcome::{Outcome, Reason};
use super::star_field::{field_of, star_field};
use super::stopwatch::{Stage, Stopwatch};
use crate::camera::KnownLens;
use crate::detect::{self, DetectConfig, Detection, Detections, detect};
use crate::ephemeris::observer::Observation;
use crate::ephemeris::places::{AttitudeFrame, StarPlaces};
use crate::frame::Frame;
use crate::identify;
use crate::identify::diagnosis::{
    Diagnosis, DoubleImage, RepeatedSky, Unidentified, diagnose, find_double_image,
    find_repeated_sky,
};
use crate::identify::{
    Choices, Identification, LOG10_FALSE_ALARM_LIMIT, ObservedStar, OtherFields, Priors,
    ScalePrior, SearchFailure, SourceIndex, StarField,
};
use std::collections::HashSet;
use std::sync::Arc;

/// Identifies the stars of a frame. Also returns the scale that was dropped because nothing matched
/// with it.
pub(super) fn identify_stars(
    frame: &Frame,
    detections: &Detections,
    (priors, places): (&Priors, StarPlaces),
    context: &Context,
    workspace: &mut Workspace,
    clock: &mut Stopwatch,
) -> (Outcome, Option<ScalePrior>) {
    let field = star_field(frame, detections, places);
    let Workspace {
        identify: workspace,
        detect: detector,
        ..
    } = workspace;
    let (mut found, dropped_scale) = {
        let other_fields = OtherStars::new(frame, detector, places);
        search(
            (&field, Some(&other_fields)),
            priors,
            context,
            workspace,
            clock,
        )
    };
    if found.is_err() && may_be_wide(detections) {
        let is_star = |source: &Detection| source.flags.may_be_wide_star();
        let wide = field_of(is_star, frame, detections, places);
        let second = attempt((&wide, None), &priors.binding(), context, workspace, clock);
        if let Some(second) = second.ok().and_then(at_second_attempt) {
            found = Ok(second);
        }
    }
    if let (Ok(found), Some(trails)) = (&mut found, detections.trails) {
        found.add_common_error(trails.middle_sigma_px);
    }
    let image = Some((frame, detections));
    let outcome = identified(found, image, &field, priors, context);
    let outcome = match outcome {
        Outcome::NotIdentified(reason) if context.explains && may_be_negative(&reason) => {
            let negative = negative(frame, detections, detector);
            Outcome::NotIdentified(negative.map_or(reason, Reason::Diagnosis))
        }
        outcome => outcome,
    };
    (outcome, dropped_scale)
}

/// Identifies a frame with these places. Where that fails, shows stars through the ground, or explains them
/// badly, the time or the site may be wrong, and refraction with it: then also without air, and the answer
/// that is less likely by chance counts. Also returns the places that it was found with.
pub(super) fn through_air_or_not(
    places: StarPlaces,
    mut identify: impl FnMut(StarPlaces) -> Outcome,
) -> (Outcome, StarPlaces) {
    let outcome = identify(places);
    if !places.has_refraction() || outcome.identification().is_some_and(is_credible_in_air) {
        return (outcome, places);
    }
    let airless = places.without_refraction();
    let without = identify(airless);
    let is_above = |found: &&Identification| {
        let boresight = found.icrs_to_camera.boresight();
        !places.is_below_horizon(&boresight)
    };
    let chance = |found: &Identification| found.log10_false_alarm;
    let in_air = outcome.identification().filter(is_above).map(chance);
    let without_air = without.identification().map(chance);
    let is_better = match (in_air, without_air) {
        (Some(in_air), Some(without_air)) => in_air <= without_air,
        (in_air, _) => in_air.is_some(),
    };
    if is_better {
        (outcome, places)
    } else {
        (without, airless)
    }
}

/// Whether an answer with refraction needs no other: the frame is well above the horizon, and no error
/// but that of the centroids is in the residuals.
fn is_credible_in_air(found: &Identification) -> bool {
    /// Cosine of 70° from the zenith: nearer to the horizon a wrong time changes refraction much.
    const LOW: f64 = 0.34;
    const RESIDUAL_PX: f64 = 0.05;
    let boresight = found.icrs_to_camera.boresight();
    let zenith = found.places.zenith();
    let is_high = zenith.is_some_and(|zenith| zenith.dot(&boresight) > LOW);
    is_high && found.excess_sigma_px < RESIDUAL_PX
}

/// How the stars of an identified frame stand in it once more.
#[derive(Default)]
pub(super) struct SecondImages {
    /// Every star is there twice.
    pub double: Option<DoubleImage>,
    /// Their pattern is there again.
    pub repeated: Option<RepeatedSky>,
}

impl SecondImages {
    /// Those of a frame with these stars. Where every star is there twice, the attitude is that of one of
    /// the images, or lies between them, and its error gets half of the way from one to the other.
    ///
    /// They are not looked for where attitude and optics alone are wanted.
    pub fn find(
        outcome: &mut Outcome,
        attitude_only: bool,
        field: impl FnOnce() -> StarField,
    ) -> Self {
        let Outcome::Identified(found) = outcome else {
            return Self::default();
        };
        if attitude_only {
            return Self::default();
        }
        let field = &field();
        let named: HashSet<SourceIndex> = found.matches.iter().map(|m| m.source).collect();
        let is_named = |star: &ObservedStar| named.contains(&star.source);
        let double = find_double_image(field, is_named);
        if let Some(double) = &double {
            let [x, y] = double.offset_px;
            found.add_common_error(libm::hypot(x, y) / 2.0);
        }
        let is_single = double.is_none();
        Self {
            double,
            repeated: is_single
                .then(|| find_repeated_sky(field, is_named))
                .flatten(),
        }
    }
}

/// Whether most of the brightest detections are wider than the spot: then it may be that of specks,
/// and these the stars.
fn may_be_wide(detections: &Detections) -> bool {
    const BRIGHTEST: usize = 16;
    let bright = detections.sources.iter().take(BRIGHTEST);
    let (count, wide) = bright.fold((0, 0), |(count, wide), source| {
        (count + 1, wide + usize::from(source.flags.extended))
    });
    2 * wide > count
}

/// Whether a negative can end like this: it has few stars, none that match, or a sky at full scale.
fn may_be_negative(reason: &Reason) -> bool {
    match reason {
        Reason::Search(failure) => *failure != SearchFailure::Interrupted,
        Reason::Diagnosis(cause) => matches!(
            cause,
            Diagnosis::Saturated { .. } | Diagnosis::Trails { .. } | Diagnosis::DoubleExposure(_)
        ),
    }
}

/// Whether `frame` has many more dark stars than bright ones.
fn negative(
    frame: &Frame,
    detections: &Detections,
    detector: &detect::Workspace,
) -> Option<Diagnosis> {
    /// Fewer dark spots may be anything.
    const MIN_SPOTS: usize = 10;
    /// Dark spots for each bright one, of whatever form.
    const MIN_RATIO: usize = 4;
    /// Fainter ones may be noise.
    const MIN_SNR: f64 = 10.0;
    /// The negative, and the frame as floats.
    const BYTES_PER_PIXEL: u64 = 2 * size_of::<f32>() as u64;
    // The sky of a negative is nearer to its highest level than to its lowest.
    let [lowest, highest] = frame.range_adu().map(f64::from);
    if detections.background_adu <= (lowest + highest) / 2.0 {
        return None;
    }
    if !detector.has_room(frame, BYTES_PER_PIXEL * frame.pixels.len() as u64) {
        return None;
    }
    let config = DetectConfig {
        max_detections: 1000,
        ..DetectConfig::default()
    };
    let inverted = detect(&frame.inverted(), &config, &mut detector.emptied()).ok()?;
    let stands_out = |source: &&Detection| source.snr >= MIN_SNR;
    let bright = detections.sources.iter().filter(stands_out).count();
    let dark = inverted.sources.iter().filter(stands_out);
    let spots = dark.filter(|source| source.flags.is_star_like()).count();
    (spots >= MIN_SPOTS.max(MIN_RATIO * bright)).then_some(Diagnosis::Negative { spots })
}

/// Result of the search, and the scale that was dropped because nothing matched with it.
type Searched = (Result<Identification, SearchFailure>, Option<ScalePrior>);

/// Searches for `field`. A scale that is not the user's and a lens that was measured are tried first, and
/// dropped where nothing matches with them, or the stars are clearly elsewhere than this lens sees them.
pub(super) fn search(
    (field, other_fields): (&StarField, Option<&dyn OtherFields>),
    priors: &Priors,
    context: &Context,
    workspace: &mut identify::Workspace,
    clock: &mut Stopwatch,
) -> Searched {
    // Names are those of detections, and without a whole search there are only those.
    let field = (field, other_fields.filter(|_| !context.attitude_only));
    let first = attempt(field, priors, context, workspace, clock);
    let tentative = priors.scale.filter(|scale| !scale.is_binding());
    if tentative.is_none() && !priors.holds_lens {
        return (first, None);
    }
    let failure = match first {
        Ok(found) if !is_of_other_lens(&found) => return (Ok(found), None),
        Ok(found) => {
            let free = attempt(field, &priors.binding(), context, workspace, clock).ok();
            let better = free.filter(|free| 2.0 * free.excess_sigma_px < found.excess_sigma_px);
            return (Ok(better.unwrap_or(found)), None);
        }
        Err(failure) => failure,
    };
    let second = attempt(field, &priors.binding(), context, workspace, clock);
    match second.map(at_second_attempt) {
        Ok(Some(found)) => (Ok(found), tentative),
        Ok(None) => (Err(failure), None),
        Err(failure) => (Err(failure), None),
    }
}

/// Whether a lens was held, and the residuals are larger than its errors and those of the stars.
fn is_of_other_lens(found: &Identification) -> bool {
    /// What a lens that is known well misses.
    const TOLERANCE_PX: f64 = 0.05;
    found.lens_is_known && found.excess_sigma_px > TOLERANCE_PX
}

/// Pointing, then names, each timed; the pointing alone where no more is wanted.
fn attempt(
    (field, other_fields): (&StarField, Option<&dyn OtherFields>),
    priors: &Priors,
    context: &Context,
    workspace: &mut identify::Workspace,
    clock: &mut Stopwatch,
) -> Result<Identification, SearchFailure> {
    let lens = prepare(workspace, priors, context);
    let finished = |found: Identification| Identification {
        lens_is_known: lens.is_some(),
        ..found
    };
    if context.attitude_only {
        let found = workspace.attitude(field, priors, context.indexed);
        clock.lap(Stage::Pointing);
        return found.cloned().map(finished);
    }
    let choices = other_fields.map_or(Choices::OfField, Choices::OfFrame);
    let pointing = workspace.find_pointing_by(choices, field, priors, context.indexed);
    clock.lap(Stage::Pointing);
    let found = pointing?.name_stars();
    clock.lap(Stage::Naming);
    found.cloned().map(finished)
}

/// Sets what the context wants of identification, and returns the lens that is held.
pub(super) fn prepare<'a>(
    workspace: &mut identify::Workspace,
    priors: &Priors,
    context: &'a Context,
) -> Option<&'a Arc<KnownLens>> {
    workspace.set_name_odds(context.name_odds);
    workspace.set_effort(context.effort);
    let lens = context.lens.as_ref().filter(|_| priors.holds_lens);
    workspace.set_known_lens(lens);
    lens
}

/// An identification at the second attempt, where it is still sure. Chance had at most twice the
/// opportunity: all that the first attempt can have tried is tried again.
fn at_second_attempt(mut found: Identification) -> Option<Identification> {
    found.log10_false_alarm += std::f64::consts::LOG10_2;
    (found.log10_false_alarm <= LOG10_FALSE_ALARM_LIMIT).then_some(found)
}

/// The outcome: where nothing is identified, with the reason that explains it best.
pub(super) fn identified(
    found: Result<Identification, SearchFailure>,
    image: Option<(&Frame, &Detections)>,
    field: &StarField,
    priors: &Priors,
    context: &Context,
) -> Outcome {
    let failure = match found {
        Ok(mut found) => {
            if priors.date.is_none() {
                found.add_unknown_aberration();
            }
            return Outcome::Identified(Box::new(found));
        }
        Err(failure) => failure,
    };
    let case = Unidentified {
        image,
        field,
        priors,
        failure,
    };
    let cause = (context.explains)
        .then(|| diagnose(&case, context.indexed))
        .flatten();
    Outcome::NotIdentified(cause.map_or(Reason::Search(failure), Reason::Diagnosis))
}

/// The frame's centre in the observer's sky, where the frame is identified and site and date are
/// known.
pub(super) fn observation(outcome: &Outcome, priors: &Priors) -> Option<Observation> {
    let found = outcome.identification()?;
    let (boresight, _) = found.attitude(AttitudeFrame::Icrs).boresight_and_up();
    Observation::new(priors.site?, &priors.date?.date, &boresight)
}
