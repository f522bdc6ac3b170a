//! Priors: what is known of a frame before its stars are identified.

use crate::base::clock::ClockDate;
use crate::base::coords::{Icrs, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::base::units::RAD_PER_DEG;
use crate::camera::data_sheet::DataSheet;
use crate::camera::{self, Distortion, KnownLens, Projection};
use crate::ephemeris::observer::Site;
use crate::ephemeris::places::StarPlaces;
use crate::ephemeris::solar_system::TimeError;
use jiff::SignedDuration;
use nalgebra::Vector3;
use serde::Serialize;

/// What is known of a frame beforehand; by default nothing.
///
/// # Example
/// ```
/// use starpipe::identify::Scale;
/// use starpipe::{Priors, ScalePrior, SkyRegion, UnitVector};
///
/// // A field 20° wide, within 10 %, whose centre is less than 5° from Polaris.
/// let fov = Scale::FieldOfView(20_f64.to_radians());
/// let priors = Priors {
///     scale: Some(ScalePrior::by_user(fov, 0.1)),
///     near: Some(SkyRegion {
///         centre: UnitVector::from_ra_dec(37.95_f64.to_radians(), 89.26_f64.to_radians()),
///         radius_rad: 5_f64.to_radians(),
///     }),
///     ..Priors::default()
/// };
/// assert!(priors.restrict_search());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Priors {
    /// The camera's scale.
    pub scale: Option<ScalePrior>,
    /// The boresight lies in this region of the sky.
    pub near: Option<SkyRegion>,
    /// The mount says that it does: tried first in deep catalogues, and dropped where nothing matches.
    pub mount: Option<SkyRegion>,
    /// When the frame was taken.
    pub date: Option<FrameDate>,
    /// Where it was taken.
    pub site: Option<Site>,
    /// The observer's velocity relative to the Earth's centre, in ICRS axes, where it is not a site's.
    pub velocity_km_s: Option<Vector3<f64>>,
    /// Whether the lens is one that was measured.
    pub holds_lens: bool,
    /// Exposure time, in seconds.
    pub exposure_s: Option<f64>,
}

/// A circle on the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyRegion {
    /// Its centre.
    pub centre: UnitVector<Icrs>,
    /// Its radius, in radians.
    pub radius_rad: f64,
}

impl SkyRegion {
    /// The region around the right ascension and declination to which a mount says that it points: alignment and
    /// precession since J2000 count for less than a degree, the sides of a meridian flip for more.
    pub fn of_mount([ra_deg, dec_deg]: [f64; 2]) -> Self {
        const RADIUS_RAD: f64 = 2.5 * RAD_PER_DEG;
        Self {
            centre: UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG),
            radius_rad: RADIUS_RAD,
        }
    }
}

/// The camera's scale with a tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScalePrior {
    /// The scale.
    pub scale: Scale,
    /// Fraction by which the true scale may be larger or smaller, in (0, 1).
    pub tolerance: f64,
    /// Who states it.
    pub source: ScaleSource,
}

/// A camera's scale, in one of the two usual forms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Horizontal field of view, in radians.
    FieldOfView(f64),
    /// Pixel scale at the frame's centre, in radians.
    Pixel(f64),
}

/// Who states a scale, and so how far it can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ScaleSource {
    /// The user: a hard constraint.
    User,
    /// A camera's data sheet: tried first, and dropped where nothing matches with it.
    Camera,
    /// The frame's header: tried first, and dropped where nothing matches with it.
    Header,
    /// A program that calls this one, for its user: tried first, and dropped where nothing matches with it.
    Program,
}

/// When a frame was taken, and who states it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameDate {
    /// The date.
    pub date: ObservationDate,
    /// Its source.
    pub source: DateSource,
    /// How it is known to be UTC.
    pub zone: DateZone,
}

impl FrameDate {
    /// A date that its source states in UTC, or with what it is ahead of UTC.
    pub const fn stated(date: ObservationDate, source: DateSource) -> Self {
        Self {
            date,
            source,
            zone: DateZone::Stated,
        }
    }

    /// A clock's date; where nothing says what the clock is ahead of UTC, it is `local_ahead`, or else the date
    /// is taken for UTC. `None` outside the years that are accepted.
    pub fn of_clock(
        clock: ClockDate,
        source: DateSource,
        local_ahead: Option<SignedDuration>,
    ) -> Option<Self> {
        let (date, zone) = match (clock.ahead, local_ahead) {
            (Some(ahead), _) => (clock.minus(ahead)?, DateZone::Stated),
            (None, Some(ahead)) => (clock.minus(ahead)?, DateZone::Given(ahead)),
            (None, None) => (clock.shown, DateZone::Unknown),
        };
        Some(Self { date, source, zone })
    }

