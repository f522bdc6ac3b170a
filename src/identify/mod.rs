//! From a list of star positions to catalogue stars, pointing and scale.

pub mod attitude;
mod blends;
mod cache;
mod cache_directory;
mod cells;
pub mod diagnosis;
pub mod index;
mod indexed_catalog;
mod listing;
mod predict;
mod refine;
mod search;
mod table;
pub mod triangle;
mod verify;

pub use cache::CacheError;
pub use cache_directory::cache_directory;
pub use indexed_catalog::IndexedCatalog;
pub use predict::{PredictedStar, View};
pub use search::LOG10_FALSE_ALARM_LIMIT;

use refine::{Refined, Start};
use search::{Buffers, Found, Search};
use verify::{Pair, Scene};

use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::camera::{CameraModel, DistortionModel};
use nalgebra::Matrix3;

/// One star as observed, the input of identification.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservedStar {
    /// Its centroid.
    pub position: PixelPoint,
    /// Standard error of the centroid on one axis, in pixels.
    pub sigma_px: f64,
    /// Brightness in magnitudes; smaller is brighter. See [`StarField::photometry`].
    pub mag: f64,
    /// Whether the detector was saturated: the star may be brighter than `mag`, by any amount.
    pub is_saturated: bool,
}

/// What the observed magnitudes mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Photometry {
    /// −2.5 log10(flux) with an unknown zero point.
    Instrumental,
    /// Johnson V.
    JohnsonV,
}

impl Photometry {
    /// How far an observed magnitude, brought to V by the zero point, may be from the catalogue's.
    pub const fn tolerance_mag(self) -> f64 {
        match self {
            // Colour, saturation, and the tone curve of a JPEG.
            Self::Instrumental => 2.5,
            Self::JohnsonV => 1.5,
        }
    }
}

/// The stars seen in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct StarField {
    /// Width of the frame, in pixels.
    pub width_px: f64,
    /// Height of the frame, in pixels.
    pub height_px: f64,
    /// What the magnitudes of `stars` mean.
    pub photometry: Photometry,
    /// When they were seen, in Julian years since J2000.0: the stars move.
    pub years_since_j2000: f64,
    /// Standard deviation of a star's spot before pixel integration, in pixels; without it every star of the catalogue is taken to be
    /// seen by itself.
    pub spot_sigma_px: Option<f64>,
    /// Brightest first.
    pub stars: Vec<ObservedStar>,
}

impl StarField {
    /// The `count` brightest stars, or all if there are fewer.
    pub fn brightest(&self, count: usize) -> &[ObservedStar] {
        &self.stars[..count.min(self.stars.len())]
    }
}

/// What is known beforehand.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Hints {
    /// Smallest and largest angle that a pixel at the frame's centre may span, in radians.
    pub pixel_scale_rad: Option<(f64, f64)>,
    /// The boresight lies within so many radians of this direction.
    pub near: Option<(UnitVector<Icrs>, f64)>,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The stars are identified.
    Identified(Box<Identification>),
    /// They are not.
    NotIdentified(Reason),
}

/// Why a field was not identified. Identification itself gives the first two; `diagnosis` looks further.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// Fewer stars than any identification needs.
    TooFewStars {
        /// Stars found.
        found: usize,
        /// Stars needed at the least.
        needed: usize,
    },
    /// No hypothesis passed the threshold on the false-alarm probability.
    NoMatch {
        /// log10 of the false-alarm probability of the best hypothesis, if there was one.
        best_log10_false_alarm: Option<f64>,
    },
    /// All pixels of the frame have one value.
    NoVariation {
        /// That value, in the frame's own units.
        level_adu: f64,
    },
    /// A large part of the frame is at full scale.
    Saturated {
        /// That part, in [0, 1].
        share: f64,
        /// The level, in the frame's own units.
        level_adu: f64,
    },
    /// The stars are trails: the camera moved, or they did.
    Trails {
        /// Detections that are trails.
        trails: usize,
        /// Their angle to the image's x axis, in radians, in (−π/2, π/2]; above 0 they rise to the right.
        angle_rad: f64,
        /// Their median length, in pixels.
        length_px: f64,
    },
    /// The same pattern of stars is there twice.
    DoubleExposure {
        /// Pairs of stars with this offset.
        pairs: usize,
        /// The offset along x and y, in pixels.
        offset_px: [f64; 2],
    },
    /// The scale asked for is outside what can be identified.
    ScaleOutOfRange {
        /// Horizontal field of view asked for, from and to, in radians.
        fov_x_rad: (f64, f64),
        /// The horizontal fields of view that the catalogue allows, in radians.
        searched_rad: (f64, f64),
    },
    /// Without the hints the stars are identified.
    HintsExclude(Box<Excluded>),
}

/// A solution that the hints do not allow.
#[derive(Debug, Clone, PartialEq)]
pub struct Excluded {
    /// Its horizontal field of view, in radians.
    pub fov_x_rad: f64,
    /// Where it points.
    pub boresight: UnitVector<Icrs>,
    /// Stars identified.
    pub stars: usize,
    /// The field of view that the hints allow, from and to, in radians, where it is not among them.
    pub allowed_fov_x_rad: Option<(f64, f64)>,
    /// How far it is from the direction hinted at, and how far it may be, in radians, where it is too far.
    pub distance_rad: Option<(f64, f64)>,
}

impl Reason {
    /// A word for it, for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::TooFewStars { .. } => "too_few_stars",
            Self::NoMatch { .. } => "no_match",
            Self::NoVariation { .. } => "no_variation",
            Self::Saturated { .. } => "saturated",
            Self::Trails { .. } => "trails",
            Self::DoubleExposure { .. } => "double_exposure",
            Self::ScaleOutOfRange { .. } => "scale_out_of_range",
            Self::HintsExclude(_) => "hints_exclude",
        }
    }
}

