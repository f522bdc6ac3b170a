//! Dark current and bias: the level against the exposure.

use super::robust::mean_and_sigma;
use crate::base::statistics::{Estimate, median};

/// What grows with the exposure, and what does not.
#[derive(Debug, Clone, PartialEq)]
pub struct DarkCurrent {
    /// Mean over all pixels, in ADU a second; its standard error is that of the frames' levels about the line, and none
    /// where two frames give a line without a doubt.
    pub mean_adu_s: (f64, Option<f64>),
    /// Median over the pixels, in ADU a second: the current of an ordinary pixel.
    pub median_adu_s: f64,
    /// The level without exposure, mean over all pixels, in ADU, and its standard error.
    pub bias_adu: (f64, Option<f64>),
    /// Of each pixel, in ADU a second; NaN where it has no value.
    pub of_pixels_adu_s: Vec<f32>,
}

/// A straight line by least squares: where it is at 0, its slope, and their standard errors where there are more than two points.
struct Line {
    at_zero: (f64, Option<f64>),
    slope: (f64, Option<f64>),
}

impl Line {
    /// Nothing where all points have the same abscissa.
    fn through(points: &[(f64, f64)]) -> Option<Self> {
        let n = points.len() as f64;
        let mean_x = points.iter().map(|p| p.0).sum::<f64>() / n;
        let mean_y = points.iter().map(|p| p.1).sum::<f64>() / n;
        let spread: f64 = points.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
        if spread <= 0.0 {
            return None;
        }
        let product: f64 = points.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
        let slope = product / spread;
        let at_zero = mean_y - slope * mean_x;
        let residuals = points.iter().map(|p| (p.1 - at_zero - slope * p.0).powi(2));
        let variance = (points.len() > 2).then(|| residuals.sum::<f64>() / (n - 2.0));
        Some(Self {
            at_zero: (
                at_zero,
                variance.map(|v| (v * (1.0 / n + mean_x * mean_x / spread)).sqrt()),
            ),
            slope: (slope, variance.map(|v| (v / spread).sqrt())),
        })
    }
}

impl DarkCurrent {
    /// From the mean level of each frame with its exposure, and the pixels' means at each exposure with the number of its
    /// frames. Nothing where there is one exposure only.
    pub(super) fn of(frames: &[(f64, f64)], groups: &[(f64, usize, &[f32])]) -> Option<Self> {
        let line = Line::through(frames)?;
        let all: f64 = groups.iter().map(|g| g.1 as f64).sum();
        let mean_s = groups.iter().map(|g| g.0 * g.1 as f64).sum::<f64>() / all;
        let spread: f64 = groups
            .iter()
            .map(|g| g.1 as f64 * (g.0 - mean_s).powi(2))
            .sum();
        let pixels = groups.first()?.2.len();
        // Σ w (t − t̄) y / Σ w (t − t̄)²; the mean of y drops out.
        let slope = |pixel: usize| -> f32 {
            let product: f64 = groups
                .iter()
                .map(|(exposure_s, count, means)| {
                    *count as f64 * (exposure_s - mean_s) * f64::from(means[pixel])
                })
                .sum();
            (product / spread) as f32
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
            bias_adu: line.at_zero,
            of_pixels_adu_s: of_pixels,
        })
    }

    /// The median and its standard error: what all pixels share, and that of a median of so many.
    pub fn median(&self) -> Option<Estimate> {
        let valid = self.of_pixels_adu_s.iter().filter(|v| !v.is_nan());
        let of_pixels = super::robust::Typical::of(&self.of_pixels_adu_s, 0.0)?;
        let of_median =
            std::f64::consts::FRAC_PI_2.sqrt() * of_pixels.spread / (valid.count() as f64).sqrt();
        Some(Estimate {
            value: self.median_adu_s,
            sigma: self.mean_adu_s.1?.hypot(of_median),
        })
    }
}

/// How much the level varies from frame to frame, in ADU: the standard deviation of their means.
pub(super) fn frame_to_frame_adu(means: impl Iterator<Item = f64>) -> f64 {
    mean_and_sigma(means).spread
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_and_its_errors_are_those_of_the_textbook() {
        // Bevington's formulas by hand: x̄ 2, ȳ 5, Σ(x−x̄)² 2, slope 2, at zero 1, residuals ⅓(−1, 2, −1).
        let third = 1.0 / 3.0;
        let line = Line::through(&[
            (1.0, 3.0 - third),
            (2.0, 5.0 + 2.0 * third),
            (3.0, 7.0 - third),
        ])
        .unwrap();
        assert!((line.slope.0 - 2.0).abs() < 1e-12 && (line.at_zero.0 - 1.0).abs() < 1e-12);
        // s² = 6/9 over one degree of freedom.
        let variance = 6.0 / 9.0;
        assert!((line.slope.1.unwrap() - f64::sqrt(variance / 2.0)).abs() < 1e-12);
        assert!((line.at_zero.1.unwrap() - f64::sqrt(variance * (1.0 / 3.0 + 2.0))).abs() < 1e-12);
        assert!(Line::through(&[(1.0, 1.0), (1.0, 2.0)]).is_none());
        assert!(
            Line::through(&[(1.0, 1.0), (2.0, 2.0)])
                .unwrap()
                .slope
                .1
                .is_none()
        );
    }
}
