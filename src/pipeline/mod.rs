//! The stages in order: a frame becomes detections, the detections a star field, the field an identification.
//!
//! [`Frame`] → [`Detections`] → [`StarField`] → [`Outcome`], kept together and timed in a [`Solution`].
//!
//! ```no_run
//! use starpipe::sky::catalog::Catalog;
//! use starpipe::identify::IndexedCatalog;
//! use starpipe::pipeline::{Pipeline, SolveConfig, Workspace};
//! use starpipe::report::FrameReport;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let catalog = Catalog::built_in();
//! // Takes some seconds; `IndexedCatalog::open` keeps what it makes for the next time.
//! let pipeline = Pipeline::new(IndexedCatalog::build(catalog, &|_| {}));
//! let mut workspace = Workspace::new();
//! let solution =
//!     pipeline.solve_file("night.tif".as_ref(), &SolveConfig::default(), &mut workspace)?;
//! let report = FrameReport::new("night.tif", &solution, catalog);
//! println!("{}", report.to_json_line()?);
//! # Ok(())
//! # }
//! ```

mod described;
mod knowledge;

use crate::base::coords::PixelPoint;
use crate::base::epoch::ObservationDate;
use crate::calibration::{Applied, Calibration, CalibrationError};
use crate::detect::{self, DetectConfig, DetectError, Detection, DetectionFlags, Detections};
use crate::frame::{self, Frame, FrameError};
use crate::identify::diagnosis::{self, Examined};
use crate::identify::{
    self, IndexedCatalog, LOG10_FALSE_ALARM_LIMIT, ObservedStar, Outcome, Photometry, StarField,
};
use crate::photometry::comparison::{Comparison, Description};
use crate::photometry::{self, FramePhotometry, MeasuredFrame, instrumental_mag};
use crate::sky::catalog::Catalog;
use crate::sky::observer::Observation;
use described::Found;
pub use knowledge::{DateSource, FrameDate, Knowledge, Scale, ScaleHint};
use knowledge::{header_scale, wrong_header};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Why the frame in a file could not be examined. That its stars are not identified is no error but an [`Outcome`].
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file cannot be read or understood.
    #[error("reading {0}")]
    Read(#[from] FrameError),
    /// The frame is not one in which stars can be looked for.
    #[error("detecting stars in {}", path.display())]
    Detect {
        /// The file.
        path: PathBuf,
        /// What is wrong with the frame.
        source: DetectError,
    },
    /// The frame is not one that can be calibrated as is asked for.
    #[error("calibrating {}", path.display())]
    Calibrate {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        source: CalibrationError,
    },
}

/// How to examine a frame.
#[derive(Debug, Clone, Default)]
pub struct SolveConfig {
    /// How to find the stars.
    pub detect: DetectConfig,
    /// What is known beforehand.
    pub knowledge: Knowledge,
    /// The camera and what it looked through, as they are said to be.
    pub description: Option<Description>,
    /// Which image of a file with several, counted from 1; the first where nothing is said.
    pub page: Option<NonZeroUsize>,
    /// What is taken out of a frame that is read from a file before stars are looked for.
    pub calibration: Option<Arc<Calibration>>,
}

/// One source: what was measured of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Source {
    /// Its centroid.
    pub position: PixelPoint,
    /// What a detection in a frame tells besides; a line in a list of centroids does not.
    pub measured: Option<Measured>,
    /// Flux above the background, in the frame's own units, where it is known.
    pub flux: Option<f64>,
}

/// What only a detection in a frame has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Standard errors of the centroid in x and y, in pixels.
    pub sigma_px: [f64; 2],
    /// Brightest pixel above the background, in the frame's own units.
    pub peak: f64,
    /// Flux over its standard error.
    pub snr: f64,
    /// What is unusual about it.
    pub flags: DetectionFlags,
}

impl From<&Detection> for Source {
    fn from(detection: &Detection) -> Self {
        Self {
            position: detection.position,
            measured: Some(Measured {
                sigma_px: [detection.sigma_x_px, detection.sigma_y_px],
                peak: detection.peak_adu,
                snr: detection.snr,
                flags: detection.flags,
            }),
            flux: Some(detection.flux_adu),
        }
    }
}

