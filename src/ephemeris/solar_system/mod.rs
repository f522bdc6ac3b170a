//! Where are the Moon and the planets at a date, and how bright are they?
//!
//! ([`ObservationDate`], its [`TimeError`], [`Site`]) → [`Body`] for each of them
//!
//! 1. UTC gives terrestrial time.
//! 2. VSOP87 gives the planets, and the Earth from which they are seen, after the light's travel.
//!    It takes a millisecond, so mean elements tell first which ones are in a frame.
//! 3. Meeus's extract of ELP-2000/82 gives the Moon, seen from the site where that is known.
//! 4. Distances and phase give magnitudes.
//!
//! Directions are astrometric: as the catalogue's stars, they are without annual aberration, and so
//! may be compared with the stars around them.
//!
//! Caveats: the years 1900 to 2100 are tested, to 5″ for the planets and 15″ for the Moon. Saturn's
//! magnitude includes its rings. Moons of planets and minor planets are not in here. A planet near
//! the Sun has a magnitude as if it were seen.
//!
//! # References
//! - Bretagnon & Francou 1988, A&A 202, 309 (VSOP87), by the crate `vsop87`
//! - Simon et al. 1994, A&A 282, 663 (mean elements), by the crate `sofars`
//! - Meeus 1998, Astronomical Algorithms, chapter 47 (the Moon), by the crate `sofars`
//! - Mallama & Hilton 2018, Astronomy and Computing 25, 10 (magnitudes of planets)

mod body;
mod brightness;
mod moon;
mod planets;
mod rough;
mod terrestrial_time;

pub use body::TimeError;
pub use body::{Body, BodyKind};

use crate::base::coords::{Icrs, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::ephemeris::observer::Site;
use body::{DAYS_PER_JULIAN_YEAR, KM_PER_AU};
use nalgebra::Vector3;

/// The Moon and the planets at `date`, whose time is known but for `error`: as seen from `site`,
/// else from the Earth's centre.
///
/// ```
/// use starpipe::ephemeris::solar_system::{BodyKind, TimeError, bodies_at};
///
/// let date = "2020-12-21T18:00:00Z".parse()?;
/// let bodies = bodies_at(&date, TimeError::None, None);
/// let of = |kind| bodies.iter().find(|body| body.kind == kind).expect("one of eight");
/// let apart_rad = of(BodyKind::Jupiter).direction.angle_to(&of(BodyKind::Saturn).direction);
/// assert!(apart_rad.to_degrees() < 0.12); // The great conjunction.
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn bodies_at(date: &ObservationDate, error: TimeError, site: Option<Site>) -> [Body; 8] {
    let time = Time::new(date, error, site);
    BodyKind::ALL.map(|kind| time.body(kind))
}

/// Those of [`bodies_at`] that are within `radius_rad` of a direction. Faster where few are.
pub(crate) fn bodies_within(
    date: &ObservationDate,
    error: TimeError,
    site: Option<Site>,
    centre: &UnitVector<Icrs>,
    radius_rad: f64,
) -> Vec<Body> {
    let time = Time::new(date, error, site);
    let is_near = |kind: &BodyKind| {
        let roughly = time.moment.rough_direction(*kind);
        roughly.angle_to(centre) < radius_rad + rough::ERROR_RAD
    };
    let near = BodyKind::ALL.into_iter().filter(is_near);
    near.map(|kind| time.body(kind))
        .filter(|body| body.direction.angle_to(centre) < radius_rad)
        .collect()
}

/// The Moon as seen from `site` at `date`, and the Sun's astrometric direction from the Earth's centre, to
/// some 2′. In microseconds.
pub(crate) fn moon_and_sun(date: &ObservationDate, site: Option<Site>) -> (Body, UnitVector<Icrs>) {
    let time = Time::new(date, TimeError::None, site);
    let sun = UnitVector::from_vector(-time.moment.earth_au);
    (time.body(BodyKind::Moon), sun)
}

/// A time, and those as far from it as the true one may be.
struct Time {
    moment: ObserverMoment,
    limits: Vec<ObserverMoment>,
}

impl Time {
    fn new(date: &ObservationDate, error: TimeError, site: Option<Site>) -> Self {
        let error = if date.has_time() {
            error
        } else {
            TimeError::Day
        };
        // The Earth's rotation is unknown to hours where the time is.
        let site = site.filter(|_| error == TimeError::None);
        let years = date.years_since_j2000();
        let at = |days: f64| ObserverMoment::new(years + days / DAYS_PER_JULIAN_YEAR, site);
        let limits = match error.days() {
            0.0 => Vec::new(),
            days => vec![at(-days), at(days)],
        };
        Self {
            moment: at(0.0),
            limits,
        }
    }

    fn body(&self, kind: BodyKind) -> Body {
        let moment = &self.moment;
        let from_earth_au = moment.place_au(kind);
        let from_sun_au = moment.earth_au + from_earth_au;
        let roughly = moment.rough_direction(kind);
        let motions = self
            .limits
            .iter()
            .map(|limit| roughly.angle_to(&limit.rough_direction(kind)));
        let motion_rad = motions.fold(0.0, f64::max) * (1.0 + MOTION_ERROR);
        let distance_au = from_earth_au.norm();
        let parallax_rad = match (kind, moment.site) {
            (BodyKind::Moon, None) => moon::parallax_rad(distance_au),
            _ => 0.0,
        };
        let year = 2000.0 + moment.years;
        Body {
            kind,
            direction: UnitVector::from_vector(from_earth_au),
            uncertainty_rad: kind.theory_error_rad() + motion_rad + parallax_rad,
            v_mag: brightness::v_mag(kind, &from_sun_au, &from_earth_au, year),
            radius_rad: libm::asin(kind.radius_km() / KM_PER_AU / distance_au),
        }
    }
}

/// Relative error of a motion that is the difference of two rough directions.
const MOTION_ERROR: f64 = 0.01;

/// A moment, and where the observer is then.
struct ObserverMoment {
    /// Julian years of universal time since J2000.0.
    years: f64,
    /// Days of terrestrial time since J2000.0.
    days_tt: f64,
    /// From the Sun to the Earth, roughly.
    earth_au: Vector3<f64>,
    /// The Earth's velocity about the Sun, in au a day.
    earth_au_per_day: Vector3<f64>,
    site: Option<Site>,
}

impl ObserverMoment {
    fn new(years: f64, site: Option<Site>) -> Self {
        let days_tt = terrestrial_time::days_since_j2000(years);
        let [earth_au, earth_au_per_day] = rough::about_sun(BodyKind::Moon, days_tt);
        Self {
            years,
            days_tt,
            earth_au,
            earth_au_per_day,
            site,
        }
    }

    fn moon_au(&self) -> Vector3<f64> {
        let apparent = moon::apparent_au(self.days_tt, self.years, self.site);
        moon::without_aberration(&apparent, &self.earth_au_per_day)
    }

    fn place_au(&self, kind: BodyKind) -> Vector3<f64> {
        match kind {
            BodyKind::Moon => self.moon_au(),
            planet => planets::astrometric_au(planet, self.days_tt),
        }
    }

    fn rough_direction(&self, kind: BodyKind) -> UnitVector<Icrs> {
        UnitVector::from_vector(match kind {
            BodyKind::Moon => self.moon_au(),
            planet => rough::astrometric_au(planet, self.days_tt, &self.earth_au),
        })
    }
}

#[cfg(test)]
mod tests;
