//! A lens that was measured: its camera model with the covariance of its parameters.

use super::distortion::DistortionModel;
use super::model::CameraModel;
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation};
use crate::base::size::Size;
use crate::base::units::DEG_PER_RAD;
use nalgebra::{DMatrix, DVector, Matrix3};
use std::fmt::Write as _;

/// A lens that was measured, as by [`crate::identify::lens::calibrate`].
#[derive(Debug, Clone, PartialEq)]
pub struct KnownLens {
    camera: CameraModel,
    covariance: DMatrix<f64>,
    information: DMatrix<f64>,
}

impl KnownLens {
    /// A camera with the covariance of the natural logarithm of its focal length, and of the terms of
    /// its distortion in pixels. `None` where that is no covariance of these.
    pub fn new(camera: CameraModel, covariance: DMatrix<f64>) -> Option<Self> {
        let terms = camera.distortion_model().map_or(0, DistortionModel::terms);
        if covariance.shape() != (1 + terms, 1 + terms) {
            return None;
        }
        // Parameters differ by many orders of magnitude.
        let sigma = covariance.diagonal().map(f64::sqrt);
        let scale = &sigma * sigma.transpose();
        let correlation = covariance.component_div(&scale);
        let information = correlation.cholesky()?.inverse().component_div(&scale);
        let is_finite = information.iter().all(|value| value.is_finite());
        is_finite.then_some(Self {
            camera,
            covariance,
            information,
        })
    }

    /// A camera whose errors are not known: they are taken to be those of good lenses, 0.1 % of the focal
    /// length, and for each term 0.1 % of the distance of the corners.
    pub fn with_assumed_errors(camera: CameraModel) -> Option<Self> {
        const RELATIVE: f64 = 1e-3;
        let terms = camera.distortion_model().map_or(0, DistortionModel::terms);
        let sigma_px = RELATIVE * camera.radius_px();
        let variances = std::iter::once(RELATIVE).chain(std::iter::repeat_n(sigma_px, terms));
        let variances = variances.map(|sigma| sigma * sigma);
        let diagonal = DVector::from_iterator(1 + terms, variances);
        Self::new(camera, DMatrix::from_diagonal(&diagonal))
    }

    /// The camera.
    pub fn camera(&self) -> &CameraModel {
        &self.camera
    }

    /// Covariance of the natural logarithm of the focal length, and of the terms of the distortion in
    /// pixels.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// The inverse of the covariance.
    pub(crate) fn information(&self) -> &DMatrix<f64> {
        &self.information
    }

    /// Standard error of the focal length, in pixels.
    pub fn focal_length_sigma_px(&self) -> f64 {
        self.covariance[(0, 0)].sqrt() * self.camera.focal_length_px()
    }

    /// Size of the frames that it was measured in.
    pub(crate) fn size(&self) -> Size {
        Size::new(
            self.camera.width_px as usize,
            self.camera.height_px as usize,
        )
    }

    /// Whether frames of this size are of the lens's camera.
    pub fn is_of_size(&self, width_px: f64, height_px: f64) -> bool {
        [width_px, height_px] == [self.camera.width_px, self.camera.height_px]
    }

    /// The attitude in which this camera sees in the frame's centre what `other` sees there.
    pub(crate) fn attitude_like(
        &self,
        other: &CameraModel,
        icrs_to_other: &Rotation<Icrs, Camera>,
    ) -> Option<Rotation<Icrs, Camera>> {
        let centre = other.centre();
        let aside = PixelPoint::new(centre.x + 0.1 * other.width_px, centre.y);
        let axes = |camera: &CameraModel| {
            let [first, second] = [&centre, &aside].map(|pixel| camera.direction_of(pixel));
            let (first, second) = (*first?.as_vector(), *second?.as_vector());
            let normal = first.cross(&second).normalize();
            Some(Matrix3::from_columns(&[
                first,
                normal.cross(&first),
                normal,
            ]))
        };
        let turn = axes(&self.camera)? * axes(other)?.transpose();
        Some(Rotation::from_matrix(turn * icrs_to_other.matrix()))
    }

    /// The table `[lens]` of a `camera.toml`, with `about` as comments.
    pub fn to_toml(&self, about: &[String]) -> String {
        let camera = &self.camera;
        let mut text = String::new();
        for line in about {
            let _ = writeln!(text, "# {line}");
        }
        let _ = writeln!(
            text,
            "[lens]\nwidth_px = {}\nheight_px = {}\nmirrored = {}\nprojection = \"{}\"\nfocal_length_px = {:?}",
            camera.width_px,
            camera.height_px,
            camera.mirrored,
            camera.projection().name(),
            camera.focal_length_px()
        );
        if camera.max_angle_rad() < camera.projection().max_angle_rad() {
            let valid_to_deg = camera.max_angle_rad() * DEG_PER_RAD;
            let _ = writeln!(text, "valid_to_deg = {valid_to_deg:?}");
        }
        if let Some(distortion) = camera.distortion() {
            let _ = writeln!(
                text,
                "distortion = \"{}\"\nradius_px = {:?}\nterms_px = {:?}",
                distortion.model().name(),
                distortion.radius_px(),
                distortion.coefficients_px()
            );
        }
        text += "# Covariance matrix of ln(focal_length_px) and terms_px.\ncovariance = [\n";
        for row in self.covariance.row_iter() {
            let row: Vec<String> = row.iter().map(|value| format!("{value:e}")).collect();
            let _ = writeln!(text, "    [{}],", row.join(", "));
        }
        text + "]\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::UnitVector;
    use crate::camera::{Distortion, Projection};

    #[test]
    fn a_camera_that_sees_the_same_in_the_centre_has_a_like_attitude() {
        let model = DistortionModel::Radial5;
        let distortion = Distortion::new(model, 640.0, &[-12.5, 1.0 / 3.0]);
        let camera = CameraModel::pinhole(1024.0, 768.0, 700.1, true)
            .with_projection(Projection::Equisolid)
            .with_distortion(Some(distortion));
        let lens = KnownLens::with_assumed_errors(camera).unwrap();
        let other = CameraModel::pinhole(1024.0, 768.0, 700.0, true);
        let attitude = Rotation::looking_at(&UnitVector::from_ra_dec(1.0, 0.2), 0.7);
        let like = lens.attitude_like(&other, &attitude).unwrap();
        let centre = other.centre();
        let seen = |camera: &CameraModel, attitude: &Rotation<Icrs, Camera>| {
            attitude
                .inverse()
                .apply(&camera.direction_of(&centre).unwrap())
        };
        let apart = seen(&lens.camera, &like).angle_to(&seen(&other, &attitude));
        assert!(apart < 1e-12);
    }
}
