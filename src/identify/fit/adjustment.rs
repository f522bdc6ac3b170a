//! The least-squares adjustment of attitude, focal length and lens distortion to star positions in
//! pixels: its equations, and one Gauss-Newton step.
//!
//! A star is predicted at `c + A D(f g(ω d))`: its direction d, turned by ω, is projected (g), scaled
//! by the focal length f, distorted (D), stretched (A) and shifted by the axis (c). The two equations
//! are linear in the distortion's terms and nearly so in ω and ln f.

use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::camera::{
    CameraModel, Distortion, DistortionModel, LENS_TERMS, MAX_TERMS, MONOMIALS, Observed, monomials,
};
use crate::identify::field::ObservedStar;
use crate::identify::pairing::Pair;
use multiversion::multiversion;
use nalgebra::{Cholesky, Const, DMatrix, DVector, SMatrix, SVector, Vector3};

/// A star with known direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredStar {
    /// Its centroid.
    pub pixel: PixelPoint,
    /// Its catalogue direction at the date of the frame.
    pub icrs: UnitVector<Icrs>,
    /// Standard error of the measured position on each axis, in pixels.
    pub sigma_px: f64,
}

impl MeasuredStar {
    /// The observed star of a pair; all measure worse by `excess_px` than stated.
    pub fn new(star: &ObservedStar, pair: &Pair, excess_px: f64) -> Self {
        /// Errors of lists that state none.
        const MIN_PX: f64 = 1e-3;
        Self {
            pixel: star.position,
            icrs: pair.direction,
            sigma_px: libm::hypot(pair.sigma_px(star), excess_px).max(MIN_PX),
        }
    }
}

/// Parameters without distortion: rotation about three axes, and ln f.
pub const POSE_PARAMETERS: usize = 4;
/// Parameters with all terms of a lens.
pub(super) const LENS_PARAMETERS: usize = POSE_PARAMETERS + LENS_TERMS;
/// Parameters with all terms of any distortion.
pub(super) const MAX_PARAMETERS: usize = POSE_PARAMETERS + MAX_TERMS;
/// Maximum number of steps.
const MAX_ITERATIONS: usize = 30;
/// Smallest share of a step that is tried.
const MIN_FRACTION: f64 = 0.01;
/// Largest step in radians: beyond it the fit has diverged.
const MAX_STEP: f64 = 0.5;
/// What lenses are like: standard deviation of the terms about zero, in units of half the frame's
/// diagonal. It only matters where the stars say nothing of a term, as of the axis of a narrow field.
pub(super) const USUAL_TERMS: [f64; LENS_TERMS] = [0.5, 0.5, 0.5, 3.0, 3.0, 0.05, 0.05, 0.1, 0.02];
/// The same of the radial terms and the decentring of a lens that is followed from a window: what any ideal
/// projection needs beyond the equidistant one.
const FOLLOWED_TERMS: [f64; LENS_TERMS] = [0.5, 0.2, 0.1, 3.0, 3.0, 0.005, 0.005, 0.1, 0.02];
/// The same of the axis where a lens is no pinhole: frames of these are not cut.
const USUAL_AXIS_OF_FISHEYE: f64 = 0.1;
/// The same of the terms by which a lens that is no pinhole differs from what the stars show. Such lenses follow
/// the ideal projections within a few per cent (Schneider et al. 2009, ISPRS J. Photogramm. Remote Sens. 64, 259;
/// Kumler & Bauer 2000, Proc. SPIE 4093, 360); pixels are square within a few thousandths.
const UNSHOWN_TERMS: [f64; LENS_TERMS] = [0.03, 0.01, 0.005, 3.0, 3.0, 0.005, 0.005, 0.002, 0.002];
/// The term that shifts the axis along x; the next does along y.
pub(super) const AXIS: usize = 3;
/// The same of the monomials.
const USUAL_MONOMIAL: f64 = 0.02;

/// Number of stars that are processed together.
pub(super) const LANES: usize = 8;
/// One number for each of them.
pub(super) type Lanes = [f64; LANES];

