//! How well a fit of each lens model predicts what is not in it: a star that is left out, and the
//! corners of the frame.
//!
//! The residual of an equation that is left out is its residual over 1 − h, with h its leverage, so
//! no fit is repeated (Allen 1974, Technometrics 16, 125). The models of lenses are nested: each
//! has the terms of those before it. One orthogonalisation of all terms gives residuals and
//! leverages of each model in turn.

use super::adjustment::{
    Adjustment, EquationRows, LINEAR_TERMS, Lanes, MeasuredStar, POSE_PARAMETERS, Reduced,
    add_products, add_scaled,
};
use crate::base::coords::{Camera, Icrs, Rotation};
use crate::camera::{
    CUBIC_MONOMIALS, CameraModel, DistortionModel, LANES, LENS_TERMS, QUINTIC_MONOMIALS,
};
use multiversion::multiversion;
use nalgebra::{SMatrix, SVector};

/// Smallest freedom of an equation at which its left-out residual is defined.
const MIN_FREEDOM: f64 = 1e-6;
/// Parameters of a camera with all terms of a lens.
const LENS_PARAMETERS: usize = POSE_PARAMETERS + LENS_TERMS;

/// How well the fit of a model predicts what is not in it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Predictions {
    /// Σ (residual / σ)² with each equation predicted by a fit to the others. It grows where a
    /// model has too much freedom.
    pub left_out_chi_sq: f64,
    /// Largest standard error of a predicted position at a corner of the frame, in pixels.
    pub corner_sigma_px: f64,
}

/// The predictions by lenses with no terms, with the first, with the first two and so on, to all of
/// [`DistortionModel::BrownConrady`]. `camera` and `icrs_to_camera` must be close to the best ones.
///
/// `None` where the stars do not determine the parameters.
pub fn predictions_by_lens_terms(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
) -> Option<[Predictions; LENS_TERMS + 1]> {
    let model = Some(DistortionModel::BrownConrady);
    let adjustment = Adjustment::<LENS_PARAMETERS, 0>::new(stars, camera, icrs_to_camera, model)?;
    let reduced = adjustment.reduced()?;
    let shares = reduced
        .root
        .l_dirty()
        .solve_lower_triangular(&reduced.vector)?;
    nested(&adjustment, &reduced, &shares)
}

/// The same for the richest models, [`DistortionModel::Cubic`] and [`DistortionModel::Quintic`].
pub fn predictions_by_polynomial(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    model: DistortionModel,
) -> Option<Predictions> {
    const PARAMETERS: usize = POSE_PARAMETERS + LINEAR_TERMS;
    if model == DistortionModel::Cubic {
        predictions(Adjustment::<PARAMETERS, CUBIC_MONOMIALS>::new(
            stars,
            camera,
            icrs_to_camera,
            Some(model),
        )?)
    } else {
        predictions(Adjustment::<PARAMETERS, QUINTIC_MONOMIALS>::new(
            stars,
            camera,
            icrs_to_camera,
            Some(model),
        )?)
    }
}

fn predictions<const P: usize, const K: usize>(
    mut adjustment: Adjustment<P, K>,
) -> Option<Predictions> {
    let (_, reduced) = adjustment.step()?;
    let corners = adjustment.rows(&corners(&adjustment))?;
    let leverages = leverages(&adjustment, &corners, &reduced);
    Some(Predictions {
        left_out_chi_sq: left_out_sum(&adjustment, &reduced)?,
        corner_sigma_px: corner_sigma_px(&leverages),
    })
}

/// The corners of the frame as stars with an error of 1 px: the leverages of their equations are
/// the squared errors of their predicted positions.
fn corners<const P: usize, const K: usize>(adjustment: &Adjustment<P, K>) -> [MeasuredStar; 4] {
    let camera = &adjustment.camera;
    let camera_to_icrs = adjustment.icrs_to_camera.inverse();
    camera.corners().map(|pixel| MeasuredStar {
        pixel,
        icrs: camera_to_icrs.apply(&camera.direction_of(&pixel)),
        sigma_px: 1.0,
    })
}