    /// How far the time may be from the true one.
    pub fn time_error(&self) -> TimeError {
        match (self.date.has_time(), self.is_utc()) {
            (false, _) => TimeError::Day,
            (true, false) => TimeError::Zone,
            (true, true) => TimeError::None,
        }
    }

    /// Whether the time may be used to tell which stars are above a site.
    pub fn is_utc(&self) -> bool {
        !matches!(self.zone, DateZone::Unknown | DateZone::Contradicted)
    }
}

/// How a frame's time is known to be UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DateZone {
    /// Its source states it in UTC, or with what it is ahead of UTC.
    Stated,
    /// It is that of a local clock, which the user says to be so much ahead of UTC.
    Given(SignedDuration),
    /// It is that of a local clock, which the stars over the site show to be so much ahead of UTC.
    ByStars(SignedDuration),
    /// It is that of a local clock, and was taken for UTC.
    Unknown,
    /// The stars contradict it, or the site.
    Contradicted,
}

/// Source of a frame's date.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub enum DateSource {
    /// The user.
    #[serde(rename = "option")]
    User,
    /// The header of the frame's file.
    #[serde(rename = "file header")]
    FileHeader,
    /// The name of the frame's file.
    #[serde(rename = "file name")]
    FileName,
}

/// Widest field of view that has a pinhole scale, in radians.
const MAX_FOV_RAD: f64 = 179.0 * RAD_PER_DEG;
/// Tolerance of the scale that a header or a data sheet gives: focal lengths are nominal. A focal
/// reducer or binning that it does not mention changes the scale by more.
const NOMINAL_TOLERANCE: f64 = 0.2;

impl ScalePrior {
    /// The user's `scale`, a hard constraint.
    pub const fn by_user(scale: Scale, tolerance: f64) -> Self {
        Self {
            scale,
            tolerance,
            source: ScaleSource::User,
        }
    }

    /// A hard constraint: a pixel scale from `low_rad` to `high_rad`.
    pub fn between(low_rad: f64, high_rad: f64) -> Self {
        let middle_rad = (low_rad + high_rad) / 2.0;
        let tolerance = (high_rad - low_rad) / (high_rad + low_rad);
        Self::by_user(Scale::Pixel(middle_rad), tolerance)
    }

    /// The scale of a lens that was measured.
    pub fn of_lens(lens: &KnownLens) -> Self {
        /// Temperature, focus and refraction change it by less.
        const TOLERANCE: f64 = 0.01;
        /// The scale in a corner differs by so many times the relative displacement there.
        const IN_CORNERS: f64 = 3.0;
        let camera = lens.camera();
        let displaced_px = camera.distortion().map_or(0.0, Distortion::largest_px);
        Self {
            scale: Scale::Pixel(1.0 / camera.central_focal_length_px()),
            tolerance: (TOLERANCE + IN_CORNERS * displaced_px / camera.radius_px()).min(0.5),
            source: ScaleSource::Camera,
        }
    }

    /// The scale of a camera by its data sheet.
    pub fn of_camera(sheet: &DataSheet) -> Self {
        Self {
            scale: Scale::Pixel(sheet.pixel_scale_rad()),
            tolerance: NOMINAL_TOLERANCE,
            source: ScaleSource::Camera,
        }
    }

    /// The pixel scale, in radians, that a frame's header gives.
    pub const fn of_header(pixel_scale_rad: f64) -> Self {
        Self {
            scale: Scale::Pixel(pixel_scale_rad),
            tolerance: NOMINAL_TOLERANCE,
            source: ScaleSource::Header,
        }
    }

    /// The same from a program that calls this one: tried first, and dropped where nothing matches with it.
    #[must_use]
    pub const fn tried_first(self) -> Self {
        Self {
            source: ScaleSource::Program,
            ..self
        }
    }

    /// Whether stars may be identified only with this scale.
    pub fn is_binding(&self) -> bool {
        self.source == ScaleSource::User
    }

    /// Smallest and largest pixel scale at the centre of a frame of this width, in radians.
    pub fn pixel_scale_range_rad(&self, width_px: f64) -> [f64; 2] {
        let factors = [1.0 - self.tolerance, 1.0 + self.tolerance];
        match self.scale {
            Scale::Pixel(pixel_rad) => factors.map(|factor| pixel_rad * factor),
            Scale::FieldOfView(fov_rad) => {
                let [low_rad, high_rad] = factors.map(|factor| fov_rad * factor);
                let [low, _] = scales_of_field(low_rad, width_px);
                let [_, high] = scales_of_field(high_rad, width_px);
                [low, high]
            }
        }
    }
}

