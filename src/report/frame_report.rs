//! The report of a frame: its fields, as JSON has them.

use super::sky::SkyReport;
use crate::base::coords::PixelPoint;
use crate::base::format::json_escaped;
use crate::base::remedy::Remedy;
use crate::ephemeris::places::AttitudeFrame;
use crate::frame::RowOrder;
use crate::identify::DateSource;
use serde::Serialize;
use std::io;

/// Version of the JSON described here.
pub const SCHEMA: u32 = 2;

/// The report of one frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct FrameReport {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Name of the frame, usually a path.
    pub frame: String,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Order of the rows in the file; `None` for lists of centroids.
    pub row_order: Option<RowOrder>,
    /// Date of the frame, if known; otherwise star positions are those of J2000.0.
    pub date: Option<DateReport>,
    /// The frame's centre in the observer's sky, where the frame is identified, and site and time
    /// of day are known.
    pub observation: Option<ObservationReport>,
    /// What the stars contradict of the site and the time; `None` where nothing.
    pub place_time: Option<PlaceTimeReport>,
    /// Exposure in seconds, if known.
    pub exposure_s: Option<f64>,
    /// What is odd about the frame, its header, or the priors.
    pub notes: Vec<NoteReport>,
    /// Whether the stars are identified.
    pub status: Status,
    /// Why they are not identified, and what may help.
    pub reason: Option<String>,
    /// Code of the reason, see [`Reason::code`](crate::solve::Reason::code).
    pub reason_code: Option<&'static str>,
    /// What the frame shows, in one sentence, where it is identified.
    pub sentence: Option<String>,
    /// log10 of the false-alarm probability of the best arrangement, where none was good enough.
    pub best_log10_false_alarm: Option<f64>,
    /// Names of the options that may help where they are not identified.
    pub remedies: Vec<Remedy>,
    /// The attitude of the camera.
    pub attitude: Option<AttitudeReport>,
    /// What shifts the places of the stars and was applied.
    pub apparent: Option<ApparentReport>,
    /// The fitted camera.
    pub optics: Option<OpticsReport>,
    /// Quality of the identification.
    #[serde(rename = "match")]
    pub matched: Option<MatchReport>,
    /// The faintest star, compared with the prediction.
    pub magnitude: Option<MagnitudeReport>,
    /// Zero point and completeness; `None` for lists of centroids.
    pub photometry: Option<PhotometryReport>,
    /// The prediction for the stated camera, where there is one and the exposure is known.
    pub prediction: Option<PredictionReport>,
    /// The calibration that was applied, if any.
    pub calibration: Option<CalibrationReport>,
    /// The sky at each place, where it was wanted (`starpipe sky`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sky: Option<SkyReport>,
    /// The sky background.
    pub background: BackgroundReport,
    /// The Moon and the planets in the frame, where its date is known.
    pub bodies: Vec<BodyReport>,
    /// The constellations in the frame, largest share first.
    pub constellations: Vec<ConstellationReport>,
    /// What has a name in the frame, by its pose: constellations, bodies, deep-sky objects, radiants, and the
    /// bright stars, whether they are measured or not.
    pub annotations: Vec<AnnotationReport>,
    /// Satellites, aeroplanes and meteors, where they were searched.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trails: Option<Vec<TrailReport>>,
    /// Every detection, brightest first.
    pub stars: Vec<StarReport>,
    /// Run times.
    pub timing_ms: TimingReport,
}

/// A constellation in a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConstellationReport {
    /// Its Latin name.
    pub name: &'static str,
    /// The abbreviation of the International Astronomical Union.
    pub abbreviation: &'static str,
    /// The share of the frame's sky that lies within its boundary.
    pub share: f64,
    /// The share of the lines of its figure that is in the frame.
    pub figure_share: f64,
}

