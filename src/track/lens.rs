//! Focal length and distortion, refined from frame to frame.
//!
//! The stars of a frame give equations for its attitude and for the camera, those of
//! `identify::fit`. The attitude is eliminated; what is left is information about the focal
//! length and the coefficients of the distortion, which is summed over the frames: the result is the
//! mean of all frames weighted by their information. Old frames are forgotten slowly, as a camera
//! changes with its temperature.

use crate::base::coords::{Camera, Icrs, Rotation};
use crate::camera::{CameraModel, DistortionModel};
use crate::identify::fit::{MeasuredStar, PositionPredictor, PredictedPosition};
use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Vector3};

/// Parameters of the attitude.
const ATTITUDE: usize = 3;
/// Steps after which a frame has a third of the weight of a new one.
const MEMORY: f64 = 1000.0;
/// Standard error of the logarithm of a focal length of which nothing is known.
const UNKNOWN_LN_FOCAL: f64 = 0.1;
/// Standard error of a coefficient of the distortion of which nothing is known, in pixels.
const UNKNOWN_PX: f64 = 10.0;
/// A step of the logarithm of the focal length above this is none of refinement.
const MAX_STEP: f64 = 0.02;

/// Refines a camera. Nothing is allocated after its start.
#[derive(Debug, Clone)]
pub(super) struct LensRefiner {
    camera: CameraModel,
    focal_sigma_px: f64,
    /// About ln f and the coefficients, at the present camera.
    information: DMatrix<f64>,
    /// The normal equations of a frame: the attitude first.
    normal: DMatrix<f64>,
    right: DVector<f64>,
    /// One equation.
    row: DVector<f64>,
    scratch: DMatrix<f64>,
    step: DVector<f64>,
}

impl LensRefiner {
    /// Begins with a camera, of whose parameters nothing is taken as known.
    pub fn new(camera: CameraModel) -> Self {
        let terms = camera.distortion_model().map_or(0, DistortionModel::terms);
        let count = 1 + terms;
        let mut information = DMatrix::identity(count, count) * UNKNOWN_PX.powi(-2);
        information[(0, 0)] = UNKNOWN_LN_FOCAL.powi(-2);
        let all = ATTITUDE + count;
        Self {
            camera,
            focal_sigma_px: UNKNOWN_LN_FOCAL * camera.focal_length_px(),
            information,
            normal: DMatrix::zeros(all, all),
            right: DVector::zeros(all),
            row: DVector::zeros(all),
            scratch: DMatrix::zeros(count, count),
            step: DVector::zeros(count),
        }
    }

    /// The camera.
    pub fn camera(&self) -> &CameraModel {
        &self.camera
    }

    /// Standard error of its focal length, in pixels.
    pub fn focal_sigma_px(&self) -> f64 {
        self.focal_sigma_px
    }

    /// Takes the stars of a frame, with their positions in the frame; `excess_px` is added to their
    /// errors.
    pub fn add(
        &mut self,
        stars: impl Iterator<Item = MeasuredStar>,
        icrs_to_camera: &Rotation<Icrs, Camera>,
        excess_px: f64,
    ) {
        self.normal.fill(0.0);
        self.right.fill(0.0);
        let model = self.camera.distortion_model();
        let predictor = PositionPredictor::new(&self.camera, icrs_to_camera, model);
        for star in stars {
            self.add_star(&star, &predictor, excess_px);
        }
        if self.add_information().is_some() {
            self.take_step();
        }
    }

    /// Adds the two equations of a star.
    fn add_star(&mut self, star: &MeasuredStar, predictor: &PositionPredictor, excess_px: f64) {
        let Some(prediction) = predictor.predict(&star.icrs) else {
            return;
        };
        let PredictedPosition {
            by_pose, observed, ..
        } = &prediction;
        let offset = self.camera.offset_of(&star.pixel);
        let weight = 1.0 / libm::hypot(star.sigma_px, excess_px);
        for axis in 0..2 {
            let of_monomials = prediction.monomials_along(axis);
            let by_parameters = by_pose[axis].into_iter().chain(observed.by_term[axis]);
            for (entry, by) in self.row.iter_mut().zip(by_parameters.chain(of_monomials)) {
                *entry = weight * by;
            }
            let residual = weight * (offset[axis] - observed.at[axis]);
            self.normal.syger(1.0, &self.row, &self.row, 1.0);
            self.right.axpy(residual, &self.row, 1.0);
        }
    }

