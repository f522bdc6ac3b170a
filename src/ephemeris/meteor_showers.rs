//! The radiants of the meteor showers that are active on a date.
//!
//! Caveats: a radiant is some degrees wide. It is taken to move a degree along the ecliptic each day, as the
//! Earth does; real ones differ from that by a few degrees at the ends of their showers.
//!
//! # Reference
//! International Meteor Organization, Meteor Shower Calendar 2024, table 5 (the showers of which people speak).

use super::OBLIQUITY_J2000_RAD;
use crate::base::coords::{Icrs, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::base::units::RAD_PER_DEG;
use jiff::civil::Date;
use nalgebra::{Rotation3, Vector3};

const TABLE: &str = include_str!("../../assets/meteor-showers.csv");
/// How far a radiant moves along the ecliptic in a day.
const DRIFT_RAD: f64 = RAD_PER_DEG;

/// Where the meteors of a shower come from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Radiant {
    /// The shower, as in `Geminids`.
    pub name: &'static str,
    pub direction: UnitVector<Icrs>,
}

/// The radiants of the showers that are active on this date.
pub(crate) fn active_radiants(date: &ObservationDate) -> Vec<Radiant> {
    let rows = TABLE.lines().skip(1);
    rows.filter_map(|row| radiant(row, date.day())).collect()
}

/// The radiant of a row of the table, if its shower is active on this day.
fn radiant(row: &'static str, day: Date) -> Option<Radiant> {
    let cells: Vec<&str> = row.split(',').collect();
    let [_, name, from, to, peak, ra_deg, dec_deg] = cells[..] else {
        return None;
    };
    let [from, to] = [days_from_peak(from, peak)?, days_from_peak(to, peak)?];
    let days = days_after(month_and_day(peak)?, day)?;
    if days < from || days > to {
        return None;
    }
    let at_peak = UnitVector::<Icrs>::from_ra_dec(
        ra_deg.parse::<f64>().ok()? * RAD_PER_DEG,
        dec_deg.parse::<f64>().ok()? * RAD_PER_DEG,
    );
    let pole =
        Rotation3::from_axis_angle(&Vector3::x_axis(), OBLIQUITY_J2000_RAD) * Vector3::z_axis();
    let drift = Rotation3::from_axis_angle(&pole, f64::from(days) * DRIFT_RAD);
    Some(Radiant {
        name,
        direction: UnitVector::from_vector(drift * at_peak.as_vector()),
    })
}

/// Month and day of `MM-DD`.
fn month_and_day(text: &str) -> Option<(i8, i8)> {
    let (month, day) = text.split_once('-')?;
    Some((month.parse().ok()?, day.parse().ok()?))
}

/// Days from the peak of a shower to another of its days, both as `MM-DD`.
fn days_from_peak(text: &str, peak: &str) -> Option<i32> {
    let (month, day) = month_and_day(text)?;
    days_after(month_and_day(peak)?, Date::new(2001, month, day).ok()?)
}

/// Days from the nearest day of this month and number to `day`.
fn days_after((month, number): (i8, i8), day: Date) -> Option<i32> {
    let years = [day.year() - 1, day.year(), day.year() + 1];
    let peaks = years
        .into_iter()
        .filter_map(|year| Date::new(year, month, number).ok());
    let days = peaks.map(|peak| (day - peak).get_days());
    days.min_by_key(|days| days.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::DEG_PER_RAD;

    fn on(year: i16, month: i8, day: i8) -> Vec<Radiant> {
        let day = Date::new(year, month, day).unwrap();
        active_radiants(&ObservationDate::of_day(day, None).unwrap())
    }

    fn names(radiants: &[Radiant]) -> Vec<&str> {
        radiants.iter().map(|radiant| radiant.name).collect()
    }

    #[test]
    fn showers_are_active_on_their_dates_across_the_turn_of_the_year() {
        assert_eq!(names(&on(2023, 12, 14)), ["Geminids"]);
        assert_eq!(names(&on(2023, 12, 30)), ["Quadrantids"]);
        assert_eq!(names(&on(2024, 1, 3)), ["Quadrantids"]);
        assert_eq!(names(&on(2024, 3, 10)), [""; 0]);
        assert_eq!(names(&on(2024, 8, 12)).len(), 3);
    }

    #[test]
    fn radiants_move_with_the_earth() {
        let perseids = |day| {
            let all = on(2024, 8, day);
            let (ra_rad, dec_rad) = all
                .iter()
                .find(|r| r.name == "Perseids")
                .unwrap()
                .direction
                .to_ra_dec();
            [ra_rad * DEG_PER_RAD, dec_rad * DEG_PER_RAD]
        };
        let [ra_deg, dec_deg] = perseids(12);
        assert!((ra_deg - 48.0).abs() < 0.01 && (dec_deg - 58.0).abs() < 0.01);
        // The same calendar, table 6: 37° and +57° on August 5.
        let [ra_deg, dec_deg] = perseids(5);
        assert!(
            (ra_deg - 37.0).abs() < 2.0 && (dec_deg - 57.0).abs() < 2.0,
            "{ra_deg} {dec_deg}"
        );
    }

    #[test]
    fn every_row_is_read() {
        for row in TABLE.lines().skip(1) {
            let peak = month_and_day(row.split(',').nth(4).unwrap()).unwrap();
            let day = Date::new(2025, peak.0, peak.1).unwrap();
            assert!(radiant(row, day).is_some(), "{row}");
        }
    }
}
