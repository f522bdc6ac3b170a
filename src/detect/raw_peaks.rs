//! Bright peaks of the unfiltered frame: stars to measure the spot on before the frame is filtered.
//!
//! A star bright enough for that stands out in a single pixel, unless it is far out of focus.

use super::background::Mesh;
use super::fit::Spot;
use super::matched_filter::{BLOCK_PX, block_maxima};
use super::psf::PIXEL_VARIANCE_PX2;
use super::view::View;

/// A pixel is looked at from this many standard deviations of the background noise on.
const MIN_PIXEL_SIGMA: f32 = 6.0;
/// A peak is the highest pixel within this many columns and rows.
const PEAK_REACH_PX: usize = 3;
/// Rows that share the levels which their blocks of columns are compared with.
const BAND_PX: usize = 32;
/// At most so many candidates: a frame with more is no night sky.
const MAX_CANDIDATES: usize = 5000;

/// A local maximum of the frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct RawPeak {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// Signal-to-noise ratio of the sum over the 3x3 pixels around it.
    pub snr: f32,
    /// Light in those pixels, in ADU.
    pub light_adu: f64,
    /// The spot size that its curvature tells, in pixels.
    pub size_px: f64,
    /// Whether one of those pixels is saturated.
    pub saturated: bool,
}

impl RawPeak {
    /// A first guess of the spot.
    pub fn spot(&self) -> Spot {
        Spot {
            x: self.x as f64,
            y: self.y as f64,
            flux: self.light_adu,
            ..Spot::default()
        }
    }
}

/// The peaks that stand out in single pixels, strongest first; those at the very border are left out.
pub(super) fn find(view: &View<'_>, background: &Mesh, saturation_adu: f32) -> Vec<RawPeak> {
    let mut peaks = Vec::new();
    let mut maxima = vec![0.0; view.width.div_ceil(BLOCK_PX)];
    let mut levels = Vec::new();
    for y in 1..view.height - 1 {
        if levels.is_empty() || y % BAND_PX == 0 {
            band_levels(view, background, y, &mut levels);
        }
        let row = view.row(y);
        block_maxima(row, &mut maxima);
        for block in (0..maxima.len()).filter(|&b| maxima[b] >= levels[b]) {
            let start = (block * BLOCK_PX).max(1);
            let end = ((block + 1) * BLOCK_PX).min(view.width - 1);
            for x in (start..end).filter(|&x| row[x] >= levels[block]) {
                peaks.extend(peak_at(view, background, x, y, saturation_adu));
            }
        }
        if peaks.len() >= MAX_CANDIDATES {
            break;
        }
    }
    peaks.sort_by(|a, b| b.snr.total_cmp(&a.snr).then((a.y, a.x).cmp(&(b.y, b.x))));
    peaks
}

/// For each block of columns the level that no pixel of interest in the band from row `y` on is below.
fn band_levels(view: &View<'_>, background: &Mesh, y: usize, levels: &mut Vec<f32>) {
    levels.clear();
    let bottom = (y + BAND_PX) as f32;
    let edge_level = |x: usize| {
        let bright = |y: f32| {
            let (level, spread) = background.at(x as f32, y);
            level + MIN_PIXEL_SIGMA * spread
        };
        bright(y as f32).min(bright(bottom))
    };
    let mut left = edge_level(0);
    for block in 0..view.width.div_ceil(BLOCK_PX) {
        let right = edge_level((block + 1) * BLOCK_PX);
        levels.push(left.min(right));
        left = right;
    }
}

/// The peak at an inner pixel, if it is one.
fn peak_at(
    view: &View<'_>,
    background: &Mesh,
    x: usize,
    y: usize,
    saturation_adu: f32,
) -> Option<RawPeak> {
    let value = view.at(x, y);
    let (level, spread) = background.at(x as f32, y as f32);
    if value < level + MIN_PIXEL_SIGMA * spread {
        return None;
    }
    let columns = x.saturating_sub(PEAK_REACH_PX)..(x + PEAK_REACH_PX + 1).min(view.width);
    for row in y.saturating_sub(PEAK_REACH_PX)..(y + PEAK_REACH_PX + 1).min(view.height) {
        for column in columns.clone() {
            let other = view.at(column, row);
            // Of equal ones, the first in reading order counts.
            if other > value || (other == value && (row, column) < (y, x)) {
                return None;
            }
        }
    }
    let above = |dx: usize, dy: usize| f64::from(view.at(x + dx - 1, y + dy - 1) - level);
    let mut light_adu = 0.0;
    let mut saturated = false;
    for (dx, dy) in (0..9).map(|i| (i % 3, i / 3)) {
        let light = above(dx, dy);
        light_adu += if light.is_nan() { 0.0 } else { light };
        saturated |= view.at(x + dx - 1, y + dy - 1) >= saturation_adu;
    }
    // A Gaussian of variance σ² + 1/12 falls to exp(−1/2S²) at the next pixel.
    let log = |dx, dy| above(dx, dy).max(1e-3 * above(1, 1)).ln();
    let drop = log(1, 1) - 0.25 * (log(0, 1) + log(2, 1) + log(1, 0) + log(1, 2));
    let variance = 0.5 / drop.max(1e-3) - PIXEL_VARIANCE_PX2;
    Some(RawPeak {
        x,
        y,
        snr: light_adu as f32 / (3.0 * spread),
        light_adu,
        size_px: variance.max(0.0).sqrt().clamp(0.35, 4.0),
        saturated,
    })
}
