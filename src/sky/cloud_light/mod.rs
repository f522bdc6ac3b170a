//! Clouds by their light: over towns and under the Moon they are brighter than a clear sky, elsewhere darker.
//!
//! ([`LitCell`] each, [`Hidden`] beforehand) → [`CloudLight`]
//!
//! 1. The light of a clear sky changes slowly over the frame ([`terms()`](terms::terms)); clouds add a share
//!    of it for the share of a star's light that they take.
//! 2. What the stars tell of the cells gives a first value of that share, and expectation and maximization
//!    the rest: how likely each cell's light is for each cloud, then the light of the clear sky and of clouds.
//! 3. How much light clouds add for what they take is told by the stars alone, with its error
//!    ([`per_share`]).
//! 4. Light counts only if it foretells which stars are seen: what else is bright does not.
//!
//! Then light tells of cells that have few stars.

mod fit;
mod lit_cell;
mod per_share;
mod terms;

use super::grid::CELLS_OF_A_STAR;
use fit::CloudLightFit;
pub(super) use lit_cell::{Hidden, LitCell, for_each_fraction};
pub(super) use terms::terms;

/// The light of cells that tells of clouds.
pub(super) struct CloudLight {
    /// Light of each cell beyond that of the clear sky, over it.
    excess: Vec<Option<f64>>,
    fit: CloudLightFit,
}

impl CloudLight {
    /// The light of `cells`, where a part `clouded` of the sky is not clear by its stars; `before` are the
    /// probabilities without any. `None` if light does not tell of clouds.
    pub(super) fn measure(mut cells: Vec<LitCell>, before: &Hidden, clouded: f64) -> Option<Self> {
        /// What chance may give of the gain of [`CloudLightFit::gains`].
        const MIN_GAIN: f64 = 6.0;
        let mut fit = CloudLightFit::of(&mut cells, clouded)?;
        let gains = cells
            .iter()
            .map(|lit| fit.gains(lit, before, clouded))
            .fold([0.0; 3], |sum, gains| {
                std::array::from_fn(|i| sum[i] + gains[i])
            });
        // Neighbours share stars.
        let is_significant = |gain: f64| gain > MIN_GAIN * CELLS_OF_A_STAR;
        if !gains.into_iter().all(is_significant) {
            return None;
        }
        fit.set_light_by_stars(&cells);
        let count = cells.iter().map(|lit| lit.cell + 1).max()?;
        let mut excess = vec![None; count];
        for lit in &cells {
            excess[lit.cell] = Some(fit.excess(lit));
        }
        Some(Self { excess, fit })
    }

    /// The likelihood of a cell's light if clouds take this share of a star's light.
    pub(super) fn likelihood(&self, cell: usize, share: f64) -> f64 {
        let excess = self.excess.get(cell).copied().flatten();
        excess.map_or(1.0, |excess| self.fit.likelihood(excess, share))
    }
}

#[cfg(test)]
mod tests {
    use super::lit_cell::{STEPS, fraction_of};
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const CELLS: usize = 300;

    /// Beforehand, clouds take any share.
    fn before() -> Hidden {
        let mut before = Hidden::NONE;
        before.add(0.0, 1.0, 0.0);
        for step in 1..=STEPS {
            before.add(fraction_of(step), 0.0, 1.0 / STEPS as f64);
        }
        before
    }

    /// Cells of a sky with a gradient, of which each third is behind clouds that take half of the light and
    /// add `of_cloud`; the stars of every second cell tell it, of which a part is `wrong`.
    fn cells(of_cloud: f64, wrong: f64) -> Vec<LitCell> {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        (0..CELLS)
            .map(|cell| {
                let is_cloudy = cell % 3 == 0;
                let along = (cell * 7 % CELLS) as f64 / CELLS as f64;
                let clear = 1.0 + 0.5 * along + 0.005 * random.random_range(-1.0..1.0);
                let added = if is_cloudy { 0.5 * of_cloud } else { 0.0 };
                let seen_cloudy = is_cloudy != random.random_bool(wrong);
                let by_stars = for_each_fraction(|share| {
                    let near = (share - 0.5).abs() < 0.2;
                    let is_unseen = cell % 2 == 1;
                    if is_unseen || near == seen_cloudy {
                        1.0
                    } else {
                        0.02
                    }
                });
                let mut hidden = before();
                for (step, likely) in by_stars.iter().enumerate() {
                    hidden.clear[step] *= likely;
                    hidden.cloud[step] *= likely;
                }
                LitCell {
                    cell,
                    by_stars,
                    hidden,
                    light: clear * (1.0 + added),
                    terms: vec![1.0, along],
                }
            })
            .collect()
    }

    #[test]
    fn light_tells_of_cells_without_stars() {
        for of_cloud in [0.8, -0.4] {
            let light = CloudLight::measure(cells(of_cloud, 0.05), &before(), 0.4).unwrap();
            for cell in 0..CELLS {
                let odds = light.likelihood(cell, 0.5) / light.likelihood(cell, 0.0);
                assert_eq!(odds > 1.0, cell % 3 == 0, "{of_cloud} {cell} {odds}");
            }
        }
    }

    #[test]
    fn light_that_does_not_go_with_stars_tells_nothing() {
        assert!(CloudLight::measure(cells(0.0, 0.05), &before(), 0.4).is_none());
        assert!(CloudLight::measure(cells(0.8, 0.5), &before(), 0.4).is_none());
        assert!(CloudLight::measure(Vec::new(), &before(), 0.5).is_none());
    }
}
