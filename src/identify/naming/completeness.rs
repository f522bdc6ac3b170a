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
use crate::identify::grid::FrameGrid;
use crate::identify::predict::PredictedStar;

/// A star's probability is never closer to 1 than this: bright stars are lost, too.
const MIN_LOST: f64 = 0.1;
/// Pseudo-stars of each step, of which one half is observed.
const PRIOR_STARS: f64 = 1.0;
/// Cells along the frame's longer side, scale by scale.
const CELLS: [usize; 2] = [12, 36];
/// Expected stars around a place that count as much as what the larger scale says.
const PRIOR_AROUND: f64 = 1.0;

/// The probability of each predicted star that it is observed. Its buffers are reused.
#[derive(Debug, Default)]
pub struct DetectionProbabilities {
    /// By brightness alone, brightest first; at the end 0, for stars fainter than all.
    fractions: Vec<f64>,
    /// How much more likely stars are observed at the place of each one than on average; as many.
    visibility: Vec<f64>,
    steps: Vec<CompletenessStep>,
    scales: [ScaleCounts; CELLS.len()],
    scratch: Vec<f64>,
}

/// Stars that are observed with the same probability.
#[derive(Debug, Clone, Copy)]
struct CompletenessStep {
    /// Number of stars, and how many of them are observed.
    stars: f64,
    observed: f64,
}

/// What is counted on one scale.
#[derive(Debug, Default)]
struct ScaleCounts {
    /// The cell of each predicted star.
    places: Vec<u32>,
    /// Stars that are observed, and that are expected to be, in the cells.
    observed: Vec<f64>,
    expected: Vec<f64>,
}

/// The odds that a star is detected, where its share by brightness is `own`, and those that it is
/// detected where it appears as bright as stars of the share `apparent`: noise brings stars above
/// the limit that are fainter.
#[inline(always)]
pub fn odds_of(own: f64, apparent: f64, visibility: f64) -> [f64; 2] {
    let apparent = if apparent > own { apparent } else { own };
    let [own, apparent] = [own, apparent].map(|share| (share * visibility).min(1.0 - MIN_LOST));
    [own / (1.0 - own), apparent / (1.0 - own)]
}

impl DetectionProbabilities {
    /// Nothing is known of `stars` predicted stars.
    pub fn start(&mut self, stars: usize) {
        self.fractions.clear();
        self.fractions.resize(stars, 0.5);
        self.fractions.push(0.0);
        self.visibility.clear();
        self.visibility.resize(stars + 1, 1.0);
    }

    /// The share by brightness, and the visibility, of each predicted star, and of one fainter than all.
    pub fn fractions_and_visibility(&self) -> (&[f64], &[f64]) {
        (&self.fractions, &self.visibility)
    }

    /// Finds the places of `predicted`, for the visibility.
    pub fn place(&mut self, field: &StarField, predicted: &[PredictedStar]) {
        for (scale, cells) in self.scales.iter_mut().zip(CELLS) {
            let grid = FrameGrid::new(field, cells);
            scale.places.clear();
            let places = predicted
                .iter()
                .map(|star| grid.cell_of(star.pixel.x, star.pixel.y) as u32);
            scale.places.extend(places);
        }
    }

    /// Measures how visible stars are at the place of each one, by the probability of each that it is
    /// observed. The places, and the share by brightness, must be known.
    pub fn measure_visibility(&mut self, field: &StarField, is_observed: &[f64]) {
        self.visibility.clear();
        self.visibility.resize(is_observed.len() + 1, 1.0);
        for (scale, cells) in self.scales.iter_mut().zip(CELLS) {
            let grid = FrameGrid::new(field, cells);
            scale.count(&grid, is_observed, &self.fractions, &mut self.scratch);
            scale.refine(&mut self.visibility, is_observed, &self.fractions);
        }
    }

