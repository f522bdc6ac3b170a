//! Raw frames of color cameras: stars are detected in the grey frame that the mosaic is smoothed
//! to, and what is measured there is told for the raw pixels.
//!
//! Fluxes become those of green filters over all pixels, which is the band nearest to V.

use crate::base::statistics::median;
use crate::detect::{Detection, Detections};
use crate::frame::{BayerPattern, Frame, Mosaic};

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
    /// Turns what was detected in the grey frame of `raw` into what it is in raw pixels: noise,
    /// threshold, standard errors and fluxes. Positions are the same in both.
    pub(super) fn restore(mosaic: Mosaic, raw: &Frame, found: &mut Detections) -> Self {
        let green_over_mean = green_over_mean(mosaic, raw, found);
        let scale = green_over_mean.unwrap_or(1.0);
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
        Self {
            pattern: mosaic.pattern,
            green_over_mean,
        }
    }

    /// Spot and threshold with which stars of the grey frame's spot and threshold are as faint in
    /// raw pixels.
    pub(super) fn of_raw_pixels(spot_px: f64, threshold_sigma: f64) -> (f64, f64) {
        let raw_px = (spot_px.powi(2) - Mosaic::ADDED_VARIANCE_PX2)
            .max(0.0)
            .sqrt();
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

/// The light of bright stars in green pixels over that in all: the median of the stars.
fn green_over_mean(mosaic: Mosaic, raw: &Frame, found: &Detections) -> Option<f64> {
    let is_clean = |source: &&Detection| {
        source.snr > MIN_SNR && source.flags.is_star_like() && source.flags.has_clean_flux()
    };
    let stars = found.sources.iter().filter(is_clean).take(MAX_STARS);
    let radius_px = 3.0 * (found.spot_sigma_px + 0.5);
    let of_star = |star: &Detection| {
        let Detection { position, .. } = star;
        green_share(mosaic, raw, [position.x, position.y], radius_px)
    };
    let mut shares: Vec<f64> = stars.filter_map(of_star).collect();
    let share = (shares.len() >= MIN_STARS).then(|| median(&mut shares))?;
    // Half of the pixels are green.
    (share > 0.0).then_some(2.0 * share)
}

/// The part of a star's light within `radius_px` that lies in green pixels; `None` at the border.
fn green_share(mosaic: Mosaic, raw: &Frame, [x, y]: [f64; 2], radius_px: f64) -> Option<f64> {
    /// Width of the ring in which the background is measured.
    const RING_PX: usize = 4;
    let radius = (radius_px.ceil() as usize).next_multiple_of(2);
    // Whole squares of 2 × 2 pixels, so that all filters are as frequent.
    let outer = radius + RING_PX;
    let start = |at: f64, side: usize| {
        let first = (at.round().max(0.0) as usize / 2 * 2).checked_sub(outer)?;
        (first + 2 * outer <= side).then_some(first)
    };
    let (x0, y0) = (start(x, raw.width)?, start(y, raw.height)?);
    let is_inner = |at: usize| (RING_PX..RING_PX + 2 * radius).contains(&at);
    // Sums of green and other pixels, inside and in the ring.
    let mut sums = [[0.0; 2]; 2];
    let mut counts = [[0.0; 2]; 2];
    for row in 0..2 * outer {
        for column in 0..2 * outer {
            let (x, y) = (x0 + column, y0 + row);
            let (part, filter) = (
                usize::from(!(is_inner(row) && is_inner(column))),
                usize::from(!mosaic.is_green(x, y)),
            );
            sums[part][filter] += f64::from(raw.at(x, y));
            counts[part][filter] += 1.0;
        }
    }
    let [inside, ring] = sums;
    let light =
        |filter: usize| inside[filter] - ring[filter] / counts[1][filter] * counts[0][filter];
    let share = light(0) / (light(0) + light(1));
    share.is_finite().then_some(share)
}