/// The larger of the errors at the [`corners`], from the leverages of their equations along x and y.
fn corner_sigma_px([along_x, along_y]: &[Lanes; 2]) -> f64 {
    let squares = along_x.iter().zip(along_y).map(|(x, y)| x + y);
    squares.fold(0.0, f64::max).sqrt()
}

/// The numbers of [`predictions_by_lens_terms`]; `shares` is L⁻¹ times the right-hand side.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn nested(
    adjustment: &Adjustment<LENS_PARAMETERS, 0>,
    reduced: &Reduced<LENS_PARAMETERS, 0>,
    shares: &SVector<f64, LENS_PARAMETERS>,
) -> Option<[Predictions; LENS_TERMS + 1]> {
    let root = reduced.root.l_dirty();
    let mut sums = [[0.0; LANES]; LENS_TERMS + 1];
    for stars in adjustment.stars.chunks(LANES) {
        let rows = adjustment.rows(stars)?;
        for axis in 0..2 {
            let (mut terms, mut residual) = (rows.common[axis], rows.rhs[axis]);
            let mut leverage = [0.0; LANES];
            for i in 0..LENS_PARAMETERS {
                orthogonalise(&mut terms, i, root);
                add_products(&mut leverage, &terms[i], &terms[i]);
                add_scaled(&mut residual, -shares[i], &terms[i]);
                if i + 1 >= POSE_PARAMETERS {
                    add_left_out(&mut sums[i + 1 - POSE_PARAMETERS], &residual, &leverage);
                }
            }
        }
    }
    let mut of_corners = [[[0.0; LANES]; 2]; LENS_TERMS + 1];
    let rows = adjustment.rows(&corners(adjustment))?;
    for (axis, &of_axis) in rows.common.iter().enumerate() {
        let (mut terms, mut leverage) = (of_axis, [0.0; LANES]);
        for i in 0..LENS_PARAMETERS {
            orthogonalise(&mut terms, i, root);
            add_products(&mut leverage, &terms[i], &terms[i]);
            if i + 1 >= POSE_PARAMETERS {
                of_corners[i + 1 - POSE_PARAMETERS][axis] = leverage;
            }
        }
    }
    Some(std::array::from_fn(|terms| Predictions {
        left_out_chi_sq: sums[terms].iter().sum(),
        corner_sigma_px: corner_sigma_px(&of_corners[terms]),
    }))
}

/// Makes the parameter `i` of the equations `terms` independent of those before it; `root` is the
/// triangular root of the normal matrix.
#[inline(always)]
fn orthogonalise<const P: usize>(terms: &mut [Lanes; P], i: usize, root: &SMatrix<f64, P, P>) {
    let (above, below) = terms.split_at_mut(i);
    let this = &mut below[0];
    for (j, above) in above.iter().enumerate() {
        add_scaled(this, -root[(i, j)], above);
    }
    *this = this.map(|value| value / root[(i, i)]);
}

#[inline(always)]
fn add_left_out(sums: &mut Lanes, residual: &Lanes, leverage: &Lanes) {
    for lane in 0..LANES {
        let left_out = residual[lane] / (1.0 - leverage[lane]).max(MIN_FREEDOM);
        sums[lane] += left_out * left_out;
    }
}

/// Σ (residual / σ)² over all equations, each residual as if its equation were left out of the fit.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn left_out_sum<const P: usize, const K: usize>(
    adjustment: &Adjustment<P, K>,
    reduced: &Reduced<P, K>,
) -> Option<f64> {
    let mut sum = 0.0;
    for stars in adjustment.stars.chunks(LANES) {
        let leverages = leverages(adjustment, &adjustment.rows(stars)?, reduced);
        let residuals_px = adjustment.residuals_px(stars)?;
        for (lane, star) in stars.iter().enumerate() {
            for axis in 0..2 {
                let freedom = (1.0 - leverages[axis][lane]).max(MIN_FREEDOM);
                sum += (residuals_px[axis][lane] / star.sigma_px / freedom).powi(2);
            }
        }
    }
    Some(sum)
}

