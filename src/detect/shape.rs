//! Whether a source has the shape of a star: hot pixels, wide sources, trails.
//!
//! Each flag needs a difference that is large in units of its error *and* large by itself, so that
//! neither faint noise nor the imperfect spots of bright stars are flagged.

use super::Detection;
use super::components::{Peak, Region};
use super::fit::{Fit, FitConfig, NoiseModel};
use super::measure::Measurement;
use super::scene::FitWork;

/// Differences in size or chi² count from this many standard errors on.
const SIGNIFICANT_SIGMA: f64 = 4.0;
/// A spot's size may be this part of the frame's before it is too sharp for a star.
const SHARPEST: f64 = 0.7;
/// And this multiple of the frame's before it is too wide.
const WIDEST: f64 = 1.6;
/// Stars fainter than this have no shape to speak of.
const MIN_SHAPE_SNR: f32 = 6.0;
/// A share of this of the signal is put down to an imperfect spot.
const SPOT_IMPERFECTION: f64 = 0.03;
/// Length over breadth of a trail.
const TRAIL_ELONGATION: f64 = 2.0;
/// Length of a trail over that of a star of the same height.
const TRAIL_LENGTH: f64 = 2.0;

/// Sets the flags for sources sharper or wider than the frame's spots.
pub(super) fn judge(
    measurement: &Measurement<'_>,
    peak: &Peak,
    fit: &Fit,
    detection: &mut Detection,
    work: &mut FitWork,
) {
    if peak.snr < MIN_SHAPE_SNR && detection.snr < f64::from(MIN_SHAPE_SNR) {
        return;
    }
    let spot_px = measurement.scene.spot_px;
    // Plain noise: a noise model that forgives an imperfect spot would forgive a hot pixel, too.
    let free = measurement
        .scene
        .fit_free(fit.spots[0], spot_px, NoiseModel::default(), work);
    if !free.converged {
        return;
    }
    let correlation2 = measurement
        .scene
        .correlation_at(fit.spots[0].x, fit.spots[0].y)
        .powi(2);
    let allowed = SIGNIFICANT_SIGMA.powi(2) * correlation2
        + (SPOT_IMPERFECTION * f64::from(peak.snr)).powi(2) * correlation2;
    let chi2_with = |size: f64, work: &mut FitWork| {
        let config = FitConfig {
            spot_px: size,
            free_spot: false,
            noise: NoiseModel::default(),
        };
        work.fitter.fit(&work.window, &free.spots, &config).chi2
    };
    if free.spot_px < SHARPEST * spot_px {
        detection.flags.hot_pixel = chi2_with(SHARPEST * spot_px, work) - free.chi2 > allowed;
    } else if free.spot_px > WIDEST * spot_px {
        detection.flags.extended = chi2_with(WIDEST * spot_px, work) - free.chi2 > allowed;
    }
}

/// Whether the region of a peak is drawn out beyond what a star of its height covers.
pub(super) fn is_trail(region: &Region, peak: &Peak, width_px: f64, threshold: f64) -> bool {
    if region.peaks > 1 || region.area_px < 8 {
        return false;
    }
    // A filtered star falls to the threshold where r² = 4 s² ln(snr / threshold); 1.5 px for the grid.
    let radius = 2.0 * width_px * (f64::from(peak.snr) / threshold).max(1.0).ln().sqrt() + 1.5;
    region.major_px > TRAIL_ELONGATION * region.minor_px
        && region.major_px > TRAIL_LENGTH * 0.5 * radius
}
