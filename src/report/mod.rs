//! What is told of a frame: plain values with the units in their names, as JSON, as a table, and as text.
//!
//! [`Solution`](crate::pipeline::Solution) → [`FrameReport`] → JSON line, CSV rows or text.
//!
//! Conventions: [`crate::conventions`]. Numbers are rounded to what they can bear, and one that is not
//! finite is left out (`null` in JSON, an empty field in CSV). Fields may be added to the schema; none is
//! renamed or dropped without a new [`SCHEMA`].

mod build;
mod compared;
#[cfg(feature = "overlay")]
pub mod overlay;
mod reason;
mod table;
mod text;
pub mod wcs;

pub use compared::PredictionReport;
pub use table::{TABLE_COLUMNS, write_table_header};
pub use text::{STARS_SHOWN, TextOptions};

use crate::identify::DateSource;
use serde::Serialize;

/// Version of the JSON described here.
pub const SCHEMA: u32 = 1;

/// All that is told of one frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameReport {
    /// [`SCHEMA`].
    pub schema: u32,
    /// The frame as it was named, mostly a path.
    pub frame: String,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// When it was taken, where that is known; else the stars stand where they stood at J2000.0.
    pub date: Option<DateReport>,
    /// Where in the sky the frame's centre stood, where it is identified, and site and time of day are known.
    pub observation: Option<ObservationReport>,
    /// How long it was exposed, in seconds, where that is known.
    pub exposure_s: Option<f64>,
    /// What is wrong or cannot be true in the file's header or in what was given, and what is odd about the frame: a sentence each.
    pub notes: Vec<String>,
    /// Whether the stars are identified.
    pub status: Status,
    /// Why they are not, and what may help.
    pub reason: Option<String>,
    /// The same as a word for programs, see [`Reason::code`](crate::identify::Reason::code).
    pub reason_code: Option<&'static str>,
    /// Where the camera points.
    pub attitude: Option<AttitudeReport>,
    /// What the camera turned out to be.
    pub optics: Option<OpticsReport>,
    /// How good the identification is.
    #[serde(rename = "match")]
    pub matched: Option<MatchReport>,
    /// How faint the frame goes.
    pub magnitude: Option<MagnitudeReport>,
    /// How bright its stars are, and how faint it goes; none of lists of centroids.
    pub photometry: Option<PhotometryReport>,
    /// What the camera should have seen, where it is described and the exposure known.
    pub prediction: Option<PredictionReport>,
    /// What was taken out of the frame before stars were looked for, where anything was.
    pub calibration: Option<CalibrationReport>,
    /// The sky between the stars.
    pub background: BackgroundReport,
    /// Every detection, brightest first.
    pub stars: Vec<StarReport>,
    /// How long it took.
    pub timing_ms: TimingReport,
}

/// What was taken out of a frame: the files.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CalibrationReport {
    /// The dark whose pattern was subtracted.
    pub dark: Option<String>,
    /// The flat by which the rest was divided.
    pub flat: Option<String>,
    /// The list of pixels that became pixels without a value.
    pub hot_pixels: Option<String>,
}

/// When the frame was taken.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DateReport {
    /// ISO 8601, in UTC; the day alone where the time is not known.
    pub iso: String,
    /// The Julian epoch in years.
    pub year: f64,
    /// `option`, `file header` or `file name`.
    pub source: DateSource,
}

/// Where in the sky the frame's centre stood.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObservationReport {
    /// The site.
    pub site: SiteReport,
    /// True zenith distance, without refraction, in degrees.
    pub zenith_distance_deg: f64,
    /// Zenith distance with refraction, in degrees; none below the horizon.
    pub apparent_zenith_distance_deg: Option<f64>,
    /// Azimuth from north through east, in degrees, in [0, 360).
    pub azimuth_deg: f64,
    /// Air in the line of sight, in units of that to the zenith; none below the horizon.
    pub airmass: Option<f64>,
}

/// A place on the Earth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SiteReport {
    /// Geodetic latitude in degrees, north positive.
    pub lat_deg: f64,
    /// Longitude in degrees, east positive.
    pub lon_deg: f64,
    /// Height in metres.
    pub height_m: f64,
}

