//! Expected pixels are those of OpenCV 5.0.0 (opencv-python-headless), by `cv2.projectPoints(DIRECTIONS,
//! 0, 0, K, D)` and `cv2.fisheye.projectPoints(WIDE_DIRECTIONS, 0, 0, K, D)`.

use super::super::FormatError;
use super::super::fit::{LensSample, image_in_lens, samples};
use super::read::from_opencv_yaml_within;
use super::*;
use crate::CameraModel;
use crate::base::coords::{PixelPoint, UnitVector};
use crate::camera::{Distortion, DistortionModel, Projection};

const DIRECTIONS: [[f64; 3]; 6] = [
    [0.0, 0.0, 1.0],
    [0.3, 0.1, 1.0],
    [-0.4, 0.25, 1.0],
    [0.15, -0.35, 1.0],
    [-0.45, -0.3, 1.0],
    [0.5, 0.35, 1.0],
];
const WIDE_DIRECTIONS: [[f64; 3]; 6] = [
    [0.0, 0.0, 1.0],
    [0.5, 0.2, 1.0],
    [-1.0, 0.6, 1.0],
    [0.4, -1.5, 1.0],
    [-2.0, -1.0, 1.0],
    [3.0, 1.0, 1.0],
];

/// As `cv2.FileStorage` writes it.
fn yaml(model: &str, [fx, fy, cx, cy]: [f64; 4], coefficients: &[f64]) -> String {
    let count = coefficients.len();
    format!(
        "%YAML 1.2\n---\nimage_width: 1280\nimage_height: 960\ndistortion_model: {model}\n\
         camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ {fx}, 0., {cx}, \
         0., {fy}, {cy},\n       0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 1\n   \
         cols: {count}\n   dt: d\n   data: {coefficients:?}\n"
    )
}

fn assert_images(text: &str, directions: &[[f64; 3]], pixels: &[[f64; 2]], tolerance_px: f64) {
    let camera = from_opencv_yaml(text).unwrap();
    for (direction, pixel) in directions.iter().zip(pixels) {
        let direction = Vector3::from(*direction).normalize();
        let [x, y] = image_in_lens(&camera, &direction).unwrap();
        let off_px = (x - pixel[0]).hypot(y - pixel[1]);
        assert!(off_px < tolerance_px, "{direction:?}: {x} {y}, {pixel:?}");
        // The same through the camera's own axes.
        let seen = UnitVector::from_vector(camera.lens_axes().tr_mul(&direction));
        let seen = camera.pixel_of(&seen).unwrap();
        assert!(seen.distance_to(&PixelPoint::new(x, y)) < 1e-9);
    }
}

#[test]
fn five_coefficients_are_those_of_opencv() {
    let coefficients = [-0.12, 0.08, 0.0011, -0.0007, -0.03];
    let pixels = [
        [645.5, 470.25],
        [971.6511, 578.618865],
        [214.991055, 738.256464],
        [807.618089, 93.609213],
        [164.647722, 151.640726],
        [1175.919119, 840.504228],
    ];
    let text = yaml("plumb_bob", [1100.0, 1095.0, 645.5, 470.25], &coefficients);
    assert_images(&text, &DIRECTIONS, &pixels, 2e-6);
    let mirrored = pixels.map(|[x, y]| [1291.0 - x, y]);
    let text = yaml("plumb_bob", [-1100.0, 1095.0, 645.5, 470.25], &coefficients);
    assert_images(&text, &DIRECTIONS, &mirrored, 2e-6);
}

#[test]
fn a_thin_prism_is_that_of_opencv() {
    let coefficients = [
        -0.1, 0.02, 0.0005, 0.0003, 0.001, 0.0, 0.0, 0.0, 0.002, -0.001, -0.0015, 0.0008,
    ];
    let pixels = [
        [630.0, 481.0],
        [957.10073, 590.049622],
        [199.853566, 750.447144],
        [792.978208, 100.688315],
        [149.547419, 159.437612],
        [1162.21454, 853.385514],
    ];
    let text = yaml(
        "rational_polynomial",
        [1100.0, 1102.0, 630.0, 481.0],
        &coefficients,
    );
    assert_images(&text, &DIRECTIONS, &pixels, 2e-6);
}

