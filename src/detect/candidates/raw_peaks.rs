//! Bright peaks of the unfiltered frame, on which the spot size is measured before the frame is
//! filtered. Such stars stand out in single pixels, unless they are far out of focus.

use super::peak::Peak;
use crate::base::interrupt::Interrupted;
use crate::detect::background::Mesh;
use crate::detect::pixels::{
    BLOCK_PX, PixelLevel, ReachedBlock, Samples, View, find_reaching, local_maxima,
};
use crate::detect::psf::PIXEL_VARIANCE_PX2;
use crate::detect::threads::for_each_worker;
use std::cmp::Ordering;

/// Least height of a peak above the background, in standard deviations of the noise.
const MIN_PIXEL_SIGMA: f32 = 6.0;
/// A peak is the highest pixel within this many columns and rows.
const PEAK_REACH_PX: usize = 3;
/// Rows that share one threshold for each block of columns.
const BAND_PX: usize = 32;
/// Pixels of a round: large frames are searched in rounds, each spread over the whole frame.
const ROUND_PX: usize = 4_000_000;
/// No further round follows once this many peaks are found: only the brightest few are fitted.
const MAX_PEAKS: usize = 600;

/// A local maximum of the frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RawPeak {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// Signal-to-noise ratio of the sum over the 3x3 pixels around it.
    pub snr: f32,
    /// Flux in those pixels, in ADU.
    pub flux_adu: f64,
    /// Background, in ADU.
    background_adu: f32,
    /// Whether one of those pixels is saturated.
    pub saturated: bool,
}

impl RawPeak {
    /// The peak as one of a filtered frame, the only one of its region.
    pub fn as_peak(&self, region: usize) -> Peak {
        Peak {
            x: self.x,
            y: self.y,
            offset_px: [0.0; 2],
            values: None,
            snr: self.snr,
            prominence: self.snr,
            region,
            saturated: self.saturated,
        }
    }

    /// The spot size from the peak's curvature, in pixels.
    pub fn size_in(&self, view: &View<'_>) -> f64 {
        // A Gaussian of variance σ² + 1/12 falls to exp(−1/2S²) at the next pixel.
        let above = |x: usize, y: usize| f64::from(view.at(x, y) - self.background_adu);
        let (x, y) = (self.x, self.y);
        let top = above(x, y);
        let log = |x, y| libm::log(above(x, y).max(1e-3 * top));
        let drop =
            libm::log(top) - 0.25 * (log(x - 1, y) + log(x + 1, y) + log(x, y - 1) + log(x, y + 1));
        let variance = 0.5 / drop.max(1e-3) - PIXEL_VARIANCE_PX2;
        variance.max(0.0).sqrt().clamp(0.35, 4.0)
    }
}

/// Finds peaks that stand out in single pixels; holds the peaks and the buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct RawPeakFinder {
    /// The peaks found last, highest signal-to-noise ratio first.
    pub peaks: Vec<RawPeak>,
    /// Pixels that were looked at since this was set to 0.
    pub visited_px: usize,
    /// Rounds over the frame that are done.
    done: usize,
    /// One for each thread.
    workers: Vec<BandWorker>,
}

/// The peaks that one thread finds, and its buffers.
#[derive(Debug, Clone, Default)]
struct BandWorker {
    thresholds: Vec<f32>,
    blocks: Vec<ReachedBlock>,
    found: Vec<RawPeak>,
}

impl RawPeakFinder {
    /// Shares the frame among `threads` threads.
    pub fn set_threads(&mut self, threads: usize) {
        self.workers.resize_with(threads, BandWorker::default);
    }

    /// Finds the peaks of `view`; those in its outermost rows and columns are left out.
    ///
    /// # Errors
    /// [`Interrupted`].
    pub fn find(
        &mut self,
        view: &View<'_>,
        background: &Mesh,
        saturation_adu: f32,
    ) -> Result<(), Interrupted> {
        self.peaks.clear();
        self.done = 0;
        self.find_until(MAX_PEAKS, view, background, saturation_adu)
    }

    /// Finds those in the part of the same view that was not looked at. Returns whether there is such a part.
    ///
    /// # Errors
    /// [`Interrupted`].
    pub fn find_rest(
        &mut self,
        view: &View<'_>,
        background: &Mesh,
        saturation_adu: f32,
    ) -> Result<bool, Interrupted> {
        let is_there_more = self.done < rounds_of(view);
        self.find_until(usize::MAX, view, background, saturation_adu)?;
        Ok(is_there_more)
    }

    /// Looks on until there are so many.
    fn find_until(
        &mut self,
        enough: usize,
        view: &View<'_>,
        background: &Mesh,
        saturation_adu: f32,
    ) -> Result<(), Interrupted> {
        let Self {
            peaks,
            visited_px,
            done,
            workers,
        } = self;
        let bands = view.height.div_ceil(BAND_PX);
        let rounds = rounds_of(view);
        let threads = workers.len();
        for round in *done..rounds {
            for_each_worker(workers, &|worker, thread| {
                let of_thread = (round..bands).step_by(rounds).skip(thread);
                worker.found.clear();
                for band in of_thread.step_by(threads) {
                    if view.is_interrupted() {
                        return;
                    }
                    worker.find_in_band(view, background, band * BAND_PX, saturation_adu);
                }
            });
            view.check()?;
            *visited_px += view.width * view.height / rounds;
            for worker in workers.iter_mut() {
                peaks.append(&mut worker.found);
            }
            *done = round + 1;
            if peaks.len() >= enough {
                break;
            }
        }
        peaks.sort_unstable_by(|a, b| b.snr.total_cmp(&a.snr).then((a.y, a.x).cmp(&(b.y, b.x))));
        Ok(())
    }
}

