//! Which star is next to another one: the same clouds dim both.

use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::RAD_PER_DEG;

/// A star's direction, and the error of its magnitude.
pub(super) type Place = (UnitVector<Icrs>, f64);

/// The star next to `one`, if it is near: of those that are about as well measured, or better.
pub(super) fn neighbor(all: &[Place], one: usize) -> Option<usize> {
    const NEAR_DEG: f64 = 6.0;
    /// Largest error of the other star, over its own.
    const MAX: f64 = 2.0;
    let (direction, sigma_mag) = &all[one];
    let is_other = |&other: &usize| other != one && all[other].1 < MAX * sigma_mag;
    let cosine = |other: usize| (all[other].0.dot(direction), other);
    let others = (0..all.len()).filter(is_other).map(cosine);
    let (cosine, nearest) = others.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (cosine > libm::cos(NEAR_DEG * RAD_PER_DEG)).then_some(nearest)
}
