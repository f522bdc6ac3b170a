//! The weight of each star in the fit of the zero point.

use super::standard::StandardStar;
use crate::base::statistics::{SIGMA_PER_MAD, median};
use nalgebra::{DMatrix, DVector};

/// Residual from which on a star does not count, in standard deviations: 95 % efficient without
/// outliers.
const BIWEIGHT_SIGMAS: f64 = 4.685;
/// Smallest scatter, in magnitudes.
const MIN_SCATTER_MAG: f64 = 0.003;

/// The weight of each star, from the residuals so far.
pub(super) struct RobustWeights {
    /// Variance of each star by the noise of its flux, and their median.
    variances: Vec<f64>,
    typical_variance: f64,
    /// Correction of the scatter for the fitted parameters.
    freedom_factor: f64,
    pub scatter_mag: f64,
    absolute: Vec<f64>,
    /// 1 / σ², smaller for outliers.
    pub weights: Vec<f64>,
    /// Weight times residual, and its derivative.
    pulls: Vec<f64>,
    curvatures: Vec<f64>,
}

impl RobustWeights {
    pub(super) fn new(stars: &[StandardStar], parameters: usize) -> Self {
        let count = stars.len() as f64;
        let variances = variances_by_magnitude(stars);
        let buffer = || Vec::with_capacity(stars.len());
        Self {
            typical_variance: median(&mut variances.clone()),
            variances,
            freedom_factor: (count / (count - parameters as f64)).sqrt(),
            scatter_mag: 0.0,
            absolute: buffer(),
            weights: buffer(),
            pulls: buffer(),
            curvatures: buffer(),
        }
    }

    /// Updates scatter and weights from the `residuals`.
    pub(super) fn update(&mut self, residuals: &DVector<f64>) {
        self.absolute.clear();
        self.absolute.extend(residuals.iter().map(|r| r.abs()));
        self.scatter_mag = SIGMA_PER_MAD * median(&mut self.absolute) * self.freedom_factor;
        let extra_variance =
            (self.scatter_mag.powi(2) - self.typical_variance).max(MIN_SCATTER_MAG.powi(2));
        self.weights.clear();
        self.pulls.clear();
        self.curvatures.clear();
        for (by_flux, residual) in self.variances.iter().zip(residuals.iter()) {
            let variance = by_flux + extra_variance;
            let off_sq = (residual.powi(2) / (BIWEIGHT_SIGMAS.powi(2) * variance)).min(1.0);
            let weight = (1.0 - off_sq).powi(2) / variance;
            self.weights.push(weight);
            self.pulls.push(weight * residual);
            let curvature = (1.0 - off_sq) * (1.0 - 5.0 * off_sq) / variance;
            self.curvatures.push(curvature);
        }
    }

    /// The normal equations: matrix and right-hand side.
    pub(super) fn normal(
        &self,
        columns: &DMatrix<f64>,
        offsets: &DVector<f64>,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let mut weighted = columns.clone();
        for mut column in weighted.column_iter_mut() {
            for (value, weight) in column.iter_mut().zip(&self.weights) {
                *value *= weight;
            }
        }
        (weighted.tr_mul(columns), weighted.tr_mul(offsets))
    }

    /// The covariance of the coefficients, estimated from the residuals (sandwich estimator), each
    /// divided by 1 − leverage.
    ///
    /// # Reference
    /// Huber 1981, Robust Statistics, eq. 7.6.3; MacKinnon & White 1985, J. Econometrics 29, 305
    /// (their HC3).
    pub(super) fn covariance(&self, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        /// Smallest 1 − leverage of a star.
        const MIN_FREEDOM: f64 = 0.1;
        /// The scatter of few stars is uncertain, so the standard errors are raised by this over
        /// the degrees of freedom minus 2. They are then right for simulated frames of 8 to 200
        /// stars; with 6 stars they are a fifth too small.
        const FEW_STARS: f64 = 1.5;
        let scaled = |factor: &dyn Fn(usize) -> f64| {
            DMatrix::from_fn(columns.nrows(), columns.ncols(), |row, column| {
                factor(row) * columns[(row, column)]
            })
        };
        let bread = (scaled(&|row| self.curvatures[row]).transpose() * columns).try_inverse()?;
        let projected = columns * &bread;
        let leverage = |row: usize| self.weights[row] * projected.row(row).dot(&columns.row(row));
        let pulls = scaled(&|row| self.pulls[row] / (1.0 - leverage(row)).max(MIN_FREEDOM));
        let free = (columns.nrows() - columns.ncols()) as f64;
        let scale = 1.0 + FEW_STARS / (free - 2.0).max(1.0);
        Some(&bread * (pulls.transpose() * &pulls) * &bread * scale.powi(2))
    }
}

/// The variance that stars of each one's V magnitude have by the noise of their fluxes: that of a
/// line through the logarithms of all. A star's own is not used: one that noise makes brighter
/// claims a smaller error, and would shift the zero point with its larger weight.
fn variances_by_magnitude(stars: &[StandardStar]) -> Vec<f64> {
    let count = stars.len() as f64;
    let mean = |value: &dyn Fn(&StandardStar) -> f64| stars.iter().map(value).sum::<f64>() / count;
    let ln_variance = |star: &StandardStar| 2.0 * libm::log(star.sigma_mag);
    let (mean_v_mag, mean_ln) = (mean(&|star| star.v_mag), mean(&ln_variance));
    let fainter = |star: &StandardStar| star.v_mag - mean_v_mag;
    let spread = mean(&|star| fainter(star).powi(2)).max(f64::MIN_POSITIVE);
    let slope = mean(&|star| fainter(star) * (ln_variance(star) - mean_ln)) / spread;
    let variance = |star: &StandardStar| libm::exp(mean_ln + slope * fainter(star));
    stars.iter().map(variance).collect()
}
