//! Where in an observer's sky is a direction? Its zenith distance, azimuth and airmass.
//!
//! ([`Site`], [`ObservationDate`] with its time, ICRS direction at the date) → [`Observation`]
//!
//! 1. Annual aberration, precession, nutation and sidereal time transform the direction to axes fixed
//!    to the Earth.
//! 2. The site's geodetic zenith gives the true (unrefracted) zenith distance and the azimuth.
//! 3. Refraction by the site's [`Air`] gives the apparent zenith distance, and that gives the airmass.
//!
//! Caveats: UT1 is assumed equal to UTC, which shifts the sky by up to 13″ east or west. All other
//! approximations are below 1″ (tested against astropy).

pub(crate) mod airmass;
mod earth;
mod refraction;

pub use refraction::Air;

use crate::base::coords::{Icrs, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::base::format::excerpt;
use crate::base::units::RAD_PER_DEG;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::str::FromStr;

/// An observing site on the Earth, and its air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    lat_deg: f64,
    lon_deg: f64,
    height_m: f64,
    air: Air,
}

/// Where a site is at a moment, and how it moves, in ICRS axes from the Earth's centre.
pub(crate) struct SiteInSpace {
    pub place_km: Vector3<f64>,
    /// By the Earth's rotation.
    pub velocity_km_s: Vector3<f64>,
    pub zenith: UnitVector<Icrs>,
    /// On the horizon.
    pub north: UnitVector<Icrs>,
}

/// The velocity of the Earth's centre relative to the solar system's barycentre, in ICRS axes, in units
/// of the speed of light, `years` Julian years after J2000.0.
pub(crate) fn earth_velocity_c(years: f64) -> Vector3<f64> {
    earth::velocity_c(years)
}

/// Why a text or numbers are not a site.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SiteError {
    /// The text is not two or three numbers.
    #[error(
        "'{}' is not a valid site; expected latitude and longitude in degrees and, where known, the \
         height in meters, with commas between them, like 52.22,4.42,3",
        excerpt(.text)
    )]
    Malformed {
        /// The text.
        text: String,
    },
    /// A number is out of range.
    #[error("the {quantity} {found} is not {expected}")]
    OutOfRange {
        /// The name of the quantity.
        quantity: &'static str,
        /// Its value.
        found: f64,
        /// Its range.
        expected: &'static str,
    },
}

impl Site {
    /// The site at a geodetic latitude (north positive) and longitude (east positive) in degrees,
    /// and a height above the ellipsoid in metres, with the air of the standard atmosphere.
    ///
    /// # Errors
    /// [`SiteError::OutOfRange`] if the latitude is not within ±90°, the longitude not from −180°
    /// to 360°, or the height not from −500 m to 100 000 m.
    pub fn new(lat_deg: f64, lon_deg: f64, height_m: f64) -> Result<Self, SiteError> {
        let ranges = [
            ("latitude", lat_deg, -90.0..=90.0, "from -90 to 90 degrees"),
            (
                "longitude",
                lon_deg,
                -180.0..=360.0,
                "from -180 to 360 degrees",
            ),
            (
                "height",
                height_m,
                -500.0..=1e5,
                "from -500 to 100000 meters",
            ),
        ];
        for (quantity, found, range, expected) in ranges {
            // No range contains NaN.
            if !range.contains(&found) {
                return Err(SiteError::OutOfRange {
                    quantity,
                    found,
                    expected,
                });
            }
        }
        let turn_deg = if lon_deg > 180.0 { 360.0 } else { 0.0 };
        Ok(Self {
            lat_deg,
            lon_deg: lon_deg - turn_deg,
            height_m,
            air: Air::at_height(height_m),
        })
    }

    /// The same site with this air.
    #[must_use]
    pub fn with_air(self, air: Air) -> Self {
        Self { air, ..self }
    }

    /// The same height and air at another latitude and longitude, where these are in range.
    pub(crate) fn moved_to(self, lat_deg: f64, lon_deg: f64) -> Option<Self> {
        let site = Self::new(lat_deg, lon_deg, self.height_m).ok()?;
        Some(site.with_air(self.air))
    }

    /// The air.
    pub fn air(&self) -> Air {
        self.air
    }

    /// Geodetic latitude in degrees, north positive.
    pub fn lat_deg(&self) -> f64 {
        self.lat_deg
    }

    /// Longitude in degrees, east positive, from −180 to 180.
    pub fn lon_deg(&self) -> f64 {
        self.lon_deg
    }

    /// Height above the ellipsoid in metres.
    pub fn height_m(&self) -> f64 {
        self.height_m
    }

