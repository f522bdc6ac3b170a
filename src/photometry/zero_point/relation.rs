//! The linear model of the zero point, and its robust fit.

use super::standard::{MIN_STARS, REFERENCE_BV_MAG, StandardStar, WeightedColor, ZeroPoint};
use super::weights::RobustWeights;
use crate::base::statistics::{Estimate, median, student_quantile};
use nalgebra::{DMatrix, DVector};

/// Minimum number of stars for further terms: this, and so many for each of them.
const MIN_STARS_FOR_TERMS: usize = 15;
const MIN_STARS_PER_TERM: usize = 10;
/// Significance of color terms, as a normal deviate: one frame in a hundred by chance. A spurious
/// term costs little precision; a missing one makes zero points of frames with other stars differ.
const COLOR_SIGMAS: f64 = 2.575_8;
/// Significance of vignetting, which every lens has: one frame in forty by chance, as it has only
/// one sign. Where it is missed, the zero point is the mean over the frame.
const VIGNETTING_SIGMAS: f64 = 1.960;
/// Significance of a slope, one frame in a thousand by chance: it is reported as a fault of the
/// frame.
const SLOPE_SIGMAS: f64 = 3.290_5;

/// An optional term of the relation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Term {
    Color,
    ColorOfSecondOrder,
    Vignetting,
    VignettingOfFourthOrder,
    Slope,
}

impl Term {
    fn column(self, star: &StandardStar, mean_mag: f64) -> f64 {
        let color = star.bv_mag.map_or(0.0, |bv| bv - REFERENCE_BV_MAG);
        match self {
            Self::Color => color,
            Self::ColorOfSecondOrder => color.powi(2),
            Self::Vignetting => -star.off_centre_sq,
            Self::VignettingOfFourthOrder => -star.off_centre_sq.powi(2),
            Self::Slope => star.v_mag - mean_mag,
        }
    }
}

/// The fitted relation between V and instrumental magnitudes.
pub(super) struct Relation {
    terms: Vec<Term>,
    coefficients: DVector<f64>,
    covariance: DMatrix<f64>,
    scatter_mag: f64,
    /// Weight of each star.
    weights: Vec<f64>,
}

impl Relation {
    /// Fits zero point and `terms`; `None` with too few stars.
    pub(super) fn fit(stars: &[StandardStar], terms: &[Term]) -> Option<Self> {
        const MAX_ROUNDS: usize = 30;
        /// Converged where no coefficient changes by more, in magnitudes.
        const CONVERGED_MAG: f64 = 1e-6;
        let parameters = 1 + terms.len();
        let enough = match terms.len() {
            0 => MIN_STARS,
            further => MIN_STARS_FOR_TERMS.max(MIN_STARS_PER_TERM * further),
        };
        if stars.len() < enough {
            return None;
        }
        let columns = design_matrix(stars, terms);
        let offsets = DVector::from_iterator(
            stars.len(),
            stars.iter().map(|star| star.v_mag - star.instrumental_mag),
        );
        let mut coefficients = DVector::zeros(parameters);
        coefficients[0] = median(&mut offsets.iter().copied().collect::<Vec<f64>>());
        let mut weights = RobustWeights::new(stars, parameters);
        let mut residuals = &offsets - &columns * &coefficients;
        weights.update(&residuals);
        for _ in 0..MAX_ROUNDS {
            let (normal, vector) = weights.normal(&columns, &offsets);
            let before = coefficients;
            coefficients = normal.cholesky()?.solve(&vector);
            if (&coefficients - before).amax() < CONVERGED_MAG {
                break;
            }
            residuals.copy_from(&offsets);
            residuals.gemv(-1.0, &columns, &coefficients, 1.0);
            weights.update(&residuals);
        }
        Some(Self {
            terms: terms.to_vec(),
            covariance: weights.covariance(&columns)?,
            coefficients,
            scatter_mag: weights.scatter_mag,
            weights: weights.weights,
        })
    }

    /// The fit if its last term is significant.
    pub(super) fn fit_significant(stars: &[StandardStar], terms: &[Term]) -> Option<Self> {
        Self::fit(stars, terms).filter(Self::needs_last_term)
    }

    /// Its terms, and `further` ones.
    pub(super) fn terms_and(&self, further: &[Term]) -> Vec<Term> {
        [&self.terms, further].concat()
    }

