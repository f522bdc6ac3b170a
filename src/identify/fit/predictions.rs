//! How well a fit of each lens model predicts what is not in it: a star that is left out, and the
//! corners of the frame.
//!
//! The residual of an equation that is left out is its residual over 1 − h, with h its leverage, so
//! no fit is repeated (Allen 1974, Technometrics 16, 125). The models of lenses are nested: each
//! has the terms of those before it. One orthogonalisation of all terms gives residuals and
//! leverages of each model in turn.

use super::adjustment::{
    Adjustment, LANES, LENS_PARAMETERS, Lanes, MAX_PARAMETERS, MeasuredStar, Normal,
    POSE_PARAMETERS, add_products, add_scaled,
};
use crate::base::coords::{Camera, Icrs, Rotation};
use crate::camera::{CameraModel, DistortionModel, MAX_TERMS};
use multiversion::multiversion;
use nalgebra::{SMatrix, SVector};

/// Smallest freedom of an equation at which its left-out residual is defined.
const MIN_FREEDOM: f64 = 1e-6;

/// Parameters of [`DistortionModel::Irregular3`].
const CUBIC_PARAMETERS: usize = POSE_PARAMETERS + DistortionModel::Irregular3.terms();

/// How well the fit of a model predicts what is not in it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Predictions {
    /// Σ (residual / σ)² with each equation predicted by a fit to the others. It grows where a
    /// model has too much freedom.
    pub left_out_chi_sq: f64,
    /// Largest standard error of a predicted position at a corner of the frame, in pixels.
    pub corner_sigma_px: f64,
}

/// The predictions by distortions with no terms, with the first, with the first two and so on, to all
/// of `richest`, in a list for all terms that there are. `camera` and `icrs_to_camera` must be close to
/// the best ones.
///
/// `None` where the stars do not determine the parameters.
pub fn predictions_by_terms(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    richest: DistortionModel,
) -> Option<[Predictions; MAX_TERMS + 1]> {
    use DistortionModel::{Irregular3, Irregular5, Stretched};
    match richest {
        Irregular5 => of_terms::<MAX_PARAMETERS>(stars, camera, icrs_to_camera, Irregular5),
        Irregular3 => of_terms::<CUBIC_PARAMETERS>(stars, camera, icrs_to_camera, Irregular3),
        _ => of_terms::<LENS_PARAMETERS>(stars, camera, icrs_to_camera, Stretched),
    }
}

fn of_terms<const P: usize>(
    stars: &[MeasuredStar],
    camera: &CameraModel,
    icrs_to_camera: &Rotation<Icrs, Camera>,
    richest: DistortionModel,
) -> Option<[Predictions; MAX_TERMS + 1]> {
    let adjustment = Adjustment::<P>::new(stars, camera, icrs_to_camera, Some(richest));
    let normal = adjustment.normal()?;
    let shares = normal
        .root
        .l_dirty()
        .solve_lower_triangular(&normal.vector)?;
    nested(&adjustment, &normal, &shares)
}

/// The corners of the frame that see the sky, as stars with an error of 1 px: the leverages of their equations are
/// the squared errors of their predicted positions.
fn corners<const P: usize>(adjustment: &Adjustment<P>) -> impl Iterator<Item = MeasuredStar> {
    let camera = *adjustment.camera();
    let camera_to_icrs = adjustment.icrs_to_camera().inverse();
    camera.corners().into_iter().filter_map(move |pixel| {
        Some(MeasuredStar {
            pixel,
            icrs: camera_to_icrs.apply(&camera.direction_of(&pixel)?),
            sigma_px: 1.0,
        })
    })
}

