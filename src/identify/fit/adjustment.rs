//! The least-squares adjustment of attitude, focal length and lens distortion to star positions in
//! pixels: its equations, and one Gauss-Newton step.
//!
//! In the ideal image plane, with (x, y) the tangent-plane coordinates of a star, f the focal
//! length in pixels and (u, v) the observed offset from the centre, each star gives two equations,
//! `f·x − u − Σ cₖ Bₖu(u, v) = 0` and the same in y; they are linear in the distortion cₖ and
//! nearly so in the small turn ω, since `dx = −ωx·x·y + ωy·(1 + x²) − ωz·y`, `dy = −ωx·(1 + y²) +
//! ωy·x·y + ωz·x`.

use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::camera::{
    CameraModel, Distortion, DistortionModel, LANES, LENS_TERMS, lens_terms, monomials_in_lanes,
};
use multiversion::multiversion;
use nalgebra::{Cholesky, Const, SMatrix, SVector, Vector3};

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

/// Parameters without distortion: rotation about three axes, and ln f.
pub const POSE_PARAMETERS: usize = 4;
/// The linear terms of a polynomial.
pub(super) const LINEAR_TERMS: usize = 2;
/// Largest step in radians: beyond it the fit has diverged.
const MAX_STEP: f64 = 0.5;

/// A least-squares adjustment of `P` parameters that both equations of a star share, and of `K`
/// monomial coefficients for each axis.
///
/// The monomials and their weights are the same along x and y and do not change with the pose. So
/// the normal matrix has blocks, `[A Bₓ Bᵧ; Bₓᵀ C 0; Bᵧᵀ 0 C]`. C is decomposed once; the rest is
/// `S = A − Bₓ C⁻¹ Bₓᵀ − Bᵧ C⁻¹ Bᵧᵀ`.
pub(super) struct Adjustment<'a, const P: usize, const K: usize> {
    pub stars: &'a [MeasuredStar],
    /// The camera that the next step starts from.
    pub camera: CameraModel,
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    model: Option<DistortionModel>,
    radius_px: f64,
    /// L⁻¹ of C = L Lᵀ.
    pub inverse_root: SMatrix<f64, K, K>,
}

/// One number for each of several stars that are processed together.
pub(super) type Lanes = [f64; LANES];

/// The two equations of several stars, divided by their standard errors, without the monomials.
pub(super) struct EquationRows<const P: usize, const K: usize> {
    /// Along x and y.
    pub common: [[Lanes; P]; 2],
    /// The coefficients of the monomials, the same along x and y.
    pub monomials: [Lanes; K],
    pub rhs: [Lanes; 2],
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
    fn add(&mut self, rows: &EquationRows<P, K>) {
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
pub(super) fn add_products(sums: &mut Lanes, a: &Lanes, b: &Lanes) {
    for lane in 0..LANES {
        sums[lane] += a[lane] * b[lane];
    }
}

fn total(lanes: &Lanes) -> f64 {
    lanes.iter().sum()
}

/// The normal equations after elimination of the monomials.
pub(super) struct Reduced<const P: usize, const K: usize> {
    /// S, decomposed.
    pub root: Cholesky<f64, Const<P>>,
    /// Its right-hand side.
    pub vector: SVector<f64, P>,
    /// L⁻¹ Bᵀ along x and y, and the same for the right-hand side of the monomials.
    pub coupling: [SMatrix<f64, K, P>; 2],
    vectors: [SVector<f64, K>; 2],
}

impl<'a, const P: usize, const K: usize> Adjustment<'a, P, K> {
    /// `None` for fewer equations than parameters.
    pub fn new(
        stars: &'a [MeasuredStar],
        camera: &CameraModel,
        icrs_to_camera: &Rotation<Icrs, Camera>,
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

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
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
    pub fn rows(&self, stars: &[MeasuredStar]) -> Option<EquationRows<P, K>> {
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
        Some(EquationRows {
            common,
            monomials: self.weighted_monomials([&u, &v], &weights),
            rhs,
        })
    }

    /// The normal equations at the present camera and attitude. `None` if a star is behind the
    /// camera, or the stars do not determine the parameters.
    pub fn reduced(&self) -> Option<Reduced<P, K>> {
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
        Some(Reduced {
            root,
            vector,
            coupling,
            vectors,
        })
    }

    /// One Gauss-Newton step. Returns its size (radians, and relative change of the focal length)
    /// and its normal equations.
    pub fn step(&mut self) -> Option<(f64, Reduced<P, K>)> {
        let reduced = self.reduced()?;
        let common = reduced.root.solve(&reduced.vector);
        let turn = Vector3::new(common[0], common[1], common[2]);
        let size = turn.norm().max(common[3].abs());
        if size.is_nan() || size > MAX_STEP {
            return None;
        }
        let of_monomials = [0, 1].map(|axis: usize| {
            let rest = reduced.vectors[axis] - reduced.coupling[axis] * common;
            self.inverse_root.tr_mul(&rest)
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
        Some((size, reduced))
    }

    /// Position by a pinhole minus position by the star's direction, of [`LANES`] stars or fewer.
    /// `None` if one is behind the camera.
    #[inline(always)]
    pub fn residuals_px(&self, stars: &[MeasuredStar]) -> Option<[Lanes; 2]> {
        let f = self.camera.focal_length_px;
        let (mut observed, mut tangents) = ([[0.0; LANES]; 2], [[0.0; LANES]; 2]);
        for (lane, star) in stars.iter().enumerate().take(LANES) {
            let (offset, tangent) = (self.camera.offset_of(&star.pixel), self.tangent(star)?);
            for axis in 0..2 {
                observed[axis][lane] = offset[axis];
                tangents[axis][lane] = tangent[axis];
            }
        }
        let mut residuals_px = self.camera.ideal_offsets(&observed);
        for axis in 0..2 {
            add_scaled(&mut residuals_px[axis], -f, &tangents[axis]);
        }
        Some(residuals_px)
    }
}

/// Adds `values` times `factor` to `sums`.
#[inline(always)]
pub(super) fn add_scaled(sums: &mut Lanes, factor: f64, values: &Lanes) {
    for lane in 0..LANES {
        sums[lane] += factor * values[lane];
    }
}

/// Fills `residuals_px` with those of all stars; `None` if one is behind the camera.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(super) fn all_residuals_px<const P: usize, const K: usize>(
    adjustment: &Adjustment<P, K>,
    residuals_px: &mut Vec<[f64; 2]>,
) -> Option<()> {
    residuals_px.clear();
    for stars in adjustment.stars.chunks(LANES) {
        let [x, y] = adjustment.residuals_px(stars)?;
        residuals_px.extend((0..stars.len()).map(|lane| [x[lane], y[lane]]));
    }
    Some(())
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