#[test]
fn a_rational_lens_is_fitted() {
    let pixels = [
        [640.0, 480.0],
        [935.894493, 578.631498],
        [251.869153, 722.581779],
        [787.052344, 136.877863],
        [207.312308, 191.541539],
        [1115.869793, 813.108855],
    ];
    let coefficients = [0.31, -0.04, 0.0, 0.0, 0.002, 0.45, -0.01, 0.0015];
    let text = yaml(
        "rational_polynomial",
        [1000.0, 1000.0, 640.0, 480.0],
        &coefficients,
    );
    assert_images(&text, &DIRECTIONS, &pixels, 0.01);
    let pixels = [
        [640.0, 480.0],
        [908.80218, 569.645727],
        [283.399201, 702.918052],
        [774.061259, 167.151245],
        [240.443511, 213.786957],
        [1081.767094, 789.441469],
    ];
    let coefficients = [0.11, -0.04, 0.0004, -0.0003, 0.002, 0.15, -0.01, 0.0015];
    let text = yaml(
        "rational_polynomial",
        [900.0, 900.0, 640.0, 480.0],
        &coefficients,
    );
    assert_images(&text, &DIRECTIONS, &pixels, 0.01);
}

#[test]
fn a_fisheye_is_that_of_opencv() {
    let pixels = [
        [650.0, 475.0],
        [834.31457, 549.094457],
        [350.521937, 655.585272],
        [754.629012, 80.67941],
        [229.794287, 263.846629],
        [1141.662612, 639.706975],
    ];
    let lens = [400.0, 402.0, 650.0, 475.0];
    let text = yaml("equidistant", lens, &[0.02, -0.004, 0.0007, 0.0]);
    assert_images(&text, &WIDE_DIRECTIONS, &pixels, 2e-6);
    let pixels = [
        [650.0, 475.0],
        [832.96355, 548.551347],
        [356.507869, 651.975755],
        [751.944525, 90.796573],
        [243.488756, 270.7281],
        [1122.765482, 633.376436],
    ];
    let text = yaml("equidistant", lens, &[-0.012, 0.004, -0.0015, 0.00005]);
    assert_images(&text, &WIDE_DIRECTIONS, &pixels, 0.01);
}

#[test]
fn a_lens_that_cannot_be_taken_over_is_refused_with_its_error() {
    let lens = [400.0, 400.0, 640.0, 480.0];
    let text = yaml("equidistant", lens, &[0.01, -0.02, 0.02, -0.005]);
    let error = from_opencv_yaml(&text).unwrap_err();
    assert!(matches!(error, FormatError::TooFarOff { .. }), "{error}");
    assert!(from_opencv_yaml_within(&text, 10.0).is_ok());
}

/// Lenses of every projection and model.
fn cameras() -> Vec<CameraModel> {
    let lens_px = [-30.0, 8.0, -2.0, 6.0, -4.0, 1.5, -1.0, 2.0];
    let mut all = Vec::new();
    for (projection, focal_px) in [
        (Projection::Pinhole, 1100.0),
        (Projection::Equidistant, 420.0),
        (Projection::Equisolid, 450.0),
        (Projection::Stereographic, 400.0),
        (Projection::Orthographic, 700.0),
    ] {
        for mirrored in [false, true] {
            let camera = CameraModel::pinhole(1280.0, 960.0, focal_px, mirrored);
            let camera = camera.with_projection(projection).limited_to(1.45);
            all.push(camera);
            for (model, is_centred) in [
                (DistortionModel::Radial7, true),
                (DistortionModel::Stretched, !camera.is_pinhole()),
            ] {
                let mut terms_px = lens_px.to_vec();
                terms_px.resize(9, 0.0);
                if is_centred {
                    terms_px[5..7].fill(0.0);
                }
                let distortion =
                    Distortion::new(model, camera.radius_px(), &terms_px[..model.terms()]);
                all.push(camera.with_distortion(Some(distortion)));
            }
        }
    }
    all
}

/// The largest distance between two cameras' pixels of the same direction in camera axes.
fn largest_difference_px(camera: &CameraModel, other: &CameraModel) -> f64 {
    let difference_px = |sample: LensSample| {
        let pixel = PixelPoint::new(sample.pixel[0], sample.pixel[1]);
        let direction = camera.direction_of(&pixel).unwrap();
        other.pixel_of(&direction).unwrap().distance_to(&pixel)
    };
    let samples = samples(camera, 19).into_iter();
    samples.map(difference_px).fold(0.0, f64::max)
}

#[test]
fn what_is_written_is_read_again() {
    for camera in cameras() {
        let text = opencv_yaml(&camera).unwrap();
        let read = from_opencv_yaml_within(&text, 0.02).unwrap();
        assert_eq!(read.mirrored, camera.mirrored);
        assert!((read.max_angle_rad() - camera.max_angle_rad()).abs() < 1e-9);
        let stated = text.rsplit("largest_error_px: ").next();
        let stated_px: f64 = stated.unwrap().trim().parse().unwrap();
        assert!(stated_px < 0.03, "{text}");
        let largest_px = largest_difference_px(&camera, &read);
        let tolerance_px = 0.01 + stated_px;
        assert!(largest_px < tolerance_px, "{largest_px} {camera:?}\n{text}");
    }
}

