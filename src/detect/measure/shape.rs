//! Tests whether a source has the shape of a star: hot pixels, wide sources, trails.
//!
//! Each flag needs a difference that is large in units of its error *and* large by itself, so that
//! neither faint noise nor the imperfect spots of bright stars are flagged.
//!
//! A hot pixel and a sharp star are two hypotheses: all light in one pixel, or a spot somewhat
//! sharper than the frame's. Their chi² differ by `D`. For a true star D is Gaussian with mean −d²
//! and standard deviation 2d, where d is the distance of the two models in units of the noise; for
//! a hot pixel the mean is +d². A source is flagged where a single pixel fits better (D > 0) and a
//! star would have a D that high in under one of 150 cases.

use super::core::Core;
use super::star_shape::StarShape;
use crate::detect::candidates::{Peak, Region};
use crate::detect::contrast::HOT_PIXEL_PX;
use crate::detect::detection::Detection;
use crate::detect::fit::{FitBuffers, FitConfig, FrameMaps, NoiseModel, SpotEstimate, SpotFit};

/// Size of a star's spot, over that of the frame's spot.
struct StarSize;

impl StarSize {
    /// Sharper spots are hot pixels or cosmic rays.
    const MIN: f64 = 0.8;
    /// Wider spots are extended sources.
    const MAX: f64 = 1.6;
    /// A size too small by this many standard errors is tested for a hot pixel.
    const TESTED_SIGMA: f64 = 1.5;
    /// A difference in size or chi² is significant at this many standard errors.
    const SIGNIFICANT_SIGMA: f64 = 4.0;
}

/// Whether the brightest pixel at a peak did not get its light through a lens whose spots leave at least
/// `least_beside` of the light of a pixel beside it: a hot pixel, a cosmic ray. Charge that ran from a saturated
/// star along a column is sharp in one direction.
pub(super) fn is_too_sharp(
    maps: &FrameMaps<'_>,
    noise: &NoiseModel,
    peak: &Peak,
    least_beside: f64,
) -> bool {
    let contrast = maps.contrast_at(peak);
    let sigmas = StarSize::SIGNIFICANT_SIGMA * maps.correlation_at(peak.x as f64, peak.y as f64);
    let directions = contrast.sharp_directions(least_beside, sigmas, noise.shot_adu);
    directions >= if peak.saturated { 2 } else { 1 }
}

/// Size of the sharpest spots that stars have in a frame, in pixels.
pub(crate) fn sharpest_px(maps: &FrameMaps<'_>, shape: &StarShape) -> f64 {
    /// The cores of spots that are no Gaussians, over their size.
    const CORE: f64 = 0.75;
    match maps.psf.map(|tables| tables.psf.summary(maps.view.size())) {
        Some(psf) => StarSize::MIN * CORE * psf.sigma_range_px[0] / psf.axis_ratio.sqrt(),
        // The breadth of elongated stars is not known.
        None if shape.is_elongated() => HOT_PIXEL_PX,
        None => StarSize::MIN * maps.spot_px,
    }
}

/// Sets the flags of sources sharper or wider than the frame's spot, unless they have the latter; the
/// window of the fit is in `buffers`.
pub(super) fn flag_size(
    maps: &FrameMaps<'_>,
    shape: &StarShape,
    peak: &Peak,
    fit: &SpotFit,
    detection: &mut Detection,
    buffers: &mut FitBuffers,
) {
    let excess = fit.size_excess_px / fit.size_error_px;
    if excess < -StarSize::TESTED_SIGMA {
        detection.flags.hot_pixel = is_hot_pixel(maps, peak, fit, buffers);
    } else if !detection.flags.border
        && !detection.flags.extended
        && excess > StarSize::SIGNIFICANT_SIGMA
        && fit.size_excess_px > 0.3 * (StarSize::MAX - 1.0) * maps.spot_px
    {
        let is_wider = shape.is_wider(maps, peak, StarSize::MAX);
        detection.flags.extended =
            is_wider.unwrap_or_else(|| is_extended(maps, peak, fit, buffers));
    }
}

/// The difference in chi² that an imperfect spot model may cause.
fn imperfection(maps: &FrameMaps<'_>, peak: &Peak, spot: &SpotEstimate) -> f64 {
    /// Error of the spot model over the signal.
    const MODEL_ERROR: f64 = 0.03;
    let correlation2 = maps.correlation_at(spot.x, spot.y).powi(2);
    (MODEL_ERROR * f64::from(peak.snr)).powi(2) * correlation2
}

