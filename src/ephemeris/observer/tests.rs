//! Compares the observer's sky with astropy.

use super::*;
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD};
use proptest::prelude::*;

/// Above the sum of what is neglected: nutation terms, polar motion, diurnal aberration, frame
/// bias.
const TOLERANCE_ARCSEC: f64 = 1.5;

/// Date, site (latitude and longitude in degrees, height in metres), direction (RA and Dec in
/// degrees), and true zenith distance and azimuth in degrees by astropy 8.0.2:
/// `SkyCoord(ra, dec).transform_to(AltAz(obstime, location, pressure=0))`, with
/// `obstime.delta_ut1_utc = 0` and the Earth orientation table that comes with it.
type Expected = (&'static str, [f64; 3], [f64; 2], [f64; 2]);
#[rustfmt::skip]
const ASTROPY: &[Expected] = &[
    ("1950-03-21T03:15:00Z", [52.2200, 4.4200, 0.0], [322.9970, 14.4888], [79.467435, 80.258988]),
    ("1950-03-21T03:15:00Z", [-30.2407, -70.7366, 2715.0], [81.0746, 33.4611], [95.791722, 305.567704]),
    ("1950-03-21T03:15:00Z", [19.8207, -155.4681, 4205.0], [168.4566, 36.4513], [83.204222, 53.335243]),
    ("1950-03-21T03:15:00Z", [-66.6600, 140.0000, 40.0], [100.2332, -23.1996], [69.960938, 102.186257]),
    ("1950-03-21T03:15:00Z", [0.0000, 0.0000, 0.0], [160.2275, -29.3577], [70.189342, 238.874533]),
    ("1950-03-21T03:15:00Z", [78.2000, 15.6000, 450.0], [199.2590, 0.5212], [80.739645, 224.522771]),
    ("1975-11-02T18:40:30Z", [52.2200, 4.4200, 0.0], [285.3583, 82.3074], [32.190325, 350.674478]),
    ("1975-11-02T18:40:30Z", [19.8207, -155.4681, 4205.0], [185.3600, -68.2237], [88.997897, 173.039869]),
    ("1975-11-02T18:40:30Z", [78.2000, 15.6000, 450.0], [72.2184, 22.5857], [68.916497, 80.569656]),
    ("1991-06-15T23:59:59Z", [19.8207, -155.4681, 4205.0], [194.8118, -54.7865], [104.050776, 143.571739]),
    ("1991-06-15T23:59:59Z", [0.0000, 0.0000, 0.0], [215.3463, -16.1094], [50.476317, 248.964457]),
    ("2000-01-01T12:00:00Z", [-30.2407, -70.7366, 2715.0], [229.6788, 12.1289], [46.519104, 27.371268]),
    ("2000-01-01T12:00:00Z", [0.0000, 0.0000, 0.0], [77.4015, 69.3344], [108.950117, 8.399700]),
    ("2019-07-29T20:47:26Z", [52.2200, 4.4200, 0.0], [238.3973, 48.4307], [16.301913, 266.322872]),
    ("2019-07-29T20:47:26Z", [-30.2407, -70.7366, 2715.0], [304.2268, -47.4569], [83.565065, 142.337589]),
    ("2019-07-29T20:47:26Z", [19.8207, -155.4681, 4205.0], [325.4100, 62.8602], [90.930064, 342.298369]),
    ("2019-07-29T20:47:26Z", [-66.6600, 140.0000, 40.0], [52.3656, 8.0153], [75.388467, 13.873967]),
    ("2019-07-29T20:47:26Z", [0.0000, 0.0000, 0.0], [334.0460, -37.9572], [78.415709, 128.789414]),
    ("2019-07-29T20:47:26Z", [78.2000, 15.6000, 450.0], [64.9989, 6.0072], [94.239595, 29.323906]),
    ("2033-09-09T09:09:09Z", [52.2200, 4.4200, 0.0], [230.9658, 50.1848], [57.818569, 48.153528]),
    ("2033-09-09T09:09:09Z", [19.8207, -155.4681, 4205.0], [315.4388, -67.5009], [87.835526, 185.481110]),
    ("2033-09-09T09:09:09Z", [78.2000, 15.6000, 450.0], [236.7939, 69.1148], [24.857878, 58.024987]),
    ("2050-12-31T06:30:00Z", [52.2200, 4.4200, 0.0], [188.5464, -8.2539], [61.708800, 194.183128]),
    ("2050-12-31T06:30:00Z", [-30.2407, -70.7366, 2715.0], [123.9158, 48.2122], [78.304838, 358.762164]),
    ("2050-12-31T06:30:00Z", [19.8207, -155.4681, 4205.0], [327.3046, 32.0389], [66.452768, 297.531021]),
    ("2050-12-31T06:30:00Z", [-66.6600, 140.0000, 40.0], [336.0310, -44.2568], [22.664093, 358.881017]),
];

fn direction([ra_deg, dec_deg]: [f64; 2]) -> UnitVector<Icrs> {
    UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG)
}