#[test]
fn skew_is_fitted_or_refused() {
    let camera = CameraModel::pinhole(1280.0, 960.0, 1100.0, false);
    let with_skew = |skew_px: f64| {
        let terms_px = [-30.0, 8.0, -2.0, 6.0, -4.0, 1.5, -1.0, 2.0, skew_px];
        let model = DistortionModel::Stretched;
        camera.with_distortion(Some(Distortion::new(model, camera.radius_px(), &terms_px)))
    };
    let text = opencv_yaml(&with_skew(0.005)).unwrap();
    assert!(text.contains("largest error on the frame: 0.00"), "{text}");
    let read = from_opencv_yaml(&text).unwrap();
    let largest_px = largest_difference_px(&with_skew(0.005), &read);
    assert!(largest_px < 0.01, "{largest_px}");
    let error = opencv_yaml(&with_skew(1.0)).unwrap_err();
    assert!(matches!(error, FormatError::TooFarOff { .. }), "{error}");
    assert!(opencv_yaml_within(&with_skew(1.0), 2.0).is_ok());
}

#[test]
fn monomials_that_a_thin_prism_makes_are_fitted() {
    let camera = CameraModel::pinhole(1280.0, 960.0, 1100.0, false);
    let mut terms_px = vec![-30.0, 8.0, 0.0, 6.0, -4.0, 0.0, 0.0, 0.0, 0.0];
    // u² and v² along u, and a little of u² alone.
    terms_px.extend([2.0, 0.0, 0.0, 0.0, 1.98, 0.0]);
    let model = DistortionModel::Irregular3;
    terms_px.resize(model.terms(), 0.0);
    let camera =
        camera.with_distortion(Some(Distortion::new(model, camera.radius_px(), &terms_px)));
    let text = opencv_yaml(&camera).unwrap();
    assert!(text.contains("rational_polynomial"), "{text}");
    let read = from_opencv_yaml(&text).unwrap();
    let largest_px = largest_difference_px(&camera, &read);
    assert!(largest_px < 0.02, "{largest_px} {text}");
}

#[test]
fn other_files_are_refused() {
    let good = yaml("plumb_bob", [1100.0, 1095.0, 645.5, 470.25], &[0.0; 5]);
    assert!(from_opencv_yaml(&good).is_ok());
    for (from, to, expected) in [
        ("image_width", "width", "'image_width' is missing"),
        ("1280", "-3", "'image_width' is -3"),
        (
            "plumb_bob",
            "equidistant",
            "4 coefficients for an equidistant lens",
        ),
        ("plumb_bob", "omni", "'distortion_model' is 'omni'"),
        ("1100, 0.", "1100, 2.", "[fx, 0, cx, 0, fy, cy, 0, 0, 1]"),
        ("1095", "-1095", "fy above 0"),
        ("camera_matrix", "matrix", "'camera_matrix' is missing"),
        ("470.25", "nan", "'nan'; expected numbers"),
        ("1100, 0.", "1e308, 0.", "the focal length is"),
        ("1095", "547", "is 2.011; expected square pixels"),
        (
            "645.5",
            "1645.5",
            "for an optical axis at (1645.5, 470.25) px; expected an axis within",
        ),
        (
            "[0.0, 0.0, 0.0, 0.0, 0.0]",
            "[-50., 300., 0., 0., -900.]",
            "is not monotonic",
        ),
    ] {
        let error = from_opencv_yaml(&good.replace(from, to))
            .unwrap_err()
            .to_string();
        assert!(error.contains(expected), "{error}");
    }
    let folded = [-2.0, 1.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0];
    let folded = yaml(
        "rational_polynomial",
        [1100.0, 1095.0, 645.5, 470.25],
        &folded,
    );
    let error = from_opencv_yaml(&folded).unwrap_err();
    assert!(error.to_string().contains("is not monotonic"), "{error}");
    assert!(from_opencv_yaml(&format!("{folded}valid_to_deg: 15\n")).is_ok());
    let long = format!("{good}{}\n", "x".repeat(200_000));
    let error = from_opencv_yaml(&long).unwrap_err().to_string();
    assert!(
        error.starts_with("line ") && error.len() < 200,
        "{}",
        error.len()
    );
}
