//! Attitude from directions known on the sky and measured with a known camera: Wahba's problem.

use crate::base::coords::{Camera, Icrs, Rotation, UnitVector};
use nalgebra::{Matrix3, SVD};

/// One direction on the sky and in the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionPair {
    /// Direction on the sky.
    pub icrs: UnitVector<Icrs>,
    /// Measured direction in the camera.
    pub camera: UnitVector<Camera>,
    /// Standard error of the measured direction on each perpendicular axis, in radians.
    pub sigma_rad: f64,
}

/// An attitude and its covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct Attitude {
    /// Rotation from the sky to camera axes.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Covariance of the small rotation about the camera's x, y and z axes, in rad².
    pub covariance_rad2: Matrix3<f64>,
}

/// The attitude that minimises Σ |camera − R · icrs|² / σ² (Wahba's problem), by singular value
/// decomposition.
///
/// `None` for fewer than two directions, or where all of them are parallel.
/// # Reference
/// Markley 1988, J. Astronaut. Sci. 36, 245 (the solution); Shuster & Oh 1981, J. Guid. Control 4,
/// 70, eq. (90) (the covariance, `[Σ σ⁻² (1 − w wᵀ)]⁻¹`).
pub fn estimate_attitude(pairs: &[DirectionPair]) -> Option<Attitude> {
    let mut profile = Matrix3::zeros();
    let mut information = Matrix3::zeros();
    for pair in pairs {
        let weight = pair.sigma_rad.powi(-2);
        let (w, v) = (pair.camera.as_vector(), pair.icrs.as_vector());
        profile += weight * w * v.transpose();
        information += weight * (Matrix3::identity() - w * w.transpose());
    }
    let covariance_rad2 = information.try_inverse()?;
    let svd = SVD::new(profile, true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    if pairs.len() < 2 || svd.singular_values[1] < 1e-12 * svd.singular_values[0] {
        return None;
    }
    let mut signs = Matrix3::identity();
    signs[(2, 2)] = (u.determinant() * v_t.determinant()).signum();
    // nalgebra sorts the singular values in descending order: the sign goes to the smallest.
    Some(Attitude {
        icrs_to_camera: Rotation::from_matrix(u * signs * v_t),
        covariance_rad2,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::{RAD_PER_ARCSEC, RAD_PER_DEG};
    use nalgebra::Vector3;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    fn noise(rng: &mut ChaCha8Rng) -> f64 {
        rng.sample(StandardNormal)
    }

    fn pairs(
        rng: &mut ChaCha8Rng,
        attitude: &Rotation<Icrs, Camera>,
        count: usize,
        sigma_rad: f64,
    ) -> Vec<DirectionPair> {
        (0..count)
            .map(|_| {
                let (x, y) = (rng.random_range(-0.17..0.17), rng.random_range(-0.17..0.17));
                let true_camera = UnitVector::from_vector(Vector3::new(x, y, 1.0));
                let turn = Vector3::new(noise(rng), noise(rng), noise(rng)) * sigma_rad;
                let seen = true_camera.as_vector() + turn.cross(true_camera.as_vector());
                DirectionPair {
                    icrs: attitude.inverse().apply(&true_camera),
                    camera: UnitVector::from_vector(seen),
                    sigma_rad,
                }
            })
            .collect()
    }

    #[test]
    fn exact_directions_give_the_exact_attitude() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let centre = UnitVector::from_ra_dec(1.0, -1.5);
        let truth = Rotation::looking_at(&centre, 170.0 * RAD_PER_DEG);
        let mut pairs = pairs(&mut rng, &truth, 5, 0.0);
        pairs.iter_mut().for_each(|p| p.sigma_rad = RAD_PER_ARCSEC);
        let found = estimate_attitude(&pairs).unwrap().icrs_to_camera;
        assert!(found.angle_to(&truth) < 1e-7);
        assert!((found.matrix() - truth.matrix()).abs().max() < 1e-12);
    }

    #[test]
    fn one_direction_or_parallel_ones_give_none() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let truth = Rotation::looking_at(&UnitVector::from_ra_dec(1.0, 0.3), 0.0);
        let one = pairs(&mut rng, &truth, 1, RAD_PER_ARCSEC);
        assert_eq!(estimate_attitude(&one), None);
        assert_eq!(estimate_attitude(&[one[0], one[0]]), None);
        assert_eq!(estimate_attitude(&[]), None);
    }

    #[test]
    fn errors_have_the_covariance_that_is_stated() {
        const TRIALS: usize = 4000;
        const SIGMA_RAD: f64 = 3.0 * RAD_PER_ARCSEC;
        // Standard error of a variance from 4000 trials: 2.2 %; four of them.
        const RATIO_TOLERANCE: f64 = 0.09;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let truth = Rotation::looking_at(&UnitVector::from_ra_dec(2.0, 1.2), 0.7);
        let mut nees = [0.0; 3];
        for _ in 0..TRIALS {
            let pairs = pairs(&mut rng, &truth, 8, SIGMA_RAD);
            let attitude = estimate_attitude(&pairs).unwrap();
            let error = attitude.icrs_to_camera.matrix() * truth.matrix().transpose();
            let turn = [error[(2, 1)], error[(0, 2)], error[(1, 0)]];
            for axis in 0..3 {
                nees[axis] += turn[axis].powi(2) / attitude.covariance_rad2[(axis, axis)];
            }
        }
        for sum in nees {
            let ratio = sum / TRIALS as f64;
            assert!((ratio - 1.0).abs() < RATIO_TOLERANCE, "{ratio}");
        }
    }
}