/// What was found in one frame, or in one list of centroids.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// When it was taken, where that is known; else the stars stand where they stood at J2000.0.
    pub date: Option<FrameDate>,
    /// Where in the sky the frame's centre stood, where it is identified, and site and time of day are known.
    pub observation: Option<Observation>,
    /// How long it was exposed, in seconds, where that is known.
    pub exposure_s: Option<f64>,
    /// What is wrong or cannot be true in the file's header or in what was given, and what is odd about the frame: a sentence each.
    pub notes: Vec<String>,
    /// All sources, brightest first.
    pub sources: Vec<Source>,
    /// The sky between them; a list of centroids does not know it.
    pub background: Option<Background>,
    /// Which stars they are; `observed` in its matches is an index into `sources`.
    pub outcome: Outcome,
    /// How bright its stars are, and how faint it goes; of identified frames, and not of lists of centroids.
    pub photometry: Option<FramePhotometry>,
    /// What the camera should have seen, where that is described and the exposure known.
    pub comparison: Option<Comparison>,
    /// Electrons for a step of the grey level, where the camera is described.
    pub gain_e_per_adu: Option<f64>,
    /// What was taken out of the frame before, where anything was.
    pub calibration: Option<Applied>,
    /// How long it took.
    pub timing: Timing,
}

/// The sky between the stars, in the frame's own units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Background {
    /// Median level.
    pub level_adu: f64,
    /// Standard deviation of one pixel.
    pub noise_adu: f64,
}

/// How long each stage took; 0 for a stage that was not needed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Timing {
    /// Reading and decoding the file.
    pub read_ms: f64,
    /// Finding and measuring the stars.
    pub detect_ms: f64,
    /// Identifying them.
    pub identify_ms: f64,
    /// Zero point, completeness, and what they should be.
    pub photometry_ms: f64,
    /// All of it.
    pub total_ms: f64,
}

/// A list of centroids, as `starpipe identify` takes it.
#[derive(Debug, Clone, PartialEq)]
pub struct CentroidList {
    /// Columns of the frame that they come from.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// What the magnitudes are.
    pub photometry: Photometry,
    /// The centroids, in any order.
    pub centroids: Vec<ListedCentroid>,
}

impl CentroidList {
    /// The list as identification takes it, which must stand in the order of brightness, seen so many Julian years after
    /// J2000.0.
    pub fn star_field(&self, years_since_j2000: f64) -> StarField {
        let observed = |centroid: &ListedCentroid| ObservedStar {
            position: centroid.position,
            sigma_px: LISTED_SIGMA_PX,
            mag: centroid.mag,
            is_saturated: false,
        };
        StarField {
            width_px: self.width as f64,
            height_px: self.height as f64,
            photometry: self.photometry,
            years_since_j2000,
            spot_sigma_px: None,
            stars: self.centroids.iter().map(observed).collect(),
        }
    }
}

/// One line of a list of centroids.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ListedCentroid {
    /// The position.
    pub position: PixelPoint,
    /// Brightness in magnitudes, see [`CentroidList::photometry`].
    pub mag: f64,
    /// Flux, where the list gives that.
    pub flux: Option<f64>,
}

/// Standard error assumed on each axis of a centroid that comes without one, in pixels.
pub const LISTED_SIGMA_PX: f64 = 0.5;

/// What the stages work with, kept from frame to frame. One for each thread.
#[derive(Default)]
pub struct Workspace {
    /// For reading.
    pub frames: frame::Buffers,
    /// For detection.
    pub detect: detect::Workspace,
    /// For identification.
    pub identify: identify::Workspace,
}

impl Workspace {
    /// An empty one.
    pub fn new() -> Self {
        Self::default()
    }
}

/// The stages, ready for any number of frames.
pub struct Pipeline<'a> {
    sky: IndexedCatalog<'a>,
}

impl<'a> Pipeline<'a> {
    /// Frames are identified with the stars of `sky`.
    pub fn new(sky: IndexedCatalog<'a>) -> Self {
        Self { sky }
    }

