//! Compares places with JPL's ephemerides, and with what JPL Horizons printed.

use super::*;
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD, RAD_PER_DEG};
use proptest::prelude::*;

/// What [`BodyKind::theory_error_rad`] states, with the rounding of the table's fourth decimal.
const PLANET_TOLERANCE_ARCSEC: f64 = 5.3;
const MOON_TOLERANCE_ARCSEC: f64 = 15.3;

/// Right ascension and declination in degrees.
type RaDec = [f64; 2];
/// Date, site (latitude and longitude in degrees, height in metres), the Moon from the site, and
/// all bodies from the Earth's centre, in the order of [`BodyKind::ALL`].
type Expected = (&'static str, [f64; 3], RaDec, [RaDec; 8]);

/// Astrometric places from JPL DE421 (to 2049) and DE405 (after), read with `jplephem` 2.24; the
/// site's from `EarthLocation.get_gcrs_posvel` of astropy 8.0.2; UT1 and terrestrial time by
/// skyfield 1.55.
#[rustfmt::skip]
const JPL: &[Expected] = &[
    ("1905-03-21T03:15:00Z", [52.22, 4.42, 0.0], [180.3663, 0.7557], [
        [180.8617, 1.5522], [10.9242, 4.6793], [37.2841, 20.4127], [233.5338, -17.6369],
        [32.2563, 11.9968], [331.5947, -12.9497], [275.9083, -23.5733], [97.2438, 22.2983],
    ]),
    ("1924-08-23T00:00:00Z", [-30.2407, -70.7366, 2715.0], [66.6712, 16.6966], [
        [66.4628, 16.4789], [175.3818, -1.4906], [107.0633, 18.3044], [336.0224, -17.2452],
        [250.0209, -21.7369], [207.8241, -8.9534], [352.4014, -4.1594], [144.0082, 14.5910],
    ]),
    ("1939-11-02T18:40:30Z", [19.8207, -155.4681, 4205.0], [107.2772, 17.0436], [
        [108.1032, 17.2131], [240.0559, -23.2665], [233.0475, -19.0965], [323.6395, -16.7678],
        [1.1139, -1.2161], [26.7367, 8.0820], [48.8790, 17.7521], [176.3461, 2.8536],
    ]),
    ("1957-10-04T19:28:34Z", [-66.66, 140.0, 40.0], [327.3697, -6.8867], [
        [327.6891, -7.7252], [178.7485, 2.6286], [231.7400, -20.6517], [187.1961, -2.2225],
        [191.9746, -3.9439], [249.1289, -20.5658], [134.0499, 17.9486], [210.5642, -10.6278],
    ]),
    ("1969-07-20T20:17:40Z", [0.0, 0.0, 0.0], [186.3007, -4.5881], [
        [187.0895, -4.5480], [118.5813, 22.3323], [74.5045, 20.2105], [240.4449, -24.1273],
        [181.5614, 0.6513], [36.9416, 12.0458], [181.3076, 0.2072], [234.5582, -17.6800],
    ]),
    ("1986-02-09T11:00:00Z", [78.2, 15.6, 450.0], [329.8575, -18.1789], [
        [329.8215, -17.2242], [329.8323, -14.1759], [328.3472, -14.3100], [242.5953, -20.3128],
        [329.9915, -13.1043], [247.2998, -19.9119], [260.9155, -23.2434], [275.5547, -22.2751],
    ]),
    ("2000-01-01T12:00:00Z", [52.22, 4.42, 0.0], [221.9533, -11.6548], [
        [222.4589, -10.9034], [272.0852, -24.4204], [239.9012, -18.4519], [330.5246, -13.1805],
        [23.8698, 8.5959], [38.7660, 12.6163], [317.4838, -17.0188], [305.4427, -19.2124],
    ]),
    ("2019-07-29T20:47:26Z", [-30.2407, -70.7366, 2715.0], [94.6943, 22.6660], [
        [95.6186, 22.2268], [115.0689, 17.1883], [124.4064, 20.5998], [140.2634, 16.7051],
        [253.2180, -22.0928], [286.7886, -22.2508], [34.1239, 13.1364], [349.4443, -5.6736],
    ]),
    ("2026-08-12T17:30:00Z", [19.8207, -155.4681, 4205.0], [143.2493, 15.5385], [
        [142.3056, 15.7959], [127.2292, 19.6650], [184.6142, -3.2333], [90.5888, 23.6891],
        [131.7525, 18.4340], [14.0065, 3.1942], [63.0564, 20.9706], [3.9523, 0.1843],
    ]),
    ("2049-12-31T06:30:00Z", [-66.66, 140.0, 40.0], [5.9807, 7.8058], [
        [5.7924, 6.8766], [270.1073, -20.3570], [280.5268, -23.6611], [224.3186, -16.0346],
        [123.3977, 20.3603], [298.8688, -20.9915], [171.1495, 4.6708], [50.9773, 16.7878],
    ]),
    ("2065-11-22T12:45:00Z", [0.0, 0.0, 0.0], [164.9631, 1.2677], [
        [165.9276, 1.2684], [220.2566, -13.1039], [229.8418, -17.4610], [331.5078, -13.2713],
        [229.8425, -17.4570], [148.9872, 13.7993], [238.4540, -20.1040], [90.5488, 22.2132],
    ]),
    ("2099-09-14T17:00:00Z", [78.2, 15.6, 450.0], [171.5995, 2.9683], [
        [171.8084, 3.9655], [191.1143, -5.6390], [185.5359, -1.1526], [30.3450, 8.1282],
        [180.2063, 1.0956], [192.6539, -2.9878], [18.1163, 6.9552], [165.3940, 7.2167],
    ]),
];

/// Date, and astrometric place (ICRF) from the Earth's centre in hours, minutes, seconds and
/// degrees, minutes, seconds, as JPL Horizons printed it (in the tests of PyEphem).
#[rustfmt::skip]
const HORIZONS: &[(BodyKind, &str, &str, &str)] = &[
    (BodyKind::Jupiter, "2008-05-14T00:00:00Z", "19:36:00.94", "-21:39:44.4"),
    (BodyKind::Mars, "2003-12-16T08:00:00Z", "23:59:53.95", "-00:24:00.1"),
    (BodyKind::Saturn, "2014-12-18T00:00:00Z", "15:49:35.27", "-18:06:01.5"),
    (BodyKind::Uranus, "2019-02-07T00:00:00Z", "01:47:38.40", "+10:33:06.2"),
    (BodyKind::Neptune, "2010-01-02T00:00:00Z", "21:47:39.19", "-13:45:31.0"),
];

fn direction([ra_deg, dec_deg]: RaDec) -> UnitVector<Icrs> {
    UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG)
}

