//! A solution for tests.

use super::outcome::Outcome;
use super::solution::Solution;
use super::stopwatch::Timing;
use crate::ephemeris::places::AttitudeFrame;

/// A solution with this `outcome` and nothing else.
pub(crate) fn solution(width: usize, height: usize, outcome: Outcome) -> Solution {
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
        deep: None,
        comparison: None,
        gain_e_per_adu: None,
        calibration: None,
        exposure_s: None,
        spot_sigma_px: None,
        notes: Vec::new(),
        background: None,
        sky_area: None,
        attitude_only: false,
        attitude_frame: AttitudeFrame::default(),
        outcome,
        bodies: Vec::new(),
        trails: None,
        timing: Timing::default(),
    }
}
