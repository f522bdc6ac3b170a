//! The kernel of the matched filter: the spot along one axis, with unit norm.

use crate::detect::background::DIFFERENCE_PX;
use crate::detect::psf::{MAX_TAPS, PIXEL_VARIANCE_PX2, centered_profile};
use arrayvec::ArrayVec;

/// The kernel ends at this many standard deviations: the rest holds under 0.1 % of ΣP².
const KERNEL_EXTENT_SIGMA: f64 = 2.4;

/// A symmetric kernel along one axis, normalised to a sum of squares of one.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kernel {
    /// Weights at distances 0, 1, … pixels.
    half: ArrayVec<f32, MAX_TAPS>,
    /// `ΣP²` of the spot over both axes: a star of flux F centred on a pixel of noise n has a
    /// signal-to-noise ratio of `F √ΣP² / n`.
    pub sum_of_squares: f64,
    /// Correlation of filtered white noise between adjacent pixels.
    pub rho: f64,
    /// Correlation of filtered white noise between pixels that are compared for its slope.
    pub slope_rho: f32,
}

impl Kernel {
    /// The kernel for a spot with standard deviation `sigma_px`.
    pub fn for_spot(sigma_px: f64) -> Self {
        let width_px = (sigma_px * sigma_px + PIXEL_VARIANCE_PX2).sqrt();
        let radius = ((KERNEL_EXTENT_SIGMA * width_px).ceil() as usize).clamp(1, MAX_TAPS - 1);
        let profile = centered_profile(sigma_px, radius);
        let at = |i: usize| profile.get(i).copied().unwrap_or(0.0);
        let span = -(radius as isize)..=radius as isize;
        let autocorrelation = |lag: usize| -> f64 {
            span.clone()
                .map(|i| at(i.unsigned_abs()) * at((i + lag as isize).unsigned_abs()))
                .sum()
        };
        let squares = autocorrelation(0);
        Self {
            half: profile
                .iter()
                .map(|p| (p / squares.sqrt()) as f32)
                .collect(),
            sum_of_squares: squares * squares,
            rho: autocorrelation(1) / squares,
            slope_rho: (autocorrelation(DIFFERENCE_PX) / squares) as f32,
        }
    }

    /// √ΣP²: the signal-to-noise ratio of a star whose flux equals the noise of a pixel.
    pub fn matched_gain(&self) -> f64 {
        self.sum_of_squares.sqrt()
    }

    /// The weights at distances 0, 1, … pixels.
    pub fn half(&self) -> &[f32] {
        &self.half
    }

    /// Distance from the centre to the last weight, in pixels.
    pub fn radius(&self) -> usize {
        self.half.len() - 1
    }

    /// The factor that restores unit variance where the border cuts off the kernel, for a pixel
    /// this many pixels from the first and the last of its row or column.
    pub(super) fn border_factor(&self, to_first: usize, to_last: usize) -> f32 {
        let radius = self.radius();
        let side =
            |reach: usize| -> f32 { (1..=reach.min(radius)).map(|i| self.half[i].powi(2)).sum() };
        let inside = self.half[0].powi(2) + side(to_first) + side(to_last);
        1.0 / inside.sqrt()
    }
}
