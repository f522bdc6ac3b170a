//! Attitude and angular rate from frame to frame: a Kalman filter with constant rate.
//!
//! State: the attitude R, and the rate ω of the camera about its own axes. `R(t + T) = exp(−ωT) R(t)`:
//! stars turn opposite to the camera. The rate changes by white angular acceleration, whose density
//! along each axis follows from the innovations: it grows where they are larger than expected, and
//! shrinks where they are smaller.
//!
//! # Reference
//! Markley 2003, J. Guid. Control Dyn. 26, 311, doi 10.2514/2.5048, for the error as a small
//! rotation; Bar-Shalom, Li & Kirubarajan 2001, Estimation with Applications to Tracking and
//! Navigation, section 6.2.2 (white acceleration) and 11.6 (noise from innovations).

use nalgebra::{Matrix3, Rotation3, SMatrix, Vector3};

/// Covariance of the small rotation and of the rate.
type Covariance = SMatrix<f64, 6, 6>;

/// Standard error of a rate of which nothing is known, in radians per unit of time.
const UNKNOWN_RATE_RAD: f64 = 100.0;
/// How fast the acceleration follows the innovations: the change of its logarithm where a squared
/// innovation is twice its expectation. The first innovations count more, this over their number, as
/// nothing is known before them.
const ADAPTATION: f64 = 0.2;
const FIRST_ADAPTATION: f64 = 2.0;
/// Largest change of its logarithm in a frame.
const MAX_ADAPTATION: f64 = 2.0;
/// Squared innovations count at most this many times their expectation, …
const MAX_RATIO: f64 = 9.0;
/// … and from here on the acceleration is at once raised to what explains them.
const SURPRISE_RATIO: f64 = 16.0;
/// The acceleration of an interval moves a star by no less than this, relative to the error of the
/// attitude: less, and the rate would forget nothing.
const MIN_ACCELERATION: f64 = 0.03;
/// Surprising innovations that are longer than this are jumps, in typical errors: no window is as
/// large.
const JUMP_TYPICALS: f64 = 8.0;

/// The attitude of a frame as the frames before it predict it.
#[derive(Debug, Clone, Copy)]
pub struct MotionPrediction {
    /// The attitude.
    pub icrs_to_camera: Matrix3<f64>,
    covariance: Covariance,
    interval: f64,
}

impl MotionPrediction {
    /// Covariance of the attitude, in rad².
    pub fn attitude_covariance_rad2(&self) -> Matrix3<f64> {
        self.covariance.fixed_view::<3, 3>(0, 0).into_owned()
    }
}

/// An attitude and its error.
#[derive(Debug, Clone, Copy)]
pub struct Measured {
    /// From directions of the ICRS to camera axes.
    pub icrs_to_camera: Matrix3<f64>,
    /// Covariance of a small rotation about the camera's axes, in rad².
    pub covariance_rad2: Matrix3<f64>,
}

/// Attitude and rate at a time.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    icrs_to_camera: Matrix3<f64>,
    rate_rad: Vector3<f64>,
    covariance: Covariance,
    /// Density of the angular acceleration along each axis; `None` before the first interval.
    acceleration: Option<Vector3<f64>>,
    time: f64,
    /// Innovations so far.
    updates: u32,
}

impl Motion {
    /// Begins with one attitude.
    pub fn start(measured: &Measured, time: f64) -> Self {
        let mut covariance = Covariance::identity() * (UNKNOWN_RATE_RAD * UNKNOWN_RATE_RAD);
        set_block(&mut covariance, 0, 0, &measured.covariance_rad2);
        Self {
            icrs_to_camera: measured.icrs_to_camera,
            rate_rad: Vector3::zeros(),
            covariance,
            acceleration: None,
            time,
            updates: 0,
        }
    }

    /// The rate of the camera about its own axes and its standard errors, in radians per unit of time; `None` where there
    /// was one attitude only.
    pub fn rate(&self) -> Option<[Vector3<f64>; 2]> {
        let variance = self.covariance.diagonal().fixed_rows::<3>(3).into_owned();
        (self.updates > 0).then(|| [self.rate_rad, variance.map(libm::sqrt)])
    }

