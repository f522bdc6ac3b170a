//! The attitude that fits pairs of observed and catalogue directions best, with its errors.
//!
//! # Reference
//! Shuster & Oh 1981, J. Guid. Control 4, 70, doi 10.2514/3.19717, for the covariance as that of a small rotation about
//! the camera's axes.

use crate::Status;
use crate::camera::Lens;
use crate::matching::Match;
use nalgebra::{Matrix3, Matrix4, Rotation3, UnitQuaternion, Vector3, Vector4};

/// Steps of Gauss and Newton.
pub(crate) const STEPS: usize = 3;
/// Scale errors smaller than this are none.
const MIN_SCALE_ERROR: f64 = 1e-9;

/// Where the camera looks.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Attitude {
    /// How the search ended; the rest counts only if it is [`Status::FOUND`].
    pub status: Status,
    /// Stars that it rests on.
    pub stars: u32,
    /// [w, x, y, z], w ≥ 0: turns a vector of the ICRS into camera axes.
    pub quaternion: [f64; 4],
    /// Covariance of a small rotation about the camera's axes, in rad².
    pub covariance_rad2: [[f64; 3]; 3],
    /// Rate of the camera about its own axes, in rad/s; zero where none is known.
    pub rate_rad_s: [f64; 3],
    /// Standard errors of the rate; infinite where none is known.
    pub rate_sigma_rad_s: [f64; 3],
    /// log10 of the probability that chance does as well.
    pub log10_false_alarm: f64,
    /// Focal length over that of the configuration.
    pub scale: f64,
    /// Root mean square of the residuals on each axis, in pixels.
    pub rms_px: f64,
}

impl Attitude {
    pub(crate) fn failed(status: Status) -> Self {
        Self {
            status,
            stars: 0,
            quaternion: [1.0, 0.0, 0.0, 0.0],
            covariance_rad2: [[0.0; 3]; 3],
            rate_rad_s: [0.0; 3],
            rate_sigma_rad_s: [f64::INFINITY; 3],
            log10_false_alarm: 0.0,
            scale: 1.0,
            rms_px: 0.0,
        }
    }

    pub(crate) fn found(fit: &Fit, stars: usize, log10_false_alarm: f64) -> Self {
        let rotation = Rotation3::from_matrix_unchecked(fit.icrs_to_camera);
        let q = UnitQuaternion::from_rotation_matrix(&rotation);
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        let covariance = &fit.covariance_rad2;
        Self {
            stars: stars as u32,
            quaternion: [q.w, q.i, q.j, q.k].map(|part| sign * part),
            covariance_rad2: [0, 1, 2].map(|row| [0, 1, 2].map(|column| covariance[(row, column)])),
            log10_false_alarm,
            scale: fit.scale,
            rms_px: fit.rms_px,
            ..Self::failed(Status::FOUND)
        }
    }
}

/// The attitude that fits best.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit {
    pub icrs_to_camera: Matrix3<f64>,
    pub covariance_rad2: Matrix3<f64>,
    pub scale: f64,
    /// Sum of the squared residuals over their expectations, and over the degrees of freedom.
    pub reduced_chi_square: f64,
    pub rms_px: f64,
}

/// The attitude from two pairs of directions: exact for the first one.
pub(crate) fn of_two(
    observed: [&Vector3<f64>; 2],
    stars: [&Vector3<f64>; 2],
) -> Option<Matrix3<f64>> {
    let axes = |[first, second]: [&Vector3<f64>; 2]| {
        let normal = first.cross(second).try_normalize(1e-12)?;
        Some(Matrix3::from_columns(&[
            *first,
            normal,
            first.cross(&normal),
        ]))
    };
    Some(axes(observed)? * axes(stars)?.transpose())
}

/// A direction as a camera with another focal length sees it.
pub(crate) fn with_scale(direction: &Vector3<f64>, scale: f64) -> Vector3<f64> {
    Vector3::new(direction.x / scale, direction.y / scale, direction.z).normalize()
}