    /// The stars that frames are identified with.
    pub fn sky(&self) -> &IndexedCatalog<'a> {
        &self.sky
    }

    /// The catalogue.
    pub fn catalog(&self) -> &'a Catalog {
        self.sky.catalog()
    }

    /// Examines the frame in the file `path`. Where `config` has no date, it is that of the file's header, else of its
    /// name; where it has no scale, see [`Pipeline::solve_frame`].
    ///
    /// # Errors
    /// [`Error::Read`] if there is no frame in the file, [`Error::Detect`] if it is unfit.
    pub fn solve_file(
        &self,
        path: &Path,
        config: &SolveConfig,
        workspace: &mut Workspace,
    ) -> Result<Solution, Error> {
        let read = |buffers: &mut frame::Buffers| frame::read_page_with(path, config.page, buffers);
        let (solution, frame) = self.solve_read(path, config, workspace, read)?;
        workspace.frames.recycle(frame);
        Ok(solution)
    }

    /// Examines the frame that `read` gives, as [`Self::solve_file`] does, and returns it with what was found: best to be given
    /// back to the workspace once it is not needed ([`frame::Buffers::recycle`]). `name` is the file's, or stands for one.
    ///
    /// # Errors
    /// As [`Self::solve_file`].
    pub fn solve_read(
        &self,
        name: &Path,
        config: &SolveConfig,
        workspace: &mut Workspace,
        read: impl FnOnce(&mut frame::Buffers) -> Result<Frame, FrameError>,
    ) -> Result<(Solution, Frame), Error> {
        let start = Instant::now();
        let mut frame = read(&mut workspace.frames)?;
        let read_ms = milliseconds_since(start);
        let calibration = config.calibration.as_deref();
        if let Some(calibration) = calibration {
            let applied = calibration.apply(&mut frame);
            applied.map_err(|source| Error::Calibrate {
                path: name.to_owned(),
                source,
            })?;
        }
        let in_name = ObservationDate::in_file_name(name);
        let config = SolveConfig {
            detect: config.detect.clone(),
            knowledge: config
                .knowledge
                .or_date(frame.metadata.date, DateSource::FileHeader)
                .or_date(in_name, DateSource::FileName),
            ..config.clone()
        };
        let mut solution = self
            .solve_frame(&frame, &config, workspace)
            .map_err(|source| Error::Detect {
                path: name.to_owned(),
                source,
            })?;
        solution.calibration = calibration.map(Calibration::applied);
        let note = calibration.and_then(|calibration| calibration.note(solution.exposure_s));
        solution.notes.extend(note);
        solution.timing.read_ms = read_ms;
        solution.timing.total_ms = milliseconds_since(start);
        Ok((solution, frame))
    }

    /// Examines `frame`. Where `config` has no date or exposure, it is that of the frame's header. Where it has no scale, that of
    /// the camera's description, or else of the header, is tried first; it can be wrong, and so it is done without where that
    /// leads nowhere.
    ///
    /// # Errors
    /// [`DetectError`] if it is unfit for detection.
    pub fn solve_frame(
        &self,
        frame: &Frame,
        config: &SolveConfig,
        workspace: &mut Workspace,
    ) -> Result<Solution, DetectError> {
        let start = Instant::now();
        let description = config.description.as_ref();
        let detect_config = DetectConfig {
            saturation_adu: description
                .and_then(|stated| described::saturation_adu(stated, frame))
                .or(config.detect.saturation_adu),
            ..config.detect.clone()
        };
        let detections = detect::detect(frame, &detect_config, &mut workspace.detect)?;
        let detect_ms = milliseconds_since(start);
        let knowledge = config
            .knowledge
            .or_date(frame.metadata.date, DateSource::FileHeader)
            .or_exposure(frame.metadata.exposure_s)
            .or_site(frame.metadata.site);
        let (field, kept) = star_field(frame, &detections, knowledge.years_since_j2000());
        let identify_start = Instant::now();
        let mut notes = frame.metadata.ignored.clone();
        let described = description.map(|stated| ScaleHint::of_camera(&stated.sensor));
        let in_header = header_scale(&frame.metadata).filter(|_| described.is_none());
        let outcome = match (knowledge.scale, described.or(in_header)) {
            (None, Some(hint)) => {
                let (outcome, is_wrong) =
                    self.identify_with(&hint, (&field, &kept), &knowledge, workspace);
                // What is wrong with a description is told below.
                notes.extend(
                    in_header
                        .filter(|_| is_wrong)
                        .map(|hint| wrong_header(&hint, &field)),
                );
                outcome
            }
            _ => self.identify((&field, &kept), &knowledge, workspace),
        };
        let outcome = self.explained(outcome, &field, &knowledge, Some((frame, &detections)));
        let identify_ms = milliseconds_since(identify_start);
        let photometry_start = Instant::now();
        let photometry = self.photometry(&detections, &outcome, &knowledge);
        let observation = knowledge.observation(&outcome);
        notes.extend(knowledge.odd_observation(&outcome, observation.as_ref()));
        let background = Background {
            level_adu: detections.background_adu,
            noise_adu: detections.noise_adu,
        };
        let found = Found {
            detect: &config.detect,
            size_px: [frame.width, frame.height],
            background: &background,
            spot_sigma_px: detections.spot_sigma_px,
            outcome: &outcome,
            photometry: photometry.as_ref(),
            observation: observation.as_ref(),
            header_zenith_distance_deg: frame.metadata.zenith_distance_deg,
            sky: &self.sky,
        };
        let comparison = description.and_then(|stated| found.against(stated, &knowledge));
        notes.extend(described::notes(description, comparison.as_ref()));
        let photometry_ms = milliseconds_since(photometry_start);
        notes.extend(photometry.as_ref().and_then(not_linear));
        Ok(Solution {
            width: frame.width,
            height: frame.height,
            date: knowledge.date,
            observation,
            exposure_s: knowledge.exposure_s,
            notes,
            sources: detections.sources.iter().map(Source::from).collect(),
            background: Some(background),
            outcome,
            photometry,
            comparison,
            gain_e_per_adu: description.map(|stated| stated.sensor.gain_e_per_adu),
            calibration: None,
            timing: Timing {
                read_ms: 0.0,
                detect_ms,
                identify_ms,
                photometry_ms,
                total_ms: milliseconds_since(start),
            },
        })
    }

    /// Identifies the stars of a list of centroids.
    pub fn solve_centroids(&self, list: &CentroidList, knowledge: &Knowledge) -> Solution {
        let start = Instant::now();
        let mut list = list.clone();
        list.centroids.sort_by(|a, b| a.mag.total_cmp(&b.mag));
        let field = list.star_field(knowledge.years_since_j2000());
        let all: Vec<usize> = (0..list.centroids.len()).collect();
        let outcome = self.identify((&field, &all), knowledge, &mut Workspace::new());
        let outcome = self.explained(outcome, &field, knowledge, None);
        let observation = knowledge.observation(&outcome);
        let identify_ms = milliseconds_since(start);
        let source = |centroid: &ListedCentroid| Source {
            position: centroid.position,
            measured: None,
            flux: centroid.flux,
        };
        Solution {
            width: list.width,
            height: list.height,
            date: knowledge.date,
            notes: knowledge
                .odd_observation(&outcome, observation.as_ref())
                .into_iter()
                .collect(),
            observation,
            exposure_s: knowledge.exposure_s,
            sources: list.centroids.iter().map(source).collect(),
            background: None,
            outcome,
            photometry: None,
            comparison: None,
            gain_e_per_adu: None,
            calibration: None,
            timing: Timing {
                identify_ms,
                total_ms: identify_ms,
                ..Timing::default()
            },
        }
    }

    /// The photometry of an identified frame.
    fn photometry(
        &self,
        detections: &Detections,
        outcome: &Outcome,
        knowledge: &Knowledge,
    ) -> Option<FramePhotometry> {
        let Outcome::Identified(identification) = outcome else {
            return None;
        };
        let measured = MeasuredFrame {
            detections,
            identification,
            years_since_j2000: knowledge.years_since_j2000(),
            exposure_s: knowledge.exposure_s,
        };
        Some(photometry::measure(&measured, &self.sky))
    }

    /// Identifies `field` with a scale that is only stated, else without; tells whether that scale is not the true one.
    fn identify_with(
        &self,
        hint: &ScaleHint,
        (field, sources): (&StarField, &[usize]),
        knowledge: &Knowledge,
        workspace: &mut Workspace,
    ) -> (Outcome, bool) {
        let believing = Knowledge {
            scale: Some(*hint),
            ..*knowledge
        };
        let first = self.identify((field, sources), &believing, workspace);
        if matches!(first, Outcome::Identified(_)) {
            return (first, false);
        }
        let second = self.identify((field, sources), knowledge, workspace);
        let second = at_second_attempt(second).unwrap_or(first);
        let is_wrong = match &second {
            Outcome::Identified(found) => {
                let (low_rad, high_rad) = hint.pixel_scale_rad(field.width_px);
                !(low_rad..=high_rad).contains(&(1.0 / found.camera.focal_length_px))
            }
            Outcome::NotIdentified(_) => false,
        };
        (second, is_wrong)
    }

    /// Identifies `field`, and numbers the matches as the sources are: `sources[i]` is the source of star i.
    fn identify(
        &self,
        (field, sources): (&StarField, &[usize]),
        knowledge: &Knowledge,
        workspace: &mut Workspace,
    ) -> Outcome {
        let hints = knowledge.hints(field.width_px);
        match workspace.identify.identify(field, &hints, &self.sky) {
            Ok(found) => {
                let mut identification = Box::new(found.clone());
                for star_match in &mut identification.matches {
                    star_match.observed = sources[star_match.observed];
                }
                Outcome::Identified(identification)
            }
            Err(reason) => Outcome::NotIdentified(reason),
        }
    }

    /// The same outcome; where the field is not identified, with a reason that says more, also from `image` where there
    /// is one.
    fn explained(
        &self,
        outcome: Outcome,
        field: &StarField,
        knowledge: &Knowledge,
        image: Option<(&Frame, &Detections)>,
    ) -> Outcome {
        let Outcome::NotIdentified(reason) = outcome else {
            return outcome;
        };
        let examined = Examined {
            image,
            field,
            hints: &knowledge.hints(field.width_px),
        };
        Outcome::NotIdentified(diagnosis::explain(&examined, &self.sky, reason))
    }
}

