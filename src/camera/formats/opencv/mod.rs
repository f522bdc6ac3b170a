//! OpenCV: the camera matrix K and the distortion D of `cv::projectPoints` and of `cv::fisheye`.
//!
//! [`CameraModel`](crate::CameraModel) → [`CvLens`] → `FileStorage` YAML, and the same way back.
//!
//! With x, y, z along the axes of the lens, a = x/z, b = y/z, r² = a² + b² and θ = atan r:
//!
//! - pinholes: radial (1 + k₁r² + k₂r⁴ + k₃r⁶) / (1 + k₄r² + k₅r⁴ + k₆r⁶), decentring p₁ and p₂, thin
//!   prism s₁ to s₄; then u = fx a′ + cx, v = fy b′ + cy
//! - other lenses (`equidistant` in ROS, `cv::fisheye`): (a, b) θ(1 + k₁θ² + … + k₄θ⁸)/r
//!
//! The axes of the lens are those of OpenCV's camera. A mirrored image has a negative fx.
//!
//! # Reference
//! OpenCV documentation, modules calib3d and fisheye.

mod read;
mod write;

pub use read::{from_opencv_yaml, from_opencv_yaml_within};
pub(super) use write::cv_lens;
pub use write::{opencv_yaml, opencv_yaml_within};

use nalgebra::{Matrix3, Vector3};

/// Which of OpenCV's two models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CvModel {
    /// That of `cv::projectPoints`.
    Pinhole,
    /// That of `cv::fisheye`.
    Fisheye,
}

/// A lens as OpenCV has it.
#[derive(Debug, Clone)]
pub(super) struct CvLens {
    pub width_px: f64,
    pub height_px: f64,
    /// fx and fy.
    pub focal_px: [f64; 2],
    /// cx and cy.
    pub centre_px: [f64; 2],
    pub model: CvModel,
    /// k₁ k₂ p₁ p₂ k₃ k₄ k₅ k₆ s₁ s₂ s₃ s₄ of pinholes, as many as are needed, k₁ to k₄ of others.
    pub coefficients: Vec<f64>,
    /// From camera axes to OpenCV's.
    pub camera_to_lens: Matrix3<f64>,
    pub max_angle_rad: f64,
    /// Largest error on the frame; `None` where nothing was fitted.
    pub largest_px: Option<f64>,
}

impl CvLens {
    /// ROS's name of the distortion model.
    pub(super) fn distortion_model(&self) -> &'static str {
        match self.model {
            CvModel::Fisheye => "equidistant",
            CvModel::Pinhole if self.coefficients.len() > 5 => "rational_polynomial",
            CvModel::Pinhole => "plumb_bob",
        }
    }

    /// The camera matrix, row by row.
    pub(super) fn camera_matrix(&self) -> [f64; 9] {
        let ([fx, fy], [cx, cy]) = (self.focal_px, self.centre_px);
        [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    }

    /// The pixel of a direction in the axes of the lens.
    fn image(&self, direction: &Vector3<f64>) -> Option<[f64; 2]> {
        let at = match self.model {
            CvModel::Pinhole => {
                let in_front = direction.z > 0.0;
                let at = [direction.x / direction.z, direction.y / direction.z];
                in_front.then(|| distorted(at, &self.coefficients))?
            }
            CvModel::Fisheye => fisheye(direction, &self.coefficients),
        };
        Some([0, 1].map(|axis: usize| self.focal_px[axis] * at[axis] + self.centre_px[axis]))
    }

    /// Distance from the axis, in focal lengths, of what is at an angle from it, without decentring.
    fn radius(&self, angle_rad: f64) -> f64 {
        let at = |i: usize| self.coefficients.get(i).copied().unwrap_or(0.0);
        match self.model {
            CvModel::Fisheye => theta_distorted(angle_rad, &self.coefficients),
            CvModel::Pinhole => {
                let r = libm::tan(angle_rad);
                r * radial(r * r, at)
            }
        }
    }
}

/// The radial factor of pinholes.
fn radial(r2: f64, at: impl Fn(usize) -> f64) -> f64 {
    let numerator = 1.0 + r2 * (at(0) + r2 * (at(1) + r2 * at(4)));
    let denominator = 1.0 + r2 * (at(5) + r2 * (at(6) + r2 * at(7)));
    numerator / denominator
}

/// The distortion of pinholes.
fn distorted([a, b]: [f64; 2], coefficients: &[f64]) -> [f64; 2] {
    let at = |i: usize| coefficients.get(i).copied().unwrap_or(0.0);
    let r2 = a * a + b * b;
    let radial = radial(r2, at);
    let (p1, p2) = (at(2), at(3));
    [
        a * radial + 2.0 * p1 * a * b + p2 * (r2 + 2.0 * a * a) + r2 * (at(8) + r2 * at(9)),
        b * radial + p1 * (r2 + 2.0 * b * b) + 2.0 * p2 * a * b + r2 * (at(10) + r2 * at(11)),
    ]
}

/// The image by a lens that is no pinhole, in focal lengths.
fn fisheye(direction: &Vector3<f64>, coefficients: &[f64]) -> [f64; 2] {
    let sine = libm::hypot(direction.x, direction.y);
    if sine == 0.0 {
        return [0.0; 2];
    }
    let theta = libm::atan2(sine, direction.z);
    let per_sine = theta_distorted(theta, coefficients) / sine;
    [direction.x * per_sine, direction.y * per_sine]
}

fn theta_distorted(theta: f64, coefficients: &[f64]) -> f64 {
    let t2 = theta * theta;
    let series = coefficients.iter().rev().fold(0.0, |sum, k| t2 * (sum + k));
    theta * (1.0 + series)
}

#[cfg(test)]
mod tests;