/// Something in a frame that has a name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AnnotationReport {
    /// `star`, `constellation`, `deep_sky`, `body` (the Moon or a planet) or `radiant` (of a meteor shower).
    pub kind: &'static str,
    /// Its name, in full.
    pub name: String,
    /// Its name beside it in a picture.
    pub label: String,
    /// Column of its place: of its measurement where there is one, else where the pose has it.
    pub x: f64,
    /// Row of its place.
    pub y: f64,
    /// Its light is within so many pixels of that place; `None` for constellations.
    pub uncertainty_px: Option<f64>,
    /// Half of its longer side, in pixels, where it has a size.
    pub radius_px: Option<f64>,
    /// V magnitude, where it has one.
    pub vmag: Option<f64>,
    /// Catalogue number of a star, designation of a deep-sky object.
    pub id: Option<String>,
    /// Number of the detection in [`stars`](FrameReport::stars) that has its light.
    pub detection: Option<usize>,
    /// Why that detection is not its measurement: `saturated`, `blended`, `extended`, `border` or `uncertain`;
    /// `None` where it is.
    pub why: Option<&'static str>,
}

/// One note, or another statement with a code.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct NoteReport {
    /// Code for programs: of a note that of [`Note::code`](crate::solve::Note::code).
    pub code: &'static str,
    /// The sentence.
    pub text: String,
}

/// The files of the applied calibration.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CalibrationReport {
    /// The dark that was subtracted.
    pub dark: Option<String>,
    /// The flat by which the frame was divided.
    pub flat: Option<String>,
    /// The list of hot pixels, which were masked.
    pub hot_pixels: Option<String>,
    /// The mask.
    pub mask: Option<String>,
}

/// The date of a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DateReport {
    /// ISO 8601, in UTC; only the day where the time is not known.
    pub iso: String,
    /// Julian epoch, in years.
    pub year: f64,
    /// `option`, `file header` or `file name`.
    pub source: DateSource,
    /// What the clock of the source was taken to be ahead of UTC, in hours: 0 where it states UTC, or its
    /// offset; `None` where only the day is known.
    pub utc_offset_h: Option<f64>,
    /// What tells that: `stated` with the date, `option`, `stars`, `assumed`, or `contradicted` by the stars;
    /// `None` where only the day is known.
    pub utc_offset_source: Option<&'static str>,
    /// The date may be off by so many hours, for what is known of the offset.
    pub uncertainty_h: f64,
}

/// What the stars contradict of the place and the time that are stated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaceTimeReport {
    /// What contradicts them: `stars_below_horizon`, `refraction`, `sun_is_up`, `planets`.
    pub contradicted_by: Vec<&'static str>,
    /// Sure stars that would be below the horizon.
    pub stars_below_horizon: Option<usize>,
    /// True altitude of the lowest of them, in degrees.
    pub lowest_star_deg: Option<f64>,
    /// True altitude of the Sun, in degrees, where it contradicts them.
    pub sun_altitude_deg: Option<f64>,
    /// What would put them right, the most likely first.
    pub candidates: Vec<CandidateReport>,
}

/// What would put a place and a time right.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CandidateReport {
    /// What is changed: `latitude_sign`, `longitude_sign`, `both_signs`, `exchanged`, `place`, `hours`,
    /// `order_of_date`, `days`, `years`.
    pub change: &'static str,
    /// By how much the time is later, in the unit of the change; `None` for other changes.
    pub amount: Option<f64>,
    /// The least of the amounts that are nearly as good.
    pub amount_from: Option<f64>,
    /// The largest of them.
    pub amount_to: Option<f64>,
    /// Latitude, north positive, in degrees.
    pub lat_deg: f64,
    /// Longitude, east positive, in degrees.
    pub lon_deg: f64,
    /// The date in UTC, ISO 8601.
    pub date: String,
    /// Odds of the first candidate against it.
    pub odds_against: f64,
}

/// The frame's centre in the observer's sky.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObservationReport {
    /// The site.
    pub site: SiteReport,
    /// True zenith distance, without refraction, in degrees.
    pub zenith_distance_deg: f64,
    /// Zenith distance with refraction, in degrees; `None` below the horizon.
    pub apparent_zenith_distance_deg: Option<f64>,
    /// Azimuth from north through east, in degrees, in [0, 360).
    pub azimuth_deg: f64,
    /// Airmass; `None` below the horizon.
    pub airmass: Option<f64>,
}

/// A site on the Earth.
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
    /// Identified.
    Identified,
    /// Not identified.
    NotIdentified,
}

