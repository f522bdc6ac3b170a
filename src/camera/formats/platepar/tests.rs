use super::super::fit::samples;
use super::super::sky::RmsSky;
use super::super::{FormatError, Pointing, TOLERANCE_PX};
use super::*;
use crate::CameraModel;
use crate::base::coords::{Icrs, Rotation};
use crate::base::coords::{PixelPoint, UnitVector};
use crate::base::units::RAD_PER_DEG;
use crate::camera::{Distortion, DistortionModel, Projection};
use crate::ephemeris::observer::Site;

/// Right ascension and declination in degrees.
const STARS_DEG: [[f64; 2]; 5] = [
    [83.0, 22.0],
    [60.0, 40.0],
    [100.0, 45.0],
    [70.0, -5.0],
    [105.0, 5.0],
];

fn file(kind: &str, others: &str, x: &[f64], y: &[f64]) -> String {
    format!(
        r#"{{"version": 2, "X_res": 1280, "Y_res": 720, "F_scale": 14.25, "lat": 45.1, "lon": 15.2,
        "elev": 120.0, "JD": 2460310.4375, "Ho": 77.59102696599439, "RA_d": 83.5, "dec_d": 22.25,
        "pos_angle_ref": 47.5, "force_distortion_centre": false, "distortion_type": "{kind}", {others},
        "x_poly_rev": {x:?}, "y_poly_rev": {y:?}}}"#
    )
}

fn assert_images(text: &str, tolerance_px: f64, pixels: [[f64; 2]; 5]) {
    let (camera, pointing) = from_platepar_within(text, tolerance_px).unwrap();
    for ([ra_deg, dec_deg], [x, y]) in STARS_DEG.into_iter().zip(pixels) {
        let star = UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG);
        let pixel = pixel_of(&camera, &pointing, text, &star);
        let off_px = pixel.distance_to(&PixelPoint::new(x, y));
        assert!(off_px < tolerance_px, "{pixel:?} {x} {y}");
    }
}

/// The pixel of a star with RMS's refraction in all of the field.
fn pixel_of(
    camera: &CameraModel,
    pointing: &Pointing,
    text: &str,
    star: &UnitVector<Icrs>,
) -> PixelPoint {
    let json: serde_json::Value = serde_json::from_str(text).unwrap();
    let sky = RmsSky::new(
        json["JD"].as_f64().unwrap(),
        pointing.site.lat_deg(),
        pointing.site.lon_deg(),
        json["refraction"].as_bool().unwrap(),
    );
    let attitude = pointing.icrs_to_camera;
    let attitude = attitude.turned_to(&sky.apparent(&attitude.boresight()));
    camera
        .pixel_of(&attitude.apply(&sky.apparent(star)))
        .unwrap()
}

// The expected pixels are those of RMS's formulas in scripts/check-platepar.py.