fn at(date: &str, site: Option<Site>) -> [Body; 8] {
    bodies_at(&date.parse().unwrap(), TimeError::None, site)
}

fn apart_arcsec(body: &Body, place: RaDec) -> f64 {
    body.direction.angle_to(&direction(place)) * ARCSEC_PER_RAD
}

fn find(kind: BodyKind, bodies: &[Body; 8]) -> Body {
    *bodies.iter().find(|body| body.kind == kind).unwrap()
}

#[test]
fn places_are_those_of_jpl_from_1905_to_2099() {
    let (mut planets, mut moon): (f64, f64) = (0.0, 0.0);
    for (date, _, _, places) in JPL {
        for (body, place) in at(date, None).iter().zip(places) {
            let apart = apart_arcsec(body, *place);
            match body.kind {
                BodyKind::Moon => moon = moon.max(apart),
                _ => planets = planets.max(apart),
            }
        }
    }
    println!("planets {planets:.2} arcsec, Moon {moon:.2} arcsec");
    assert!(planets < PLANET_TOLERANCE_ARCSEC && moon < MOON_TOLERANCE_ARCSEC);
}

#[test]
fn the_moon_of_a_site_is_that_of_jpl_and_its_parallax_is_stated_without_one() {
    for (date, [lat, lon, height], place, _) in JPL {
        let site = Site::new(*lat, *lon, *height).unwrap();
        let [moon, ..] = at(date, Some(site));
        let apart = apart_arcsec(&moon, *place);
        assert!(apart < MOON_TOLERANCE_ARCSEC, "{date}: {apart}");
        let [without, ..] = at(date, None);
        let parallax_rad = without.direction.angle_to(&moon.direction);
        assert!(parallax_rad < without.uncertainty_rad, "{date}");
        // The horizontal parallax is 54 to 61 arcminutes.
        let stated_arcmin = without.uncertainty_rad * DEG_PER_RAD * 60.0;
        assert!((53.0..62.5).contains(&stated_arcmin), "{stated_arcmin}");
    }
}

