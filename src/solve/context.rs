//! What the stages need and what does not change from frame to frame.

use super::deep::DeepSky;
use super::fixed_camera::FixedCamera;
use super::limits::FrameLimits;
use super::pointing_buffers::PointingBuffers;
use super::stopwatch::Stage;
use crate::base::clock::{ClockDate, UtcOffset};
use crate::base::interrupt::{Interrupt, Paused};
use crate::base::size::Size;
use crate::calibration::Calibration;
use crate::camera::KnownLens;
use crate::detect::{self, DetectConfig};
use crate::ephemeris::places::AttitudeFrame;
use crate::frame::{self, Frame};
use crate::identify::{
    self, DateSource, Effort, FrameDate, IndexedCatalog, NAME_ODDS, Priors, ScalePrior, SkyRegion,
};
use crate::photometry::comparison::ObservingSetup;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use web_time::Instant;

/// How long a frame may take by default where many are solved, in seconds.
pub const DEFAULT_TIME_LIMIT_S: f64 = 60.0;

/// What the stages need and what does not change from frame to frame.
#[derive(Clone)]
#[non_exhaustive]
pub struct Context<'a> {
    /// The catalogue's stars and their triangles.
    pub indexed: &'a IndexedCatalog<'a>,
    /// Deep catalogues for fields that are too narrow for it.
    pub deep: Option<&'a DeepSky>,
    /// How to detect stars.
    pub detect: DetectConfig,
    /// What is known of every frame beforehand.
    pub priors: Priors,
    /// The camera with which frames are compared.
    pub camera: Option<ObservingSetup>,
    /// The lens with which they were taken, where it was measured.
    pub lens: Option<Arc<KnownLens>>,
    /// The sizes of the camera's frames, besides those of `camera` and `lens`.
    pub frame_sizes: Vec<Size>,
    /// What local times in names of files and in Exif are ahead of UTC, where it is known.
    pub utc_offset: Option<UtcOffset>,
    /// How the camera stands, where it does not move: tried first.
    pub fixed_camera: Option<Arc<FixedCamera>>,
    /// The calibration of frames that are read from files.
    pub calibration: Option<&'a Calibration>,
    /// Whether to stop at attitude and optics, from the brightest stars: no other star is named, and
    /// nothing is measured that needs the names.
    pub attitude_only: bool,
    /// Whether to measure the sky at each place.
    pub measure_sky: bool,
    /// Whether to do so without being asked in wide fields whose site and time are known.
    pub measure_known_sky: bool,
    /// Whether to search satellites, aeroplanes and meteors.
    pub find_trails: bool,
    /// Which directions reported attitudes refer to.
    pub attitude_frame: AttitudeFrame,
    /// A star is named where the odds are at least this many to 1 that the name is right, and at least
    /// 1 to 1: else a star would have several.
    pub name_odds: f64,
    /// How much is tried to identify a frame.
    pub effort: Effort,
    /// Whether a frame is that of the file's rows as they are stored: the first is then row 0 of
    /// positions, attitude and world coordinates. Without it they are those of the picture as drawn.
    pub as_stored: bool,
    /// How long a frame may take, from where its reading begins.
    pub time_limit: Option<Duration>,
    /// Told of each stage that is done; a stage may come again.
    pub on_stage: Option<&'a (dyn Fn(Stage) + Sync)>,
    /// Whether to search for the reason why a frame is not identified: not where it is tried another way.
    pub(crate) explains: bool,
}

impl<'a> Context<'a> {
    /// Default detection, nothing known beforehand, no camera and no calibration.
    pub fn new(indexed: &'a IndexedCatalog<'a>) -> Self {
        Self {
            indexed,
            deep: None,
            detect: DetectConfig::default(),
            priors: Priors::default(),
            camera: None,
            lens: None,
            frame_sizes: Vec::new(),
            utc_offset: None,
            fixed_camera: None,
            calibration: None,
            attitude_only: false,
            measure_sky: false,
            measure_known_sky: false,
            find_trails: false,
            attitude_frame: AttitudeFrame::default(),
            name_odds: NAME_ODDS,
            effort: Effort::Normal,
            as_stored: false,
            time_limit: None,
            on_stage: None,
            explains: true,
        }
    }

