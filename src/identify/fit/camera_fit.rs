//! Joint fit of attitude, focal length and lens distortion to star positions in pixels.
//!
//! matched stars + first guess → Gauss-Newton on (turn about x, y, z; ln f; distortion) → camera,
//! attitude, covariance

use super::adjustment::{
    Adjustment, LINEAR_TERMS, MeasuredStar, POSE_PARAMETERS, Reduced, all_residuals_px,
};
use crate::base::coords::{Camera, Icrs, Rotation};
use crate::camera::{CUBIC_MONOMIALS, CameraModel, DistortionModel, QUINTIC_MONOMIALS};
use nalgebra::Matrix4;

/// Result of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraFit {
    /// The camera.
    pub camera: CameraModel,
    /// The attitude.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Covariance of the small rotation about the camera's x, y, z axes, in radians, and of
    /// ln(focal length), marginalised over the distortion, for the stated standard errors.
    pub covariance: Matrix4<f64>,
    /// Free parameters.
    pub parameters: usize,
}

const MAX_ITERATIONS: usize = 10;
/// The fit has converged below this step: the next would be about its square, far below centroid
/// errors.
const CONVERGED: f64 = 1e-5;

/// Fits attitude, focal length and, with a `model`, the distortion, starting from `camera` and
/// `icrs_to_camera`. Sets `residuals_px` to observed minus predicted position of each star along
/// the camera's axes, in pixels.
///
/// `None` if the stars do not determine the parameters (too few, or badly placed) or are behind the
/// camera.
pub fn fit_camera(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    model: Option<DistortionModel>,
    residuals_px: &mut Vec<[f64; 2]>,
) -> Option<CameraFit> {
    use DistortionModel::{BrownConrady, Cubic, Quintic, Radial, Radial5, Radial7};
    /// A fit whose numbers of distortion terms, shared by both axes and not, the compiler knows.
    macro_rules! fit {
        ($shared:expr, $monomials:expr) => {{
            const PARAMETERS: usize = POSE_PARAMETERS + $shared;
            Adjustment::<PARAMETERS, { $monomials }>::new(stars, camera, icrs_to_camera, model)?
                .fit(residuals_px)
        }};
    }
    match model {
        None => fit!(0, 0),
        Some(Radial) => fit!(Radial.terms(), 0),
        Some(Radial5) => fit!(Radial5.terms(), 0),
        Some(Radial7) => fit!(Radial7.terms(), 0),
        Some(BrownConrady) => fit!(BrownConrady.terms(), 0),
        Some(Cubic) => fit!(LINEAR_TERMS, CUBIC_MONOMIALS),
        Some(Quintic) => fit!(LINEAR_TERMS, QUINTIC_MONOMIALS),
    }
}