    /// The attitude at a later time; `None` where it is not later. `typical_rad` is the error that
    /// an unknown acceleration may cause.
    pub fn predict(&self, time: f64, typical_rad: f64) -> Option<MotionPrediction> {
        let interval = time - self.time;
        if !(interval > 0.0 && interval.is_finite()) {
            return None;
        }
        let acceleration = self
            .acceleration
            .unwrap_or_else(|| Vector3::repeat(3.0 * square(typical_rad) / cube(interval)));
        Some(self.predicted(interval, &acceleration))
    }

    fn predicted(&self, interval: f64, acceleration: &Vector3<f64>) -> MotionPrediction {
        let turn = -self.rate_rad * interval;
        let mut transition = Covariance::identity();
        set_block(&mut transition, 0, 0, Rotation3::new(turn).matrix());
        set_block(&mut transition, 0, 3, &(-Matrix3::identity() * interval));
        let mut covariance = transition * self.covariance * transition.transpose();
        for axis in 0..3 {
            let density = acceleration[axis];
            let shared = -density * square(interval) / 2.0;
            covariance[(axis, axis)] += density * cube(interval) / 3.0;
            covariance[(axis, axis + 3)] += shared;
            covariance[(axis + 3, axis)] += shared;
            covariance[(axis + 3, axis + 3)] += density * interval;
        }
        MotionPrediction {
            icrs_to_camera: turned(&self.icrs_to_camera, turn),
            covariance,
            interval,
        }
    }

    /// Takes the attitude measured at the time of `prediction`. One that is no continuation of the
    /// motion before begins a new one: the rate is then not known.
    pub fn update(&mut self, prediction: &MotionPrediction, measured: &Measured, typical_rad: f64) {
        let time = self.time + prediction.interval;
        let innovation = turn_between(&prediction.icrs_to_camera, &measured.icrs_to_camera);
        let noise = &measured.covariance_rad2;
        let interval = prediction.interval;
        let first = Vector3::repeat(3.0 * square(typical_rad) / cube(interval));
        let mut acceleration = self.acceleration.unwrap_or(first);
        let ratio = |prediction: &MotionPrediction, axis: usize| {
            let expected = prediction.covariance[(axis, axis)] + noise[(axis, axis)];
            square(innovation[axis]) / expected
        };
        let mut prediction = *prediction;
        if (0..3).any(|axis| ratio(&prediction, axis) > SURPRISE_RATIO) {
            if innovation.norm() > JUMP_TYPICALS * typical_rad {
                return *self = Self::start(measured, time);
            }
            for axis in 0..3 {
                acceleration[axis] *= ratio(&prediction, axis).max(1.0);
            }
            prediction = self.predicted(interval, &acceleration);
        } else if self.updates > 0 {
            let adaptation = ADAPTATION.max(FIRST_ADAPTATION / f64::from(self.updates));
            for axis in 0..3 {
                let excess = ratio(&prediction, axis).min(MAX_RATIO) - 1.0;
                acceleration[axis] *= libm::exp((adaptation * excess).min(MAX_ADAPTATION));
            }
        }
        for axis in 0..3 {
            let least = square(MIN_ACCELERATION) * noise[(axis, axis)] / cube(interval);
            acceleration[axis] = acceleration[axis].max(least);
        }
        let spread = prediction.attitude_covariance_rad2() + noise;
        let Some(inverse) = spread.try_inverse() else {
            return *self = Self::start(measured, time);
        };
        let gain = prediction.covariance.fixed_view::<6, 3>(0, 0) * inverse;
        let correction = gain * innovation;
        let kept = Covariance::identity() - pad(&gain);
        // The form of Joseph stays symmetric and positive.
        let covariance =
            kept * prediction.covariance * kept.transpose() + gain * noise * gain.transpose();
        *self = Self {
            icrs_to_camera: turned(
                &prediction.icrs_to_camera,
                correction.fixed_rows::<3>(0).into_owned(),
            ),
            rate_rad: self.rate_rad + correction.fixed_rows::<3>(3),
            covariance,
            acceleration: Some(acceleration),
            time,
            updates: self.updates.saturating_add(1),
        };
    }
}

/// The gain with three more columns of zeros.
fn pad(gain: &SMatrix<f64, 6, 3>) -> Covariance {
    let mut padded = Covariance::zeros();
    padded.fixed_view_mut::<6, 3>(0, 0).copy_from(gain);
    padded
}

