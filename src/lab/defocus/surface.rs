//! The surface of the paper: a polynomial of fourth degree in radius and noise.

use super::ErrorGrid;
use nalgebra::DMatrix;
use serde::Serialize;

/// Number of coefficients along either axis.
const TERMS: usize = 5;

/// σ_e as a polynomial: `Σ c[j][i] σ_s^j σ_g^i` (eqs. 9, 10 and 13).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Surface {
    /// Indexed by the power of the radius in pixels, then by that of the noise.
    pub coefficients: [[f64; TERMS]; TERMS],
}

/// Why no surface can be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// The grid is too small.
    #[error(
        "a surface of {TERMS} x {TERMS} coefficients needs at least {TERMS} radii and {TERMS} noise levels, \
         found {spots} and {noises}"
    )]
    TooFew {
        /// Number of radii.
        spots: usize,
        /// Number of noises.
        noises: usize,
    },
    /// A point has no error.
    #[error(
        "too few stars were detected at a radius of {spot_px} px and a noise of {noise}: {found} of {trials}"
    )]
    NoError {
        /// The radius.
        spot_px: f64,
        /// The noise.
        noise: f64,
        /// Number of detected stars.
        found: usize,
        /// Number of stars.
        trials: usize,
    },
}

impl Surface {
    /// The surface of the paper (its table 1, with the exponents that are missing in print).
    pub fn of_paper() -> Self {
        let mut coefficients = [[0.0; TERMS]; TERMS];
        let rows = include_str!("paper-surface.csv").lines().skip(1);
        for (row, line) in coefficients.iter_mut().zip(rows) {
            for (coefficient, text) in row.iter_mut().zip(line.split(',').skip(1)) {
                *coefficient = text.trim().parse().unwrap_or(f64::NAN);
            }
        }
        Self { coefficients }
    }

    /// The least-squares surface through all points with equal weights.
    ///
    /// Differs from the source: eq. (11) of the paper inverts BᵀB and GᵀG directly, which squares
    /// the condition number of the power basis. Here both axes are scaled to −1 to 1, the basis is
    /// Chebyshev's polynomials, and both systems are solved by QR decomposition; the result is then
    /// expanded in powers of radius and noise.
    ///
    /// # Errors
    /// [`SurfaceError`] if the grid does not determine a surface.
    pub fn fit(errors: &ErrorGrid) -> Result<Self, SurfaceError> {
        let (spots, noises) = (&errors.grid.spots_px, &errors.grid.noises);
        let too_few = SurfaceError::TooFew {
            spots: spots.len(),
            noises: noises.len(),
        };
        if let Some((spot_px, noise, point)) = errors.rows().find(|row| !row.2.rms_px.is_finite()) {
            let (found, trials) = (point.found, point.trials);
            return Err(SurfaceError::NoError {
                spot_px,
                noise,
                found,
                trials,
            });
        }
        let (Some(along), Some(across)) = (ScaledAxis::new(spots), ScaledAxis::new(noises)) else {
            return Err(too_few);
        };
        let values = errors.points.iter().map(|point| point.rms_px);
        let values = DMatrix::from_row_iterator(spots.len(), noises.len(), values);
        let fitted = along
            .solve(&values)
            .and_then(|by_spot| across.solve(&by_spot.transpose()))
            .ok_or(too_few)?;
        let powers = along.powers().transpose() * fitted.transpose() * across.powers();
        let mut coefficients = [[0.0; TERMS]; TERMS];
        for (j, row) in coefficients.iter_mut().enumerate() {
            for (i, coefficient) in row.iter_mut().enumerate() {
                *coefficient = powers[(j, i)];
            }
        }
        Ok(Self { coefficients })
    }

    /// The error at a radius in pixels and a noise, in pixels.
    pub fn at(&self, spot_px: f64, noise: f64) -> f64 {
        let of_noise = |row: &[f64; TERMS]| row.iter().rev().fold(0.0, |sum, c| sum * noise + c);
        let rows = self.coefficients.iter().rev();
        rows.fold(0.0, |sum, row| sum * spot_px + of_noise(row))
    }

    /// RMS residual of the errors, in pixels (eq. 14).
    pub fn residual_px(&self, errors: &ErrorGrid) -> f64 {
        root_mean_square(
            errors
                .rows()
                .map(|(spot_px, noise, point)| point.rms_px - self.at(spot_px, noise)),
        )
    }