/// A least-squares adjustment of `P` parameters.
pub(super) struct Adjustment<'a, const P: usize> {
    pub stars: &'a [MeasuredStar],
    /// The camera that the next step starts from, and its attitude.
    pub predictor: PositionPredictor,
    /// The terms that are fitted.
    model: Option<DistortionModel>,
    prior: Prior<'a>,
}

/// What is known of a lens before it is fitted.
#[derive(Clone, Copy)]
pub(super) enum Prior<'a> {
    /// What lenses are like.
    Usual,
    /// What lenses are like that are followed from a window.
    Followed,
    /// What lenses are like beyond their first terms, so many, which the stars show.
    Beyond(usize),
    /// What lenses are like, and where the axis meets the frame.
    Axis(KnownAxis),
    /// A lens that was measured, with this information (inverse covariance) on ln f and the terms.
    Known(&'a CameraModel, &'a DMatrix<f64>),
}

/// Where the axis of a lens meets the frame, as an offset from its centre, with the standard errors, in pixels.
#[derive(Clone, Copy)]
pub(super) struct KnownAxis {
    at_px: [f64; 2],
    sigma_px: [f64; 2],
}

impl KnownAxis {
    /// That of a camera. The monomials can take the place of the axis: it stays where the lens has it. The attitude of
    /// a lens that is no pinhole is that of its axis, and has all of the axis's error, `sigma_px`.
    pub fn from_camera(camera: &CameraModel, sigma_px: [f64; 2]) -> Self {
        /// Standard error of an axis that stays.
        const FIXED_PX: f64 = 0.01;
        let distortion = camera.distortion();
        Self {
            at_px: distortion.map_or([0.0; 2], Distortion::axis_offset_px),
            sigma_px: if camera.is_pinhole() {
                [FIXED_PX; 2]
            } else {
                sigma_px.map(|sigma_px| sigma_px.max(FIXED_PX))
            },
        }
    }
}

/// The two equations of several stars, divided by their standard errors. The unknowns are a turn, the
/// change of ln f, and the coefficients of the distortion.
pub(super) struct EquationRows<const P: usize> {
    /// Along x and y.
    pub terms: [[Lanes; P]; 2],
    pub rhs: [Lanes; 2],
    residuals: [Lanes; 2],
}

/// The normal equations, summed over the stars of each lane: every candidate is fitted, and stars side by side
/// are faster than one after the other, as in `base::least_squares`.
struct LaneNormalEquations<const P: usize> {
    /// Lower triangle.
    block: [[Lanes; P]; P],
    vector: [Lanes; P],
    misfit: Lanes,
}

impl<const P: usize> LaneNormalEquations<P> {
    #[inline(always)]
    fn add(&mut self, rows: &EquationRows<P>) {
        for (axis, (terms, rhs)) in rows.terms.iter().zip(&rows.rhs).enumerate() {
            add_products(
                &mut self.misfit,
                &rows.residuals[axis],
                &rows.residuals[axis],
            );
            for i in 0..P {
                for j in 0..=i {
                    add_products(&mut self.block[i][j], &terms[i], &terms[j]);
                }
                add_products(&mut self.vector[i], &terms[i], rhs);
            }
        }
    }
}

#[inline(always)]
pub(super) fn add_products(sums: &mut Lanes, a: &Lanes, b: &Lanes) {
    for lane in 0..LANES {
        sums[lane] += a[lane] * b[lane];
    }
}

/// Adds `values` times `factor` to `sums`.
#[inline(always)]
pub(super) fn add_scaled(sums: &mut Lanes, factor: f64, values: &Lanes) {
    for lane in 0..LANES {
        sums[lane] += factor * values[lane];
    }
}

/// The normal equations.
pub(super) struct Normal<const P: usize> {
    /// The matrix, decomposed.
    pub root: Cholesky<f64, Const<P>>,
    /// The right-hand side.
    pub vector: SVector<f64, P>,
    /// Sum of the squared residuals, in standard errors; unusual terms add to it.
    misfit: f64,
}

