//! Joint fit of one lens, and of the attitude of each frame, to the stars of several frames.
//!
//! The normal equations are sparse: the attitude of a frame meets the lens and no other attitude.
//! Attitudes are eliminated frame by frame, and what is left are the equations of the lens.

use super::adjustment::{KnownAxis, MeasuredStar, PositionPredictor, USUAL_TERMS, usual_term_px};
use crate::base::coords::{Camera, Icrs, Rotation};
use crate::base::least_squares::LinearFit;
use crate::camera::{CameraModel, Distortion, DistortionModel};
use nalgebra::{Cholesky, Const, DMatrix, DVector, Dyn, Matrix3, Matrix3xX, Vector3, Vector4};

/// Maximum number of steps.
const MAX_STEPS: usize = 40;
/// Smallest share of a step that is tried.
const MIN_FRACTION: f64 = 0.01;
/// The fit has converged where a step moves the predicted places by less than this, in standard errors.
const CONVERGED: f64 = 1e-3;

/// The stars of a frame, and its attitude.
#[derive(Debug, Clone)]
pub(crate) struct JointFrame {
    pub stars: Vec<MeasuredStar>,
    pub icrs_to_camera: Rotation<Icrs, Camera>,
}

/// One lens for several frames.
#[derive(Debug, Clone)]
pub(crate) struct JointFit {
    pub camera: CameraModel,
    /// The attitude of each frame.
    pub attitudes: Vec<Rotation<Icrs, Camera>>,
    /// Covariance of ln f and of the terms of the distortion in pixels, for the stated errors.
    pub covariance: DMatrix<f64>,
    /// Observed minus predicted positions of the stars of each frame, in pixels.
    pub residuals_px: Vec<Vec<[f64; 2]>>,
}

/// Fits a lens of this projection, with the distortion of `model`, starting from `camera`. `None` if the
/// stars do not determine it, or one is not imaged.
pub(crate) fn fit_jointly(
    frames: &[JointFrame],
    camera: &CameraModel,
    model: Option<DistortionModel>,
) -> Option<JointFit> {
    let mut camera = *camera;
    let mut axis = None;
    if model >= Some(DistortionModel::Irregular3) {
        let lens = fit_jointly(frames, &camera, Some(DistortionModel::Stretched))?;
        camera = lens.camera;
        axis = Some(KnownAxis::from_camera(&camera, [0.0; 2]));
    }
    let predictor =
        |frame: &JointFrame| PositionPredictor::new(&camera, &frame.icrs_to_camera, model);
    let joint = Joint {
        frames,
        predictors: frames.iter().map(predictor).collect(),
        model,
        axis,
    };
    joint.fit()
}

/// Observed minus predicted positions of stars, in pixels. `None` if one is not imaged.
pub(crate) fn residuals_px(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
) -> Option<Vec<[f64; 2]>> {
    let predictor = PositionPredictor::new(camera, icrs_to_camera, camera.distortion_model());
    stars
        .iter()
        .map(|star| predictor.residual_px(star))
        .collect()
}

/// What the stars of a frame alone say of the lens of a joint fit.
#[derive(Debug, Clone)]
pub(crate) struct LensPull {
    /// The derivative of half the misfit by its parameters, downwards.
    pub vector: DVector<f64>,
    /// The inverse of the covariance of its parameters.
    pub information: DMatrix<f64>,
}

/// What each of `frames` says of the lens of their `fit`, with its attitude eliminated. `None` if a star is
/// not imaged, or an attitude not determined.
pub(crate) fn lens_pulls(frames: &[JointFrame], fit: &JointFit) -> Option<Vec<LensPull>> {
    let model = fit.camera.distortion_model();
    let parameters = fit.covariance.nrows();
    let mut row = vec![0.0; 3 + parameters];
    let of_frame = |(frame, attitude): (&JointFrame, &Rotation<Icrs, Camera>)| {
        let predictor = PositionPredictor::new(&fit.camera, attitude, model);
        let mut vector = DVector::zeros(parameters);
        let mut information = DMatrix::zeros(parameters, parameters);
        let mut sums = FrameSums::new(parameters);
        for star in &frame.stars {
            sums.add(&predictor, star, &mut row, &mut information, &mut vector)?;
        }
        sums.block()?.eliminate_from(&mut information, &mut vector);
        information.fill_upper_triangle_with_lower_triangle();
        Some(LensPull {
            vector,
            information,
        })
    };
    frames.iter().zip(&fit.attitudes).map(of_frame).collect()
}

