//! The share of the predicted stars that are observed, by brightness.
//!
//! Fainter stars are not detected more often than brighter ones. So the share is a falling step
//! function, the one that fits best (isotonic regression by pooling of adjacent violators: Ayer et
//! al. 1955, Ann. Math. Stat. 26, 641). It needs no shape and no parameter.

/// A star's share is never closer to 1 than this: bright stars are lost, too.
const LEAST_LOST: f64 = 0.1;
/// Pseudo-stars of each step, of which one half is observed.
const PRIOR_STARS: f64 = 1.0;

/// The share of the predicted stars that are observed. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Completeness {
    /// The odds of each predicted star that it is detected, brightest first.
    odds: Vec<f64>,
    /// Steps: number of stars, and how many of them are observed.
    steps: Vec<(usize, f64)>,
}

impl Completeness {
    /// Nothing is known of `stars` predicted stars.
    pub fn start(&mut self, stars: usize) {
        self.odds.clear();
        self.odds.resize(stars, 1.0);
    }

    /// The odds that a predicted star is detected.
    pub fn odds(&self, predicted: usize) -> f64 {
        self.odds[predicted]
    }

    /// Measures it by the probability of each predicted star, brightest first, that it is observed.
    pub fn measure(&mut self, is_observed: &[f64]) {
        self.steps.clear();
        for &observed in is_observed {
            let mut step = (1, observed.min(1.0));
            while let Some(&(stars, observed)) = self.steps.last() {
                if observed / stars as f64 > step.1 / step.0 as f64 {
                    break;
                }
                step = (step.0 + stars, step.1 + observed);
                self.steps.pop();
            }
            self.steps.push(step);
        }
        self.odds.clear();
        for &(stars, observed) in &self.steps {
            let share = (observed + 0.5 * PRIOR_STARS) / (stars as f64 + PRIOR_STARS);
            let share = share.min(1.0 - LEAST_LOST);
            self.odds
                .extend(std::iter::repeat_n(share / (1.0 - share), stars));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_falls_and_pools_what_rises() {
        let mut found = Completeness::default();
        let observed: Vec<f64> = [[1.0; 40], [0.0; 40]].concat();
        found.measure(&observed);
        assert!((found.odds(0) - 9.0).abs() < 1e-9);
        assert!(found.odds(79) < 0.02);
        // One of two, in whatever order it rises: 1/2 of each.
        let rising: Vec<f64> = (0..80).map(|i| f64::from(i % 2)).collect();
        found.measure(&rising);
        assert!(found.odds.windows(2).all(|pair| pair[0] >= pair[1]));
        assert!((found.odds(40) - 1.0).abs() < 0.1, "{}", found.odds(40));
    }
}
