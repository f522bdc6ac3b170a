//! The zero point of a frame's fluxes, and whether they are proportional to light.
//!
//! V and instrumental magnitudes m = −2.5 log10(flux) of single stars → [`ZeroPoint`]
//!
//! ```text
//! V = ZP + m + k (B−V − 0.6) + s (V − V̄)
//! ```
//!
//! 1. The variance of a star is that of its flux, plus a scatter (catalogue, colour, pixels) that
//!    is estimated from the residuals.
//! 2. Outliers, mostly unresolved companions and variables on one side, are down-weighted with
//!    Tukey's biweight, to zero from 4.7 standard deviations on.
//! 3. The terms k (colour) and s (grey levels not proportional to light) are used only where they
//!    are significant.
//!
//! With the colour term, the zero point is that of a star of B−V = 0.6; without it, that of the
//! mean star, whose B−V is given. With s, it holds only for stars of the mean magnitude V̄; one
//! magnitude in V is then 1 − s instrumental ones.
//!
//! The stars must be chosen by V and not by flux, which would prefer stars that noise or colour
//! makes brighter.

use crate::base::statistics::{Estimate, median};
use nalgebra::{DMatrix, DVector};

/// Reference B−V of the zero point where there is a colour term: about that of the Sun and of many
/// field stars.
pub const REFERENCE_BV_MAG: f64 = 0.6;
/// Minimum number of stars for a zero point.
pub const MIN_STARS: usize = 5;
/// Minimum number of stars for a further term.
const MIN_STARS_FOR_TERMS: usize = 15;
/// Significance of a colour term, as a normal deviate: one frame in a hundred by chance. A spurious
/// term costs little precision; a missing one makes zero points of frames with other stars differ.
const COLOR_SIGMAS: f64 = 2.575_8;
/// Significance of a slope, one frame in a thousand by chance: it is reported as a fault of the
/// frame.
const SLOPE_SIGMAS: f64 = 3.290_5;
/// A colour term is tried where at least this share of the stars has a colour.
const MIN_COLORED_SHARE: f64 = 0.5;
/// Residual from which on a star does not count, in standard deviations: 95 % efficient without
/// outliers.
const BIWEIGHT_SIGMAS: f64 = 4.685;
/// Smallest scatter, in magnitudes.
const MIN_SCATTER_MAG: f64 = 0.003;
/// Standard deviation per median absolute deviation, for a normal distribution.
const SIGMA_PER_MAD: f64 = 1.482_6;

/// A star of known V magnitude with its measured flux.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandardStar {
    /// V magnitude from the catalogue.
    pub v_mag: f64,
    /// B−V, where known.
    pub bv_mag: Option<f64>,
    /// −2.5 log10(flux).
    pub instrumental_mag: f64,
    /// Its standard error from the flux alone.
    pub sigma_mag: f64,
}

/// The conversion from instrumental to V magnitudes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZeroPoint {
    /// V magnitude of a star with a flux of 1.
    pub v_mag: f64,
    /// Its standard error.
    pub sigma_mag: f64,
    /// Robust standard deviation of a star about the relation, flux noise included.
    pub scatter_mag: f64,
    /// Number of stars.
    pub stars: usize,
    /// The B−V for which it holds; `None` where no star has one.
    pub bv_mag: Option<f64>,
    /// k, in magnitudes per magnitude of B−V, where it is significant.
    pub color_term: Option<Estimate>,
    /// Instrumental magnitudes per magnitude of V: 1 where grey levels are proportional to light.
    /// `None` with too few stars.
    pub linearity: Option<Estimate>,
    /// Mean V magnitude of the stars, at which the zero point of a nonlinear frame holds.
    pub mean_v_mag: f64,
    /// Whether [`Self::linearity`] differs significantly from 1.
    pub is_nonlinear: bool,
}

/// An optional term of the relation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Term {
    Color,
    Slope,
}

