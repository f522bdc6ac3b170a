//! YAML → [`CvLens`] → [`CameraModel`].

use super::super::error::FormatError;
use super::super::error::TOLERANCE_PX;
use super::super::fit::{LensGuess, LensSample, camera_like};
use super::super::yaml::{Document, Matrix};
use super::{CvLens, CvModel};
use crate::CameraModel;
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::camera::{Distortion, DistortionModel, ImplausibleLens, Projection};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The lens of an OpenCV `FileStorage` YAML, or of a ROS `camera_info` YAML.
///
/// `image_width`, `image_height`, `camera_matrix` and `distortion_coefficients` are read, and
/// `distortion_model`: `plumb_bob`, `rational_polynomial` or `equidistant` (`cv::fisheye`). Without a
/// model the lens is a pinhole, unless `fisheye_model` is 1. `valid_to_deg` is read, too; without it
/// lenses are known up to 90° from the axis. Lenses that no camera has are refused: an image that folds on
/// the frame, an axis beside it, focal lengths along rows and columns that differ by more than 25 %.
///
/// k₁ to k₃, p₁, p₂ and s₁ to s₄ of pinholes, and k₁ to k₃ of `cv::fisheye`, are taken over exactly. With
/// k₄ and more the lens of some ideal projection is fitted.
///
/// Directions are OpenCV's in the axes of the lens: a pinhole with an axis off the frame's centre has its
/// camera axes turned against them.
///
/// # Errors
/// [`FormatError`] if the file is something else, or the fit is off by more than [`TOLERANCE_PX`].
///
/// # Example
/// ```
/// use starpipe::CameraModel;
/// use starpipe::camera::formats::{from_opencv_yaml, opencv_yaml};
///
/// let camera = CameraModel::pinhole(640.0, 480.0, 900.0, false);
/// assert_eq!(from_opencv_yaml(&opencv_yaml(&camera)?)?.focal_length_px(), 900.0);
/// # Ok::<(), starpipe::camera::formats::FormatError>(())
/// ```
pub fn from_opencv_yaml(text: &str) -> Result<CameraModel, FormatError> {
    from_opencv_yaml_within(text, TOLERANCE_PX)
}

/// [`from_opencv_yaml`], with another limit to the error of a fit.
///
/// # Errors
/// [`FormatError`] if the file is something else, or the fit is off by more.
pub fn from_opencv_yaml_within(text: &str, tolerance_px: f64) -> Result<CameraModel, FormatError> {
    camera_of(&lens_of(&Document::read(text)?)?, tolerance_px)
}

fn lens_of(document: &Document) -> Result<CvLens, FormatError> {
    let size = |keys: &[&'static str]| {
        let found = document.number(keys)?;
        let expected = "the size of the image, from 1 to 1000000 pixels";
        let key = keys[0];
        let found = found.ok_or(FormatError::Missing { key, expected })?;
        if (1.0..=1e6).contains(&found) && found.fract() == 0.0 {
            return Ok(found);
        }
        let found = found.to_string();
        Err(FormatError::Value {
            key,
            found,
            expected,
        })
    };
    let (focal_px, centre_px) = of_camera_matrix(&document.matrix(&["camera_matrix"])?)?;
    let coefficients = document.matrix(&["distortion_coefficients"])?.data;
    let model = model_of(document, &coefficients)?;
    let valid_to_deg = document.number(&["valid_to_deg"])?;
    let max_angle_rad = valid_to_deg.map_or(FRAC_PI_2, |deg| deg * RAD_PER_DEG);
    if max_angle_rad.is_nan() || max_angle_rad <= 0.0 || max_angle_rad > PI + 1e-9 {
        return Err(FormatError::Value {
            key: "valid_to_deg",
            found: format!("{}", valid_to_deg.unwrap_or(f64::NAN)),
            expected: "an angle up to 180 degrees",
        });
    }
    let [width_px, height_px] = [size(&["image_width"])?, size(&["image_height"])?];
    let [x, y] = centre_px;
    if !(-0.5..=width_px).contains(&x) || !(-0.5..=height_px).contains(&y) {
        return Err(FormatError::Value {
            key: "camera_matrix",
            found: format!("for an optical axis at ({x}, {y}) px"),
            expected: "an axis within image_width and image_height",
        });
    }
    Ok(CvLens {
        width_px,
        height_px,
        focal_px,
        centre_px,
        model,
        coefficients,
        camera_to_lens: Matrix3::identity(),
        max_angle_rad,
        largest_px: None,
    })
}

