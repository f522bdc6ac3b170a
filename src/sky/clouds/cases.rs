//! The extinctions that are compared in a cell.

/// Below this extinction beyond that of clear air, in magnitudes, a sky counts as clear.
pub const CLEAR_MAG: f64 = 0.2;

/// Step of the extinctions that are compared, in magnitudes, and their number.
pub(super) const STEP_MAG: f64 = 0.05;
pub(super) const STEPS: usize = 121;
/// Variation of the extinction within a cell, over the extinction.
pub(super) const CLOUD_VARIATION: f64 = 0.3;
/// Parts of a cell that clouds cover where they are broken,
const COVERS: [f64; 2] = [0.5, 0.25];
/// and the step of their extinctions, in magnitudes, and their number.
pub(super) const BROKEN_STEP_MAG: f64 = 0.1;
const BROKEN_STEPS: usize = 60;
/// Kinds of cover: all of a cell, then the parts of [`COVERS`].
pub(super) const KINDS: usize = 1 + COVERS.len();
/// What is compared: clouds over all of a cell, then over its parts.
pub(super) const CASES: usize = STEPS + COVERS.len() * BROKEN_STEPS;

/// A value for each case.
pub(super) type Cases = [f64; CASES];

/// A case.
#[derive(Debug, Clone, Copy)]
pub(super) struct CloudCase {
    /// The kind of its cover.
    pub kind: usize,
    /// Part of the cell that clouds cover.
    pub cover: f64,
    /// Extinction by them, in magnitudes.
    pub mag: f64,
}

/// The case with this number.
pub(super) fn case(number: usize) -> CloudCase {
    match number.checked_sub(STEPS) {
        None => CloudCase {
            kind: 0,
            cover: 1.0,
            mag: number as f64 * STEP_MAG,
        },
        Some(broken) => CloudCase {
            kind: 1 + broken / BROKEN_STEPS,
            cover: COVERS[broken / BROKEN_STEPS],
            mag: (broken % BROKEN_STEPS + 1) as f64 * BROKEN_STEP_MAG,
        },
    }
}

/// Mean extinction of a cell in a case.
pub(super) fn mean_mag(number: usize) -> f64 {
    let CloudCase { cover, mag, .. } = case(number);
    cover * mag
}

/// Mean share of a star's light that clouds take in each case.
pub(super) fn hidden_fractions() -> Cases {
    std::array::from_fn(|number| {
        let CloudCase { cover, mag, .. } = case(number);
        cover * (1.0 - libm::pow(10.0, -0.4 * mag))
    })
}