/// The attitude of the camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AttitudeReport {
    /// What it is the attitude of: the frame's `centre`, or the `axis` of a lens that is no pinhole.
    pub at: &'static str,
    /// Which directions it refers to: `icrs`, those of the catalogue at the date, or `apparent`, those
    /// from which light reaches the camera, in ICRS axes.
    pub frame_of: AttitudeFrame,
    /// Right ascension of the frame's centre, in degrees, in [0, 360).
    pub ra_deg: f64,
    /// Declination of the frame's centre, in degrees.
    pub dec_deg: f64,
    /// Position angle of image-up at the centre, from north through east, in degrees, in (−180,
    /// 180].
    pub up_pa_deg: f64,
    /// [w, x, y, z], w ≥ 0; rotates ICRS vectors into camera axes.
    pub quaternion: [f64; 4],
    /// Standard errors of the attitude.
    pub sigma_arcsec: AttitudeSigma,
    /// Covariance of the small rotation about the camera's x, y and z axes, in square arcseconds.
    pub covariance_arcsec2: [[f64; 3]; 3],
}

/// What shifts the places of the stars and was applied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct ApparentReport {
    /// Aberration.
    pub aberration: bool,
    /// Refraction.
    pub refraction: bool,
    /// Whether the date is unknown, and so taken to be 2000.
    pub date_assumed: bool,
}

/// Standard errors of the attitude, as small rotations about the camera's axes, in arcseconds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AttitudeSigma {
    /// About the image's x axis (moves the boresight along y).
    pub x: f64,
    /// About the image's y axis (moves the boresight along x).
    pub y: f64,
    /// About the boresight.
    pub roll: f64,
}

/// The fitted camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OpticsReport {
    /// Whether the lens is the one that was measured (`[lens]` of the camera's description), and was held.
    pub held: bool,
    /// Angle between the middles of the left and right borders, in degrees; none where one of them does
    /// not see the sky.
    pub fov_x_deg: Option<f64>,
    /// Angle between the middles of the upper and lower borders, in degrees.
    pub fov_y_deg: Option<f64>,
    /// Standard error of `fov_x_deg`, in degrees.
    pub fov_x_sigma_deg: Option<f64>,
    /// Standard error of `fov_y_deg`, in degrees.
    pub fov_y_sigma_deg: Option<f64>,
    /// Name of the [`Projection`](crate::camera::Projection).
    pub model: &'static str,
    /// Focal length over pixel pitch: 1 / the scale in radians per pixel at the frame's centre of a
    /// pinhole, and on the axis of another lens.
    pub focal_length_px: f64,
    /// Standard error of the focal length, in pixels.
    pub focal_length_sigma_px: Option<f64>,
    /// Whether the image is a mirror image of the sky.
    pub mirrored: bool,
    /// The pixel on the axis of the lens, [x, y]: the centre of the frame where the stars do not say
    /// otherwise.
    pub axis_px: [f64; 2],
    /// Angle from the axis, in degrees, to which the lens is known; none where it is known all over the
    /// frame.
    pub valid_to_deg: Option<f64>,
    /// Distortion, where it is significant.
    pub distortion: Option<DistortionReport>,
}

/// Distortion, as [`Distortion`](crate::camera::Distortion) defines it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DistortionReport {
    /// Name of the [`DistortionModel`](crate::camera::DistortionModel).
    pub model: &'static str,
    /// Focal length on the axis of the lens, in pixels.
    pub focal_length_px: f64,
    /// Radius at which a normalised offset is 1, in pixels.
    pub radius_px: f64,
    /// Largest displacement in the corners, or where an all-sky lens ends, without that of the axis, in
    /// pixels.
    pub largest_px: f64,
    /// The coefficients in pixels, in the model's order.
    pub coefficients_px: Vec<f64>,
}

/// Quality of the identification.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MatchReport {
    /// Number of detections.
    pub detected: usize,
    /// Number of detections identified with a catalogue star.
    pub matched: usize,
    /// Root mean square distance between observed and predicted position, in pixels.
    pub rms_px: f64,
    /// The same on the sky, in arcseconds.
    pub rms_arcsec: f64,
    /// log10 of the false-alarm probability.
    pub log10_false_alarm: f64,
    /// The deep catalogue that it took, for people.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub catalog: Option<String>,
}

