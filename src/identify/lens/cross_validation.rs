//! Which lens predicts best the stars that a fit leaves out?

use super::repeats::Repeats;
use crate::base::coords::{Camera, Icrs, Rotation};
use crate::base::least_squares::huber_sigma;
use crate::base::statistics::median;
use crate::camera::{CameraModel, DistortionModel, Projection};
use crate::identify::fit::{
    JointFrame, WIDE_RAD, fit_jointly, is_affordable, least_gain, residuals_px, worth_a_projection,
};
use std::f64::consts::LN_2;

/// Parts of the stars, of which each is left out once.
const FOLDS: usize = 5;

/// A lens, and how it predicts stars that were left out.
#[derive(Debug, Clone, Copy)]
pub(super) struct TestedLens {
    pub projection: Projection,
    pub model: Option<DistortionModel>,
    /// Sum of the squared errors in standard errors, of which outliers have less.
    chi_sq: f64,
    /// Standard deviation of the errors on each axis, in pixels, from their median.
    pub rms_px: f64,
}

/// The lens that predicts left-out stars best for its number of terms. Only a wide field tells
/// projections apart. `None` where no lens can be fitted. The frames tell as much as `stars` that have nothing in
/// common.
pub(super) fn best_lens(
    frames: &[JointFrame],
    repeats: &Repeats,
    stars: f64,
    start: &CameraModel,
) -> Option<TestedLens> {
    let equations = 2.0 * stars;
    let projections = if start.radius_rad() > WIDE_RAD {
        Projection::ALL.to_vec()
    } else {
        vec![Projection::Pinhole]
    };
    let parted = Parted {
        frames,
        parts: (0..frames.len())
            .map(|frame| repeats.parts(frame, FOLDS))
            .collect(),
    };
    let of_projection = |projection: Projection| {
        let penalty = worth_a_projection(projection);
        let tested = best_model(&parted, &start.reprojected(projection), stars)?;
        Some((equations * libm::log(tested.chi_sq) + penalty, tested))
    };
    let tested = projections.into_iter().filter_map(of_projection);
    let best = tested.min_by(|(a, _), (b, _)| a.total_cmp(b));
    best.map(|(_, tested)| tested)
}

/// The simplest distortion that no richer one clearly surpasses.
fn best_model(frames: &Parted, start: &CameraModel, stars: f64) -> Option<TestedLens> {
    let equations = 2.0 * stars;
    let mut best: Option<TestedLens> = None;
    let models = DistortionModel::ALL.map(Some);
    for model in std::iter::once(None).chain(models) {
        if model.is_some_and(|model| !is_affordable(model, stars as usize)) {
            break;
        }
        let Some(tested) = test(frames, start, model) else {
            continue;
        };
        let is_better = |best: &TestedLens| {
            let wanted = model.map_or(0.0, |model| least_gain(model, best.model));
            equations * libm::log(best.chi_sq / tested.chi_sq) > wanted
        };
        if best.as_ref().is_none_or(is_better) {
            best = Some(tested);
        }
    }
    best
}

/// Standard deviation of residuals on each axis, from their squared distances.
pub(super) fn rms_px(squares_px2: &mut [f64]) -> f64 {
    (median(squares_px2) / (2.0 * LN_2)).sqrt()
}

/// Frames, and the part that each star of them is in.
struct Parted<'a> {
    frames: &'a [JointFrame],
    parts: Vec<Vec<usize>>,
}

impl Parted<'_> {
    /// The frames with the stars of one part, or of all others, and with these attitudes.
    fn part(
        &self,
        fold: usize,
        is_in: bool,
        attitudes: &[Rotation<Icrs, Camera>],
    ) -> Vec<JointFrame> {
        let frames = self.frames.iter().zip(&self.parts).zip(attitudes);
        let of_part = frames.map(|((frame, parts), attitude)| {
            let stars = frame.stars.iter().zip(parts);
            let stars = stars.filter(|(_, part)| (**part == fold) == is_in);
            JointFrame {
                stars: stars.map(|(star, _)| *star).collect(),
                icrs_to_camera: *attitude,
            }
        });
        of_part.collect()
    }
}

/// How a lens predicts the stars that are left out.
fn test(
    parted: &Parted,
    start: &CameraModel,
    model: Option<DistortionModel>,
) -> Option<TestedLens> {
    let whole = fit_jointly(parted.frames, start, model)?;
    let (mut chi_sq, mut squares) = (0.0, Vec::new());
    for fold in 0..FOLDS {
        let part = |is_in| parted.part(fold, is_in, &whole.attitudes);
        let fit = fit_jointly(&part(false), &whole.camera, model)?;
        for (left_out, attitude) in part(true).iter().zip(&fit.attitudes) {
            let residuals = residuals_px(&left_out.stars, &fit.camera, attitude)?;
            for (star, [x, y]) in left_out.stars.iter().zip(residuals) {
                let sigma_px = huber_sigma(star.sigma_px, libm::hypot(x, y));
                chi_sq += (x * x + y * y) / (sigma_px * sigma_px);
                squares.push(x * x + y * y);
            }
        }
    }
    Some(TestedLens {
        projection: start.projection(),
        model,
        chi_sq,
        rms_px: rms_px(&mut squares),
    })
}
