//! The direction to the Moon, by Meeus's extract of ELP-2000/82.

use super::body::{KM_PER_AU, LIGHT_DAYS_PER_AU};
use crate::ephemeris::observer::Site;
use nalgebra::Vector3;
use sofars::eph::moon98;

const J2000_JD: f64 = 2_451_545.0;
const EARTH_RADIUS_KM: f64 = 6_378.137;

/// The largest angle between the Moon seen from a site and from the Earth's centre.
pub(super) fn parallax_rad(distance_au: f64) -> f64 {
    libm::asin(EARTH_RADIUS_KM / KM_PER_AU / distance_au)
}

/// From the site, or the Earth's centre, to where the Moon is seen: `days_tt` days of terrestrial
/// time and `years` Julian years of universal time after J2000.0.
pub(super) fn apparent_au(days_tt: f64, years: f64, site: Option<Site>) -> Vector3<f64> {
    // Its elements include the light's travel.
    let [moon_au, _] = moon98(J2000_JD, days_tt);
    let observer_au = site.map_or(Vector3::zeros(), |site| {
        site.in_space(years).place_km / KM_PER_AU
    });
    Vector3::from(moon_au) - observer_au
}

/// The place among the stars: aberration moves the stars around the Moon, but not the Moon, which
/// goes with the Earth.
pub(super) fn without_aberration(
    apparent_au: &Vector3<f64>,
    earth_au_per_day: &Vector3<f64>,
) -> Vector3<f64> {
    apparent_au - earth_au_per_day * LIGHT_DAYS_PER_AU * apparent_au.norm()
}