/// Predicts where stars are, with the derivatives by all parameters.
#[derive(Clone, Copy)]
pub(crate) struct PositionPredictor {
    camera: CameraModel,
    /// ICRS to the axes of its lens.
    icrs_to_lens: Rotation<Icrs, Camera>,
    /// Its distortion, with all the terms of lenses; those that it lacks are 0.
    distortion: Distortion,
}

/// Where a star is predicted.
pub(crate) struct PredictedPosition {
    /// Derivatives by the turn and ln f.
    pub by_pose: [[f64; POSE_PARAMETERS]; 2],
    /// The place, and its derivatives by the terms of the lens.
    pub observed: Observed,
    /// Its offset from the axis without distortion, in units of R.
    ideal: [f64; 2],
}

impl PredictedPosition {
    /// The monomials of an irregular distortion there.
    fn monomials(&self) -> [f64; MONOMIALS] {
        monomials(self.ideal)
    }

    /// Derivatives of a coordinate by the coefficients of the monomials.
    pub fn monomials_along(&self, axis: usize) -> impl Iterator<Item = f64> {
        let pair = move |value: f64| {
            if axis == 0 {
                [value, 0.0]
            } else {
                [0.0, value]
            }
        };
        self.monomials().into_iter().flat_map(pair)
    }
}

impl PositionPredictor {
    /// The stars as seen by `camera` in this attitude, with the terms of `model` alone.
    pub fn new(
        camera: &CameraModel,
        icrs_to_camera: &Rotation<Icrs, Camera>,
        model: Option<DistortionModel>,
    ) -> Self {
        let of_lenses = DistortionModel::Stretched;
        let whole = model.map_or(of_lenses, |model| model.max(of_lenses));
        let of_model = |distortion: &Distortion| model.map(|model| distortion.of_model(model));
        let known = camera.distortion().and_then(of_model);
        let mut predictor = Self {
            camera: *camera,
            icrs_to_lens: *icrs_to_camera,
            distortion: known.map_or_else(
                || Distortion::zero(whole, camera.radius_px()),
                |known| known.of_model(whole),
            ),
        };
        predictor.set_lens(camera.focal_length_px(), predictor.distortion, model);
        let to_lens = predictor.camera.lens_axes();
        predictor.icrs_to_lens = Rotation::from_matrix(to_lens * icrs_to_camera.matrix());
        predictor
    }

    /// Turns the camera, and changes ln f and the terms of `model`.
    pub fn change(
        &mut self,
        turn: Vector3<f64>,
        ln_ratio: f64,
        changes_px: impl IntoIterator<Item = f64>,
        model: Option<DistortionModel>,
    ) {
        self.icrs_to_lens = self.icrs_to_lens.then_turn(turn);
        let focal_length_px = self.camera.focal_length_px() * libm::exp(ln_ratio);
        self.set_lens(focal_length_px, self.distortion.changed(changes_px), model);
    }

    /// The camera.
    pub fn camera(&self) -> &CameraModel {
        &self.camera
    }

    /// The attitude.
    pub fn icrs_to_camera(&self) -> Rotation<Icrs, Camera> {
        let to_camera = self.camera.lens_axes().transpose();
        Rotation::from_matrix(to_camera * self.icrs_to_lens.matrix())
    }

    /// Sets the lens, with the terms of `model` alone, and leaves its axes.
    fn set_lens(
        &mut self,
        focal_length_px: f64,
        distortion: Distortion,
        model: Option<DistortionModel>,
    ) {
        self.distortion = distortion;
        let camera = self.camera.with_focal_length(focal_length_px);
        self.camera = camera.with_distortion(model.map(|model| distortion.of_model(model)));
    }

