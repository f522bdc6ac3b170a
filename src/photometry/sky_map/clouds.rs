//! Clouds: stars that are dimmed, and stars that are missing.
//!
//! For the extinction A beyond that of clear air, a star that was measured has the likelihood of its
//! magnitude, and one that is missing that of not being detected A magnitudes fainter. A part of the sky has
//! the extinction of clear air alone, and the other part more, over all of a cell or over half of it: which
//! parts is told by all cells together. Where clouds are brighter or darker than a clear sky, so does their
//! light (`cloud_light`).

use super::brightness::Levels;
use super::clear_sky::MEAN_CLOUD_MAG;
use super::cloud_light::{CloudLight, Hidden, LitCell, terms};
use super::grid::CELLS_OF_A_STAR;
use super::relative_limit::RelativeLimit;
use super::witnesses::{Sky, Witness};
use crate::base::statistics::Estimate;

/// Step of the extinctions that are compared, in magnitudes, and their number.
const STEP_MAG: f64 = 0.05;
const STEPS: usize = 121;
/// The same of clouds that cover half of a cell.
const HALF_STEP_MAG: f64 = 0.1;
const HALF_STEPS: usize = 60;
/// Cells that clouds cover by half, for each that they cover.
const HALVES: f64 = 0.3;
/// What is compared: clouds over all of a cell, then over half of it.
const CASES: usize = STEPS + HALF_STEPS;
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
/// No cell is more certain of clouds, or of a clear sky, than by this factor.
const MOST_ODDS: f64 = 1000.0;
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
        let logs: Vec<[f64; CASES]> = witnesses
            .iter()
            .map(|witness| self.ln_likelihoods(witness, limit.as_ref()))
            .collect();
        let mut cells = vec![CellClouds::default(); self.grid.places.len()];
        let mut told = Vec::new();
        let priors = Priors::new();
        for (cell, (clouds, level)) in cells.iter_mut().zip(&levels.cells).enumerate() {
            let solid_angle_sr = level.solid_angle_sr;
            let stars = witnesses.iter().zip(&logs);
            let logs = self.ln_likelihoods_around(cell, stars, limit.as_ref(), clouds);
            let logs = logs.filter(|_| solid_angle_sr > 0.0);
            told.extend(logs.map(|logs| Told {
                cell,
                solid_angle_sr,
                evidence: Evidence::of(&logs, &priors),
                ln_likelihoods: logs,
            }));
        }
        let mut cover = Cover::of(&told);
        let lit = told
            .iter()
            .filter_map(|told| self.lit(told, levels, &priors));
        let before = priors.hidden(&[0.0; CASES]);
        if let Some(light) = CloudLight::of(lit.collect(), &before, cover.clouded) {
            for told in &mut told {
                told.add(&light, &priors);
            }
            cover = Cover::of(&told);
        }
        for Told { cell, evidence, .. } in &told {
            let (clear, extinction_mag) = evidence.posterior(cover.clouded);
            cells[*cell].clear = Some(clear);
            cells[*cell].extinction_mag = Some(extinction_mag);
        }
        Clouds {
            share: cover.share(&told),
            cells,
        }
    }

    /// The logarithms of the likelihoods of the stars around a cell, if they tell of it; the stars in it are counted
    /// in `clouds`.
    fn ln_likelihoods_around<'w>(
        &self,
        cell: usize,
        stars: impl Iterator<Item = (&'w Witness<'w>, &'w [f64; CASES])>,
        limit: Option<&RelativeLimit>,
        clouds: &mut CellClouds,
    ) -> Option<[f64; CASES]> {
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
    fn lit(&self, told: &Told, levels: &Levels, priors: &Priors) -> Option<LitCell> {
        let place = self.grid.pixel_of(told.cell)?;
        let direction = self.grid.direction_of(&place)?;
        let (camera, zenith) = (self.grid.camera(), self.frame.places.zenith());
        Some(LitCell {
            cell: told.cell,
            hidden: priors.hidden(&told.ln_likelihoods),
            light: levels.radiance_adu_sr(told.cell)?,
            terms: terms(camera, &place, &direction, zenith, self.moon.as_ref()),
        })
    }

    /// The logarithm of the likelihood of a star in each case.
    fn ln_likelihoods(&self, witness: &Witness, limit: Option<&RelativeLimit>) -> [f64; CASES] {
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

/// Extinction by clouds that cover half of a cell.
fn half_mag(step: usize) -> f64 {
    (step + 1) as f64 * HALF_STEP_MAG
}

/// Mean extinction of a cell in a case.
fn mean_mag(case: usize) -> f64 {
    match case.checked_sub(STEPS) {
        None => case as f64 * STEP_MAG,
        Some(step) => 0.5 * half_mag(step),
    }
}

/// The largest of the logarithms.
fn largest_of(ln_likelihoods: &[f64; CASES]) -> f64 {
    ln_likelihoods
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max)
}

/// Mean share of a star's light that clouds take in a case.
fn hidden_share(case: usize) -> f64 {
    let of = |mag: f64| 1.0 - libm::pow(10.0, -0.4 * mag);
    match case.checked_sub(STEPS) {
        None => of(case as f64 * STEP_MAG),
        Some(step) => 0.5 * of(half_mag(step)),
    }
}

/// Probabilities of the cases beforehand, in the clear part of the sky and in the other.
struct Priors {
    clear: [f64; CASES],
    cloud: [f64; CASES],
    /// Mean share of a star's light that clouds take in each case.
    hidden_shares: [f64; CASES],
}

impl Priors {
    fn new() -> Self {
        let of_clear = |case: usize| match case {
            0..STEPS => libm::exp(-0.5 * (mean_mag(case) / CLEAR_SIGMA_MAG).powi(2)),
            _ => 0.0,
        };
        // Most clouds are larger than a cell.
        let of_cloud = |case: usize| match case.checked_sub(STEPS) {
            None => STEP_MAG * libm::exp(-mean_mag(case) / MEAN_CLOUD_MAG),
            Some(step) => HALVES * HALF_STEP_MAG * libm::exp(-half_mag(step) / MEAN_CLOUD_MAG),
        };
        let normalized = |prior: &dyn Fn(usize) -> f64| {
            let total: f64 = (0..CASES).map(prior).sum();
            std::array::from_fn(|case| prior(case) / total)
        };
        Self {
            clear: normalized(&of_clear),
            cloud: normalized(&of_cloud),
            hidden_shares: std::array::from_fn(hidden_share),
        }
    }

    /// The share of a star's light that clouds take, by the logarithms of the likelihoods of the cases.
    fn hidden(&self, ln_likelihoods: &[f64; CASES]) -> Hidden {
        let largest = largest_of(ln_likelihoods);
        let mut hidden = Hidden::NONE;
        for (case, ln) in ln_likelihoods.iter().enumerate() {
            let likelihood = libm::exp(ln - largest);
            let [clear, cloud] = [&self.clear, &self.cloud].map(|prior| prior[case] * likelihood);
            hidden.add(self.hidden_shares[case], clear, cloud);
        }
        hidden
    }
}

/// What the stars around a cell tell of it: sums over the cases, if it is part of the clear sky, and if it is
/// not.
#[derive(Debug, Clone, Copy)]
struct Evidence {
    clear: Sums,
    cloud: Sums,
}

/// Sums of likelihoods over the cases.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    all: f64,
    first: f64,
    second: f64,
    below_clear: f64,
}