/// Whether the stars of a frame are identified.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// They are.
    Identified,
    /// They are not.
    NotIdentified,
}

/// Where the camera points.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AttitudeReport {
    /// Right ascension of the frame's centre, in degrees, in [0, 360).
    pub ra_deg: f64,
    /// Declination of the frame's centre, in degrees.
    pub dec_deg: f64,
    /// Position angle of image-up at the centre, from north through east, in degrees, in (−180, 180].
    pub up_pa_deg: f64,
    /// [w, x, y, z], w ≥ 0; turns an ICRS vector into camera axes.
    pub quaternion: [f64; 4],
    /// Standard errors of the attitude.
    pub sigma_arcsec: AttitudeSigma,
}

/// Standard errors of the attitude, as small turns about the camera's axes, in arcseconds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AttitudeSigma {
    /// About the image's x axis (moves the boresight along y).
    pub x: f64,
    /// About the image's y axis (moves the boresight along x).
    pub y: f64,
    /// About the boresight.
    pub roll: f64,
}

/// What the camera turned out to be.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OpticsReport {
    /// Angle between the middles of the left and right borders, in degrees.
    pub fov_x_deg: f64,
    /// Angle between the middles of the upper and lower borders, in degrees.
    pub fov_y_deg: f64,
    /// Focal length over pixel pitch.
    pub focal_length_px: f64,
    /// Standard error of the focal length, in pixels.
    pub focal_length_sigma_px: Option<f64>,
    /// The image is a mirror image of the sky.
    pub mirrored: bool,
    /// Departure from the pinhole camera, where the stars show one.
    pub distortion: Option<DistortionReport>,
}

/// Departure from the pinhole camera, as [`Distortion`](crate::camera::Distortion) defines it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DistortionReport {
    /// Name of the [`DistortionModel`](crate::camera::DistortionModel).
    pub model: &'static str,
    /// Offset from the frame's centre at which a normalised offset is 1, in pixels.
    pub radius_px: f64,
    /// Largest displacement at that offset, in pixels.
    pub largest_px: f64,
    /// The coefficients in pixels, in the model's order.
    pub coefficients_px: Vec<f64>,
}

/// How good the identification is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MatchReport {
    /// Detections in the frame.
    pub detected: usize,
    /// Detections identified with a catalogue star.
    pub matched: usize,
    /// Root mean square distance between observed and predicted position, in pixels.
    pub rms_px: f64,
    /// The same on the sky, in arcseconds.
    pub rms_arcsec: f64,
    /// log10 of the probability that chance gives as good an answer.
    pub log10_false_alarm: f64,
}

/// How faint the frame goes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MagnitudeReport {
    /// Johnson V of the faintest star identified.
    pub faintest_vmag: f64,
    /// Its catalogue number.
    pub faintest_id: String,
    /// Johnson V at which the camera should find half of the stars, where a camera is given.
    pub predicted_limit_vmag: Option<f64>,
    /// Faintest star minus that limit: not of like with like, for the faintest of many stars lies beyond it.
    pub difference_mag: Option<f64>,
    /// Johnson V of the faintest star that the camera should find among those of the field.
    pub expected_faintest_vmag: Option<f64>,
    /// The spread of that.
    pub expected_faintest_sigma_mag: Option<f64>,
    /// Faintest star found minus that; its standard error is the spread.
    pub faintest_difference_mag: Option<f64>,
    /// The measured magnitude at which half of the stars are found minus the predicted one.
    pub limit_difference_mag: Option<f64>,
    /// Its standard error: that of the measurement.
    pub limit_difference_sigma_mag: Option<f64>,
}

