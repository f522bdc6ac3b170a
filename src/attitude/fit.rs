//! Attitude, focal length and lens distortion, adjusted together to star positions in pixels.
//!
//! matched stars + first guess → Gauss-Newton on (turn about x, y, z; ln f; distortion) → camera, attitude, covariance
//!
//! In the ideal image plane, with (x, y) the tangent-plane coordinates of a star, f the focal length in
//! pixels and (u, v) the observed offset from the centre, each star gives two equations,
//! `f·x − u − Σ cₖ Bₖu(u, v) = 0` and the same in y; they are linear in the distortion cₖ and nearly so
//! in the small turn ω, since `dx = −ωx·x·y + ωy·(1 + x²) − ωz·y`, `dy = −ωx·(1 + y²) + ωy·x·y + ωz·x`.

use crate::camera::{
    CUBIC_MONOMIALS, CameraModel, Distortion, DistortionModel, QUINTIC_MONOMIALS, monomials,
};
use crate::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use nalgebra::{Cholesky, Const, Matrix4, SMatrix, SVector, Vector3};

/// A star whose place on the sky is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredStar {
    /// Its centroid.
    pub pixel: PixelPoint,
    /// Its catalogue direction at the time of the frame.
    pub icrs: UnitVector<Icrs>,
    /// Standard error of the measured position on each axis, in pixels.
    pub sigma_px: f64,
}

/// The camera and the attitude that fit best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraFit {
    /// The camera.
    pub camera: CameraModel,
    /// The attitude.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Covariance of the small turn about the camera's x, y, z axes in radians and of ln(focal length),
    /// the distortion marginalised, for the standard errors as given.
    pub covariance: Matrix4<f64>,
    /// Free parameters.
    pub parameters: usize,
}

/// Parameters without any distortion: turn about three axes, and ln f.
pub const POSE_PARAMETERS: usize = 4;
/// These, and the one term of a radial distortion.
const RADIAL_PARAMETERS: usize = POSE_PARAMETERS + 1;
/// These, and the two linear terms of a polynomial.
const LINEAR_PARAMETERS: usize = POSE_PARAMETERS + 2;
const MAX_ITERATIONS: usize = 10;
/// A step above this (radians) leads nowhere.
const LARGEST_STEP: f64 = 0.5;
/// The least share of an equation that may be left to its own residual when it is left out.
const MIN_FREEDOM: f64 = 1e-6;
/// After a step below this the next would be about its square: far below any centroid error.
const CONVERGED: f64 = 1e-5;

/// Fits attitude, focal length and, with a `model`, the distortion, starting from `camera` and `icrs_to_camera`. Then
/// `residuals_px` are observed minus predicted position of each star along the camera's axes, in pixels.
///
/// `None` where the stars do not determine the parameters (too few, or in bad places) or are not in front of the camera.
pub fn fit_camera(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    model: Option<DistortionModel>,
    residuals_px: &mut Vec<[f64; 2]>,
) -> Option<CameraFit> {
    let at = (camera, icrs_to_camera);
    match model {
        None => Adjustment::<POSE_PARAMETERS, 0>::new(stars, at, None)?.fit(residuals_px),
        Some(DistortionModel::Radial) => {
            Adjustment::<RADIAL_PARAMETERS, 0>::new(stars, at, model)?.fit(residuals_px)
        }
        Some(DistortionModel::Cubic) => {
            Adjustment::<LINEAR_PARAMETERS, CUBIC_MONOMIALS>::new(stars, at, model)?
                .fit(residuals_px)
        }
        Some(DistortionModel::Quintic) => {
            Adjustment::<LINEAR_PARAMETERS, QUINTIC_MONOMIALS>::new(stars, at, model)?
                .fit(residuals_px)
        }
    }
}

/// Σ (residual / σ)² with each equation predicted by a fit of `model` to the others: it rises where a model has too
/// much freedom. `camera` and `icrs_to_camera` must be close to the best ones.
///
/// `None` where the stars do not determine the parameters.
pub fn left_out_chi_sq(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    model: Option<DistortionModel>,
) -> Option<f64> {
    let at = (camera, icrs_to_camera);
    match model {
        None => Adjustment::<POSE_PARAMETERS, 0>::new(stars, at, None)?.left_out_chi_sq(),
        Some(DistortionModel::Radial) => {
            Adjustment::<RADIAL_PARAMETERS, 0>::new(stars, at, model)?.left_out_chi_sq()
        }
        Some(DistortionModel::Cubic) => {
            Adjustment::<LINEAR_PARAMETERS, CUBIC_MONOMIALS>::new(stars, at, model)?
                .left_out_chi_sq()
        }
        Some(DistortionModel::Quintic) => {
            Adjustment::<LINEAR_PARAMETERS, QUINTIC_MONOMIALS>::new(stars, at, model)?
                .left_out_chi_sq()
        }
    }
}