/// The faintest identified star, compared with the prediction.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct MagnitudeReport {
    /// Johnson V of the faintest identified star.
    pub faintest_vmag: f64,
    /// Its catalogue number.
    pub faintest_id: String,
    /// Johnson V at which the stated camera should find half of the stars.
    pub predicted_limit_vmag: Option<f64>,
    /// Faintest star minus that limit. Not a comparison of like with like: the faintest of many
    /// stars lies beyond the limit.
    pub difference_mag: Option<f64>,
    /// Johnson V of the expected faintest star among those in the field.
    pub expected_faintest_vmag: Option<f64>,
    /// Standard deviation of that expectation.
    pub expected_faintest_sigma_mag: Option<f64>,
    /// Faintest identified star minus the expected one; its standard error is that standard
    /// deviation.
    pub faintest_difference_mag: Option<f64>,
    /// Measured minus predicted limit (where half of the stars are found).
    pub limit_difference_mag: Option<f64>,
    /// Its standard error, from the measurement.
    pub limit_difference_sigma_mag: Option<f64>,
}

/// Zero point and completeness of a frame, see [`photometry`](crate::photometry).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PhotometryReport {
    /// V magnitude of a star whose flux is 1 in `flux_unit`; `None` with too few stars.
    pub zero_point_vmag: Option<f64>,
    /// Its standard error.
    pub zero_point_sigma_mag: Option<f64>,
    /// Why there is none, with the code of [`NoZeroPoint`](crate::photometry::zero_point::NoZeroPoint).
    pub no_zero_point: Option<NoteReport>,
    /// `ADU/s` where the exposure is known, else `ADU`.
    pub flux_unit: &'static str,
    /// Robust standard deviation of a star about zero point and color term.
    pub scatter_mag: Option<f64>,
    /// Number of stars of the zero point.
    pub zero_point_stars: usize,
    /// Their mean V magnitude.
    pub zero_point_mean_vmag: Option<f64>,
    /// B−V for which the zero point holds.
    pub zero_point_bv_mag: Option<f64>,
    /// Increase of V − instrumental magnitude per magnitude of B−V, where it is significant.
    pub color_term: Option<f64>,
    /// Its standard error.
    pub color_term_sigma: Option<f64>,
    /// Magnitudes by which stars in the corners are dimmer than in the centre, for which the zero
    /// point then holds; `None` where it is not significant.
    pub corner_loss_mag: Option<f64>,
    /// Its standard error.
    pub corner_loss_sigma_mag: Option<f64>,
    /// Instrumental magnitudes per magnitude of V: 1 where grey levels are proportional to light.
    pub linearity: Option<f64>,
    /// Its standard error.
    pub linearity_sigma: Option<f64>,
    /// V magnitude at which half of the catalogue's stars are detected; with a color term, of stars
    /// of the Sun's color.
    pub limit50_vmag: Option<f64>,
    /// Its standard error.
    pub limit50_sigma_mag: Option<f64>,
    /// Width (standard deviation) of the fall of completeness.
    pub limit50_width_mag: Option<f64>,
    /// Share of much brighter stars that is not detected.
    pub lost_share: Option<f64>,
    /// Why there is no limit.
    pub limit50_reason: Option<String>,
    /// The completeness in bins of half a magnitude.
    pub completeness: Vec<CompletenessReport>,
}

/// One bin of the completeness.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CompletenessReport {
    /// V magnitude of its centre.
    pub vmag: f64,
    /// Number of single catalogue stars in the frame.
    pub stars: usize,
    /// Number of those that were detected.
    pub detected: usize,
}

