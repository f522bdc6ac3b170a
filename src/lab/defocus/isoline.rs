//! Lines of equal error over the noise, and the parabola fitted to them in the paper.

use super::{ErrorCurve, ErrorGrid};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// For each noise, the range of radii that meets an error (the paper's figure 4).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IsoLine {
    /// The error, in pixels.
    pub rms_px: f64,
    /// Points at the noises where a radius of the grid meets it.
    pub points: Vec<IsoPoint>,
    /// Smallest radius as a parabola of the noise, as the paper has it.
    pub radius_of_noise: Option<Parabola>,
    /// Noise as a parabola of the smallest radius.
    pub noise_of_radius: Option<Parabola>,
}

/// A point of a line of equal error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct IsoPoint {
    /// The noise.
    pub noise: f64,
    /// Smallest radius that meets the error, in pixels; none if the first of the grid does, as
    /// smaller ones may, too.
    pub smallest_px: Option<f64>,
    /// Largest radius that meets it; none if the last of the grid does.
    pub largest_px: Option<f64>,
}

/// Least-squares parabola `c₀ + c₁ x + c₂ x²`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Parabola {
    /// c₀, c₁, c₂.
    pub coefficients: [f64; 3],
    /// RMS residual, in units of y.
    pub residual: f64,
    /// RMS residual of a straight line, for comparison.
    pub residual_of_line: f64,
    /// Fraction of the variance that is explained (R²).
    pub explained: f64,
}

impl IsoLine {
    /// The line of an error, from the curves at the noises of the grid, where they exist.
    pub fn trace(errors: &ErrorGrid, curves: &[Option<ErrorCurve>], rms_px: f64) -> Self {
        let points: Vec<_> = errors
            .grid
            .noises
            .iter()
            .zip(curves)
            .filter_map(|(&noise, curve)| {
                let curve = curve.as_ref()?;
                let [first, last] = curve.range_px();
                let smallest = curve.smallest_within(rms_px)?;
                let largest = curve.largest_within(rms_px)?;
                Some(IsoPoint {
                    noise,
                    smallest_px: Some(smallest).filter(|px| *px > first),
                    largest_px: Some(largest).filter(|px| *px < last),
                })
            })
            .collect();
        let smallest = points.iter();
        let smallest = smallest.filter_map(|point| Some((point.noise, point.smallest_px?)));
        let pairs: Vec<_> = smallest.collect();
        let turned: Vec<_> = pairs.iter().map(|(noise, spot)| (*spot, *noise)).collect();
        Self {
            rms_px,
            radius_of_noise: Parabola::nearest_to(&pairs),
            noise_of_radius: Parabola::nearest_to(&turned),
            points,
        }
    }
}

impl Parabola {
    /// Fits a parabola to points (x, y); none for fewer than four points.
    pub fn nearest_to(points: &[(f64, f64)]) -> Option<Self> {
        if points.len() < 4 {
            return None;
        }
        let scale = points.iter().map(|(x, _)| x.abs()).fold(0.0, f64::max);
        let y = DVector::from_iterator(points.len(), points.iter().map(|(_, y)| *y));
        let fitted = |terms: usize| {
            let basis = DMatrix::from_fn(points.len(), terms, |row, power| {
                (points[row].0 / scale).powi(power as i32)
            });
            let solved = basis.clone().svd(true, true).solve(&y, 1e-12).ok()?;
            let residual = (&y - basis * &solved).norm() / (points.len() as f64).sqrt();
            Some((solved, residual))
        };
        let (line, parabola) = (fitted(2)?, fitted(3)?);
        let spread = y.add_scalar(-y.mean()).norm() / (points.len() as f64).sqrt();
        let coefficient = |power: usize| parabola.0[power] / scale.powi(power as i32);
        Some(Self {
            coefficients: [coefficient(0), coefficient(1), coefficient(2)],
            residual: parabola.1,
            residual_of_line: line.1,
            explained: 1.0 - (parabola.1 / spread).powi(2),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_found_again() {
        let of = |x: f64| 0.7 + 500.0 * x - 9e4 * x * x;
        let points: Vec<_> = (1..20)
            .map(|i| 1e-4 * f64::from(i))
            .map(|x| (x, of(x)))
            .collect();
        let found = Parabola::nearest_to(&points).unwrap();
        for (found, expected) in found.coefficients.iter().zip([0.7, 500.0, -9e4]) {
            assert!((found / expected - 1.0).abs() < 1e-9, "{found}");
        }
        assert!(found.residual < 1e-12 && found.explained > 0.999_999);
        // Residual of c₂ x² about its line: c₂ h² · √(4/45), h half the range, for many points.
        let expected = 9e4 * 9e-4f64.powi(2) * (4.0f64 / 45.0).sqrt();
        assert!((found.residual_of_line / expected - 1.0).abs() < 0.15);
        assert_eq!(Parabola::nearest_to(&points[..3]), None);
    }
}
