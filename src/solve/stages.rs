//! The stages in order.

use super::bodies::find_bodies;
use super::context::{Context, Workspace};
use super::deep::{Answered, InAll, identify_in_all};
use super::error::Error;
use super::explanation::explained;
use super::identification::{SecondImages, identify_stars, observation, through_air_or_not};
use super::note::Note;
use super::outcome::{Outcome, Reason};
use super::place_time::{ConfirmedPlaceTime, PlaceTime, settle};
use super::pointing::search_at_once;
use super::pointing_buffers::{TRIED_CHOICES, TRIED_STARS};
use super::prepared::Prepared;
use super::raw_color::RawColor;
use super::solution::{Solution, SolvedSky};
use super::solved::SolvedFrame;
use super::source::Source;
use super::star_field::star_field;
use super::stopwatch::{Stage, Stopwatch, Timing};
use crate::base::panics::caught;
use crate::base::size::Size;
use crate::calibration::Calibration;
use crate::detect::{
    self, DetectConfig, DetectError, Detections, Trail, look_for_brightest, measure_brightest_into,
};
use crate::ephemeris::places::StarPlaces;
use crate::frame::{self, Frame, FrameError, MemoryLimit, Mosaic};
use crate::identify::diagnosis::Unexplained;
use crate::identify::{Choices, IndexedCatalog, Priors, ScalePrior, SearchFailure, SkyRegion};
use crate::photometry::PictureColors;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;

/// Solves the frame in a file, or its image number `page`, counted from 1.
///
/// # Errors
/// [`Error::Read`] if there is no frame in the file, [`Error::Calibrate`] if the calibration is of
/// another camera, [`Error::Detect`] if stars cannot be detected in it.
///
/// # Example
/// ```
/// use starpipe::{Catalog, Context, IndexedCatalog, Workspace, solve_file};
///
/// // The stars to V 7 are enough for wide fields, and are indexed in a moment.
/// let catalog = Catalog::built_in().limited_to(7.0);
/// let indexed = IndexedCatalog::build(&catalog, &|_| ());
/// let context = Context::new(&indexed);
/// let file = "fixtures/orion/orion.png";
/// let solution = solve_file(file, None, &context, &mut Workspace::new())?;
/// let found = solution.outcome.identification().expect("the stars are identified");
/// let (boresight, _) = found.icrs_to_camera.boresight_and_up();
/// let (ra_rad, dec_rad) = boresight.to_ra_dec();
/// assert!((ra_rad.to_degrees() - 83.7).abs() < 0.001);
/// assert!((dec_rad.to_degrees() - -0.4).abs() < 0.001);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve_file(
    path: impl AsRef<Path>,
    page: Option<NonZeroUsize>,
    context: &Context,
    workspace: &mut Workspace,
) -> Result<Solution, Error> {
    let path = path.as_ref();
    let read = |buffers: &mut frame::Buffers| frame::read_page_with(path, page, buffers);
    let (solution, frame) = solve_read(path, read, context, workspace)?;
    workspace.frames.recycle(frame);
    Ok(solution)
}

/// Solves the frame that `read` returns, and returns it with the solution. Give it back to the
/// workspace once it is no longer needed ([`frame::Buffers::recycle`]). `name` is the file's name,
/// or stands for one.
///
/// # Errors
/// As [`solve_file`].
pub fn solve_read(
    name: &Path,
    read: impl FnOnce(&mut frame::Buffers) -> Result<Frame<'static>, FrameError>,
    context: &Context,
    workspace: &mut Workspace,
) -> Result<(Solution, Frame<'static>), Error> {
    let mut clock = Stopwatch::start(context.on_stage);
    workspace.set_deadline(clock.deadline(context.time_limit));
    workspace.frames.forget();
    let mut frame = read(&mut workspace.frames)?;
    // A flat evens out the levels by which a mosaic is found.
    let mosaic = Mosaic::of(&frame);
    let calibration = context.calibration;
    if let Some(calibration) = calibration {
        let checked = workspace.frames.check_floats(&frame);
        checked.map_err(|error| error.in_file(name))?;
        calibration
            .apply(&mut frame)
            .map_err(|source| Error::Calibrate {
                path: name.to_owned(),
                source,
            })?;
    }
    if context.as_stored {
        frame = frame.as_stored();
    }
    clock.lap(Stage::Read);
    let input = SolveInput {
        frame: &frame,
        name: Some(name),
        calibration,
        memory: workspace.frames.memory_of_frame(),
        mosaic,
        clock,
    };
    let solution = solve(input, context, workspace).map_err(|source| Error::Detect {
        path: name.to_owned(),
        source,
    })?;
    Ok((solution, frame))
}

