//! From frame to frame: windows around predicted stars, or a full solution.

use super::agreement::{Agreement, density_px2};
use super::guides::{GuideStar, Guides, Wanted};
use super::lens::LensRefiner;
use super::motion::{AttitudeMotion, MotionPrediction};
use super::outcome::{Attitude, Loss, Mode, Track, TrackedStar};
use super::pose::{PoseFitter, PosePrior, PoseStar};
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::base::statistics::median;
use crate::camera::CameraModel;
use crate::catalog::Catalog;
use crate::detect::DetectError;
use crate::detect::windows::{ExpectedStar, FoundStar, SpotModel, WindowDetector};
use crate::ephemeris::places::{AttitudeFrame, StarPlaces};
use crate::frame::{Frame, SaturationFinder};
use crate::identify::{
    Identification, LOG10_FALSE_ALARM_LIMIT, MIN_STARS, Scale, ScalePrior, ScaleSource,
};
use crate::photometry::instrumental_mag;
use crate::solve::{Context, Outcome, Solution, Workspace, solve_frame};
use nalgebra::{Matrix3, RowVector3, Vector3};

/// Default number of stars that are tracked.
pub const DEFAULT_STARS: usize = 30;

/// Search radius in predicted errors, …
const RADIUS_SIGMAS: f64 = 4.0;
/// … to which this is added, in pixels: the peak is not the centroid.
const MIN_RADIUS_PX: f64 = 1.5;
/// Stars are not searched for within a larger radius, in pixels: a full solution is more certain.
const MAX_RADIUS_PX: f64 = 16.0;
/// An error of the prediction that an unknown acceleration may cause, in pixels.
const TYPICAL_ERROR_PX: f64 = 2.0;
/// Least signal-to-noise ratio of a star that is tracked.
const MIN_SNR: f64 = 8.0;
/// Share of the saturation level that the peak of a star may reach.
const MAX_PEAK: f64 = 0.8;
/// Largest difference of a star's magnitude from the catalogue's, relative to that of most stars.
const MAG_TOLERANCE: f64 = 1.5;
/// Frames from one refinement of the camera to the next.
const REFINED_EVERY: u64 = 8;
/// The weight of one frame in the mean of what lacks in the stated errors, and in the zero point.
const AVERAGED_FRACTION: f64 = 0.05;
/// How far a full solution's scale may be off that of the frames before it.
const SCALE_TOLERANCE: f64 = 0.02;
/// A full solution's focal length that differs by more standard errors is of another camera.
const OTHER_CAMERA_SIGMAS: f64 = 6.0;
/// Smears shorter than this, in pixels, count as points.
const MIN_SMEAR_PX: f64 = 0.3;

/// Follows the attitude of one camera from frame to frame.
pub struct Tracker<'a> {
    context: Context<'a>,
    stars: usize,
    workspace: Workspace,
    detector: WindowDetector,
    guides: Guides,
    pose: PoseFitter,
    agreement: Agreement,
    buffers: TrackBuffers,
    known: Option<TrackerState>,
}

/// What is known after a frame.
struct TrackerState {
    motion: AttitudeMotion,
    lens: LensRefiner,
    spot: Option<SpotModel>,
    light: StarBrightness,
    /// Time of the last attitude or try, in seconds or frames.
    clock: Clock,
    places: StarPlaces,
    exposure_s: Option<f64>,
    /// Squared error that the stated ones lack, in px²; negative where they are too large.
    excess_variance_px2: f64,
    /// Frames since the camera was refined.
    frames: u64,
}

/// Brightness of the stars of a camera.
#[derive(Debug, Clone, Copy)]
struct StarBrightness {
    /// V magnitude of a star with a flux of 1 ADU.
    zero_point_mag: f64,
    /// Flux of a star with the least signal-to-noise ratio, in ADU.
    least_flux_adu: f64,
    background_adu: f64,
    saturation_adu: f32,
    /// Density of sources, per px².
    density_px2: f64,
}

/// Time of frames: in seconds, or counted.
#[derive(Debug, Clone, Copy)]
struct Clock {
    time: f64,
    is_counted: bool,
}

#[derive(Debug, Default)]
struct TrackBuffers {
    expected: Vec<ExpectedStar>,
    /// The star of each place.
    guides: Vec<GuideStar>,
    found: Vec<Option<FoundStar>>,
    stars: Vec<PoseStar>,
    mags: Vec<f64>,
    sorted: Vec<f64>,
}

