//! Positions rounded to half milliarcseconds.
//!
//! SKY2000 gives right ascension in steps of 0.0001 s (1.5 mas) and declination in steps of 1 mas.
//! Both are multiples of 0.5 mas, so its positions are exact here, and a turn (2 592 000 000 steps)
//! fits 32 bits; positions of other catalogues are rounded. Every reader takes its directions from
//! here, so a star has the same direction, to the last bit, from whichever file it is read.

use crate::base::coords::{Icrs, UnitVector};
use std::f64::consts::TAU;

/// Steps in a full turn.
pub(super) const STEPS_PER_TURN: u32 = 2 * 360 * 3600 * 1000;
/// Steps from the equator to a pole.
pub(super) const STEPS_PER_QUARTER: u32 = STEPS_PER_TURN / 4;
/// Steps in 0.0001 s of right ascension.
pub(super) const STEPS_PER_TENTH_MS_OF_TIME: u32 = 3;
/// Steps in 1 mas.
pub(super) const STEPS_PER_MAS: u32 = 2;

/// The range of declinations, for messages.
pub(super) const EXPECTED_DEC: &str = "a declination from -90 to +90 degrees";

const STEPS_PER_DEG: f64 = STEPS_PER_TURN as f64 / 360.0;
const RAD_PER_STEP: f64 = TAU / STEPS_PER_TURN as f64;

/// Right ascension in [0, `STEPS_PER_TURN`) and declination within ±`STEPS_PER_QUARTER`, both in
/// half milliarcseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Position {
    ra_steps: u32,
    dec_steps: i32,
}

impl Position {
    /// The position; `None` if it is out of range.
    pub(super) fn new(ra_steps: u32, dec_steps: i32) -> Option<Self> {
        let valid = ra_steps < STEPS_PER_TURN && dec_steps.unsigned_abs() <= STEPS_PER_QUARTER;
        valid.then_some(Self {
            ra_steps,
            dec_steps,
        })
    }

    /// The position nearest to a right ascension and a declination in degrees; `None` beyond a
    /// pole.
    pub(super) fn from_degrees(ra_deg: f64, dec_deg: f64) -> Option<Self> {
        let ra_steps = (ra_deg.rem_euclid(360.0) * STEPS_PER_DEG).round() as u32 % STEPS_PER_TURN;
        let within = dec_deg.abs() <= 90.0;
        within.then_some(Self {
            ra_steps,
            dec_steps: (dec_deg * STEPS_PER_DEG).round() as i32,
        })
    }

    /// The position nearest to `direction`.
    pub(super) fn nearest(direction: &UnitVector<Icrs>) -> Self {
        let (ra_rad, dec_rad) = direction.to_ra_dec();
        // Just below a full turn may round up to it.
        let ra_steps = (ra_rad / RAD_PER_STEP).round() as u32 % STEPS_PER_TURN;
        let dec_steps = (dec_rad / RAD_PER_STEP).round() as i32;
        Self {
            ra_steps,
            dec_steps,
        }
    }

    /// Right ascension in half milliarcseconds.
    pub(super) fn ra_steps(self) -> u32 {
        self.ra_steps
    }

    /// Declination in half milliarcseconds.
    pub(super) fn dec_steps(self) -> i32 {
        self.dec_steps
    }

    /// Declination in radians.
    pub(super) fn dec_rad(self) -> f64 {
        f64::from(self.dec_steps) * RAD_PER_STEP
    }

    /// The direction.
    pub(super) fn direction(self) -> UnitVector<Icrs> {
        UnitVector::from_ra_dec(f64::from(self.ra_steps) * RAD_PER_STEP, self.dec_rad())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        // Within 1000 steps (0.5″) of a pole the vector loses the right ascension.
        #[test]
        fn a_position_survives_its_unit_vector(
            ra_steps in 0..STEPS_PER_TURN,
            dec_steps in -(STEPS_PER_QUARTER as i32) + 1000..STEPS_PER_QUARTER as i32 - 1000,
        ) {
            let position = Position::new(ra_steps, dec_steps).unwrap();
            prop_assert_eq!(Position::nearest(&position.direction()), position);
        }
    }

    #[test]
    fn the_meridian_and_the_poles_are_in_range() {
        let west = UnitVector::from_ra_dec(-1e-12, 0.0);
        assert_eq!(Position::nearest(&west).ra_steps(), 0);
        for pole in [-1.0, 1.0] {
            let direction = UnitVector::from_ra_dec(1.0, pole * TAU / 4.0);
            let position = Position::nearest(&direction);
            assert_eq!(position.dec_steps().unsigned_abs(), STEPS_PER_QUARTER);
            assert!(Position::new(position.ra_steps(), position.dec_steps()).is_some());
        }
        assert!(Position::new(STEPS_PER_TURN, 0).is_none());
        assert!(Position::new(0, STEPS_PER_QUARTER as i32 + 1).is_none());
        assert!(Position::new(0, i32::MIN).is_none());
    }
}