/// The focal lengths and the axis.
fn of_camera_matrix(matrix: &Matrix) -> Result<([f64; 2], [f64; 2]), FormatError> {
    let error = |found: String, expected| FormatError::Value {
        key: "camera_matrix",
        found,
        expected,
    };
    let [fx, skew, cx, zero, fy, cy, z1, z2, one] = matrix.data[..] else {
        let found = format!("{} x {}", matrix.rows, matrix.columns);
        return Err(error(found, "a matrix of 3 x 3 numbers"));
    };
    let others = [skew, zero, z1, z2, one - 1.0];
    if matrix.rows != 3 || others.iter().any(|n| *n != 0.0) {
        let found = format!("{:?}", matrix.data);
        return Err(error(found, "[fx, 0, cx, 0, fy, cy, 0, 0, 1]"));
    }
    if fx == 0.0 || fy <= 0.0 {
        let found = format!("fx {fx}, fy {fy}");
        return Err(error(found, "an fx that is not 0 and an fy above 0"));
    }
    Ok(([fx, fy], [cx, cy]))
}

fn model_of(document: &Document, coefficients: &[f64]) -> Result<CvModel, FormatError> {
    let count = coefficients.len();
    let named = document.word(&["distortion_model"]);
    let is_fisheye = document.number(&["fisheye_model"])?.unwrap_or(0.0) == 1.0;
    let model = match named.map(str::to_lowercase).as_deref() {
        None | Some("") if is_fisheye => CvModel::Fisheye,
        None | Some("" | "plumb_bob" | "rational_polynomial" | "thin_prism") => CvModel::Pinhole,
        Some("equidistant" | "fisheye") => CvModel::Fisheye,
        Some(_) => {
            return Err(FormatError::Value {
                key: "distortion_model",
                found: format!("'{}'", named.unwrap_or_default()),
                expected: "plumb_bob, rational_polynomial or equidistant",
            });
        }
    };
    let (is_good, expected) = match model {
        CvModel::Fisheye => (count == 4, "4 coefficients for an equidistant lens"),
        CvModel::Pinhole => (
            [0, 4, 5, 8, 12].contains(&count)
                || count == 14 && coefficients[12..].iter().all(|tilt| *tilt == 0.0),
            "4, 5, 8 or 12 coefficients, or 14 for a sensor without tilt",
        ),
    };
    if is_good {
        return Ok(model);
    }
    Err(FormatError::Value {
        key: "distortion_coefficients",
        found: format!("{coefficients:?}"),
        expected,
    })
}

