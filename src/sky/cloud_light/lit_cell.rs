//! A cell with what its stars tell, and its light.

/// Steps of the share of a star's light that clouds take.
pub(super) const STEPS: usize = 50;

/// Probabilities of the share of a star's light that clouds take in a cell, from 0 to 1.
#[derive(Debug, Clone)]
pub(in crate::sky) struct Hidden {
    /// If the cell is part of the clear sky.
    pub(super) clear: [f64; STEPS + 1],
    /// If it is not.
    pub(super) cloud: [f64; STEPS + 1],
}

impl Hidden {
    /// No probabilities yet.
    pub(in crate::sky) const NONE: Self = Self {
        clear: [0.0; STEPS + 1],
        cloud: [0.0; STEPS + 1],
    };

    /// Adds probabilities of a share.
    pub(in crate::sky) fn add(&mut self, share: f64, clear: f64, cloud: f64) {
        let step = (share * STEPS as f64).round() as usize;
        self.clear[step] += clear;
        self.cloud[step] += cloud;
    }

    /// The probability of a step where a part `clouded` of the sky is not clear.
    pub(super) fn mixed(&self, step: usize, clouded: f64) -> f64 {
        (1.0 - clouded) * self.clear[step] + clouded * self.cloud[step]
    }
}

/// The share of a step.
pub(super) fn fraction_of(step: usize) -> f64 {
    step as f64 / STEPS as f64
}

/// A value for the share of each step.
pub(in crate::sky) fn for_each_fraction(of: impl Fn(f64) -> f64) -> [f64; STEPS + 1] {
    std::array::from_fn(|step| of(fraction_of(step)))
}

/// A cell of which stars tell, and its light.
#[derive(Debug, Clone)]
pub(in crate::sky) struct LitCell {
    /// The cell.
    pub cell: usize,
    /// What its stars tell.
    pub hidden: Hidden,
    /// What its stars alone tell: the likelihood of each step of the share.
    pub by_stars: [f64; STEPS + 1],
    /// Its light over its solid angle, in any unit.
    pub light: f64,
    /// Terms of which the light of a clear sky is composed.
    pub terms: Vec<f64>,
}
