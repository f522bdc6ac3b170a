//! Joint fit of attitude, focal length and lens distortion to star positions in pixels.
//!
//! matched stars + first guess → Gauss-Newton on (turn about x, y, z; ln f; distortion) → camera,
//! attitude, covariance
//!
//! In the ideal image plane, with (x, y) the tangent-plane coordinates of a star, f the focal
//! length in pixels and (u, v) the observed offset from the centre, each star gives two equations,
//! `f·x − u − Σ cₖ Bₖu(u, v) = 0` and the same in y; they are linear in the distortion cₖ and
//! nearly so in the small turn ω, since `dx = −ωx·x·y + ωy·(1 + x²) − ωz·y`, `dy = −ωx·(1 + y²) +
//! ωy·x·y + ωz·x`.

use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::camera::{
    CUBIC_MONOMIALS, CameraModel, Distortion, DistortionModel, LANES, LENS_TERMS,
    QUINTIC_MONOMIALS, lens_terms, monomials_in_lanes,
};
use multiversion::multiversion;
use nalgebra::{Cholesky, Const, Matrix4, SMatrix, SVector, Vector3};

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

/// Parameters without distortion: rotation about three axes, and ln f.
pub const POSE_PARAMETERS: usize = 4;
/// The linear terms of a polynomial.
const LINEAR_TERMS: usize = 2;
const MAX_ITERATIONS: usize = 10;
/// Largest step in radians: beyond it the fit has diverged.
const LARGEST_STEP: f64 = 0.5;
/// Smallest freedom of an equation at which its left-out residual is defined.
const MIN_FREEDOM: f64 = 1e-6;
/// The fit has converged below this step: the next would be about its square, far below centroid
/// errors.
const CONVERGED: f64 = 1e-5;

/// The result of a method of the [`Adjustment`] for a model: its numbers of parameters and of
/// monomials are known to the compiler.
macro_rules! adjusted {
    ($stars:expr, $at:expr, $model:expr, $method:ident($($argument:expr)?)) => {{
        use DistortionModel::{BrownConrady, Cubic, Quintic, Radial, Radial5, Radial7};
        macro_rules! with {
            ($shared:expr, $monomials:expr) => {
                Adjustment::<{ POSE_PARAMETERS + $shared }, { $monomials }>::new($stars, $at, $model)?
                    .$method($($argument)?)
            };
        }
        match $model {
            None => with!(0, 0),
            Some(Radial) => with!(Radial.terms(), 0),
            Some(Radial5) => with!(Radial5.terms(), 0),
            Some(Radial7) => with!(Radial7.terms(), 0),
            Some(BrownConrady) => with!(BrownConrady.terms(), 0),
            Some(Cubic) => with!(LINEAR_TERMS, CUBIC_MONOMIALS),
            Some(Quintic) => with!(LINEAR_TERMS, QUINTIC_MONOMIALS),
        }
    }};
}

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
    let at = (camera, icrs_to_camera);
    adjusted!(stars, at, model, fit(residuals_px))
}

/// Σ (residual / σ)² with each equation predicted by a fit of `model` to the others. It grows where
/// a model has too much freedom. `camera` and `icrs_to_camera` must be close to the best ones.
///
/// `None` where the stars do not determine the parameters.
pub fn left_out_chi_sq(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    model: Option<DistortionModel>,
) -> Option<f64> {
    let at = (camera, icrs_to_camera);
    adjusted!(stars, at, model, left_out_chi_sq())
}

/// A least-squares adjustment of `P` parameters that both equations of a star share, and of `K`
/// monomial coefficients for each axis.
///
/// The monomials and their weights are the same along x and y and do not change with the pose. So
/// the normal matrix has blocks, `[A Bₓ Bᵧ; Bₓᵀ C 0; Bᵧᵀ 0 C]`. C is decomposed once; the rest is
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

/// One number for each of several stars that are processed together.
type Lanes = [f64; LANES];

/// The two equations of several stars, divided by their standard errors, without the monomials.
struct Rows<const P: usize, const K: usize> {
    /// Along x and y.
    common: [[Lanes; P]; 2],
    /// The coefficients of the monomials, the same along x and y.
    monomials: [Lanes; K],
    rhs: [Lanes; 2],
}

/// The normal equations, summed over the stars of each lane.
struct Sums<const P: usize, const K: usize> {
    /// A (lower triangle), and its right-hand side.
    block: [[Lanes; P]; P],
    vector: [Lanes; P],
    /// Bᵀ along x and y, and the same for the monomials.
    coupling: [[[Lanes; P]; K]; 2],
    vectors: [[Lanes; K]; 2],
}

