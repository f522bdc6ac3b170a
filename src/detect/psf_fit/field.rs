//! Size and elongation of the spots over the field: the simplest polynomial that the stars allow.

use super::stars::PsfStar;
use crate::detect::psf::{FIELD_TERMS, FieldFrame, FieldMoments, polynomials};
use nalgebra::{DMatrix, DVector, SVector};

/// Scatter of the stars' own moments beyond their errors: their colors, their neighbors.
const SCATTER: f64 = 0.02;
/// A parameter more must lower chi² by this: that of the Bayesian information criterion for some
/// hundred values.
const CHI2_PER_PARAMETER: f64 = 5.0;

/// Coefficients of the moments that one parameter multiplies.
type Basis = [[f64; FIELD_TERMS]; 3];
/// The moments of one star.
type Moments = SVector<f64, 3>;

/// One number of a basis: moment, term, coefficient.
type Part = (usize, usize, f64);

/// The basis with these parts.
fn basis(parts: &[Part]) -> Basis {
    let mut basis = [[0.0; FIELD_TERMS]; 3];
    for &(moment, term, coefficient) in parts {
        basis[moment][term] = coefficient;
    }
    basis
}

/// The same term of each of the moments.
fn of_each_moment(term: usize) -> impl Iterator<Item = Basis> {
    (0..3).map(move |moment| basis(&[(moment, term, 1.0)]))
}

/// Curvature of the field and astigmatism of a centred lens, of which the first term is `xx`: a
/// size that grows outward, and a radial elongation.
fn centred(xx: usize) -> [Basis; 2] {
    let [xy, yy] = [xx + 1, xx + 2];
    [
        basis(&[(0, xx, 1.0), (0, yy, 1.0)]),
        basis(&[(1, xx, 1.0), (1, yy, -1.0), (2, xy, 2.0)]),
    ]
}

/// The models, the simplest first. The numbers are those of [`FieldFrame::terms`].
fn models() -> [Vec<Basis>; 7] {
    let terms = |range: std::ops::Range<usize>| range.flat_map(of_each_moment);
    let constant = || terms(0..1);
    [
        constant().collect(),
        constant().chain(centred(3)).collect(),
        constant().chain(centred(3)).chain(centred(6)).collect(),
        terms(0..3).collect(),
        terms(0..3).chain(centred(3)).collect(),
        terms(0..6).collect(),
        terms(0..9).collect(),
    ]
}

/// The moments of one star, their variances, and the terms at its place.
struct Sample {
    values: Moments,
    variances: Moments,
    terms: [f64; FIELD_TERMS],
}

impl Sample {
    fn of(star: &PsfStar, frame: &FieldFrame) -> Self {
        Self {
            values: Moments::from(star.moments),
            variances: Moments::from(star.variances).add_scalar(SCATTER * SCATTER),
            terms: frame.terms(star.spot.x, star.spot.y),
        }
    }

    /// The moments that coefficients give.
    fn predicted(&self, coefficients: &Basis) -> Moments {
        Moments::from(polynomials(coefficients, &self.terms))
    }
}

