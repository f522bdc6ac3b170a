//! The saturated area of a source: its position where few unsaturated pixels have its light.

use crate::detect::candidates::Peak;
use crate::detect::fit::FrameMaps;
use crate::detect::psf::{MAX_WINDOW_PX, PIXEL_VARIANCE_PX2};
use arrayvec::ArrayVec;

/// The area is followed this far from the peak, in columns and rows: stars are not larger.
const REACH_PX: usize = (MAX_WINDOW_PX - 1) / 2;

/// 8-connected saturated pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SaturatedArea {
    /// Centre of the area, in pixels.
    pub x: f64,
    /// Centre of the area, in pixels.
    pub y: f64,
    /// Standard error of x, in pixels.
    pub sigma_x: f64,
    /// Standard error of y, in pixels.
    pub sigma_y: f64,
    /// Number of pixels.
    pub area_px: f64,
    /// Sum of the pixels above the background, in ADU: a lower limit of the flux.
    pub flux: f64,
}

impl SaturatedArea {
    /// The area that has a pixel within one pixel of `peak`; `None` where there is none.
    pub fn at(maps: &FrameMaps<'_>, peak: &Peak) -> Option<Self> {
        let mut sums = [0.0; 6];
        for_each_from(maps, peak, maps.saturation_adu, |column, row| {
            let background = f64::from(maps.background.at(column as f32, row as f32).0);
            let light = f64::from(maps.view.at(column, row)) - background;
            let (x, y) = (column as f64 - peak.x as f64, row as f64 - peak.y as f64);
            for (sum, term) in sums.iter_mut().zip([1.0, x, y, x * x, y * y, light]) {
                *sum += term;
            }
        });
        let [area_px, x, y, xx, yy, flux] = sums;
        if area_px == 0.0 {
            return None;
        }
        let (x, y) = (x / area_px, y / area_px);
        // Each pixel is one sample; the position is not better than that of a single pixel.
        let sigma = |variance: f64| (variance / area_px).max(PIXEL_VARIANCE_PX2).sqrt();
        Some(Self {
            x: x + peak.x as f64,
            y: y + peak.y as f64,
            sigma_x: sigma(xx / area_px - x * x),
            sigma_y: sigma(yy / area_px - y * y),
            area_px,
            flux,
        })
    }
}

/// Calls `visit` with column and row of each pixel at or above `level` that is connected with
/// `peak` (flood fill).
pub(super) fn for_each_from(
    maps: &FrameMaps<'_>,
    peak: &Peak,
    level: f32,
    mut visit: impl FnMut(usize, usize),
) {
    let left = peak.x.saturating_sub(REACH_PX);
    let top = peak.y.saturating_sub(REACH_PX);
    let mut is_seen = [[false; MAX_WINDOW_PX]; MAX_WINDOW_PX];
    let mut is_new = |x: usize, y: usize| {
        let is_near = x.abs_diff(peak.x) <= REACH_PX && y.abs_diff(peak.y) <= REACH_PX;
        is_near && !std::mem::replace(&mut is_seen[y - top][x - left], true)
    };
    let around = |x: usize, y: usize| {
        let columns = x.saturating_sub(1)..(x + 2).min(maps.view.width);
        let rows = y.saturating_sub(1)..(y + 2).min(maps.view.height);
        rows.flat_map(move |row| columns.clone().map(move |column| (column, row)))
            .filter(|&(x, y)| maps.view.at(x, y) >= level)
    };
    // Each pixel is new once: there is room for all.
    let mut open = ArrayVec::<(usize, usize), { MAX_WINDOW_PX * MAX_WINDOW_PX }>::new();
    open.extend(around(peak.x, peak.y).filter(|&(x, y)| is_new(x, y)));
    while let Some((column, row)) = open.pop() {
        open.extend(around(column, row).filter(|&(x, y)| is_new(x, y)));
        visit(column, row);
    }
}