/// Measures the zero point of `stars`; `None` if they are too few.
pub fn measure(stars: &[StandardStar]) -> Option<ZeroPoint> {
    if stars.len() < MIN_STARS {
        return None;
    }
    let colored = |star: &&StandardStar| star.bv_mag.is_some();
    let colored: Vec<StandardStar> = stars.iter().filter(colored).copied().collect();
    let is_colored = colored.len() as f64 >= MIN_COLORED_SHARE * stars.len() as f64
        && Relation::fit(&colored, &[Term::Color]).is_some_and(|fit| fit.needs_last_term());
    let (terms, stars) = if is_colored {
        (&[Term::Color][..], &colored[..])
    } else {
        (&[][..], stars)
    };
    let simple = Relation::fit(stars, terms)?;
    let sloping = Relation::fit(stars, &[terms, &[Term::Slope]].concat());
    let linearity = sloping.as_ref().map(Relation::linearity);
    match sloping {
        Some(fit) if fit.needs_last_term() => Some(fit.zero_point(stars, linearity, true)),
        _ => Some(simple.zero_point(stars, linearity, false)),
    }
}

/// The fitted relation between V and instrumental magnitudes.
struct Relation {
    terms: Vec<Term>,
    coefficients: DVector<f64>,
    covariance: DMatrix<f64>,
    scatter_mag: f64,
    stars: usize,
}

impl Relation {
    /// Fits zero point and `terms`; `None` with too few stars.
    fn fit(stars: &[StandardStar], terms: &[Term]) -> Option<Self> {
        const MAX_ROUNDS: usize = 30;
        /// Converged where no coefficient changes by more, in magnitudes.
        const CONVERGED_MAG: f64 = 1e-6;
        let parameters = 1 + terms.len();
        if stars.len() < MIN_STARS || (parameters > 1 && stars.len() < MIN_STARS_FOR_TERMS) {
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
        weights.update(stars, &residuals);
        for _ in 0..MAX_ROUNDS {
            let (normal, vector) = weights.normal(&columns, &offsets);
            let before = coefficients;
            coefficients = normal.cholesky()?.solve(&vector);
            if (&coefficients - before).amax() < CONVERGED_MAG {
                break;
            }
            residuals.copy_from(&offsets);
            residuals.gemv(-1.0, &columns, &coefficients, 1.0);
            weights.update(stars, &residuals);
        }
        Some(Self {
            terms: terms.to_vec(),
            covariance: weights.covariance(&columns)?,
            coefficients,
            scatter_mag: weights.scatter_mag,
            stars: stars.len(),
        })
    }

    fn term(&self, wanted: Term) -> Option<Estimate> {
        let column = 1 + self.terms.iter().position(|term| *term == wanted)?;
        Some(self.estimate(column))
    }

    fn estimate(&self, column: usize) -> Estimate {
        Estimate {
            value: self.coefficients[column],
            sigma: self.covariance[(column, column)].max(0.0).sqrt(),
        }
    }

    /// Whether the last term is significant (Student's t test).
    fn needs_last_term(&self) -> bool {
        let last = self.estimate(self.terms.len());
        let degrees_of_freedom = self.stars as f64 - self.coefficients.len() as f64;
        let sigmas = match self.terms.last() {
            Some(Term::Slope) => SLOPE_SIGMAS,
            _ => COLOR_SIGMAS,
        };
        last.value.abs() > student_quantile(sigmas, degrees_of_freedom) * last.sigma
    }

    /// Instrumental magnitudes per magnitude of V; the slope is the last term.
    fn linearity(&self) -> Estimate {
        let slope = self.estimate(self.terms.len());
        Estimate {
            value: 1.0 - slope.value,
            sigma: slope.sigma,
        }
    }

    fn zero_point(
        &self,
        stars: &[StandardStar],
        linearity: Option<Estimate>,
        is_nonlinear: bool,
    ) -> ZeroPoint {
        let Estimate { value, sigma } = self.estimate(0);
        let color_term = self.term(Term::Color);
        let known = stars.iter().filter_map(|star| star.bv_mag);
        let mean_bv_mag = (known.clone().count() > 0).then(|| mean(known));
        ZeroPoint {
            v_mag: value,
            sigma_mag: sigma,
            scatter_mag: self.scatter_mag,
            stars: stars.len(),
            bv_mag: color_term.map_or(mean_bv_mag, |_| Some(REFERENCE_BV_MAG)),
            color_term,
            linearity,
            mean_v_mag: mean(stars.iter().map(|star| star.v_mag)),
            is_nonlinear,
        }
    }
}

/// The columns of the linear model: 1, and one column per term.
fn design_matrix(stars: &[StandardStar], terms: &[Term]) -> DMatrix<f64> {
    let mean_mag = mean(stars.iter().map(|star| star.v_mag));
    DMatrix::from_fn(stars.len(), 1 + terms.len(), |row, column| {
        let star = &stars[row];
        match column.checked_sub(1).map(|term| terms[term]) {
            None => 1.0,
            Some(Term::Color) => star.bv_mag.map_or(0.0, |bv| bv - REFERENCE_BV_MAG),
            Some(Term::Slope) => star.v_mag - mean_mag,
        }
    })
}

/// The weight of each star, from the residuals so far.
struct RobustWeights {
    /// Median variance of the fluxes' noise.
    typical_variance: f64,
    /// Correction of the scatter for the fitted parameters.
    freedom_factor: f64,
    scatter_mag: f64,
    absolute: Vec<f64>,
    /// 1 / σ², smaller for outliers.
    weights: Vec<f64>,
    /// Weight times residual, and its derivative.
    pulls: Vec<f64>,
    curvatures: Vec<f64>,
}

impl RobustWeights {
    fn new(stars: &[StandardStar], parameters: usize) -> Self {
        let count = stars.len() as f64;
        let mut variances: Vec<f64> = stars.iter().map(|star| star.sigma_mag.powi(2)).collect();
        let buffer = || Vec::with_capacity(stars.len());
        Self {
            typical_variance: median(&mut variances),
            freedom_factor: (count / (count - parameters as f64)).sqrt(),
            scatter_mag: 0.0,
            absolute: buffer(),
            weights: buffer(),
            pulls: buffer(),
            curvatures: buffer(),
        }
    }

