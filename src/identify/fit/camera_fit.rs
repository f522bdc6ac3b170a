//! Joint fit of attitude, focal length and lens distortion to star positions in pixels.
//!
//! matched stars + first guess → Gauss-Newton on (turn about x, y, z; ln f; distortion) → camera,
//! attitude, covariance

use super::adjustment::{AXIS, Adjustment, LENS_PARAMETERS, MeasuredStar, Normal, POSE_PARAMETERS};
use crate::base::coords::{Camera, Icrs, Rotation, small_turn_rad};
use crate::camera::{CameraModel, Distortion, DistortionModel, KnownLens};
use nalgebra::{Matrix4, SMatrix, Vector4};

/// Result of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraFit {
    /// The camera.
    pub camera: CameraModel,
    /// The attitude.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Covariance of the small rotation about the camera's x, y, z axes, in radians, and of the
    /// logarithm of the central focal length, marginalised over the distortion, for the stated
    /// standard errors.
    pub covariance: Matrix4<f64>,
    /// Standard errors of where the axis of the lens meets the frame, in pixels; 0 where that is not fitted.
    pub axis_sigma_px: [f64; 2],
    /// Free parameters.
    pub parameters: usize,
    /// Number of stars.
    pub stars: usize,
}

/// The fit has converged where a step moves the predicted places by less than this, in standard errors.
const CONVERGED: f64 = 1e-3;

/// Fits attitude, focal length and, with a `model`, the distortion, starting from `camera` and
/// `icrs_to_camera`; the projection stays. Sets `residuals_px` to observed minus predicted position of
/// each star along the camera's axes, in pixels.
///
/// `None` if the stars do not determine the parameters (too few, or badly placed) or are not imaged.
pub fn fit_camera(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    model: Option<DistortionModel>,
    residuals_px: &mut Vec<[f64; 2]>,
) -> Option<CameraFit> {
    use DistortionModel::{
        BrownConrady, Irregular3, Irregular5, Radial, Radial5, Radial7, Stretched,
    };
    /// An adjustment whose number of terms the compiler knows.
    macro_rules! adjustment {
        ($model:expr, $camera:expr, $attitude:expr) => {
            Adjustment::<{ POSE_PARAMETERS + $model.terms() }>::new(
                stars,
                $camera,
                $attitude,
                Some($model),
            )
        };
    }
    /// A fit from the camera that is given.
    macro_rules! fit {
        ($model:expr) => {
            adjustment!($model, camera, icrs_to_camera).fit(residuals_px)
        };
    }
    if 2 * stars.len() < POSE_PARAMETERS + model.map_or(0, DistortionModel::terms) {
        return None;
    }
    match model {
        None => Adjustment::<POSE_PARAMETERS>::new(stars, camera, icrs_to_camera, None)
            .fit(residuals_px),
        Some(Radial) => fit!(Radial),
        Some(Radial5) => fit!(Radial5),
        Some(Radial7) => fit!(Radial7),
        Some(BrownConrady) => fit!(BrownConrady),
        Some(Stretched) => fit!(Stretched),
        Some(irregular @ (Irregular3 | Irregular5)) => {
            let (camera, icrs_to_camera, axis_sigma_px) = match fit!(Stretched) {
                Some(lens) => (lens.camera, lens.icrs_to_camera, lens.axis_sigma_px),
                None => (*camera, *icrs_to_camera, [0.0; 2]),
            };
            if irregular == Irregular3 {
                let cubic = adjustment!(Irregular3, &camera, &icrs_to_camera);
                cubic.with_known_axis(axis_sigma_px).fit(residuals_px)
            } else {
                let quintic = adjustment!(Irregular5, &camera, &icrs_to_camera);
                quintic.with_known_axis(axis_sigma_px).fit(residuals_px)
            }
        }
    }
}

/// Fits the attitude and a lens that is no pinhole with all terms of lenses, from `camera` on, whose terms are those
/// that the stars show: of the others is known what lenses are like. A lens's axis is where these terms put it, so
/// without them too small an error of the attitude would be stated. Sets `residuals_px` as [`fit_camera`]; `None` for the
/// same reasons.
pub(super) fn fit_with_unshown_terms(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    residuals_px: &mut Vec<[f64; 2]>,
) -> Option<CameraFit> {
    let all = Some(DistortionModel::Stretched);
    let shown = camera.distortion_model().map_or(0, DistortionModel::terms);
    let fit = Adjustment::<LENS_PARAMETERS>::new(stars, camera, icrs_to_camera, all)
        .with_unshown_terms(shown)
        .fit(residuals_px)?;
    Some(CameraFit {
        // The others use up no star.
        parameters: POSE_PARAMETERS + shown,
        ..fit
    })
}