impl<const P: usize, const K: usize> Sums<P, K> {
    #[inline(always)]
    fn add(&mut self, rows: &Rows<P, K>) {
        for axis in 0..2 {
            let (common, rhs) = (&rows.common[axis], &rows.rhs[axis]);
            for i in 0..P {
                for j in 0..=i {
                    add_products(&mut self.block[i][j], &common[i], &common[j]);
                }
                add_products(&mut self.vector[i], &common[i], rhs);
            }
            for (k, monomial) in rows.monomials.iter().enumerate() {
                for (sums, common) in self.coupling[axis][k].iter_mut().zip(common) {
                    add_products(sums, monomial, common);
                }
                add_products(&mut self.vectors[axis][k], monomial, rhs);
            }
        }
    }
}

#[inline(always)]
fn add_products(sums: &mut Lanes, a: &Lanes, b: &Lanes) {
    for lane in 0..LANES {
        sums[lane] += a[lane] * b[lane];
    }
}

fn total(lanes: &Lanes) -> f64 {
    lanes.iter().sum()
}

/// The normal equations after elimination of the monomials.
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
            let shared = shared_sums(&adjustment);
            let shared = SMatrix::<f64, K, K>::from_fn(|i, j| total(&shared[i.max(j)][i.min(j)]));
            let root = shared.cholesky()?;
            root.l_dirty()
                .solve_lower_triangular_mut(&mut adjustment.inverse_root);
        }
        Some(adjustment)
    }

    fn parameters(&self) -> usize {
        P + 2 * K
    }

    /// Offsets from the centre along u and v in units of the radius, and 1 / σ (0 in empty lanes).
    #[inline(always)]
    fn offsets_and_weights(&self, stars: &[MeasuredStar]) -> ([Lanes; 2], Lanes) {
        let (mut offsets, mut weights) = ([[0.0; LANES]; 2], [0.0; LANES]);
        for (lane, star) in stars.iter().enumerate().take(LANES) {
            let [u, v] = self.camera.offset_of(&star.pixel);
            offsets[0][lane] = u / self.radius_px;
            offsets[1][lane] = v / self.radius_px;
            weights[lane] = 1.0 / star.sigma_px;
        }
        (offsets, weights)
    }

    #[inline(always)]
    fn weighted_monomials(&self, [u, v]: [&Lanes; 2], weights: &Lanes) -> [Lanes; K] {
        let mut monomials = monomials_in_lanes::<K>([u, v]);
        for monomial in &mut monomials {
            for lane in 0..LANES {
                monomial[lane] *= -weights[lane];
            }
        }
        monomials
    }

    /// Tangent-plane coordinates of a star, `None` behind the camera.
    #[inline(always)]
    fn tangent(&self, star: &MeasuredStar) -> Option<[f64; 2]> {
        let direction = self.icrs_to_camera.apply(&star.icrs);
        let d = direction.as_vector();
        (d.z > 0.0).then(|| [d.x / d.z, d.y / d.z])
    }

    /// The equations of [`LANES`] stars, or fewer. `None` if one is behind the camera.
    #[inline(always)]
    fn rows(&self, stars: &[MeasuredStar]) -> Option<Rows<P, K>> {
        let f = self.camera.focal_length_px;
        let ([u, v], weights) = self.offsets_and_weights(stars);
        let [mut x, mut y] = [[0.0; LANES]; 2];
        for (lane, star) in stars.iter().enumerate().take(LANES) {
            [x[lane], y[lane]] = self.tangent(star)?;
        }
        let mut common = [[[0.0; LANES]; P]; 2];
        let mut rhs = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            let ([x, y], [u, v], weight) = ([x[lane], y[lane]], [u[lane], v[lane]], weights[lane]);
            let pose = [[-x * y, 1.0 + x * x, -y, x], [-(1.0 + y * y), x * y, x, y]];
            // The distortion terms that are not monomials along one axis.
            let terms = if K == 0 {
                lens_terms([u, v])
            } else {
                let mut linear = [[0.0; LENS_TERMS]; 2];
                [linear[0][0], linear[0][1]] = [u, v];
                [linear[1][0], linear[1][1]] = [-v, u];
                linear
            };
            for axis in 0..2 {
                for parameter in 0..P {
                    common[axis][parameter][lane] = match parameter.checked_sub(POSE_PARAMETERS) {
                        None => weight * f * pose[axis][parameter],
                        Some(term) => -weight * terms[axis][term],
                    };
                }
                let offset = [u, v][axis] * self.radius_px;
                rhs[axis][lane] = weight * (offset - f * [x, y][axis]);
            }
        }
        Some(Rows {
            common,
            monomials: self.weighted_monomials([&u, &v], &weights),
            rhs,
        })
    }

    /// One Gauss-Newton step. Returns its size (radians, and relative change of the focal length)
    /// and its normal equations.
    fn step(&mut self) -> Option<(f64, Reduced<P, K>)> {
        let sums = sums(self)?;
        let mut block =
            SMatrix::<f64, P, P>::from_fn(|i, j| total(&sums.block[i.max(j)][i.min(j)]));
        let mut vector = SVector::<f64, P>::from_fn(|i, _| total(&sums.vector[i]));
        let mut coupling = [0, 1].map(|axis: usize| {
            SMatrix::<f64, K, P>::from_fn(|k, j| total(&sums.coupling[axis][k][j]))
        });
        let mut vectors = [0, 1]
            .map(|axis: usize| SVector::<f64, K>::from_fn(|k, _| total(&sums.vectors[axis][k])));
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

    /// Position by a pinhole minus position by the star's direction.
    fn residual_px(&self, star: &MeasuredStar) -> Option<[f64; 2]> {
        let f = self.camera.focal_length_px;
        let [x, y] = self.tangent(star)?;
        let [u, v] = self.camera.ideal_offset_of(&star.pixel);
        Some([u - f * x, v - f * y])
    }

    fn left_out_chi_sq(mut self) -> Option<f64> {
        let (_, reduced) = self.step()?;
        left_out_sum(&self, &reduced)
    }

    /// The leverage of each equation of some stars, along x and y.
    #[inline(always)]
    fn leverages(&self, rows: &Rows<P, K>, reduced: &Reduced<P, K>) -> [Lanes; 2] {
        let mut of_monomials = [[0.0; LANES]; K];
        let mut shared = [0.0; LANES];
        for (i, of_monomial) in of_monomials.iter_mut().enumerate() {
            for (j, monomial) in rows.monomials[..=i].iter().enumerate() {
                add_scaled(of_monomial, self.inverse_root[(i, j)], monomial);
            }
            add_products(&mut shared, of_monomial, of_monomial);
        }
        let root = reduced.root.l_dirty();
        [0, 1].map(|axis: usize| {
            let (mut rest, mut leverage) = (rows.common[axis], shared);
            for i in 0..P {
                let (above, below) = rest.split_at_mut(i);
                let this = &mut below[0];
                for (k, of_monomial) in of_monomials.iter().enumerate() {
                    add_scaled(this, -reduced.coupling[axis][(k, i)], of_monomial);
                }
                for (j, above) in above.iter().enumerate() {
                    add_scaled(this, -root[(i, j)], above);
                }
                *this = this.map(|value| value / root[(i, i)]);
                add_products(&mut leverage, this, this);
            }
            leverage
        })
    }
}

