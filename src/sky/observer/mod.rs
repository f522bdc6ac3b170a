//! Where in the observer's sky a direction stands: zenith distance, azimuth and airmass.
//!
//! ([`Site`], [`ObservationDate`] with its time, ICRS direction) → [`Observation`]
//!
//! 1. Proper motion is the caller's: the direction is that at the date.
//! 2. Precession, nutation and annual aberration lead to the true equator of the date, sidereal time to the Earth.
//! 3. The geodetic latitude gives the zenith: the true, unrefracted zenith distance.
//! 4. Mean refraction gives the apparent one, and that the airmass.
//!
//! Caveats: UT1 is taken for UTC, which puts the sky up to 13″ to the east or west; all else left out is below 1″ (compared with
//! astropy, and so tested). Refraction is that of a mean atmosphere at the site's height.

pub mod airmass;
mod earth;

use crate::base::coords::{Icrs, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::base::units::RAD_PER_DEG;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::str::FromStr;

/// A place on the Earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    lat_deg: f64,
    lon_deg: f64,
    height_m: f64,
}

/// Why something is no place on the Earth.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SiteError {
    /// It is not two or three numbers.
    #[error(
        "'{text}' is no site; expected latitude and longitude in degrees and, where known, the height in metres, \
         with commas between them, like 52.22,4.42,3"
    )]
    Malformed {
        /// What was found.
        text: String,
    },
    /// A number is not one that a site has.
    #[error("the {quantity} {found} is not {expected}")]
    OutOfRange {
        /// Which of the numbers.
        quantity: &'static str,
        /// What was found.
        found: f64,
        /// What it may be.
        expected: &'static str,
    },
}

impl Site {
    /// The site at a geodetic latitude (north positive) and a longitude (east positive) in degrees, and a height above the
    /// ellipsoid in metres.
    ///
    /// # Errors
    /// [`SiteError::OutOfRange`] if the latitude is not within ±90, the longitude not from −180 to 360, or the height not from −500
    /// to 100 000.
    pub fn new(lat_deg: f64, lon_deg: f64, height_m: f64) -> Result<Self, SiteError> {
        // Written so that NaN is out of range.
        let check = |quantity, found: f64, low: f64, high: f64, expected| {
            if (low..=high).contains(&found) {
                return Ok(());
            }
            Err(SiteError::OutOfRange {
                quantity,
                found,
                expected,
            })
        };
        check("latitude", lat_deg, -90.0, 90.0, "from -90 to 90 degrees")?;
        check(
            "longitude",
            lon_deg,
            -180.0,
            360.0,
            "from -180 to 360 degrees",
        )?;
        check(
            "height",
            height_m,
            -500.0,
            1e5,
            "from -500 to 100000 metres",
        )?;
        let lon_deg = if lon_deg > 180.0 {
            lon_deg - 360.0
        } else {
            lon_deg
        };
        Ok(Self {
            lat_deg,
            lon_deg,
            height_m,
        })
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

    /// The unit vectors towards north, east and the zenith, along the Earth's axes.
    fn north_east_up(&self) -> [Vector3<f64>; 3] {
        let (sin_lat, cos_lat) = (self.lat_deg * RAD_PER_DEG).sin_cos();
        let (sin_lon, cos_lon) = (self.lon_deg * RAD_PER_DEG).sin_cos();
        [
            Vector3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat),
            Vector3::new(-sin_lon, cos_lon, 0.0),
            Vector3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat),
        ]
    }
}

/// `LAT,LON` or `LAT,LON,HEIGHT_M`.
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

/// Where a direction stands in a site's sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// The site.
    pub site: Site,
    /// True zenith distance, without refraction, in radians, in [0, π].
    pub zenith_distance_rad: f64,
    /// Azimuth from north through east, in radians, in [0, 2π).
    pub azimuth_rad: f64,
    /// What is seen of it; `None` below the horizon.
    pub apparent: Option<Apparent>,
}

/// How a direction above the horizon is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Apparent {
    /// Zenith distance with refraction, in radians, in [0, π/2].
    pub zenith_distance_rad: f64,
    /// See [`airmass::airmass_kasten_young`].
    pub airmass: f64,
}

impl Observation {
    /// Where `direction`, at the date's epoch, stood at `site` at `date`; `None` where only the day is known.
    ///
    /// ```
    /// use starpipe::base::coords::UnitVector;
    /// use starpipe::sky::observer::{Observation, Site};
    ///
    /// let site: Site = "52.22,4.42".parse()?;
    /// let date = "2019-07-29T20:47:26Z".parse()?;
    /// let vega = UnitVector::from_ra_dec(279.2347_f64.to_radians(), 38.7837_f64.to_radians());
    /// let seen = Observation::new(site, &date, &vega).expect("the time is known");
    /// assert!((seen.zenith_distance_rad.to_degrees() - 17.37).abs() < 0.01);
    /// assert!(seen.apparent.is_some_and(|apparent| (apparent.airmass - 1.0475).abs() < 0.001));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(site: Site, date: &ObservationDate, direction: &UnitVector<Icrs>) -> Option<Self> {
        if !date.has_time() {
            return None;
        }
        let seen = earth::terrestrial(direction, date.years_since_j2000());
        let [north, east, up] = site.north_east_up().map(|axis| axis.dot(&seen));
        let altitude_rad = up.atan2(north.hypot(east));
        let apparent_rad = altitude_rad + airmass::refraction_rad(altitude_rad, site.height_m);
        let zenith_distance_rad = (FRAC_PI_2 - apparent_rad).max(0.0);
        let apparent = (apparent_rad >= 0.0).then(|| Apparent {
            zenith_distance_rad,
            airmass: airmass::airmass_kasten_young(zenith_distance_rad),
        });
        Some(Self {
            site,
            zenith_distance_rad: FRAC_PI_2 - altitude_rad,
            azimuth_rad: east.atan2(north).rem_euclid(TAU),
            apparent,
        })
    }
}

#[cfg(test)]
mod tests;
