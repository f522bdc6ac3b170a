//! The probability of each predicted star that it is observed, by its brightness and its place.
//!
//! Fainter stars are not detected more often than brighter ones. So the share by brightness is a
//! falling step function, the one that fits best (isotonic regression by pooling of adjacent
//! violators: Ayer et al. 1955, Ann. Math. Stat. 26, 641). It needs no shape and no parameter.
//!
//! Behind foliage, clouds and roofs no stars are seen, however bright. So the share at a place is
//! that of the stars around it, over what their brightness alone would give: first in large
//! cells, then in smaller ones, where those around have enough stars to say more.

use crate::identify::field::StarField;
use crate::identify::grid::Grid;
use crate::identify::predict::PredictedStar;

/// A star's probability is never closer to 1 than this: bright stars are lost, too.
const LEAST_LOST: f64 = 0.1;
/// Pseudo-stars of each step, of which one half is observed.
const PRIOR_STARS: f64 = 1.0;
/// Cells along the frame's longer side, scale by scale.
const CELLS: [usize; 2] = [12, 36];
/// Stars are few if a grid has more than this many cells for each.
const FEW: usize = 6;
/// Expected stars around a place that count as much as what the larger scale says.
const PRIOR_AROUND: f64 = 1.0;

/// The probability of each predicted star that it is observed. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Completeness {
    /// By brightness alone, brightest first.
    shares: Vec<f64>,
    /// How much more likely stars are observed at the place of each one than on average.
    visibility: Vec<f64>,
    /// The odds of each predicted star that it is detected.
    odds: Vec<f64>,
    /// Steps: number of stars, and how many of them are observed.
    steps: Vec<(usize, f64)>,
    /// Stars that are observed, and that are expected to be, in the cells of one scale.
    observed: Vec<f64>,
    expected: Vec<f64>,
    scratch: Vec<f64>,
}

impl Completeness {
    /// Nothing is known of `stars` predicted stars.
    pub fn start(&mut self, stars: usize) {
        self.odds.clear();
        self.odds.resize(stars, 1.0);
        self.shares.clear();
        self.visibility.clear();
        self.visibility.resize(stars, 1.0);
    }

    /// The odds that a predicted star is detected.
    pub fn odds(&self, predicted: usize) -> f64 {
        self.odds[predicted]
    }

    /// The odds that a predicted star is detected where it appears as bright as another one: noise
    /// brings stars above the limit that are fainter.
    pub fn odds_as(&self, predicted: usize, as_bright_as: usize) -> f64 {
        let (Some(own), Some(share)) = (self.shares.get(predicted), self.shares.get(as_bright_as))
        else {
            return self.odds[predicted];
        };
        if share <= own {
            return self.odds[predicted];
        }
        let visibility = self.visibility[predicted];
        let [own, share] = [own, share].map(|share| (share * visibility).min(1.0 - LEAST_LOST));
        share / (1.0 - own)
    }

    /// Measures how visible stars are at the place of each one of `predicted`, by the probability of
    /// each that it is observed. The share by brightness must have been measured.
    pub fn measure_visibility(
        &mut self,
        field: &StarField,
        predicted: &[PredictedStar],
        is_observed: &[f64],
    ) {
        self.visibility.clear();
        self.visibility.resize(predicted.len(), 1.0);
        for cells in CELLS {
            self.add_scale(&Grid::new(field, cells), predicted, is_observed);
        }
    }

    /// Sets the odds from share and visibility.
    pub fn set_odds(&mut self) {
        let share = self.shares.iter().zip(&self.visibility);
        self.odds.clear();
        self.odds.extend(share.map(|(share, visibility)| {
            let share = (share * visibility).min(1.0 - LEAST_LOST);
            share / (1.0 - share)
        }));
    }

    /// Measures the share by brightness, by the probability of each star that it is observed.
    pub fn measure_shares(&mut self, is_observed: &[f64]) {
        self.steps.clear();
        for &observed in is_observed {
            let mut step = (1, observed.min(1.0));
            while let Some(&(stars, observed)) = self.steps.last() {
                if observed * step.0 as f64 > step.1 * stars as f64 {
                    break;
                }
                step = (step.0 + stars, step.1 + observed);
                self.steps.pop();
            }
            self.steps.push(step);
        }
        self.shares.clear();
        for &(stars, observed) in &self.steps {
            let share = (observed + 0.5 * PRIOR_STARS) / (stars as f64 + PRIOR_STARS);
            self.shares.extend(std::iter::repeat_n(share, stars));
        }
    }