impl<'a> Tracker<'a> {
    /// A tracker that knows no attitude yet. `context` is that of the full solutions.
    pub fn new(context: Context<'a>) -> Self {
        Self {
            context,
            stars: DEFAULT_STARS,
            workspace: Workspace::new(),
            detector: WindowDetector::default(),
            guides: Guides::default(),
            pose: PoseFitter::default(),
            agreement: Agreement::default(),
            buffers: TrackBuffers::default(),
            known: None,
        }
    }

    /// Forgets everything: the next frame is solved in full, in new buffers.
    pub fn reset(&mut self) {
        let empty = Self::new(self.context.clone()).with_stars(self.stars);
        *self = empty.with_workspace(self.workspace.emptied());
    }

    /// The same, with at most this many stars in a frame.
    #[must_use]
    pub fn with_stars(self, stars: usize) -> Self {
        Self { stars, ..self }
    }

    /// The same, with these buffers for full solutions.
    #[must_use]
    pub fn with_workspace(self, workspace: Workspace) -> Self {
        Self { workspace, ..self }
    }

    /// Buffers of the full solutions: for reading the next frame.
    pub fn workspace(&mut self) -> &mut Workspace {
        &mut self.workspace
    }

    /// The attitude of the next frame. `time_s` is the middle of its exposure, in seconds from any
    /// origin; where it is `None` frames are taken to have equal intervals, and rates are per frame.
    ///
    /// The frame is not calibrated. In steady state a tracked frame allocates nothing.
    ///
    /// # Errors
    /// [`DetectError`] if stars cannot be detected in it.
    ///
    /// # Example
    /// ```
    /// use starpipe::track::{Mode, Tracker};
    /// use starpipe::{Catalog, Context, IndexedCatalog, frame};
    ///
    /// // The stars to V 7 are enough for wide fields, and are indexed in a moment.
    /// let catalog = Catalog::built_in().limited_to(7.0);
    /// let indexed = IndexedCatalog::build(&catalog, &|_| ());
    /// let mut tracker = Tracker::new(Context::new(&indexed));
    /// // A camera at rest: the same frame again and again.
    /// let frame = frame::read("fixtures/cygnus/cygnus.tif")?;
    /// let mut modes = Vec::new();
    /// for time_s in [0.0, 0.1, 0.2] {
    ///     let track = tracker.process_frame(&frame, Some(time_s))?;
    ///     modes.push(track.mode);
    ///     if let Some(rate) = track.rate {
    ///         // In radians per second.
    ///         assert!(rate.rad.norm() < 1e-3);
    ///     }
    /// }
    /// assert_eq!(modes, [Mode::Acquired, Mode::Acquired, Mode::Tracked]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn process_frame(
        &mut self,
        frame: &Frame,
        time_s: Option<f64>,
    ) -> Result<Track, DetectError> {
        let clock = self.clock(time_s);
        let mut track = match self.track(frame, clock) {
            Ok(track) => track,
            Err(loss) => self.solve(frame, clock, loss)?,
        };
        track.time_s = time_s;
        track.attitude_frame = self.context.attitude_frame;
        Ok(track)
    }

    /// The stars that the attitude of the last tracked frame was fitted to.
    pub fn used_stars(&self) -> impl Iterator<Item = TrackedStar> + '_ {
        let stars = self.buffers.stars.iter().zip(&self.pose.is_used);
        stars
            .filter(|(_, used)| **used)
            .map(|(star, _)| TrackedStar {
                star: star.star,
                position: star.position,
                sigma_px: star.sigma_px,
                direction: star.direction,
            })
    }

    fn clock(&self, time_s: Option<f64>) -> Clock {
        let last = self.known.as_ref().map(|known| known.clock);
        Clock {
            time: time_s.unwrap_or_else(|| last.map_or(0.0, |clock| clock.time + 1.0)),
            is_counted: time_s.is_none(),
        }
    }

    /// The attitude from windows around predicted stars.
    fn track(&mut self, frame: &Frame, clock: Clock) -> Result<Track, Loss> {
        let stars = self.stars;
        let known = self.known.as_mut().ok_or(Loss::NoAttitude)?;
        let was_counted = known.clock.is_counted;
        known.clock = clock;
        let camera = *known.lens.camera();
        if [frame.width as f64, frame.height as f64] != [camera.width_px, camera.height_px] {
            return Err(Loss::OtherSize);
        }
        let spot = known.spot.ok_or(Loss::NoAttitude)?;
        let rate = known.motion.rate(clock.is_counted).ok_or(Loss::NoRate)?;
        if was_counted != clock.is_counted {
            return Err(Loss::NotLater);
        }
        let typical_rad = TYPICAL_ERROR_PX / camera.focal_length_px();
        let prediction = known
            .motion
            .predict(clock.time, typical_rad)
            .ok_or(Loss::NotLater)?;
        let exposure_s = known.exposure_s.filter(|_| !clock.is_counted);
        let view = PredictedView {
            camera: &camera,
            prediction: &prediction,
            turn_rad: rate.rad * exposure_s.unwrap_or(0.0),
        };
        let radius_px = view.radius_px(&camera.centre());
        if radius_px > MAX_RADIUS_PX {
            return Err(Loss::TooUncertain { radius_px });
        }
        let boresight = prediction.icrs_to_camera.boresight_and_up().0;
        let wanted = known.wanted(&spot);
        let sky = self.context.indexed;
        let guides = self
            .guides
            .around(sky, &boresight, camera.radius_rad(), &wanted);
        let buffers = &mut self.buffers;
        view.choose(guides, stars, &spot, buffers);
        let predicted = buffers.expected.len();
        if predicted < MIN_STARS {
            return Err(Loss::TooFewStars { predicted });
        }
        let saturation_adu = known.light.saturation_adu;
        let (expected, found) = (&buffers.expected, &mut buffers.found);
        self.detector
            .measure(frame, saturation_adu, &spot, expected, found);
        buffers.take_found(&mut known.light.zero_point_mag);
        let prior = PosePrior {
            camera: &camera,
            focal_sigma_px: known.lens.focal_sigma_px(),
            icrs_to_camera: &prediction.icrs_to_camera,
            excess_px: known.excess_variance_px2.max(0.0).sqrt(),
        };
        let attitude = self.pose.fit(&buffers.stars, &prior);
        let agreeing = attitude.map_or(0, |_| self.pose.used());
        let density_px2 = density_px2(self.detector.surplus(), known.light.density_px2);
        let agreeing_px = self.pose.agreeing_px();
        let log10 = self
            .agreement
            .log10(&buffers.expected, agreeing, agreeing_px, density_px2);
        let lost = Loss::NoAgreement {
            predicted,
            agreeing,
            log10_false_alarm: log10,
        };
        let attitude = attitude.ok_or(lost)?;
        if log10 > LOG10_FALSE_ALARM_LIMIT {
            return Err(lost);
        }
        known.motion.update(&prediction, &attitude, typical_rad);
        known.learn_from(&self.pose, &buffers.stars, &attitude, prior.excess_px);
        Ok(known.track(Mode::Tracked, attitude, agreeing, log10))
    }

    /// The pointing of a frame, with nothing known of the frames before but their scale.
    fn solve(&mut self, frame: &Frame, clock: Clock, loss: Loss) -> Result<Track, DetectError> {
        let mut context = self.context.clone();
        context.attitude_only = true;
        // The known scale is tried first, and dropped where nothing matches with it.
        if let Some(known) = self.known.as_ref().filter(|_| loss != Loss::OtherSize) {
            let is_free = |scale: &ScalePrior| !scale.is_binding();
            if context.priors.scale.as_ref().is_none_or(is_free) {
                context.priors.scale = Some(ScalePrior {
                    scale: Scale::Pixel(1.0 / known.lens.camera().focal_length_px()),
                    tolerance: SCALE_TOLERANCE,
                    source: ScaleSource::Camera,
                });
            }
        }
        let solution = solve_frame(frame, &context, &mut self.workspace)?;
        let Outcome::Identified(found) = &solution.outcome else {
            return Ok(Track {
                mode: Mode::Lost,
                time_s: None,
                attitude: None,
                places: StarPlaces::default(),
                attitude_frame: AttitudeFrame::default(),
                rate: None,
                stars_used: 0,
                log10_false_alarm: None,
                camera: None,
                loss: Some(loss),
                solution: Some(Box::new(solution)),
            });
        };
        let attitude = Attitude {
            icrs_to_camera: found.icrs_to_camera,
            covariance_rad2: found.attitude_covariance_rad2,
        };
        let (stars_used, log10) = (found.matches.len(), found.log10_false_alarm);
        let known = self.continued(frame, clock, &solution, found, &attitude);
        let mut track = known.track(Mode::Acquired, attitude, stars_used, log10);
        self.known = Some(known);
        track.loss = Some(loss);
        track.solution = Some(Box::new(solution));
        Ok(track)
    }

    /// What is known after a full solution.
    fn continued(
        &mut self,
        frame: &Frame,
        clock: Clock,
        solution: &Solution,
        found: &Identification,
        attitude: &Attitude,
    ) -> TrackerState {
        let config = self.context.detect_config(frame);
        let saturation_adu = config.saturation_adu(frame, &mut SaturationFinder::default());
        let light = StarBrightness::measure(
            solution,
            found,
            self.context.indexed.catalog(),
            saturation_adu,
        );
        let before = self.known.take().filter(|known| known.is_of(found));
        let is_same_clock = |known: &TrackerState| known.clock.is_counted == clock.is_counted;
        let motion = before.as_ref().filter(|known| is_same_clock(known));
        let motion = motion.and_then(|known| known.continued_motion(clock, attitude));
        let old_spot = before.as_ref().and_then(|known| known.spot);
        let mut lens = before.map_or_else(|| LensRefiner::new(found.camera), |known| known.lens);
        lens.add(
            solution.measured_stars(found),
            &found.icrs_to_camera,
            found.excess_sigma_px,
        );
        let mut known = TrackerState {
            motion: motion.unwrap_or_else(|| AttitudeMotion::start(attitude, clock.time)),
            lens,
            spot: None,
            light,
            clock,
            places: found.places,
            exposure_s: solution.exposure_s,
            excess_variance_px2: found.excess_sigma_px.powi(2),
            frames: 0,
        };
        // A smear that is not known widens the spots.
        let is_smear_known = known.motion.rate(false).is_some();
        known.spot = old_spot.filter(|_| !is_smear_known).or_else(|| {
            let stars = known.bright_stars(solution, found, attitude);
            self.detector.learn(frame, saturation_adu, &stars)
        });
        known.spot = known.spot.or(old_spot);
        known
    }
}

