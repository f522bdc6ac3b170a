//! The probability that chance gives as good an agreement as that of the tracked stars.
//!
//! If the predicted attitude is wrong, a window holds a source by chance with the probability
//! `p = ρπr²`, with r its radius and ρ the density of sources. The number of windows that do is
//! Poisson-binomial, as in identification. An attitude has three parameters: two stars agree with it
//! by construction, and are taken to be those least likely to do so by chance. One attitude is
//! tried.

use crate::base::statistics::log10_poisson_binomial_tail;
use crate::detect::windows::{ExpectedStar, Surplus};
use std::f64::consts::PI;

/// Stars that agree by construction.
const USED_UP: usize = 2;

/// Computes the probability. Its buffers are reused.
#[derive(Debug, Default)]
pub(super) struct Agreement {
    chances: Vec<f64>,
    tail: Vec<f64>,
}

impl Agreement {
    /// log10 of the probability that at least `agreeing` of the windows hold a source by chance.
    ///
    /// The density of sources is that of the last full solution, per px², and that of the peaks in
    /// the windows that are not the stars: the first counts as one peak in the area where it expects
    /// one.
    pub fn log10(
        &mut self,
        expected: &[ExpectedStar],
        agreeing: usize,
        (surplus, density_px2): (Surplus, f64),
    ) -> f64 {
        let area_px2 = surplus.searched_px2 + 1.0 / density_px2;
        let density = (surplus.peaks as f64 + 1.0) / area_px2;
        let chance = |star: &ExpectedStar| (density * PI * star.radius_px.powi(2)).min(1.0);
        self.chances.clear();
        self.chances.extend(expected.iter().map(chance));
        self.chances.sort_unstable_by(f64::total_cmp);
        let counted = self.chances.get(USED_UP..).unwrap_or_default();
        let hits = agreeing.saturating_sub(USED_UP);
        log10_poisson_binomial_tail(counted, hits, &mut self.tail)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::PixelPoint;

    fn log10(windows: usize, agreeing: usize, radius_px: f64, peaks: usize) -> f64 {
        let star = ExpectedStar {
            position: PixelPoint::default(),
            radius_px,
            smear_px: [0.0; 2],
        };
        let searched_px2 = windows as f64 * PI * radius_px.powi(2);
        let surplus = Surplus {
            peaks,
            searched_px2,
        };
        Agreement::default().log10(&vec![star; windows], agreeing, (surplus, 3e-4))
    }

    #[test]
    fn more_stars_in_smaller_windows_are_less_likely() {
        assert!(log10(30, 28, 3.0, 0) < -30.0);
        assert!(log10(30, 28, 3.0, 0) < log10(30, 20, 3.0, 0));
        assert!(log10(30, 20, 3.0, 0) < log10(30, 20, 6.0, 0));
        assert!(log10(30, 20, 3.0, 0) < log10(30, 20, 3.0, 20));
        // Three stars are one more than agree by construction.
        assert!(log10(30, 3, 3.0, 0) > -1.0);
        assert_eq!(log10(30, 2, 3.0, 0), 0.0);
        assert_eq!(log10(2, 2, 3.0, 0), 0.0);
    }
}