/// The relative difference of the scale of a frame's stars from that of `camera`, and its standard error.
/// `None` if the stars do not determine it.
pub(crate) fn fit_scale(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
) -> Option<[f64; 2]> {
    let predictor = PositionPredictor::new(camera, icrs_to_camera, camera.distortion_model());
    let mut fit = LinearFit::new();
    for star in stars {
        let by_pose = predictor.predict(&star.icrs)?.by_pose;
        let residual_px = predictor.residual_px(star)?;
        for (by, residual_px) in by_pose.into_iter().zip(residual_px) {
            let row = Vector4::from(by) / star.sigma_px;
            fit.add(&row, 1.0, residual_px / star.sigma_px);
        }
    }
    // The last is ln f: residuals are small, so one step is enough.
    let (change, covariance) = fit.solve_with_covariance()?;
    Some([change[3], covariance[(3, 3)].sqrt()])
}

/// The frames of a joint fit at its present lens and attitudes.
struct Joint<'a> {
    frames: &'a [JointFrame],
    predictors: Vec<PositionPredictor>,
    model: Option<DistortionModel>,
    axis: Option<KnownAxis>,
}

/// The equations of the attitude of a frame.
struct FrameBlock {
    root: Cholesky<f64, Const<3>>,
    /// With the parameters of the lens.
    coupling: Matrix3xX<f64>,
    vector: Vector3<f64>,
}

/// The normal equations.
struct JointNormal {
    frames: Vec<FrameBlock>,
    /// Of the lens, with the attitudes eliminated.
    root: Cholesky<f64, Dyn>,
    vector: DVector<f64>,
    misfit: f64,
}

/// A step: of the lens, and of each attitude.
struct JointStep {
    lens: DVector<f64>,
    turns: Vec<Vector3<f64>>,
}

impl Joint<'_> {
    fn fit(mut self) -> Option<JointFit> {
        let stars: usize = self.frames.iter().map(|frame| frame.stars.len()).sum();
        let converged = CONVERGED * CONVERGED * 2.0 * stars as f64;
        let mut normal = self.normal()?;
        let mut before = DVector::zeros(self.parameters());
        for _ in 0..MAX_STEPS {
            let step = normal.step();
            let moved = normal.root.l().tr_mul(&step.lens);
            if normal.gain(&step) < converged {
                self.take(&step, 1.0);
                return self.finish(&normal);
            }
            let share = if moved.dot(&before) < 0.0 { 0.5 } else { 1.0 };
            before = moved;
            normal = self.improved(&normal, &step, share)?;
        }
        None
    }

    /// Takes a share of a step that makes the fit better; `None` where none does.
    fn improved(
        &mut self,
        normal: &JointNormal,
        step: &JointStep,
        share: f64,
    ) -> Option<JointNormal> {
        let before = self.predictors.clone();
        let mut share = share;
        while share > MIN_FRACTION {
            self.take(step, share);
            let next = self.normal().filter(|next| next.misfit <= normal.misfit);
            if next.is_some() {
                return next;
            }
            self.predictors.clone_from(&before);
            share *= 0.5;
        }
        None
    }

    /// Number of parameters of the lens: ln f and the terms.
    fn parameters(&self) -> usize {
        1 + self.model.map_or(0, DistortionModel::terms)
    }

    fn take(&mut self, step: &JointStep, share: f64) {
        for (predictor, turn) in self.predictors.iter_mut().zip(&step.turns) {
            let changes_px = step.lens.iter().skip(1).map(|change| share * change);
            predictor.change(turn * share, share * step.lens[0], changes_px, self.model);
        }
    }

    /// `None` if a star is not imaged, or the stars do not determine the parameters.
    fn normal(&self) -> Option<JointNormal> {
        let lens = self.parameters();
        let mut matrix = DMatrix::zeros(lens, lens);
        let mut vector = DVector::zeros(lens);
        let mut misfit = self.add_usual(&mut matrix, &mut vector);
        let mut frames = Vec::with_capacity(self.frames.len());
        let mut row = vec![0.0; 3 + lens];
        for (frame, predictor) in self.frames.iter().zip(&self.predictors) {
            let mut of_frame = FrameSums::new(lens);
            for star in &frame.stars {
                misfit += of_frame.add(predictor, star, &mut row, &mut matrix, &mut vector)?;
            }
            let block = of_frame.block()?;
            block.eliminate_from(&mut matrix, &mut vector);
            frames.push(block);
        }
        matrix.fill_upper_triangle_with_lower_triangle();
        Some(JointNormal {
            frames,
            root: matrix.cholesky()?,
            vector,
            misfit,
        })
    }

    /// Adds what lenses are like; returns how unusual the present one is.
    fn add_usual(&self, matrix: &mut DMatrix<f64>, vector: &mut DVector<f64>) -> f64 {
        let camera = self.predictors[0].camera();
        let terms_px = camera
            .distortion()
            .map_or(&[][..], Distortion::coefficients_px);
        let mut misfit = 0.0;
        for (term, present_px) in terms_px.iter().enumerate() {
            let (expected_px, sigma_px) = usual_term_px(camera, &USUAL_TERMS, self.axis, term);
            matrix[(1 + term, 1 + term)] += sigma_px.powi(-2);
            vector[1 + term] += (expected_px - present_px) * sigma_px.powi(-2);
            misfit += ((present_px - expected_px) / sigma_px).powi(2);
        }
        misfit
    }

    fn finish(self, normal: &JointNormal) -> Option<JointFit> {
        let stars = self.frames.iter().zip(&self.predictors);
        let residuals_px = stars.map(|(frame, predictor)| {
            let stars = frame.stars.iter();
            stars.map(|star| predictor.residual_px(star)).collect()
        });
        let residuals_px: Option<Vec<_>> = residuals_px.collect();
        Some(JointFit {
            camera: *self.predictors.first()?.camera(),
            attitudes: self
                .predictors
                .iter()
                .map(PositionPredictor::icrs_to_camera)
                .collect(),
            covariance: normal.root.inverse(),
            residuals_px: residuals_px?,
        })
    }
}

