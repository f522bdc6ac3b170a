//! [`CameraModel`] → [`CvLens`] → YAML.

use super::super::error::FormatError;
use super::super::error::TOLERANCE_PX;
use super::super::fit::{CHECK_POINTS, FIT_POINTS, LensSample, largest_error_px, samples};
use super::super::yaml::{number, write_matrix};
use super::{CvLens, CvModel};
use crate::CameraModel;
use crate::base::coords::{Camera, Rotation};
use crate::base::least_squares::levenberg_marquardt;
use crate::base::units::DEG_PER_RAD;
use crate::camera::{LENS_TERMS, Projection};
use nalgebra::{Matrix3, Vector3};
use std::fmt::Write as _;

/// The powers of the distance from the axis that go with the coefficients of pinholes.
const POWERS: [i32; 12] = [2, 4, 1, 1, 6, 2, 4, 6, 1, 3, 1, 3];

/// The lens in OpenCV's `FileStorage` YAML: `camera_matrix` and `distortion_coefficients` of
/// `cv::projectPoints` for pinholes, of `cv::fisheye` for other lenses (`distortion_model:
/// equidistant`).
///
/// Pinholes without skew and monomials, and equidistant lenses with nothing but radial terms, an axis and
/// a stretch, are written exactly. For others K and D are fitted over the frame, for pinholes with as many
/// coefficients (5, 8 or 12) as it takes; a comment and `largest_error_px` tell the largest error.
///
/// `camera_to_lens` converts directions in camera axes to OpenCV's: the attitude of OpenCV's camera is this
/// matrix times that of [`CameraModel`].
///
/// # Errors
/// [`FormatError::TooFarOff`] if a pinhole cannot be written to [`TOLERANCE_PX`], or nothing fits.
pub fn opencv_yaml(camera: &CameraModel) -> Result<String, FormatError> {
    let tolerance_px = if camera.is_pinhole() {
        TOLERANCE_PX
    } else {
        f64::MAX
    };
    opencv_yaml_within(camera, tolerance_px)
}

/// [`opencv_yaml`], with another limit to the error of a fit, for every lens.
///
/// # Errors
/// [`FormatError::TooFarOff`] if the fit is worse.
pub fn opencv_yaml_within(camera: &CameraModel, tolerance_px: f64) -> Result<String, FormatError> {
    const MATRIX: [&str; 3] = [" !!opencv-matrix", "d", "   "];
    let lens = cv_lens(camera, tolerance_px, &[5, 8, 12])?;
    let mut text = String::from("%YAML:1.0\n---\n");
    // Writing to a text does not fail.
    let _ = match lens.largest_px {
        None => writeln!(text, "# Represents the measured lens exactly."),
        Some(largest_px) => writeln!(
            text,
            "# Fitted to the measured lens; largest error on the frame: {largest_px:.4} px."
        ),
    };
    if camera.mirrored {
        text.push_str("# The image is mirrored: the focal length along x is negative.\n");
    }
    let _ = writeln!(text, "image_width: {}", camera.width_px);
    let _ = writeln!(text, "image_height: {}", camera.height_px);
    let _ = writeln!(text, "distortion_model: {}", lens.distortion_model());
    write_matrix(
        &mut text,
        "camera_matrix",
        MATRIX,
        [3, 3],
        &lens.camera_matrix(),
    );
    let count = lens.coefficients.len();
    let key = "distortion_coefficients";
    write_matrix(&mut text, key, MATRIX, [1, count], &lens.coefficients);
    text.push_str("# Rotation from starpipe's camera axes to OpenCV's.\n");
    let to_lens: Vec<f64> = lens.camera_to_lens.transpose().iter().copied().collect();
    write_matrix(&mut text, "camera_to_lens", MATRIX, [3, 3], &to_lens);
    text.push_str("# The lens was measured up to this angle from the axis.\n");
    let valid_to_deg = lens.max_angle_rad * DEG_PER_RAD;
    let _ = writeln!(text, "valid_to_deg: {}", number(valid_to_deg));
    let largest_px = lens.largest_px.unwrap_or(0.0);
    let _ = writeln!(text, "largest_error_px: {}", number(largest_px));
    Ok(text)
}

/// The lens as OpenCV has it. Pinholes that need to be fitted get the first of `counts` coefficients with
/// which the error stays below `tolerance_px`.
pub(in super::super) fn cv_lens(
    camera: &CameraModel,
    tolerance_px: f64,
    counts: &[usize],
) -> Result<CvLens, FormatError> {
    let (start, is_exact) = without_irregularities(camera);
    if is_exact {
        return Ok(start);
    }
    let format = match start.model {
        CvModel::Pinhole => "OpenCV's pinhole model",
        CvModel::Fisheye => "OpenCV's fisheye model",
    };
    let (fitted, checked) = (samples(camera, FIT_POINTS), samples(camera, CHECK_POINTS));
    let counts = if start.model == CvModel::Fisheye {
        &[4]
    } else {
        counts
    };
    let mut least_px = f64::INFINITY;
    for count in counts {
        let Some(lens) = fit(&start, *count, &fitted) else {
            continue;
        };
        // The samples are in the axes of the measured lens.
        let to_fitted = lens.camera_to_lens * start.camera_to_lens.transpose();
        let error_px = largest_error_px(&checked, |direction| lens.image(&(to_fitted * direction)));
        least_px = least_px.min(error_px);
        if error_px <= tolerance_px {
            return Ok(CvLens {
                largest_px: Some(error_px),
                ..lens
            });
        }
    }
    Err(FormatError::TooFarOff {
        format,
        found_px: least_px,
        expected_px: tolerance_px,
    })
}