/// Fits attitude and scale to the matches, from a first attitude; `None` where they do not determine it.
pub(crate) fn fit(
    matches: &[Match],
    start: &Matrix3<f64>,
    lens: &Lens,
    scale_error: f64,
    iterations: &mut u64,
) -> Option<Fit> {
    let scale_error = scale_error.max(MIN_SCALE_ERROR);
    let (mut attitude, mut scale) = (*start, 1.0);
    let mut normal = Normal::default();
    for _ in 0..STEPS {
        *iterations += 1;
        normal = Normal::new(matches, &attitude, scale, lens);
        normal.add_prior((1.0 - scale) / scale, scale_error);
        let step = normal.solve()?;
        let turn = Vector3::new(step[0], step[1], step[2]);
        attitude = Rotation3::new(turn).matrix() * attitude;
        scale *= 1.0 + step[3];
    }
    let inverse = normal.matrix.try_inverse()?;
    let last = Normal::new(matches, &attitude, scale, lens);
    let freedom = (2 * matches.len()).saturating_sub(3).max(1) as f64;
    let reduced = last.chi_square / freedom;
    // What the stated errors lack shows in the residuals.
    let excess = reduced.max(1.0);
    let finite = attitude
        .iter()
        .chain(inverse.iter())
        .all(|value| value.is_finite());
    finite.then(|| Fit {
        icrs_to_camera: attitude,
        covariance_rad2: inverse.fixed_view::<3, 3>(0, 0).into_owned() * excess,
        scale,
        reduced_chi_square: reduced,
        rms_px: libm::sqrt(last.square_px2 / (2 * matches.len()).max(1) as f64),
    })
}

/// The normal equations of a small rotation and a change of scale.
#[derive(Debug, Clone, Copy, Default)]
struct Normal {
    matrix: Matrix4<f64>,
    right: Vector4<f64>,
    chi_square: f64,
    square_px2: f64,
}

impl Normal {
    fn new(matches: &[Match], attitude: &Matrix3<f64>, scale: f64, lens: &Lens) -> Self {
        let mut normal = Self::default();
        let focal_px = lens.camera.focal_length_px * scale;
        for pair in matches {
            let observed = with_scale(&Vector3::from(pair.observed), scale);
            let predicted = attitude * Vector3::from(pair.apparent);
            let across = libm::hypot(predicted.x, predicted.y);
            let outward = if across > 1e-9 {
                let (x, y) = (predicted.x / across, predicted.y / across);
                Vector3::new(x * predicted.z, y * predicted.z, -across)
            } else {
                Vector3::new(1.0, 0.0, 0.0)
            };
            let around = predicted.cross(&outward);
            let difference = observed - predicted;
            let cosine = predicted.z;
            // A pixel is a smaller angle away from the axis, along the radius more than around it.
            for (axis, px_rad) in [
                (outward, cosine * cosine / focal_px),
                (around, cosine / focal_px),
            ] {
                let lever = predicted.cross(&axis);
                let growth = axis.dot(&outward) * across * cosine;
                let row = Vector4::new(lever.x, lever.y, lever.z, growth);
                let residual = difference.dot(&axis);
                let weight = 1.0 / (pair.variance_px2 * px_rad * px_rad);
                normal.matrix += row * row.transpose() * weight;
                normal.right += row * (residual * weight);
                normal.chi_square += residual * residual * weight;
                normal.square_px2 += residual * residual / (px_rad * px_rad);
            }
        }
        normal
    }

    /// The scale is that of the configuration within an error.
    fn add_prior(&mut self, missing: f64, sigma: f64) {
        let weight = 1.0 / (sigma * sigma);
        self.matrix[(3, 3)] += weight;
        self.right[3] += missing * weight;
    }

    fn solve(&self) -> Option<Vector4<f64>> {
        let step = self.matrix.cholesky()?.solve(&self.right);
        step.iter().all(|value| value.is_finite()).then_some(step)
    }
}
