//! The extinctions that are compared in a cell.

/// Below this extinction beyond that of clear air, in magnitudes, a sky counts as clear.
pub const CLEAR_MAG: f64 = 0.2;

/// Step of the extinctions that are compared, in magnitudes, and their number.
pub(super) const STEP_MAG: f64 = 0.05;
pub(super) const STEPS: usize = 121;
/// The same of clouds that cover half of a cell.
pub(super) const HALF_STEP_MAG: f64 = 0.1;
const HALF_STEPS: usize = 60;
/// What is compared: clouds over all of a cell, then over half of it.
pub(super) const CASES: usize = STEPS + HALF_STEPS;

/// A value for each case.
pub(super) type Cases = [f64; CASES];

/// Extinction by clouds that cover half of a cell.
pub(super) fn half_mag(step: usize) -> f64 {
    (step + 1) as f64 * HALF_STEP_MAG
}

/// Mean extinction of a cell in a case.
pub(super) fn mean_mag(case: usize) -> f64 {
    match case.checked_sub(STEPS) {
        None => case as f64 * STEP_MAG,
        Some(step) => 0.5 * half_mag(step),
    }
}

/// Mean share of a star's light that clouds take in each case.
pub(super) fn hidden_shares() -> Cases {
    let of = |mag: f64| 1.0 - libm::pow(10.0, -0.4 * mag);
    std::array::from_fn(|case| match case.checked_sub(STEPS) {
        None => of(case as f64 * STEP_MAG),
        Some(step) => 0.5 * of(half_mag(step)),
    })
}