/// What can be written as it is, and whether that is all of the lens.
fn without_irregularities(camera: &CameraModel) -> (CvLens, bool) {
    let terms = camera.distortion().map_or(&[][..], |d| d.coefficients_px());
    let radius_px = camera.distortion().map_or(1.0, |d| d.radius_px());
    let at = |term: usize| terms.get(term).map_or(0.0, |px| px / radius_px);
    let focal_px = camera.focal_length_px();
    let axis = camera.axis();
    // Units of R per focal length.
    let unit = focal_px / radius_px;
    let u2 = unit * unit;
    let [k1, k2, k3] = [at(0) * u2, at(1) * u2 * u2, at(2) * u2 * u2 * u2];
    let is_regular = at(8) == 0.0 && terms.iter().skip(LENS_TERMS).all(|px| *px == 0.0);
    let (model, coefficients, is_exact) = if camera.is_pinhole() {
        let [p2, p1] = [at(5) * unit / 3.0, at(6) * unit / 3.0];
        (CvModel::Pinhole, vec![k1, k2, p1, p2, k3], is_regular)
    } else {
        let is_centred = at(5) == 0.0 && at(6) == 0.0;
        let is_equidistant = camera.projection() == Projection::Equidistant;
        let radial = if is_equidistant {
            [k1, k2, k3, 0.0]
        } else {
            [0.0; 4]
        };
        let is_exact = is_equidistant && is_centred && is_regular;
        (CvModel::Fisheye, radial.to_vec(), is_exact)
    };
    let side = if camera.mirrored { -1.0 } else { 1.0 };
    let lens = CvLens {
        width_px: camera.width_px,
        height_px: camera.height_px,
        focal_px: [side * focal_px * (1.0 + at(7)), focal_px * (1.0 - at(7))],
        centre_px: [axis.x, axis.y],
        model,
        coefficients,
        camera_to_lens: camera.lens_axes(),
        max_angle_rad: camera.max_angle_rad(),
        largest_px: None,
    };
    (lens, is_exact)
}

/// The lens with `count` coefficients that is most like `fitted`. The axes of a pinhole are free to turn.
fn fit(start: &CvLens, count: usize, fitted: &[LensSample]) -> Option<CvLens> {
    const FIRST: usize = 7;
    let is_pinhole = start.model == CvModel::Pinhole;
    let far = |sample: &LensSample| {
        let sine = libm::hypot(sample.direction.x, sample.direction.y);
        if is_pinhole {
            sine / sample.direction.z
        } else {
            libm::atan2(sine, sample.direction.z)
        }
    };
    let far = fitted.iter().map(far).fold(0.0, f64::max);
    let power = |term: usize| {
        if is_pinhole {
            POWERS[term]
        } else {
            2 * term as i32 + 2
        }
    };
    // Every parameter is of the order of 1 for what it does at the border of the frame.
    let unit: Vec<f64> = (0..count)
        .map(|term| libm::pow(far, f64::from(power(term))))
        .collect();
    let scale_px = start.focal_px[1];
    let lens_of = |parameters: &[f64]| {
        let turn = turned(&parameters[..3]);
        let coefficients = parameters[FIRST..].iter().zip(&unit);
        let lens = CvLens {
            focal_px: [parameters[3] * scale_px, parameters[4] * scale_px],
            centre_px: [parameters[5] * scale_px, parameters[6] * scale_px],
            coefficients: coefficients.map(|(p, unit)| p / unit).collect(),
            camera_to_lens: turn * start.camera_to_lens,
            ..start.clone()
        };
        (lens, turn)
    };
    let mut first = vec![0.0; FIRST + count];
    first[3] = start.focal_px[0] / scale_px;
    first[4] = 1.0;
    first[5] = start.centre_px[0] / scale_px;
    first[6] = start.centre_px[1] / scale_px;
    for (term, coefficient) in start.coefficients.iter().enumerate() {
        first[FIRST + term] = coefficient * unit[term];
    }
    // Axes that may not turn have a parameter that nothing depends on.
    let free = usize::from(!is_pinhole) * 3;
    let steps = vec![1e-5; first.len() - free];
    let found = levenberg_marquardt(&first[free..], &steps, |parameters, residuals| {
        let parameters: Vec<f64> = first[..free].iter().chain(parameters).copied().collect();
        let (lens, turn) = lens_of(&parameters);
        fitted.iter().all(|sample| {
            lens.image(&(turn * sample.direction))
                .is_some_and(|[x, y]| {
                    residuals.extend([x - sample.pixel[0], y - sample.pixel[1]]);
                    true
                })
        })
    })?;
    let parameters: Vec<f64> = first[..free].iter().chain(&found).copied().collect();
    Some(lens_of(&parameters).0)
}

/// The rotation by twice the angles whose tangents are given.
fn turned(tangents: &[f64]) -> Matrix3<f64> {
    let v = Vector3::from_column_slice(tangents);
    *Rotation::<Camera, Camera>::from_quaternion([1.0, v.x, v.y, v.z]).matrix()
}