/// An adjustment of `P` parameters that both equations of a star have, and of `K` coefficients of monomials in each.
///
/// The monomials and their weights are the same in the equations along x and along y, and do not change with the pose. So the
/// normal matrix is one of blocks, `[A Bₓ Bᵧ; Bₓᵀ C 0; Bᵧᵀ 0 C]`, of which C is decomposed once, and the rest is
/// `S = A − Bₓ C⁻¹ Bₓᵀ − Bᵧ C⁻¹ Bᵧᵀ`.
struct Adjustment<'a, const P: usize, const K: usize> {
    stars: &'a [MeasuredStar],
    camera: CameraModel,
    icrs_to_camera: Rotation<Icrs, Camera>,
    model: Option<DistortionModel>,
    radius_px: f64,
    /// L⁻¹ of C = L Lᵀ.
    inverse_root: SMatrix<f64, K, K>,
}

/// The two equations of one star, divided by its standard error, without what the monomials add.
struct Rows<const P: usize, const K: usize> {
    /// Along x and y.
    common: [SVector<f64, P>; 2],
    /// The coefficients of the monomials, the same along x and y.
    monomials: SVector<f64, K>,
    rhs: [f64; 2],
}

/// The normal equations, solved in part.
struct Reduced<const P: usize, const K: usize> {
    /// S, decomposed.
    root: Cholesky<f64, Const<P>>,
    /// L⁻¹ Bᵀ along x and y.
    coupling: [SMatrix<f64, K, P>; 2],
}

impl<'a, const P: usize, const K: usize> Adjustment<'a, P, K> {
    fn new(
        stars: &'a [MeasuredStar],
        (camera, icrs_to_camera): (&CameraModel, &Rotation<Icrs, Camera>),
        model: Option<DistortionModel>,
    ) -> Option<Self> {
        if 2 * stars.len() < P + 2 * K {
            return None;
        }
        let mut adjustment = Self {
            stars,
            camera: *camera,
            icrs_to_camera: *icrs_to_camera,
            model,
            radius_px: camera.radius_px(),
            inverse_root: SMatrix::identity(),
        };
        if K > 0 {
            let mut shared = SMatrix::<f64, K, K>::zeros();
            for star in stars {
                let monomials = adjustment.weighted_monomials(star);
                shared.syger(1.0, &monomials, &monomials, 1.0);
            }
            let root = shared.cholesky()?;
            root.l_dirty()
                .solve_lower_triangular_mut(&mut adjustment.inverse_root);
        }
        Some(adjustment)
    }

    fn parameters(&self) -> usize {
        P + 2 * K
    }

    fn normalised(&self, star: &MeasuredStar) -> [f64; 2] {
        let [u, v] = self.camera.offset_of(&star.pixel);
        [u / self.radius_px, v / self.radius_px]
    }

    fn weighted_monomials(&self, star: &MeasuredStar) -> SVector<f64, K> {
        SVector::from(monomials::<K>(self.normalised(star))) * (-1.0 / star.sigma_px)
    }

    /// Tangent-plane coordinates of a star, `None` behind the camera.
    fn tangent(&self, star: &MeasuredStar) -> Option<[f64; 2]> {
        let direction = self.icrs_to_camera.apply(&star.icrs);
        let d = direction.as_vector();
        (d.z > 0.0).then(|| [d.x / d.z, d.y / d.z])
    }

    fn rows(&self, star: &MeasuredStar) -> Option<Rows<P, K>> {
        let f = self.camera.focal_length_px;
        let [x, y] = self.tangent(star)?;
        let offset = self.camera.offset_of(&star.pixel);
        let [u, v] = self.normalised(star);
        let weight = 1.0 / star.sigma_px;
        let pose = [[-x * y, 1.0 + x * x, -y, x], [-(1.0 + y * y), x * y, x, y]];
        let r_sq = u * u + v * v;
        // The terms of the distortion that are no monomials along one axis.
        let terms = match self.model {
            None => [[0.0; 2]; 2],
            Some(DistortionModel::Radial) => [[u * r_sq, 0.0], [v * r_sq, 0.0]],
            Some(_) => [[u, v], [-v, u]],
        };
        let common = |axis: usize| {
            SVector::from_fn(
                |parameter: usize, _| match parameter.checked_sub(POSE_PARAMETERS) {
                    None => weight * f * pose[axis][parameter],
                    Some(term) => -weight * terms[axis][term],
                },
            )
        };
        Some(Rows {
            common: [common(0), common(1)],
            monomials: self.weighted_monomials(star),
            rhs: [weight * (offset[0] - f * x), weight * (offset[1] - f * y)],
        })
    }

