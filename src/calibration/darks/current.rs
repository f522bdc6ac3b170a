//! Dark current and bias: a straight line through level over exposure.

use crate::base::statistics::{Estimate, median};
use crate::calibration::robust::RobustMoments;

/// A fitted value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedValue {
    /// The value.
    pub value: f64,
    /// Its standard error. `None` for a line through two points, which leaves no residuals.
    pub sigma: Option<f64>,
}

/// Dark current and bias.
#[derive(Debug, Clone, PartialEq)]
pub struct DarkCurrent {
    /// Mean dark current of all pixels, in ADU per second. Its standard error is from the residuals
    /// of the frames' levels.
    pub mean_adu_s: FittedValue,
    /// Median dark current of the pixels, in ADU per second.
    pub median_adu_s: f64,
    /// Mean level at exposure 0, in ADU.
    pub bias_adu: FittedValue,
    /// Dark current of each pixel, in ADU per second; NaN if it has no value.
    pub of_pixels_adu_s: Vec<f32>,
}

/// A straight line by least squares.
struct FittedLine {
    intercept: FittedValue,
    slope: FittedValue,
}

impl FittedLine {
    /// Fits a line to `points`. `None` if all have the same abscissa.
    fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let n = points.len() as f64;
        let mean_x = points.iter().map(|p| p.0).sum::<f64>() / n;
        let mean_y = points.iter().map(|p| p.1).sum::<f64>() / n;
        let sum_xx: f64 = points.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
        if sum_xx <= 0.0 {
            return None;
        }
        let sum_xy: f64 = points.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
        let slope = sum_xy / sum_xx;
        let intercept = mean_y - slope * mean_x;
        let residuals = points
            .iter()
            .map(|p| (p.1 - intercept - slope * p.0).powi(2));
        let variance = (points.len() > 2).then(|| residuals.sum::<f64>() / (n - 2.0));
        Some(Self {
            intercept: FittedValue {
                value: intercept,
                sigma: variance.map(|v| (v * (1.0 / n + mean_x * mean_x / sum_xx)).sqrt()),
            },
            slope: FittedValue {
                value: slope,
                sigma: variance.map(|v| (v / sum_xx).sqrt()),
            },
        })
    }
}

impl DarkCurrent {
    /// Fits the dark current to `frames`, exposure and mean level of each frame, and `groups`,
    /// exposure, number of frames and pixel means of each exposure. `None` if there is only one
    /// exposure.
    pub(super) fn fit(frames: &[(f64, f64)], groups: &[(f64, usize, &[f32])]) -> Option<Self> {
        let line = FittedLine::fit(frames)?;
        let all: f64 = groups.iter().map(|g| g.1 as f64).sum();
        let mean_s = groups.iter().map(|g| g.0 * g.1 as f64).sum::<f64>() / all;
        let sum_tt: f64 = groups
            .iter()
            .map(|g| g.1 as f64 * (g.0 - mean_s).powi(2))
            .sum();
        let pixels = groups.first()?.2.len();
        // Σ w (t − t̄) y / Σ w (t − t̄)²; the mean of y drops out.
        let slope = |pixel: usize| -> f32 {
            let sum_ty: f64 = groups
                .iter()
                .map(|(exposure_s, count, means)| {
                    *count as f64 * (exposure_s - mean_s) * f64::from(means[pixel])
                })
                .sum();
            (sum_ty / sum_tt) as f32
        };
        let of_pixels: Vec<f32> = (0..pixels).map(slope).collect();
        let valid = of_pixels
            .iter()
            .filter(|v| !v.is_nan())
            .map(|&v| f64::from(v));
        let mut sorted: Vec<f64> = valid.collect();
        Some(Self {
            mean_adu_s: line.slope,
            median_adu_s: median(&mut sorted),
            bias_adu: line.intercept,
            of_pixels_adu_s: of_pixels,
        })
    }

    /// The median dark current with its standard error: that of the mean and that of a median.
    pub fn median(&self) -> Option<Estimate> {
        let valid = self.of_pixels_adu_s.iter().filter(|v| !v.is_nan());
        let of_pixels = RobustMoments::clipped(&self.of_pixels_adu_s, 0.0)?;
        let of_median =
            std::f64::consts::FRAC_PI_2.sqrt() * of_pixels.sigma / (valid.count() as f64).sqrt();
        Some(Estimate {
            value: self.median_adu_s,
            sigma: libm::hypot(self.mean_adu_s.sigma?, of_median),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_and_its_errors_are_those_of_the_textbook() {
        // Bevington's formulas by hand: x̄ 2, ȳ 5, Σ(x−x̄)² 2, slope 2, intercept 1, residuals
        // ⅓(−1, 2, −1).
        let third = 1.0 / 3.0;
        let line = FittedLine::fit(&[
            (1.0, 3.0 - third),
            (2.0, 5.0 + 2.0 * third),
            (3.0, 7.0 - third),
        ])
        .unwrap();
        assert!(
            (line.slope.value - 2.0).abs() < 1e-12 && (line.intercept.value - 1.0).abs() < 1e-12
        );
        // s² = 6/9 over one degree of freedom.
        let variance = 6.0 / 9.0;
        assert!((line.slope.sigma.unwrap() - f64::sqrt(variance / 2.0)).abs() < 1e-12);
        assert!(
            (line.intercept.sigma.unwrap() - f64::sqrt(variance * (1.0 / 3.0 + 2.0))).abs() < 1e-12
        );
        assert!(FittedLine::fit(&[(1.0, 1.0), (1.0, 2.0)]).is_none());
        assert!(
            FittedLine::fit(&[(1.0, 1.0), (2.0, 2.0)])
                .unwrap()
                .slope
                .sigma
                .is_none()
        );
    }
}
