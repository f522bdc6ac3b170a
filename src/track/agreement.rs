//! The probability that chance gives as good an agreement as that of the tracked stars.
//!
//! If the predicted attitude is wrong, a window holds a source by chance with the probability
//! `p = ρπr²`, with r its radius and ρ the density of sources. The number of windows that do is
//! Poisson-binomial, as in identification. An attitude has three parameters: two stars agree with it
//! by construction, and are taken to be those least likely to do so by chance.
//!
//! Two tests are made, and the less likely result counts. In the first, r is the radius of search,
//! and one attitude is tried: the predicted one. In the second, r is the radius within which stars
//! agree with the fitted attitude; as many attitudes are tried as there are pairs of stars that fix
//! one (Moisan & Stival 2004, IJCV 57, 201).

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
    /// log10 of the probability that chance gives as many stars that agree within `agreeing_px` of
    /// one attitude, or more.
    pub fn log10(
        &mut self,
        expected: &[ExpectedStar],
        agreeing: usize,
        agreeing_px: f64,
        density_px2: f64,
    ) -> f64 {
        /// Tests made.
        const TESTS: f64 = 2.0;
        let windows = expected.len() as f64;
        let pairs = (0.5 * windows * (windows - 1.0)).max(1.0);
        let searched = self.log10_within(expected, agreeing, |star| {
            density_px2 * PI * star.radius_px.powi(2)
        });
        let fitted = self.log10_within(expected, agreeing, |star| {
            density_px2 * PI * agreeing_px.min(star.radius_px).powi(2)
        });
        (searched.min(fitted + libm::log10(pairs)) + libm::log10(TESTS)).min(0.0)
    }

    fn log10_within(
        &mut self,
        expected: &[ExpectedStar],
        agreeing: usize,
        chance: impl Fn(&ExpectedStar) -> f64,
    ) -> f64 {
        self.chances.clear();
        self.chances
            .extend(expected.iter().map(|star| chance(star).min(1.0)));
        self.chances.sort_unstable_by(f64::total_cmp);
        let counted = self.chances.get(USED_UP..).unwrap_or_default();
        let hits = agreeing.saturating_sub(USED_UP);
        log10_poisson_binomial_tail(counted, hits, &mut self.tail)
    }
}

/// The density of sources, per px²: that of the last full solution, and that of the peaks in the
/// windows that are not the stars. The first counts as one peak in the area where it expects one.
pub(super) fn density_px2(surplus: Surplus, of_frame_px2: f64) -> f64 {
    (surplus.peaks as f64 + 1.0) / (surplus.searched_px2 + 1.0 / of_frame_px2)
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
        let density_px2 = density_px2(surplus, 3e-4);
        Agreement::default().log10(&vec![star; windows], agreeing, 1.0, density_px2)
    }

    #[test]
    fn more_stars_in_smaller_windows_are_less_likely() {
        assert!(log10(30, 28, 3.0, 0) < -30.0);
        assert!(log10(30, 28, 3.0, 0) < log10(30, 20, 3.0, 0));
        // Few stars that agree closely are enough in wide windows, too.
        assert!(log10(30, 28, 16.0, 60) < -20.0);
        assert!(log10(30, 20, 3.0, 0) < log10(30, 20, 3.0, 20));
        // Three stars are one more than agree by construction.
        assert!(log10(30, 3, 3.0, 0) > -1.0);
        assert_eq!(log10(30, 2, 3.0, 0), 0.0);
        assert_eq!(log10(2, 2, 3.0, 0), 0.0);
        assert_eq!(log10(0, 0, 3.0, 0), 0.0);
    }
}
