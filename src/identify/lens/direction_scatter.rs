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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, Rotation, UnitVector};
    use crate::camera::CameraModel;
    use crate::identify::fit::{MeasuredStar, fit_jointly};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SIGMA_PX: f64 = 0.1;

    /// A frame of 60 stars by a camera whose focal length is `ratio` times the usual one.
    fn frame(ratio: f64, rng: &mut ChaCha8Rng) -> JointFrame {
        let camera = CameraModel::pinhole(1024.0, 768.0, 1500.0 * ratio, false);
        let place =
            UnitVector::from_ra_dec(rng.random_range(0.0..6.0), rng.random_range(-1.0..1.0));
        let icrs_to_camera = Rotation::looking_at(&place, rng.random_range(-3.0..3.0));
        let stars = (0..60).map(|_| {
            let [x, y] = [1024.0, 768.0].map(|side| rng.random_range(0.0..side));
            let direction = camera.direction_of(&PixelPoint::new(x, y)).unwrap();
            let [x, y] = [x, y].map(|at| at + SIGMA_PX * rng.sample::<f64, _>(StandardNormal));
            MeasuredStar {
                pixel: PixelPoint::new(x, y),
                icrs: icrs_to_camera.inverse().apply(&direction),
                sigma_px: SIGMA_PX,
            }
        });
        JointFrame {
            stars: stars.collect(),
            icrs_to_camera,
        }
    }

    /// The mean factor for eight frames whose scales scatter.
    fn factor(scatter: f64, directions: [usize; 8]) -> f64 {
        const TRIALS: u32 = 20;
        let camera = CameraModel::pinhole(1024.0, 768.0, 1500.0, false);
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let trials = (0..TRIALS).map(|_| {
            let frames = directions.map(|direction| {
                let side = if direction.is_multiple_of(2) {
                    1.0
                } else {
                    -1.0
                };
                frame(1.0 + side * scatter, &mut rng)
            });
            let fit = fit_jointly(&frames, &camera, None).unwrap();
            variance_factor(&frames, &fit, &directions)
        });
        trials.sum::<f64>() / f64::from(TRIALS)
    }

    #[test]
    fn directions_that_differ_make_the_errors_larger() {
        let apart = [0, 1, 2, 3, 4, 5, 6, 7];
        let same = factor(0.0, apart);
        assert!((1.0..1.35).contains(&same), "{same}");
        // A frame alone has 3e-5.
        let differing = factor(1e-4, apart);
        assert!(differing > 4.0, "{differing}");
        assert_eq!(factor(1e-4, [0; 8]), 1.0);
        let of_two = factor(1e-4, [0, 0, 0, 0, 1, 1, 1, 1]);
        assert!(of_two > 3.0, "{of_two}");
    }
}