/// Fits the attitude, and a lens that is known but for its errors, starting from `icrs_to_camera`. Sets
/// `residuals_px` as [`fit_camera`]; `None` for the same reasons.
pub fn fit_known_lens(
    stars: &[MeasuredStar],
    lens: &KnownLens,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    residuals_px: &mut Vec<[f64; 2]>,
) -> Option<CameraFit> {
    use DistortionModel::{
        BrownConrady, Irregular3, Irregular5, Radial, Radial5, Radial7, Stretched,
    };
    let (camera, information) = (lens.camera(), lens.information());
    macro_rules! fit {
        ($terms:expr) => {
            Adjustment::<{ POSE_PARAMETERS + $terms }>::new(
                stars,
                camera,
                icrs_to_camera,
                camera.distortion_model(),
            )
            .with_known_lens(camera, information)
            .fit(residuals_px)
        };
    }
    let fit = match camera.distortion_model() {
        None => fit!(0),
        Some(Radial) => fit!(Radial.terms()),
        Some(Radial5) => fit!(Radial5.terms()),
        Some(Radial7) => fit!(Radial7.terms()),
        Some(BrownConrady) => fit!(BrownConrady.terms()),
        Some(Stretched) => fit!(Stretched.terms()),
        Some(Irregular3) => fit!(Irregular3.terms()),
        Some(Irregular5) => fit!(Irregular5.terms()),
    }?;
    Some(CameraFit {
        // No star is used up by the lens.
        parameters: POSE_PARAMETERS,
        ..fit
    })
}

impl<const P: usize> Adjustment<'_, P> {
    fn fit(mut self, residuals_px: &mut Vec<[f64; 2]>) -> Option<CameraFit> {
        let normal = self.converge(CONVERGED)?;
        self.finish(&normal, residuals_px)
    }

    fn finish(self, normal: &Normal<P>, residuals_px: &mut Vec<[f64; 2]>) -> Option<CameraFit> {
        residuals_px.clear();
        for star in self.stars {
            residuals_px.push(self.predictor.residual_px(star)?);
        }
        let by_parameters = central_pose_by_parameters::<P>(self.camera());
        let of_all = normal.root.inverse();
        let covariance = by_parameters * of_all * by_parameters.transpose();
        let axis_sigma_px = [0, 1].map(|along| {
            let parameter = POSE_PARAMETERS + AXIS + along;
            of_all.get((parameter, parameter)).map_or(0.0, |v| v.sqrt())
        });
        Some(CameraFit {
            camera: *self.camera(),
            icrs_to_camera: self.icrs_to_camera(),
            covariance,
            axis_sigma_px,
            parameters: P,
            stars: self.stars.len(),
        })
    }
}

/// Derivatives of the attitude of the camera's axes, as small rotations, and of the logarithm of the
/// central focal length, by the parameters of the fit: the attitude of the lens's axes, ln f and the
/// terms of the distortion.
fn central_pose_by_parameters<const P: usize>(camera: &CameraModel) -> SMatrix<f64, 4, P> {
    let mut by_parameters = SMatrix::zeros();
    for i in 0..POSE_PARAMETERS {
        by_parameters[(i, i)] = 1.0;
    }
    let Some(distortion) = camera.distortion() else {
        return by_parameters;
    };
    if !camera.is_pinhole() || distortion.model() < DistortionModel::BrownConrady {
        return by_parameters;
    }
    by_parameters
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&camera.lens_axes().transpose());
    for parameter in POSE_PARAMETERS - 1..P {
        let by_parameter = central_pose_by_parameter(camera, distortion, parameter);
        by_parameters.set_column(parameter, &by_parameter);
    }
    by_parameters
}

