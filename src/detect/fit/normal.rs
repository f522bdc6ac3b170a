//! Normal equations of a weighted least-squares fit, solved by the square-root-free Cholesky
//! factorisation A = L D Lᵀ.

#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns of matrices read best as indices"
)]

/// Normal equations of one linearised step for at most `N` parameters.
#[derive(Debug, Clone)]
pub(crate) struct NormalEquations<const N: usize> {
    /// Lower triangle of the normal matrix; after [`Self::factorise`] that of the factor L, whose
    /// diagonal is one.
    pub matrix: [[f64; N]; N],
    /// Inverse of the diagonal D.
    pub inverse: [f64; N],
    /// Right-hand side: half the negative gradient of chi².
    pub right: [f64; N],
    /// Sum of squared residuals over their variance.
    pub chi2: f64,
    /// Number of pixels.
    pub pixels: usize,
}

impl<const N: usize> NormalEquations<N> {
    /// Equations without any pixel.
    pub fn empty() -> Self {
        Self {
            matrix: [[0.0; N]; N],
            inverse: [0.0; N],
            right: [0.0; N],
            chi2: 0.0,
            pixels: 0,
        }
    }

    /// Factorises the leading `count` rows in place.
    ///
    /// Returns the number of rows that are positive definite: `count` if all are.
    pub fn factorise(&mut self, count: usize) -> usize {
        // With a count known at compile time the loops are unrolled.
        match N - count {
            0 => self.factorise_first(N),
            1 => self.factorise_first(N - 1),
            _ => self.factorise_first(count),
        }
    }

    #[inline(always)]
    fn factorise_first(&mut self, count: usize) -> usize {
        let matrix = &mut self.matrix;
        for i in 0..count {
            let mut diagonal = matrix[i][i];
            for j in 0..i {
                // The row of L times D; divided by D below.
                for k in 0..j {
                    matrix[i][j] -= matrix[i][k] * matrix[j][k];
                }
            }
            for j in 0..i {
                let times_d = matrix[i][j];
                matrix[i][j] *= self.inverse[j];
                diagonal -= times_d * matrix[i][j];
            }
            if !(diagonal > 0.0 && diagonal.is_finite()) {
                return i;
            }
            self.inverse[i] = 1.0 / diagonal;
        }
        count
    }

    /// Solves for the step of the first `count` parameters, after [`Self::factorise`].
    pub fn solve(&self, count: usize) -> [f64; N] {
        match N - count {
            0 => self.solve_first(N),
            1 => self.solve_first(N - 1),
            _ => self.solve_first(count),
        }
    }

    #[inline(always)]
    fn solve_first(&self, count: usize) -> [f64; N] {
        let mut x = self.forward(self.right, 0, count);
        for i in (0..count).rev() {
            x[i] *= self.inverse[i];
            for k in i + 1..count {
                x[i] -= self.matrix[k][i] * x[k];
            }
        }
        x
    }

    /// The last component of [`Self::solve`].
    pub fn solve_last(&self, count: usize) -> f64 {
        self.forward(self.right, 0, count)[count - 1] * self.inverse[count - 1]
    }

    /// The variances of the first `count` parameters, after [`Self::factorise`].
    pub fn variances(&self, count: usize) -> [f64; N] {
        let mut variances = [0.0; N];
        // The diagonal of (L D Lᵀ)⁻¹ is the sum of the squared columns of L⁻¹ over D.
        for (column, variance) in variances.iter_mut().enumerate().take(count) {
            let mut unit = [0.0; N];
            unit[column] = 1.0;
            let x = self.forward(unit, column, count);
            for i in column..count {
                *variance += x[i] * x[i] * self.inverse[i];
            }
        }
        variances
    }

    /// L⁻¹ x, for an x that is 0 before `first`.
    #[inline(always)]
    fn forward(&self, mut x: [f64; N], first: usize, count: usize) -> [f64; N] {
        for i in first..count {
            for k in first..i {
                x[i] -= self.matrix[i][k] * x[k];
            }
        }
        x
    }

    /// The factors, after [`Self::factorise`], for gradients that are divided by `units`.
    pub fn factor(&self, units: [f64; N]) -> CholeskyFactor<N> {
        let mut factor = CholeskyFactor {
            lower: [[0.0; N]; N],
            inverse: [0.0; N],
        };
        for i in 0..N {
            let unit = units[i];
            factor.inverse[i] = (self.inverse[i] * unit * unit) as f32;
            for k in 0..i {
                factor.lower[i][k] = (self.matrix[i][k] * units[k] / unit) as f32;
            }
        }
        factor
    }
}

/// The factors L and D of normal equations, in single precision.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CholeskyFactor<const N: usize> {
    /// L below its diagonal.
    lower: [[f32; N]; N],
    /// Inverse of D.
    inverse: [f32; N],
}

impl<const N: usize> CholeskyFactor<N> {
    /// Leverage of a pixel over its weight: the fraction of its noise that the parameters absorb.
    #[inline(always)]
    pub fn leverage(&self, gradient: &[f32; N]) -> f32 {
        let mut x = *gradient;
        let mut leverage = 0.0;
        for i in 0..N {
            for k in 0..i {
                x[i] -= self.lower[i][k] * x[k];
            }
            leverage += x[i] * x[i] * self.inverse[i];
        }
        leverage
    }
}