/// How bright a frame's stars are, and how faint it goes, see [`photometry`](crate::photometry).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PhotometryReport {
    /// V magnitude of a star whose flux is 1 in `flux_unit`; none where too few stars tell.
    pub zero_point_vmag: Option<f64>,
    /// Its standard error.
    pub zero_point_sigma_mag: Option<f64>,
    /// `ADU/s` where the exposure is known, else `ADU`.
    pub flux_unit: &'static str,
    /// Standard deviation of a star about zero point and colour term, robust.
    pub scatter_mag: Option<f64>,
    /// Stars of the zero point.
    pub zero_point_stars: usize,
    /// Their mean V magnitude.
    pub zero_point_mean_vmag: Option<f64>,
    /// B−V of the star for which the zero point holds.
    pub zero_point_bv_mag: Option<f64>,
    /// Magnitudes that V − instrumental magnitude grows by to one magnitude of B−V, where stars show that it does.
    pub color_term: Option<f64>,
    /// Its standard error.
    pub color_term_sigma: Option<f64>,
    /// Instrumental magnitudes to one magnitude of V: 1 where the grey level is proportional to light.
    pub linearity: Option<f64>,
    /// Its standard error.
    pub linearity_sigma: Option<f64>,
    /// V magnitude at which half of the catalogue's stars are detected.
    pub limit50_vmag: Option<f64>,
    /// Its standard error.
    pub limit50_sigma_mag: Option<f64>,
    /// Standard deviation of the fall of completeness.
    pub limit50_width_mag: Option<f64>,
    /// The part of much brighter stars that is not detected.
    pub lost_share: Option<f64>,
    /// Why there is no limit.
    pub limit50_reason: Option<String>,
    /// The completeness, in steps of half a magnitude.
    pub completeness: Vec<CompletenessReport>,
}

/// One step of the completeness.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CompletenessReport {
    /// V magnitude of its middle.
    pub vmag: f64,
    /// Single stars of the catalogue in the frame.
    pub stars: usize,
    /// Those of them that were detected.
    pub detected: usize,
}

/// The sky between the stars, in the frame's own units.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct BackgroundReport {
    /// Median level; none for a list of centroids.
    pub level: Option<f64>,
    /// Standard deviation of one pixel.
    pub noise: Option<f64>,
}

/// One detection, and the star that it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StarReport {
    /// Position to the right, in pixels.
    pub x: f64,
    /// Position downward, in pixels.
    pub y: f64,
    /// Standard error of `x`, in pixels.
    pub sigma_x: Option<f64>,
    /// Standard error of `y`, in pixels.
    pub sigma_y: Option<f64>,
    /// Flux above the background, in the frame's own units.
    pub flux: Option<f64>,
    /// Brightest pixel above the background, in the frame's own units.
    pub peak: Option<f64>,
    /// The flux in electrons, where a camera is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flux_e: Option<f64>,
    /// The brightest pixel in electrons, where a camera is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_e: Option<f64>,
    /// Flux over its standard error.
    pub snr: Option<f64>,
    /// The catalogue's own number for the star.
    pub id: Option<String>,
    /// Its name, if it has one.
    pub name: Option<String>,
    /// Its Johnson V magnitude.
    pub vmag: Option<f64>,
    /// Its right ascension (ICRS) at the frame's date, in degrees.
    pub ra_deg: Option<f64>,
    /// Its declination (ICRS) at the frame's date, in degrees.
    pub dec_deg: Option<f64>,
    /// Distance between observed and predicted position, in pixels.
    pub residual_px: Option<f64>,
    /// What is unusual about the detection: `saturated`, `hot_pixel`, `trail`, `extended`, `blended`, `border`.
    pub flags: Vec<&'static str>,
}

/// How long each stage took, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct TimingReport {
    /// Reading and decoding the file.
    pub read: f64,
    /// Finding and measuring the stars.
    pub detect: f64,
    /// Identifying them.
    pub identify: f64,
    /// Zero point and completeness.
    pub photometry: f64,
    /// All of it.
    pub total: f64,
}

impl FrameReport {
    /// The report as one line of JSON, without the line's end.
    ///
    /// # Errors
    /// [`serde_json::Error`], which these types give no occasion for.
    pub fn to_json_line(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string(self)
    }

    /// Whether the stars are identified.
    pub fn is_identified(&self) -> bool {
        self.status == Status::Identified
    }
}

#[cfg(test)]
mod tests;