/// The derivatives by one parameter of the lens.
fn central_pose_by_parameter(
    camera: &CameraModel,
    distortion: &Distortion,
    parameter: usize,
) -> Vector4<f64> {
    /// Steps of the numerical derivatives: of ln f, and of terms in units of R.
    const STEP: f64 = 1e-5;
    let step = match parameter.checked_sub(POSE_PARAMETERS) {
        None => STEP,
        Some(_) => STEP * distortion.radius_px(),
    };
    let moved = with_step(camera, distortion, parameter, step);
    // The lens's axes stay, so the camera's turn the other way.
    let turn = camera.lens_axes().tr_mul(&moved.lens_axes());
    let turn_rad = small_turn_rad(&turn.transpose());
    let ln_central = libm::log(camera.central_focal_length_px());
    let ln_ratio = libm::log(moved.central_focal_length_px()) - ln_central;
    turn_rad.push(ln_ratio) / step
}

/// `camera` with a parameter of the lens changed.
fn with_step(
    camera: &CameraModel,
    distortion: &Distortion,
    parameter: usize,
    step: f64,
) -> CameraModel {
    let Some(term) = parameter.checked_sub(POSE_PARAMETERS) else {
        return camera.with_focal_length(camera.focal_length_px() * libm::exp(step));
    };
    let changes = std::iter::repeat_n(0.0, term).chain([step]);
    camera.with_distortion(Some(distortion.changed(changes)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, UnitVector};
    use crate::base::units::RAD_PER_DEG;
    use crate::camera::Projection;
    use nalgebra::{DMatrix, DVector, Vector3};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

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
                    icrs: attitude
                        .inverse()
                        .apply(&camera.direction_of(&pixel).unwrap()),
                    sigma_px: 0.1,
                });
            }
        }
        stars
    }

    fn lens(model: DistortionModel, mirrored: bool) -> CameraModel {
        let lens = [-16.0, -4.0, 3.0, 21.0, -12.0, 0.5, 1.5, 2.0, -1.0];
        let others = (0..36).map(|i| 0.3 - 0.1 * f64::from(i % 7));
        let coefficients: Vec<f64> = lens.into_iter().chain(others).collect();
        let camera = CameraModel::pinhole(1024.0, 768.0, 2000.0, mirrored);
        let of_model = &coefficients[..model.terms()];
        camera.with_distortion(Some(Distortion::new(model, camera.radius_px(), of_model)))
    }

    #[test]
    fn a_known_lens_is_found_again() {
        let truth = Rotation::looking_at(&UnitVector::from_ra_dec(0.3, 1.5), 2.0);
        for (model, mirrored) in DistortionModel::ALL
            .into_iter()
            .zip([false, true].into_iter().cycle())
        {
            let camera = lens(model, mirrored);
            let stars = stars_of(&camera, &truth);
            let start = CameraModel::pinhole(1024.0, 768.0, 2010.0, mirrored);
            let turned = truth.then_turn(Vector3::new(0.002, -0.003, 0.001));
            let mut residuals_px = Vec::new();
            let fit = fit_camera(&stars, &start, &turned, Some(model), &mut residuals_px).unwrap();
            let worst_px = residuals_px.iter().flatten();
            let worst_px = worst_px.fold(0.0, |a: f64, r| a.max(r.abs()));
            // Monomials take the place of an axis that is not quite found.
            let most_px = if model >= DistortionModel::Irregular3 {
                0.01
            } else {
                1e-3
            };
            assert!(worst_px < most_px, "{model:?} {worst_px}");
            let found_px = fit.camera.central_focal_length_px();
            let off = found_px / camera.central_focal_length_px() - 1.0;
            assert!(off.abs() < 2e-5, "{model:?} {off}");
            let off_rad = (fit.icrs_to_camera.matrix() - truth.matrix()).abs().max();
            assert!(off_rad < 2e-5, "{model:?} {off_rad}");
        }
    }

    #[test]
    fn a_fisheye_is_found_again() {
        let truth = Rotation::looking_at(&UnitVector::from_ra_dec(0.3, 0.7), 2.0);
        for projection in Projection::ALL.into_iter().skip(1) {
            let model = DistortionModel::BrownConrady;
            let coefficients = [-16.0, 4.0, -3.0, 11.0, -8.0, 0.5, 1.5];
            let camera =
                CameraModel::pinhole(1024.0, 768.0, 700.0, false).with_projection(projection);
            let distortion = Distortion::new(model, camera.radius_px(), &coefficients);
            let stars = stars_of(&camera.with_distortion(Some(distortion)), &truth);
            let start = camera.with_focal_length(703.0);
            let turned = truth.then_turn(Vector3::new(0.002, -0.003, 0.001));
            let mut residuals_px = Vec::new();
            fit_camera(&stars, &start, &turned, Some(model), &mut residuals_px).unwrap();
            let worst_px = residuals_px.iter().flatten();
            let worst_px = worst_px.fold(0.0, |a: f64, r| a.max(r.abs()));
            assert!(worst_px < 1e-2, "{projection:?} {worst_px}");
        }
    }

    #[test]
    fn errors_are_as_stated_with_the_axis_anywhere() {
        const TRIALS: u32 = 200;
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let truth = Rotation::looking_at(&UnitVector::from_ra_dec(0.3, 0.5), 2.0);
        for model in [DistortionModel::BrownConrady, DistortionModel::Stretched] {
            let camera = lens(model, false);
            let exact = stars_of(&camera, &truth);
            let (mut nees, mut focal_sq) = (0.0, 0.0);
            for _ in 0..TRIALS {
                let mut stars = exact.clone();
                for star in &mut stars {
                    star.pixel.x += star.sigma_px * rng.sample::<f64, _>(StandardNormal);
                    star.pixel.y += star.sigma_px * rng.sample::<f64, _>(StandardNormal);
                }
                let mut residuals_px = Vec::new();
                let fit = fit_camera(&stars, &camera, &truth, Some(model), &mut residuals_px);
                let fit = fit.unwrap();
                let turn = fit.icrs_to_camera.matrix() * truth.matrix().transpose();
                let half = (turn - turn.transpose()) * 0.5;
                let error = Vector3::new(half[(2, 1)], half[(0, 2)], half[(1, 0)]);
                let covariance = fit.covariance.fixed_view::<3, 3>(0, 0).into_owned();
                let inverse = covariance.try_inverse().unwrap();
                nees += (error.transpose() * inverse * error)[0] / 3.0 / f64::from(TRIALS);
                let ratio = fit.camera.central_focal_length_px() / camera.central_focal_length_px();
                focal_sq += ratio.ln().powi(2) / fit.covariance[(3, 3)] / f64::from(TRIALS);
            }
            // Standard errors of 6 % and 10 %.
            assert!((nees - 1.0).abs() < 0.2, "{model:?} {nees}");
            assert!((focal_sq - 1.0).abs() < 0.3, "{model:?} {focal_sq}");
        }
    }

    #[test]
    fn four_stars_are_enough_for_a_known_lens_and_its_error_is_in_the_attitudes() {
        const TRIALS: u32 = 300;
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let truth = Rotation::looking_at(&UnitVector::from_ra_dec(0.3, 0.5), 2.0);
        let camera = lens(DistortionModel::BrownConrady, true);
        let terms = camera.distortion().unwrap();
        // Errors of ln f and of the terms.
        let sigma = [3e-4, 0.3, 0.2, 0.1, 0.6, 0.5, 0.05, 0.05];
        let covariance = DMatrix::from_diagonal(&DVector::from_iterator(8, sigma.map(|s| s * s)));
        let exact = stars_of(&camera, &truth);
        let mut nees = 0.0;
        for _ in 0..TRIALS {
            let mut deviate = |sigma: f64| sigma * rng.sample::<f64, _>(StandardNormal);
            let off = sigma.map(&mut deviate);
            let stated = terms.changed(off[1..].iter().copied());
            let stated = camera
                .with_focal_length(camera.focal_length_px() * off[0].exp())
                .with_distortion(Some(stated));
            let known = KnownLens::new(stated, covariance.clone()).unwrap();
            let mut stars: Vec<MeasuredStar> = exact.iter().step_by(11).copied().collect();
            for star in &mut stars {
                star.pixel.x += deviate(star.sigma_px);
                star.pixel.y += deviate(star.sigma_px);
            }
            let turned = truth.then_turn(Vector3::new(0.002, -0.003, 0.001));
            let fit = fit_known_lens(&stars, &known, &turned, &mut Vec::new()).unwrap();
            let turn = fit.icrs_to_camera.matrix() * truth.matrix().transpose();
            let half = (turn - turn.transpose()) * 0.5;
            let error = Vector3::new(half[(2, 1)], half[(0, 2)], half[(1, 0)]);
            let inverse = fit
                .covariance
                .fixed_view::<3, 3>(0, 0)
                .try_inverse()
                .unwrap();
            nees += (error.transpose() * inverse * error)[0] / f64::from(TRIALS);
        }
        // A standard error of 0.14.
        assert!((nees - 3.0).abs() < 0.5, "{nees}");
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
        assert!(fit(6, Some(DistortionModel::Stretched)).is_none());
    }
}