    /// `None` if the star is not imaged.
    #[inline(always)]
    pub fn predict(&self, icrs: &UnitVector<Icrs>) -> Option<PredictedPosition> {
        let f = self.camera.focal_length_px();
        let direction = self.icrs_to_lens.apply(icrs);
        let projected = self.camera.projection().project(&direction)?;
        let ideal = projected.at.map(|along| along * f);
        let observed = self.distortion.observe(ideal)?;
        let by_pose = observed.by_ideal.map(|[by_u, by_v]| {
            let [u, v] = projected.by_turn;
            let by_turn = |turn: usize| f * (by_u * u[turn] + by_v * v[turn]);
            let by_ln_f = by_u * ideal[0] + by_v * ideal[1];
            [by_turn(0), by_turn(1), by_turn(2), by_ln_f]
        });
        let radius_px = self.distortion.radius_px();
        Some(PredictedPosition {
            by_pose,
            observed,
            ideal: ideal.map(|along| along / radius_px),
        })
    }

    /// Observed minus predicted position of a star; `None` if it is not imaged.
    pub fn residual_px(&self, star: &MeasuredStar) -> Option<[f64; 2]> {
        let predicted = self.predict(&star.icrs)?.observed.at;
        let [u, v] = self.camera.offset_of(&star.pixel);
        Some([u - predicted[0], v - predicted[1]])
    }

    /// Changes the parameters by a share of `change`: of the turn, ln f and the terms of `model`.
    fn take(&mut self, change: &[f64], share: f64, model: Option<DistortionModel>) {
        let (pose, changes_px) = change.split_at(POSE_PARAMETERS);
        let turn = Vector3::new(pose[0], pose[1], pose[2]) * share;
        let changes_px = changes_px.iter().map(|change| share * change);
        self.change(turn, share * pose[3], changes_px, model);
    }

    /// How far the lens is from one that was measured: the pull of its information on ln f and the terms, and the
    /// misfit.
    fn pull_of(&self, lens: &CameraModel, information: &DMatrix<f64>) -> (DVector<f64>, f64) {
        let expected_px = lens
            .distortion()
            .map_or(&[][..], Distortion::coefficients_px);
        let ln_ratio = libm::log(lens.focal_length_px() / self.camera.focal_length_px());
        // The unknowns: a change of ln f, and terms.
        let wanted: DVector<f64> = DVector::from_iterator(
            information.nrows(),
            std::iter::once(ln_ratio).chain(expected_px.iter().copied()),
        );
        let mut off = wanted.clone();
        let present_px = self.distortion.coefficients_px();
        for (off, present_px) in off.iter_mut().skip(1).zip(present_px) {
            *off -= present_px;
        }
        let misfit = off.dot(&(information * &off));
        (information * &wanted, misfit)
    }
}

impl<'a, const P: usize> Adjustment<'a, P> {
    /// An adjustment with the terms of `model`.
    pub fn new(
        stars: &'a [MeasuredStar],
        camera: &CameraModel,
        icrs_to_camera: &Rotation<Icrs, Camera>,
        model: Option<DistortionModel>,
    ) -> Self {
        Self {
            stars,
            predictor: PositionPredictor::new(camera, icrs_to_camera, model),
            model,
            prior: Prior::Usual,
        }
    }

    /// The same with the axis that the camera has, with these errors.
    pub fn with_known_axis(self, sigma_px: [f64; 2]) -> Self {
        Self {
            prior: Prior::Axis(KnownAxis::from_camera(self.camera(), sigma_px)),
            ..self
        }
    }

    /// The same of a lens that is followed from a window.
    pub fn followed(self) -> Self {
        Self {
            prior: Prior::Followed,
            ..self
        }
    }

    /// The same of a lens of which the stars show the first terms, so many.
    pub fn with_unshown_terms(self, shown: usize) -> Self {
        Self {
            prior: Prior::Beyond(shown),
            ..self
        }
    }

    /// The same with a lens that was measured before.
    pub fn with_known_lens(mut self, lens: &'a CameraModel, information: &'a DMatrix<f64>) -> Self {
        self.prior = Prior::Known(lens, information);
        self
    }

    /// The camera.
    pub fn camera(&self) -> &CameraModel {
        &self.predictor.camera
    }

    /// The attitude.
    pub fn icrs_to_camera(&self) -> Rotation<Icrs, Camera> {
        self.predictor.icrs_to_camera()
    }

