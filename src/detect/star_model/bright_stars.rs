//! Fits of a frame's bright stars, each with a free size.
//!
//! Bright peaks that are neither saturated nor close to others are fitted. Hot pixels and cosmic
//! rays are sharper than stars, lamps and comets wider, and none of them need be few.

use crate::detect::candidates::{Peak, RawPeak};
use crate::detect::fit::{Fit, FitBuffers, FrameMaps, NoiseModel, SpotEstimate};
use crate::detect::psf::PIXEL_VARIANCE_PX2;
use arrayvec::ArrayVec;

/// Peaks below this signal-to-noise ratio say little about the size.
const MIN_SNR: f32 = 12.0;
/// Most stars that are fitted.
pub(crate) const MAX_STARS: usize = 30;
/// Peaks that are tried, the brightest.
const MAX_PEAKS: usize = 4 * MAX_STARS;
/// Peaks that may disturb others, the brightest.
const MAX_NEIGHBOURS: usize = 2000;
/// Peaks closer than this many spot sizes disturb each other,
const ISOLATION_SIGMA: f32 = 6.0;
/// with this added to the spot size, in pixels.
const SIZE_MARGIN_PX: f64 = 0.3;
/// Peaks below this part of a peak do not disturb it.
const FAINT_NEIGHBOUR: f32 = 0.1;
/// Largest error of the spot model, as a part of the light in a pixel: a source with a larger one
/// is no star.
pub(crate) const MAX_MODEL_ERROR: f64 = 0.1;

/// Bright stars, each fitted with a free size.
pub(crate) type BrightStars = ArrayVec<Fit, MAX_STARS>;

/// Fits the brightest peaks of the filtered frame.
pub(crate) fn fit_bright_stars(
    maps: &FrameMaps<'_>,
    peaks: &[Peak],
    buffers: &mut FitBuffers,
) -> BrightStars {
    let neighbours = &peaks[..peaks.len().min(MAX_NEIGHBOURS)];
    let reach_px = ISOLATION_SIGMA * (maps.spot_px + SIZE_MARGIN_PX) as f32;
    let bright = peaks
        .iter()
        .take(MAX_PEAKS)
        .take_while(|peak| peak.snr >= MIN_SNR);
    bright
        .filter(|peak| !peak.saturated)
        .filter(|peak| {
            let place = |p: &Peak| (p.x, p.y);
            let mut others = neighbours.iter().filter(|o| is_rival(o.snr, peak.snr));
            !others.any(|other| is_near(place(peak), place(other), reach_px))
        })
        .filter_map(|peak| {
            let size_px = size_from_curvature(peak, maps.spot_px);
            fit_star(maps, maps.initial_guess(peak), size_px, buffers)
        })
        .take(MAX_STARS)
        .collect()
}

/// Fits the brightest peaks of the unfiltered frame.
pub(crate) fn fit_raw_stars(
    maps: &FrameMaps<'_>,
    peaks: &[RawPeak],
    buffers: &mut FitBuffers,
) -> BrightStars {
    let neighbours = &peaks[..peaks.len().min(MAX_NEIGHBOURS)];
    let bright = peaks
        .iter()
        .take(MAX_PEAKS)
        .take_while(|peak| peak.snr >= MIN_SNR);
    bright
        .filter(|peak| !peak.saturated)
        .map(|peak| (peak, peak.size_px(&maps.view)))
        .filter(|(peak, size_px)| {
            let reach_px = ISOLATION_SIGMA * (*size_px as f32 + SIZE_MARGIN_PX as f32);
            let place = |p: &RawPeak| (p.x, p.y);
            let mut others = neighbours.iter().filter(|o| is_rival(o.snr, peak.snr));
            !others.any(|other| is_near(place(peak), place(other), reach_px))
        })
        .filter_map(|(peak, size_px)| {
            let start = SpotEstimate {
                x: peak.x as f64,
                y: peak.y as f64,
                flux: peak.flux_adu,
                ..SpotEstimate::default()
            };
            fit_star(maps, start, size_px, buffers)
        })
        .take(MAX_STARS)
        .collect()
}

/// Whether a peak is bright enough to disturb another.
fn is_rival(other_snr: f32, snr: f32) -> bool {
    other_snr >= FAINT_NEIGHBOUR * snr
}

/// Whether two places are within `reach_px` of each other, but not the same.
fn is_near(a: (usize, usize), b: (usize, usize), reach_px: f32) -> bool {
    let dx = b.0 as f32 - a.0 as f32;
    let dy = b.1 as f32 - a.1 as f32;
    (dx != 0.0 || dy != 0.0) && dx * dx + dy * dy <= reach_px * reach_px
}

/// Fits a star with a free size; `None` where it is none, or not alone.
fn fit_star(
    maps: &FrameMaps<'_>,
    start: SpotEstimate,
    size_px: f64,
    buffers: &mut FitBuffers,
) -> Option<Fit> {
    let fit = buffers.fit_free_size(maps, start, &[], (size_px, NoiseModel::default()));
    let is_star = fit.converged && fit.spots[0].flux > 0.0 && is_alone(&fit, buffers);
    is_star.then_some(fit)
}

/// Whether the fit's window, which is still in `buffers`, holds no light of another star: no pixel
/// with next to no light of the star is above what its error and noise explain.
fn is_alone(fit: &Fit, buffers: &mut FitBuffers) -> bool {
    /// Noise of a pixel, in standard deviations.
    const NOISE_SIGMA: f64 = 5.0;
    let mut pixels = buffers.fitter.compare(&buffers.window, fit);
    let peak = pixels
        .clone()
        .fold(0.0f64, |peak, (_, light)| peak.max(light));
    let faint = MAX_MODEL_ERROR * peak;
    let most = faint + NOISE_SIGMA;
    !pixels.any(|(above, light)| light < faint && above - light > most)
}

/// The spot size from the filtered peak's curvature, in pixels: a Gaussian of variance
/// S² = σ² + σ_filter² + 2/12 falls to exp(−1/2S²) at the next pixel.
fn size_from_curvature(peak: &Peak, filter_px: f64) -> f64 {
    let Some((value, around)) = peak.values else {
        return filter_px;
    };
    let log = |value: f32| f64::from(value.max(1e-3)).ln();
    let drop = log(value) - 0.25 * around.into_iter().map(log).sum::<f64>();
    let variance = 0.5 / drop.max(1e-3) - filter_px * filter_px - 2.0 * PIXEL_VARIANCE_PX2;
    variance.max(0.0).sqrt().clamp(0.35, 6.0)
}