/// The moments of the stars over the field, and whether they differ from place to place.
pub(super) fn moments_over_field(frame: FieldFrame, stars: &[PsfStar]) -> (FieldMoments, bool) {
    let known = stars
        .iter()
        .filter(|star| star.variances.iter().all(|v| v.is_finite()));
    let samples: Vec<Sample> = known.map(|star| Sample::of(star, &frame)).collect();
    let values = 3 * samples.len();
    let is_allowed = |model: &&Vec<Basis>| values >= 2 * model.len() + 6;
    let fits: Vec<(usize, FieldFit)> = models()
        .iter()
        .filter(is_allowed)
        .filter_map(|model| Some((model.len(), FieldFit::of(&samples, model)?)))
        .collect();
    // The scatter that no model explains.
    let of_noise = fits
        .iter()
        .map(|(parameters, fit)| fit.chi2 / (values - parameters) as f64);
    let of_noise = of_noise.fold(f64::INFINITY, f64::min).max(1.0);
    let cost = |(parameters, fit): &(usize, FieldFit)| {
        fit.chi2 / of_noise + CHI2_PER_PARAMETER * *parameters as f64
    };
    let best = fits.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
    let coefficients = best.map_or([[0.0; FIELD_TERMS]; 3], |(_, fit)| fit.coefficients);
    let predicted = || samples.iter().map(|sample| sample.predicted(&coefficients));
    let range = std::array::from_fn(|i| {
        let values = || predicted().map(|moments| moments[i]);
        let low = values().fold(f64::INFINITY, f64::min);
        let high = values().fold(f64::NEG_INFINITY, f64::max);
        // Without stars that tell, the moments are 0.
        if low <= high { [low, high] } else { [0.0; 2] }
    });
    let moments = FieldMoments {
        frame,
        coefficients,
        range,
    };
    (moments, best.is_some_and(|(parameters, _)| *parameters > 3))
}

/// Coefficients that fit the stars.
struct FieldFit {
    coefficients: Basis,
    chi2: f64,
}

impl FieldFit {
    /// The weighted least-squares fit of a model; stars far off count less. `None` where the stars
    /// do not fix it.
    fn of(samples: &[Sample], model: &[Basis]) -> Option<Self> {
        /// Rounds of weights.
        const ROUNDS: usize = 4;
        /// Residuals beyond this many standard deviations count less.
        const HUBER_SIGMA: f64 = 2.5;
        let mut weights: Vec<Moments> = samples
            .iter()
            .map(|s| s.variances.map(f64::recip))
            .collect();
        let mut fit = Self {
            coefficients: [[0.0; FIELD_TERMS]; 3],
            chi2: 0.0,
        };
        // The values at each star, moment by moment, of the bases that it depends on: most are of one
        // moment.
        let rows: Vec<[Vec<(usize, f64)>; 3]> = samples
            .iter()
            .map(|sample| {
                let values: Vec<Moments> = model.iter().map(|b| sample.predicted(b)).collect();
                std::array::from_fn(|moment| {
                    let of_moment = values.iter().map(|value| value[moment]).enumerate();
                    of_moment.filter(|(_, value)| *value != 0.0).collect()
                })
            })
            .collect();
        for _ in 0..ROUNDS {
            let mut matrix = DMatrix::<f64>::identity(model.len(), model.len()) * 1e-6;
            let mut right = DVector::<f64>::zeros(model.len());
            for ((sample, weight), rows) in samples.iter().zip(&weights).zip(&rows) {
                for (moment, row) in rows.iter().enumerate() {
                    for (number, (i, value)) in row.iter().enumerate() {
                        let weighted = value * weight[moment];
                        right[*i] += weighted * sample.values[moment];
                        // The lower triangle, which is all that the decomposition reads.
                        let column = &mut matrix.as_mut_slice()[i * model.len()..];
                        for (j, other) in &row[number..] {
                            column[*j] += weighted * other;
                        }
                    }
                }
            }
            let solution = matrix.cholesky()?.solve(&right);
            fit.coefficients = [[0.0; FIELD_TERMS]; 3];
            for (basis, factor) in model.iter().zip(solution.iter()) {
                let numbers = fit.coefficients.as_flattened_mut().iter_mut();
                for (sum, part) in numbers.zip(basis.as_flattened()) {
                    *sum += factor * part;
                }
            }
            fit.chi2 = 0.0;
            for (sample, weight) in samples.iter().zip(&mut weights) {
                let residual = sample.values - sample.predicted(&fit.coefficients);
                for i in 0..3 {
                    let sigmas = residual[i].abs() / sample.variances[i].sqrt();
                    let part = (HUBER_SIGMA / sigmas).min(1.0);
                    weight[i] = part / sample.variances[i];
                    fit.chi2 += part * sigmas * sigmas;
                }
            }
        }
        Some(fit)
    }
}
