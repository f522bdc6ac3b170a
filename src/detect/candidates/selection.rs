//! Keeps the peaks that neither noise on a flank nor the wing of a brighter star explains.

use super::peak::{Peak, highest_first};
use super::search_config::SearchConfig;
use multiversion::multiversion;

/// Minimum prominence of a peak that is not the highest of its region.
struct MinProminence;

impl MinProminence {
    /// In standard deviations of the noise.
    const NOISE_SIGMA: f32 = 3.0;
    /// As a part of the peak's height: shot noise and imperfect spots scale with it.
    const RELATIVE: f32 = 0.03;
    /// The same where the core is saturated: its plateau is noisy.
    const RELATIVE_SATURATED: f32 = 0.3;

    /// For a peak, in units of the noise.
    fn of(peak: &Peak) -> f32 {
        let relative = if peak.saturated {
            Self::RELATIVE_SATURATED
        } else {
            Self::RELATIVE
        };
        Self::NOISE_SIGMA.max(relative * peak.snr)
    }
}

/// Height of a real spot's wing four standard deviations out, over its peak, beyond a Gaussian.
/// Moffat profiles with β = 2.5 to 4 have 0.5 to 2 % there.
const WING_HEIGHT: f32 = 0.02;
/// Wings are considered out to this many pixels: the side of a cell of the grid.
const WING_REACH_PX: usize = 64;
/// Wings lower than this, in units of the noise, are neglected.
const MIN_WING_SNR: f32 = 0.1;

/// Buffers of the selection. Bright peaks are sorted into the cells of a grid, so that only those
/// nearby are considered.
#[derive(Debug, Clone, Default)]
pub(super) struct Selection {
    /// The peaks' heights, inverted, and their indices: highest first when sorted.
    by_height: Vec<u64>,
    kept: Vec<Peak>,
    cells: WingCells,
    /// Whether there were more peaks than the last call might keep.
    pub is_full: bool,
}

impl Selection {
    /// Keeps the well-founded peaks, at most `config.max_peaks`; sorts them, highest first.
    pub fn apply(&mut self, peaks: &mut Vec<Peak>, config: &SearchConfig) {
        // Of equal peaks the first in reading order comes first, by its lower index.
        let keys = peaks.iter().enumerate();
        self.by_height.clear();
        self.by_height
            .extend(keys.map(|(index, peak)| highest_first(peak.snr, index)));
        self.by_height.sort_unstable();
        self.kept.clear();
        self.is_full = false;
        self.cells.prepare(peaks);
        for &key in &self.by_height {
            let peak = &peaks[key as u32 as usize];
            let is_highest = peak.prominence >= peak.snr;
            if !is_highest && peak.prominence < MinProminence::of(peak) {
                continue;
            }
            if self.cells.explain(peak, config) {
                continue;
            }
            if self.kept.len() >= config.max_peaks {
                self.is_full = true;
                break;
            }
            self.cells.add(peak);
            self.kept.push(*peak);
        }
        std::mem::swap(peaks, &mut self.kept);
    }
}

/// The bright ones of the kept peaks, in the cells of a grid.
#[derive(Debug, Clone, Default)]
struct WingCells {
    across: usize,
    down: usize,
    /// Where the peaks of each cell start in `sources`: there is room for all of them.
    starts: Vec<u32>,
    /// Number of peaks in each cell so far.
    counts: Vec<u32>,
    /// Sum of the heights of the peaks in each cell.
    height: Vec<f32>,
    /// Cell by cell.
    sources: Vec<WingSource>,
}

/// A peak that has a wing.
#[derive(Debug, Clone, Copy, Default)]
struct WingSource {
    x: f32,
    y: f32,
    /// Maximum height, in units of the noise.
    height: f32,
}