fn set_block(matrix: &mut Covariance, row: usize, column: usize, block: &Matrix3<f64>) {
    matrix.fixed_view_mut::<3, 3>(row, column).copy_from(block);
}

/// The attitude after a turn about the camera's axes.
fn turned(icrs_to_camera: &Matrix3<f64>, turn_rad: Vector3<f64>) -> Matrix3<f64> {
    Rotation3::new(turn_rad).matrix() * icrs_to_camera
}

/// The rotation about the camera's axes that turns one attitude into another.
pub fn turn_between(from: &Matrix3<f64>, to: &Matrix3<f64>) -> Vector3<f64> {
    let matrix = to * from.transpose();
    // sin θ times the axis: exact for small angles, where the cosine is not.
    let half = (matrix - matrix.transpose()) * 0.5;
    let skew = Vector3::new(half[(2, 1)], half[(0, 2)], half[(1, 0)]);
    let sine = skew.norm();
    let angle = libm::atan2(sine, 0.5 * (matrix.trace() - 1.0));
    if sine > 0.0 {
        skew * (angle / sine)
    } else {
        skew
    }
}

fn square(value: f64) -> f64 {
    value * value
}

fn cube(value: f64) -> f64 {
    value * value * value
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SIGMA_RAD: f64 = 1e-5;

    fn measured(truth: &Matrix3<f64>, rng: &mut ChaCha8Rng) -> Measured {
        let error = Vector3::from_fn(|_, _| SIGMA_RAD * rng.sample::<f64, _>(StandardNormal));
        Measured {
            icrs_to_camera: turned(truth, error),
            covariance_rad2: Matrix3::identity() * SIGMA_RAD.powi(2),
        }
    }

    #[test]
    fn the_turn_between_attitudes_is_that_which_was_made() {
        let from = *Rotation3::new(Vector3::new(1.0, 0.4, 0.3)).matrix();
        for size in [1e-9, 1e-3, 2.0] {
            let turn = Vector3::new(0.6, -0.8, 0.1) * size;
            let found = turn_between(&from, &turned(&from, turn));
            assert!((found - turn).norm() < 1e-12 * size.max(1e-3), "{size}");
        }
    }

    #[test]
    fn a_constant_rate_is_found_with_an_honest_error() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let rate = Vector3::new(0.01, -0.02, 0.03);
        let mut truth = *Rotation3::new(Vector3::new(1.0, 0.4, 0.3)).matrix();
        let mut motion = Motion::start(&measured(&truth, &mut rng), 0.0);
        assert!(motion.rate().is_none());
        let (mut nees, mut count) = (0.0, 0.0);
        for frame in 1..400 {
            let time = 0.1 * f64::from(frame);
            truth = turned(&truth, -rate * 0.1);
            let prediction = motion.predict(time, 1e-4).unwrap();
            motion.update(&prediction, &measured(&truth, &mut rng), 1e-4);
            let [found, sigma] = motion.rate().unwrap();
            if frame > 20 {
                let error = (found - rate).component_div(&sigma);
                nees += error.norm_squared() / 3.0;
                count += 1.0;
            }
        }
        let [_, sigma] = motion.rate().unwrap();
        assert!(sigma.max() < 1e-4, "{sigma:?}");
        assert!((0.2..2.0).contains(&(nees / count)), "{}", nees / count);
    }

    #[test]
    fn a_jump_begins_a_new_motion() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let truth = *Rotation3::new(Vector3::new(1.0, 0.4, 0.3)).matrix();
        let mut motion = Motion::start(&measured(&truth, &mut rng), 0.0);
        for frame in 1..10 {
            let prediction = motion.predict(f64::from(frame), 1e-4).unwrap();
            motion.update(&prediction, &measured(&truth, &mut rng), 1e-4);
        }
        assert!(motion.predict(9.0, 1e-4).is_none());
        let elsewhere = turned(&truth, Vector3::new(0.5, 0.0, 0.0));
        let prediction = motion.predict(10.0, 1e-4).unwrap();
        motion.update(&prediction, &measured(&elsewhere, &mut rng), 1e-4);
        assert!(motion.rate().is_none());
    }
}
