//! Does the scale of the lens change from frame to frame, and over time?

use super::frames::LensFrame;
use crate::camera::CameraModel;
use crate::identify::fit::{MeasuredStar, fit_scale};

/// The scale of a frame relative to that of the lens, less 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrameScale {
    /// The relative difference.
    pub value: f64,
    /// Its standard error.
    pub sigma: f64,
}

/// A change of the scale over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaleDrift {
    /// Relative change per day.
    pub per_day: f64,
    /// Its standard error.
    pub sigma_per_day: f64,
    /// Standard deviation of the scales of the frames about it, in their standard errors: 1 if there is no
    /// other change.
    pub scatter: f64,
}

impl FrameScale {
    /// The scale of a frame, with the distortion of `camera`.
    pub(super) fn fit(frame: &LensFrame, camera: &CameraModel, excess_sigma_px: f64) -> Self {
        let with_excess = |star: &MeasuredStar| MeasuredStar {
            sigma_px: libm::hypot(star.sigma_px, excess_sigma_px),
            ..*star
        };
        let stars: Vec<MeasuredStar> = frame.joint.stars.iter().map(with_excess).collect();
        let [value, sigma] =
            fit_scale(&stars, camera, &frame.joint.icrs_to_camera).unwrap_or([0.0, f64::INFINITY]);
        Self { value, sigma }
    }
}

impl ScaleDrift {
    const DAYS_PER_YEAR: f64 = 365.25;

    /// The drift over the dates (Julian years) of frames; `None` if there are not two dates.
    pub(super) fn fit(frames: &[(f64, FrameScale)]) -> Option<Self> {
        let known = frames.iter().filter(|(_, scale)| scale.sigma.is_finite());
        let known: Vec<(f64, FrameScale)> = known.copied().collect();
        let weight = |scale: &FrameScale| scale.sigma.powi(-2);
        let sum = |value: &dyn Fn(f64, &FrameScale) -> f64| -> f64 {
            known
                .iter()
                .map(|(years, scale)| weight(scale) * value(*years, scale))
                .sum()
        };
        let total = sum(&|_, _| 1.0);
        let mean_years = sum(&|years, _| years) / total;
        let mean = sum(&|_, scale| scale.value) / total;
        let squares = sum(&|years, _| (years - mean_years).powi(2));
        // A second.
        if known.len() < 2 || squares < total * 1e-15 {
            return None;
        }
        let slope = sum(&|years, scale| (years - mean_years) * (scale.value - mean)) / squares;
        let about =
            sum(&|years, scale| (scale.value - mean - slope * (years - mean_years)).powi(2));
        let freedoms = (known.len() as f64 - 2.0).max(1.0);
        Some(Self {
            per_day: slope / Self::DAYS_PER_YEAR,
            sigma_per_day: squares.sqrt().recip() / Self::DAYS_PER_YEAR,
            scatter: (about / freedoms).sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drift_is_found_with_its_error() {
        let scale = |day: i32| {
            let years = 20.0 + f64::from(day) / 365.25;
            let error = if day % 2 == 0 { 1e-6 } else { -1e-6 };
            let value = 3e-6 * f64::from(day) + error;
            (years, FrameScale { value, sigma: 1e-6 })
        };
        let drift = ScaleDrift::fit(&(0..40).map(scale).collect::<Vec<_>>()).unwrap();
        assert!((drift.per_day - 3e-6).abs() < 3.0 * drift.sigma_per_day);
        assert!((0.8..1.2).contains(&drift.scatter), "{}", drift.scatter);
        assert!(ScaleDrift::fit(&[scale(1)]).is_none());
        assert!(ScaleDrift::fit(&[scale(1), scale(1)]).is_none());
    }
}
