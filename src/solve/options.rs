//! What is stated for all frames, as people state it: hints, limits, and what to measure.

use super::context::{Context, DEFAULT_TIME_LIMIT_S};
use crate::base::clock::UtcOffset;
use crate::base::coords::UnitVector;
use crate::base::epoch::ObservationDate;
use crate::base::units::{RAD_PER_ARCSEC, RAD_PER_DEG};
use crate::camera::data_sheet::{CameraDescription, DataSheet};
use crate::detect::{CentroidMethod, DetectConfig};
use crate::ephemeris::observer::{Air, Site};
use crate::ephemeris::places::AttitudeFrame;
use crate::identify::{
    DateSource, Effort, FrameDate, NAME_ODDS, Priors, Scale, ScalePrior, SkyRegion,
};
use crate::photometry::comparison::ObservingSetup;
use crate::predict::Extinction;
use serde::{Serialize, Serializer};
use std::time::Duration;

/// What is stated for all frames; `None` stands for what the frame itself or the default says.
///
/// The command line, Python and the page set them by name, which is that of the field without its unit:
/// [`with`](Self::with).
///
/// # Example
/// ```
/// use starpipe::SolveOptions;
///
/// // The field is 20° wide, or up to 5 % more or less, and is somewhere near Orion's belt.
/// let mut options = SolveOptions::default();
/// options.fov_deg = Some(20.0);
/// options.scale_error_percent = 5.0;
/// options.near_deg = Some([84.0, -1.0]);
/// assert!(options.priors().restrict_search());
/// ```
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SolveOptions {
    /// Horizontal field of view.
    pub fov_deg: Option<f64>,
    /// Angle of a pixel, where no field of view is given.
    pub pixel_scale_arcsec: Option<f64>,
    /// How far either of them may be off.
    pub scale_error_percent: f64,
    /// Right ascension and declination near which the frame's centre lies.
    pub near_deg: Option<[f64; 2]>,
    /// How far from there it may lie.
    pub radius_deg: f64,
    /// When the frames were taken.
    #[serde(serialize_with = "iso")]
    pub date: Option<ObservationDate>,
    /// What local times in names of files and in Exif are ahead of UTC.
    pub utc_offset: Option<UtcOffset>,
    /// Where they were taken.
    #[serde(serialize_with = "geodetic")]
    pub site: Option<Site>,
    /// The air there, where it is not that of [`site`](Self::site).
    #[serde(skip)]
    pub air: Option<Air>,
    /// Velocity of a spacecraft relative to the Earth's centre, along the axes of ICRS.
    pub velocity_km_s: Option<[f64; 3]>,
    /// Which directions attitudes refer to.
    pub attitude_frame: AttitudeFrame,
    /// Exposure.
    pub exposure_s: Option<f64>,
    /// Zenith distance of the frames' centres, where a camera is stated.
    pub zenith_distance_deg: Option<f64>,
    /// Extinction, for the same.
    pub extinction_mag_per_airmass: Option<f64>,
    /// Detection threshold in standard deviations, in place of `false_alarms_per_mpx`.
    pub sigma: Option<f64>,
    /// Accepted false detections in a million pixels of noise.
    pub false_alarms_per_mpx: f64,
    /// Largest number of stars that are measured, the brightest.
    pub max_stars: usize,
    /// How centroids are measured.
    pub centroid: CentroidMethod,
    /// A star is named where the odds are at least this many to 1 that the name is right.
    pub name_odds: f64,
    /// How much is tried to identify a frame.
    pub effort: Effort,
    /// Whether a lens that was measured is only the start of a fit.
    pub refine_lens: bool,
    /// Whether to stop at attitude and optics, from the brightest stars.
    pub attitude_only: bool,
    /// Whether to measure the sky at each place: brightness, extinction, clouds and limits.
    pub sky: bool,
    /// Whether to search the trails of satellites, aeroplanes and meteors.
    pub trails: bool,
    /// How long a frame may take.
    pub time_limit_s: Option<f64>,
}

impl SolveOptions {
    /// What is known of every frame.
    pub fn priors(&self) -> Priors {
        let fov = self
            .fov_deg
            .map(|deg| Scale::FieldOfView(deg * RAD_PER_DEG));
        let pixel = self.pixel_scale_arcsec;
        let scale = fov.or(pixel.map(|arcsec| Scale::Pixel(arcsec * RAD_PER_ARCSEC)));
        let tolerance = self.scale_error_percent / 100.0;
        Priors {
            scale: scale.map(|scale| ScalePrior::by_user(scale, tolerance)),
            near: self.near_deg.map(|near_deg| {
                let [ra_rad, dec_rad] = near_deg.map(|deg| deg * RAD_PER_DEG);
                SkyRegion {
                    centre: UnitVector::from_ra_dec(ra_rad, dec_rad),
                    radius_rad: self.radius_deg * RAD_PER_DEG,
                }
            }),
            mount: None,
            date: self
                .date
                .map(|date| FrameDate::stated(date, DateSource::User)),
            site: self.site_with_air(),
            velocity_km_s: self.velocity_km_s.map(Into::into),
            holds_lens: false,
            exposure_s: self.exposure_s,
        }
    }