impl TrackerState {
    /// Whether an identification is of the same camera.
    fn is_of(&self, found: &Identification) -> bool {
        let (camera, other) = (self.lens.camera(), &found.camera);
        let apart_px = (camera.focal_length_px() - other.focal_length_px()).abs();
        let sigma_px = libm::hypot(self.lens.focal_sigma_px(), found.focal_length_sigma_px);
        // Models of distortion differ in their scale at the centre.
        let models_px = 1e-3 * camera.focal_length_px();
        [camera.width_px, camera.height_px] == [other.width_px, other.height_px]
            && camera.mirrored == other.mirrored
            && apart_px < OTHER_CAMERA_SIGMAS * sigma_px + models_px
    }

    fn continued_motion(&self, clock: Clock, attitude: &Attitude) -> Option<AttitudeMotion> {
        let typical_rad = TYPICAL_ERROR_PX / self.lens.camera().focal_length_px();
        let mut motion = self.motion;
        let prediction = motion.predict(clock.time, typical_rad)?;
        motion.update(&prediction, attitude, typical_rad);
        Some(motion)
    }

    /// The brightest stars that are neither saturated nor blended, with their paths.
    fn bright_stars(
        &self,
        solution: &Solution,
        found: &Identification,
        attitude: &Attitude,
    ) -> Vec<(PixelPoint, [f64; 2])> {
        let rate = self.motion.rate(self.clock.is_counted);
        let turn_rad = rate.filter(|rate| !rate.is_per_frame).zip(self.exposure_s);
        let turn_rad = turn_rad.map_or(Vector3::zeros(), |(rate, s)| rate.rad * s);
        let camera = self.lens.camera();
        let sources = found.matches.iter().map(|m| solution.source(m.source));
        let alone = sources.filter(|source| {
            let flags = source.measured.map(|measured| measured.flags);
            flags.is_some_and(|flags| !flags.saturated && !flags.blended && !flags.border)
        });
        let mut stars: Vec<_> = alone.collect();
        stars.sort_by(|a, b| b.flux.unwrap_or(0.0).total_cmp(&a.flux.unwrap_or(0.0)));
        let with_path = |position: PixelPoint| {
            let direction = camera.direction_of(&position)?;
            let direction = attitude.icrs_to_camera.inverse().apply(&direction);
            let smear_px = smear_px(camera, &attitude.icrs_to_camera, &direction, turn_rad);
            Some((position, smear_px))
        };
        let stars = stars.iter();
        stars.filter_map(|star| with_path(star.position)).collect()
    }