    /// Updates scatter and weights from the `residuals`.
    fn update(&mut self, stars: &[StandardStar], residuals: &DVector<f64>) {
        self.absolute.clear();
        self.absolute.extend(residuals.iter().map(|r| r.abs()));
        self.scatter_mag = SIGMA_PER_MAD * median(&mut self.absolute) * self.freedom_factor;
        let extra_variance =
            (self.scatter_mag.powi(2) - self.typical_variance).max(MIN_SCATTER_MAG.powi(2));
        self.weights.clear();
        self.pulls.clear();
        self.curvatures.clear();
        for (star, residual) in stars.iter().zip(residuals.iter()) {
            let variance = star.sigma_mag.powi(2) + extra_variance;
            let off_sq = (residual.powi(2) / (BIWEIGHT_SIGMAS.powi(2) * variance)).min(1.0);
            let weight = (1.0 - off_sq).powi(2) / variance;
            self.weights.push(weight);
            self.pulls.push(weight * residual);
            let curvature = (1.0 - off_sq) * (1.0 - 5.0 * off_sq) / variance;
            self.curvatures.push(curvature);
        }
    }

    /// The normal equations: matrix and right-hand side.
    fn normal(
        &self,
        columns: &DMatrix<f64>,
        offsets: &DVector<f64>,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let count = columns.ncols();
        let (mut matrix, mut vector) = (DMatrix::zeros(count, count), DVector::zeros(count));
        for (row, weight) in self.weights.iter().enumerate() {
            for i in 0..count {
                let weighted = weight * columns[(row, i)];
                vector[i] += weighted * offsets[row];
                for j in 0..count {
                    matrix[(i, j)] += weighted * columns[(row, j)];
                }
            }
        }
        (matrix, vector)
    }