    /// Measures the share by brightness, by the probability of each star that it is observed.
    pub fn measure_fractions(&mut self, is_observed: &[f64]) {
        self.steps.clear();
        for &observed in is_observed {
            match self.steps.last_mut() {
                // Most stars are too faint.
                Some(last) if observed == 0.0 && last.observed == 0.0 => last.stars += 1.0,
                _ => self.add_step(observed.min(1.0)),
            }
        }
        self.fractions.clear();
        for &CompletenessStep { stars, observed } in &self.steps {
            let share = (observed + 0.5 * PRIOR_STARS) / (stars + PRIOR_STARS);
            let end = self.fractions.len() + stars as usize;
            self.fractions.resize(end, share);
        }
        self.fractions.push(0.0);
    }

    /// Adds a star, and pools the steps that rise.
    fn add_step(&mut self, observed: f64) {
        let mut step = CompletenessStep {
            stars: 1.0,
            observed,
        };
        while let Some(last) = self.steps.last() {
            if last.observed * step.stars > step.observed * last.stars {
                break;
            }
            step = CompletenessStep {
                stars: step.stars + last.stars,
                observed: step.observed + last.observed,
            };
            self.steps.pop();
        }
        self.steps.push(step);
    }
}

impl ScaleCounts {
    /// Counts the stars in each cell and its neighbors.
    fn count(
        &mut self,
        grid: &FrameGrid,
        is_observed: &[f64],
        shares: &[f64],
        scratch: &mut Vec<f64>,
    ) {
        for cells in [&mut self.observed, &mut self.expected] {
            cells.clear();
            cells.resize(grid.cells(), 0.0);
        }
        for ((&cell, observed), share) in self.places.iter().zip(is_observed).zip(shares) {
            self.observed[cell as usize] += observed.min(1.0);
            self.expected[cell as usize] += share;
        }
        for cells in [&mut self.observed, &mut self.expected] {
            grid.sum_with_neighbors(cells, scratch);
        }
    }

    /// The visibility on this scale, where what is known so far is that of the larger one.
    fn refine(&self, visibility: &mut [f64], is_observed: &[f64], shares: &[f64]) {
        let stars = self.places.iter().zip(is_observed).zip(shares);
        for (((&cell, observed), share), visibility) in stars.zip(visibility) {
            // Without the star itself: it must not vouch for its own name.
            let observed = (self.observed[cell as usize] - observed.min(1.0)).max(0.0);
            let expected = (self.expected[cell as usize] - share).max(0.0);
            *visibility = (observed + PRIOR_AROUND * *visibility) / (expected + PRIOR_AROUND);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, UnitVector};

    use crate::catalog::StarIndex;

    fn field() -> StarField {
        StarField::of_places([1200.0, 1200.0], &[])
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
        let mut found = DetectionProbabilities::default();
        let observed: Vec<f64> = [[1.0; 40], [0.0; 40]].concat();
        found.measure_fractions(&observed);
        assert!(found.fractions[0] > 0.95);
        assert!(found.fractions[79] < 0.02);
        // One of two, in whatever order it rises: 1/2 of each.
        let rising: Vec<f64> = (0..80).map(|i| f64::from(i % 2)).collect();
        found.measure_fractions(&rising);
        assert!(found.fractions.windows(2).all(|pair| pair[0] >= pair[1]));
        assert!(
            (found.fractions[40] - 0.5).abs() < 0.03,
            "{}",
            found.fractions[40]
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
        let mut found = DetectionProbabilities::default();
        found.measure_fractions(&observed);
        found.place(&field(), &stars);
        found.measure_visibility(&field(), &observed);
        let (shares, visibility) = found.fractions_and_visibility();
        for (index, star) in stars.iter().enumerate() {
            let [odds, _] = odds_of(shares[index], 0.0, visibility[index]);
            if star.pixel.x > 900.0 {
                assert!(odds < 0.05, "{odds}");
            } else if star.pixel.x < 300.0 {
                assert!(odds > 2.0, "{odds}");
            }
        }
    }
}