/// Solves a frame in memory. It is not calibrated.
///
/// # Errors
/// [`DetectError`] if stars cannot be detected in it.
///
/// # Example
/// ```
/// use starpipe::{Catalog, Context, IndexedCatalog, Outcome, Workspace, frame, solve_frame};
///
/// // The stars to V 7 are enough for wide fields, and are indexed in a moment.
/// let catalog = Catalog::built_in().limited_to(7.0);
/// let indexed = IndexedCatalog::build(&catalog, &|_| ());
/// let context = Context::new(&indexed);
/// let mut workspace = Workspace::new();
/// let frame = frame::read("fixtures/cygnus/cygnus.tif")?;
/// match solve_frame(&frame, &context, &mut workspace)?.outcome {
///     Outcome::Identified(found) => {
///         let mut names = found.matches.iter().filter_map(|m| catalog.proper_name(m.star));
///         assert!(names.any(|name| name == "Sadr"));
///     }
///     Outcome::NotIdentified(reason) => panic!("{}", reason.code()),
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve_frame(
    frame: &Frame,
    context: &Context,
    workspace: &mut Workspace,
) -> Result<Solution, DetectError> {
    let clock = Stopwatch::start(context.on_stage);
    workspace.set_deadline(clock.deadline(context.time_limit));
    workspace.frames.forget();
    let input = SolveInput {
        frame,
        name: None,
        calibration: None,
        memory: workspace.frames.memory(),
        mosaic: Mosaic::of(frame),
        clock,
    };
    solve(input, context, workspace)
}

/// Calls `work`, which does all that is to be done with one frame. A panic in it becomes this frame's
/// error, and the workspace is emptied. `name` is the file's name, or stands for one.
///
/// # Errors
/// Those of `work`, and [`Error::Panicked`].
pub fn solve_guarded<R, E: From<Error>>(
    name: &Path,
    workspace: &mut Workspace,
    work: impl FnOnce(&mut Workspace) -> Result<R, E>,
) -> Result<R, E> {
    caught(|| work(workspace)).unwrap_or_else(|source| {
        *workspace = workspace.emptied();
        let path = name.to_owned();
        Err(Error::Panicked { path, source }.into())
    })
}

/// A frame, and what is known of its origin.
struct SolveInput<'a> {
    frame: &'a Frame<'a>,
    name: Option<&'a Path>,
    /// The calibration that was applied.
    calibration: Option<&'a Calibration>,
    /// For the frame and the work on it.
    memory: MemoryLimit,
    /// The mosaic of a raw color frame.
    mosaic: Option<Mosaic>,
    clock: Stopwatch<'a>,
}

/// The spine: every stage once, in order.
fn solve(
    input: SolveInput,
    context: &Context,
    workspace: &mut Workspace,
) -> Result<Solution, DetectError> {
    let (raw, calibration, mut clock) = (input.frame, input.calibration, input.clock);
    let priors = context.priors_of(raw, input.name);

    let config = context.detect_config(raw);
    let prepared = Prepared::new(raw, input.mosaic, &config, input.memory)?;
    workspace.detect.set_memory(prepared.memory);
    let frame = prepared.frame();
    let mut stage = StarSearch {
        prepared: &prepared,
        priors: &priors,
        context,
        workspace,
    };
    let Some((found, more_stars)) = stage.find(&config, &mut clock)? else {
        let timing = clock.timing();
        return Ok(not_in_time(raw, calibration, &priors, context, timing));
    };
    let FoundStars {
        detections,
        mosaic,
        stars,
        deep,
        other_than,
    } = found;
    let IdentifiedStars {
        mut outcome,
        dropped_scale,
        places,
        priors,
        place_time,
    } = stars;
    outcome = stage.explained(outcome, &detections, calibration);
    let trails = stage.trails(&detections, &mut clock);
    let over_deep = deep.as_ref().map(|deep| context.over(deep));
    let context = over_deep.as_ref().unwrap_or(context);
    let sources: Vec<Source> = detections.sources.iter().map(Source::from).collect();
    let bodies = find_bodies(&mut outcome, &sources, &priors, context.indexed.catalog());
    let second_images = SecondImages::find(&mut outcome, context.attitude_only, || {
        star_field(frame, &detections, places)
    });
    clock.lap(Stage::Identify);

    let mut solved = SolvedFrame {
        context,
        frame,
        calibration,
        mosaic,
        observation: observation(&outcome, &priors),
        priors,
        place_time,
        trails,
        detections,
        sources,
        outcome,
        bodies,
        second_images,
        dropped_scale,
        other_than,
        more_stars,
        defects: &prepared.defects,
        photometry: None,
        sky: None,
    };
    let mut comparison = None;
    if !context.attitude_only {
        solved.measure_photometry();
        comparison = solved.compare_with_camera();
        if context.measure_sky || (context.measure_known_sky && solved.shows_whole_sky()) {
            let colors = || colors_of(&prepared, calibration, context, workspace);
            solved.measure_sky(comparison.as_ref(), &colors);
        }
    }
    clock.lap(Stage::Photometry);
    let solution = solved.into_solution(comparison, clock.timing());
    Ok(Solution {
        deep: deep.map(SolvedSky),
        ..solution
    })
}