/// The sums over the stars of a frame.
struct FrameSums {
    attitude: Matrix3<f64>,
    coupling: Matrix3xX<f64>,
    vector: Vector3<f64>,
}

impl FrameSums {
    fn new(lens: usize) -> Self {
        Self {
            attitude: Matrix3::zeros(),
            coupling: Matrix3xX::zeros(lens),
            vector: Vector3::zeros(),
        }
    }

    /// Adds the equations of a star, also to those of the lens (the lower triangle of `matrix`), with
    /// `row` as a buffer. Returns its squared residual in standard errors; `None` if it is not imaged.
    fn add(
        &mut self,
        predictor: &PositionPredictor,
        star: &MeasuredStar,
        row: &mut [f64],
        matrix: &mut DMatrix<f64>,
        vector: &mut DVector<f64>,
    ) -> Option<f64> {
        let prediction = predictor.predict(&star.icrs)?;
        let offset = predictor.camera().offset_of(&star.pixel);
        let weight = 1.0 / star.sigma_px;
        let mut misfit = 0.0;
        for (axis, offset) in offset.into_iter().enumerate() {
            let by_lens = prediction.observed.by_term[axis].into_iter();
            let by_all = prediction.by_pose[axis].into_iter().chain(by_lens);
            let by_all = by_all.chain(prediction.monomials_along(axis));
            for (value, by) in row.iter_mut().zip(by_all) {
                *value = weight * by;
            }
            let residual = weight * (offset - prediction.observed.at[axis]);
            misfit += residual * residual;
            let (turn, lens) = row.split_at(3);
            for i in 0..3 {
                for j in 0..3 {
                    self.attitude[(i, j)] += turn[i] * turn[j];
                }
                self.vector[i] += turn[i] * residual;
            }
            for (i, by) in lens.iter().enumerate() {
                for (j, turn) in turn.iter().enumerate() {
                    self.coupling[(j, i)] += turn * by;
                }
                vector[i] += by * residual;
                // Columns are contiguous.
                let column = &mut matrix.as_mut_slice()[i * lens.len()..][i..lens.len()];
                for (sum, other) in column.iter_mut().zip(&lens[i..]) {
                    *sum += by * other;
                }
            }
        }
        Some(misfit)
    }

    fn block(self) -> Option<FrameBlock> {
        Some(FrameBlock {
            root: self.attitude.cholesky()?,
            coupling: self.coupling,
            vector: self.vector,
        })
    }
}

impl FrameBlock {
    fn eliminate_from(&self, matrix: &mut DMatrix<f64>, vector: &mut DVector<f64>) {
        let solved = self.root.solve(&self.coupling);
        *matrix -= self.coupling.tr_mul(&solved);
        *vector -= solved.tr_mul(&self.vector);
    }
}

impl JointNormal {
    fn step(&self) -> JointStep {
        let lens = self.root.solve(&self.vector);
        let turn = |frame: &FrameBlock| {
            let rest = frame.vector - &frame.coupling * &lens;
            frame.root.solve(&rest)
        };
        JointStep {
            turns: self.frames.iter().map(turn).collect(),
            lens,
        }
    }