    /// The stars that can be tracked.
    fn wanted(&self, spot: &SpotModel) -> Wanted {
        let light = &self.light;
        let faintest = light.zero_point_mag + instrumental_mag(light.least_flux_adu);
        let highest_adu = MAX_PEAK * f64::from(light.saturation_adu) - light.background_adu;
        let most_flux_adu = highest_adu.max(1.0) / spot.peak_fraction();
        let brightest = light.zero_point_mag + instrumental_mag(most_flux_adu);
        let rad_per_px = 1.0 / self.lens.camera().focal_length_px();
        let width_px = spot.width_px([0.0; 2]);
        let still = ExpectedStar {
            position: PixelPoint::default(),
            radius_px: MIN_RADIUS_PX,
            smear_px: [0.0; 2],
        };
        let clear_px = WindowDetector::reach_px(spot, &still) as f64;
        Wanted {
            v_mag: [brightest.max(-10.0), faintest],
            width_rad: width_px * rad_per_px,
            clear_rad: clear_px * rad_per_px,
            places: self.places,
        }
    }

    /// Takes what a tracked frame says of the camera.
    fn learn_from(
        &mut self,
        pose: &PoseFitter,
        stars: &[PoseStar],
        attitude: &Attitude,
        excess_px: f64,
    ) {
        let excess_variance_px2 = excess_px.powi(2) + pose.excess_variance_px2();
        self.excess_variance_px2 +=
            AVERAGED_FRACTION * (excess_variance_px2 - self.excess_variance_px2);
        self.frames += 1;
        if self.frames.is_multiple_of(REFINED_EVERY) {
            let used = pose.used_stars(stars);
            // Their errors have the excess already.
            self.lens.add(used, &attitude.icrs_to_camera, 0.0);
        }
    }