#[test]
fn a_radial_plate_is_that_of_rms() {
    let x = [0.004, -0.003, 0.002, 0.02, -0.01, 0.003];
    let others = r#""refraction": true, "equal_aspect": false, "asymmetry_corr": false"#;
    let text = file("radial7-odd", others, &x, &[0.0; 6]);
    let pixels = [
        [641.33995, 362.51663],
        [1017.24003, 358.0039],
        [772.25342, 5.58556],
        [493.23267, 756.91954],
        [263.98047, 282.76941],
    ];
    assert_images(&text, 1e-4, pixels);
    let pixels = [
        [641.34029, 362.51902],
        [1017.35227, 358.02002],
        [772.29893, 5.4799],
        [493.13777, 757.11767],
        [263.84275, 282.77228],
    ];
    assert_images(
        &text.replace(r#"refraction": true"#, r#"refraction": false"#),
        1e-4,
        pixels,
    );
}

#[test]
fn a_plate_with_a_ninth_power_is_fitted() {
    let x = [0.004, -0.003, 0.02, -0.01, 0.003, 0.0005];
    let others = r#""refraction": true, "equal_aspect": true, "asymmetry_corr": false"#;
    let text = file("radial9-odd", others, &x, &[0.0; 6]);
    let pixels = [
        [641.33995, 362.52382],
        [1017.23731, 358.00207],
        [772.25243, 4.8816],
        [493.23573, 757.70736],
        [263.98399, 282.61782],
    ];
    assert_images(&text, 0.01, pixels);
}

#[test]
fn a_polynomial_plate_is_fitted_with_its_turn() {
    let x = [
        -2.5, 0.004, 0.02, 3e-6, -2e-6, 1e-6, 2e-8, 1e-9, 1.8e-8, -2e-9, 1e-9, 0.0,
    ];
    let y = [
        1.25, -0.018, 0.003, 1e-6, 2e-6, -3e-6, 1e-9, 2.1e-8, -1e-9, 1.9e-8, 1e-9, 0.0,
    ];
    let others = r#""refraction": true"#;
    let text = file("poly3+radial", others, &x, &y);
    let pixels = [
        [641.21273, 362.32109],
        [1016.40132, 364.42128],
        [778.86957, 7.47351],
        [484.92704, 755.67931],
        [265.40512, 275.45717],
    ];
    assert_images(&text, 0.01, pixels);
}

fn pointing() -> Pointing {
    let boresight = UnitVector::from_ra_dec(1.45, 0.4);
    Pointing {
        icrs_to_camera: Rotation::looking_at(&boresight, 0.8),
        site: Site::new(45.1, 15.2, 120.0).unwrap(),
        date: "2024-01-01T22:30:00Z".parse().unwrap(),
    }
}

fn cameras() -> Vec<CameraModel> {
    let lens_px = [-20.0, 5.0, -1.0, 6.0, -4.0, 0.6, -0.4, 2.0, 0.0];
    [
        (Projection::Pinhole, 1500.0),
        (Projection::Equidistant, 800.0),
        (Projection::Equisolid, 700.0),
        (Projection::Stereographic, 700.0),
        // The whole sky, and a wide pinhole.
        (Projection::Equidistant, 220.0),
        (Projection::Pinhole, 900.0),
    ]
    .into_iter()
    .flat_map(|(projection, focal_px)| {
        let camera = CameraModel::pinhole(1280.0, 720.0, focal_px, false);
        let camera = camera.with_projection(projection).limited_to(1.5);
        let radius_px = camera.radius_px();
        let mut centred_px = lens_px;
        centred_px[5..7].fill(0.0);
        [
            camera,
            camera.with_distortion(Some(Distortion::new(
                DistortionModel::Stretched,
                radius_px,
                &centred_px,
            ))),
        ]
    })
    .collect()
}

#[test]
fn what_is_written_is_read_again() {
    for camera in cameras() {
        let pointing = pointing();
        let text = platepar(&camera, &pointing).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        let stated_px = json["largest_error_px"].as_f64().unwrap();
        assert!(stated_px < TOLERANCE_PX, "{text}");
        let (read, read_pointing) = from_platepar(&text).unwrap();
        assert_eq!(read_pointing.date.to_iso(), pointing.date.to_iso());
        let mut largest_px = 0f64;
        for sample in samples(&camera, 11) {
            let pixel = PixelPoint::new(sample.pixel[0], sample.pixel[1]);
            let direction = camera.direction_of(&pixel).unwrap();
            let star = pointing.icrs_to_camera.inverse().apply(&direction);
            let again = read_pointing.icrs_to_camera.apply(&star);
            let again = read.pixel_of(&again).unwrap();
            largest_px = largest_px.max(again.distance_to(&pixel));
        }
        assert!(largest_px < TOLERANCE_PX, "{largest_px} {camera:?} {text}");
    }
}

#[test]
fn what_rms_cannot_have_is_refused() {
    let camera = CameraModel::pinhole(1280.0, 720.0, 1500.0, true);
    let error = platepar(&camera, &pointing()).unwrap_err().to_string();
    let expected = "a platepar only supports images that are not mirrored; this one is mirrored";
    assert_eq!(error, expected);
    let camera = CameraModel::pinhole(1280.0, 720.0, 1500.0, false);
    let date = "2024-01-01".parse().unwrap();
    let error = platepar(&camera, &Pointing { date, ..pointing() });
    assert!(matches!(error, Err(FormatError::Unsuitable { .. })));
    let good = platepar(&camera, &pointing()).unwrap();
    for (from, to, expected) in [
        ("\"JD\"", "\"no\"", "'JD' is missing"),
        ("radial", "conic", "'distortion_type' is 'conic"),
        ("1280", "-1", "'X_res' is -1"),
        ("{", "", "expected JSON"),
    ] {
        let error = from_platepar(&good.replacen(from, to, 1))
            .unwrap_err()
            .to_string();
        assert!(error.contains(expected), "{error}");
    }
}
