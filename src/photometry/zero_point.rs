//! The zero point of a frame's fluxes, and whether they are proportional to light.
//!
//! V and instrumental magnitudes m = −2.5 log10(flux) of single stars → [`ZeroPoint`]
//!
//! ```text
//! V = ZP + m + k (B−V − 0.6) + s (V − V̄)
//! ```
//!
//! 1. The noise of a star is that of its flux, and a scatter besides (catalogue, colour, pixels), which is found from the residuals.
//! 2. Outliers count the less the further off they are, and from 4.7 standard deviations on not at all (Tukey's biweight): they are
//!    unresolved companions and variables, most of them on one side.
//! 3. The terms k (colour) and s (a grey level not proportional to light) are there only where they are clearly needed.
//!
//! With the colour term, the zero point is that of a star of B−V = 0.6; without, that of the mean of the stars, whose B−V is given. With
//! s, it is right for stars of the mean magnitude V̄, and no others; a magnitude in V is 1 − s instrumental ones.
//!
//! The stars must have been chosen by V, not by their flux: else those are preferred that noise and colour make bright.

use crate::base::statistics::{Estimate, median};
use nalgebra::{DMatrix, DVector};

/// The B−V of the stars whose zero point is given, where there is a colour term: the Sun's, nearly, and that of many field stars.
pub const REFERENCE_BV_MAG: f64 = 0.6;
/// Fewer stars make no zero point.
pub const FEWEST_STARS: usize = 5;
/// Fewer stars make no further term.
const FEWEST_FOR_TERMS: usize = 15;
/// A colour term is kept where chance alone makes so large a one in one frame of a hundred (standard deviations of a normal deviate): one
/// too many costs little precision, and one missing makes the zero points of frames with other stars differ.
const COLOR_SIGMAS: f64 = 2.575_8;
/// A slope is kept in one frame of a thousand: it says that something is wrong.
const SLOPE_SIGMAS: f64 = 3.290_5;
/// A colour term is looked for where this part of the stars, or more, have a colour.
const COLORED_SHARE: f64 = 0.5;
/// Distance in standard deviations from which on a star does not count: 95 % efficient where there are no outliers.
const BIWEIGHT_SIGMAS: f64 = 4.685;
/// No stars agree better than this, in magnitudes.
const LEAST_SCATTER_MAG: f64 = 0.003;
/// From the median of absolute deviations to the standard deviation of a normal distribution.
const SIGMA_PER_MAD: f64 = 1.482_6;
/// The scatter of few stars is known roughly, and the standard errors are raised by this over the degrees of freedom less 2: so
/// they are right for drawn stars, from 8 to 200; for 6 they are a fifth too small.
const FEW_STARS: f64 = 1.5;
/// No star takes more of its own residual than all but this.
const LEAST_FREEDOM: f64 = 0.1;
const MAX_ROUNDS: usize = 30;
/// A smaller change matters to nobody, in magnitudes.
const SETTLED_MAG: f64 = 1e-6;

/// A star with its measured flux.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredStar {
    /// V magnitude of the catalogue.
    pub v_mag: f64,
    /// B−V, where known.
    pub bv_mag: Option<f64>,
    /// −2.5 log10(flux).
    pub instrumental_mag: f64,
    /// Its standard error, of the flux alone.
    pub sigma_mag: f64,
}

/// What makes an instrumental magnitude a V magnitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZeroPoint {
    /// V magnitude of a star with a flux of 1.
    pub v_mag: f64,
    /// Its standard error.
    pub sigma_mag: f64,
    /// Standard deviation of a star about the relation, flux noise included; robust.
    pub scatter_mag: f64,
    /// Stars it is from.
    pub stars: usize,
    /// The B−V for which it holds; none where no star has one.
    pub bv_mag: Option<f64>,
    /// k, in magnitudes to one magnitude of B−V, where it is needed.
    pub color_term: Option<Estimate>,
    /// Instrumental magnitudes to one magnitude of V: 1 where the grey level is proportional to light. None where there are too
    /// few stars to tell.
    pub linearity: Option<Estimate>,
    /// Mean V magnitude of the stars: where the frame is not linear, the zero point holds there.
    pub mean_v_mag: f64,
    /// Whether [`Self::linearity`] clearly is not 1.
    pub is_nonlinear: bool,
}

