//! Identification of a list of centroids.

use super::bodies::find_bodies;
use super::context::{Context, Workspace};
use super::deep::{Answered, identify_in_all};
use super::identification::{SecondImages, identified, observation, search, through_air_or_not};
use super::note::Note;
use super::outcome::Outcome;
use super::place_time::{ConfirmedPlaceTime, settle};
use super::solution::{Solution, SolvedSky};
use super::source::Source;
use super::stopwatch::{Stage, Stopwatch};
use crate::base::size::Size;
use crate::centroids::CentroidList;
use crate::centroids::CentroidListError;
use crate::centroids::ListFrame;
use crate::identify::{Priors, ScalePrior, ScaleSource};

/// What is known of a list whose frame has this size.
fn priors_of(size: Size, context: &Context) -> Priors {
    let of_camera = context.camera.as_ref().map(|camera| ScalePrior {
        source: ScaleSource::User,
        ..ScalePrior::of_camera(&camera.sheet)
    });
    let lens = context.lens_of(size.width, size.height);
    let lens_scale = lens.map(ScalePrior::of_lens);
    Priors {
        scale: context.priors.scale.or(lens_scale).or(of_camera),
        holds_lens: lens.is_some(),
        ..context.priors
    }
}

/// Identifies the stars of a list of centroids. A direction that is stated is tried first; every other prior is a
/// hard constraint.
///
/// Where nobody states the size of the frame, it is as large as the centroids reach, and the errors have
/// that its centre is not known.
///
/// # Errors
/// [`CentroidListError`] where the stated size is not that of the context's camera, or a centroid lies
/// outside the frame.
///
/// # Example
/// ```
/// use starpipe::identify::Photometry;
/// use starpipe::centroids::ListedCentroid;
/// use starpipe::{CameraModel, Catalog, CentroidList, Context, IndexedCatalog};
/// use starpipe::{Rotation, UnitVector, Workspace, solve_centroids};
///
/// // The stars to V 7 are enough for wide fields, and are indexed in a moment.
/// let catalog = Catalog::built_in().limited_to(7.0);
/// let indexed = IndexedCatalog::build(&catalog, &|_| ());
/// // What a camera of 20° sees of the Southern Cross.
/// let camera = CameraModel::pinhole(1024.0, 768.0, 2900.0, false);
/// let attitude = Rotation::looking_at(&UnitVector::from_ra_dec(3.3, -1.1), 0.5);
/// let centroids = catalog.stars().iter().filter_map(|star| {
///     let pixel = camera.pixel_of(&attitude.apply(&star.direction))?;
///     let listed = ListedCentroid::new(pixel, f64::from(star.v_mag));
///     camera.contains(&pixel).then_some(listed)
/// });
/// let list = CentroidList {
///     width: Some(1024),
///     height: Some(768),
///     photometry: Photometry::JohnsonV,
///     has_brightness: true,
///     centroids: centroids.collect(),
/// };
/// let solution = solve_centroids(&list, &Context::new(&indexed), &mut Workspace::new())?;
/// let found = solution.outcome.identification().expect("the stars are identified");
/// assert!(found.icrs_to_camera.angle_to(&attitude) < 1e-5);
/// # Ok::<(), starpipe::centroids::CentroidListError>(())
/// ```
pub fn solve_centroids(
    list: &CentroidList,
    context: &Context,
    workspace: &mut Workspace,
) -> Result<Solution, CentroidListError> {
    let mut clock = Stopwatch::start(context.on_stage);
    workspace.set_deadline(clock.deadline(context.time_limit));
    let (list, left_out) = list.usable();
    let frame = ListFrame::from_list(&list, &context.camera_sizes())?;
    let [width, height] = frame.size.sides();
    let priors = &priors_of(frame.size, context);
    let sources: Vec<Source> = list.centroids.iter().map(Source::from).collect();
    let limits = workspace.limits();
    let mut search = ListSearch {
        list: &list,
        sources: &sources,
        size: frame.size,
        workspace,
        clock: &mut clock,
    };
    let known = (context, priors);
    let identify = |context: &Context, priors: &Priors| search.identify(context, priors);
    let in_all = identify_in_all(known, frame.size, &limits, identify);
    let (deep, answer) = (in_all.named, in_all.answer);
    let (mut outcome, place_time) = (answer.outcome, answer.place_time);
    let usual = context.indexed.catalog();
    let catalog = deep.as_ref().map_or(usual, |deep| deep.catalog());
    let priors = &answer.priors;
    let second_images = SecondImages::find(&mut outcome, context.attitude_only, || {
        list.star_field_in(frame.size, priors.places())
    });
    if let Outcome::Identified(found) = &mut outcome {
        frame.add_unknown_centre(&list, found);
    }
    let observation = observation(&outcome, priors);
    let bodies = find_bodies(&mut outcome, &sources, priors, catalog);
    clock.lap(Stage::Identify);
    let unknown = (!list.has_brightness).then_some(Note::BrightnessUnknown);
    let found = outcome.identification();
    let notes = left_out
        .into_iter()
        .map(Note::RowsLeftOut)
        .chain(unknown)
        .chain(Note::of_guessed_size(&frame, found))
        .chain(Note::of_direction(in_all.other_than.as_ref(), &outcome))
        .chain(Note::of_place_time(place_time.as_ref()))
        .chain(Note::of_observation(observation.as_ref(), priors, &outcome))
        .chain(second_images.double.map(Note::DoubleImage))
        .chain(second_images.repeated.map(Note::RepeatedSky))
        .chain(Note::of_bodies(&bodies, &outcome, catalog))
        .chain(Note::of_residuals(found))
        .chain(Note::of_pointing(context.attitude_only, &outcome))
        .chain(Note::of_lens(context.lens.as_deref(), &outcome))
        .chain(Note::of_date(priors, &outcome))
        .collect();
    Ok(Solution {
        width,
        height,
        row_order: None,
        date: priors.date,
        notes,
        observation,
        place_time,
        site: priors.site,
        exposure_s: priors.exposure_s,
        spot_sigma_px: None,
        sky_area: None,
        sources,
        background: None,
        attitude_only: context.attitude_only,
        attitude_frame: context.attitude_frame,
        outcome,
        bodies,
        photometry: None,
        sky: None,
        deep: deep.map(SolvedSky),
        trails: None,
        comparison: None,
        gain_e_per_adu: None,
        calibration: None,
        timing: clock.timing(),
    })
}

/// The search for the stars of a list.
struct ListSearch<'a, 'c> {
    list: &'a CentroidList,
    sources: &'a [Source],
    size: Size,
    workspace: &'a mut Workspace,
    clock: &'a mut Stopwatch<'c>,
}

impl ListSearch<'_, '_> {
    fn identify(&mut self, context: &Context, priors: &Priors) -> ConfirmedPlaceTime {
        let mut identify = |places| {
            let field = self.list.star_field_in(self.size, places);
            let workspace = &mut self.workspace.identify;
            let (found, _) = search((&field, None), priors, context, workspace, self.clock);
            identified(found, None, &field, priors, context)
        };
        let answer = through_air_or_not(priors.places(), &mut identify);
        let known = (priors, context.utc_offset);
        let sky = (self.sources, context.indexed.catalog());
        settle(answer, known, sky, |places| {
            through_air_or_not(places, &mut identify)
        })
    }
}

impl Answered for ConfirmedPlaceTime {
    fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    fn outcome_mut(&mut self) -> &mut Outcome {
        &mut self.outcome
    }
}