#[test]
fn places_are_those_that_horizons_prints() {
    use crate::base::angle::Angle;
    let sexagesimal = |text: &str| Angle::parse(text).and_then(Angle::in_degrees).unwrap();
    for (kind, date, ra, dec) in HORIZONS {
        let place = [15.0 * sexagesimal(ra), sexagesimal(dec)];
        let apart = apart_arcsec(&find(*kind, &at(date, None)), place);
        assert!(apart < PLANET_TOLERANCE_ARCSEC, "{kind:?}: {apart}");
    }
}

#[test]
fn what_is_not_known_of_the_time_is_stated() {
    let noon: ObservationDate = "2019-07-29T12:00:00Z".parse().unwrap();
    let day: ObservationDate = "2019-07-29".parse().unwrap();
    for error in [TimeError::Zone, TimeError::Day] {
        for body in bodies_at(&noon, error, None) {
            for hours in [-error.days() * 24.0, 0.3, error.days() * 24.0] {
                let mjd = 58_693.5 + hours / 24.0;
                let then = ObservationDate::from_modified_julian_date(mjd).unwrap();
                let moved = find(body.kind, &bodies_at(&then, TimeError::None, None));
                let apart_rad = moved.direction.angle_to(&body.direction);
                assert!(apart_rad <= body.uncertainty_rad, "{:?}", body.kind);
            }
        }
    }
    assert_eq!(
        bodies_at(&day, TimeError::None, None),
        bodies_at(&noon, TimeError::Day, None)
    );
    let jupiter = find(BodyKind::Jupiter, &bodies_at(&day, TimeError::None, None));
    assert!(jupiter.uncertainty_rad * DEG_PER_RAD < 0.3);
}

#[test]
fn bodies_near_a_direction_are_those_of_all_that_are_near_it() {
    for (date, ..) in JPL {
        let date = date.parse().unwrap();
        let all = bodies_at(&date, TimeError::Zone, None);
        let centre = all[4].direction;
        for radius_rad in [0.001, 0.1, 0.5, 4.0] {
            let near = all.into_iter();
            let near = near.filter(|body| body.direction.angle_to(&centre) < radius_rad);
            let found = bodies_within(&date, TimeError::Zone, None, &centre, radius_rad);
            assert_eq!(found, near.collect::<Vec<_>>());
        }
    }
}

/// Magnitudes that the Astronomical Almanac and newspapers gave: at Mars's opposition of 2003, at
/// Venus's greatest brilliancy and Jupiter's opposition of 2020 and 2010, with Saturn's rings open
/// (2003) and closed (2009), at a full Moon.
#[test]
fn magnitudes_and_sizes_are_those_of_the_almanac() {
    for (kind, date, v_mag) in [
        (BodyKind::Mars, "2003-08-28T10:00:00Z", -2.9),
        (BodyKind::Venus, "2020-07-10T08:00:00Z", -4.7),
        (BodyKind::Jupiter, "2010-09-21T00:00:00Z", -2.9),
        (BodyKind::Saturn, "2003-12-31T21:00:00Z", -0.5),
        (BodyKind::Saturn, "2009-09-04T00:00:00Z", 1.1),
        (BodyKind::Uranus, "2019-10-28T00:00:00Z", 5.7),
        (BodyKind::Neptune, "2019-09-10T00:00:00Z", 7.8),
        (BodyKind::Moon, "2010-06-26T11:30:00Z", -12.6),
    ] {
        let found = find(kind, &at(date, None)).v_mag;
        assert!((found - v_mag).abs() < 0.25, "{kind:?} at {date}: {found}");
    }
    // Horizons gives a diameter of 42.839 arcsec.
    let jupiter = find(BodyKind::Jupiter, &at("2008-05-14T00:00:00Z", None));
    assert!((2.0 * jupiter.radius_rad * ARCSEC_PER_RAD - 42.84).abs() < 0.02);
}

proptest! {
    #[test]
    fn every_body_has_numbers_at_every_date(
        day in 0.0..91_000.0,
        (lat, lon) in (-90.0..=90.0, -180.0..=180.0),
    ) {
        let date = ObservationDate::from_modified_julian_date(-3_000.0 + day).unwrap();
        let site = Site::new(lat, lon, 0.0).unwrap();
        for body in bodies_at(&date, TimeError::None, Some(site)) {
            prop_assert!((-14.0..9.0).contains(&body.v_mag), "{body:?}");
            prop_assert!(body.uncertainty_rad * ARCSEC_PER_RAD < 16.0);
            prop_assert!((1e-6..5e-3).contains(&body.radius_rad));
            prop_assert!((body.direction.as_vector().norm() - 1.0).abs() < 1e-12);
        }
    }
}
