//! Lists of centroids, and their identification.

use super::bodies::find_bodies;
use super::centroid_table::CentroidListError;
use super::context::{Context, Workspace};
use super::identification::{SecondImages, identified, observation, search, through_air_or_not};
use super::left_out::{LeftOut, RowProblem};
use super::list_frame::{ListFrame, reached_size};
use super::note::Note;
use super::place_time::{Settled, settle};
use super::solution::{Solution, Source};
use super::stopwatch::{Stage, Stopwatch};
use crate::base::coords::PixelPoint;
use crate::base::size::Size;
use crate::detect::DetectionFlags;
use crate::identify::{
    ObservedStar, Photometry, Priors, ScalePrior, ScaleSource, SourceIndex, StarField,
};
use crate::sky::places::StarPlaces;
use std::collections::HashMap;

/// Standard error assumed on each axis of a centroid that is listed without one, in pixels.
pub const LISTED_SIGMA_PX: f64 = 0.5;

/// Centroids closer than this are one star that is listed twice, in pixels: the error assumed.
const COINCIDENT_PX: f64 = LISTED_SIGMA_PX;

/// A list of centroids.
#[derive(Debug, Clone, PartialEq)]
pub struct CentroidList {
    /// Columns of the frame that they come from, where they are stated. Else they are the camera's, and
    /// without a camera as many as the centroids reach.
    pub width: Option<usize>,
    /// Rows, likewise.
    pub height: Option<usize>,
    /// What the magnitudes are.
    pub photometry: Photometry,
    /// Whether the brightnesses are known. If not, the magnitudes give their order alone.
    pub has_brightness: bool,
    /// The centroids, in any order.
    pub centroids: Vec<ListedCentroid>,
}

/// One line of a list of centroids.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ListedCentroid {
    /// The position.
    pub position: PixelPoint,
    /// Brightness in magnitudes, see [`CentroidList::photometry`].
    pub mag: f64,
    /// Flux, if the list gives it.
    pub flux: Option<f64>,
    /// Standard error on one axis in pixels, if the list gives it.
    pub sigma_px: Option<f64>,
    /// Flags, if the list gives them. Sources that are not stars are not used for identification.
    pub flags: DetectionFlags,
    /// Where it stands in its list, from 1: the line of a file, the place in an array; 0 if unknown.
    pub row: u64,
}

impl ListedCentroid {
    /// A centroid of which only position and magnitude are known.
    pub fn new(position: PixelPoint, mag: f64) -> Self {
        Self {
            position,
            mag,
            flux: None,
            sigma_px: None,
            flags: DetectionFlags::default(),
            row: 0,
        }
    }

    /// Standard error on one axis, stated or assumed, in pixels.
    pub(super) fn error_px(&self) -> f64 {
        self.sigma_px.unwrap_or(LISTED_SIGMA_PX)
    }

    /// A magnitude for the star of this rank, from 0, in a list that is in order of brightness.
    ///
    /// Stars brighter than m are as many as 10^(m/2) on the sky. The magnitudes span half of that, so
    /// that a list in another order is not far from the truth either.
    pub fn mag_of_rank(rank: usize) -> f64 {
        libm::log10(rank as f64 + 1.0)
    }

    /// Why it cannot be used, if it cannot.
    pub fn problem(&self) -> Option<RowProblem> {
        let has_place = self.position.x.is_finite() && self.position.y.is_finite();
        if has_place && self.flux.is_some_and(|flux| flux <= 0.0) {
            return Some(RowProblem::NoFlux);
        }
        if !has_place || !self.mag.is_finite() {
            return Some(RowProblem::NoNumber);
        }
        let is_error = |sigma_px: f64| sigma_px > 0.0 && sigma_px.is_finite();
        let has_error = self.sigma_px.is_none_or(is_error);
        (!has_error).then_some(RowProblem::NoError)
    }
}

impl CentroidList {
    /// The centroids that can be used, brightest first, and what is left out: rows without a number,
    /// with a flux or an error of 0 or below, and those that coincide with a brighter one.
    pub fn usable(&self) -> (Self, Vec<LeftOut>) {
        let mut problems = Vec::new();
        let mut usable = Vec::new();
        for centroid in &self.centroids {
            match centroid.problem() {
                Some(problem) => problems.push((problem, centroid.row)),
                None => usable.push(*centroid),
            }
        }
        usable.sort_by(|a, b| a.mag.total_cmp(&b.mag));
        let is_kept = without_coincident(&usable);
        let centroids = usable.into_iter().zip(is_kept);
        let (kept, coincident): (Vec<_>, Vec<_>) = centroids.partition(|(_, is_kept)| *is_kept);
        let rows = coincident.iter().map(|(centroid, _)| centroid.row);
        problems.extend(rows.map(|row| (RowProblem::Coincident, row)));
        let list = Self {
            centroids: kept.into_iter().map(|(centroid, _)| centroid).collect(),
            ..self.clone()
        };
        (list, LeftOut::of(&problems))
    }

    /// The star field of a list that is sorted by brightness; `places` is where the catalogue's stars
    /// appear. A side of the frame that is not stated is as long as the centroids reach.
    pub fn star_field(&self, places: StarPlaces) -> StarField {
        self.star_field_in(reached_size(self, [self.width, self.height]), places)
    }

