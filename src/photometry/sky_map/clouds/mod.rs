//! Clouds: stars that are dimmed, and stars that are missing.
//!
//! For the extinction A beyond that of clear air, a star that was measured has the likelihood of its
//! magnitude, and one that is missing that of not being detected A magnitudes fainter. A part of the sky has
//! the extinction of clear air alone, and the other part more, over all of a cell or over half of it: which
//! parts is told by all cells together. Where clouds are brighter or darker than a clear sky, so does their
//! light (`cloud_light`).

mod belief;
mod cases;

use super::brightness::Levels;
use super::cloud_light::{CloudLight, Hidden, LitCell, terms};
use super::relative_limit::RelativeLimit;
use super::witnesses::{Sky, Witness};
use crate::base::statistics::Estimate;
use belief::{Belief, Told};
pub use cases::CLEAR_MAG;
use cases::{CASES, Cases, STEP_MAG, STEPS, half_mag, hidden_shares};

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

/// Clouds in all cells.
pub(super) struct Clouds {
    /// Each cell.
    pub cells: Vec<CellClouds>,
    /// Share of the sky that is behind clouds.
    pub share: Option<Estimate>,
}

impl Sky<'_> {
    /// Clouds in each cell.
    pub(super) fn clouds(&self, witnesses: &[Witness], levels: &Levels) -> Clouds {
        let limit = if self.is_usual {
            Some(RelativeLimit::usual())
        } else {
            RelativeLimit::of_clear_sky(witnesses, self.clear_sky, self.chance)
        };
        let logs: Vec<Cases> = witnesses
            .iter()
            .map(|witness| self.ln_likelihoods(witness, limit.as_ref()))
            .collect();
        let mut cells = vec![CellClouds::default(); self.grid.places.len()];
        let mut told = Vec::new();
        for (cell, (clouds, level)) in cells.iter_mut().zip(&levels.cells).enumerate() {
            let solid_angle_sr = level.solid_angle_sr;
            let stars = witnesses.iter().zip(&logs);
            let logs = self.ln_likelihoods_around(cell, stars, limit.as_ref(), clouds);
            let logs = logs.filter(|_| solid_angle_sr > 0.0);
            told.extend(logs.map(|logs| Told::new(cell, solid_angle_sr, &logs)));
        }
        let mut belief = Belief::of(&told);
        let shares = hidden_shares();
        let lit = told
            .iter()
            .filter_map(|told| self.lit(told, levels, belief.hidden(told, &shares)));
        let before = belief.hidden_before(&shares);
        if let Some(light) = CloudLight::of(lit.collect(), &before, belief.clouded) {
            for told in &mut told {
                let cell = told.cell;
                told.add(&shares, |share| light.likelihood(cell, share));
            }
            belief = Belief::of(&told);
        }
        for (told, (clear, extinction_mag)) in told.iter().zip(belief.cells()) {
            cells[told.cell].clear = Some(clear);
            cells[told.cell].extinction_mag = Some(extinction_mag);
        }
        Clouds {
            share: belief.share(&told),
            cells,
        }
    }

    /// The logarithms of the likelihoods of the stars around a cell, if they tell of it; the stars in it are counted
    /// in `clouds`.
    fn ln_likelihoods_around<'w>(
        &self,
        cell: usize,
        stars: impl Iterator<Item = (&'w Witness<'w>, &'w Cases)>,
        limit: Option<&RelativeLimit>,
        clouds: &mut CellClouds,
    ) -> Option<Cases> {
        let mut total = [0.0; CASES];
        let mut told = 0.0;
        for (witness, logs) in stars {
            let Some(weight) = self.grid.weight(cell, &witness.star.direction) else {
                continue;
            };
            for (total, log) in total.iter_mut().zip(logs) {
                *total += weight * log;
            }
            let is_expected =
                limit.is_some_and(|limit| limit.probability(witness.relative_mag) > EXPECTED);
            if is_expected || witness.star.measured.is_some() {
                told += weight;
            }
            if witness.cell == cell && is_expected {
                clouds.expected += 1;
                clouds.detected += usize::from(witness.star.is_detected);
            }
        }
        (told > LEAST_WEIGHT && self.depths[cell].is_some()).then_some(total)
    }

    /// A cell with its light.
    fn lit(&self, told: &Told, levels: &Levels, hidden: Hidden) -> Option<LitCell> {
        let place = self.grid.pixel_of(told.cell)?;
        let direction = self.grid.direction_of(&place)?;
        let (camera, zenith) = (self.grid.camera(), self.frame.places.zenith());
        Some(LitCell {
            cell: told.cell,
            hidden,
            light: levels.radiance_adu_sr(told.cell)?,
            terms: terms(camera, &place, &direction, zenith, self.moon.as_ref()),
        })
    }

    /// The logarithm of the likelihood of a star in each case.
    fn ln_likelihoods(&self, witness: &Witness, limit: Option<&RelativeLimit>) -> Cases {
        let full = self.likelihoods(witness, limit);
        std::array::from_fn(|case| {
            let likelihood = match case.checked_sub(STEPS) {
                None => full[case],
                // The star is as likely behind the clouds as beside them.
                Some(step) => {
                    let behind = half_mag(step) / STEP_MAG;
                    0.5 * (full[0] + full[behind.round() as usize])
                }
            };
            libm::log(likelihood.max(f64::MIN_POSITIVE))
        })
    }

    /// The likelihood of a star for each extinction.
    fn likelihoods(&self, witness: &Witness, limit: Option<&RelativeLimit>) -> [f64; STEPS] {
        let star = witness.star;
        let dimmed_by = self.clear_sky.dimmed_by(star);
        std::array::from_fn(|step| {
            let extinction_mag = step as f64 * STEP_MAG;
            let seen = limit.map_or(1.0, |limit| {
                limit.probability(witness.relative_mag + extinction_mag)
            });
            let seen = UNTRUE + (1.0 - 2.0 * UNTRUE) * seen;
            match (dimmed_by, star.is_detected) {
                (Some(dimmed_by), _) => {
                    let sigma_mag = libm::hypot(dimmed_by.sigma, CLOUD_VARIATION * extinction_mag);
                    let off = (dimmed_by.value - extinction_mag) / sigma_mag;
                    let agrees = libm::exp(-0.5 * off * off) / sigma_mag;
                    (1.0 - UNTRUE) * agrees + UNTRUE
                }
                (None, true) => seen,
                (None, false) => 1.0 - seen,
            }
        })
    }
}