fn observation((date, [lat, lon, height], at, _): &Expected) -> Observation {
    let site = Site::new(*lat, *lon, *height).unwrap();
    Observation::new(site, &date.parse().unwrap(), &direction(*at)).unwrap()
}

#[test]
fn zenith_distance_and_azimuth_are_those_of_astropy() {
    let mut worst: f64 = 0.0;
    for row in ASTROPY {
        let found = observation(row);
        let on_sky = |zenith_distance_rad: f64, azimuth_rad: f64| {
            UnitVector::from_ra_dec(azimuth_rad, FRAC_PI_2 - zenith_distance_rad)
        };
        let expected = row.3.map(|deg| deg * RAD_PER_DEG);
        let apart = on_sky(found.zenith_distance_rad, found.azimuth_rad)
            .angle_to(&on_sky(expected[0], expected[1]));
        worst = worst.max(apart * ARCSEC_PER_RAD);
    }
    println!("largest difference: {worst:.2} arcsec");
    assert!(worst < TOLERANCE_ARCSEC, "{worst}");
}

#[test]
fn a_star_below_the_horizon_has_no_airmass() {
    let below = ASTROPY.iter().filter(|row| row.3[0] > 91.0);
    assert!(below.clone().count() > 0);
    for row in below {
        let found = observation(row);
        assert!(found.apparent.is_none() && found.zenith_distance_rad > FRAC_PI_2);
    }
}

#[test]
fn refraction_lifts_what_is_just_below_the_horizon() {
    let row = ASTROPY.iter().find(|row| (85.0..90.0).contains(&row.3[0]));
    let found = observation(row.unwrap());
    let apparent = found.apparent.unwrap();
    let lifted_deg = (found.zenith_distance_rad - apparent.zenith_distance_rad) * DEG_PER_RAD;
    assert!((0.03..0.6).contains(&lifted_deg), "{lifted_deg}");
    assert!(apparent.airmass > 10.0);
}

#[test]
fn without_a_time_there_is_no_observation() {
    let site = Site::new(0.0, 0.0, 0.0).unwrap();
    let day = "2019-07-29".parse().unwrap();
    assert_eq!(Observation::new(site, &day, &direction([0.0, 0.0])), None);
}

#[test]
fn a_site_is_two_or_three_numbers_in_range() {
    let site: Site = " 52.22, 355.5 ,-3".parse().unwrap();
    assert_eq!(
        (site.lat_deg(), site.lon_deg(), site.height_m()),
        (52.22, -4.5, -3.0)
    );
    assert_eq!("90,-180".parse::<Site>().unwrap().height_m(), 0.0);
    for text in ["", "1", "1,2,3,4", "a,b", "1;2", "1,,2"] {
        let error = text.parse::<Site>().unwrap_err();
        assert!(
            matches!(error, SiteError::Malformed { .. }),
            "{text}: {error}"
        );
    }
    for text in [
        "90.1,0",
        "0,-181",
        "0,361",
        "0,0,-501",
        "0,0,100001",
        "NaN,0",
        "0,inf",
    ] {
        let error = text.parse::<Site>().unwrap_err();
        assert!(
            matches!(error, SiteError::OutOfRange { .. }),
            "{text}: {error}"
        );
    }
}

proptest! {
    #[test]
    fn no_text_panics(text in "[-0-9., eNaif]{0,30}") {
        let _ = text.parse::<Site>();
    }

    #[test]
    fn all_results_are_in_range(
        site in (-90.0..=90.0, -180.0..=360.0, -500.0..=1e5),
        at in (0.0..360.0, -90.0..=90.0),
        day in 0..90_000,
    ) {
        let site = Site::new(site.0, site.1, site.2).unwrap();
        let date = ObservationDate::from_modified_julian_date(-2_000.0 + f64::from(day) + 0.37);
        let date = date.unwrap();
        let found = Observation::new(site, &date, &direction([at.0, at.1])).unwrap();
        prop_assert!((0.0..=std::f64::consts::PI).contains(&found.zenith_distance_rad));
        prop_assert!((0.0..TAU).contains(&found.azimuth_rad));
        if let Some(apparent) = found.apparent {
            prop_assert!((1.0 - 1e-3..38.0).contains(&apparent.airmass));
            prop_assert!((0.0..=FRAC_PI_2).contains(&apparent.zenith_distance_rad));
        }
        prop_assert!(found.apparent.is_some() || found.zenith_distance_rad >= FRAC_PI_2 - 1e-9);
    }
}