#[inline(always)]
fn add_scaled(sums: &mut Lanes, factor: f64, values: &Lanes) {
    for lane in 0..LANES {
        sums[lane] += factor * values[lane];
    }
}

/// C (lower triangle), summed over the stars of each lane.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn shared_sums<const P: usize, const K: usize>(adjustment: &Adjustment<P, K>) -> [[Lanes; K]; K] {
    let mut sums = [[[0.0; LANES]; K]; K];
    for stars in adjustment.stars.chunks(LANES) {
        let ([u, v], weights) = adjustment.offsets_and_weights(stars);
        let monomials = adjustment.weighted_monomials([&u, &v], &weights);
        for i in 0..K {
            for j in 0..=i {
                add_products(&mut sums[i][j], &monomials[i], &monomials[j]);
            }
        }
    }
    sums
}

/// The sums of the normal equations; `None` if a star is behind the camera.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn sums<const P: usize, const K: usize>(adjustment: &Adjustment<P, K>) -> Option<Sums<P, K>> {
    let mut sums = Sums {
        block: [[[0.0; LANES]; P]; P],
        vector: [[0.0; LANES]; P],
        coupling: [[[[0.0; LANES]; P]; K]; 2],
        vectors: [[[0.0; LANES]; K]; 2],
    };
    for stars in adjustment.stars.chunks(LANES) {
        sums.add(&adjustment.rows(stars)?);
    }
    Some(sums)
}

/// Σ (residual / σ)² over all equations, each residual as if its equation were left out of the fit.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn left_out_sum<const P: usize, const K: usize>(
    adjustment: &Adjustment<P, K>,
    reduced: &Reduced<P, K>,
) -> Option<f64> {
    let mut sum = 0.0;
    for stars in adjustment.stars.chunks(LANES) {
        let leverages = adjustment.leverages(&adjustment.rows(stars)?, reduced);
        for (lane, star) in stars.iter().enumerate() {
            let residual_px = adjustment.residual_px(star)?;
            for axis in 0..2 {
                let freedom = (1.0 - leverages[axis][lane]).max(MIN_FREEDOM);
                sum += (residual_px[axis] / star.sigma_px / freedom).powi(2);
            }
        }
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::RAD_PER_DEG;

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
