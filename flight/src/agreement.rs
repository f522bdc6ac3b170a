//! The attitude that most of the matches agree with.

use crate::attitude::{self, Fit};
use crate::tracker::Tracker;
use nalgebra::{Matrix3, Vector3};

/// Residuals of more standard errors are of something else.
pub(crate) const OUTLIER_SIGMAS: f64 = 5.0;
/// Squared residuals over their expectations that stated errors may lack.
pub(crate) const MAX_EXCESS: f64 = 16.0;
/// Rounds in which matches are left out.
const ROUNDS: usize = 4;
/// Steps of the fits at most.
pub(crate) const FIT_STEPS: usize = ROUNDS * attitude::STEPS;

impl Tracker<'_> {
    /// Fits an attitude to the first matches, without those that do not agree with it; also tells how many do. `None`
    /// where these are fewer than `least`.
    pub(crate) fn fit_agreeing(
        &mut self,
        matches: usize,
        start: &Matrix3<f64>,
        least: usize,
    ) -> Option<(Fit, usize)> {
        let mut count = matches;
        let mut start = *start;
        let mut last = None;
        for _ in 0..ROUNDS {
            if count < least {
                return None;
            }
            let pairs = &self.buffers.matches[..count];
            let iterations = &mut self.work.iterations;
            let fit = attitude::fit(
                pairs,
                &start,
                &self.lens,
                self.config.scale_error,
                iterations,
            )?;
            start = fit.icrs_to_camera;
            last = Some((fit, count));
            let kept = self.keep_agreeing(count, &fit);
            if kept == count {
                break;
            }
            count = kept;
        }
        last
    }

    /// Moves the matches that agree with an attitude to the front, and tells how many they are.
    fn keep_agreeing(&mut self, count: usize, fit: &Fit) -> usize {
        let focal_px = self.lens.camera.focal_length_px * fit.scale;
        let mut kept = 0;
        for number in 0..count {
            let pair = self.buffers.matches[number];
            let observed = attitude::with_scale(&Vector3::from(pair.observed), fit.scale);
            let off = observed - fit.icrs_to_camera * Vector3::from(pair.apparent);
            let cosine = observed.z;
            let off_px = off.norm() * focal_px / (cosine * cosine);
            let sigma_px =
                libm::sqrt(pair.variance_px2 * fit.reduced_chi_square.clamp(1.0, MAX_EXCESS));
            if off_px < OUTLIER_SIGMAS * sigma_px {
                self.buffers.matches.swap(kept, number);
                kept += 1;
            }
        }
        kept
    }
}