impl<const P: usize, const K: usize> Adjustment<'_, P, K> {
    fn fit(mut self, residuals_px: &mut Vec<[f64; 2]>) -> Option<CameraFit> {
        for _ in 0..MAX_ITERATIONS {
            let (size, reduced) = self.step()?;
            if size < CONVERGED {
                return self.finish(&reduced, residuals_px);
            }
        }
        None
    }

    fn finish(
        self,
        reduced: &Reduced<P, K>,
        residuals_px: &mut Vec<[f64; 2]>,
    ) -> Option<CameraFit> {
        all_residuals_px(&self, residuals_px)?;
        let covariance = reduced.root.inverse();
        Some(CameraFit {
            camera: self.camera,
            icrs_to_camera: self.icrs_to_camera,
            covariance: covariance.fixed_view::<4, 4>(0, 0).into_owned(),
            parameters: self.parameters(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, UnitVector};
    use crate::base::units::RAD_PER_DEG;
    use crate::camera::Distortion;
    use nalgebra::Vector3;

    /// Largest effect of stopping early: a thousandth of the best centroid error.
    const CONVERGED_PX: f64 = 1e-5;

    fn stars_of(camera: &CameraModel, attitude: &Rotation<Icrs, Camera>) -> Vec<MeasuredStar> {
        let mut stars = Vec::new();
        for column in 0..7 {
            for row in 0..6 {
                let pixel = PixelPoint::new(
                    20.0 + 160.0 * f64::from(column) + 7.0 * f64::from(row),
                    15.0 + 140.0 * f64::from(row) - 3.0 * f64::from(column),
                );
                stars.push(MeasuredStar {
                    pixel,
                    icrs: attitude.inverse().apply(&camera.direction_of(&pixel)),
                    sigma_px: 0.1,
                });
            }
        }
        stars
    }

    #[test]
    fn a_known_lens_is_found_again() {
        let truth = Rotation::looking_at(&UnitVector::from_ra_dec(0.3, 1.5), 2.0);
        for model in DistortionModel::LENSES {
            let coefficients = [6.0, -4.0, 3.0, 1.0, -2.0, 0.5, 1.5];
            let mut camera = CameraModel::pinhole(1024.0, 768.0, 2000.0, false);
            let distortion = Distortion::new(model, 640.0, &coefficients[..model.terms()]);
            camera.distortion = Some(distortion);
            let stars = stars_of(&camera, &truth);
            let start = CameraModel::pinhole(1024.0, 768.0, 2010.0, false);
            let mut residuals_px = Vec::new();
            let fit = fit_camera(&stars, &start, &truth, Some(model), &mut residuals_px).unwrap();
            let off_px = (fit.camera.focal_length_px - 2000.0).abs();
            assert!(off_px < 1e-4, "{model:?} {off_px}");
            let found = fit.camera.distortion.unwrap();
            for (found, expected) in found.coefficients_px().iter().zip(coefficients) {
                assert!(
                    (found - expected).abs() < 1e-4,
                    "{model:?} {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn a_known_camera_is_found_again() {
        for mirrored in [false, true] {
            let centre = UnitVector::from_ra_dec(0.3, 1.5);
            let truth = Rotation::looking_at(&centre, 2.0);
            let mut camera = CameraModel::pinhole(1024.0, 768.0, 2000.0, mirrored);
            let mut coefficients = vec![0.0; DistortionModel::Cubic.terms()];
            coefficients[0] = 0.7;
            coefficients[5] = -1.5;
            coefficients[11] = 4.0;
            camera.distortion = Some(Distortion::new(
                DistortionModel::Cubic,
                640.0,
                &coefficients,
            ));
            let stars = stars_of(&camera, &truth);
            let start = CameraModel::pinhole(1024.0, 768.0, 2020.0, mirrored);
            let turned = truth.then_turn(Vector3::new(0.002, -0.003, 0.001));
            let mut residuals_px = Vec::new();
            let cubic = Some(DistortionModel::Cubic);
            let fit = fit_camera(&stars, &start, &turned, cubic, &mut residuals_px).unwrap();
            let worst_px = residuals_px
                .iter()
                .flatten()
                .fold(0.0, |a: f64, r| a.max(r.abs()));
            assert!(worst_px < CONVERGED_PX, "{worst_px}");
            assert!((fit.camera.focal_length_px - 2000.0).abs() < 1e-6);
            assert!((fit.icrs_to_camera.matrix() - truth.matrix()).abs().max() < 1e-9);
        }
    }

    #[test]
    fn too_few_stars_give_none() {
        let camera = CameraModel::pinhole(1000.0, 1000.0, 3000.0, false);
        let truth = Rotation::looking_at(&UnitVector::from_ra_dec(0.0, 0.0), 10.0 * RAD_PER_DEG);
        let stars = stars_of(&camera, &truth);
        let fit = |count: usize, model| {
            fit_camera(&stars[..count], &camera, &truth, model, &mut Vec::new())
        };
        assert!(fit(1, None).is_none());
        assert!(fit(2, None).is_some());
        assert!(fit(9, Some(DistortionModel::Cubic)).is_none());
    }
}
