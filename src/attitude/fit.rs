//! Attitude, focal length and lens distortion, adjusted together to star positions in pixels.
//!
//! matched stars + first guess → Gauss-Newton on (turn about x, y, z; ln f; distortion) → camera, attitude, covariance
//!
//! In the ideal image plane, with (x, y) the tangent-plane coordinates of a star, f the focal length in
//! pixels and (u, v) the observed offset from the centre, each star gives two equations,
//! `f·x − u − Σ cₖ Bₖu(u, v) = 0` and the same in y; they are linear in the distortion cₖ and nearly so
//! in the small turn ω, since `dx = −ωx·x·y + ωy·(1 + x²) − ωz·y`, `dy = −ωx·(1 + y²) + ωy·x·y + ωz·x`.

use crate::camera::{CameraModel, Distortion, DistortionModel};
use crate::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix4, Vector3};

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
#[derive(Debug, Clone, PartialEq)]
pub struct CameraFit {
    /// The camera.
    pub camera: CameraModel,
    /// The attitude.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Covariance of the small turn about the camera's x, y, z axes in radians and of ln(focal length),
    /// the distortion marginalised, for the standard errors as given.
    pub covariance: Matrix4<f64>,
    /// Observed minus predicted position of each star along the camera's axes, in pixels.
    pub residuals_px: Vec<[f64; 2]>,
    /// Free parameters.
    pub parameters: usize,
}

/// Parameters without any distortion: turn about three axes, and ln f.
pub const POSE_PARAMETERS: usize = 4;
const MAX_ITERATIONS: usize = 10;
/// A step above this (radians) leads nowhere.
const LARGEST_STEP: f64 = 0.5;
/// The least share of an equation that may be left to its own residual when it is left out.
const MIN_FREEDOM: f64 = 1e-6;
/// After a step below this the next would be about its square: far below any centroid error.
const CONVERGED: f64 = 1e-5;

/// Fits attitude, focal length and, with a `model`, the distortion, starting from `camera` and `icrs_to_camera`.
///
/// `None` where the stars do not determine the parameters (too few, or in bad places) or are not in front of the camera.
pub fn fit_camera(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    model: Option<DistortionModel>,
) -> Option<CameraFit> {
    let mut adjustment = Adjustment::new(stars, camera, icrs_to_camera, model);
    if 2 * stars.len() < adjustment.equations.parameters {
        return None;
    }
    for _ in 0..MAX_ITERATIONS {
        let (size, normal) = adjustment.step()?;
        if size < CONVERGED {
            return adjustment.finish(&normal);
        }
    }
    None
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
    let mut adjustment = Adjustment::new(stars, camera, icrs_to_camera, model);
    let (_, normal) = adjustment.step()?;
    adjustment.left_out_chi_sq(&normal)
}

/// The normal equations' matrix, decomposed.
type Normal = Cholesky<f64, Dyn>;

struct Adjustment<'a> {
    stars: &'a [MeasuredStar],
    camera: CameraModel,
    icrs_to_camera: Rotation<Icrs, Camera>,
    model: Option<DistortionModel>,
    /// Two a star, divided by its standard error.
    equations: Equations,
}

/// Linear equations, of which each has coefficients for about half of the parameters.
struct Equations {
    parameters: usize,
    /// (parameter, coefficient) of one equation after the other.
    terms: Vec<(usize, f64)>,
    /// Where each equation's terms end.
    ends: Vec<usize>,
    rhs: Vec<f64>,
}

impl Equations {
    fn new(parameters: usize, count: usize) -> Self {
        Self {
            parameters,
            terms: Vec::with_capacity(count * parameters),
            ends: Vec::with_capacity(count),
            rhs: Vec::with_capacity(count),
        }
    }

    fn clear(&mut self) {
        self.terms.clear();
        self.ends.clear();
        self.rhs.clear();
    }

    fn term(&mut self, parameter: usize, coefficient: f64) {
        if coefficient != 0.0 {
            self.terms.push((parameter, coefficient));
        }
    }

    fn close(&mut self, rhs: f64) {
        self.ends.push(self.terms.len());
        self.rhs.push(rhs);
    }

    fn iter(&self) -> impl Iterator<Item = (&[(usize, f64)], f64)> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        let ranges = starts.zip(&self.ends);
        ranges
            .zip(&self.rhs)
            .map(|((start, &end), &rhs)| (&self.terms[start..end], rhs))
    }

    /// The normal equations: matrix and right-hand side.
    fn normal(&self) -> (DMatrix<f64>, DVector<f64>) {
        let size = self.parameters;
        let mut matrix = DMatrix::zeros(size, size);
        let by_column = matrix.as_mut_slice();
        let mut vector = DVector::zeros(self.parameters);
        for (terms, rhs) in self.iter() {
            for (done, &(column, a)) in terms.iter().enumerate() {
                vector[column] += a * rhs;
                let lower = &mut by_column[column * size..(column + 1) * size];
                for &(row, b) in &terms[done..] {
                    lower[row] += a * b;
                }
            }
        }
        // Terms come in ascending order, so that all of it is in the lower triangle.
        matrix.fill_upper_triangle_with_lower_triangle();
        (matrix, vector)
    }
}

impl<'a> Adjustment<'a> {
    fn new(
        stars: &'a [MeasuredStar],
        camera: &CameraModel,
        icrs_to_camera: &Rotation<Icrs, Camera>,
        model: Option<DistortionModel>,
    ) -> Self {
        let parameters = POSE_PARAMETERS + model.map_or(0, DistortionModel::terms);
        Self {
            stars,
            camera: camera.clone(),
            icrs_to_camera: *icrs_to_camera,
            model,
            equations: Equations::new(parameters, 2 * stars.len()),
        }
    }

