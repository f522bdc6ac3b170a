//! Which lens: the ideal lens, and the terms of its distortion.
//!
//! Lenses are compared by how well they predict stars that are left out of the fit.

use super::{MeasuredStar, POSE_PARAMETERS, Predictions, fit_camera, predictions_by_terms};
use crate::base::coords::{Camera, Icrs, Rotation, small_turn_rad};
use crate::camera::{CameraModel, Distortion, DistortionModel, Projection};
use crate::identify::field::StarField;
use crate::identify::grid::FrameGrid;
use crate::identify::hypothesis::Hypothesis;
use arrayvec::ArrayVec;
use nalgebra::{Matrix4, Vector4};

/// Equations per parameter that a distortion model needs.
const EQUATIONS_PER_PARAMETER: f64 = 4.0;
/// Gain in likelihood of the stars left out of the fit (twice its logarithm) that each further term
/// of a lens needs. It is small: a term that is missed shifts the focal length by several standard
/// errors, and one that is not needed makes these larger, but not false.
const WORTH_A_TERM: f64 = 3.0;
/// The same that the monomials need together: the stars that are left out tell of terms too many.
const WORTH_MONOMIALS: f64 = 12.0;
/// The same that a lens other than a pinhole needs.
const WORTH_A_PROJECTION: f64 = 6.0;
/// Angle from the boresight to the corners above which projections are compared, in radians. In
/// narrower fields the term r³ is all by which they differ.
pub(crate) const WIDE_RAD: f64 = 0.3;
/// So many times more is needed where the stars do not determine the model as far as the corners:
/// one in 4000 first terms gains that by chance.
const WORTH_A_GUESS: f64 = 4.5;
/// Largest standard error at a corner of a model that the stars determine, in widths of the frame.
const KNOWN_CORNER: f64 = 1e-3;
/// With few equations the required gain is larger: the F distribution has heavier tails than χ².
const TAIL_EQUATIONS: f64 = 8.0;

/// A kind of lens.
#[derive(Clone, Copy, PartialEq)]
pub struct LensKind {
    /// The ideal lens.
    pub projection: Projection,
    /// The terms of its distortion.
    pub model: Option<DistortionModel>,
}

impl LensKind {
    /// That of a camera.
    pub fn of(camera: &CameraModel) -> Self {
        Self {
            projection: camera.projection(),
            model: camera.distortion_model(),
        }
    }
}

/// A lens that was chosen.
#[derive(Clone, Copy)]
pub struct ChosenLens {
    /// The lens.
    pub lens: LensKind,
    /// Covariance of the pose about that of the lens, as in [`CameraFit`](super::CameraFit), among projections that
    /// explain the stars nearly as well.
    pub covariance: Matrix4<f64>,
}

impl From<LensKind> for ChosenLens {
    /// A lens without rivals.
    fn from(lens: LensKind) -> Self {
        Self {
            lens,
            covariance: Matrix4::zeros(),
        }
    }
}

/// A projection with the distortion that it needs.
struct Rival {
    lens: LensKind,
    /// −2 ln of its likelihood, with penalties.
    misfit: f64,
    fitted: Hypothesis,
}

/// A camera with another projection, which sees the same near the axis of its lens, and its attitude.
pub fn with_projection(
    hypothesis: &Hypothesis,
    projection: Projection,
) -> (CameraModel, Rotation<Icrs, Camera>) {
    let Hypothesis {
        camera,
        icrs_to_camera,
        ..
    } = hypothesis;
    if camera.projection() == projection {
        return (*camera, *icrs_to_camera);
    }
    let other = camera.reprojected(projection);
    let of_axes = other.lens_axes().transpose() * camera.lens_axes();
    (
        other,
        Rotation::from_matrix(of_axes * icrs_to_camera.matrix()),
    )
}

/// The choice of a lens for the stars of a fit.
pub struct LensChoice<'a> {
    /// The field.
    pub field: &'a StarField,
    /// The stars.
    pub stars: &'a [MeasuredStar],
    /// Their residuals after the last fit; then a buffer.
    pub residuals_px: &'a mut Vec<[f64; 2]>,
}

impl Rival {
    /// Covariance of the pose about this one's among all, which count as likely as they are.
    ///
    /// # Reference
    /// Hoeting et al. 1999, Statist. Sci. 14, 382, eq. 2, for the variance between models.
    fn covariance(&self, all: &[Self]) -> Matrix4<f64> {
        let weight = |rival: &Self| libm::exp(0.5 * (self.misfit - rival.misfit));
        let (mut weights, mut sum) = (0.0, Matrix4::zeros());
        for rival in all {
            let change = self.change_to(rival);
            weights += weight(rival);
            sum += change * change.transpose() * weight(rival);
        }
        sum / weights
    }