    /// One Gauss-Newton step; returns its size (radians, and relative change of the focal length) and the normal equations
    /// that it was made with.
    fn step(&mut self) -> Option<(f64, Reduced<P, K>)> {
        let mut block = SMatrix::<f64, P, P>::zeros();
        let mut vector = SVector::<f64, P>::zeros();
        let mut coupling = [SMatrix::<f64, K, P>::zeros(); 2];
        let mut vectors = [SVector::<f64, K>::zeros(); 2];
        for star in self.stars {
            let rows = self.rows(star)?;
            for axis in 0..2 {
                let (common, rhs) = (&rows.common[axis], rows.rhs[axis]);
                block.ger(1.0, common, common, 1.0);
                vector.axpy(rhs, common, 1.0);
                coupling[axis].ger(1.0, &rows.monomials, common, 1.0);
                vectors[axis].axpy(rhs, &rows.monomials, 1.0);
            }
        }
        for axis in 0..2 {
            coupling[axis] = self.inverse_root * coupling[axis];
            vectors[axis] = self.inverse_root * vectors[axis];
            block -= coupling[axis].tr_mul(&coupling[axis]);
            vector -= coupling[axis].tr_mul(&vectors[axis]);
        }
        let root = block.cholesky()?;
        let common = root.solve(&vector);
        let turn = Vector3::new(common[0], common[1], common[2]);
        let size = turn.norm().max(common[3].abs());
        if size.is_nan() || size > LARGEST_STEP {
            return None;
        }
        let of_monomials = [0, 1].map(|axis: usize| {
            self.inverse_root
                .tr_mul(&(vectors[axis] - coupling[axis] * common))
        });
        self.icrs_to_camera = self.icrs_to_camera.then_turn(turn);
        self.camera.focal_length_px *= common[3].exp();
        self.camera.distortion = self.model.map(|model| {
            let mut coefficients = [0.0; DistortionModel::Quintic.terms()];
            coefficients[..P - POSE_PARAMETERS]
                .copy_from_slice(&common.as_slice()[POSE_PARAMETERS..]);
            for (k, pair) in coefficients[P - POSE_PARAMETERS..]
                .as_chunks_mut()
                .0
                .iter_mut()
                .take(K)
                .enumerate()
            {
                *pair = [of_monomials[0][k], of_monomials[1][k]];
            }
            Distortion::new(model, self.radius_px, &coefficients[..model.terms()])
        });
        Some((size, Reduced { root, coupling }))
    }

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
        residuals_px.clear();
        for star in self.stars {
            residuals_px.push(self.residual_px(star)?);
        }
        let covariance = reduced.root.inverse();
        Some(CameraFit {
            camera: self.camera,
            icrs_to_camera: self.icrs_to_camera,
            covariance: covariance.fixed_view::<4, 4>(0, 0).into_owned(),
            parameters: self.parameters(),
        })
    }

    /// Where a pinhole would have put the star, less where it puts its direction.
    fn residual_px(&self, star: &MeasuredStar) -> Option<[f64; 2]> {
        let f = self.camera.focal_length_px;
        let [x, y] = self.tangent(star)?;
        let [u, v] = self.camera.ideal_offset_of(&star.pixel);
        Some([u - f * x, v - f * y])
    }

    fn left_out_chi_sq(mut self) -> Option<f64> {
        let (_, reduced) = self.step()?;
        let mut sum = 0.0;
        for star in self.stars {
            let rows = self.rows(star)?;
            let residual_px = self.residual_px(star)?;
            let of_monomials = self.inverse_root * rows.monomials;
            for (axis, residual_px) in residual_px.into_iter().enumerate() {
                let mut rest = rows.common[axis] - reduced.coupling[axis].tr_mul(&of_monomials);
                reduced.root.l_dirty().solve_lower_triangular_mut(&mut rest);
                let leverage = of_monomials.norm_squared() + rest.norm_squared();
                let residual = residual_px / star.sigma_px;
                sum += (residual / (1.0 - leverage).max(MIN_FREEDOM)).powi(2);
            }
        }
        Some(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::RAD_PER_DEG;

    /// What stopping early may leave: a thousandth of the best centroid.
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

    fn chi_sq(residuals_px: &[[f64; 2]]) -> f64 {
        let residuals = residuals_px.iter().flatten();
        residuals.map(|r| (r / 0.1).powi(2)).sum()
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

    #[test]
    fn too_much_freedom_shows_in_the_left_out_residuals() {
        let camera = CameraModel::pinhole(1024.0, 768.0, 2000.0, false);
        let truth = Rotation::looking_at(&UnitVector::from_ra_dec(0.0, 0.5), 0.0);
        let mut stars = stars_of(&camera, &truth);
        for (i, star) in stars.iter_mut().enumerate() {
            let phase = (i * i * 7 % 31) as f64;
            star.pixel.x += 0.1 * phase.sin();
            star.pixel.y += 0.1 * (phase * 1.7).cos();
        }
        let models = [None, Some(DistortionModel::Quintic)];
        let [simple, rich] = models.map(|model| {
            let mut residuals_px = Vec::new();
            fit_camera(&stars, &camera, &truth, model, &mut residuals_px).unwrap();
            (
                chi_sq(&residuals_px),
                left_out_chi_sq(&stars, &camera, &truth, model).unwrap(),
            )
        });
        assert!(rich.0 < simple.0);
        assert!(rich.1 > simple.1);
    }
}