    /// Eliminates the attitude, and adds the rest to the information; sets `step` to the right-hand
    /// side. `None` where the stars do not determine the attitude.
    fn add_information(&mut self) -> Option<()> {
        self.normal.fill_upper_triangle_with_lower_triangle();
        let attitude: Matrix3<f64> = self.normal.fixed_view::<3, 3>(0, 0).into_owned();
        let inverse = attitude.try_inverse()?;
        let of_attitude: Vector3<f64> = self.right.fixed_rows::<3>(0).into_owned();
        let count = self.step.len();
        self.information *= 1.0 - 1.0 / MEMORY;
        for i in 0..count {
            let coupling: Vector3<f64> =
                self.normal.fixed_view::<3, 1>(0, ATTITUDE + i).into_owned();
            let taken = inverse * coupling;
            self.step[i] = self.right[ATTITUDE + i] - taken.dot(&of_attitude);
            for j in 0..count {
                let other: Vector3<f64> =
                    self.normal.fixed_view::<3, 1>(0, ATTITUDE + j).into_owned();
                self.information[(i, j)] +=
                    self.normal[(ATTITUDE + i, ATTITUDE + j)] - taken.dot(&other);
            }
        }
        Some(())
    }

    /// Solves for the camera.
    fn take_step(&mut self) {
        let mut scratch = std::mem::replace(&mut self.scratch, DMatrix::zeros(0, 0));
        scratch.copy_from(&self.information);
        let Some(root) = Cholesky::new(scratch) else {
            let count = self.step.len();
            self.scratch = DMatrix::zeros(count, count);
            return;
        };
        root.solve_mut(&mut self.step);
        if self.step[0].abs() < MAX_STEP && self.step.iter().all(|step| step.is_finite()) {
            let focal_length_px = self.camera.focal_length_px() * libm::exp(self.step[0]);
            let steps = || self.step.iter().skip(1).copied();
            let distortion = self.camera.distortion().map(|known| known.changed(steps()));
            let camera = self.camera.with_focal_length(focal_length_px);
            self.camera = camera.with_distortion(distortion);
        }
        // The first column of the inverse, for the variance of ln f.
        self.step.fill(0.0);
        self.step[0] = 1.0;
        root.solve_mut(&mut self.step);
        self.focal_sigma_px = self.step[0].max(0.0).sqrt() * self.camera.focal_length_px();
        self.scratch = root.unpack_dirty();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, UnitVector};
    use crate::camera::Distortion;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SIGMA_PX: f64 = 0.05;

    fn camera(focal_px: f64, coefficients_px: &[f64]) -> CameraModel {
        let camera = CameraModel::pinhole(640.0, 480.0, focal_px, false);
        let model = DistortionModel::Radial5;
        let distortion = Distortion::new(model, camera.radius_px(), coefficients_px);
        camera.with_distortion(Some(distortion))
    }

    #[test]
    fn a_camera_is_refined_to_its_stated_error() {
        let truth = camera(1800.0, &[-2.0, 0.8]);
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let (mut squares, mut last_sigma_px) = (0.0, 0.0);
        const RUNS: usize = 40;
        for _ in 0..RUNS {
            let mut lens = LensRefiner::new(camera(1801.5, &[-1.0, 0.0]));
            for frame in 0..40 {
                let centre = UnitVector::from_ra_dec(0.1 * f64::from(frame), 0.4);
                let attitude = Rotation::looking_at(&centre, 0.3);
                let star = |_| {
                    let (x, y) = (rng.random_range(0.0..640.0), rng.random_range(0.0..480.0));
                    let place = PixelPoint::new(x, y);
                    let icrs = attitude
                        .inverse()
                        .apply(&truth.direction_of(&place).unwrap());
                    let mut error = || SIGMA_PX * rng.sample::<f64, _>(StandardNormal);
                    MeasuredStar {
                        pixel: PixelPoint::new(x + error(), y + error()),
                        icrs,
                        sigma_px: SIGMA_PX,
                    }
                };
                let stars: Vec<MeasuredStar> = (0..30).map(star).collect();
                // The attitude is not quite the true one: it is free.
                let turned = attitude.then_turn(Vector3::new(1e-5, -2e-5, 3e-5));
                lens.add(stars.into_iter(), &turned, 0.0);
            }
            let error_px = lens.camera().focal_length_px() - 1800.0;
            squares += (error_px / lens.focal_sigma_px()).powi(2) / RUNS as f64;
            last_sigma_px = lens.focal_sigma_px();
            let corner = PixelPoint::new(630.0, 470.0);
            let there = truth.direction_of(&corner).unwrap();
            let found = lens.camera().pixel_of(&there).unwrap();
            assert!(found.distance_to(&corner) < 0.3, "{found:?}");
        }
        assert!(last_sigma_px < 0.15, "{last_sigma_px}");
        // The standard error of the mean square of forty is 0.22.
        assert!((0.4..2.0).contains(&squares), "{squares}");
    }
}
