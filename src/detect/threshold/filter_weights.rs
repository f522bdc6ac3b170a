//! The weights with which the matched filter adds up pixels.

use crate::base::size::Size;
use crate::detect::psf::{MAX_TAPS, centered_profile};
use arrayvec::ArrayVec;

/// Weights of a filter, each with the number of times that it occurs.
type Weighted = ArrayVec<(f64, f64), { MAX_TAPS * MAX_TAPS }>;

/// The weights of the matched filter.
#[derive(Debug, Clone)]
pub(crate) struct FilterWeights {
    /// In the interior of the frame.
    pub inside: Weighted,
    /// At the border, where half of the filter is cut off.
    pub at_border: Weighted,
    /// The largest weight.
    pub largest: f64,
    /// The part of the frame that counts as its border.
    pub border_part: f64,
}

impl FilterWeights {
    /// Width of the border, in pixels: there about half of the filter is cut off.
    const BORDER_PX: f64 = 1.0;
    /// Most that the threshold at the border is above that of the interior.
    const MAX_BORDER_RAISE: f64 = 2.0;

    /// The filter for a spot, out to `radius`, on a frame of this size.
    pub fn for_spot(spot_px: f64, radius: usize, size: Size) -> Self {
        let profile = centered_profile(spot_px, radius);
        let axis = |sides: f64| -> ArrayVec<(f64, f64), MAX_TAPS> {
            let times = |i: usize| if i == 0 { 1.0 } else { sides };
            let with_times = profile.iter().enumerate().map(|(i, &p)| (times(i), p));
            let weights: ArrayVec<(f64, f64), MAX_TAPS> = with_times.collect();
            let norm = sum_of_powers(&weights, 2).sqrt();
            weights.iter().map(|&(n, w)| (n, w / norm)).collect()
        };
        let (whole, half) = (axis(2.0), axis(1.0));
        let product = |a: &[(f64, f64)], b: &[(f64, f64)]| -> Weighted {
            let row = |&(n, w): &(f64, f64)| b.iter().map(move |&(m, v)| (n * m, w * v));
            a.iter().flat_map(row).collect()
        };
        let inner = |side: usize| 1.0 - 2.0 * Self::BORDER_PX.min(0.5 * side as f64) / side as f64;
        Self {
            largest: half[0].1 * whole[0].1,
            inside: product(&whole, &whole),
            at_border: product(&half, &whole),
            border_part: 1.0 - inner(size.width) * inner(size.height),
        }
    }

    /// The value that the filtered noise of interior and border exceeds as often as Gaussian noise
    /// exceeds `u`, from the quantile for given weights. `shift` is the mean at the border less
    /// that of the interior.
    pub fn quantile_of_frame(
        &self,
        u: f64,
        shift: f64,
        quantile: impl Fn(&[(f64, f64)]) -> Option<f64>,
    ) -> Option<f64> {
        let (inside, at_border) = (quantile(&self.inside)?, quantile(&self.at_border)?);
        let raise = (at_border + shift - inside).min(Self::MAX_BORDER_RAISE);
        Some(inside + libm::log1p(self.border_part * libm::expm1(u * raise)) / u)
    }
}

/// `Σ n wᵏ` over weights w that occur n times.
pub(crate) fn sum_of_powers(weights: &[(f64, f64)], power: i32) -> f64 {
    weights.iter().map(|(n, w)| n * w.powi(power)).sum()
}
