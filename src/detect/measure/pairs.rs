//! Close pairs: two stars that the matched filter merges into one peak.
//!
//! The filter merges stars closer than about two spot sizes, and makes a shoulder of a fainter one
//! up to four spot sizes away.

use crate::detect::candidates::{Peak, Region};
use crate::detect::fit::{FitBuffers, FitConfig, FrameMaps, NoiseModel, SpotEstimate, SpotFit};

/// A bright single source is tried as a pair where it is too wide, fits badly or is elongated.
struct PairCriteria;

impl PairCriteria {
    /// Minimum flux over its standard error.
    const MIN_SNR: f64 = 15.0;
    /// Too wide: minimum excess of the size, in standard errors,
    const MIN_EXCESS_SIGMA: f64 = 5.0;
    /// and as a fraction of the spot.
    const MIN_EXCESS: f64 = 0.12;
    /// Fits badly: minimum chi² over the degrees of freedom.
    const MIN_CHI2: f64 = 2.0;
    /// Elongated: minimum ratio of the principal axes of its region. The window of the fit ends
    /// before a neighbor four spot sizes away.
    const MIN_ELONGATION: f64 = 1.35;
    /// It is a pair where two spots have no more chi² than this over the degrees of freedom: more is
    /// a nebula.
    const MAX_CHI2: f64 = 3.0;
}

/// Whether a source may be a close pair, in a frame whose stars are round.
pub(super) fn may_be_pair(fit: &SpotFit, peak: &Peak, region: &Region, spot_px: f64) -> bool {
    let is_wide = fit.size_excess_px > PairCriteria::MIN_EXCESS_SIGMA * fit.size_error_px
        && fit.size_excess_px > PairCriteria::MIN_EXCESS * spot_px;
    let is_sharp = fit.size_excess_px < 0.0 && !peak.saturated;
    let is_bad = fit.chi2 > PairCriteria::MIN_CHI2 * fit.degrees_of_freedom.max(1.0) && !is_sharp;
    let is_elongated =
        region.peaks == 1 && region.major_px > PairCriteria::MIN_ELONGATION * region.minor_px;
    let is_bright = fit.spots[0].flux >= PairCriteria::MIN_SNR * fit.spots[0].sigma_flux;
    is_bright && (is_wide || is_bad || is_elongated)
}

/// Fits two spots to a source.
pub(super) struct PairFitter<'a> {
    pub maps: &'a FrameMaps<'a>,
    pub noise: NoiseModel,
    /// Spots beyond the window, whose light is subtracted.
    pub beyond: &'a [SpotEstimate],
}

