//! Whether a source has the shape of a star: hot pixels, wide sources, trails.
//!
//! Each flag needs a difference that is large in units of its error *and* large by itself, so that
//! neither faint noise nor the imperfect spots of bright stars are flagged.
//!
//! A hot pixel is told from a sharp star by comparing two hypotheses, all light in one pixel and a
//! spot somewhat sharper than the frame's. Their chi² differ by `D`. For a true star D is Gaussian
//! with mean −d² and standard deviation 2d, with d the distance of the two models in units of the
//! noise; for a hot pixel the mean is +d². A source is flagged where a single pixel fits better
//! (D > 0) and a star would have a D that high in under one of 150 cases.

use super::measurement::Measurement;
use crate::detect::candidates::{Peak, Region};
use crate::detect::detection::Detection;
use crate::detect::fit::{Fit, FitConfig, FitWork, NoiseModel, Spot};

/// Differences in size or chi² count from this many standard errors on.
const SIGNIFICANT_SIGMA: f64 = 4.0;
/// A true star passes for a hot pixel beyond this many standard deviations of its chi² difference.
const STAR_LOST_SIGMA: f64 = 2.5;
/// A spot's size may be this part of the frame's before it is too sharp for a star.
const SHARPEST: f64 = 0.8;
/// And this multiple of the frame's before it is too wide.
const WIDEST: f64 = 1.6;
/// A share of this of the signal is put down to an imperfect spot.
const SPOT_IMPERFECTION: f64 = 0.03;
/// Sizes are looked at more closely from this many standard errors on.
const SUSPICIOUS_SIGMA: f64 = 1.5;
/// Length over breadth of a trail.
const TRAIL_ELONGATION: f64 = 2.0;
/// Length of a trail over that of a star of the same height.
const TRAIL_LENGTH: f64 = 2.0;
/// Regions below this area have no elongation to speak of, in pixels.
const MIN_TRAIL_AREA_PX: usize = 8;

/// Sets the flags for sources sharper or wider than the frame's spots; the fit's window is still in `work`.
pub(crate) fn judge(
    measurement: &Measurement<'_>,
    peak: &Peak,
    fit: &Fit,
    detection: &mut Detection,
    work: &mut FitWork,
) {
    let spot_px = measurement.scene.spot_px;
    let excess = fit.size_excess_px / fit.size_error_px;
    if excess < -SUSPICIOUS_SIGMA {
        detection.flags.hot_pixel = is_hot_pixel(measurement, peak, fit, work);
    } else if !detection.flags.border
        && excess > SIGNIFICANT_SIGMA
        && fit.size_excess_px > 0.3 * (WIDEST - 1.0) * spot_px
    {
        detection.flags.extended = is_extended(measurement, peak, fit, work);
    }
}

/// What chi² may differ by, for the share of an imperfect spot.
fn imperfection(measurement: &Measurement<'_>, peak: &Peak, spot: &Spot) -> f64 {
    let correlation2 = measurement.scene.correlation_at(spot.x, spot.y).powi(2);
    (SPOT_IMPERFECTION * f64::from(peak.snr)).powi(2) * correlation2
}

/// Whether one pixel explains the source better than any star does.
fn is_hot_pixel(measurement: &Measurement<'_>, peak: &Peak, fit: &Fit, work: &mut FitWork) -> bool {
    let spot = fit.spots[0];
    // Plain noise: a noise model that forgives an imperfect spot would forgive a hot pixel, too.
    let config = FitConfig {
        spot_px: SHARPEST * measurement.scene.spot_px,
        free_spot: false,
        noise: NoiseModel::default(),
    };
    let correlation2 = measurement.scene.correlation_at(spot.x, spot.y).powi(2);
    let allowed = imperfection(measurement, peak, &spot);
    let is_single = |star: &Fit, work: &mut FitWork| {
        let [difference, distance2] = against_one_pixel(star, work).map(|v| v / correlation2);
        let unlike_a_star = difference + distance2 > STAR_LOST_SIGMA * 2.0 * distance2.sqrt();
        difference > allowed && unlike_a_star
    };
    // Where even a sharp star that is not fitted is better than a single pixel, one that is fitted is.
    let unfitted = Fit {
        spot_px: config.spot_px,
        ..fit.clone()
    };
    is_single(&unfitted, work) && {
        let star = work.fitter.fit(&work.window, &fit.spots[..1], &config);
        is_single(&star, work)
    }
}

/// What chi² of a star is above that of all its light in one pixel, and the squared distance of the two models.
fn against_one_pixel(star: &Fit, work: &mut FitWork) -> [f64; 2] {
    let FitWork { fitter, window, .. } = work;
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

/// Whether a spot well wider than the frame's explains the source much better.
fn is_extended(measurement: &Measurement<'_>, peak: &Peak, fit: &Fit, work: &mut FitWork) -> bool {
    let spot_px = measurement.scene.spot_px;
    let free =
        measurement
            .scene
            .fit_free(fit.spots[0], &[], (spot_px, NoiseModel::default()), work);
    if !free.converged || free.spot_px < WIDEST * spot_px {
        return false;
    }
    let config = FitConfig {
        spot_px: WIDEST * spot_px,
        free_spot: false,
        noise: NoiseModel::default(),
    };
    let star = work.fitter.fit(&work.window, &free.spots, &config);
    let correlation2 = measurement
        .scene
        .correlation_at(fit.spots[0].x, fit.spots[0].y)
        .powi(2);
    let allowed = SIGNIFICANT_SIGMA.powi(2) * correlation2;
    star.chi2 - free.chi2 > allowed + imperfection(measurement, peak, &fit.spots[0])
}

/// Whether the region of a peak is drawn out beyond what a star of its height covers.
pub(crate) fn is_trail(region: &Region, peak: &Peak, width_px: f64, threshold: f64) -> bool {
    if region.peaks > 1 || region.area_px < MIN_TRAIL_AREA_PX {
        return false;
    }
    // A filtered star falls to the threshold where r² = 4 s² ln(snr / threshold); 1.5 px for the grid.
    let height = (f64::from(peak.snr) / threshold).max(1.0);
    let radius_px = 2.0 * width_px * height.ln().sqrt() + 1.5;
    let is_long = region.major_px > TRAIL_LENGTH * 0.5 * radius_px;
    is_long && region.major_px > TRAIL_ELONGATION * region.minor_px
}
