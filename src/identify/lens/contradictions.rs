//! Which frames contradict the others, where no lens fits all of them?

use super::frames::Unfit;
use crate::base::statistics::median;
use crate::identify::fit::{JointFit, JointFrame, fit_jointly};

/// The median distance of a frame's stars, over that of all frames, at which the lens misses them.
pub(super) const MISFIT: f64 = 2.0;
/// The least such distance, in pixels.
pub(super) const MISFIT_PX: f64 = 0.1;
/// Frames that are tried as those that the others are compared with.
const MAX_REFERENCES: usize = 12;

/// The frames whose stars are missed by a lens that is fitted to them and to one frame, although their own
/// lens does not miss them: of the frames that could be that one, it is the one with the fewest such, of
/// these the first. `fit` is that of all.
pub(super) fn contradictions(frames: &[JointFrame], fit: &JointFit) -> Vec<(usize, Unfit)> {
    let together_px = |frames: &[JointFrame]| {
        let fit = fit_jointly(frames, &fit.camera, fit.camera.distortion_model())?;
        Some(distances_px(&fit))
    };
    let alone_px = frames.iter().map(|frame| {
        let own = together_px(std::slice::from_ref(frame));
        own.map_or(f64::INFINITY, |own| own[0])
    });
    let alone_px: Vec<f64> = alone_px.collect();
    let against = |reference: usize| {
        let others = frames.iter().enumerate().filter(|(j, _)| *j != reference);
        let missed = others.filter_map(|(number, frame)| {
            let pair = [frames[reference].clone(), frame.clone()];
            let found_px = together_px(&pair)?;
            let own_px = [alone_px[reference], alone_px[number]];
            let worst = if found_px[0] / own_px[0] > found_px[1] / own_px[1] {
                0
            } else {
                1
            };
            let (found_px, expected_px) = (found_px[worst], own_px[worst]);
            let is_missed = found_px > (MISFIT * expected_px).max(MISFIT_PX);
            is_missed.then_some((
                number,
                Unfit::Misfit {
                    found_px,
                    expected_px,
                },
            ))
        });
        missed.collect::<Vec<_>>()
    };
    let references = 0..frames.len().min(MAX_REFERENCES);
    references
        .map(against)
        .min_by_key(Vec::len)
        .unwrap_or_default()
}

/// The median distance of the stars of each frame, in pixels.
pub(super) fn distances_px(fit: &JointFit) -> Vec<f64> {
    let of_frame = |residuals: &Vec<[f64; 2]>| {
        let distances = residuals.iter().map(|[x, y]| libm::hypot(*x, *y));
        median(&mut distances.collect::<Vec<f64>>())
    };
    fit.residuals_px.iter().map(of_frame).collect()
}