impl Evidence {
    /// From the logarithms of the likelihoods of the cases.
    fn of(ln_likelihoods: &[f64; CASES], priors: &Priors) -> Self {
        let largest = largest_of(ln_likelihoods);
        let sums = |prior: &[f64; CASES]| {
            let mut sums = Sums::default();
            for (case, (ln, prior)) in ln_likelihoods.iter().zip(prior).enumerate() {
                let weight = prior * libm::exp(ln - largest);
                sums.all += weight;
                sums.first += weight * mean_mag(case);
                sums.second += weight * mean_mag(case).powi(2);
                sums.below_clear += weight * f64::from(mean_mag(case) < CLEAR_MAG);
            }
            sums
        };
        let mut evidence = Self {
            clear: sums(&priors.clear),
            cloud: sums(&priors.cloud),
        };
        evidence.clear = evidence.clear.at_least(evidence.cloud.all / MOST_ODDS);
        evidence.cloud = evidence.cloud.at_least(evidence.clear.all / MOST_ODDS);
        evidence
    }

    /// The probability that the sky is clear, and the extinction, where a share `clouded` of the sky is not part
    /// of the clear one.
    fn posterior(&self, clouded: f64) -> (f64, Estimate) {
        let mean =
            |of: fn(&Sums) -> f64| (1.0 - clouded) * of(&self.clear) + clouded * of(&self.cloud);
        let all = mean(|sums| sums.all);
        let first = mean(|sums| sums.first) / all;
        let second = mean(|sums| sums.second) / all;
        let extinction_mag = Estimate {
            value: first,
            sigma: (second - first * first).max(0.0).sqrt(),
        };
        (mean(|sums| sums.below_clear) / all, extinction_mag)
    }
}

