//! Compares apparent places with astropy.

use super::*;
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD, RAD_PER_DEG};
use crate::ephemeris::observer::Observation;
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// The deflection of light by the Sun is neglected.
const TOLERANCE_ARCSEC: f64 = 0.03;

/// Date, site (latitude and longitude in degrees, height in metres), direction in ICRS and apparent
/// direction (RA and Dec in degrees) by astropy 8: `GCRS(obstime, obsgeoloc, obsgeovel)`.
type Seen = (&'static str, [f64; 3], [f64; 2], [f64; 2]);
#[rustfmt::skip]
const ASTROPY: &[Seen] = &[
    ("1990-02-11T05:00:00Z", [52.22, 4.42, 0.0], [184.255785, 64.280238], [184.2648167, 64.2760018]),
    ("1990-02-11T05:00:00Z", [-30.2407, -70.7366, 2715.0], [197.853728, -70.888248], [197.8625979, -70.8843667]),
    ("1990-02-11T05:00:00Z", [78.2, 15.6, 450.0], [48.255011, -11.173115], [48.2548888, -11.1759412]),
    ("2003-06-30T22:10:05Z", [52.22, 4.42, 0.0], [346.196590, 26.716733], [346.1989047, 26.7146699]),
    ("2003-06-30T22:10:05Z", [-30.2407, -70.7366, 2715.0], [224.456312, 33.598258], [224.4603772, 33.6009924]),
    ("2003-06-30T22:10:05Z", [78.2, 15.6, 450.0], [230.878141, 44.851012], [230.8835397, 44.8541414]),
    ("2019-07-29T20:47:26Z", [52.22, 4.42, 0.0], [53.251933, 39.736173], [53.2495627, 39.7338851]),
    ("2019-07-29T20:47:26Z", [-30.2407, -70.7366, 2715.0], [307.881711, 46.266825], [307.8895174, 46.2674440]),
    ("2019-07-29T20:47:26Z", [78.2, 15.6, 450.0], [300.804918, -25.864500], [300.8109775, -25.8634435]),
    ("2024-03-20T22:00:00Z", [52.22, 4.42, 0.0], [322.097710, -8.891637], [322.0934376, -8.8933894]),
    ("2024-03-20T22:00:00Z", [-30.2407, -70.7366, 2715.0], [237.727937, -30.590285], [237.7310611, -30.5899597]),
    ("2024-03-20T22:00:00Z", [78.2, 15.6, 450.0], [135.052919, -21.501382], [135.0569591, -21.5048460]),
    ("2040-11-09T13:30:00Z", [52.22, 4.42, 0.0], [38.131645, 15.445396], [38.1372194, 15.4471765]),
    ("2040-11-09T13:30:00Z", [-30.2407, -70.7366, 2715.0], [291.698767, -18.445989], [291.6959306, -18.4460514]),
    ("2040-11-09T13:30:00Z", [78.2, 15.6, 450.0], [92.809123, 31.752907], [92.8139160, 31.7522430]),
];

/// Date, site, two directions in ICRS, and the angle in degrees between them as they are seen through
/// the air, by astropy 8: `AltAz(obstime, location, pressure, temperature, obswl=0.574 um)`.
type Pair = (&'static str, [f64; 3], [f64; 2], [f64; 2], f64);
#[rustfmt::skip]
const PAIRS: &[Pair] = &[
    ("1990-02-11T05:00:00Z", [52.22, 4.42, 0.0], [332.9308702, 34.7326212], [308.1244819, 33.1696921], 20.5648891),
    ("1990-02-11T05:00:00Z", [-30.2407, -70.7366, 2715.0], [68.9838395, -6.3846769], [80.3066879, -10.9998450], 12.0837982),
    ("1990-02-11T05:00:00Z", [78.2, 15.6, 450.0], [335.0979437, 18.0730547], [341.8755298, 31.6927210], 14.9111916),
    ("2003-06-30T22:10:05Z", [52.22, 4.42, 0.0], [240.0106933, -21.6049589], [250.0876949, -10.6339387], 14.5955754),
    ("2003-06-30T22:10:05Z", [-30.2407, -70.7366, 2715.0], [77.2761797, -49.7299696], [101.6199974, -40.0562790], 19.6298418),
    ("2003-06-30T22:10:05Z", [78.2, 15.6, 450.0], [234.3108724, 5.0358634], [244.5995373, 16.1048981], 14.9603058),
    ("2019-07-29T20:47:26Z", [52.22, 4.42, 0.0], [201.2170642, -2.0290952], [199.5899442, 13.9821493], 16.0712635),
    ("2019-07-29T20:47:26Z", [-30.2407, -70.7366, 2715.0], [138.1852701, 27.8467216], [146.0427129, 18.1776530], 12.0455202),
    ("2019-07-29T20:47:26Z", [78.2, 15.6, 450.0], [13.5852654, 17.0694875], [5.2419513, 27.6686647], 13.0738811),
    ("2024-03-20T22:00:00Z", [52.22, 4.42, 0.0], [120.4161708, -17.2064878], [141.1169860, -9.8646445], 21.3838412),
    ("2024-03-20T22:00:00Z", [-30.2407, -70.7366, 2715.0], [4.1162580, -2.0275955], [9.6115911, -17.2146903], 16.1017103),
    ("2024-03-20T22:00:00Z", [78.2, 15.6, 450.0], [97.7722505, 10.4593470], [112.3010666, 20.0538936], 16.9480490),
    ("2040-11-09T13:30:00Z", [52.22, 4.42, 0.0], [298.3373957, -13.3326350], [285.7870050, -5.4579089], 14.6420374),
    ("2040-11-09T13:30:00Z", [-30.2407, -70.7366, 2715.0], [47.8439503, -69.1243805], [47.3285392, -85.6294858], 16.4888476),
    ("2040-11-09T13:30:00Z", [78.2, 15.6, 450.0], [198.2426868, 11.1017660], [214.7640444, 20.2480400], 18.3064222),
    ("1990-02-11T05:00:00Z", [52.22, 4.42, 0.0], [272.3471590, 15.2509117], [266.3855389, 26.1383376], 12.2185473),
    ("1990-02-11T05:00:00Z", [78.2, 15.6, 450.0], [149.7543007, 34.1169562], [162.0724290, 43.9582587], 13.6887435),
    ("2003-06-30T22:10:05Z", [-30.2407, -70.7366, 2715.0], [193.0028040, 23.4243306], [190.9557960, 11.5474827], 12.0306254),
    ("2019-07-29T20:47:26Z", [52.22, 4.42, 0.0], [344.4222184, 39.1783902], [324.8922774, 39.9074090], 15.0395191),
    ("2019-07-29T20:47:26Z", [78.2, 15.6, 450.0], [173.0681976, 38.2707524], [158.0251598, 53.4490604], 18.3532953),
    ("2024-03-20T22:00:00Z", [-30.2407, -70.7366, 2715.0], [32.1532410, 3.1668798], [34.3196740, -14.4730867], 17.7648696),
    ("2040-11-09T13:30:00Z", [52.22, 4.42, 0.0], [212.5946194, 9.8595466], [220.8162231, 19.0930751], 12.1761422),
    ("2040-11-09T13:30:00Z", [78.2, 15.6, 450.0], [306.8537060, 26.0770150], [307.1853200, 38.3128463], 12.2323390),
];

fn direction([ra_deg, dec_deg]: [f64; 2]) -> UnitVector<Icrs> {
    UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG)
}

fn places(date: &str, [lat_deg, lon_deg, height_m]: [f64; 3]) -> StarPlaces {
    let site = Site::new(lat_deg, lon_deg, height_m).unwrap();
    StarPlaces::at(&date.parse().unwrap(), Some(site), None)
}

#[test]
fn aberration_is_that_of_astropy() {
    for (date, site, icrs, expected) in ASTROPY {
        let places = places(date, *site).without_refraction();
        let found = places.apparent(&direction(*icrs));
        let off_arcsec = found.angle_to(&direction(*expected)) * ARCSEC_PER_RAD;
        assert!(off_arcsec < TOLERANCE_ARCSEC, "{date}: {off_arcsec}");
    }
}

#[test]
fn angles_through_the_air_are_those_of_astropy() {
    for (date, site, a, b, expected_deg) in PAIRS {
        let places = places(date, *site);
        let [a, b] = [a, b].map(|icrs| places.apparent(&direction(*icrs)));
        let off_arcsec = (a.angle_to(&b) * DEG_PER_RAD - expected_deg) * 3600.0;
        // SOFA's formula is itself 0.1″ off at 15° above the horizon.
        assert!(off_arcsec.abs() < 0.3, "{date}: {off_arcsec}");
    }
}

#[test]
fn a_place_in_the_horizon_is_where_an_observation_has_it() {
    let date = "2019-07-29T20:47:26Z";
    let site = Site::new(52.22, 4.42, 0.0).unwrap();
    let places = places(date, [52.22, 4.42, 0.0]);
    let vega = direction([279.2347, 38.7837]);
    let seen = Observation::new(site, &date.parse().unwrap(), &vega).unwrap();
    let zenith_distance_rad = seen.apparent.unwrap().zenith_distance_rad;
    let place = places.in_horizon(seen.azimuth_rad, FRAC_PI_2 - zenith_distance_rad);
    let off_arcsec = place.unwrap().angle_to(&places.apparent(&vega)) * ARCSEC_PER_RAD;
    // An observation neglects the Earth's rotation.
    assert!(off_arcsec < 0.4, "{off_arcsec}");
}

#[test]
fn a_spacecraft_adds_its_own_velocity() {
    let date = "2024-03-20T22:00:00Z".parse().unwrap();
    let star = UnitVector::from_ra_dec(1.0, 0.3);
    let (east, _) = star.east_north();
    let still = StarPlaces::at(&date, None, None).apparent(&star);
    let moved = StarPlaces::at(&date, None, Some(east * 7.5)).apparent(&star);
    let shift_arcsec = (moved.as_vector() - still.as_vector()) * ARCSEC_PER_RAD;
    let expected_arcsec = 7.5 / LIGHT_KM_S * ARCSEC_PER_RAD;
    assert!((shift_arcsec.dot(&east) - expected_arcsec).abs() < 1e-3);
}

#[test]
fn without_date_and_site_places_are_those_of_the_catalogue() {
    let star = UnitVector::from_ra_dec(1.0, 0.3);
    let places = StarPlaces::of_catalog(20.0);
    assert_eq!(places.apparent(&star), star);
    assert!(!places.has_aberration() && !places.has_refraction());
    let day = StarPlaces::at(
        &"2024-03-20".parse().unwrap(),
        Some(Site::new(50.0, 5.0, 0.0).unwrap()),
        None,
    );
    assert!(day.has_aberration() && !day.has_refraction());
}

proptest! {
    #[test]
    fn apparent_and_astrometric_places_are_inverse(
        azimuth in 0.0..std::f64::consts::TAU,
        zenith_deg in 0.0..89.5,
        roll in -3.0..3.0,
    ) {
        let places = places("2019-07-29T20:47:26Z", [52.22, 4.42, 0.0]);
        let zenith = places.refraction.unwrap().zenith;
        let (east, north) = zenith.east_north();
        let away = east * libm::sin(azimuth) + north * libm::cos(azimuth);
        let (sine, cosine) = libm::sincos(zenith_deg * RAD_PER_DEG);
        let star = UnitVector::from_vector(zenith.as_vector() * cosine + away * sine);
        let back = places.astrometric(&places.apparent(&star));
        prop_assert!(back.angle_to(&star) < 1e-12);

        let attitude = Rotation::looking_at(&star, roll);
        let apparent = places.apparent_attitude(&attitude);
        prop_assert!(places.astrometric_attitude(&apparent).angle_to(&attitude) < 1e-7);
        let centre = apparent.apply(&places.apparent(&star));
        prop_assert!(centre.angle_to(&UnitVector::BORESIGHT) < 1e-12);
    }
}
