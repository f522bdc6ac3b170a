//! A solution for tests.

use crate::ephemeris::places::AttitudeFrame;
use crate::solve::{Outcome, Solution, Timing};

/// A solution with this `outcome` and nothing else.
pub(super) fn solution(width: usize, height: usize, outcome: Outcome) -> Solution {
    Solution {
        width,
        height,
        row_order: None,
        date: None,
        sources: Vec::new(),
        observation: None,
        place_time: None,
        site: None,
        photometry: None,
        sky: None,
        comparison: None,
        gain_e_per_adu: None,
        calibration: None,
        exposure_s: None,
        spot_sigma_px: None,
        notes: Vec::new(),
        background: None,
        attitude_only: false,
        attitude_frame: AttitudeFrame::default(),
        outcome,
        bodies: Vec::new(),
        trails: None,
        timing: Timing::default(),
    }
}