    /// The same without a reason where a frame is not identified.
    pub(super) fn unexplained(&self) -> Self {
        Self {
            explains: false,
            ..self.clone()
        }
    }

    /// The same over the stars of a deep catalogue.
    pub(super) fn over<'b>(&'b self, indexed: &'b IndexedCatalog<'static>) -> Context<'b> {
        Context {
            indexed,
            deep: None,
            explains: false,
            ..self.clone()
        }
    }

    /// The priors of one frame: those of every frame, completed from the camera's data sheet, the
    /// frame's header and the file's name.
    pub(super) fn priors_of(&self, frame: &Frame, name: Option<&Path>) -> Priors {
        let header = &frame.metadata;
        let lens = self.lens_of(frame.width, frame.height);
        let camera_scale = self.camera.as_ref().map(|camera| &camera.sheet);
        let header_scale = header.pixel_scale_rad().map(ScalePrior::of_header);
        let in_name = name.and_then(ClockDate::in_file_name);
        let local_ahead = match self.utc_offset {
            Some(UtcOffset::Ahead(ahead)) => Some(ahead),
            Some(UtcOffset::Auto) | None => None,
        };
        let dated = |clock, source| FrameDate::of_clock(clock, source, local_ahead);
        let on_clock = header.local_date.map(ClockDate::local);
        let priors = self
            .priors
            .or_date(on_clock.and_then(|clock| dated(clock, DateSource::FileHeader)))
            .or_date(
                header
                    .date
                    .map(|date| FrameDate::stated(date, DateSource::FileHeader)),
            )
            .or_date(in_name.and_then(|clock| dated(clock, DateSource::FileName)));
        Priors {
            holds_lens: lens.is_some(),
            scale: priors
                .scale
                .or(lens.map(ScalePrior::of_lens))
                .or(camera_scale.map(ScalePrior::of_camera))
                .or(header_scale),
            mount: priors
                .mount
                .or(header.pointing_deg.map(SkyRegion::of_mount)),
            site: priors.site.or(header.site),
            exposure_s: priors.exposure_s.or(header.exposure_s),
            ..priors
        }
    }

    /// The lens of frames of this size, where it was measured.
    pub(super) fn lens_of(&self, width_px: usize, height_px: usize) -> Option<&KnownLens> {
        let lens = self.lens.as_deref();
        lens.filter(|lens| lens.is_of_size(width_px as f64, height_px as f64))
    }

    /// The sizes that frames of the camera have, as far as the camera and its lens are known.
    pub(super) fn camera_sizes(&self) -> Vec<Size> {
        let of_sheet = self.camera.as_ref().map(|camera| camera.sheet.size());
        let of_lens = self.lens.as_deref().map(KnownLens::size);
        let known = of_sheet.into_iter().chain(of_lens);
        known.chain(self.frame_sizes.iter().copied()).collect()
    }

    /// How to detect stars in one frame: pixels at the stated camera's full well are saturated.
    pub(crate) fn detect_config(&self, frame: &Frame) -> DetectConfig {
        let camera = self.camera.as_ref();
        DetectConfig {
            saturation_adu: camera
                .and_then(|camera| saturation_adu(camera, frame))
                .or(self.detect.saturation_adu),
            ..self.detect.clone()
        }
    }
}

/// The level from which on the camera's pixels are saturated. `None` where the frame's levels
/// exceed the camera's full scale: files may hold the levels of few bits multiplied.
fn saturation_adu(camera: &ObservingSetup, frame: &Frame) -> Option<f64> {
    let sheet = &camera.sheet;
    let full_scale_adu = sheet.full_scale_adu() as f32;
    let is_within = frame.pixels.highest() <= full_scale_adu;
    is_within.then(|| sheet.saturation_adu())
}