    fn track(&self, mode: Mode, attitude: Attitude, stars_used: usize, log10: f64) -> Track {
        Track {
            mode,
            time_s: None,
            attitude: Some(attitude),
            places: self.places,
            attitude_frame: AttitudeFrame::default(),
            rate: self.motion.rate(self.clock.is_counted),
            stars_used,
            log10_false_alarm: Some(log10),
            camera: Some((*self.lens.camera(), self.lens.focal_sigma_px())),
            loss: None,
            solution: None,
        }
    }
}

impl StarBrightness {
    fn measure(
        solution: &Solution,
        found: &Identification,
        catalog: &Catalog,
        saturation_adu: f32,
    ) -> Self {
        let (mut zero_points, mut noises) = (Vec::new(), Vec::new());
        for named in &found.matches {
            let source = solution.source(named.source);
            let Some((measured, flux)) = source.measured.zip(source.flux) else {
                continue;
            };
            if !measured.flags.saturated && flux > 0.0 && measured.snr > 0.0 {
                let v_mag = f64::from(catalog.star(named.star).v_mag);
                zero_points.push(v_mag - instrumental_mag(flux));
                noises.push((measured.snr, flux / measured.snr));
            }
        }
        // The noise of faint stars is that of the background.
        noises.sort_by(|a, b| a.0.total_cmp(&b.0));
        let fainter = noises.len().div_ceil(2);
        let mut of_faint: Vec<f64> = noises[..fainter].iter().map(|noise| noise.1).collect();
        let area_px2 = (solution.width * solution.height) as f64;
        Self {
            zero_point_mag: median(&mut zero_points),
            least_flux_adu: MIN_SNR * median(&mut of_faint).max(f64::MIN_POSITIVE),
            background_adu: solution.background.map_or(0.0, |b| b.level_adu),
            saturation_adu,
            density_px2: solution.sources.len().max(1) as f64 / area_px2,
        }
    }
}