/// The prediction of the sensitivity model for the camera, the exposure, and the frame's own sky.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictionReport {
    /// Name of the camera.
    pub camera: String,
    /// Exposure, in seconds.
    pub exposure_s: f64,
    /// Zenith distance used, in degrees.
    pub zenith_distance_deg: f64,
    /// Whether it is known and not assumed to be 0.
    pub zenith_distance_known: bool,
    /// Airmass used.
    pub airmass: f64,
    /// V magnitude at which the detector finds half of the stars.
    pub limit50_vmag: Option<f64>,
    /// V magnitude at which it finds 90 % of the stars.
    pub limit90_vmag: Option<f64>,
    /// V magnitude at which the brightest pixel of half of the stars has a signal-to-noise ratio of
    /// 6.
    pub peak_limit50_vmag: Option<f64>,
    /// Expected number of catalogue stars found in the field.
    pub stars_expected: Option<f64>,
    /// Predicted V magnitude of a star that gives 1 ADU/s, of the B−V for which the measured zero
    /// point holds.
    pub zero_point_vmag: Option<f64>,
    /// Measured minus predicted zero point.
    pub zero_point_difference_mag: Option<f64>,
    /// Its standard error.
    pub zero_point_difference_sigma_mag: Option<f64>,
    /// Sky brightness in V, seen from the ground, with the camera's throughput, per square
    /// arcsecond.
    pub sky_camera_mag_arcsec2: Option<f64>,
    /// The same with the measured zero point, that is, from the stars in the frame.
    pub sky_mag_arcsec2: Option<f64>,
    /// Its standard error, that of the zero point.
    pub sky_sigma_mag: Option<f64>,
    /// Sky background in a pixel, in electrons.
    pub background_e: Option<f64>,
    /// Noise of a pixel without a star, in electrons.
    pub background_noise_e: Option<f64>,
    /// Part of it from the sensor: dark current, read noise, quantisation.
    pub sensor_noise_e: Option<f64>,
}

/// The sky background, in the frame's own units.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct BackgroundReport {
    /// Median background; `None` for a list of centroids.
    pub level: Option<f64>,
    /// Noise of one pixel (standard deviation).
    pub noise: Option<f64>,
    /// Share of the frame that shows the sky: the rest is masked, or the picture itself shows that something
    /// is in front of the sky there.
    pub sky_share: Option<f64>,
}

/// The Moon or a planet in the frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BodyReport {
    /// Its name in English.
    pub name: &'static str,
    /// Expected position to the right, in pixels.
    pub x: f64,
    /// Expected position downward, in pixels.
    pub y: f64,
    /// Its position may be off by this much, in pixels: error of theory, time and parallax.
    pub uncertainty_px: f64,
    /// Astrometric right ascension (ICRS), in degrees.
    pub ra_deg: f64,
    /// Astrometric declination (ICRS), in degrees.
    pub dec_deg: f64,
    /// Approximate Johnson V magnitude.
    pub vmag: f64,
    /// Angular radius, in pixels.
    pub radius_px: f64,
    /// Index of its detection in `stars`, counted from 0.
    pub detection: Option<usize>,
}

/// A satellite, an aeroplane or a meteor. Without a direction, the begin is the end with the smaller x.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrailReport {
    /// Position of the begin to the right, in pixels.
    pub x_begin: f64,
    /// Position of the begin downward, in pixels.
    pub y_begin: f64,
    /// Position of the end to the right, in pixels.
    pub x_end: f64,
    /// Position of the end downward, in pixels.
    pub y_end: f64,
    /// Standard error of the line's place across it, in pixels.
    pub sigma_across_px: f64,
    /// Distance of the ends, in pixels.
    pub length_px: f64,
    /// Full width across at half maximum, in pixels.
    pub width_px: f64,
    /// Flux above the background, in the frame's own units.
    pub flux: f64,
    /// Mean flux of a pixel of length.
    pub flux_per_px: f64,
    /// That over its standard error.
    pub snr: f64,
    /// Decimal logarithm of the expected number of such lines in a frame of noise.
    pub log10_false_alarm: f64,
    /// V magnitude of a star that gives the same light in this exposure.
    pub vmag: Option<f64>,
    /// V magnitude of the light of one arcsecond of length.
    pub vmag_per_arcsec: Option<f64>,
    /// Angle between the ends, in degrees.
    pub length_deg: Option<f64>,
    /// Astrometric right ascension (ICRS) of the begin, in degrees.
    pub ra_begin_deg: Option<f64>,
    /// Its declination, in degrees.
    pub dec_begin_deg: Option<f64>,
    /// Astrometric right ascension (ICRS) of the end, in degrees.
    pub ra_end_deg: Option<f64>,
    /// Its declination, in degrees.
    pub dec_end_deg: Option<f64>,
    /// Apparent altitude of the begin, in degrees, where site and time are known.
    pub altitude_begin_deg: Option<f64>,
    /// Its azimuth from north through east, in degrees.
    pub azimuth_begin_deg: Option<f64>,
    /// Apparent altitude of the end, in degrees, where site and time are known.
    pub altitude_end_deg: Option<f64>,
    /// Its azimuth from north through east, in degrees.
    pub azimuth_end_deg: Option<f64>,
}