    /// The small turn from this pose to another, and the change of ln f.
    fn change_to(&self, other: &Self) -> Vector4<f64> {
        let (camera, icrs_to_camera) = with_projection(&other.fitted, self.lens.projection);
        let turn = icrs_to_camera.matrix() * self.fitted.icrs_to_camera.matrix().transpose();
        let scale = camera.central_focal_length_px() / self.fitted.camera.central_focal_length_px();
        small_turn_rad(&turn).push(libm::log(scale))
    }
}

impl LensChoice<'_> {
    /// The lens that predicts left-out stars best, for its number of terms. Only a wide field tells
    /// projections apart.
    pub fn choose(&mut self, hypothesis: &Hypothesis, richest: DistortionModel) -> ChosenLens {
        let is_regular = !depend_on_place(self.field, self.stars, self.residuals_px);
        let least = DistortionModel::Stretched;
        let affordable = |model: &DistortionModel| is_affordable(*model, self.stars.len());
        let of_all = DistortionModel::ALL.into_iter().filter(affordable);
        let richest = of_all.fold(least, DistortionModel::max).min(richest);
        let richest = if is_regular {
            richest.min(least)
        } else {
            richest
        };
        let is_wide = hypothesis.camera.radius_rad() > WIDE_RAD;
        if is_wide && richest > DistortionModel::Radial {
            return self.choose_projection(hypothesis, richest);
        }
        let projection = Projection::Pinhole;
        let (camera, icrs_to_camera) = with_projection(hypothesis, projection);
        let hypothesis = Hypothesis {
            camera,
            icrs_to_camera,
            ..*hypothesis
        };
        let linear = self.choose_model(&hypothesis, richest);
        let model = hypothesis.camera.distortion_model();
        let (model, misfit) = linear.unwrap_or((model, f64::INFINITY));
        if is_regular || richest <= DistortionModel::Radial || model >= Some(least) {
            return LensKind { projection, model }.into();
        }
        // A lens that is far from the present one shows what it is worth only once it is fitted.
        let fitted = self.fitted_lens(&hypothesis, projection);
        let richer = fitted.and_then(|fitted| self.choose_model(&fitted, richest));
        let better = richer.filter(|(richer, less)| *richer > model && *less < misfit);
        let model = better.map_or(model, |(model, _)| model);
        LensKind { projection, model }.into()
    }

    /// The lens whose projection, with the distortion that it needs, predicts left-out stars best. One
    /// that needs more distortion than a pinhole is no better than a pinhole.
    fn choose_projection(
        &mut self,
        hypothesis: &Hypothesis,
        richest: DistortionModel,
    ) -> ChosenLens {
        let mut rivals = ArrayVec::<Rival, { Projection::ALL.len() }>::new();
        let mut pinhole_px = f64::INFINITY;
        for projection in Projection::ALL {
            let Some(fitted) = self.fitted_lens(hypothesis, projection) else {
                continue;
            };
            let Some((model, misfit)) = self.choose_model(&fitted, richest) else {
                continue;
            };
            let distortion = fitted.camera.distortion().filter(|_| model.is_some());
            let largest_px = distortion.map_or(0.0, Distortion::largest_px);
            if projection == Projection::Pinhole {
                pinhole_px = largest_px;
            } else if largest_px > pinhole_px {
                continue;
            }
            rivals.push(Rival {
                lens: LensKind { projection, model },
                misfit: misfit + worth_a_projection(projection),
                fitted,
            });
        }
        let best = rivals.iter().min_by(|a, b| a.misfit.total_cmp(&b.misfit));
        best.map_or(LensKind::of(&hypothesis.camera).into(), |best| ChosenLens {
            lens: best.lens,
            covariance: best.covariance(&rivals),
        })
    }

    /// The best lens of a projection, with all the terms of lenses that the stars can afford.
    fn fitted_lens(
        &mut self,
        hypothesis: &Hypothesis,
        projection: Projection,
    ) -> Option<Hypothesis> {
        let affordable = |model: &DistortionModel| is_affordable(*model, self.stars.len());
        let model = DistortionModel::LENSES.into_iter().filter(affordable).max();
        let (camera, icrs_to_camera) = with_projection(hypothesis, projection);
        let fit = fit_camera(
            self.stars,
            &camera,
            &icrs_to_camera,
            model,
            self.residuals_px,
        )?;
        Some(Hypothesis {
            camera: fit.camera,
            icrs_to_camera: fit.icrs_to_camera,
            ..*hypothesis
        })
    }

    /// The simplest distortion model that no richer one clearly surpasses in predicting left-out stars;
    /// and by how much it misses them, with a penalty for its terms.
    fn choose_model(
        &self,
        hypothesis: &Hypothesis,
        richest: DistortionModel,
    ) -> Option<(Option<DistortionModel>, f64)> {
        let Hypothesis {
            camera,
            icrs_to_camera,
            ..
        } = hypothesis;
        let predictions = predictions_by_terms(self.stars, camera, icrs_to_camera, richest)?;
        let equations = 2.0 * self.stars.len() as f64;
        let heavier_tails = equations / (equations - TAIL_EQUATIONS).max(1.0);
        let known_corner_px = KNOWN_CORNER * camera.width_px;
        let mut best = (None, predictions[0].left_out_chi_sq);
        let mut is_best_a_guess = false;
        for model in DistortionModel::ALL {
            if model > richest || !is_affordable(model, self.stars.len()) {
                break;
            }
            let is_guess = |found: &Predictions| found.corner_sigma_px > known_corner_px;
            let is_better = |found: &Predictions| {
                let of_guess = match (is_guess(found), is_best_a_guess) {
                    (false, _) => 1.0,
                    (true, false) => WORTH_A_GUESS,
                    // The simplest guess brings more stars, and these tell whether it is enough.
                    (true, true) => WORTH_A_GUESS.powi(2),
                };
                let worth = heavier_tails * of_guess * least_gain(model, best.0);
                equations * libm::log(best.1 / found.left_out_chi_sq) > worth
            };
            let found = &predictions[model.terms()];
            if is_better(found) {
                is_best_a_guess = is_guess(found);
                best = (Some(model), found.left_out_chi_sq);
            }
        }
        let (model, left_out_chi_sq) = best;
        let penalty = model.map_or(0.0, |model| least_gain(model, None));
        Some((
            model,
            equations * libm::log(left_out_chi_sq) + heavier_tails * penalty,
        ))
    }
}