impl Sums {
    /// The same with a sum that is not below `least`.
    fn at_least(self, least: f64) -> Self {
        if self.all >= least {
            return self;
        }
        let factor = least / self.all.max(f64::MIN_POSITIVE);
        Self {
            all: least,
            first: self.first * factor,
            second: self.second * factor,
            below_clear: self.below_clear * factor,
        }
    }
}

/// A cell of which stars tell.
struct Told {
    cell: usize,
    solid_angle_sr: f64,
    ln_likelihoods: [f64; CASES],
    evidence: Evidence,
}

impl Told {
    /// Adds what its light tells.
    fn add(&mut self, light: &CloudLight, priors: &Priors) {
        for (case, ln_likelihood) in self.ln_likelihoods.iter_mut().enumerate() {
            *ln_likelihood += libm::log(light.likelihood(self.cell, priors.hidden_shares[case]));
        }
        self.evidence = Evidence::of(&self.ln_likelihoods, priors);
    }
}

/// How much of the sky is not part of the clear one: the share for which what the cells show is most probable.
struct Cover {
    clouded: f64,
    sigma: f64,
}

impl Cover {
    fn of(told: &[Told]) -> Self {
        const STEPS: usize = 200;
        /// Cells that are clear, and that are not, which the sky has beforehand.
        const BEFOREHAND: f64 = 0.5;
        let all_sr: f64 = told.iter().map(|told| told.solid_angle_sr).sum();
        // The same stars tell of several cells.
        let cells = told.len() as f64 / CELLS_OF_A_STAR;
        let mean = |of: &dyn Fn(&Evidence) -> f64| {
            let parts = told
                .iter()
                .map(|told| told.solid_angle_sr / all_sr * of(&told.evidence));
            parts.sum::<f64>()
        };
        let mut clouded = 0.5;
        for _ in 0..STEPS {
            let share = mean(&|of| {
                clouded * of.cloud.all / (clouded * of.cloud.all + (1.0 - clouded) * of.clear.all)
            });
            let share = if told.is_empty() { 0.5 } else { share };
            clouded = (BEFOREHAND + cells * share) / (2.0 * BEFOREHAND + cells);
        }
        let information = mean(&|of| {
            let slope = of.cloud.all - of.clear.all;
            (slope / (clouded * of.cloud.all + (1.0 - clouded) * of.clear.all)).powi(2)
        });
        Self {
            clouded,
            sigma: (cells * information).sqrt().recip().min(0.5),
        }
    }

    /// Share of the sky of which stars tell that is behind clouds.
    fn share(&self, told: &[Told]) -> Option<Estimate> {
        let all_sr: f64 = told.iter().map(|told| told.solid_angle_sr).sum();
        let clouded_sr = told.iter().map(|told| {
            let (clear, _) = told.evidence.posterior(self.clouded);
            told.solid_angle_sr * (1.0 - clear)
        });
        let clouded_sr: f64 = clouded_sr.sum();
        (all_sr > 0.0).then(|| Estimate {
            value: clouded_sr / all_sr,
            sigma: self.sigma,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cell in which extinctions about one are as likely as `odds` to those about zero.
    fn told(cell: usize, odds: f64) -> Told {
        let logs = std::array::from_fn(|case| {
            let extinction_mag = mean_mag(case);
            let about = |mag: f64| libm::exp(-0.5 * ((extinction_mag - mag) / 0.1).powi(2));
            libm::log(about(0.0) + odds * about(1.0) + 1e-9)
        });
        Told {
            cell,
            solid_angle_sr: 0.01,
            evidence: Evidence::of(&logs, &Priors::new()),
            ln_likelihoods: logs,
        }
    }

    #[test]
    fn all_cells_together_tell_how_much_is_clear() {
        let cells = |clear: usize, cloudy: usize| -> Vec<Told> {
            let odds = |cell: usize| if cell < clear { 1e-3 } else { 1e4 };
            (0..clear + cloudy)
                .map(|cell| told(cell, odds(cell)))
                .collect()
        };
        let mostly_clear = cells(90, 10);
        let cover = Cover::of(&mostly_clear);
        let share = cover.share(&mostly_clear).unwrap();
        assert!((share.value - 0.1).abs() < 0.03, "{share:?}");
        assert!((0.02..0.1).contains(&share.sigma), "{share:?}");
        // The same cell is more likely clear where most of the sky is.
        let doubtful = told(0, 10.0).evidence;
        let (clear, _) = doubtful.posterior(cover.clouded);
        let (less, _) = doubtful.posterior(Cover::of(&cells(10, 90)).clouded);
        assert!(clear > less + 0.3, "{clear} {less}");
        assert_eq!(Cover::of(&[]).share(&[]), None);
    }
}