/// What to say of a frame whose grey levels do not follow the light.
fn not_linear(photometry: &FramePhotometry) -> Option<String> {
    let zero_point = photometry.zero_point.filter(|zero| zero.is_nonlinear)?;
    Some(format!(
        "the grey levels are not proportional to light: a magnitude is {:.2} ± {:.2} in this frame, and its zero point holds near V {:.1} only",
        zero_point.linearity?.value, zero_point.linearity?.sigma, zero_point.mean_v_mag
    ))
}

/// What is left of an identification found at the second attempt: chance had twice the opportunity, at most, since all
/// that the first attempt can have tried is tried again.
fn at_second_attempt(outcome: Outcome) -> Option<Outcome> {
    match outcome {
        Outcome::Identified(mut identification) => {
            identification.log10_false_alarm += std::f64::consts::LOG10_2;
            let sure = identification.log10_false_alarm <= LOG10_FALSE_ALARM_LIMIT;
            sure.then_some(Outcome::Identified(identification))
        }
        not_identified => Some(not_identified),
    }
}

/// The sources that may be stars, and the index of each among all sources.
pub fn star_field(
    frame: &Frame,
    detections: &Detections,
    years_since_j2000: f64,
) -> (StarField, Vec<usize>) {
    let sources = &detections.sources;
    let kept: Vec<usize> = (0..sources.len())
        .filter(|&i| sources[i].flags.is_star_like() && sources[i].flux_adu > 0.0)
        .collect();
    let observed = |&i: &usize| {
        let source = &sources[i];
        let variance_px2 = (source.sigma_x_px.powi(2) + source.sigma_y_px.powi(2)) / 2.0;
        ObservedStar {
            position: source.position,
            sigma_px: variance_px2.sqrt(),
            mag: instrumental_mag(source.flux_adu),
            is_saturated: source.flags.saturated,
        }
    };
    let field = StarField {
        width_px: frame.width as f64,
        height_px: frame.height as f64,
        photometry: Photometry::Instrumental,
        years_since_j2000,
        spot_sigma_px: Some(detections.spot_sigma_px),
        stars: kept.iter().map(observed).collect(),
    };
    (field, kept)
}

fn milliseconds_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