/// One detection and its star.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
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
    /// Standard error of `flux`.
    pub sigma_flux: Option<f64>,
    /// Brightest pixel above the background, in the frame's own units.
    pub peak: Option<f64>,
    /// Flux in electrons, where a camera is stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flux_e: Option<f64>,
    /// Brightest pixel in electrons, where a camera is stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_e: Option<f64>,
    /// Flux over its standard error.
    pub snr: Option<f64>,
    /// The star's identifier, with its catalogue; `None` where it is not identified.
    pub id: Option<String>,
    /// Its name, if it has one; that of the Moon or a planet, without `id`.
    pub name: Option<String>,
    /// Its number in the Hipparcos Catalogue, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hip: Option<u32>,
    /// Its number in the Henry Draper Catalogue, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hd: Option<u32>,
    /// Its number in the Bright Star Catalogue, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hr: Option<u32>,
    /// Its number in the SAO catalogue, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sao: Option<u32>,
    /// Its Johnson V magnitude.
    pub vmag: Option<f64>,
    /// Right ascension (ICRS) of the star at the frame's date, or of the detection where no star is
    /// identified, in degrees; `None` in a frame that is not identified.
    pub ra_deg: Option<f64>,
    /// Declination of the same, in degrees.
    pub dec_deg: Option<f64>,
    /// Airmass of its light, where site and time of day are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub airmass: Option<f64>,
    /// Distance of the detection from the star's own predicted position, in pixels.
    pub residual_px: Option<f64>,
    /// Distance of the detection from the light of the star and all those blended with it, in
    /// pixels; `None` for a single star.
    pub residual_blend_px: Option<f64>,
    /// Probability that the name is chance.
    pub p_chance: Option<f64>,
    /// Flags of the detection: `saturated`, `hot_pixel`, `trail`, `extended`, `blended`, `border`.
    pub flags: Vec<&'static str>,
}

/// Run time of each stage, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct TimingReport {
    /// Reading and decoding the file.
    pub read: f64,
    /// Detecting and measuring the stars.
    pub detect: f64,
    /// Identifying them.
    pub identify: f64,
    /// Of this, finding out where the camera points.
    pub pointing: f64,
    /// Of this, naming the stars and fitting to all of them.
    pub naming: f64,
    /// Zero point and completeness.
    pub photometry: f64,
    /// All stages.
    pub total: f64,
}

impl FrameReport {
    /// Where a pixel is in the rows of the file, counted from 1 as in FITS.
    pub(crate) fn file_pixel(&self, pixel: &PixelPoint) -> [f64; 2] {
        let bottom_up = self.row_order == Some(RowOrder::BottomUp);
        let from_top = pixel.y + 1.0;
        let y = if bottom_up {
            self.height as f64 + 1.0 - from_top
        } else {
            from_top
        };
        [pixel.x + 1.0, y]
    }

    /// The report as one line of JSON, without the line's end.
    ///
    /// # Errors
    /// None for reports that [`new`](Self::new) made.
    pub fn to_json_line(&self) -> io::Result<String> {
        Ok(json_escaped(serde_json::to_string(self)?))
    }

    /// Whether the stars are identified.
    pub fn is_identified(&self) -> bool {
        self.status == Status::Identified
    }

    /// The order of the rows in the file; empty for a list of centroids.
    pub(crate) fn row_order_word(&self) -> &'static str {
        self.row_order.map_or("", RowOrder::word)
    }
}
