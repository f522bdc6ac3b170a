//! Size and elongation of the spots over the field: the simplest polynomial that the stars allow.

use super::stars::PsfStar;
use crate::base::least_squares::huber_weight;
use crate::detect::psf::{FIELD_TERMS, FieldFrame, FieldMoments, polynomials};
use arrayvec::ArrayVec;
use nalgebra::{DMatrix, DVector, SVector};

/// Scatter of the stars' own moments beyond their errors: their colors, their neighbors.
const SCATTER: f64 = 0.02;
/// A parameter more must lower chi² by this: that of the Bayesian information criterion for some
/// hundred values.
const CHI2_PER_PARAMETER: f64 = 5.0;

/// The moments of one star.
type Moments = SVector<f64, 3>;

/// One number of a basis: moment, term, coefficient.
type Part = (usize, usize, f64);
/// Most of them.
const MAX_PARTS: usize = 3;
/// Coefficients of the moments that one parameter multiplies, those that are not 0.
type Basis = ArrayVec<Part, MAX_PARTS>;
/// Coefficients of all moments.
type Coefficients = [[f64; FIELD_TERMS]; 3];
/// Most parameters of a model.
const MAX_PARAMETERS: usize = 3 * FIELD_TERMS;

/// The same term of each of the moments.
fn of_each_moment(term: usize) -> impl Iterator<Item = Basis> {
    (0..3).map(move |moment| Basis::from_iter([(moment, term, 1.0)]))
}

/// Curvature of the field and astigmatism of a centred lens, of which the first term is `xx`: a
/// size that grows outward, and a radial elongation.
fn centred(xx: usize) -> [Basis; 2] {
    let [xy, yy] = [xx + 1, xx + 2];
    [
        Basis::from_iter([(0, xx, 1.0), (0, yy, 1.0)]),
        Basis::from_iter([(1, xx, 1.0), (1, yy, -1.0), (2, xy, 2.0)]),
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

/// Numbers of bases, and their values.
type BasisValues = ArrayVec<(usize, f64), MAX_PARAMETERS>;

/// The moments of one star, their variances, and the terms at its place.
struct MomentSample {
    values: Moments,
    variances: Moments,
    terms: [f64; FIELD_TERMS],
}

impl MomentSample {
    fn of(star: &PsfStar, frame: &FieldFrame) -> Self {
        Self {
            values: Moments::from(star.moments),
            variances: Moments::from(star.variances).add_scalar(SCATTER * SCATTER),
            terms: frame.terms(star.spot.x, star.spot.y),
        }
    }

    /// The values, moment by moment, of the bases that each depends on, and their numbers: most bases
    /// are of one moment.
    fn rows(&self, model: &[Basis]) -> [BasisValues; 3] {
        let mut rows = [(); 3].map(|()| BasisValues::new());
        for (number, basis) in model.iter().enumerate() {
            let mut values = [0.0; 3];
            for &(moment, term, coefficient) in basis {
                values[moment] += coefficient * self.terms[term];
            }
            for (row, value) in rows.iter_mut().zip(values) {
                if value != 0.0 {
                    row.push((number, value));
                }
            }
        }
        rows
    }

    /// The moments that coefficients give.
    fn predicted(&self, coefficients: &Coefficients) -> Moments {
        Moments::from(polynomials(coefficients, &self.terms))
    }
}

/// The moments of the stars over the field, and whether they differ from place to place.
pub(super) fn moments_over_field(frame: FieldFrame, stars: &[PsfStar]) -> (FieldMoments, bool) {
    let known = stars
        .iter()
        .filter(|star| star.variances.iter().all(|v| v.is_finite()));
    let samples: Vec<MomentSample> = known.map(|star| MomentSample::of(star, &frame)).collect();
    let values = 3 * samples.len();
    let is_allowed = |model: &&Vec<Basis>| values >= 2 * model.len() + 6;
    let fits: Vec<(usize, FieldFit)> = models()
        .iter()
        .filter(is_allowed)
        .filter_map(|model| Some((model.len(), FieldFit::fit(&samples, model)?)))
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
    coefficients: Coefficients,
    chi2: f64,
}

impl FieldFit {
    /// The weighted least-squares fit of a model; stars far off count less. `None` where the stars
    /// do not fix it.
    fn fit(samples: &[MomentSample], model: &[Basis]) -> Option<Self> {
        /// Rounds of weights.
        const ROUNDS: usize = 4;
        let mut weights: Vec<Moments> = samples
            .iter()
            .map(|s| s.variances.map(f64::recip))
            .collect();
        let mut fit = Self {
            coefficients: [[0.0; FIELD_TERMS]; 3],
            chi2: 0.0,
        };
        let rows: Vec<[BasisValues; 3]> = samples.iter().map(|s| s.rows(model)).collect();
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
                for &(moment, term, coefficient) in basis {
                    fit.coefficients[moment][term] += factor * coefficient;
                }
            }
            fit.chi2 = 0.0;
            for (sample, weight) in samples.iter().zip(&mut weights) {
                let residual = sample.values - sample.predicted(&fit.coefficients);
                for i in 0..3 {
                    let sigmas = residual[i].abs() / sample.variances[i].sqrt();
                    let part = huber_weight(sigmas);
                    weight[i] = part / sample.variances[i];
                    fit.chi2 += part * sigmas * sigmas;
                }
            }
        }
        Some(fit)
    }
}