    /// Where the site is `years` Julian years after J2000.0.
    pub(crate) fn in_space(&self, years: f64) -> SiteInSpace {
        // WGS 84.
        const EQUATORIAL_RADIUS_KM: f64 = 6_378.137;
        const FLATTENING: f64 = 1.0 / 298.257_223_563;
        const POLAR_FRACTION: f64 = (1.0 - FLATTENING) * (1.0 - FLATTENING);
        const ROTATION_RAD_S: f64 = 7.292_115e-5;
        let [north, _, up] = self.north_east_up();
        let sin_lat = up.z;
        let normal_km =
            EQUATORIAL_RADIUS_KM / (1.0 - (1.0 - POLAR_FRACTION) * sin_lat * sin_lat).sqrt();
        let height_km = self.height_m / 1000.0;
        let terrestrial_km = Vector3::new(
            (normal_km + height_km) * up.x,
            (normal_km + height_km) * up.y,
            (normal_km * POLAR_FRACTION + height_km) * up.z,
        );
        let to_terrestrial = earth::icrs_to_terrestrial(years);
        let velocity_km_s = (ROTATION_RAD_S * Vector3::z()).cross(&terrestrial_km);
        SiteInSpace {
            place_km: to_terrestrial.tr_mul(&terrestrial_km),
            velocity_km_s: to_terrestrial.tr_mul(&velocity_km_s),
            zenith: UnitVector::from_vector(to_terrestrial.tr_mul(&up)),
            north: UnitVector::from_vector(to_terrestrial.tr_mul(&north)),
        }
    }

    /// The unit vectors towards north, east and the zenith, in axes fixed to the Earth.
    fn north_east_up(&self) -> [Vector3<f64>; 3] {
        let (sin_lat, cos_lat) = libm::sincos(self.lat_deg * RAD_PER_DEG);
        let (sin_lon, cos_lon) = libm::sincos(self.lon_deg * RAD_PER_DEG);
        [
            Vector3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat),
            Vector3::new(-sin_lon, cos_lon, 0.0),
            Vector3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat),
        ]
    }
}

/// Parses `LAT,LON` or `LAT,LON,HEIGHT_M`.
impl FromStr for Site {
    type Err = SiteError;

    fn from_str(text: &str) -> Result<Self, SiteError> {
        let malformed = || SiteError::Malformed { text: text.into() };
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
        match numbers.map_err(|_| malformed())?[..] {
            [lat_deg, lon_deg] => Self::new(lat_deg, lon_deg, 0.0),
            [lat_deg, lon_deg, height_m] => Self::new(lat_deg, lon_deg, height_m),
            _ => Err(malformed()),
        }
    }
}

/// A direction in a site's sky.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Observation {
    /// The site.
    pub site: Site,
    /// True (unrefracted) zenith distance in radians, in [0, π].
    pub zenith_distance_rad: f64,
    /// Azimuth from north through east, in radians, in [0, 2π).
    pub azimuth_rad: f64,
    /// The refracted direction; `None` below the horizon.
    pub apparent: Option<Apparent>,
}

/// How a direction above the horizon appears through the atmosphere.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Apparent {
    /// Apparent (refracted) zenith distance in radians, in [0, π/2].
    pub zenith_distance_rad: f64,
    /// The airmass by the formula of Kasten & Young 1989.
    pub airmass: f64,
}

impl Observation {
    /// The place of `direction` (of the catalogue, with proper motion to the date) in the sky of `site`
    /// at `date`; `None` if only the day is known.
    ///
    /// ```
    /// use starpipe::base::coords::UnitVector;
    /// use starpipe::ephemeris::observer::{Observation, Site};
    ///
    /// let site: Site = "52.22,4.42".parse()?;
    /// let date = "2019-07-29T20:47:26Z".parse()?;
    /// let vega = UnitVector::from_ra_dec(279.2347_f64.to_radians(), 38.7837_f64.to_radians());
    /// let observed = Observation::new(site, &date, &vega).expect("the time is known");
    /// assert!((observed.zenith_distance_rad.to_degrees() - 17.37).abs() < 0.01);
    /// assert!(observed.apparent.is_some_and(|seen| (seen.airmass - 1.0475).abs() < 0.001));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(site: Site, date: &ObservationDate, direction: &UnitVector<Icrs>) -> Option<Self> {
        if !date.has_time() {
            return None;
        }
        let years = date.years_since_j2000();
        let seen = direction.as_vector() + earth::velocity_c(years);
        let terrestrial = earth::icrs_to_terrestrial(years) * seen.normalize();
        let [north, east, up] = site.north_east_up().map(|axis| axis.dot(&terrestrial));
        let altitude_rad = libm::atan2(up, libm::hypot(north, east));
        let (sine, cosine) = (libm::cos(altitude_rad), libm::sin(altitude_rad));
        let apparent_rad = altitude_rad + site.air.refraction_per_sine(cosine) * sine;
        let zenith_distance_rad = (FRAC_PI_2 - apparent_rad).max(0.0);
        let apparent = (apparent_rad >= 0.0).then(|| Apparent {
            zenith_distance_rad,
            airmass: airmass::airmass_kasten_young(zenith_distance_rad),
        });
        Some(Self {
            site,
            zenith_distance_rad: FRAC_PI_2 - altitude_rad,
            azimuth_rad: libm::atan2(east, north).rem_euclid(TAU),
            apparent,
        })
    }
}

#[cfg(test)]
mod tests;
