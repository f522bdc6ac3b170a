//! Raw frames of color cameras: stars are detected in the grey frame that the mosaic is smoothed
//! to, and what is measured there is told for the raw pixels.
//!
//! Fluxes become those of green filters over all pixels, which is the band nearest to V.

use crate::base::statistics::median;
use crate::detect::{Detection, Detections};
use crate::frame::{BayerPattern, Mosaic};
use crate::photometry::ColorFrame;

/// Variance of light within a pixel on each axis, in px².
const PIXEL_VARIANCE_PX2: f64 = 1.0 / 12.0;
/// Most stars in which the colors are compared.
const MAX_STARS: usize = 100;
/// Fewer stars do not tell the response of a filter.
const MIN_STARS: usize = 5;
/// Signal-to-noise ratio of such stars.
const MIN_SNR: f64 = 30.0;

/// A raw color frame whose stars were detected.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct RawColor {
    /// The filters, where the header says which.
    pub pattern: Option<BayerPattern>,
    /// Light of the stars behind green filters over the mean behind all; `None` where too few stars
    /// tell, and fluxes are of that mean.
    pub green_over_mean: Option<f64>,
}

impl RawColor {
    /// Turns what was detected in the grey frame of `color` into what it is in raw pixels: noise,
    /// threshold, standard errors and fluxes. Positions are the same in both.
    pub(super) fn restore(color: &ColorFrame, found: &mut Detections) -> Self {
        let restored = Self {
            pattern: color.mosaic.pattern,
            green_over_mean: green_over_mean(color, found),
        };
        let scale = restored.flux_scale();
        found.flux_limits.scale(scale);
        let error_ratio = error_ratio(found.spot_sigma_px);
        for source in &mut found.sources {
            source.flux_adu *= scale;
            if source.flags.is_star_like() && !source.flags.saturated {
                source.sigma_x_px *= error_ratio;
                source.sigma_y_px *= error_ratio;
            }
        }
        found.noise_adu /= Mosaic::NOISE_RATIO;
        found.threshold_sigma *= Mosaic::NOISE_RATIO;
        restored
    }

    /// What fluxes are multiplied with.
    pub(super) fn flux_scale(&self) -> f64 {
        self.green_over_mean.unwrap_or(1.0)
    }

    /// Spot and threshold with which stars of the grey frame's spot and threshold are as faint in
    /// raw pixels.
    pub(super) fn of_raw_pixels(spot_px: f64, threshold_sigma: f64) -> (f64, f64) {
        let raw_px = Mosaic::raw_spot_px(spot_px);
        let width_px = |spot_px: f64| (spot_px.powi(2) + PIXEL_VARIANCE_PX2).sqrt();
        (
            raw_px,
            threshold_sigma * width_px(spot_px) / width_px(raw_px),
        )
    }
}

/// Standard error of a position over that which fits state in the grey frame. They know by how much
/// its correlated noise raises the error of a flux; that of a position depends on higher frequencies,
/// of which the kernel leaves less: s² / (s² + v) in variance, for a spot of variance s² and a kernel
/// of v.
fn error_ratio(spot_px: f64) -> f64 {
    let variance_px2 = spot_px.powi(2) + PIXEL_VARIANCE_PX2;
    (variance_px2 / (variance_px2 + Mosaic::ADDED_VARIANCE_PX2)).sqrt()
}

/// The light of bright stars behind green filters over the mean behind all: the median of the stars.
fn green_over_mean(color: &ColorFrame, found: &Detections) -> Option<f64> {
    let is_clean = |source: &&Detection| {
        source.snr > MIN_SNR && source.flags.is_star_like() && source.flags.has_clean_flux()
    };
    let stars = found.sources.iter().filter(is_clean).take(MAX_STARS);
    let of_star = |star: &Detection| {
        let [green, first, second] = color.fluxes_adu(&star.position, found.spot_sigma_px)?;
        // Half of the pixels are green.
        Some(4.0 * green / (2.0 * green + first + second))
    };
    let mut ratios: Vec<f64> = stars.filter_map(of_star).collect();
    let ratio = (ratios.len() >= MIN_STARS).then(|| median(&mut ratios))?;
    (ratio > 0.0).then_some(ratio)
}