impl PairFitter<'_> {
    /// A fit of two spots where these explain the source well and one spot does not.
    ///
    /// Where there is no pair, the window of `fit` is restored in `buffers`.
    pub fn fit(&self, fit: &SpotFit, buffers: &mut FitBuffers) -> Option<SpotFit> {
        buffers.kept_window.copy_from(&buffers.window);
        let along_axis = self.start_along_axis(fit, buffers)?;
        let pair = self.fit_from(&along_axis, fit, buffers).or_else(|| {
            let with_residual = self.start_from_residual(fit, buffers)?;
            self.fit_from(&with_residual, fit, buffers)
        });
        if pair.is_none() {
            buffers.window.copy_from(&buffers.kept_window);
        }
        pair
    }

    /// Initial guess: two equal spots on the major axis of the light.
    fn start_along_axis(&self, fit: &SpotFit, buffers: &FitBuffers) -> Option<[SpotEstimate; 2]> {
        let axis = buffers.fitter.major_axis(&buffers.window, fit)?;
        let half_px = 1.2 * self.maps.width_px();
        let spot = fit.spots[0];
        Some([-half_px, half_px].map(|step| SpotEstimate {
            x: spot.x + step * axis.0,
            y: spot.y + step * axis.1,
            flux: 0.5 * spot.flux,
            ..spot
        }))
    }

    /// Initial guess: the fitted spot, and another at the brightest residual.
    fn start_from_residual(
        &self,
        fit: &SpotFit,
        buffers: &mut FitBuffers,
    ) -> Option<[SpotEstimate; 2]> {
        /// Flux of a spot over that in its brightest 3x3 pixels, roughly.
        const FLUX_OVER_BRIGHTEST: f64 = 1.5;
        let spot_px = self.maps.spot_px;
        let radius = self.maps.window_radius(spot_px) + self.maps.width_px().ceil() as usize;
        let FitBuffers { fitter, window, .. } = buffers;
        self.maps.cut_out(&fit.spots[..1], radius, window);
        fitter.subtract(window, self.beyond, spot_px);
        fitter.subtract(window, &fit.spots, fit.spot_px);
        let (mut brightest, mut position) = (0.0, None);
        for row in 1..window.height.saturating_sub(1) {
            for column in 1..window.width.saturating_sub(1) {
                let light: f64 = (row - 1..row + 2)
                    .flat_map(|r| (column - 1..column + 2).map(move |c| (c, r)))
                    .map(|(c, r)| window.at(c, r))
                    .sum();
                // False where a pixel is left out: the sum is NaN.
                if light > brightest {
                    brightest = light;
                    position = Some((window.x0 + column, window.y0 + row));
                }
            }
        }
        let (x, y) = position?;
        let residual = SpotEstimate {
            x: x as f64,
            y: y as f64,
            flux: FLUX_OVER_BRIGHTEST * brightest * window.noise_adu,
            ..SpotEstimate::default()
        };
        Some([fit.spots[0], residual])
    }

    /// A fit of two spots from `start` that is good, and much better than one spot.
    fn fit_from(
        &self,
        start: &[SpotEstimate; 2],
        fit: &SpotFit,
        buffers: &mut FitBuffers,
    ) -> Option<SpotFit> {
        /// Largest chi² of two spots over that of one.
        const MAX_CHI2_OF_ONE: f64 = 0.5;
        let config = FitConfig {
            spot_px: self.maps.spot_px,
            free_size: false,
            noise: self.noise,
        };
        buffers.cut_out(self.maps, start, self.beyond);
        let FitBuffers { fitter, window, .. } = buffers;
        let (of_one, pixels) = fitter.chi2_near(window, fit.spots[0], &config);
        let most_chi2 = (MAX_CHI2_OF_ONE * of_one).min(PairCriteria::MAX_CHI2 * pixels as f64);
        let mut two = fitter.fit_pair_below(window, start, &config, most_chi2);
        if !self.is_well_fitted(&two) {
            return None;
        }
        let one = fitter.fit(window, &fit.spots[..1], &config);
        if two.chi2 >= MAX_CHI2_OF_ONE * one.chi2 {
            return None;
        }
        fitter.set_flux_noise(window, &mut two, &config);
        if two.spots[1].flux > two.spots[0].flux {
            two.spots.swap(0, 1);
        }
        Some(two)
    }

    /// Whether both spots are significant and apart, and the residuals are noise.
    fn is_well_fitted(&self, fit: &SpotFit) -> bool {
        /// Minimum flux of both spots over its standard error.
        const MIN_FLUX_SIGMA: f64 = 5.0;
        let Some(&[a, b]) = fit.spots.first_chunk::<2>() else {
            return false;
        };
        let is_real = |s: SpotEstimate| {
            s.flux > MIN_FLUX_SIGMA * s.sigma_flux && s.has_position(self.maps.spot_px)
        };
        let separation_px = libm::hypot(a.x - b.x, a.y - b.y);
        let is_good = fit.chi2 < PairCriteria::MAX_CHI2 * fit.degrees_of_freedom.max(1.0);
        let is_apart = separation_px > self.maps.width_px();
        fit.converged && is_real(a) && is_real(b) && is_good && is_apart
    }
}