/// Whether the residuals of the last fit are alike in places next to each other: a lens model is
/// too simple then.
pub fn depend_on_place(
    field: &StarField,
    stars: &[MeasuredStar],
    residuals_px: &[[f64; 2]],
) -> bool {
    const CELLS_ALONG: usize = 6;
    /// With the border of the grid.
    const CELLS: usize = (CELLS_ALONG + 2) * (CELLS_ALONG + 2);
    /// Standard deviations of the sum of squares that chance does not reach.
    const SIGMAS: f64 = 4.0;
    let grid = FrameGrid::new(field, CELLS_ALONG);
    let mut sums = [[0.0; 3]; CELLS];
    let mut squares = 0.0;
    for (star, [x, y]) in stars.iter().zip(residuals_px) {
        let [x, y] = [x / star.sigma_px, y / star.sigma_px];
        if let Some(sums) = sums.get_mut(grid.cell_of(star.pixel.x, star.pixel.y)) {
            *sums = [sums[0] + x, sums[1] + y, sums[2] + 1.0];
        }
        squares += x * x + y * y;
    }
    let variance = squares / (2.0 * stars.len() as f64);
    let filled = sums.iter().filter(|[_, _, stars]| *stars > 0.0);
    let (mut of_cells, mut freedoms) = (0.0, 0.0);
    for [x, y, stars] in filled {
        of_cells += (x * x + y * y) / (stars * variance);
        freedoms += 2.0;
    }
    of_cells > freedoms + SIGMAS * (2.0_f64 * freedoms).sqrt()
}

/// The gain in likelihood over a simpler model that a model needs.
pub(crate) fn least_gain(model: DistortionModel, simpler: Option<DistortionModel>) -> f64 {
    if model >= DistortionModel::Irregular3 {
        return WORTH_MONOMIALS + least_gain(DistortionModel::Stretched, simpler).max(0.0);
    }
    let terms = simpler.map_or(0, DistortionModel::terms);
    WORTH_A_TERM * (model.terms() as f64 - terms as f64)
}

/// The gain in likelihood that a projection needs.
pub(crate) fn worth_a_projection(projection: Projection) -> f64 {
    match projection {
        Projection::Pinhole => 0.0,
        _ => WORTH_A_PROJECTION,
    }
}

/// Whether there are stars enough for a model.
pub(crate) fn is_affordable(model: DistortionModel, stars: usize) -> bool {
    2.0 * stars as f64 >= EQUATIONS_PER_PARAMETER * (model.terms() + POSE_PARAMETERS) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, UnitVector};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    #[test]
    fn residuals_that_are_alike_in_a_place_show() {
        const SIGMA_PX: f64 = 0.1;
        let field = StarField::of_places([1000.0, 800.0], &[]);
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let (mut stars, mut by_chance, mut bent) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..300 {
            let (x, y) = (rng.random_range(0.0..1000.0), rng.random_range(0.0..800.0));
            stars.push(MeasuredStar {
                pixel: PixelPoint::new(x, y),
                icrs: UnitVector::from_ra_dec(0.0, 0.0),
                sigma_px: SIGMA_PX,
            });
            let mut error = || SIGMA_PX * rng.sample::<f64, _>(StandardNormal);
            let residual = [error(), error()];
            by_chance.push(residual);
            bent.push([residual[0] + 0.15 * (x / 150.0).sin(), residual[1]]);
        }
        assert!(!depend_on_place(&field, &stars, &by_chance));
        assert!(depend_on_place(&field, &stars, &bent));
    }
}
