//! How the camera stands, and when it was moved.

use super::row::NightRow;
use crate::base::coords::{Camera, Horizon, Rotation, small_turn_rad};
use crate::base::statistics::{median, median_of};
use crate::base::units::{DEG_PER_RAD, RAD_PER_ARCSEC};
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use std::collections::VecDeque;

/// Frames whose median pointing is held.
const RECENT: usize = 15;
/// Frames that agree with each other and not with what is held before a jump is stated.
const CONFIRMED: usize = 3;
/// Pointings that differ by more than these standard errors do not agree,
const SIGMAS: f64 = 6.0;
/// and by more than this: neglected effects, and lenses that are not quite known.
const MIN_RAD: f64 = 120.0 * RAD_PER_ARCSEC;

/// A moment at which the camera was moved.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PointingJump {
    /// Number of the first frame after it, from 0.
    pub frame: usize,
    /// Angle by which the camera was turned, in degrees.
    pub shift_deg: f64,
}

/// A pointing and its standard error.
#[derive(Debug, Clone, Copy)]
struct Pointed {
    frame: usize,
    pointing: Rotation<Horizon, Camera>,
    sigma_rad: f64,
}

/// The pointing that is held, from frame to frame. It depends on the frames so far and nothing else.
#[derive(Debug, Clone, Default)]
pub struct PointingHistory {
    fixed: Option<Rotation<Horizon, Camera>>,
    /// Those of the last frames that agree.
    recent: VecDeque<Pointed>,
    /// The last frames that do not agree with what is held.
    suspects: Vec<Pointed>,
    jumps: Vec<PointingJump>,
}

impl PointingHistory {
    /// Starts with this pointing, if one is known.
    pub fn new(held: Option<Rotation<Horizon, Camera>>) -> Self {
        Self {
            fixed: held,
            ..Self::default()
        }
    }

    /// The pointing that is held, and its standard error about each axis in radians; `None` as long as frames
    /// contradict it and none agrees with it, as those of a camera that follows the stars.
    pub fn fixed(&self) -> Option<(Rotation<Horizon, Camera>, f64)> {
        let is_contradicted = self.recent.is_empty() && !self.suspects.is_empty();
        let held = self.fixed.filter(|_| !is_contradicted)?;
        Some((held, self.scatter_rad()))
    }

    /// When the camera was moved.
    pub fn jumps(&self) -> &[PointingJump] {
        &self.jumps
    }

    /// Takes the pointing of frame number `frame` with its standard error, and returns by how much it
    /// differs from what was held, in radians.
    pub fn take(
        &mut self,
        frame: usize,
        pointing: Rotation<Horizon, Camera>,
        sigma_rad: f64,
    ) -> f64 {
        let now = Pointed {
            frame,
            pointing,
            sigma_rad,
        };
        let held = *self.fixed.get_or_insert(pointing);
        let shift_rad = held.angle_to(&pointing);
        if shift_rad < self.limit_rad(sigma_rad) {
            self.suspects.clear();
            self.recent.push_back(now);
            if self.recent.len() > RECENT {
                self.recent.pop_front();
            }
            self.fixed = Some(self.middle(held));
        } else {
            self.suspect(now, held);
        }
        shift_rad
    }

    /// As [`Self::take`] with the pointing of a row, where it has one.
    pub fn take_row(&mut self, frame: usize, row: &NightRow) -> Option<f64> {
        let sigma_rad = row.pointing_sigma_arcsec? * RAD_PER_ARCSEC;
        Some(self.take(frame, row.horizon_to_camera()?, sigma_rad))
    }

    fn limit_rad(&self, sigma_rad: f64) -> f64 {
        (SIGMAS * libm::hypot(self.scatter_rad(), sigma_rad)).max(MIN_RAD)
    }

    /// Counts a frame that does not agree with `held`.
    fn suspect(&mut self, now: Pointed, held: Rotation<Horizon, Camera>) {
        let limit_rad = self.limit_rad(now.sigma_rad);
        let agrees = |other: &Pointed| other.pointing.angle_to(&now.pointing) < limit_rad;
        self.suspects.retain(agrees);
        self.suspects.push(now);
        if self.suspects.len() < CONFIRMED {
            return;
        }
        // Without a pointing that was confirmed there is none that was left.
        if !self.recent.is_empty() {
            self.jumps.push(PointingJump {
                frame: self.suspects[0].frame,
                shift_deg: held.angle_to(&now.pointing) * DEG_PER_RAD,
            });
        }
        self.recent = self.suspects.drain(..).collect();
        self.fixed = Some(self.middle(now.pointing));
    }