    /// By how much a step should make the misfit less.
    fn gain(&self, step: &JointStep) -> f64 {
        let of_frames = self.frames.iter();
        let of_frames = of_frames.map(|frame| frame.vector.dot(&frame.root.solve(&frame.vector)));
        step.lens.dot(&self.vector) + of_frames.sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, UnitVector};
    use crate::camera::Projection;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SIGMA_PX: f64 = 0.1;

    /// Frames of a camera, with errors of the positions.
    fn frames_of(camera: &CameraModel, count: usize, rng: &mut ChaCha8Rng) -> Vec<JointFrame> {
        let frame = |_| {
            let place =
                UnitVector::from_ra_dec(rng.random_range(0.0..6.0), rng.random_range(-1.0..1.0));
            let truth = Rotation::looking_at(&place, rng.random_range(-3.0..3.0));
            let mut stars = Vec::new();
            while stars.len() < 60 {
                let pixel =
                    PixelPoint::new(rng.random_range(0.0..1024.0), rng.random_range(0.0..768.0));
                let Some(direction) = camera.direction_of(&pixel) else {
                    continue;
                };
                let mut error = || SIGMA_PX * rng.sample::<f64, _>(StandardNormal);
                stars.push(MeasuredStar {
                    pixel: PixelPoint::new(pixel.x + error(), pixel.y + error()),
                    icrs: truth.inverse().apply(&direction),
                    sigma_px: SIGMA_PX,
                });
            }
            let off = Vector3::new(0.002, -0.001, 0.003);
            JointFrame {
                stars,
                icrs_to_camera: truth.then_turn(off),
            }
        };
        (0..count).map(frame).collect()
    }

    #[test]
    fn errors_of_a_lens_are_as_stated() {
        const TRIALS: u32 = 60;
        let model = DistortionModel::BrownConrady;
        let coefficients = [-16.0, 4.0, -3.0, 11.0, -8.0, 0.5, 1.5];
        for projection in [Projection::Pinhole, Projection::Equidistant] {
            let ideal =
                CameraModel::pinhole(1024.0, 768.0, 1500.0, false).with_projection(projection);
            let distortion = Distortion::new(model, ideal.radius_px(), &coefficients);
            let camera = ideal.with_distortion(Some(distortion));
            let mut rng = ChaCha8Rng::seed_from_u64(7);
            let mut mean_sq = 0.0;
            for _ in 0..TRIALS {
                let frames = frames_of(&camera, 8, &mut rng);
                let fit =
                    fit_jointly(&frames, &ideal.with_focal_length(1510.0), Some(model)).unwrap();
                let found = fit.camera.distortion().unwrap().coefficients_px();
                let ln_ratio = (fit.camera.focal_length_px() / 1500.0).ln();
                let off = std::iter::once(ln_ratio)
                    .chain(found.iter().zip(&coefficients).map(|(a, b)| a - b));
                let off = DVector::from_iterator(8, off);
                let root = fit.covariance.cholesky().unwrap();
                mean_sq += off.dot(&root.solve(&off)) / 8.0 / f64::from(TRIALS);
            }
            // A standard error of 6 %.
            assert!((mean_sq - 1.0).abs() < 0.2, "{projection:?} {mean_sq}");
        }
    }

    #[test]
    fn one_frame_gives_what_a_fit_of_one_frame_gives() {
        let camera = CameraModel::pinhole(1024.0, 768.0, 1500.0, true);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let frames = frames_of(&camera, 1, &mut rng);
        let model = Some(DistortionModel::Radial5);
        let joint = fit_jointly(&frames, &camera, model).unwrap();
        let single = super::super::fit_camera(
            &frames[0].stars,
            &camera,
            &frames[0].icrs_to_camera,
            model,
            &mut Vec::new(),
        );
        let single = single.unwrap();
        assert!(joint.attitudes[0].angle_to(&single.icrs_to_camera) < 1e-8);
        let ratio = joint.camera.focal_length_px() / single.camera.focal_length_px();
        assert!((ratio - 1.0).abs() < 1e-6);
        assert!((joint.covariance[(0, 0)] / single.covariance[(3, 3)] - 1.0).abs() < 1e-3);
        let again = residuals_px(&frames[0].stars, &joint.camera, &joint.attitudes[0]).unwrap();
        assert!((again[5][0] - joint.residuals_px[0][5][0]).abs() < 1e-9);
    }
}