    /// The equations of [`LANES`] stars, or fewer. `None` if one is not imaged.
    #[inline(always)]
    pub fn rows(&self, stars: &[MeasuredStar]) -> Option<EquationRows<P>> {
        let mut rows = EquationRows {
            terms: [[[0.0; LANES]; P]; 2],
            rhs: [[0.0; LANES]; 2],
            residuals: [[0.0; LANES]; 2],
        };
        let PositionPredictor {
            camera, distortion, ..
        } = &self.predictor;
        let known = distortion.coefficients_px();
        for (lane, star) in stars.iter().enumerate().take(LANES) {
            let prediction = self.predictor.predict(&star.icrs)?;
            let PredictedPosition {
                by_pose, observed, ..
            } = &prediction;
            let offset = camera.offset_of(&star.pixel);
            let weight = 1.0 / star.sigma_px;
            for axis in 0..2 {
                let mut residual = offset[axis] - observed.at[axis];
                rows.residuals[axis][lane] = weight * residual;
                let by_parameters = by_pose[axis].iter().chain(&observed.by_term[axis]);
                for (terms, by) in rows.terms[axis].iter_mut().zip(by_parameters) {
                    terms[lane] = weight * by;
                }
                let of_terms = observed.by_term[axis].iter().zip(known);
                residual += of_terms.map(|(by, value)| by * value).sum::<f64>();
                rows.rhs[axis][lane] = weight * residual;
            }
            if P > LENS_PARAMETERS {
                let pairs = known[LENS_TERMS..].as_chunks::<2>().0.iter();
                let monomials = prediction.monomials();
                let fitted = (P - LENS_PARAMETERS) / 2;
                for (k, (monomial, pair)) in monomials.iter().zip(pairs).take(fitted).enumerate() {
                    for (axis, coefficient) in pair.iter().enumerate() {
                        let parameter = LENS_PARAMETERS + 2 * k + axis;
                        rows.terms[axis][parameter][lane] = weight * monomial;
                        rows.rhs[axis][lane] += weight * monomial * coefficient;
                    }
                }
            }
        }
        Some(rows)
    }

    /// The normal equations at the present camera and attitude. `None` if a star is not imaged, or the
    /// stars do not determine the parameters.
    pub fn normal(&self) -> Option<Normal<P>> {
        let sums = sums(self)?;
        let total = |lanes: &Lanes| -> f64 { lanes.iter().sum() };
        let mut block =
            SMatrix::<f64, P, P>::from_fn(|i, j| total(&sums.block[i.max(j)][i.min(j)]));
        let mut vector = SVector::<f64, P>::from_fn(|i, _| total(&sums.vector[i]));
        let mut misfit = total(&sums.misfit);
        misfit += match self.prior {
            Prior::Known(lens, information) => {
                self.add_known(lens, information, &mut block, &mut vector)
            }
            Prior::Usual | Prior::Followed | Prior::Beyond(_) | Prior::Axis(_) => {
                self.add_usual(&mut block, &mut vector)
            }
        };
        Some(Normal {
            root: block.cholesky()?,
            vector,
            misfit,
        })
    }

    /// Adds what lenses are like; returns how unusual the present one is.
    fn add_usual(&self, block: &mut SMatrix<f64, P, P>, vector: &mut SVector<f64, P>) -> f64 {
        let axis = match self.prior {
            Prior::Axis(axis) => Some(axis),
            _ => None,
        };
        let terms_px = &self.predictor.distortion.coefficients_px()[..P - POSE_PARAMETERS];
        let mut misfit = 0.0;
        for (term, known_px) in terms_px.iter().enumerate() {
            let camera = &self.predictor.camera;
            let usual = match self.prior {
                Prior::Followed => &FOLLOWED_TERMS,
                Prior::Beyond(shown) if term >= shown => &UNSHOWN_TERMS,
                _ => &USUAL_TERMS,
            };
            let (expected_px, sigma_px) = usual_term_px(camera, usual, axis, term);
            let parameter = POSE_PARAMETERS + term;
            block[(parameter, parameter)] += sigma_px.powi(-2);
            vector[parameter] += expected_px * sigma_px.powi(-2);
            misfit += ((known_px - expected_px) / sigma_px).powi(2);
        }
        misfit
    }