fn camera_of(lens: &CvLens, tolerance_px: f64) -> Result<CameraModel, FormatError> {
    let at = |i: usize| lens.coefficients.get(i).copied().unwrap_or(0.0);
    let is_exact = match lens.model {
        CvModel::Pinhole => [5, 6, 7].iter().all(|i| at(*i) == 0.0),
        CvModel::Fisheye => at(3) == 0.0,
    };
    let exact = exact_camera(lens);
    if is_exact {
        exact.check()?;
        return Ok(exact);
    }
    exact.check_frame()?;
    check_fold(lens)?;
    let camera = CameraModel::pinhole(
        lens.width_px,
        lens.height_px,
        exact.focal_length_px(),
        exact.mirrored,
    )
    .with_projection(Projection::Equidistant)
    .limited_to(lens.max_angle_rad);
    let distortion = exact.distortion();
    let guess = LensGuess {
        camera,
        axis_px: distortion.map_or([0.0; 2], |d| d.axis_offset_px()),
        stretch_px: distortion.map_or(0.0, |d| d.coefficients_px().get(7).copied().unwrap_or(0.0)),
    };
    let to_rad = farthest_rad(lens);
    let [fitted, checked] = [(31, 24), (71, 45)].map(|points| polar_samples(lens, to_rad, points));
    let kinds = |projections: &[Projection]| -> Vec<_> {
        let kind = |projection: &Projection| (*projection, DistortionModel::Stretched);
        projections.iter().map(kind).collect()
    };
    use Projection::{Equidistant, Equisolid, Orthographic, Pinhole, Stereographic};
    let is_centred = [2, 3, 8, 9, 10, 11].iter().all(|i| at(*i) == 0.0);
    let kinds = match lens.model {
        CvModel::Fisheye => kinds(&[Equidistant, Equisolid, Stereographic, Orthographic]),
        CvModel::Pinhole if is_centred => {
            kinds(&[Pinhole, Equidistant, Stereographic, Equisolid, Orthographic])
        }
        CvModel::Pinhole => vec![
            (Pinhole, DistortionModel::Stretched),
            (Pinhole, DistortionModel::Irregular5),
        ],
    };
    let found = camera_like(&guess, [&fitted, &checked], &kinds, tolerance_px);
    let found_px = found.map_or(f64::INFINITY, |(_, error_px)| error_px);
    let found = found.filter(|(_, error_px)| *error_px <= tolerance_px);
    found
        .map(|(camera, _)| camera)
        .ok_or(FormatError::TooFarOff {
            format: "a lens with radial terms up to the seventh order",
            found_px,
            expected_px: tolerance_px,
        })
}

/// The camera with all coefficients but k₄ and more.
fn exact_camera(lens: &CvLens) -> CameraModel {
    let at = |i: usize| lens.coefficients.get(i).copied().unwrap_or(0.0);
    let [fx, fy] = lens.focal_px;
    let mirrored = fx < 0.0;
    let focal_px = 0.5 * (fx.abs() + fy);
    let camera = CameraModel::pinhole(lens.width_px, lens.height_px, focal_px, mirrored);
    let radius_px = camera.radius_px();
    let centre = camera.centre();
    let side = if mirrored { -1.0 } else { 1.0 };
    let axis = [
        side * (lens.centre_px[0] - centre.x),
        lens.centre_px[1] - centre.y,
    ];
    let stretch_px = (fx.abs() - fy) / (2.0 * focal_px) * radius_px;
    // R in focal lengths.
    let unit = radius_px / focal_px;
    let u2 = unit * unit;
    let k3 = if lens.model == CvModel::Pinhole {
        at(4)
    } else {
        at(2)
    };
    let radial = [at(0) * u2, at(1) * u2 * u2, k3 * u2 * u2 * u2].map(|k| k * radius_px);
    let (projection, decentring, prism) = match lens.model {
        CvModel::Fisheye => (Projection::Equidistant, [0.0; 2], [0.0; 4]),
        CvModel::Pinhole => (
            Projection::Pinhole,
            [at(3), at(2)].map(|p| 3.0 * p * unit * radius_px),
            [at(8), at(9), at(10), at(11)],
        ),
    };
    let mut terms = radial.to_vec();
    terms.extend(axis);
    terms.extend(decentring);
    terms.extend([stretch_px, 0.0]);
    terms.resize(DistortionModel::Irregular5.terms(), 0.0);
    // r² is the monomials u², v²; r⁴ is u⁴ + 2u²v² + v⁴.
    for (along, scale_px) in [(0, fx.abs() / focal_px), (1, fy / focal_px)] {
        let [of_r2, of_r4] = [prism[2 * along], prism[2 * along + 1]];
        let scale_px = scale_px * radius_px;
        for (monomial, factor) in [(0, of_r2), (2, of_r2)] {
            terms[9 + 2 * monomial + along] = factor * unit * scale_px;
        }
        for (monomial, factor) in [(7, of_r4), (9, 2.0 * of_r4), (11, of_r4)] {
            terms[9 + 2 * monomial + along] = factor * unit * u2 * scale_px;
        }
    }
    let used = terms
        .iter()
        .rposition(|px| *px != 0.0)
        .map_or(0, |last| last + 1);
    let model = DistortionModel::with_terms(used);
    let distortion = model.map(|m| Distortion::new(m, radius_px, &terms[..m.terms()]));
    let lens_camera = camera
        .with_projection(projection)
        .with_distortion(distortion);
    lens_camera.limited_to(lens.max_angle_rad)
}

