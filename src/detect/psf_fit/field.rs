//! Size and elongation of the spots over the field: polynomials of the lowest degree that the stars
//! allow.

use super::stars::PsfStar;
use crate::detect::effective_psf::{FIELD_TERMS, FieldFrame, FieldMoments};
use nalgebra::{DMatrix, DVector};

/// Numbers of terms that are tried: constant, linear, quadratic, quartic.
const TERMS: [usize; 4] = [1, 3, 6, FIELD_TERMS];
/// Scatter of the stars' own moments beyond their errors: their colours, their neighbours.
const SCATTER: f64 = 0.02;
/// More terms must lower chi² by more than chance does in one of 10⁴ cases.
const CHANCE_SIGMA: f64 = 4.0;

/// Value, variance and terms of each star, for one of the moments.
struct Sample {
    value: f64,
    variance: f64,
    terms: [f64; FIELD_TERMS],
}

/// The moments of the stars over the field; whether they differ from place to place.
pub(super) fn moments_over_field(frame: FieldFrame, stars: &[PsfStar]) -> (FieldMoments, bool) {
    let samples: [Vec<Sample>; 3] = std::array::from_fn(|i| {
        let sample = |star: &PsfStar| Sample {
            value: star.moments[i],
            variance: star.variances[i] + SCATTER * SCATTER,
            terms: frame.terms(star.spot.x, star.spot.y),
        };
        let known = stars.iter().filter(|star| star.variances[i].is_finite());
        known.map(sample).collect()
    });
    let fits = |terms: usize| {
        samples
            .each_ref()
            .map(|samples| Polynomial::fit(samples, terms))
    };
    let chi2 = |fits: &[Polynomial; 3]| fits.iter().map(|fit| fit.chi2).sum::<f64>();
    let values = 3 * stars.len();
    let mut best = fits(1);
    let mut best_terms = 1;
    for terms in TERMS {
        // Two stars for each term, and some more.
        if stars.len() < 2 * terms + 4 {
            break;
        }
        let larger = fits(terms);
        let of_noise = (chi2(&larger) / (values - 3 * terms) as f64).max(1.0);
        let more = (3 * (terms - best_terms)) as f64;
        let chance = more + CHANCE_SIGMA * (2.0 * more).sqrt();
        if chi2(&best) - chi2(&larger) > chance * of_noise {
            (best, best_terms) = (larger, terms);
        }
    }
    let range = samples.each_ref().map(|samples| {
        let values = || samples.iter().map(|sample| sample.value);
        [
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        ]
    });
    let moments = FieldMoments {
        frame,
        coefficients: best.map(|fit| fit.coefficients),
        range,
    };
    (moments, best_terms > 1)
}

/// A polynomial over the field.
struct Polynomial {
    coefficients: [f64; FIELD_TERMS],
    chi2: f64,
}

impl Polynomial {
    /// The weighted least-squares fit of the first `terms` terms; samples far off count less.
    fn fit(samples: &[Sample], terms: usize) -> Self {
        /// Rounds of weights.
        const ROUNDS: usize = 4;
        /// Residuals beyond this many standard deviations count less.
        const HUBER_SIGMA: f64 = 2.5;
        let mut coefficients = [0.0; FIELD_TERMS];
        let mut weights: Vec<f64> = samples.iter().map(|s| 1.0 / s.variance).collect();
        let mut chi2 = 0.0;
        for _ in 0..ROUNDS {
            let mut matrix = DMatrix::<f64>::identity(terms, terms) * 1e-6;
            let mut right = DVector::<f64>::zeros(terms);
            for (sample, weight) in samples.iter().zip(&weights) {
                let row = DVector::from_column_slice(&sample.terms[..terms]);
                right.axpy(weight * sample.value, &row, 1.0);
                matrix.ger(*weight, &row, &row, 1.0);
            }
            let Some(factor) = matrix.cholesky() else {
                break;
            };
            coefficients[..terms].copy_from_slice(factor.solve(&right).as_slice());
            chi2 = 0.0;
            for (sample, weight) in samples.iter().zip(&mut weights) {
                let terms = sample.terms.iter().zip(&coefficients);
                let residual = sample.value - terms.map(|(t, c)| t * c).sum::<f64>();
                let sigmas = residual.abs() / sample.variance.sqrt();
                let part = (HUBER_SIGMA / sigmas).min(1.0);
                *weight = part / sample.variance;
                chi2 += part * sigmas * sigmas;
            }
        }
        Self { coefficients, chi2 }
    }
}
