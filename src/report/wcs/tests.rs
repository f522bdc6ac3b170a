//! Tests of the header against its camera, with an independent evaluator of cards, SIP polynomials
//! and the gnomonic projection (formulas of Calabretta & Greisen 2002).

use super::*;
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::base::units::RAD_PER_DEG;
use crate::camera::{Distortion, DistortionModel};
use crate::ephemeris::places::StarPlaces;
use crate::solve::sample;
use nalgebra::Matrix3;
use proptest::prelude::*;
use std::collections::HashMap;

/// Required agreement of the way from pixels to the sky, in pixels. Nine orders are too few for the
/// worst of these lenses: of 6000, none is farther off than 0.02.
const FORWARD_TOLERANCE_PX: f64 = 0.03;
/// The same for the way back, which is a polynomial in a lens as well: of 20,000, none is farther off than 0.0006.
const INVERSE_TOLERANCE_PX: f64 = 1e-3;

/// The header's cards by keyword, as text.
fn cards(header: &[u8]) -> HashMap<String, String> {
    assert_eq!(header.len() % 2880, 0);
    let cards = header
        .chunks(80)
        .map(|card| std::str::from_utf8(card).unwrap());
    cards
        .filter(|card| card[8..].starts_with("= "))
        .map(|card| {
            let value = card[10..].split(" /").next().unwrap().trim();
            (card[..8].trim().to_owned(), value.to_owned())
        })
        .collect()
}

/// The evaluator of a header.
struct Wcs(HashMap<String, String>);

impl Wcs {
    fn value(&self, keyword: &str) -> f64 {
        self.0.get(keyword).map_or(0.0, |v| v.parse().unwrap())
    }

    fn polynomial(&self, name: &str, u: f64, v: f64) -> f64 {
        let order = self.value(&format!("{name}_ORDER")) as i32;
        let mut sum = 0.0;
        for p in 0..=order {
            for q in 0..=order - p {
                sum += self.value(&format!("{name}_{p}_{q}")) * u.powi(p) * v.powi(q);
            }
        }
        sum
    }

    /// Right ascension and declination, in radians, of FITS pixel (x, y).
    fn sky(&self, x: f64, y: f64) -> (f64, f64) {
        let (u, v) = (x - self.value("CRPIX1"), y - self.value("CRPIX2"));
        let (u, v) = (
            u + self.polynomial("A", u, v),
            v + self.polynomial("B", u, v),
        );
        let xi = (self.value("CD1_1") * u + self.value("CD1_2") * v) * RAD_PER_DEG;
        let eta = (self.value("CD2_1") * u + self.value("CD2_2") * v) * RAD_PER_DEG;
        let (ra, dec) = (
            self.value("CRVAL1") * RAD_PER_DEG,
            self.value("CRVAL2") * RAD_PER_DEG,
        );
        let down = dec.cos() - eta * dec.sin();
        let sky_ra = ra + xi.atan2(down);
        let sky_dec = (dec.sin() + eta * dec.cos()).atan2(xi.hypot(down));
        (sky_ra, sky_dec)
    }

    /// FITS pixel of a direction, through `AP` and `BP`.
    fn pixel(&self, ra: f64, dec: f64) -> (f64, f64) {
        let (ra0, dec0) = (
            self.value("CRVAL1") * RAD_PER_DEG,
            self.value("CRVAL2") * RAD_PER_DEG,
        );
        let (sin_d, cos_d) = (ra - ra0).sin_cos();
        let depth = dec0.sin() * dec.sin() + dec0.cos() * dec.cos() * cos_d;
        let xi = dec.cos() * sin_d / depth / RAD_PER_DEG;
        let eta = (dec0.cos() * dec.sin() - dec0.sin() * dec.cos() * cos_d) / depth / RAD_PER_DEG;
        let cd = ["CD1_1", "CD1_2", "CD2_1", "CD2_2"].map(|k| self.value(k));
        let determinant = cd[0] * cd[3] - cd[1] * cd[2];
        let u = (cd[3] * xi - cd[1] * eta) / determinant;
        let v = (cd[0] * eta - cd[2] * xi) / determinant;
        (
            u + self.polynomial("AP", u, v) + self.value("CRPIX1"),
            v + self.polynomial("BP", u, v) + self.value("CRPIX2"),
        )
    }
}

fn solution(camera: CameraModel, attitude: Rotation<Icrs, Camera>) -> Solution {
    let identification = Identification {
        places: StarPlaces::default(),
        lens_is_known: false,
        camera,
        icrs_to_camera: attitude,
        attitude_covariance_rad2: Matrix3::from_diagonal(&[1e-10, 4e-10, 9e-10].into()),
        excess_sigma_px: 0.0,
        focal_length_sigma_px: 0.1,
        centre_sigma_px: [0.0; 2],
        matches: Vec::new(),
        rms_px: 0.1,
        log10_false_alarm: -50.0,
    };
    sample::solution(
        camera.width_px as usize,
        camera.height_px as usize,
        Outcome::Identified(Box::new(identification)),
    )
}