/// Reads the colors of a frame: those behind its mosaic, or of the file of which it was read, calibrated as it was.
fn colors_of<'a>(
    prepared: &'a Prepared,
    calibration: Option<&Calibration>,
    context: &Context,
    workspace: &Workspace,
) -> Option<PictureColors<'a>> {
    if let Some(raw) = prepared.color() {
        return Some(PictureColors::Raw(raw));
    }
    let mut frames = workspace.frames.red_and_blue(prepared.raw())?;
    if let Some(calibration) = calibration {
        for frame in &mut frames {
            calibration.apply(frame).ok()?;
        }
    }
    if context.as_stored {
        frames = frames.map(Frame::as_stored);
    }
    Some(PictureColors::RedAndBlue(Box::new(frames)))
}

/// The search for the stars of a frame.
struct StarSearch<'a, 'c> {
    prepared: &'a Prepared<'a>,
    priors: &'a Priors,
    context: &'a Context<'c>,
    workspace: &'a mut Workspace,
}

/// The stars of a frame, and which they are.
struct FoundStars {
    detections: Detections,
    mosaic: Option<RawColor>,
    stars: IdentifiedStars,
    /// The stars that they are, where it took a deep catalogue.
    deep: Option<Arc<IndexedCatalog<'static>>>,
    /// The direction that was stated, where the stars show another.
    other_than: Option<SkyRegion>,
}

/// Which stars they are.
struct IdentifiedStars {
    outcome: Outcome,
    /// The scale that was dropped because nothing matched with it.
    dropped_scale: Option<ScalePrior>,
    /// Where the catalogue's stars appear.
    places: StarPlaces,
    /// What is known of the frame, as far as the stars do not contradict it.
    priors: Priors,
    /// What they contradict.
    place_time: Option<PlaceTime>,
}

impl StarSearch<'_, '_> {
    /// Lines of light beside the stars, where they are wanted.
    fn trails(&self, detections: &Detections, clock: &mut Stopwatch) -> Option<Vec<Trail>> {
        let search = &self.workspace.detect;
        let found = |()| search.find_trails(self.prepared.frame(), detections);
        let trails = self.context.find_trails.then_some(()).map(found);
        clock.lap(Stage::Detect);
        trails
    }

    /// The outcome, with what the picture shows where the stars are not identified.
    fn explained(
        &self,
        outcome: Outcome,
        detections: &Detections,
        calibration: Option<&Calibration>,
    ) -> Outcome {
        let (prepared, context, workspace) = (self.prepared, self.context, &*self.workspace);
        let colors = || match colors_of(prepared, calibration, context, workspace)? {
            PictureColors::RedAndBlue(frames) => Some(*frames),
            // Those of a raw frame are not balanced: no sky is gray in them.
            PictureColors::Raw(_) => None,
        };
        let picture = Unexplained {
            frame: prepared.frame(),
            detections,
            colors: &colors,
        };
        explained(outcome, &picture, &workspace.detect)
    }

