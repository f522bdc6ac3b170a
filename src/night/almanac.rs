//! The Moon and the Sun over a site.

use crate::base::coords::{Horizon, Icrs, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::base::units::DEG_PER_RAD;
use crate::ephemeris::observer::Site;
use crate::ephemeris::places::StarPlaces;
use crate::ephemeris::solar_system::moon_and_sun;
use std::f64::consts::TAU;

/// Altitudes of the Sun's center at which twilights end, in degrees, and what it is above them.
const TWILIGHTS: [(f64, &str); 4] = [
    (-0.833, "day"),
    (-6.0, "civil"),
    (-12.0, "nautical"),
    (-18.0, "astronomical"),
];

/// Whether the Sun is over `site` at `date`; not where either is not known.
pub fn is_by_day(date: Option<&ObservationDate>, site: Option<Site>) -> bool {
    let almanac = date
        .zip(site)
        .and_then(|(date, site)| Almanac::at(date, site));
    almanac.is_some_and(|almanac| almanac.twilight() == TWILIGHTS[0].1)
}

/// Where Moon and Sun are over a site. Angles are refracted.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Almanac {
    /// Altitude of the Moon's center, in degrees.
    pub moon_altitude_deg: f64,
    /// Its azimuth from north through east, in degrees.
    pub moon_azimuth_deg: f64,
    /// Illuminated share of its disk.
    pub moon_illuminated: f64,
    /// Altitude of the Sun's center, in degrees.
    pub sun_altitude_deg: f64,
}

impl Almanac {
    /// That of `site` at `date`; `None` where the time is not known.
    ///
    /// # Reference
    /// Meeus 1998, Astronomical Algorithms, eq. 48.1; the phase angle is taken as 180° less the elongation,
    /// which changes the illuminated share by less than 0.002.
    pub fn at(date: &ObservationDate, site: Site) -> Option<Self> {
        let places = StarPlaces::at(date, Some(site), None);
        let horizon = places.horizon()?;
        let (moon, sun) = moon_and_sun(date, Some(site));
        let seen = |direction: &UnitVector<Icrs>| {
            let direction: UnitVector<Horizon> = horizon.apply(&places.apparent(direction));
            let [east, north, up] = *direction.as_vector().as_ref();
            let altitude_deg = libm::asin(up.clamp(-1.0, 1.0)) * DEG_PER_RAD;
            (
                altitude_deg,
                libm::atan2(east, north).rem_euclid(TAU) * DEG_PER_RAD,
            )
        };
        let (moon_altitude_deg, moon_azimuth_deg) = seen(&moon.direction);
        Some(Self {
            moon_altitude_deg,
            moon_azimuth_deg,
            moon_illuminated: 0.5 * (1.0 - moon.direction.dot(&sun)),
            sun_altitude_deg: seen(&sun).0,
        })
    }

    /// `day`, `civil`, `nautical` or `astronomical` twilight, or `night`.
    pub fn twilight(&self) -> &'static str {
        let above = |(altitude_deg, _): &&(f64, &str)| self.sun_altitude_deg > *altitude_deg;
        TWILIGHTS
            .iter()
            .find(above)
            .map_or("night", |(_, name)| name)
    }

    /// Whether the Moon's upper limb is above the horizon. The altitude is refracted.
    pub fn is_moon_up(&self) -> bool {
        const RADIUS_DEG: f64 = 0.26;
        self.moon_altitude_deg > -RADIUS_DEG
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(date: &str) -> Almanac {
        let site = "50,10,300".parse().unwrap();
        Almanac::at(&date.parse().unwrap(), site).unwrap()
    }

    /// Expected values by astropy 6 (`get_body`, `AltAz` without air).
    #[test]
    fn the_moon_and_the_sun_are_where_astropy_has_them() {
        let night = at("2024-01-25T22:00:00Z");
        assert!(night.moon_illuminated > 0.995 && night.is_moon_up());
        assert_eq!(night.twilight(), "night");
        let noon = at("2024-06-21T11:20:00Z");
        assert!((noon.sun_altitude_deg - 63.4).abs() < 0.2, "{noon:?}");
        assert_eq!(noon.twilight(), "day");
    }
}
