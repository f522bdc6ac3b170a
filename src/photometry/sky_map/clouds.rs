//! Clouds: stars that are dimmed, and stars that are missing.
//!
//! For the extinction A beyond that of clear air, a star that was measured has the likelihood of its
//! magnitude, and one that is missing that of not being detected A magnitudes fainter. Beforehand, half of
//! the sky has the extinction of clear air alone, and the other half more.

use super::relative_limit::RelativeLimit;
use super::witnesses::{Sky, Witness};
use crate::base::statistics::Estimate;

/// Step of the extinctions that are compared, in magnitudes, and their number.
const STEP_MAG: f64 = 0.05;
const STEPS: usize = 121;
/// Mean extinction of clouds, in magnitudes: thin ones are more frequent.
const MEAN_CLOUD_MAG: f64 = 1.0;
/// Below this extinction beyond that of clear air, in magnitudes, a sky counts as clear.
pub const CLEAR_MAG: f64 = 0.2;
/// Variation of clear air, in magnitudes.
const CLEAR_SIGMA_MAG: f64 = 0.05;
/// Variation of the extinction within a cell, over the extinction.
const CLOUD_VARIATION: f64 = 0.3;
/// Share of stars whose brightness or presence tells nothing: variable stars, wrong names.
const UNTRUE: f64 = 0.02;
/// Weight of the stars that tell of a cell at least: without any, nothing is known of it.
const LEAST_WEIGHT: f64 = 0.3;
/// Stars that should be detected with at least this probability count as expected.
const EXPECTED: f64 = 0.9;

/// Clouds in a cell.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CellClouds {
    /// Stars in it that a clear sky would show.
    pub expected: usize,
    /// Those of them that were detected.
    pub detected: usize,
    /// Extinction beyond that of clear air.
    pub extinction_mag: Option<Estimate>,
    /// Probability that it is below [`CLEAR_MAG`].
    pub clear: Option<f64>,
}

impl Sky<'_> {
    /// Clouds in each cell.
    pub(super) fn clouds(&self, witnesses: &[Witness]) -> Vec<CellClouds> {
        let limit = if self.is_usual {
            Some(RelativeLimit::usual())
        } else {
            RelativeLimit::of_clear_sky(witnesses, self.clear_sky, self.chance)
        };
        let logs: Vec<[f64; STEPS]> = witnesses
            .iter()
            .map(|witness| self.ln_likelihoods(witness, limit.as_ref()))
            .collect();
        let of_cell = |cell: usize| {
            let mut clouds = CellClouds::default();
            let mut total = [0.0; STEPS];
            let mut told = 0.0;
            for (witness, logs) in witnesses.iter().zip(&logs) {
                let Some(weight) = self.grid.weight(cell, &witness.star.direction) else {
                    continue;
                };
                for (total, log) in total.iter_mut().zip(logs) {
                    *total += weight * log;
                }
                let is_expected = limit
                    .as_ref()
                    .is_some_and(|limit| limit.probability(witness.relative_mag) > EXPECTED);
                if is_expected || witness.star.measured.is_some() {
                    told += weight;
                }
                if witness.cell == cell && is_expected {
                    clouds.expected += 1;
                    clouds.detected += usize::from(witness.star.is_detected);
                }
            }
            if told > LEAST_WEIGHT && self.depths[cell].is_some() {
                let (clear, extinction_mag) = posterior(&total);
                clouds.clear = Some(clear);
                clouds.extinction_mag = Some(extinction_mag);
            }
            clouds
        };
        (0..self.grid.places.len()).map(of_cell).collect()
    }

    /// The logarithm of the likelihood of a star for each extinction.
    fn ln_likelihoods(&self, witness: &Witness, limit: Option<&RelativeLimit>) -> [f64; STEPS] {
        let star = witness.star;
        let dimmed_by = self.clear_sky.dimmed_by(star);
        std::array::from_fn(|step| {
            let extinction_mag = step as f64 * STEP_MAG;
            let seen = limit.map_or(1.0, |limit| {
                limit.probability(witness.relative_mag + extinction_mag)
            });
            let seen = UNTRUE + (1.0 - 2.0 * UNTRUE) * seen;
            let likelihood = match (dimmed_by, star.is_detected) {
                (Some(dimmed_by), _) => {
                    let sigma_mag = libm::hypot(dimmed_by.sigma, CLOUD_VARIATION * extinction_mag);
                    let off = (dimmed_by.value - extinction_mag) / sigma_mag;
                    let agrees = libm::exp(-0.5 * off * off) / sigma_mag;
                    (1.0 - UNTRUE) * agrees + UNTRUE
                }
                (None, true) => seen,
                (None, false) => 1.0 - seen,
            };
            libm::log(likelihood.max(f64::MIN_POSITIVE))
        })
    }
}

/// The probability beforehand that the sky is clear.
pub(super) fn prior_clear() -> f64 {
    posterior(&[0.0; STEPS]).0
}

/// The probability that the sky is clear, and the extinction, from the logarithms of the likelihoods of
/// extinctions.
fn posterior(ln_likelihoods: &[f64; STEPS]) -> (f64, Estimate) {
    let largest = ln_likelihoods
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    let extinction = |step: usize| step as f64 * STEP_MAG;
    let of_clear = |step: usize| libm::exp(-0.5 * (extinction(step) / CLEAR_SIGMA_MAG).powi(2));
    let of_cloud = |step: usize| libm::exp(-extinction(step) / MEAN_CLOUD_MAG);
    let sums = |prior: &dyn Fn(usize) -> f64| {
        let total: f64 = (0..STEPS).map(prior).sum();
        let mut sums = [0.0; 4];
        for (step, ln) in ln_likelihoods.iter().enumerate() {
            let weight = prior(step) / total * libm::exp(ln - largest);
            sums[0] += weight;
            sums[1] += weight * extinction(step);
            sums[2] += weight * extinction(step).powi(2);
            sums[3] += weight * f64::from(extinction(step) < CLEAR_MAG);
        }
        sums
    };
    let (clear, cloud) = (sums(&of_clear), sums(&of_cloud));
    let [total, first, second, clear] = [0, 1, 2, 3].map(|i| clear[i] + cloud[i]);
    let mean = first / total;
    let sigma = (second / total - mean * mean).max(0.0).sqrt();
    let extinction_mag = Estimate { value: mean, sigma };
    (clear / total, extinction_mag)
}