/// Whether a single pixel explains the source better than any star does.
fn is_hot_pixel(
    maps: &FrameMaps<'_>,
    peak: &Peak,
    fit: &SpotFit,
    buffers: &mut FitBuffers,
) -> bool {
    /// Maximum deviation of a true star's chi² difference, in standard deviations.
    const STAR_SIGMA: f64 = 2.5;
    let spot = fit.spots[0];
    // Without shot noise and model errors: these would excuse a hot pixel, too.
    let config = FitConfig {
        spot_px: StarSize::MIN * maps.spot_px,
        free_size: false,
        noise: NoiseModel::default(),
    };
    let correlation2 = maps.correlation_at(spot.x, spot.y).powi(2);
    let allowed = imperfection(maps, peak, &spot);
    let is_single = |star: &SpotFit, buffers: &mut FitBuffers| {
        let [difference, distance2] =
            compare_with_one_pixel(star, buffers).map(|v| v / correlation2);
        let is_unlike_star = difference + distance2 > STAR_SIGMA * 2.0 * distance2.sqrt();
        difference > allowed && is_unlike_star
    };
    // Where a sharp star that is not fitted is better than a single pixel, a fitted one is, too.
    let unfitted = SpotFit {
        spot_px: config.spot_px,
        ..fit.clone()
    };
    is_single(&unfitted, buffers) && {
        let FitBuffers { fitter, window, .. } = &mut *buffers;
        let star = fitter.fit(window, &fit.spots[..1], &config);
        is_single(&star, buffers)
    }
}

/// Chi² of a star less that of all light in one pixel, and the squared distance of the two models.
fn compare_with_one_pixel(star: &SpotFit, buffers: &mut FitBuffers) -> [f64; 2] {
    let FitBuffers { fitter, window, .. } = buffers;
    let (mut difference, mut distance2) = (0.0, 0.0);
    let mut brightest = (0.0, 0.0);
    for (above, light) in fitter.compare(window, star) {
        difference += light * (light - 2.0 * above);
        distance2 += light * light;
        if above > brightest.0 {
            brightest = (above, light);
        }
    }
    let (above, light) = brightest;
    [
        difference + above * above,
        distance2 + above * (above - 2.0 * light),
    ]
}

/// Whether a much wider spot than the frame's explains the source much better: one of the largest
/// size that a star has is fitted, and would be larger still, which would lower chi² (a score test).
fn is_extended(maps: &FrameMaps<'_>, peak: &Peak, fit: &SpotFit, buffers: &mut FitBuffers) -> bool {
    let spot = fit.spots[0];
    let spot_px = StarSize::MAX * maps.spot_px;
    let config = FitConfig {
        spot_px,
        free_size: false,
        noise: NoiseModel::default(),
    };
    let FitBuffers { fitter, window, .. } = buffers;
    maps.cut_out(&[spot], maps.window_radius(spot_px), window);
    let star = fitter.fit(window, &[spot], &config);
    let correlation2 = maps.correlation_at(spot.x, spot.y).powi(2);
    let allowed = StarSize::SIGNIFICANT_SIGMA.powi(2) * correlation2;
    let excess = (star.size_excess_px / star.size_error_px).max(0.0);
    star.converged && excess * excess > allowed + imperfection(maps, peak, &spot)
}

/// Whether the region of a peak is longer than a star of its height is wide. The halo of a saturated
/// star may be so; its core is not.
pub(super) fn is_trail(
    maps: &FrameMaps<'_>,
    shape: &StarShape,
    region: &Region,
    peak: &Peak,
    threshold: f64,
) -> bool {
    /// Minimum area, in pixels: smaller regions have no meaningful elongation.
    const MIN_AREA_PX: usize = 8;
    /// Minimum ratio of the principal axes.
    const MIN_ELONGATION: f64 = 2.0;
    /// Minimum length over that of a star of the same height.
    const MIN_LENGTH: f64 = 2.0;
    if region.peaks > 1 || region.area_px < MIN_AREA_PX {
        return false;
    }
    let has_round_core = || {
        let axes = Core::at(maps, peak).map(|core| shape.axes_px(core.covariance));
        axes.is_some_and(|[major, minor]| major < MIN_ELONGATION * minor)
    };
    // A filtered star falls to the threshold at r² = 4 s² ln(snr / threshold); 1.5 px for the grid.
    let height = (f64::from(peak.snr) / threshold).max(1.0);
    let radius_px = 2.0 * maps.width_px() * libm::log(height).sqrt() + 1.5;
    let [major_px, minor_px] = shape.axes_px(region.covariance);
    let is_long = major_px > MIN_LENGTH * 0.5 * radius_px;
    is_long && major_px > MIN_ELONGATION * minor_px && !(peak.saturated && has_round_core())
}
