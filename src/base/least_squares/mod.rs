//! Least squares: linear fits with few coefficients, and fits of any function.

mod levenberg_marquardt;

pub(crate) use levenberg_marquardt::levenberg_marquardt;

use nalgebra::{SMatrix, SVector};

/// Residual in standard errors from which on an equation pulls no harder.
const HUBER_SIGMAS: f64 = 2.5;

/// The normal equations of a linear fit of `N` coefficients.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LinearFit<const N: usize> {
    /// The information: the inverse of the covariance if weights are inverse variances.
    pub matrix: SMatrix<f64, N, N>,
    /// The right-hand side.
    pub vector: SVector<f64, N>,
}

impl<const N: usize> LinearFit<N> {
    /// Without equations.
    pub fn new() -> Self {
        Self {
            matrix: SMatrix::zeros(),
            vector: SVector::zeros(),
        }
    }

    /// Adds the equation coefficients · `terms` = value. Of the value it takes the product with the weight, which is
    /// a sum where the weight is a number of values.
    #[inline]
    pub fn add(&mut self, terms: &SVector<f64, N>, weight: f64, weighted_value: f64) {
        self.matrix += terms * terms.transpose() * weight;
        self.vector += terms * weighted_value;
    }

    /// The coefficients; `None` if the equations do not determine them.
    pub fn solve(&self) -> Option<SVector<f64, N>> {
        Some(self.matrix.cholesky()?.solve(&self.vector))
    }

    /// The coefficients with their covariance.
    pub fn solve_with_covariance(&self) -> Option<(SVector<f64, N>, SMatrix<f64, N, N>)> {
        let root = self.matrix.cholesky()?;
        Some((root.solve(&self.vector), root.inverse()))
    }

    /// The same equations with a diagonal that is larger by the part `damping`: their solution is a shorter step
    /// (Marquardt 1963, J. SIAM 11, 431).
    pub fn damped(mut self, damping: f64) -> Self {
        for i in 0..N {
            self.matrix[(i, i)] *= 1.0 + damping;
        }
        self
    }
}

/// The solution of two equations, and their determinant.
#[inline]
pub(crate) fn solve_pair([[a, b], [c, d]]: [[f64; 2]; 2], [p, q]: [f64; 2]) -> ([f64; 2], f64) {
    let determinant = a * d - b * c;
    let solution = [(d * p - b * q) / determinant, (a * q - c * p) / determinant];
    (solution, determinant)
}

/// The weight of an outlier, such as a star with an unresolved companion, over that of others, by its residual in
/// standard errors.
///
/// # Reference
/// Huber 1964, Ann. Math. Stat. 35, 73.
pub(crate) fn huber_weight(residual_sigmas: f64) -> f64 {
    (HUBER_SIGMAS / residual_sigmas).min(1.0)
}

/// The standard error of an outlier as it counts in a fit by [`huber_weight`].
pub(crate) fn huber_sigma(sigma: f64, residual: f64) -> f64 {
    sigma * (residual / (HUBER_SIGMAS * sigma)).max(1.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    #[test]
    fn a_line_and_its_errors_are_those_of_the_textbook() {
        // Through (1, 3), (2, 5) and (3, 7), each twice: Σ (x − x̄)² is 4.
        let mut fit = LinearFit::new();
        for x in [1.0, 2.0, 3.0] {
            fit.add(&Vector2::new(1.0, x), 2.0, 2.0 * (1.0 + 2.0 * x));
        }
        let (line, covariance) = fit.solve_with_covariance().unwrap();
        assert!((line - Vector2::new(1.0, 2.0)).norm() < 1e-12);
        assert!((covariance[(1, 1)] - 0.25).abs() < 1e-12);
        assert!((covariance[(0, 0)] - (1.0 / 6.0 + 4.0 / 4.0)).abs() < 1e-12);
        assert_eq!(fit.solve(), Some(line));
        let damped = fit.damped(1.0).solve().unwrap();
        assert!(damped.norm() < line.norm());
        let pair = fit.matrix.data.0;
        let (solution, determinant) = solve_pair(pair, fit.vector.data.0[0]);
        assert!((Vector2::from(solution) - line).norm() < 1e-12);
        assert!((determinant - fit.matrix.determinant()).abs() < 1e-12);
        assert_eq!(LinearFit::<2>::new().solve(), None);
    }

    #[test]
    fn an_outlier_pulls_no_harder_than_other_stars() {
        assert_eq!([0.0, 2.5, 5.0].map(huber_weight), [1.0, 1.0, 0.5]);
        assert_eq!(huber_sigma(0.1, 0.2), 0.1);
        let counted = huber_sigma(0.1, 1.0);
        assert!((counted - 0.1 / huber_weight(10.0).sqrt()).abs() < 1e-15);
    }
}