/// Smallest and largest pixel scale at the centre, in radians, of lenses with this field across this width:
/// of a pinhole alone, unless it is wide.
fn scales_of_field(fov_rad: f64, width_px: f64) -> [f64; 2] {
    /// Wider fields may be those of any lens.
    const WIDE_RAD: f64 = 100.0 * RAD_PER_DEG;
    /// The field may be a circle that is smaller than the frame by this much.
    const CIRCLE: f64 = 2.0;
    let pinhole = 1.0 / camera::focal_length_px(width_px, fov_rad.min(MAX_FOV_RAD));
    if fov_rad < WIDE_RAD {
        return [pinhole; 2];
    }
    let half_rad = fov_rad / 2.0;
    let others = Projection::ALL.into_iter().skip(1);
    let others = others.filter(|lens| half_rad <= lens.max_angle_rad());
    let radii = others.map(|lens| lens.radius(half_rad));
    let (least, most) = radii.fold((f64::INFINITY, 0.0), |(least, most): (f64, f64), radius| {
        (least.min(radius), most.max(radius))
    });
    let [least, most] = [least, most].map(|radius| 2.0 * radius / width_px);
    [least.min(pinhole), CIRCLE * most.max(pinhole)]
}

impl Priors {
    /// Adds a date, unless one is known.
    pub fn or_date(self, date: Option<FrameDate>) -> Self {
        Self {
            date: self.date.or(date),
            ..self
        }
    }

    /// Where the catalogue's stars appear: at J2000.0, without aberration, where the date is not known.
    ///
    /// Refraction needs a time that can be trusted: not that of a local clock.
    pub fn places(&self) -> StarPlaces {
        let Some(known) = &self.date else {
            return StarPlaces::default();
        };
        let site = self.site.filter(|_| known.is_utc());
        StarPlaces::at(&known.date, site, self.velocity_km_s)
    }

    /// Smallest and largest pixel scale at the centre of a frame of this width, in radians, if
    /// known.
    pub fn pixel_scale_range_rad(&self, width_px: f64) -> Option<[f64; 2]> {
        Some(self.scale?.pixel_scale_range_rad(width_px))
    }

    /// Whether they restrict the search for the stars.
    pub fn restrict_search(&self) -> bool {
        self.scale.is_some() || self.near.is_some()
    }

    /// The same without a scale and a lens that are only tried first.
    pub fn binding(&self) -> Self {
        Self {
            scale: self.scale.filter(ScalePrior::is_binding),
            holds_lens: false,
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::RAD_PER_ARCSEC;

    #[test]
    fn a_field_of_view_and_its_pixel_scale_are_the_same_prior() {
        let width_px = 1000.0;
        let prior = ScalePrior::by_user(Scale::FieldOfView(10.0 * RAD_PER_DEG), 0.1);
        let [low, high] = prior.pixel_scale_range_rad(width_px);
        let expected = |fov_deg: f64| 2.0 * (fov_deg / 2.0 * RAD_PER_DEG).tan() / width_px;
        assert!((low - expected(9.0)).abs() < 1e-12);
        assert!((high - expected(11.0)).abs() < 1e-12);
    }

    #[test]
    fn a_pixel_scale_widens_by_its_tolerance() {
        let prior = ScalePrior::by_user(Scale::Pixel(10.0 * RAD_PER_ARCSEC), 0.2);
        let [low, high] = prior.pixel_scale_range_rad(123.0);
        assert!((low / RAD_PER_ARCSEC - 8.0).abs() < 1e-9);
        assert!((high / RAD_PER_ARCSEC - 12.0).abs() < 1e-9);
    }

    #[test]
    fn a_range_of_scales_is_kept() {
        let [low, high] = ScalePrior::between(1e-5, 4e-5).pixel_scale_range_rad(9.0);
        assert!((low - 1e-5).abs() < 1e-18 && (high - 4e-5).abs() < 1e-18);
    }

    #[test]
    fn a_field_of_the_whole_sky_may_be_that_of_any_lens_that_sees_it() {
        let prior = ScalePrior::by_user(Scale::FieldOfView(180.0 * RAD_PER_DEG), 0.05);
        let [low, high] = prior.pixel_scale_range_rad(1000.0);
        for lens in Projection::ALL.into_iter().skip(1) {
            let pixel_rad = 2.0 * lens.radius(std::f64::consts::FRAC_PI_2) / 1000.0;
            assert!((low..=high).contains(&pixel_rad), "{lens:?}");
        }
        // A circle across 700 of the pixels.
        assert!((low..=high).contains(&(std::f64::consts::PI / 700.0)));
        assert!(low > 0.5e-3 && high < 0.5);
    }

    #[test]
    fn the_widest_field_of_view_has_a_finite_scale() {
        let prior = ScalePrior::by_user(Scale::FieldOfView(170.0 * RAD_PER_DEG), 0.5);
        let [low, high] = prior.pixel_scale_range_rad(500.0);
        assert!(low > 0.0 && high > low && high.is_finite());
    }
}