/// The leverage of each equation of some stars, along x and y.
#[inline(always)]
fn leverages<const P: usize, const K: usize>(
    adjustment: &Adjustment<P, K>,
    rows: &EquationRows<P, K>,
    reduced: &Reduced<P, K>,
) -> [Lanes; 2] {
    let mut of_monomials = [[0.0; LANES]; K];
    let mut shared = [0.0; LANES];
    for (i, of_monomial) in of_monomials.iter_mut().enumerate() {
        for (j, monomial) in rows.monomials[..=i].iter().enumerate() {
            add_scaled(of_monomial, adjustment.inverse_root[(i, j)], monomial);
        }
        add_products(&mut shared, of_monomial, of_monomial);
    }
    let root = reduced.root.l_dirty();
    [0, 1].map(|axis: usize| {
        let (mut rest, mut leverage) = (rows.common[axis], shared);
        for i in 0..P {
            for (k, of_monomial) in of_monomials.iter().enumerate() {
                add_scaled(&mut rest[i], -reduced.coupling[axis][(k, i)], of_monomial);
            }
            orthogonalise(&mut rest, i, root);
            add_products(&mut leverage, &rest[i], &rest[i]);
        }
        leverage
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, UnitVector};

    /// A camera and its attitude, and stars whose positions scatter by about 0.1 px.
    fn scattered_stars() -> (CameraModel, Rotation<Icrs, Camera>, Vec<MeasuredStar>) {
        let camera = CameraModel::pinhole(1024.0, 768.0, 2000.0, false);
        let attitude = Rotation::looking_at(&UnitVector::from_ra_dec(0.0, 0.5), 0.0);
        let star = |i: usize| {
            let place = PixelPoint::new((i * 151 % 1024) as f64, (i * 89 % 768) as f64);
            let phase = (i * i * 7 % 31) as f64;
            let (dx, dy) = (0.1 * phase.sin(), 0.1 * (phase * 1.7).cos());
            MeasuredStar {
                pixel: PixelPoint::new(place.x + dx, place.y + dy),
                icrs: attitude.inverse().apply(&camera.direction_of(&place)),
                sigma_px: 0.1,
            }
        };
        (camera, attitude, (0..43).map(star).collect())
    }

    #[test]
    fn nested_models_are_as_each_by_itself() {
        let (camera, attitude, stars) = scattered_stars();
        let nested = predictions_by_lens_terms(&stars, &camera, &attitude).unwrap();
        let [radial, radial5, radial7, all] = DistortionModel::LENSES.map(Some);
        let alone = [
            (
                0,
                predictions(Adjustment::<4, 0>::new(&stars, &camera, &attitude, None).unwrap()),
            ),
            (
                1,
                predictions(Adjustment::<5, 0>::new(&stars, &camera, &attitude, radial).unwrap()),
            ),
            (
                2,
                predictions(Adjustment::<6, 0>::new(&stars, &camera, &attitude, radial5).unwrap()),
            ),
            (
                3,
                predictions(Adjustment::<7, 0>::new(&stars, &camera, &attitude, radial7).unwrap()),
            ),
            (
                7,
                predictions(Adjustment::<11, 0>::new(&stars, &camera, &attitude, all).unwrap()),
            ),
        ];
        for (terms, expected) in alone {
            let expected = expected.unwrap();
            let ratio = nested[terms].left_out_chi_sq / expected.left_out_chi_sq;
            assert!((ratio - 1.0).abs() < 1e-3, "{terms} {ratio}");
            let ratio = nested[terms].corner_sigma_px / expected.corner_sigma_px;
            assert!((ratio - 1.0).abs() < 1e-3, "{terms} {ratio}");
        }
    }

    #[test]
    fn too_much_freedom_shows() {
        let (camera, attitude, stars) = scattered_stars();
        let lenses = predictions_by_lens_terms(&stars, &camera, &attitude).unwrap();
        let quintic = DistortionModel::Quintic;
        let rich = predictions_by_polynomial(&stars, &camera, &attitude, quintic).unwrap();
        assert!(rich.left_out_chi_sq > lenses[0].left_out_chi_sq);
        assert!(rich.corner_sigma_px > lenses[0].corner_sigma_px);
    }
}