/// Pointings, with more than their share of poles and of right ascensions near 0° and 180°.
fn pointing() -> impl Strategy<Value = (f64, f64)> {
    prop_oneof![
        4 => (0.0..360.0_f64, -90.0..90.0_f64),
        1 => (0.0..360.0_f64, prop_oneof![Just(90.0), Just(-90.0), Just(89.99), Just(0.0)]),
        1 => (prop_oneof![Just(0.0), Just(359.9999), Just(180.0)], -90.0..90.0_f64),
    ]
}

fn camera() -> impl Strategy<Value = CameraModel> {
    let model = prop::option::weighted(0.8, prop::sample::select(DistortionModel::ALL.to_vec()));
    let size = (100.0..3000.0_f64, 100.0..3000.0_f64);
    let coefficients = prop::collection::vec(-1.0..1.0_f64, DistortionModel::Irregular5.terms());
    (size, 0.6..20.0_f64, any::<bool>(), model, coefficients).prop_map(
        |((width, height), focal, mirrored, model, coefficients)| {
            let (width, height) = (width.round(), height.round());
            let radius_px = width.hypot(height) / 2.0;
            let camera = CameraModel::pinhole(width, height, focal * 2.0 * radius_px, mirrored);
            camera.with_distortion(model.map(|model| {
                // Each coefficient is at most this large: a poor lens.
                let most_px = 0.015 * radius_px / (model.terms() as f64).sqrt();
                let c = coefficients[..model.terms()].iter().map(|c| c * most_px);
                Distortion::new(model, radius_px, &c.collect::<Vec<f64>>())
            }))
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn the_header_says_what_the_camera_says(
        camera in camera(),
        (ra_deg, dec_deg) in pointing(),
        up_deg in -180.0..180.0_f64,
        row_order in prop_oneof![Just(RowOrder::TopDown), Just(RowOrder::BottomUp)],
    ) {
        let boresight = UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG);
        let attitude = Rotation::looking_at(&boresight, up_deg * RAD_PER_DEG);
        let solution = Solution {
            row_order: Some(row_order),
            ..solution(camera, attitude)
        };
        let header = header("a.fits", &solution).unwrap();
        let wcs = Wcs(cards(&header));
        // FITS counts the rows of the file from 1.
        let row_of = |y: f64| match row_order {
            RowOrder::TopDown => y + 1.0,
            RowOrder::BottomUp => camera.height_px - y,
        };
        for i in 0..=8 {
            for j in 0..=8 {
                let x = -0.5 + camera.width_px * f64::from(i) / 8.0;
                let y = -0.5 + camera.height_px * f64::from(j) / 8.0;
                let ours = attitude.inverse().apply(&camera.direction_of(&PixelPoint::new(x, y)).unwrap());
                let (ra, dec) = wcs.sky(x + 1.0, row_of(y));
                let off_px = ours.angle_to(&UnitVector::from_ra_dec(ra, dec)) * camera.focal_length_px();
                prop_assert!(off_px < FORWARD_TOLERANCE_PX, "({x}, {y}) is off by {off_px} px");
                let (ra, dec) = ours.to_ra_dec();
                let (back_x, back_y) = wcs.pixel(ra, dec);
                let off_px = (back_x - 1.0 - x).hypot(back_y - row_of(y));
                prop_assert!(off_px < INVERSE_TOLERANCE_PX, "({x}, {y}) comes back {off_px} px off");
            }
        }
    }
}

#[test]
fn a_camera_upright_towards_the_equinox_has_east_on_the_left() {
    let boresight = UnitVector::from_ra_dec(0.0, 0.0);
    let attitude = Rotation::looking_at(&boresight, 0.0);
    for mirrored in [false, true] {
        // One degree a pixel at the centre.
        let camera = CameraModel::pinhole(3.0, 5.0, DEG_PER_RAD, mirrored);
        let found = cards(&header("a.tif", &solution(camera, attitude)).unwrap());
        let value = |keyword: &str| found[keyword].parse::<f64>().unwrap();
        assert_eq!((value("CRPIX1"), value("CRPIX2")), (2.0, 3.0));
        assert_eq!((value("IMAGEW"), value("IMAGEH")), (3.0, 5.0));
        let east = if mirrored { 1.0 } else { -1.0 };
        assert!((value("CD1_1") - east).abs() < 1e-12, "{}", value("CD1_1"));
        assert!((value("CD2_2") + 1.0).abs() < 1e-12, "y runs south");
        assert!(value("CD1_2").abs() < 1e-12 && value("CD2_1").abs() < 1e-12);
        assert_eq!(found["CTYPE1"], "'RA---TAN'");
        assert_eq!(found["RADESYS"], "'ICRS    '");
        // A turn about y, of 2e-5 rad, moves the centre along x, which is east or west.
        assert!((value("CRDER1") - 2e-5 * DEG_PER_RAD).abs() < 1e-12);
    }
}
