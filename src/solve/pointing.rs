//! The pointing first: where the camera points, from the brightest stars, before all else is measured.
//!
//! A star tracker, a telescope that is pushed by hand and a night of ten thousand frames want it now, and the
//! rest later or not at all.

use super::context::{Context, Workspace};
use super::identification::prepare;
use super::outcome::{Outcome, Reason};
use super::pointing_buffers::{PointingBuffers, TRIED_CHOICES, TRIED_STARS};
use super::star_field::fill_field;
use super::stopwatch::{Stage, Stopwatch};
use crate::detect::{DetectError, Detections, look_for_brightest, measure_brightest_into};
use crate::ephemeris::places::StarPlaces;
use crate::frame::Frame;
use crate::identify::{
    self, Choices, Identification, Priors, ScalePrior, SearchFailure, StarField,
};

/// Attitude and optics of a frame from its brightest stars; `None` where they do not show beyond doubt where it
/// points, and [`solve_frame`](super::solve_frame()) may find out. Nothing is allocated after the first frame of a
/// size.
///
/// # Errors
/// [`DetectError`] if stars cannot be detected in it.
///
/// # Example
/// ```
/// use starpipe::{Catalog, Context, IndexedCatalog, Workspace, find_pointing_in, frame};
///
/// // The stars to V 7 are enough for wide fields, and are indexed in a moment.
/// let catalog = Catalog::built_in().limited_to(7.0);
/// let indexed = IndexedCatalog::build(&catalog, &|_| ());
/// let frame = frame::read("fixtures/orion/orion.png")?;
/// let mut workspace = Workspace::new();
/// let found = find_pointing_in(&frame, &Context::new(&indexed), &mut workspace)?;
/// let found = found.expect("the brightest stars are enough");
/// let (ra_rad, dec_rad) = found.icrs_to_camera.boresight().to_ra_dec();
/// assert!((ra_rad.to_degrees() - 83.7).abs() < 0.001);
/// assert!((dec_rad.to_degrees() - -0.4).abs() < 0.001);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn find_pointing_in<'w>(
    frame: &Frame,
    context: &Context,
    workspace: &'w mut Workspace,
) -> Result<Option<&'w Identification>, DetectError> {
    let priors = context.priors_of(frame, None);
    let config = context.detect_config(frame);
    let Workspace {
        detect,
        identify,
        pointing: PointingBuffers { detections, field },
        ..
    } = workspace;
    look_for_brightest(frame, &config, detect)?;
    for (count, tried) in TRIED_STARS.into_iter().zip(TRIED_CHOICES) {
        measure_brightest_into(frame, &config, count, detect, detections)?;
        let field = fill_field(field, frame, detections, priors.places());
        if attitude_at_once((field, tried), &priors, context, identify).is_ok() {
            return Ok(identify.answer());
        }
    }
    Ok(None)
}

/// Attitude and optics of `field` by what is `tried` of it, with the errors that follow from what is not known.
fn attitude_at_once<'w>(
    (field, tried): (&StarField, Choices),
    priors: &Priors,
    context: &Context,
    workspace: &'w mut identify::Workspace,
) -> Result<&'w Identification, SearchFailure> {
    let lens = prepare(workspace, priors, context);
    let found = workspace.attitude_at_once(field, priors, context.indexed, tried)?;
    found.lens_is_known = lens.is_some();
    if priors.date.is_none() {
        found.add_unknown_aberration();
    }
    Ok(found)
}

/// Searches the brightest stars, at once or not at all.
pub(super) fn search_at_once(
    frame: &Frame,
    (detections, tried): (&Detections, Choices),
    (priors, places): (&Priors, StarPlaces),
    context: &Context,
    workspace: &mut Workspace,
    clock: &mut Stopwatch,
) -> (Outcome, Option<ScalePrior>) {
    let Workspace {
        identify, pointing, ..
    } = workspace;
    let field = fill_field(&mut pointing.field, frame, detections, places);
    let found = attitude_at_once((field, tried), priors, context, identify);
    clock.lap(Stage::Pointing);
    let outcome = match found {
        Ok(found) => Outcome::Identified(Box::new(found.clone())),
        Err(failure) => Outcome::NotIdentified(Reason::Search(failure)),
    };
    (outcome, None)
}