    /// The defaults; but a frame may take as long as it needs.
    pub fn unlimited() -> Self {
        Self {
            time_limit_s: None,
            ..Self::default()
        }
    }

    /// Where the frames were taken, with the air there.
    pub fn site_with_air(&self) -> Option<Site> {
        let with_air = |site: Site| self.air.map_or(site, |air| site.with_air(air));
        self.site.map(with_air)
    }

    /// How to detect stars.
    pub fn detect_config(&self) -> DetectConfig {
        DetectConfig {
            threshold_sigma: self.sigma,
            false_alarms_per_mpx: self.false_alarms_per_mpx,
            max_detections: self.max_stars,
            centroid: self.centroid,
            ..DetectConfig::default()
        }
    }

    fn observing_setup(&self, sheet: DataSheet) -> ObservingSetup {
        ObservingSetup {
            sheet,
            zenith_distance_deg: self.zenith_distance_deg,
            extinction: self
                .extinction_mag_per_airmass
                .map(Extinction::MagPerAirmass),
        }
    }
}

impl Default for SolveOptions {
    fn default() -> Self {
        let detect = DetectConfig::default();
        Self {
            fov_deg: None,
            pixel_scale_arcsec: None,
            scale_error_percent: 10.0,
            near_deg: None,
            radius_deg: 10.0,
            date: None,
            utc_offset: None,
            site: None,
            air: None,
            velocity_km_s: None,
            attitude_frame: AttitudeFrame::default(),
            exposure_s: None,
            zenith_distance_deg: None,
            extinction_mag_per_airmass: None,
            sigma: detect.threshold_sigma,
            false_alarms_per_mpx: detect.false_alarms_per_mpx,
            max_stars: detect.max_detections,
            centroid: detect.centroid,
            name_odds: NAME_ODDS,
            effort: Effort::Normal,
            refine_lens: false,
            attitude_only: false,
            sky: false,
            trails: false,
            time_limit_s: Some(DEFAULT_TIME_LIMIT_S),
        }
    }
}

impl<'a> Context<'a> {
    /// The same with what is stated for all frames, and the camera that took them.
    ///
    /// # Example
    /// ```
    /// use starpipe::camera::data_sheet::DataSheet;
    /// use starpipe::{Catalog, Context, IndexedCatalog, SolveOptions, Workspace, solve_file};
    ///
    /// // The stars to V 7 are enough for wide fields, and are indexed in a moment.
    /// let catalog = Catalog::built_in().limited_to(7.0);
    /// let indexed = IndexedCatalog::build(&catalog, &|_| ());
    /// let camera = DataSheet::read("fixtures/cygnus/camera.toml")?;
    /// let mut options = SolveOptions::default();
    /// options.exposure_s = Some(1.0);
    /// options.extinction_mag_per_airmass = Some(0.0);
    /// let context = Context::new(&indexed).with_options(&options, Some(camera.into()));
    /// let file = "fixtures/cygnus/cygnus.tif";
    /// let solution = solve_file(file, None, &context, &mut Workspace::new())?;
    /// // The exposure is known, so the frame is compared with what the camera should see.
    /// let comparison = solution.comparison.expect("the stars are identified");
    /// let difference = comparison.zero_point_difference_mag.expect("stars have fluxes");
    /// assert!(difference.value.abs() < 0.1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn with_options(self, options: &SolveOptions, camera: Option<CameraDescription>) -> Self {
        let limit_s = options.time_limit_s;
        let camera = camera.unwrap_or_default();
        let frame_sizes = camera.sizes();
        let CameraDescription { sheet, lens } = camera;
        Self {
            frame_sizes,
            detect: options.detect_config(),
            priors: options.priors(),
            utc_offset: options.utc_offset,
            camera: sheet.map(|sheet| options.observing_setup(sheet)),
            lens: lens.filter(|_| !options.refine_lens),
            name_odds: options.name_odds,
            effort: options.effort,
            attitude_only: options.attitude_only,
            measure_sky: options.sky,
            find_trails: options.trails,
            attitude_frame: options.attitude_frame,
            // A limit that is longer than any clock runs is none.
            time_limit: limit_s.and_then(|limit_s| Duration::try_from_secs_f64(limit_s).ok()),
            ..self
        }
    }
}

fn iso<S: Serializer>(date: &Option<ObservationDate>, serializer: S) -> Result<S::Ok, S::Error> {
    date.map(|date| date.to_iso()).serialize(serializer)
}

fn geodetic<S: Serializer>(site: &Option<Site>, serializer: S) -> Result<S::Ok, S::Error> {
    let geodetic = site.map(|site| [site.lat_deg(), site.lon_deg(), site.height_m()]);
    geodetic.serialize(serializer)
}