/// An identified field.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// Which direction each pixel looks in.
    pub camera: CameraModel,
    /// The attitude.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Covariance of the small turn about the camera's x, y and z axes by which the attitude may be off, in rad².
    pub attitude_covariance_rad2: Matrix3<f64>,
    /// Standard error of the focal length, in pixels.
    pub focal_length_sigma_px: f64,
    /// The stars identified, in the order of the observed stars.
    pub matches: Vec<StarMatch>,
    /// Root mean square of the residuals (distance between observed and predicted position), in pixels.
    pub rms_px: f64,
    /// log10 of the probability that noise alone gives as good an answer, all hypotheses tried counted.
    pub log10_false_alarm: f64,
}

impl Identification {
    /// Standard errors of the attitude about the camera's x, y and z axes, in radians.
    pub fn attitude_sigma_rad(&self) -> [f64; 3] {
        self.attitude_covariance_rad2
            .diagonal()
            .map(f64::sqrt)
            .into()
    }
}

/// One observed star and the catalogue star that it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StarMatch {
    /// Index into [`StarField::stars`].
    pub observed: usize,
    /// Index into the catalogue's stars.
    pub catalog: usize,
    /// Distance between the observed position and that predicted for the star, or for the light of all stars that the camera
    /// does not tell from it, in pixels.
    pub residual_px: f64,
}

/// Stars without which no identification is possible: a triangle and one that decides.
pub const MIN_STARS: usize = 4;

/// Identifies the stars of `field`. For many fields, [`Workspace::identify`] does the same without allocating.
pub fn identify(field: &StarField, hints: &Hints, sky: &IndexedCatalog) -> Outcome {
    match Workspace::new().identify(field, hints, sky) {
        Ok(found) => Outcome::Identified(Box::new(found.clone())),
        Err(reason) => Outcome::NotIdentified(reason),
    }
}

/// What identification works with, kept from field to field: once it has seen the largest, nothing is allocated.
#[derive(Debug, Default)]
pub struct Workspace {
    buffers: Buffers,
    answer: Option<Identification>,
}

impl Workspace {
    /// An empty one.
    pub fn new() -> Self {
        Self::default()
    }

    /// Identifies the stars of `field`. The answer lies in the workspace.
    ///
    /// # Errors
    /// The [`Reason`] why they are not identified.
    pub fn identify(
        &mut self,
        field: &StarField,
        hints: &Hints,
        sky: &IndexedCatalog,
    ) -> Result<&Identification, Reason> {
        if field.stars.len() < MIN_STARS {
            return Err(Reason::TooFewStars {
                found: field.stars.len(),
                needed: MIN_STARS,
            });
        }
        let scene = Scene { field, sky };
        let mut search = Search::new(scene, hints, &mut self.buffers);
        let Some(found) = search.run() else {
            return Err(Reason::NoMatch {
                best_log10_false_alarm: search.best_log10_false_alarm(),
            });
        };
        let completed = complete(scene, &mut search, &found);
        let (refined, log10, pairs) = match completed {
            Some((refined, log10)) => (refined, log10, &self.buffers.refiner.pairs),
            None => (found.refined, found.log10_false_alarm, &self.buffers.found),
        };
        let mut matches = self.answer.take().map_or_else(Vec::new, |old| old.matches);
        matches.clear();
        matches.extend(pairs.iter().map(Pair::star_match));
        Ok(self.answer.insert(identification(&refined, log10, matches)))
    }
}

/// The final fit, with all stars and as much distortion as they support. `None` where the search's own answer stands: all the
/// stars can only make it surer.
fn complete(scene: Scene, search: &mut Search, found: &Found) -> Option<(Refined, f64)> {
    let field = scene.field;
    let hypothesis = found.refined.hypothesis();
    let start = Start {
        hypothesis: &hypothesis,
        radius_px: FINAL_RADIUS_SHARE * field.width_px.hypot(field.height_px),
        sceptical: false,
        stars: CALIBRATION_STARS,
        richest: DistortionModel::Quintic,
    };
    let refiner = search.refiner();
    let settled = refiner.refine(scene, &start)?;
    let settled = refiner.with_all_stars(scene, &settled)?;
    let refined = refiner.with_blends(scene, settled)?;
    let log10 = search.log10_false_alarm(&refined.hypothesis())?;
    (log10 <= LOG10_FALSE_ALARM_LIMIT).then_some((refined, log10))
}

fn identification(
    refined: &Refined,
    log10_false_alarm: f64,
    matches: Vec<StarMatch>,
) -> Identification {
    let covariance = &refined.fit.covariance;
    let sum_sq: f64 = matches.iter().map(|m| m.residual_px.powi(2)).sum();
    Identification {
        attitude_covariance_rad2: covariance.fixed_view::<3, 3>(0, 0).into_owned(),
        focal_length_sigma_px: covariance[(3, 3)].sqrt() * refined.fit.camera.focal_length_px,
        camera: refined.fit.camera,
        icrs_to_camera: refined.fit.icrs_to_camera,
        rms_px: (sum_sq / matches.len().max(1) as f64).sqrt(),
        matches,
        log10_false_alarm,
    }
}

/// Stars, the brightest, that decide how much distortion there is.
const CALIBRATION_STARS: usize = 120;
/// Where the final fit starts to look for pairs, in units of the frame's diagonal.
const FINAL_RADIUS_SHARE: f64 = 0.005;