    fn linearise(&mut self) -> Option<()> {
        let f = self.camera.focal_length_px;
        let radius_px = self.camera.radius_px();
        self.equations.clear();
        for star in self.stars {
            let direction = self.icrs_to_camera.apply(&star.icrs);
            let d = direction.as_vector();
            if d.z <= 0.0 {
                return None;
            }
            let (x, y) = (d.x / d.z, d.y / d.z);
            let [u, v] = self.camera.offset_of(&star.pixel);
            let weight = 1.0 / star.sigma_px;
            let rows = [
                ([-x * y, 1.0 + x * x, -y, x], u - f * x),
                ([-(1.0 + y * y), x * y, x, y], v - f * y),
            ];
            for (axis, (pose, rhs)) in rows.into_iter().enumerate() {
                for (parameter, value) in pose.into_iter().enumerate() {
                    self.equations.term(parameter, weight * f * value);
                }
                if let Some(model) = self.model {
                    let mut parameter = POSE_PARAMETERS;
                    model.for_each_term([u / radius_px, v / radius_px], |displacement| {
                        self.equations.term(parameter, -weight * displacement[axis]);
                        parameter += 1;
                    });
                }
                self.equations.close(weight * rhs);
            }
        }
        Some(())
    }

    /// One Gauss-Newton step; returns its size (radians, and relative change of the focal length) and the matrix
    /// that it was made with.
    fn step(&mut self) -> Option<(f64, Normal)> {
        self.linearise()?;
        let (matrix, vector) = self.equations.normal();
        let normal = matrix.cholesky()?;
        let solution = normal.solve(&vector);
        let turn = Vector3::new(solution[0], solution[1], solution[2]);
        let size = turn.norm().max(solution[3].abs());
        if size.is_nan() || size > LARGEST_STEP {
            return None;
        }
        self.icrs_to_camera = self.icrs_to_camera.then_turn(turn);
        self.camera.focal_length_px *= solution[3].exp();
        let radius_px = self.camera.radius_px();
        self.camera.distortion = self.model.map(|model| {
            let coefficients = solution.as_slice()[POSE_PARAMETERS..].to_vec();
            Distortion::new(model, radius_px, coefficients)
        });
        Some((size, normal))
    }

    fn finish(mut self, normal: &Normal) -> Option<CameraFit> {
        self.linearise()?;
        let covariance = normal.inverse();
        let residuals_px: Vec<[f64; 2]> = self
            .weighted_residuals()
            .chunks_exact(2)
            .zip(self.stars)
            .map(|(pair, star)| [pair[0] * star.sigma_px, pair[1] * star.sigma_px])
            .collect();
        Some(CameraFit {
            camera: self.camera,
            icrs_to_camera: self.icrs_to_camera,
            covariance: covariance.fixed_view::<4, 4>(0, 0).into_owned(),
            residuals_px,
            parameters: self.equations.parameters,
        })
    }

    /// At the solution the linear model's right-hand side is the residual plus the distortion part.
    fn weighted_residuals(&self) -> Vec<f64> {
        let distortion = self.camera.distortion.as_ref();
        let coefficients = distortion.map_or(&[][..], Distortion::coefficients_px);
        let of_distortion = |terms: &[(usize, f64)]| -> f64 {
            let is_distortion = |term: &&(usize, f64)| term.0 >= POSE_PARAMETERS;
            let distortion_terms = terms.iter().filter(is_distortion);
            distortion_terms
                .map(|&(parameter, a)| a * coefficients[parameter - POSE_PARAMETERS])
                .sum()
        };
        self.equations
            .iter()
            .map(|(terms, rhs)| rhs - of_distortion(terms))
            .collect()
    }

    fn left_out_chi_sq(&mut self, normal: &Normal) -> Option<f64> {
        self.linearise()?;
        let inverse = normal.inverse();
        let leverage = |terms: &[(usize, f64)]| -> f64 {
            let row = |column: usize| -> f64 {
                terms
                    .iter()
                    .map(|&(row, b)| inverse[(row, column)] * b)
                    .sum()
            };
            terms.iter().map(|&(column, a)| a * row(column)).sum()
        };
        let residuals = self.weighted_residuals();
        let mut sum = 0.0;
        for ((terms, _), residual) in self.equations.iter().zip(residuals) {
            sum += (residual / (1.0 - leverage(terms)).max(MIN_FREEDOM)).powi(2);
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
            camera.distortion = Some(Distortion::new(DistortionModel::Cubic, 640.0, coefficients));
            let stars = stars_of(&camera, &truth);
            let start = CameraModel::pinhole(1024.0, 768.0, 2020.0, mirrored);
            let turned = truth.then_turn(Vector3::new(0.002, -0.003, 0.001));
            let fit = fit_camera(&stars, &start, &turned, Some(DistortionModel::Cubic)).unwrap();
            let worst_px = fit
                .residuals_px
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
        assert!(fit_camera(&stars[..1], &camera, &truth, None).is_none());
        assert!(fit_camera(&stars[..2], &camera, &truth, None).is_some());
        let cubic = Some(DistortionModel::Cubic);
        assert!(fit_camera(&stars[..9], &camera, &truth, cubic).is_none());
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
        let fits: Vec<CameraFit> = models
            .into_iter()
            .map(|model| fit_camera(&stars, &camera, &truth, model).unwrap())
            .collect();
        let [simple, rich] = [0, 1].map(|i| {
            let residuals = fits[i].residuals_px.iter().flatten();
            (
                residuals.map(|r| (r / 0.1).powi(2)).sum::<f64>(),
                left_out_chi_sq(&stars, &camera, &truth, models[i]).unwrap(),
            )
        });
        assert!(rich.0 < simple.0);
        assert!(rich.1 > simple.1);
    }
}