    /// RMS difference from another surface at the points of `errors`, in pixels.
    pub fn difference_px(&self, other: &Self, errors: &ErrorGrid) -> f64 {
        root_mean_square(
            errors
                .rows()
                .map(|(spot_px, noise, _)| other.at(spot_px, noise) - self.at(spot_px, noise)),
        )
    }
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for value in values {
        sum += value * value;
        count += 1;
    }
    (sum / f64::from(count.max(1))).sqrt()
}

/// An axis scaled to −1 to 1: `t = (value − middle) / half`.
struct ScaledAxis {
    values: Vec<f64>,
    middle: f64,
    half: f64,
}

impl ScaledAxis {
    fn new(values: &[f64]) -> Option<Self> {
        let (first, last) = (*values.first()?, *values.last()?);
        (values.len() >= TERMS && last > first).then(|| Self {
            middle: 0.5 * (first + last),
            half: 0.5 * (last - first),
            values: values.to_vec(),
        })
    }

    /// Least-squares coefficients of Chebyshev's polynomials for each column of `right`.
    fn solve(&self, right: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let basis = DMatrix::from_fn(self.values.len(), TERMS, |row, degree| {
            let t = (self.values[row] - self.middle) / self.half;
            let mut pair = [1.0, t];
            for _ in 0..degree {
                pair = [pair[1], 2.0 * t * pair[1] - pair[0]];
            }
            pair[0]
        });
        let decomposed = basis.qr();
        decomposed
            .r()
            .solve_upper_triangular(&(decomposed.q().transpose() * right))
    }

    /// Chebyshev's polynomials, one per row, in powers of the value.
    fn powers(&self) -> DMatrix<f64> {
        let mut powers = DMatrix::zeros(TERMS, TERMS);
        powers[(0, 0)] = 1.0;
        for degree in 1..TERMS {
            // T₁ = t, T_n = 2 t T_(n−1) − T_(n−2), with t = (value − middle) / half.
            let twice = if degree == 1 { 1.0 } else { 2.0 };
            for power in 0..TERMS {
                let times_value = if power == 0 {
                    0.0
                } else {
                    powers[(degree - 1, power - 1)]
                };
                let times_t = (times_value - self.middle * powers[(degree - 1, power)]) / self.half;
                let before = if degree == 1 {
                    0.0
                } else {
                    powers[(degree - 2, power)]
                };
                powers[(degree, power)] = twice * times_t - before;
            }
        }
        powers
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::defocus::{ErrorPoint, SpotNoiseGrid};
    use crate::predict::Spacing;

    fn papers_grid(of: impl Fn(f64, f64) -> f64) -> ErrorGrid {
        let grid = SpotNoiseGrid {
            spots_px: Spacing::Linear.values(0.4, 2.4, 200),
            noises: Spacing::Linear.values(2e-4, 20e-4, 100),
        };
        let point = |value| ErrorPoint {
            trials: 20,
            found: 20,
            rms_px: value,
            rms_sigma_px: 0.0,
        };
        let places = grid
            .spots_px
            .iter()
            .flat_map(|&s| grid.noises.iter().map(move |&g| (s, g)));
        let points = places.map(|(s, g)| point(of(s, g))).collect();
        ErrorGrid { grid, points }
    }

    #[test]
    fn a_polynomial_is_found_again_to_the_last_digits() {
        let paper = Surface::of_paper();
        assert_eq!(paper.coefficients[3][4], 2.6108e10);
        let errors = papers_grid(|s, g| paper.at(s, g));
        let fitted = Surface::fit(&errors).unwrap();
        for (row, expected) in fitted.coefficients.iter().zip(paper.coefficients) {
            for (found, expected) in row.iter().zip(expected) {
                assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
            }
        }
        assert!(fitted.residual_px(&errors) < 1e-14);
    }

    #[test]
    fn a_small_grid_and_a_gap_are_refused() {
        let mut errors = papers_grid(|s, _| s);
        errors.points[105].rms_px = f64::NAN;
        let error = Surface::fit(&errors).unwrap_err().to_string();
        assert!(
            error.contains("0.41005025") && error.contains("20 of 20"),
            "{error}"
        );
        let mut small = papers_grid(|s, _| s);
        small.grid.spots_px.truncate(4);
        small.points.truncate(400);
        let error = Surface::fit(&small).unwrap_err().to_string();
        assert!(error.ends_with("found 4 and 100"), "{error}");
    }
}
