//! Keeps the peaks that neither noise on a flank nor the wing of a brighter star explains.

use super::peak::{Peak, highest_first};
use super::search_config::SearchConfig;

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

/// No peak.
const NONE: u32 = u32::MAX;

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
            if self.cells.explain(peak, &self.kept, config) {
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

/// The kept peaks in the cells of a grid.
#[derive(Debug, Clone, Default)]
struct WingCells {
    across: usize,
    down: usize,
    /// The last of the kept peaks in each cell, or [`NONE`].
    last: Vec<u32>,
    /// Sum of the heights of the peaks in each cell.
    height: Vec<f32>,
    /// For each kept peak the one before it in its cell, or [`NONE`].
    previous: Vec<u32>,
}

impl WingCells {
    /// An empty grid over all peaks.
    fn prepare(&mut self, peaks: &[Peak]) {
        let cells = peaks.iter().map(Self::cell_of);
        (self.across, self.down) =
            cells.fold((1, 1), |(w, h), (x, y)| (w.max(x + 1), h.max(y + 1)));
        self.previous.clear();
        self.last.clear();
        self.last.resize(self.across * self.down, NONE);
        self.height.clear();
        self.height.resize(self.across * self.down, 0.0);
    }

    /// Column and row of the cell of a peak.
    fn cell_of(peak: &Peak) -> (usize, usize) {
        (peak.x / WING_REACH_PX, peak.y / WING_REACH_PX)
    }

    /// Whether the wings of the `kept` peaks may lift noise to the height of `peak`.
    fn explain(&self, peak: &Peak, kept: &[Peak], config: &SearchConfig) -> bool {
        let (cx, cy) = Self::cell_of(peak);
        let near = (cy.saturating_sub(1)..(cy + 2).min(self.down)).flat_map(|row| {
            let columns = cx.saturating_sub(1)..(cx + 2).min(self.across);
            columns.map(move |column| row * self.across + column)
        });
        // Most peaks exceed the wings even if all of these were at their highest.
        let heights: f32 = near.clone().map(|cell| self.height[cell]).sum();
        if peak.snr >= config.threshold + WING_HEIGHT * heights {
            return false;
        }
        let mut wings = 0.0;
        for cell in near {
            let mut other = self.last[cell];
            while let Some(brighter) = kept.get(other as usize) {
                wings += wing_of(brighter, peak, config);
                other = self.previous[other as usize];
            }
        }
        peak.snr < config.threshold + wings
    }

    /// Adds the next kept peak; only bright peaks enter a cell.
    fn add(&mut self, peak: &Peak) {
        let mut previous = NONE;
        if peak.snr * WING_HEIGHT > MIN_WING_SNR {
            let (cx, cy) = Self::cell_of(peak);
            let cell = cy * self.across + cx;
            let number = self.previous.len() as u32;
            previous = std::mem::replace(&mut self.last[cell], number);
            self.height[cell] += height_of(peak);
        }
        self.previous.push(previous);
    }
}

/// Maximum height of the wing of `bright` at `peak`, in units of the noise.
fn wing_of(bright: &Peak, peak: &Peak, config: &SearchConfig) -> f32 {
    let dx = bright.x as f32 - peak.x as f32;
    let dy = bright.y as f32 - peak.y as f32;
    let distance = (dx * dx + dy * dy).sqrt() / (4.0 * config.spot_width_px);
    WING_HEIGHT * height_of(bright) / (1.0 + distance.powi(3))
}

/// Maximum height of a peak, in units of the noise: a saturated core hides some of it.
fn height_of(peak: &Peak) -> f32 {
    peak.snr * if peak.saturated { 3.0 } else { 1.0 }
}