    /// The visibility on a finer scale, where what is known so far is that of the larger one.
    fn add_scale(&mut self, grid: &Grid, predicted: &[PredictedStar], is_observed: &[f64]) {
        for cells in [&mut self.observed, &mut self.expected] {
            cells.clear();
            cells.resize(grid.cells(), 0.0);
        }
        let stars = || predicted.iter().zip(is_observed.iter().zip(&self.shares));
        for (star, (observed, share)) in stars() {
            let cell = grid.cell_of(star.pixel.x, star.pixel.y);
            self.observed[cell] += observed.min(1.0);
            self.expected[cell] += share;
        }
        // Few stars look around themselves; for many, the sums of all cells are made at once.
        let are_few = predicted.len() * FEW < grid.cells();
        if !are_few {
            for cells in [&mut self.observed, &mut self.expected] {
                grid.sum_with_neighbours(cells, &mut self.scratch);
            }
        }
        for ((star, (observed, share)), visibility) in stars().zip(&mut self.visibility) {
            let [all_observed, all_expected] = [&self.observed, &self.expected].map(|cells| {
                let (x, y) = (star.pixel.x, star.pixel.y);
                if are_few {
                    grid.around(x, y, cells).0
                } else {
                    cells[grid.cell_of(x, y)]
                }
            });
            // Without the star itself: it must not vouch for its own name.
            let observed = (all_observed - observed.min(1.0)).max(0.0);
            let expected = (all_expected - share).max(0.0);
            *visibility = (observed + PRIOR_AROUND * *visibility) / (expected + PRIOR_AROUND);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, UnitVector};
    use crate::identify::Photometry;
    use crate::sky::catalog::StarIndex;

    fn field() -> StarField {
        StarField {
            width_px: 1200.0,
            height_px: 1200.0,
            photometry: Photometry::Instrumental,
            years_since_j2000: 0.0,
            spot_sigma_px: None,
            stars: Vec::new(),
        }
    }

    /// Stars spread evenly over the frame.
    fn predicted(count: usize) -> Vec<PredictedStar> {
        let star = |index: usize| {
            let golden = 0.618_033_988_749_895 * index as f64;
            PredictedStar {
                pixel: PixelPoint::new(
                    1200.0 * golden.fract(),
                    1200.0 * (index as f64 + 0.5) / count as f64,
                ),
                direction: UnitVector::from_ra_dec(0.0, 0.0),
                v_mag: 5.0,
                star: StarIndex::new(index),
            }
        };
        (0..count).map(star).collect()
    }

    #[test]
    fn the_share_falls_and_pools_what_rises() {
        let mut found = Completeness::default();
        let observed: Vec<f64> = [[1.0; 40], [0.0; 40]].concat();
        found.measure_shares(&observed);
        assert!(found.shares[0] > 0.95);
        assert!(found.shares[79] < 0.02);
        // One of two, in whatever order it rises: 1/2 of each.
        let rising: Vec<f64> = (0..80).map(|i| f64::from(i % 2)).collect();
        found.measure_shares(&rising);
        assert!(found.shares.windows(2).all(|pair| pair[0] >= pair[1]));
        assert!(
            (found.shares[40] - 0.5).abs() < 0.03,
            "{}",
            found.shares[40]
        );
    }

    #[test]
    fn stars_behind_a_wall_are_not_expected() {
        let stars = predicted(2000);
        let is_behind = |star: &PredictedStar| star.pixel.x > 600.0;
        let observed: Vec<f64> = stars
            .iter()
            .map(|s| f64::from(u8::from(!is_behind(s))))
            .collect();
        let mut found = Completeness::default();
        found.measure_shares(&observed);
        found.measure_visibility(&field(), &stars, &observed);
        found.set_odds();
        for (index, star) in stars.iter().enumerate() {
            let odds = found.odds(index);
            if star.pixel.x > 900.0 {
                assert!(odds < 0.05, "{odds}");
            } else if star.pixel.x < 300.0 {
                assert!(odds > 2.0, "{odds}");
            }
        }
    }
}