/// The rounds in which a view is looked at, all over it in each.
fn rounds_of(view: &View<'_>) -> usize {
    (view.width * view.height / ROUND_PX).max(1)
}

impl BandWorker {
    /// Finds the peaks in the band that begins at row `top`.
    fn find_in_band(
        &mut self,
        view: &View<'_>,
        background: &Mesh,
        top: usize,
        saturation_adu: f32,
    ) {
        let Self {
            thresholds,
            blocks,
            found,
        } = self;
        block_thresholds(view, background, top, thresholds);
        for y in top.max(1)..(top + BAND_PX).min(view.height - 1) {
            match [y - 1, y, y + 1].map(|y| view.row(y)) {
                [Samples::U8(above), Samples::U8(row), Samples::U8(below)] => {
                    find_maxima([above, row, below], thresholds, blocks);
                }
                [Samples::U16(above), Samples::U16(row), Samples::U16(below)] => {
                    find_maxima([above, row, below], thresholds, blocks);
                }
                [Samples::F32(above), Samples::F32(row), Samples::F32(below)] => {
                    find_maxima([above, row, below], thresholds, blocks);
                }
                _ => continue,
            }
            for block in blocks.iter() {
                for x in block.columns().filter(|&x| x > 0 && x + 1 < view.width) {
                    found.extend(peak_at(view, background, x, y, saturation_adu));
                }
            }
        }
    }
}

/// Finds the pixels of the middle row from the threshold of their block on that no neighbor exceeds.
fn find_maxima<T: PixelLevel>(rows: [&[T]; 3], thresholds: &[f32], found: &mut Vec<ReachedBlock>) {
    find_reaching(rows[1], thresholds, found);
    for ReachedBlock { block, bits } in found {
        *bits &= local_maxima(rows.map(Some), *block * BLOCK_PX);
    }
}

/// A threshold for each block of columns in the band that begins at row `top`, below which no pixel
/// is a peak.
fn block_thresholds(view: &View<'_>, background: &Mesh, top: usize, thresholds: &mut Vec<f32>) {
    thresholds.clear();
    let bottom = (top + BAND_PX) as f32;
    let at_edge = |x: usize| {
        let threshold = |y: f32| {
            let (background, sigma) = background.at(x as f32, y);
            background + MIN_PIXEL_SIGMA * sigma
        };
        threshold(top as f32).min(threshold(bottom))
    };
    let mut left = at_edge(0);
    for block in 0..view.width.div_ceil(BLOCK_PX) {
        let right = at_edge((block + 1) * BLOCK_PX);
        thresholds.push(left.min(right));
        left = right;
    }
}

/// The peak at an inner pixel that is a local maximum, if it is one.
fn peak_at(
    view: &View<'_>,
    background: &Mesh,
    x: usize,
    y: usize,
    saturation_adu: f32,
) -> Option<RawPeak> {
    let value = view.at(x, y);
    let (background, sigma) = background.at(x as f32, y as f32);
    if value < background + MIN_PIXEL_SIGMA * sigma || !is_highest(view, x, y) {
        return None;
    }
    let above = |dx: usize, dy: usize| f64::from(view.at(x + dx - 1, y + dy - 1) - background);
    let mut flux_adu = 0.0;
    let mut saturated = false;
    for (dx, dy) in (0..9).map(|i| (i % 3, i / 3)) {
        let light = above(dx, dy);
        flux_adu += if light.is_nan() { 0.0 } else { light };
        saturated |= view.at(x + dx - 1, y + dy - 1) >= saturation_adu;
    }
    Some(RawPeak {
        x,
        y,
        snr: flux_adu as f32 / (3.0 * sigma),
        flux_adu,
        background_adu: background,
        saturated,
    })
}

/// Whether no pixel within reach is higher; of equal ones, the first in reading order counts.
fn is_highest(view: &View<'_>, x: usize, y: usize) -> bool {
    let value = view.at(x, y);
    let columns = x.saturating_sub(PEAK_REACH_PX)..(x + PEAK_REACH_PX + 1).min(view.width);
    let rows = y.saturating_sub(PEAK_REACH_PX)..(y + PEAK_REACH_PX + 1).min(view.height);
    let is_lower = |x, y| {
        let other = view.at(x, y);
        other < value || other.is_nan()
    };
    let is_no_higher = |x, y| is_lower(x, y) || view.at(x, y) == value;
    rows.into_iter().all(|row| {
        let mut columns = columns.clone();
        columns.all(|column| match (row, column).cmp(&(y, x)) {
            Ordering::Less => is_lower(column, row),
            Ordering::Greater => is_no_higher(column, row),
            Ordering::Equal => true,
        })
    })
}