    pub(super) fn has(&self, term: Term) -> bool {
        self.terms.contains(&term)
    }

    fn column(&self, wanted: Term) -> Option<usize> {
        Some(1 + self.terms.iter().position(|term| *term == wanted)?)
    }

    /// A coefficient: that of 1, and then of each term.
    pub(super) fn estimate(&self, column: usize) -> Estimate {
        Estimate {
            value: self.coefficients[column],
            sigma: self.covariance[(column, column)].max(0.0).sqrt(),
        }
    }

    /// The covariance of two of them.
    pub(super) fn covariance(&self, row: usize, column: usize) -> f64 {
        self.covariance[(row, column)]
    }

    /// Whether the last term is significant (Student's t test).
    pub(super) fn needs_last_term(&self) -> bool {
        let last = self.estimate(self.terms.len());
        let degrees_of_freedom = self.weights.len() as f64 - self.coefficients.len() as f64;
        let sigmas = match self.terms.last() {
            Some(Term::Slope) => SLOPE_SIGMAS,
            Some(Term::Vignetting | Term::VignettingOfFourthOrder) => VIGNETTING_SIGMAS,
            _ => COLOR_SIGMAS,
        };
        last.value.abs() > student_quantile(sigmas, degrees_of_freedom) * last.sigma
    }

    /// Instrumental magnitudes per magnitude of V; the slope is the last term.
    pub(super) fn linearity(&self) -> Estimate {
        let slope = self.estimate(self.terms.len());
        Estimate {
            value: 1.0 - slope.value,
            sigma: slope.sigma,
        }
    }

    pub(super) fn zero_point(
        &self,
        stars: &[StandardStar],
        linearity: Option<Estimate>,
        is_nonlinear: bool,
    ) -> ZeroPoint {
        let Estimate { value, sigma } = self.estimate(0);
        let color_term = self.column(Term::Color).map(|column| self.estimate(column));
        let colors = self.colors(stars);
        let weight: f64 = colors.iter().map(|color| color.weight).sum();
        let weighted: f64 = colors.iter().map(|color| color.weight * color.bv_mag).sum();
        let mean_bv_mag = (weight > 0.0).then(|| weighted / weight);
        ZeroPoint {
            v_mag: value,
            sigma_mag: sigma,
            scatter_mag: self.scatter_mag,
            stars: stars.len(),
            bv_mag: color_term.map_or(mean_bv_mag, |_| Some(REFERENCE_BV_MAG)),
            colors,
            color_term,
            corner_loss_mag: self.corner_loss_mag(),
            linearity,
            mean_v_mag: mean(stars.iter().map(|star| star.v_mag)),
            is_nonlinear,
        }
    }

    /// The colors of `stars`, where known.
    fn colors(&self, stars: &[StandardStar]) -> Vec<WeightedColor> {
        let colors = stars
            .iter()
            .zip(&self.weights)
            .filter_map(|(star, weight)| {
                Some(WeightedColor {
                    bv_mag: star.bv_mag?,
                    weight: *weight,
                })
            });
        colors.collect()
    }

    pub(super) fn loses_light_in_the_corners(&self) -> bool {
        self.corner_loss_mag().is_some_and(|loss| loss.value > 0.0)
    }

    /// The sum of the terms of vignetting in the corner.
    fn corner_loss_mag(&self) -> Option<Estimate> {
        let first = self.column(Term::Vignetting)?;
        let columns = [Some(first), self.column(Term::VignettingOfFourthOrder)];
        let columns = || columns.iter().flatten().copied();
        let variance: f64 = columns()
            .flat_map(|i| columns().map(move |j| (i, j)))
            .map(|place| self.covariance[place])
            .sum();
        Some(Estimate {
            value: columns().map(|column| self.coefficients[column]).sum(),
            sigma: variance.max(0.0).sqrt(),
        })
    }
}

/// The columns of the linear model: 1, and one column per term.
fn design_matrix(stars: &[StandardStar], terms: &[Term]) -> DMatrix<f64> {
    let mean_mag = mean(stars.iter().map(|star| star.v_mag));
    DMatrix::from_fn(stars.len(), 1 + terms.len(), |row, column| {
        let term = column.checked_sub(1).map(|term| terms[term]);
        term.map_or(1.0, |term| term.column(&stars[row], mean_mag))
    })
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
    sum / count
}
