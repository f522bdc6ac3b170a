//! Bright peaks of the unfiltered frame: stars to measure the spot on before the frame is filtered.
//!
//! A star bright enough for that stands out in a single pixel, unless it is far out of focus.

use crate::detect::background::{Mesh, on_each};
use crate::detect::fit::Spot;
use crate::detect::pixels::{BLOCK_PX, Reached, View, find_reaching};
use crate::detect::psf::PIXEL_VARIANCE_PX2;
use std::cmp::Ordering;

/// A pixel is looked at from this many standard deviations of the background noise on.
const MIN_PIXEL_SIGMA: f32 = 6.0;
/// A peak is the highest pixel within this many columns and rows.
const PEAK_REACH_PX: usize = 3;
/// Rows that share the levels which their blocks of columns are compared with.
const BAND_PX: usize = 32;
/// Large frames are looked at in rounds of so many pixels, each spread over the whole frame,
const ROUND_PX: usize = 4_000_000;
/// until there are so many peaks: only the brightest few are fitted.
const ENOUGH_PEAKS: usize = 600;

/// A local maximum of the frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RawPeak {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// Signal-to-noise ratio of the sum over the 3x3 pixels around it.
    pub snr: f32,
    /// Light in those pixels, in ADU.
    pub light_adu: f64,
    /// Background, in ADU.
    level_adu: f32,
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

    /// The spot size that its curvature tells, in pixels.
    pub fn size_px(&self, view: &View<'_>) -> f64 {
        // A Gaussian of variance σ² + 1/12 falls to exp(−1/2S²) at the next pixel.
        let above = |x: usize, y: usize| f64::from(view.at(x, y) - self.level_adu);
        let (x, y) = (self.x, self.y);
        let top = above(x, y);
        let log = |x, y| above(x, y).max(1e-3 * top).ln();
        let drop =
            top.ln() - 0.25 * (log(x - 1, y) + log(x + 1, y) + log(x, y - 1) + log(x, y + 1));
        let variance = 0.5 / drop.max(1e-3) - PIXEL_VARIANCE_PX2;
        variance.max(0.0).sqrt().clamp(0.35, 4.0)
    }
}

/// The peaks that one thread finds, and its buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct RawPeaks {
    levels: Vec<f32>,
    blocks: Vec<Reached>,
    found: Vec<RawPeak>,
}

/// Finds peaks that stand out in single pixels, strongest first; those at the very border are left out.
pub(crate) fn find(
    view: &View<'_>,
    background: &Mesh,
    saturation_adu: f32,
    workers: &mut [RawPeaks],
    peaks: &mut Vec<RawPeak>,
) {
    peaks.clear();
    let bands = view.height.div_ceil(BAND_PX);
    let rounds = (view.width * view.height / ROUND_PX).max(1);
    let threads = workers.len();
    for round in 0..rounds {
        on_each(workers, &|worker, thread| {
            let of_thread = (round..bands).step_by(rounds).skip(thread);
            worker.found.clear();
            for band in of_thread.step_by(threads) {
                worker.find_in_band(view, background, band * BAND_PX, saturation_adu);
            }
        });
        for worker in workers.iter_mut() {
            peaks.append(&mut worker.found);
        }
        if peaks.len() >= ENOUGH_PEAKS {
            break;
        }
    }
    peaks.sort_unstable_by(|a, b| b.snr.total_cmp(&a.snr).then((a.y, a.x).cmp(&(b.y, b.x))));
}

impl RawPeaks {
    /// Finds the peaks in the band from row `top` on.
    fn find_in_band(
        &mut self,
        view: &View<'_>,
        background: &Mesh,
        top: usize,
        saturation_adu: f32,
    ) {
        let Self {
            levels,
            blocks,
            found,
        } = self;
        band_levels(view, background, top, levels);
        for y in top.max(1)..(top + BAND_PX).min(view.height - 1) {
            let row = view.row(y);
            find_reaching(row, levels, blocks);
            for block in blocks.iter() {
                for x in block.columns().filter(|&x| x > 0 && x + 1 < view.width) {
                    found.extend(peak_at(view, background, x, y, saturation_adu));
                }
            }
        }
    }
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
    // Most pixels of a star are no peak: that is seen at once.
    let next_to = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
    if next_to.iter().any(|&(x, y)| view.at(x, y) > value) {
        return None;
    }
    let (level, spread) = background.at(x as f32, y as f32);
    if value < level + MIN_PIXEL_SIGMA * spread || !is_highest(view, x, y) {
        return None;
    }
    let above = |dx: usize, dy: usize| f64::from(view.at(x + dx - 1, y + dy - 1) - level);
    let mut light_adu = 0.0;
    let mut saturated = false;
    for (dx, dy) in (0..9).map(|i| (i % 3, i / 3)) {
        let light = above(dx, dy);
        light_adu += if light.is_nan() { 0.0 } else { light };
        saturated |= view.at(x + dx - 1, y + dy - 1) >= saturation_adu;
    }
    Some(RawPeak {
        x,
        y,
        snr: light_adu as f32 / (3.0 * spread),
        light_adu,
        level_adu: level,
        saturated,
    })
}

/// Whether no pixel within reach is higher; of equal ones, the first in reading order counts.
fn is_highest(view: &View<'_>, x: usize, y: usize) -> bool {
    let value = view.at(x, y);
    let columns = x.saturating_sub(PEAK_REACH_PX)..(x + PEAK_REACH_PX + 1).min(view.width);
    let rows = y.saturating_sub(PEAK_REACH_PX)..(y + PEAK_REACH_PX + 1).min(view.height);
    rows.into_iter().all(|row| {
        let here = view.row(row);
        let is_lower = |v: &f32| *v < value || v.is_nan();
        let is_no_higher = |v: &f32| *v <= value || v.is_nan();
        match row.cmp(&y) {
            Ordering::Less => here[columns.clone()].iter().all(is_lower),
            Ordering::Greater => here[columns.clone()].iter().all(is_no_higher),
            Ordering::Equal => {
                here[columns.start..x].iter().all(is_lower)
                    && here[x..columns.end].iter().all(is_no_higher)
            }
        }
    })
}