/// The numbers of [`predictions_by_terms`]; `shares` is L⁻¹ times the right-hand side.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn nested<const P: usize>(
    adjustment: &Adjustment<P>,
    normal: &Normal<P>,
    shares: &SVector<f64, P>,
) -> Option<[Predictions; MAX_TERMS + 1]> {
    let root = normal.root.l_dirty();
    let mut sums = [[0.0; LANES]; MAX_TERMS + 1];
    for stars in adjustment.stars.chunks(LANES) {
        let rows = adjustment.rows(stars)?;
        for axis in 0..2 {
            let (mut terms, mut residual) = (rows.terms[axis], rows.rhs[axis]);
            let mut leverage = [0.0; LANES];
            for i in 0..P {
                orthogonalise(&mut terms, i, root);
                add_products(&mut leverage, &terms[i], &terms[i]);
                add_scaled(&mut residual, -shares[i], &terms[i]);
                if i + 1 >= POSE_PARAMETERS {
                    add_left_out(&mut sums[i + 1 - POSE_PARAMETERS], &residual, &leverage);
                }
            }
        }
    }
    let mut largest_px2 = [0.0_f64; MAX_TERMS + 1];
    for corner in corners(adjustment) {
        let rows = adjustment.rows(&[corner])?;
        let mut terms = rows.terms;
        let mut variance_px2 = 0.0;
        for i in 0..P {
            for of_axis in &mut terms {
                orthogonalise(of_axis, i, root);
                variance_px2 += of_axis[i][0].powi(2);
            }
            if i + 1 >= POSE_PARAMETERS {
                let largest_px2 = &mut largest_px2[i + 1 - POSE_PARAMETERS];
                *largest_px2 = largest_px2.max(variance_px2);
            }
        }
    }
    Some(std::array::from_fn(|terms| Predictions {
        left_out_chi_sq: sums[terms].iter().sum(),
        corner_sigma_px: largest_px2[terms].sqrt(),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, UnitVector};
    use crate::camera::LENS_TERMS;
    use crate::identify::fit::fit_camera;

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
                icrs: attitude
                    .inverse()
                    .apply(&camera.direction_of(&place).unwrap()),
                sigma_px: 0.1,
            }
        };
        (camera, attitude, (0..43).map(star).collect())
    }

    /// Σ (residual / σ)² with each star's fit made without its equations.
    fn left_out_sum(model: Option<DistortionModel>) -> f64 {
        let (camera, attitude, stars) = scattered_stars();
        let mut sum = 0.0;
        for left_out in 0..stars.len() {
            let mut others = stars.clone();
            others.remove(left_out);
            let mut residuals_px = Vec::new();
            let fit = fit_camera(&others, &camera, &attitude, model, &mut residuals_px).unwrap();
            let star = &stars[left_out];
            let there = fit
                .camera
                .pixel_of(&fit.icrs_to_camera.apply(&star.icrs))
                .unwrap();
            sum += (there.distance_to(&star.pixel) / star.sigma_px).powi(2);
        }
        sum
    }

    #[test]
    fn nested_models_predict_stars_as_fits_without_them() {
        let (camera, attitude, stars) = scattered_stars();
        let nested =
            predictions_by_terms(&stars, &camera, &attitude, DistortionModel::Stretched).unwrap();
        for model in [None]
            .into_iter()
            .chain(DistortionModel::ALL.map(Some))
            .take(6)
        {
            let found = nested[model.map_or(0, DistortionModel::terms)].left_out_chi_sq;
            // Each of the two equations is left out by itself, here both of a star.
            let ratio = found / left_out_sum(model);
            assert!((ratio - 1.0).abs() < 0.06, "{model:?} {ratio}");
        }
    }

    #[test]
    fn too_much_freedom_shows() {
        let (camera, attitude, stars) = scattered_stars();
        let nested =
            predictions_by_terms(&stars, &camera, &attitude, DistortionModel::Stretched).unwrap();
        let [few, all] = [nested[0], nested[LENS_TERMS]];
        assert!(all.left_out_chi_sq > few.left_out_chi_sq);
        assert!(all.corner_sigma_px > few.corner_sigma_px);
    }
}