/// Refuses a lens whose image folds before the frame's corners.
fn check_fold(lens: &CvLens) -> Result<(), ImplausibleLens> {
    let corner = farthest_radius(lens);
    let mut last = [0.0, 0.0];
    for angle_rad in angles(lens) {
        let radius = lens.radius(angle_rad);
        if radius.is_nan() || radius <= last[1] {
            let [last_rad, last_radius] = last;
            return Err(ImplausibleLens::Fold {
                angle_deg: last_rad * DEG_PER_RAD,
                x_px: lens.centre_px[0] + last_radius * lens.focal_px[0].abs(),
                y_px: lens.centre_px[1],
            });
        }
        if radius > corner {
            return Ok(());
        }
        last = [angle_rad, radius];
    }
    Ok(())
}

/// The angle from the axis of the farthest corner.
fn farthest_rad(lens: &CvLens) -> f64 {
    let corner = farthest_radius(lens);
    let mut beyond = angles(lens).filter(|angle_rad| lens.radius(*angle_rad) > corner);
    beyond.next().unwrap_or(lens.max_angle_rad * (1.0 - 1e-9))
}

/// Distance from the axis to the farthest corner, in focal lengths, and a little more.
fn farthest_radius(lens: &CvLens) -> f64 {
    let ([fx, fy], [cx, cy]) = (lens.focal_px, lens.centre_px);
    let (right, bottom) = (lens.width_px - 0.5, lens.height_px - 0.5);
    let corners = [(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)];
    let distances = corners.map(|(x, y)| libm::hypot((x - cx) / fx, (y - cy) / fy));
    1.01 * distances.into_iter().fold(0.0, f64::max)
}

/// Angles from the axis up to that to which the lens is known.
fn angles(lens: &CvLens) -> impl Iterator<Item = f64> {
    const STEPS: u32 = 4000;
    let step_rad = lens.max_angle_rad * (1.0 - 1e-9) / f64::from(STEPS);
    (1..=STEPS).map(move |i| f64::from(i) * step_rad)
}

/// What the lens images up to an angle from its axis, on circles about it.
fn polar_samples(lens: &CvLens, to_rad: f64, (circles, rays): (u32, u32)) -> Vec<LensSample> {
    let at = |circle: u32, ray: u32| {
        // Closer together at the border.
        let angle_rad = to_rad * libm::sin(FRAC_PI_2 * f64::from(circle) / f64::from(circles));
        let (sin, cos) = libm::sincos(angle_rad);
        let (sin_ray, cos_ray) = libm::sincos(TAU * f64::from(ray) / f64::from(rays));
        let direction = Vector3::new(sin * cos_ray, sin * sin_ray, cos);
        let pixel = lens.image(&direction)?;
        Some(LensSample { direction, pixel })
    };
    (0..=circles)
        .flat_map(|circle| (0..rays).filter_map(move |ray| at(circle, ray)))
        .collect()
}