    /// The same in a frame of this size.
    pub(super) fn star_field_in(&self, size: Size, places: StarPlaces) -> StarField {
        let observed = |(line, centroid): (usize, &ListedCentroid)| ObservedStar {
            source: SourceIndex::new(line),
            position: centroid.position,
            sigma_px: centroid.error_px(),
            mag: centroid.mag,
            is_saturated: centroid.flags.saturated,
        };
        let lines = self.centroids.iter().enumerate();
        let stars = lines.filter(|(_, centroid)| centroid.flags.is_star_like());
        StarField {
            width_px: size.width as f64,
            height_px: size.height as f64,
            photometry: self.photometry,
            places,
            spot_sigma_px: None,
            sky_area: None,
            stars: stars.map(observed).collect(),
        }
    }
}

/// For each of these centroids, brightest first, whether no brighter one coincides with it.
fn without_coincident(centroids: &[ListedCentroid]) -> Vec<bool> {
    // Cells of the size of the distance: what coincides is in the same or a neighboring cell.
    let cell = |at: f64| (at / COINCIDENT_PX).floor() as i64;
    let mut kept: HashMap<[i64; 2], Vec<PixelPoint>> = HashMap::new();
    let is_kept = |centroid: &ListedCentroid| {
        let place = centroid.position;
        let [x, y] = [cell(place.x), cell(place.y)];
        let near = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| [x, y]));
        let mut brighter = near.filter_map(|cell| kept.get(&cell)).flatten();
        let is_alone = !brighter
            .any(|other| libm::hypot(other.x - place.x, other.y - place.y) < COINCIDENT_PX);
        if is_alone {
            kept.entry([x, y]).or_default().push(place);
        }
        is_alone
    };
    centroids.iter().map(is_kept).collect()
}

impl From<&ListedCentroid> for Source {
    fn from(centroid: &ListedCentroid) -> Self {
        Self {
            position: centroid.position,
            measured: None,
            flux: centroid.flux,
        }
    }
}

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

/// Identifies the stars of a list of centroids. Every prior is a hard constraint.
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
/// use starpipe::pipeline::ListedCentroid;
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
/// # Ok::<(), starpipe::pipeline::CentroidListError>(())
/// ```
pub fn solve_centroids(
    list: &CentroidList,
    context: &Context,
    workspace: &mut Workspace,
) -> Result<Solution, CentroidListError> {
    let mut clock = Stopwatch::start(context.on_stage);
    workspace.set_deadline(clock.deadline(context.time_limit));
    let (list, left_out) = list.usable();
    let frame = ListFrame::of(&list, &context.camera_sizes())?;
    let [width, height] = frame.size.sides();
    let priors = &priors_of(frame.size, context);
    let sources: Vec<Source> = list.centroids.iter().map(Source::from).collect();
    let catalog = context.indexed.catalog();
    let mut identify = |places| {
        let field = list.star_field_in(frame.size, places);
        let workspace = &mut workspace.identify;
        let (found, _) = search((&field, None), priors, context, workspace, &mut clock);
        identified(found, None, &field, priors, context.indexed)
    };
    let answer = through_air_or_not(priors.places(), &mut identify);
    let known = (priors, context.utc_offset);
    let Settled {
        mut outcome,
        priors,
        place_time,
        ..
    } = settle(answer, known, (&sources, catalog), |places| {
        through_air_or_not(places, &mut identify)
    });
    let priors = &priors;
    let second_images = SecondImages::of(&mut outcome, context.attitude_only, || {
        list.star_field_in(frame.size, priors.places())
    });
    frame.add_unknown_centre(&list, &mut outcome);
    let observation = observation(&outcome, priors);
    let bodies = find_bodies(&mut outcome, &sources, priors, catalog);
    clock.lap(Stage::Identify);
    let note = Note::of_observation(observation.as_ref(), priors, &outcome);
    let note = Note::of_place_time(place_time.as_ref()).chain(note);
    let notes = left_out.into_iter().map(Note::RowsLeftOut);
    let unknown = (!list.has_brightness).then_some(Note::BrightnessUnknown);
    let guessed = Note::of_guessed_size(&frame, outcome.identification());
    let notes = notes.chain(unknown).chain(guessed).chain(note);
    let notes = notes
        .chain(second_images.double.map(Note::DoubleImage))
        .chain(second_images.repeated.map(Note::RepeatedSky));
    let notes = notes.chain(Note::of_bodies(&bodies, &outcome, catalog));
    let notes = notes.chain(Note::of_residuals(outcome.identification()));
    let notes = notes.chain(Note::of_pointing(context.attitude_only, &outcome));
    let notes = notes.chain(Note::of_lens(context.lens.as_deref(), &outcome));
    let notes = notes.chain(Note::of_date(priors, &outcome));
    Ok(Solution {
        width,
        height,
        row_order: None,
        date: priors.date,
        notes: notes.collect(),
        observation,
        place_time,
        site: priors.site,
        exposure_s: priors.exposure_s,
        spot_sigma_px: None,
        sources,
        background: None,
        attitude_only: context.attitude_only,
        attitude_frame: context.attitude_frame,
        outcome,
        bodies,
        photometry: None,
        sky: None,
        trails: None,
        comparison: None,
        gain_e_per_adu: None,
        calibration: None,
        timing: clock.timing(),
    })
}