    /// The median of the recent pointings, as turns from `from`.
    fn middle(&self, from: Rotation<Horizon, Camera>) -> Rotation<Horizon, Camera> {
        let turns: Vec<Vector3<f64>> = self.turns(from).collect();
        let axis = |axis: usize| median_of(turns.iter().map(|turn| turn[axis])).unwrap_or(0.0);
        from.then_turn(Vector3::new(axis(0), axis(1), axis(2)))
    }

    fn turns(&self, from: Rotation<Horizon, Camera>) -> impl Iterator<Item = Vector3<f64>> {
        let back: Matrix3<f64> = from.matrix().transpose();
        // They agree, so the turns are small.
        let turn = move |pointed: &Pointed| small_turn_rad(&(pointed.pointing.matrix() * back));
        self.recent.iter().map(turn)
    }

    /// Standard deviation of the recent pointings about each axis, by their median distance from the middle.
    fn scatter_rad(&self) -> f64 {
        /// Median distance of three normal errors of 1.
        const MEDIAN: f64 = 1.538;
        let stated = self.recent.iter().map(|pointed| pointed.sigma_rad);
        let stated_rad = stated.fold(0.0, f64::max);
        let Some(held) = self.fixed.filter(|_| self.recent.len() >= CONFIRMED) else {
            return stated_rad;
        };
        let mut off: Vec<f64> = self.turns(held).map(|turn| turn.norm()).collect();
        (median(&mut off) / MEDIAN).max(stated_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::RAD_PER_DEG;

    const SIGMA_RAD: f64 = 10.0 * RAD_PER_ARCSEC;

    /// A pointing that is turned by this about the boresight, in degrees.
    fn turned(deg: f64) -> Rotation<Horizon, Camera> {
        Rotation::from_quaternion([1.0, 0.0, 0.0, 0.0]).then_turn(Vector3::new(
            0.0,
            0.0,
            deg * RAD_PER_DEG,
        ))
    }

    fn after(degrees: &[f64]) -> PointingHistory {
        let mut history = PointingHistory::new(Some(turned(0.0)));
        for (frame, deg) in degrees.iter().enumerate() {
            history.take(frame, turned(*deg), SIGMA_RAD);
        }
        history
    }

    #[test]
    fn a_knock_is_the_first_of_three_frames_that_agree_elsewhere() {
        let history = after(&[0.0, 0.001, -0.001, 0.0, 1.5, 1.5, 1.501]);
        let [jump] = history.jumps() else {
            panic!("{history:?}");
        };
        assert_eq!(jump.frame, 4);
        assert!((jump.shift_deg - 1.5).abs() < 0.01);
        let (held, _) = history.fixed().unwrap();
        assert!(held.angle_to(&turned(1.5)) < 1e-4);
    }

    #[test]
    fn a_single_frame_elsewhere_and_a_camera_that_turns_are_no_knocks() {
        assert!(
            after(&[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0])
                .jumps()
                .is_empty()
        );
        let turning: Vec<f64> = (0..30).map(f64::from).collect();
        let turning = after(&turning[1..]);
        assert!(turning.jumps().is_empty() && turning.fixed().is_none());
    }

    #[test]
    fn a_slow_drift_is_followed() {
        let drifting: Vec<f64> = (0..200).map(|frame| 0.002 * f64::from(frame)).collect();
        let history = after(&drifting);
        assert!(history.jumps().is_empty());
        assert!(history.fixed().unwrap().0.angle_to(&turned(0.4)) < 0.02 * RAD_PER_DEG);
    }

    #[test]
    fn the_same_pointing_again_is_no_shift() {
        for number in 1..1000 {
            let part = |factor: f64| (factor * f64::from(number)).sin();
            let pointing = Rotation::from_quaternion([1e-6, part(1.1), part(2.3), part(0.7)]);
            let mut history = PointingHistory::new(None);
            for frame in 0..4 {
                let shift_rad = history.take(frame, pointing, SIGMA_RAD);
                assert!(shift_rad < 1e-9, "{number}: {shift_rad}");
            }
        }
    }
}
