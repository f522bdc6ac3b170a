//! Do the directions that a camera looked into agree on its lens?

use crate::identify::fit::{JointFit, JointFrame, lens_pulls};
use nalgebra::{DMatrix, DVector};

/// Degrees of freedom with which errors are taken to be as stated before any direction is looked at.
const PRIOR_FREEDOMS: f64 = 4.0;

/// By how much the squared errors of the lens of a fit are to grow, for directions to agree within them: the
/// squared differences of the lens of each from that of all over the ones expected (Birge 1932, Phys. Rev.
/// 40, 207), at least 1. With a single direction nothing is known of it, and it is 1.
pub(super) fn variance_factor(frames: &[JointFrame], fit: &JointFit, directions: &[usize]) -> f64 {
    let count = directions.iter().max().map_or(0, |last| last + 1);
    let Some(pulls) = lens_pulls(frames, fit).filter(|_| count > 1) else {
        return 1.0;
    };
    let parameters = fit.covariance.nrows();
    let mut sums = vec![
        (
            DVector::zeros(parameters),
            DMatrix::zeros(parameters, parameters)
        );
        count
    ];
    for (pull, direction) in pulls.iter().zip(directions) {
        sums[*direction].0 += &pull.vector;
        sums[*direction].1 += &pull.information;
    }
    let (mut found, mut expected, mut squares) = (0.0, 0.0, 0.0);
    for (vector, information) in &sums {
        found += vector.dot(&(&fit.covariance * vector));
        // The fit of all follows each by its share of the information.
        let share = &fit.covariance * information;
        let freedom = &share - &share * &share;
        expected += freedom.trace();
        squares += (&freedom * &freedom).trace();
    }
    // Satterthwaite 1946, Biometrics Bulletin 2, 110.
    let freedoms = expected * expected / squares;
    let factor = (PRIOR_FREEDOMS + freedoms * found / expected) / (PRIOR_FREEDOMS + freedoms);
    if factor.is_finite() {
        factor.max(1.0)
    } else {
        1.0
    }
}