    /// The covariance of the coefficients, estimated from the residuals (sandwich estimator), each
    /// divided by 1 − leverage.
    ///
    /// # Reference
    /// Huber 1981, Robust Statistics, eq. 7.6.3; MacKinnon & White 1985, J. Econometrics 29, 305
    /// (their HC3).
    fn covariance(&self, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
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

/// The quantile of Student's distribution with the tail probability of the normal quantile `z`.
///
/// # Reference
/// Abramowitz & Stegun 1964, eq. 26.7.5, to the second order: within 2 % from 10 degrees of
/// freedom.
fn student_quantile(z: f64, degrees_of_freedom: f64) -> f64 {
    let first = (z.powi(3) + z) / 4.0;
    let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
    z + first / degrees_of_freedom + second / degrees_of_freedom.powi(2)
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
    sum / count
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    /// The parameters of simulated stars.
    #[derive(Clone, Copy)]
    struct Stars {
        count: usize,
        zero_point: f64,
        color_term: f64,
        linearity: f64,
        scatter: f64,
        outliers: f64,
    }

    const TYPICAL: Stars = Stars {
        count: 40,
        zero_point: 16.5,
        color_term: 0.0,
        linearity: 1.0,
        scatter: 0.08,
        outliers: 0.0,
    };

    impl Stars {
        fn draw(&self, seed: u64) -> Vec<StandardStar> {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let normal = Normal::new(0.0, 1.0).unwrap();
            let mut star = || {
                let v_mag = random.random_range(4.0..8.0);
                let bv_mag = random.random_range(-0.1..1.7);
                let sigma_mag = 0.12 * 10_f64.powf(0.2 * (v_mag - 8.0));
                let off = if random.random_bool(self.outliers) {
                    random.random_range(0.3..1.5)
                } else {
                    sigma_mag.hypot(self.scatter) * normal.sample(&mut random)
                };
                let color = self.color_term * (bv_mag - REFERENCE_BV_MAG);
                StandardStar {
                    v_mag,
                    bv_mag: Some(bv_mag),
                    instrumental_mag: 6.0 + self.linearity * (v_mag - 6.0)
                        - self.zero_point
                        - color
                        + off,
                    sigma_mag,
                }
            };
            (0..self.count).map(|_| star()).collect()
        }

        fn zero_points(&self, frames: u64) -> Vec<ZeroPoint> {
            let zero_point = |seed| measure(&self.draw(seed)).unwrap();
            (0..frames).map(zero_point).collect()
        }
    }

    /// Mean and standard deviation.
    fn mean_and_spread(values: &[f64]) -> (f64, f64) {
        let mean = mean(values.iter().copied());
        let square = super::mean(values.iter().map(|v| (v - mean).powi(2)));
        (mean, square.sqrt())
    }

    #[test]
    fn the_zero_point_is_found_within_its_standard_error() {
        for count in [8, 12, 40, 200] {
            let found = Stars { count, ..TYPICAL }.zero_points(600);
            let pulls: Vec<f64> = found
                .iter()
                .map(|zero| (zero.v_mag - TYPICAL.zero_point) / zero.sigma_mag)
                .collect();
            let (mean, spread) = mean_and_spread(&pulls);
            println!("{count} stars: pulls {mean:+.3} ± {spread:.3}");
            assert!(
                mean.abs() < 0.12 && (spread - 1.0).abs() < 0.12,
                "{mean} {spread}"
            );
        }
    }

    #[test]
    fn outliers_on_one_side_hardly_move_the_zero_point() {
        let stars = Stars {
            outliers: 0.15,
            ..TYPICAL
        };
        let found = stars.zero_points(200);
        let off: Vec<f64> = found
            .iter()
            .map(|zero| zero.v_mag - stars.zero_point)
            .collect();
        let (mean, spread) = mean_and_spread(&off);
        println!("zero point off by {mean:+.4} ± {spread:.4}");
        // Their mean alone is off by 0.15 × 0.9 = 0.135.
        assert!(mean.abs() < 0.04 && spread < 0.04, "{mean} {spread}");
    }

    #[test]
    fn terms_are_not_kept_where_chance_alone_makes_them() {
        const FRAMES: u64 = 3000;
        for count in [15, 20, 60] {
            let found = Stars { count, ..TYPICAL }.zero_points(FRAMES);
            let colored = found
                .iter()
                .filter(|zero| zero.color_term.is_some())
                .count();
            let sloping = found.iter().filter(|zero| zero.is_nonlinear).count();
            println!("{count} stars: {colored} color terms, {sloping} slopes in {FRAMES} frames");
            // The median absolute deviation of few stars is uncertain, which raises the rates.
            assert!(colored as f64 <= 0.025 * FRAMES as f64, "{colored}");
            assert!(sloping as f64 <= 0.006 * FRAMES as f64, "{sloping}");
        }
    }

    #[test]
    fn a_color_term_that_is_real_is_kept_and_makes_zero_points_comparable() {
        let stars = Stars {
            count: 60,
            color_term: 0.25,
            ..TYPICAL
        };
        let found = stars.zero_points(200);
        let kept: Vec<_> = found
            .iter()
            .filter_map(|zero| Some((zero, zero.color_term?)))
            .collect();
        assert!(kept.len() >= 198, "{}", kept.len());
        let pulls = |value: &dyn Fn(&(&ZeroPoint, Estimate)) -> f64| {
            mean_and_spread(&kept.iter().map(value).collect::<Vec<f64>>())
        };
        let color = pulls(&|(_, term)| (term.value - stars.color_term) / term.sigma);
        let zero = pulls(&|(zero, _)| (zero.v_mag - stars.zero_point) / zero.sigma_mag);
        for (mean, spread) in [color, zero] {
            assert!(
                mean.abs() < 0.3 && (spread - 1.0).abs() < 0.2,
                "{mean} {spread}"
            );
        }
        assert!(
            kept.iter()
                .all(|(zero, _)| zero.bv_mag == Some(REFERENCE_BV_MAG))
        );
    }

    #[test]
    fn a_tone_curve_is_detected() {
        let stars = Stars {
            linearity: 0.45,
            ..TYPICAL
        };
        let found = measure(&stars.draw(1)).unwrap();
        let linearity = found.linearity.unwrap();
        assert!(found.is_nonlinear);
        assert!(
            (linearity.value - 0.45).abs() < 4.0 * linearity.sigma,
            "{found:?}"
        );
        // The tone curve does not count as scatter.
        assert!(found.scatter_mag < 2.0 * TYPICAL.scatter, "{found:?}");
    }

    #[test]
    fn stars_of_unknown_color_still_make_a_zero_point_and_few_stars_none() {
        let mut stars = TYPICAL.draw(5);
        stars.iter_mut().for_each(|star| star.bv_mag = None);
        let found = measure(&stars).unwrap();
        assert_eq!(
            (found.bv_mag, found.color_term, found.stars),
            (None, None, 40)
        );
        assert_eq!(measure(&stars[..MIN_STARS - 1]), None);
        let same = vec![stars[0]; MIN_STARS];
        assert!(measure(&same).is_some_and(|zero| zero.sigma_mag.is_finite()));
    }

    #[test]
    fn quantiles_of_student_are_those_of_the_tables() {
        // Two-sided 0.1 %, and 1 %.
        for (degrees_of_freedom, sigmas, expected) in [
            (10.0, SLOPE_SIGMAS, 4.587),
            (20.0, SLOPE_SIGMAS, 3.850),
            (60.0, SLOPE_SIGMAS, 3.460),
            (10.0, COLOR_SIGMAS, 3.169),
            (30.0, COLOR_SIGMAS, 2.750),
        ] {
            let found = student_quantile(sigmas, degrees_of_freedom);
            assert!((found / expected - 1.0).abs() < 0.02, "{found} {expected}");
        }
    }
}
