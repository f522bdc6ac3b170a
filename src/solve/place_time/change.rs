//! What may be wrong with a stated place and time, and what it would be then.

use super::sky::ObservedSky;
use crate::base::clock::of_hours;
use crate::base::coords::{Icrs, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::base::units::DEG_PER_RAD;
use crate::ephemeris::observer::Site;

/// One thing that may be wrong with a place and a time.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Change {
    /// The latitude has the other sign.
    LatitudeSign,
    /// The longitude has the other sign.
    LongitudeSign,
    /// Both have the other sign.
    BothSigns,
    /// Latitude and longitude are exchanged.
    Exchanged,
    /// It is another place.
    Place,
    /// The time is so many hours later.
    Hours(f64),
    /// The date's numbers are in another order.
    OrderOfDate,
    /// The date is so many days later.
    Days(i64),
    /// The date is so many years later.
    Years(i64),
}

/// A sign of a smaller latitude or longitude changes nothing, in degrees.
const MIN_DEG: f64 = 2.0;
/// A sidereal day is shorter than a day by this angle, in degrees.
const DEG_PER_DAY: f64 = 0.985_647;
const DEG_PER_HOUR: f64 = 15.041;

impl Change {
    /// Code for programs.
    pub const fn code(self) -> &'static str {
        match self {
            Self::LatitudeSign => "latitude_sign",
            Self::LongitudeSign => "longitude_sign",
            Self::BothSigns => "both_signs",
            Self::Exchanged => "exchanged",
            Self::Place => "place",
            Self::Hours(_) => "hours",
            Self::OrderOfDate => "order_of_date",
            Self::Days(_) => "days",
            Self::Years(_) => "years",
        }
    }

    /// By how much, where it is a shift of the time.
    pub const fn amount(self) -> Option<f64> {
        match self {
            Self::Hours(hours) => Some(hours),
            Self::Days(count) | Self::Years(count) => Some(count as f64),
            _ => None,
        }
    }

    /// How unlikely it is among mistakes, as the negative logarithm of its odds.
    pub(super) fn rarity(self) -> f64 {
        match self {
            Self::LatitudeSign | Self::LongitudeSign => 1.0,
            Self::Hours(hours) if hours.fract() == 0.0 => 1.5 + 0.05 * hours.abs(),
            Self::Exchanged | Self::OrderOfDate => 2.0,
            Self::Place | Self::BothSigns | Self::Days(_) => 3.0,
            Self::Hours(hours) => 3.0 + 0.05 * hours.abs(),
            Self::Years(_) => 4.0,
        }
    }

    /// The stated place and time with this change.
    fn apply(self, (site, date): (Site, ObservationDate)) -> Option<(Site, ObservationDate)> {
        let (lat, lon) = (site.lat_deg(), site.lon_deg());
        let at = |lat, lon| Some((site.moved_to(lat, lon)?, date));
        match self {
            Self::LatitudeSign => (lat.abs() >= MIN_DEG).then(|| at(-lat, lon))?,
            Self::LongitudeSign => (lon.abs() >= MIN_DEG).then(|| at(lat, -lon))?,
            Self::BothSigns => {
                let differ = lat.abs() >= MIN_DEG && lon.abs() >= MIN_DEG;
                differ.then(|| at(-lat, -lon))?
            }
            Self::Exchanged => at(lon, lat),
            Self::Hours(hours) => Some((site, date.earlier_by(of_hours(-hours))?)),
            Self::Days(days) => Some((site, date.earlier_by(of_hours(-24.0 * days as f64))?)),
            Self::Years(years) => Some((site, date.in_other_year(years as i16)?)),
            Self::Place | Self::OrderOfDate => None,
        }
    }
}

/// A changed place and time.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlaceTimeCandidate {
    pub change: Change,
    pub site: Site,
    pub date: ObservationDate,
}

/// Everything that a single mistake may have made of the true place and time.
pub(super) fn candidates(
    stated: (Site, ObservationDate),
    zenith: &UnitVector<Icrs>,
    sky: &ObservedSky,
) -> Vec<PlaceTimeCandidate> {
    let signs = [
        Change::LatitudeSign,
        Change::LongitudeSign,
        Change::BothSigns,
        Change::Exchanged,
    ];
    let hours = (-28..=28).filter(|half| *half != 0);
    let hours = hours.map(|half| Change::Hours(f64::from(half) / 2.0));
    let days = (-12..=12).filter(|step| *step != 0).map(|step| 15 * step);
    let level = sky.level_zenith();
    let turn_deg = level.map(|level| right_ascension_from(zenith, &level) * DEG_PER_RAD);
    let best_days = turn_deg.map(|deg| (deg / DEG_PER_DAY).round() as i64);
    let days = days.chain(best_days.filter(|days| *days != 0));
    let changes = signs.into_iter().chain(hours).chain(days.map(Change::Days));
    let changed = |change: Change| {
        let (site, date) = change.apply(stated)?;
        Some(PlaceTimeCandidate { change, site, date })
    };
    let place = level.and_then(|level| {
        let (_, lat_rad) = level.to_ra_dec();
        let lon_deg = stated.0.lon_deg() + turn_deg?;
        let lon_deg = (lon_deg + 180.0).rem_euclid(360.0) - 180.0;
        // A camera is not level to a tenth of a degree.
        let rough = |deg: f64| (10.0 * deg).round() / 10.0;
        let site = stated
            .0
            .moved_to(rough(lat_rad * DEG_PER_RAD), rough(lon_deg))?;
        Some(PlaceTimeCandidate {
            change: Change::Place,
            site,
            date: stated.1,
        })
    });
    let simple = changes.filter_map(changed);
    simple.chain(place).chain(other_dates(stated)).collect()
}

/// The dates whose numbers may have been misread, and those of a clock that is a year or two off. Few, so that
/// chance hardly brings a planet to where a source is.
pub(super) fn other_dates(
    stated: (Site, ObservationDate),
) -> impl Iterator<Item = PlaceTimeCandidate> {
    let (site, date) = stated;
    let orders = date
        .reordered()
        .into_iter()
        .map(move |date| PlaceTimeCandidate {
            change: Change::OrderOfDate,
            site,
            date,
        });
    let years = (-2..=2).filter(|years| *years != 0).map(Change::Years);
    let years = years.filter_map(move |change| {
        let (site, date) = change.apply(stated)?;
        Some(PlaceTimeCandidate { change, site, date })
    });
    orders.chain(years)
}

/// From one direction to the other in right ascension, in radians from -π to π.
fn right_ascension_from(from: &UnitVector<Icrs>, to: &UnitVector<Icrs>) -> f64 {
    use std::f64::consts::{PI, TAU};
    let turn = to.to_ra_dec().0 - from.to_ra_dec().0;
    (turn + PI).rem_euclid(TAU) - PI
}

/// The changes of the longitude, in degrees east, that do the same as so many hours.
pub(super) fn longitude_of_hours(hours: f64) -> f64 {
    DEG_PER_HOUR * hours
}