    /// Detects the stars; `None` if that was not done in time.
    fn detect(
        &mut self,
        config: &DetectConfig,
        clock: &mut Stopwatch,
    ) -> Result<Option<(Detections, Option<RawColor>)>, DetectError> {
        let frame = self.prepared.frame();
        let detected = detect::detect(frame, config, &mut self.workspace.detect);
        clock.lap(Stage::Detect);
        let mut detections = match detected {
            Err(DetectError::Interrupted(_)) => return Ok(None),
            detected => detected?,
        };
        detections.sky_area = self.workspace.detect.sky_area(frame, &detections);
        let color = self.prepared.color();
        let mosaic = color.map(|color| RawColor::restore(&color, &mut detections));
        clock.lap(Stage::Detect);
        Ok(Some((detections, mosaic)))
    }

    /// Detects the stars and identifies them; `None` if detection was not done in time.
    fn run(
        &mut self,
        config: &DetectConfig,
        clock: &mut Stopwatch,
    ) -> Result<Option<FoundStars>, DetectError> {
        let Some((detections, mosaic)) = self.detect(config, clock)? else {
            return Ok(None);
        };
        let InAll {
            answer: stars,
            named: deep,
            other_than,
        } = self.identify_in_all(&detections, clock);
        let mut found = FoundStars {
            detections,
            mosaic,
            stars,
            deep,
            other_than,
        };
        let held = self.context.fixed_camera.as_ref();
        if !found.are_identified()
            && let Some(spot_sigma_px) = held.and_then(|held| held.spot_sigma_px)
        {
            // Behind clouds, what was measured as the size of stars may be that of clouds.
            let config = DetectConfig {
                spot_sigma_px: config.spot_sigma_px.or(Some(spot_sigma_px)),
                ..config.clone()
            };
            if let Some(again) = self.detect(&config, clock)? {
                (found.detections, found.mosaic) = again;
            }
        }
        Ok(Some(found))
    }

    /// Identifies stars with the catalogue of all frames or with deep ones.
    fn identify_in_all(
        &mut self,
        detections: &Detections,
        clock: &mut Stopwatch,
    ) -> InAll<IdentifiedStars> {
        let (context, priors, prepared) = (self.context, self.priors, self.prepared);
        let frame = prepared.frame();
        let size = Size::new(frame.width, frame.height);
        let limits = self.workspace.limits();
        identify_in_all((context, priors), size, &limits, |context, priors| {
            let mut search = StarSearch {
                prepared,
                priors,
                context,
                workspace: &mut *self.workspace,
            };
            search.identify(detections, None, clock)
        })
    }

    /// The stars that are wanted, and how many of them were, where more were needed to identify them; `None` if
    /// detection was not done in time.
    fn find(
        &mut self,
        config: &DetectConfig,
        clock: &mut Stopwatch,
    ) -> Result<Option<(FoundStars, Option<usize>)>, DetectError> {
        let Some(found) = self.find_wanted(config, clock)? else {
            return Ok(None);
        };
        if found.may_lack_stars(config) {
            let all = DetectConfig {
                max_detections: DetectConfig::DEFAULT_MAX_DETECTIONS,
                ..config.clone()
            };
            let more = self.run(&all, clock)?;
            if let Some(more) = more.filter(FoundStars::are_identified) {
                return Ok(Some((more, Some(config.max_detections))));
            }
        }
        Ok(Some((found, None)))
    }

    /// The stars that are wanted: of the pointing alone, the brightest, if these show it; `None` if detection was
    /// not done in time.
    fn find_wanted(
        &mut self,
        config: &DetectConfig,
        clock: &mut Stopwatch,
    ) -> Result<Option<FoundStars>, DetectError> {
        if self.context.attitude_only && !self.context.find_trails {
            match self.point(config, clock) {
                Ok(None) | Err(DetectError::Interrupted(_)) => {}
                pointed => return pointed,
            }
        }
        self.run(config, clock)
    }