/// A term that the relation may have besides the zero point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Term {
    Color,
    Slope,
}

/// The zero point of `stars`; `None` where they are too few.
pub fn measure(stars: &[MeasuredStar]) -> Option<ZeroPoint> {
    if stars.len() < FEWEST_STARS {
        return None;
    }
    let colored = |star: &&MeasuredStar| star.bv_mag.is_some();
    let colored: Vec<MeasuredStar> = stars.iter().filter(colored).copied().collect();
    let is_colored = colored.len() as f64 >= COLORED_SHARE * stars.len() as f64
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

/// The relation between V and instrumental magnitudes, fitted.
struct Relation {
    terms: Vec<Term>,
    coefficients: DVector<f64>,
    covariance: DMatrix<f64>,
    scatter_mag: f64,
    stars: usize,
}

impl Relation {
    /// Fits zero point and `terms`. `None` where there are too few stars for them.
    fn fit(stars: &[MeasuredStar], terms: &[Term]) -> Option<Self> {
        let parameters = 1 + terms.len();
        if stars.len() < FEWEST_STARS || (parameters > 1 && stars.len() < FEWEST_FOR_TERMS) {
            return None;
        }
        let mean_mag = mean(stars.iter().map(|star| star.v_mag));
        let columns = DMatrix::from_fn(stars.len(), parameters, |row, column| {
            let star = &stars[row];
            match column.checked_sub(1).map(|term| terms[term]) {
                None => 1.0,
                Some(Term::Color) => star.bv_mag.map_or(0.0, |bv| bv - REFERENCE_BV_MAG),
                Some(Term::Slope) => star.v_mag - mean_mag,
            }
        });
        let offsets = DVector::from_iterator(
            stars.len(),
            stars.iter().map(|star| star.v_mag - star.instrumental_mag),
        );
        let mut coefficients = DVector::zeros(parameters);
        coefficients[0] = median(&mut offsets.iter().copied().collect::<Vec<f64>>());
        let mut weighing = Weighing::new(stars, parameters);
        let mut residuals = &offsets - &columns * &coefficients;
        weighing.weigh(stars, &residuals);
        for _ in 0..MAX_ROUNDS {
            let (normal, vector) = weighing.normal(&columns, &offsets);
            let before = coefficients;
            coefficients = normal.cholesky()?.solve(&vector);
            if (&coefficients - before).amax() < SETTLED_MAG {
                break;
            }
            residuals.copy_from(&offsets);
            residuals.gemv(-1.0, &columns, &coefficients, 1.0);
            weighing.weigh(stars, &residuals);
        }
        Some(Self {
            terms: terms.to_vec(),
            covariance: weighing.covariance(&columns)?,
            coefficients,
            scatter_mag: weighing.scatter_mag,
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

    /// Whether chance hardly makes so large a last term (Student's t test).
    fn needs_last_term(&self) -> bool {
        let last = self.estimate(self.terms.len());
        let degrees_of_freedom = self.stars as f64 - self.coefficients.len() as f64;
        let sigmas = match self.terms.last() {
            Some(Term::Slope) => SLOPE_SIGMAS,
            _ => COLOR_SIGMAS,
        };
        last.value.abs() > student_quantile(sigmas, degrees_of_freedom) * last.sigma
    }

    /// Instrumental magnitudes to one of V; the slope is the last term.
    fn linearity(&self) -> Estimate {
        let slope = self.estimate(self.terms.len());
        Estimate {
            value: 1.0 - slope.value,
            sigma: slope.sigma,
        }
    }

    fn zero_point(
        &self,
        stars: &[MeasuredStar],
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

/// How much each star counts, from the residuals so far.
struct Weighing {
    /// The median variance of the fluxes' noise.
    typical: f64,
    /// What a scatter found must be multiplied by, as parameters were fitted.
    used_up: f64,
    scatter_mag: f64,
    absolute: Vec<f64>,
    /// 1 / σ², less for outliers.
    weights: Vec<f64>,
    /// Weight times residual, and its derivative.
    pulls: Vec<f64>,
    curvatures: Vec<f64>,
}

impl Weighing {
    fn new(stars: &[MeasuredStar], parameters: usize) -> Self {
        let count = stars.len() as f64;
        let mut variances: Vec<f64> = stars.iter().map(|star| star.sigma_mag.powi(2)).collect();
        let room = || Vec::with_capacity(stars.len());
        Self {
            typical: median(&mut variances),
            used_up: (count / (count - parameters as f64)).sqrt(),
            scatter_mag: 0.0,
            absolute: room(),
            weights: room(),
            pulls: room(),
            curvatures: room(),
        }
    }

    /// Weighs the stars by their `residuals`.
    fn weigh(&mut self, stars: &[MeasuredStar], residuals: &DVector<f64>) {
        self.absolute.clear();
        self.absolute.extend(residuals.iter().map(|r| r.abs()));
        self.scatter_mag = SIGMA_PER_MAD * median(&mut self.absolute) * self.used_up;
        let besides = (self.scatter_mag.powi(2) - self.typical).max(LEAST_SCATTER_MAG.powi(2));
        self.weights.clear();
        self.pulls.clear();
        self.curvatures.clear();
        for (star, residual) in stars.iter().zip(residuals.iter()) {
            let variance = star.sigma_mag.powi(2) + besides;
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

    /// The covariance of the coefficients, from the residuals themselves; each is raised by what its own star took of it.
    ///
    /// # Reference
    /// Huber 1981, Robust Statistics, eq. 7.6.3; MacKinnon & White 1985, J. Econometrics 29, 305 (their HC3).
    fn covariance(&self, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let scaled = |factor: &dyn Fn(usize) -> f64| {
            DMatrix::from_fn(columns.nrows(), columns.ncols(), |row, column| {
                factor(row) * columns[(row, column)]
            })
        };
        let bread = (scaled(&|row| self.curvatures[row]).transpose() * columns).try_inverse()?;
        let leverages = columns * &bread;
        let own = |row: usize| self.weights[row] * leverages.row(row).dot(&columns.row(row));
        let pulls = scaled(&|row| self.pulls[row] / (1.0 - own(row)).max(LEAST_FREEDOM));
        let free = (columns.nrows() - columns.ncols()) as f64;
        let rough_scale = 1.0 + FEW_STARS / (free - 2.0).max(1.0);
        Some(&bread * (pulls.transpose() * &pulls) * &bread * rough_scale.powi(2))
    }
}

/// What a deviate of Student's distribution exceeds as seldom as a normal one exceeds `z`.
///
/// # Reference
/// Abramowitz & Stegun 1964, eq. 26.7.5, to the second order: within 2 % from 10 degrees of freedom.
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

    /// How stars are drawn.
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
        fn draw(&self, seed: u64) -> Vec<MeasuredStar> {
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
                MeasuredStar {
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

        fn measured(&self, frames: u64) -> Vec<ZeroPoint> {
            let measured = |seed| measure(&self.draw(seed)).unwrap();
            (0..frames).map(measured).collect()
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
            let found = Stars { count, ..TYPICAL }.measured(600);
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
        let found = stars.measured(200);
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
            let found = Stars { count, ..TYPICAL }.measured(FRAMES);
            let colored = found
                .iter()
                .filter(|zero| zero.color_term.is_some())
                .count();
            let sloping = found.iter().filter(|zero| zero.is_nonlinear).count();
            println!("{count} stars: {colored} color terms, {sloping} slopes in {FRAMES} frames");
            // The median absolute deviation of few stars is a rough scale, which raises the rates.
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
        let found = stars.measured(200);
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
    fn a_tone_curve_is_noticed() {
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
        // The curve is no scatter.
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
        assert_eq!(measure(&stars[..FEWEST_STARS - 1]), None);
        let same = vec![stars[0]; FEWEST_STARS];
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