    /// Adds what is known of this lens; returns how far the present one is from it.
    fn add_known(
        &self,
        lens: &CameraModel,
        information: &DMatrix<f64>,
        block: &mut SMatrix<f64, P, P>,
        vector: &mut SVector<f64, P>,
    ) -> f64 {
        const FIRST: usize = POSE_PARAMETERS - 1;
        let (pull, misfit) = self.predictor.pull_of(lens, information);
        for i in 0..information.nrows().min(P - FIRST) {
            vector[FIRST + i] += pull[i];
            for j in 0..information.ncols().min(P - FIRST) {
                block[(FIRST + i, FIRST + j)] += information[(i, j)];
            }
        }
        misfit
    }

    /// Gauss-Newton steps, shortened where a whole one makes the fit worse or steps go to and fro, until a step moves the
    /// predicted places by less than `converged`, as root mean square in standard errors. Returns the
    /// normal equations. `None` where it does not converge, or the stars do not determine the parameters.
    pub fn converge(&mut self, converged: f64) -> Option<Normal<P>> {
        let mut normal = self.normal()?;
        let equations = 2.0 * self.stars.len() as f64;
        let mut moved_before = SVector::zeros();
        for _ in 0..MAX_ITERATIONS {
            let change = self.change(&normal)?;
            // By how much the step moves the predicted places, in standard errors.
            let moved = normal.root.l().tr_mul(&change);
            if moved.norm_squared() < converged * converged * equations {
                self.predictor.take(change.as_slice(), 1.0, self.model);
                return Some(normal);
            }
            let before = self.predictor;
            let mut share = if moved.dot(&moved_before) < 0.0 {
                0.5
            } else {
                1.0
            };
            moved_before = moved;
            normal = loop {
                self.predictor.take(change.as_slice(), share, self.model);
                match self.normal() {
                    Some(next) if next.misfit <= normal.misfit => break next,
                    _ if share > MIN_FRACTION => {
                        self.predictor = before;
                        share *= 0.5;
                    }
                    _ => return None,
                }
            };
        }
        None
    }

    /// The change of the parameters that the normal equations ask for.
    fn change(&self, normal: &Normal<P>) -> Option<SVector<f64, P>> {
        let mut change = normal.root.solve(&normal.vector);
        let turn = Vector3::new(change[0], change[1], change[2]);
        let size = turn.norm().max(change[3].abs());
        if size.is_nan() || size > MAX_STEP {
            return None;
        }
        let known = self.predictor.distortion.coefficients_px();
        for (change, known) in change.iter_mut().skip(POSE_PARAMETERS).zip(known) {
            *change -= known;
        }
        Some(change)
    }
}

/// Mean and standard deviation of a term of lenses like `usual`, in pixels; with the axis where it is known.
pub(super) fn usual_term_px(
    camera: &CameraModel,
    usual: &[f64; LENS_TERMS],
    axis: Option<KnownAxis>,
    term: usize,
) -> (f64, f64) {
    let radius_px = camera.radius_px();
    let of_axis = term.checked_sub(AXIS).filter(|along| *along < 2);
    match (of_axis, axis) {
        (Some(along), Some(axis)) => (axis.at_px[along], axis.sigma_px[along]),
        (Some(_), None) if !camera.is_pinhole() => (0.0, USUAL_AXIS_OF_FISHEYE * radius_px),
        _ => {
            let sigma = usual.get(term).unwrap_or(&USUAL_MONOMIAL);
            (0.0, sigma * radius_px)
        }
    }
}

/// The sums of the normal equations; `None` if a star is not imaged.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn sums<const P: usize>(adjustment: &Adjustment<P>) -> Option<LaneNormalEquations<P>> {
    let mut sums = LaneNormalEquations {
        block: [[[0.0; LANES]; P]; P],
        vector: [[0.0; LANES]; P],
        misfit: [0.0; LANES],
    };
    for stars in adjustment.stars.chunks(LANES) {
        sums.add(&adjustment.rows(stars)?);
    }
    Some(sums)
}