    /// The brightest stars, where they show beyond doubt where the camera points.
    ///
    /// # Errors
    /// As [`detect`](detect::detect()).
    fn point(
        &mut self,
        config: &DetectConfig,
        clock: &mut Stopwatch,
    ) -> Result<Option<FoundStars>, DetectError> {
        let frame = self.prepared.frame();
        look_for_brightest(frame, config, &mut self.workspace.detect)?;
        clock.lap(Stage::Detect);
        for (count, tried) in TRIED_STARS.into_iter().zip(TRIED_CHOICES) {
            let mut detections = Detections::default();
            let detector = &mut self.workspace.detect;
            measure_brightest_into(frame, config, count, detector, &mut detections)?;
            clock.lap(Stage::Detect);
            let stars = self.identify(&detections, Some(tried), clock);
            if stars.outcome.identification().is_some() {
                return Ok(Some(FoundStars {
                    detections,
                    mosaic: None,
                    stars,
                    deep: None,
                    other_than: None,
                }));
            }
        }
        Ok(None)
    }

    /// Identifies stars, as far as what is known of the frame holds; only what is tried `at_once`, if that is stated.
    fn identify(
        &mut self,
        detections: &Detections,
        at_once: Option<Choices>,
        clock: &mut Stopwatch,
    ) -> IdentifiedStars {
        let frame = self.prepared.frame();
        let (priors, context) = (self.priors, self.context);
        let mut dropped_scale = None;
        let mut identify = |places| {
            let held = context.fixed_camera.as_ref();
            let near = held.and_then(|held| held.near(priors, &places));
            let mut outcome = None;
            for priors in near.iter().chain([priors]) {
                let known = (priors, places);
                let workspace = &mut *self.workspace;
                let (found, dropped) = match at_once {
                    Some(tried) => {
                        let stars = (detections, tried);
                        search_at_once(frame, stars, known, context, workspace, clock)
                    }
                    None => identify_stars(frame, detections, known, context, workspace, clock),
                };
                dropped_scale = dropped;
                let is_identified = found.identification().is_some();
                outcome = Some(found);
                if is_identified {
                    break;
                }
            }
            outcome.unwrap_or(Outcome::NotIdentified(Reason::Search(
                SearchFailure::Interrupted,
            )))
        };
        let answer = through_air_or_not(priors.places(), &mut identify);
        let sources: Vec<Source> = detections.sources.iter().map(Source::from).collect();
        let known = (priors, context.utc_offset);
        let sky = (&sources[..], context.indexed.catalog());
        let ConfirmedPlaceTime {
            outcome,
            places,
            priors,
            place_time,
        } = settle(answer, known, sky, |places| {
            through_air_or_not(places, &mut identify)
        });
        IdentifiedStars {
            outcome,
            dropped_scale,
            places,
            priors,
            place_time,
        }
    }
}

impl Answered for IdentifiedStars {
    fn outcome(&self) -> &Outcome {
        &self.outcome
    }

    fn outcome_mut(&mut self) -> &mut Outcome {
        &mut self.outcome
    }
}

impl FoundStars {
    /// Whether the stars are not identified, and fewer of them were wanted than usual. That may cost
    /// depth, but never the answer.
    fn may_lack_stars(&self, config: &DetectConfig) -> bool {
        let interrupted = Reason::Search(SearchFailure::Interrupted);
        self.detections.is_truncated
            && config.max_detections < DetectConfig::DEFAULT_MAX_DETECTIONS
            && matches!(&self.stars.outcome, Outcome::NotIdentified(reason) if *reason != interrupted)
    }

    fn are_identified(&self) -> bool {
        self.stars.outcome.identification().is_some()
    }
}

/// The solution of a frame whose stars were not detected in time.
fn not_in_time(
    frame: &Frame,
    calibration: Option<&Calibration>,
    priors: &Priors,
    context: &Context,
    timing: Timing,
) -> Solution {
    let camera = context.camera.as_ref();
    Solution {
        width: frame.width,
        height: frame.height,
        row_order: Some(frame.metadata.row_order),
        date: priors.date,
        observation: None,
        place_time: None,
        site: priors.site,
        exposure_s: priors.exposure_s,
        spot_sigma_px: None,
        sky_area: None,
        notes: Note::of_file(&frame.metadata).collect(),
        sources: Vec::new(),
        background: None,
        attitude_only: context.attitude_only,
        attitude_frame: context.attitude_frame,
        outcome: Outcome::NotIdentified(Reason::Search(SearchFailure::Interrupted)),
        bodies: Vec::new(),
        trails: None,
        photometry: None,
        sky: None,
        deep: None,
        comparison: None,
        gain_e_per_adu: camera.map(|camera| camera.sheet.gain_e_per_adu),
        calibration: calibration.map(Calibration::applied),
        timing,
    }
}