/// The camera at the predicted attitude.
struct PredictedView<'a> {
    camera: &'a CameraModel,
    prediction: &'a MotionPrediction,
    /// Turn of the camera during the exposure.
    turn_rad: Vector3<f64>,
}

impl PredictedView<'_> {
    /// How far from its predicted place a star may be.
    fn radius_px(&self, place: &PixelPoint) -> f64 {
        let focal_px = self.camera.focal_length_px();
        let [u, v] = self.camera.offset_of(place);
        let [x, y] = [u / focal_px, v / focal_px];
        let covariance: Matrix3<f64> = self.prediction.attitude_covariance_rad2();
        let variance = |by: [f64; 3]| {
            let by = RowVector3::from(by) * focal_px;
            (by * covariance * by.transpose())[0]
        };
        let along_x = variance([-x * y, 1.0 + x * x, -y]);
        let along_y = variance([-(1.0 + y * y), x * y, x]);
        MIN_RADIUS_PX + RADIUS_SIGMAS * along_x.max(along_y).sqrt()
    }

    /// Chooses the brightest stars that are well within the frame.
    fn choose(
        &self,
        guides: &[GuideStar],
        stars: usize,
        spot: &SpotModel,
        buffers: &mut TrackBuffers,
    ) {
        let icrs_to_camera = &self.prediction.icrs_to_camera;
        let cos_reach = libm::cos(self.camera.radius_rad());
        buffers.expected.clear();
        buffers.guides.clear();
        for guide in guides {
            if buffers.expected.len() >= stars {
                break;
            }
            let direction = icrs_to_camera.apply(&guide.direction);
            if direction.as_vector().z < cos_reach {
                continue;
            }
            let Some(position) = self.camera.pixel_of(&direction) else {
                continue;
            };
            if !self.camera.contains(&position) {
                continue;
            }
            let expected = ExpectedStar {
                position,
                radius_px: self.radius_px(&position).min(MAX_RADIUS_PX),
                smear_px: smear_px(self.camera, icrs_to_camera, &guide.direction, self.turn_rad),
            };
            let margin_px = WindowDetector::reach_px(spot, &expected) as f64 + 1.0;
            if self.camera.nearly_contains(&position, -margin_px) {
                buffers.expected.push(expected);
                buffers.guides.push(*guide);
            }
        }
    }
}

/// The path of a star while the camera turns, along x and y in pixels.
fn smear_px(
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    direction: &UnitVector<Icrs>,
    turn_rad: Vector3<f64>,
) -> [f64; 2] {
    if turn_rad.norm() * camera.focal_length_px() < MIN_SMEAR_PX {
        return [0.0; 2];
    }
    let at = |part: f64| {
        let turned = icrs_to_camera.then_turn(turn_rad * part);
        camera.pixel_of(&turned.apply(direction))
    };
    match (at(-0.5), at(0.5)) {
        (Some(from), Some(to)) => [to.x - from.x, to.y - from.y],
        _ => [0.0; 2],
    }
}

impl TrackBuffers {
    /// Makes stars of what was found, without those whose brightness is not theirs.
    fn take_found(&mut self, zero_point_mag: &mut f64) {
        let Self {
            guides,
            found,
            stars,
            mags,
            sorted,
            ..
        } = self;
        mags.clear();
        let off_mag = |(star, guide): (&Option<FoundStar>, &GuideStar)| {
            star.map_or(f64::NAN, |s| guide.v_mag - instrumental_mag(s.flux_adu))
        };
        mags.extend(found.iter().zip(guides.iter()).map(off_mag));
        sorted.clear();
        sorted.extend(mags.iter().filter(|mag| mag.is_finite()));
        stars.clear();
        if sorted.is_empty() {
            return;
        }
        let typical = median(sorted);
        for ((star, mag), guide) in found.iter().zip(mags.iter()).zip(guides.iter()) {
            let Some(star) = star.filter(|star| !star.saturated) else {
                continue;
            };
            if (mag - typical).abs() <= MAG_TOLERANCE {
                let [x, y] = star.sigma_px;
                stars.push(PoseStar {
                    position: star.position,
                    direction: guide.direction,
                    star: guide.star,
                    sigma_px: (0.5 * (x * x + y * y)).sqrt().max(1e-3),
                });
            }
        }
        if stars.len() >= MIN_STARS {
            *zero_point_mag += AVERAGED_FRACTION * (typical - *zero_point_mag);
        }
    }
}