impl WingCells {
    /// An empty grid over all peaks.
    fn prepare(&mut self, peaks: &[Peak]) {
        let cells = peaks.iter().map(Self::cell_of);
        (self.across, self.down) =
            cells.fold((1, 1), |(w, h), (x, y)| (w.max(x + 1), h.max(y + 1)));
        let cells = self.across * self.down;
        for numbers in [&mut self.starts, &mut self.counts] {
            numbers.clear();
            numbers.resize(cells, 0);
        }
        self.height.clear();
        self.height.resize(cells, 0.0);
        let mut end = 0;
        let bright = || peaks.iter().filter(|peak| has_wing(peak));
        for peak in bright() {
            let cell = self.index_of(peak);
            self.starts[cell] += 1;
            end += 1;
        }
        self.sources.resize(end as usize, WingSource::default());
        for start in self.starts.iter_mut().rev() {
            end -= *start;
            *start = end;
        }
    }

    /// Column and row of the cell of a peak.
    fn cell_of(peak: &Peak) -> (usize, usize) {
        (peak.x / WING_REACH_PX, peak.y / WING_REACH_PX)
    }

    /// The cell of a peak, as its index.
    fn index_of(&self, peak: &Peak) -> usize {
        let (column, row) = Self::cell_of(peak);
        row * self.across + column
    }

    /// Whether the wings of the kept peaks may lift noise to the height of `peak`.
    fn explain(&self, peak: &Peak, config: &SearchConfig) -> bool {
        let (cx, cy) = Self::cell_of(peak);
        let mut near = (cy.saturating_sub(1)..(cy + 2).min(self.down)).flat_map(|row| {
            let columns = cx.saturating_sub(1)..(cx + 2).min(self.across);
            columns.map(move |column| row * self.across + column)
        });
        // Most peaks exceed the wings even if all of these were at their highest.
        let heights: f32 = near.clone().map(|cell| self.height[cell]).sum();
        if peak.snr >= config.threshold + WING_HEIGHT * heights {
            return false;
        }
        let per_wing_px = 1.0 / (4.0 * config.spot_width_px);
        let place = [peak.x as f32, peak.y as f32];
        let mut wings = 0.0;
        near.any(|cell| {
            let start = self.starts[cell] as usize;
            let sources = &self.sources[start..start + self.counts[cell] as usize];
            wings += wings_at(place, sources, per_wing_px);
            peak.snr < config.threshold + wings
        })
    }

    /// Adds the next kept peak; only bright peaks enter a cell.
    fn add(&mut self, peak: &Peak) {
        if !has_wing(peak) {
            return;
        }
        let cell = self.index_of(peak);
        let height = height_of(peak);
        self.sources[(self.starts[cell] + self.counts[cell]) as usize] = WingSource {
            x: peak.x as f32,
            y: peak.y as f32,
            height,
        };
        self.counts[cell] += 1;
        self.height[cell] += height;
    }
}

/// Whether the wing of a peak may lift noise.
fn has_wing(peak: &Peak) -> bool {
    peak.snr * WING_HEIGHT > MIN_WING_SNR
}

/// Maximum height of the wings of peaks at a place, in units of the noise.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn wings_at([x, y]: [f32; 2], sources: &[WingSource], per_wing_px: f32) -> f32 {
    /// Peaks treated together.
    const TOGETHER: usize = 8;
    let wing_of = |source: &WingSource| {
        let [dx, dy] = [source.x - x, source.y - y];
        let distance = (dx * dx + dy * dy).sqrt() * per_wing_px;
        WING_HEIGHT * source.height / (1.0 + distance * distance * distance)
    };
    let (chunks, rest) = sources.as_chunks::<TOGETHER>();
    let mut sums = [0.0; TOGETHER];
    for chunk in chunks {
        for (sum, source) in sums.iter_mut().zip(chunk) {
            *sum += wing_of(source);
        }
    }
    let of_rest: f32 = rest.iter().map(wing_of).sum();
    sums.iter().sum::<f32>() + of_rest
}

/// Maximum height of a peak, in units of the noise: a saturated core hides some of it.
fn height_of(peak: &Peak) -> f32 {
    peak.snr * if peak.saturated { 3.0 } else { 1.0 }
}