/// Buffers of the stages, reused from frame to frame. One for each thread.
#[derive(Default)]
pub struct Workspace {
    /// For reading.
    pub frames: frame::Buffers,
    /// For detection.
    pub detect: detect::Workspace,
    /// For identification.
    pub identify: identify::Workspace,
    pub(super) pointing: PointingBuffers,
    interrupt: Interrupt,
    /// Also due at the deadline of the frame.
    of_frame: Interrupt,
    paused: Paused,
}

impl Workspace {
    /// Empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Work on a frame ends early when `interrupt` is due, or [`Context::time_limit`] is reached:
    /// while it is read and stars are detected, with an error; later, with the frame not identified.
    ///
    /// # Example
    /// ```
    /// use starpipe::{Catalog, Context, IndexedCatalog, Interrupt, Workspace, solve_file};
    ///
    /// let catalog = Catalog::built_in().limited_to(5.0);
    /// let indexed = IndexedCatalog::build(&catalog, &|_| ());
    /// let context = Context::new(&indexed);
    /// // One that is due at once.
    /// let mut workspace = Workspace::new().with_interrupt(&Interrupt::when(|| true));
    /// let ended = solve_file("fixtures/orion/orion.png", None, &context, &mut workspace);
    /// assert!(ended.is_err());
    /// ```
    #[must_use]
    pub fn with_interrupt(self, interrupt: &Interrupt) -> Self {
        let mut until = Self {
            interrupt: interrupt.clone(),
            ..self
        };
        until.set_deadline(None);
        until
    }

    /// Lets the time limit of `context` run from now on, for what is read before
    /// [`solve_read`](super::solve_read) lets it run anew.
    pub fn begin(&mut self, context: &Context) {
        let deadline = context
            .time_limit
            .and_then(|limit| Instant::now().checked_add(limit));
        self.set_deadline(deadline);
    }

    /// Empty buffers with the same settings.
    pub(crate) fn emptied(&self) -> Self {
        let mut frames = frame::Buffers::new();
        frames.set_memory(self.frames.memory());
        let empty = Self {
            frames,
            detect: self.detect.emptied(),
            ..Self::new()
        };
        empty.with_interrupt(&self.interrupt)
    }

    /// When the work on the frame is to end.
    pub(super) fn limits(&self) -> FrameLimits {
        FrameLimits {
            of_all: self.interrupt.clone(),
            of_frame: self.of_frame.clone(),
            paused: self.paused.clone(),
        }
    }

    /// Ends the work on one frame at `deadline`, too.
    pub(super) fn set_deadline(&mut self, deadline: Option<Instant>) {
        self.paused = Paused::default();
        let interrupt = match deadline {
            Some(deadline) => self.interrupt.or_after(deadline, &self.paused),
            None => self.interrupt.clone(),
        };
        self.frames.set_interrupt(interrupt.clone());
        self.detect.set_interrupt(interrupt.clone());
        self.identify.set_interrupt(interrupt.clone());
        self.of_frame = interrupt;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;

    #[test]
    fn full_well_counts_where_the_levels_can_be_the_cameras() {
        let camera = ObservingSetup {
            sheet: Preset::Experiment1.data_sheet(),
            zenith_distance_deg: None,
            extinction: None,
        };
        let frame = |highest: f32| Frame::new(3, 3, vec![highest; 9]).unwrap();
        let full_adu = camera.sheet.saturation_adu();
        assert!(full_adu < 4095.0);
        assert_eq!(saturation_adu(&camera, &frame(4095.0)), Some(full_adu));
        // Twelve bits at the upper end of sixteen.
        assert_eq!(saturation_adu(&camera, &frame(4096.0)), None);
    }
}
