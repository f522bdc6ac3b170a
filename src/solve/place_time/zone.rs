//! Which zone a local time is of, by the place and the stars.

use super::examination::Examination;
use crate::base::clock::of_hours;
use crate::base::epoch::ObservationDate;
use crate::ephemeris::observer::Site;
use jiff::SignedDuration;

/// Zones that are no whole hour from UTC, in hours, and the longitudes where they are in use, in degrees.
const BROKEN_ZONES: [(f64, [f64; 2]); 11] = [
    (-9.5, [-142.0, -137.0]),
    (-3.5, [-60.0, -52.0]),
    (-2.5, [-60.0, -52.0]),
    (3.5, [43.0, 64.0]),
    (4.5, [43.0, 76.0]),
    (5.5, [68.0, 98.0]),
    (5.75, [79.0, 89.0]),
    (6.5, [91.0, 102.0]),
    (9.5, [128.0, 142.0]),
    (10.5, [128.0, 160.0]),
    (12.75, [-178.0, -175.0]),
];

/// What a local time is ahead of UTC, and the time in UTC; `None` where the stars do not tell.
pub(super) fn by_stars(
    examination: &Examination,
    site: Site,
    local: ObservationDate,
) -> Option<(SignedDuration, ObservationDate)> {
    /// The second best has to be worse by so much: odds of 20 to 1.
    const CLEAR: f64 = 3.0;
    let zones = zones_at(site.lon_deg());
    let costs = zones.filter_map(|(ahead_h, rarity)| {
        let ahead = of_hours(ahead_h);
        let date = local.earlier_by(ahead)?;
        let assessed = examination.assess(site, date);
        let is_possible = assessed.contradictions().is_empty();
        is_possible.then(|| ((ahead, date), assessed.cost() + rarity))
    });
    let mut costs: Vec<_> = costs.collect();
    costs.sort_by(|a, b| a.1.total_cmp(&b.1));
    match costs[..] {
        [(best, _)] => Some(best),
        [(best, least), (_, second), ..] if second - least > CLEAR => Some(best),
        _ => None,
    }
}

/// Zones that may be in use at a longitude, in hours ahead of UTC, and how unusual they are there.
fn zones_at(lon_deg: f64) -> impl Iterator<Item = (f64, f64)> {
    let broken = BROKEN_ZONES.into_iter();
    let broken = broken.filter(move |(_, [west, east])| (*west..=*east).contains(&lon_deg));
    let broken = broken.map(|(ahead_h, _)| (ahead_h, 0.5));
    let whole = (-12..=14).map(f64::from).filter_map(move |ahead_h| {
        let early_h = (ahead_h - lon_deg / 15.0 + 12.0).rem_euclid(24.0) - 12.0;
        let of_observatories = (ahead_h == 0.0).then_some(2.0);
        Some((ahead_h, rarity(early_h).or(of_observatories)?))
    });
    whole.chain(broken)
}

/// How unusual a zone is that is so many hours ahead of local solar time. Summer time and large countries are
/// ahead; UTC itself is in use at observatories everywhere.
fn rarity(early_h: f64) -> Option<f64> {
    match early_h {
        -0.8..=1.6 => Some(0.0),
        -1.3..=2.6 => Some(1.0),
        -2.0..=3.6 => Some(3.0),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zones_of_known_places_are_among_the_usual_ones() {
        for (lon_deg, ahead_h) in [
            (8.5, 1.0),
            (8.5, 2.0),
            (-4.0, 2.0),
            (77.0, 5.5),
            (85.0, 5.75),
            (-71.0, -3.0),
            (-155.5, -10.0),
            (174.0, 13.0),
            (76.0, 8.0),
            (133.0, 9.5),
        ] {
            assert!(
                zones_at(lon_deg).any(|(zone, rarity)| zone == ahead_h && rarity <= 3.0),
                "{lon_deg} {ahead_h}"
            );
        }
        assert!(zones_at(8.5).count() < 9);
    }
}
