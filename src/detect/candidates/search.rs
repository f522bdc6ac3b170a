//! Finds connected regions above the threshold, and the peaks in them.
//!
//! [`Candidates`] of each row of cells, mean and noise of the filtered frame → [`Peak`]s, strongest
//! first, and the [`Region`]s that hold them.
//!
//! 1. Candidates above the threshold, in units of the local noise of the filtered frame.
//! 2. Regions of 8-connected pixels.
//! 3. Local maxima, each with its prominence.
//! 4. Peaks that noise or the wing of a brighter star can explain are dropped.
//! 5. Of the many peaks of a streak one is kept.

use super::candidate_pixels::{Adjacent, Candidates, PixelSpan};
use super::labelling::Labelling;
use super::memory::check_count;
use super::peak::{Peak, is_saturated, parabola_vertex};
use super::prominence::Prominence;
use super::region::Region;
use super::search_config::SearchConfig;
use super::selection::Selection;
use super::streaks::Streaks;
use crate::base::interrupt::Interrupted;
use crate::detect::DetectError;
use crate::detect::background::Mesh;
use crate::detect::pixels::{BLOCK_PX, View, bits_of};
use multiversion::multiversion;

/// Buffers of the search, and its result.
#[derive(Debug, Clone, Default)]
pub(crate) struct PeakSearch {
    labelling: Labelling,
    /// The pixel and the run of each peak while the peaks are in reading order.
    peak_pixels: Vec<[u32; 2]>,
    prominence: Prominence,
    /// The highest peak of each region.
    highest: Vec<Option<usize>>,
    selection: Selection,
    streaks: Streaks,
    /// The mesh interpolated to the current row.
    nodes: Vec<[f32; 2]>,
    /// Peaks, strongest first.
    pub peaks: Vec<Peak>,
    /// All regions.
    pub regions: Vec<Region>,
}

/// What a search found.
#[derive(Debug, Clone)]
pub(crate) struct FoundPeaks {
    peaks: Vec<Peak>,
    regions: Vec<Region>,
    is_full: bool,
}

impl PeakSearch {
    /// What was found last.
    pub fn found(&self) -> FoundPeaks {
        FoundPeaks {
            peaks: self.peaks.clone(),
            regions: self.regions.clone(),
            is_full: self.selection.is_full,
        }
    }

    /// Puts back what was found before.
    pub fn set(&mut self, found: FoundPeaks) {
        self.peaks = found.peaks;
        self.regions = found.regions;
        self.selection.is_full = found.is_full;
    }

    /// Finds regions and peaks in the candidates of all rows of cells of the filtered frame, whose
    /// mean and noise are in `mesh`.
    ///
    /// # Errors
    /// [`DetectError::Interrupted`], [`DetectError::TooCrowded`].
    pub fn run(
        &mut self,
        candidates: &[Candidates],
        mesh: &Mesh,
        frame: &View<'_>,
        config: &SearchConfig,
    ) -> Result<(), DetectError> {
        self.collect(candidates, mesh, frame, config)?;
        self.labelling.connect();
        self.labelling.measure_regions(&mut self.regions);
        for (peak, &[_, run]) in self.peaks.iter_mut().zip(&self.peak_pixels) {
            peak.region = self.labelling.region_of_run(run);
        }
        self.count_peaks();
        self.set_prominences(frame)?;
        self.selection.apply(&mut self.peaks, config);
        self.count_peaks();
        self.streaks
            .reduce_regions(&mut self.peaks, &self.regions, config.spot_width_px);
        self.count_peaks();
        self.streaks
            .join_dashes(&mut self.peaks, &mut self.regions, config.spot_width_px);
        Ok(frame.check()?)
    }

    /// Collects the pixels above the threshold, and the peaks among them.
    fn collect(
        &mut self,
        candidates: &[Candidates],
        mesh: &Mesh,
        frame: &View<'_>,
        config: &SearchConfig,
    ) -> Result<(), DetectError> {
        self.labelling.clear();
        self.peaks.clear();
        self.peak_pixels.clear();
        let mut row = None;
        for of_cells in candidates {
            for span in of_cells.spans() {
                if row.replace(span.y) != Some(span.y) {
                    mesh.across_row(span.y as usize, &mut self.nodes);
                }
                let mut heights = [0.0; BLOCK_PX];
                let heights = &mut heights[..span.values.len()];
                let bright = reaching(mesh, &self.nodes, &span, config.threshold, heights);
                self.add_runs(&span, bright, heights, frame, config.saturation_adu);
            }
            frame.check()?;
            check_count(self.labelling.heights.len(), config.max_pixels)?;
        }
        Ok(())
    }

    /// Adds those pixels of a span that are `bright`, as bits, and the peaks among them.
    fn add_runs(
        &mut self,
        span: &PixelSpan<'_>,
        mut bright: u64,
        heights: &[f32],
        frame: &View<'_>,
        saturation_adu: f32,
    ) {
        while bright != 0 {
            let start = bright.trailing_zeros();
            let length = (bright >> start).trailing_ones();
            let run = (u64::MAX >> (u64::BITS - length)) << start;
            bright &= !run;
            let of_run = &heights[start as usize..(start + length) as usize];
            let [first, index] = self.labelling.add(span.x + start, span.y, of_run);
            let mut tops = span.maxima & run;
            while tops != 0 {
                let at = tops.trailing_zeros();
                let rank = (span.maxima & !(u64::MAX << at)).count_ones();
                tops &= tops - 1;
                self.peak_pixels.push([first + at - start, index]);
                let (x, y) = ((span.x + at) as usize, span.y as usize);
                self.peaks.push(Peak {
                    saturated: is_saturated(frame, x, y, saturation_adu),
                    ..new_peak(
                        [x, y],
                        span.values[at as usize],
                        heights[at as usize],
                        span.adjacent[rank as usize],
                    )
                });
            }
        }
    }

    /// Whether there were more peaks than the last search might keep.
    pub fn is_full(&self) -> bool {
        self.selection.is_full
    }

    /// Sets the prominences where a region has several peaks; a single peak keeps its height, and
    /// so does the highest: on a plateau, the highest pixel in units of the local noise may be
    /// next to it.
    fn set_prominences(&mut self, frame: &View<'_>) -> Result<(), Interrupted> {
        let regions = &self.regions;
        let has_several = |region: usize| regions[region].peaks >= 2;
        if (0..regions.len()).any(has_several) {
            self.prominence
                .find_tops(&self.labelling, frame, has_several)?;
            self.prominence
                .find_saddles(&self.labelling, frame, has_several)?;
            self.prominence
                .set(&self.labelling.heights, &self.peak_pixels, &mut self.peaks);
        }
        self.highest.clear();
        self.highest.resize(self.regions.len(), None);
        for (index, peak) in self.peaks.iter().enumerate() {
            let highest = &mut self.highest[peak.region];
            if highest.is_none_or(|other| self.peaks[other].snr < peak.snr) {
                *highest = Some(index);
            }
        }
        for &index in self.highest.iter().flatten() {
            self.peaks[index].prominence = self.peaks[index].snr;
        }
        Ok(())
    }

    fn count_peaks(&mut self) {
        for region in &mut self.regions {
            region.peaks = 0;
        }
        for peak in &self.peaks {
            self.regions[peak.region].peaks += 1;
        }
    }
}

/// Sets the heights of a span's pixels in units of the noise, given the nodes of the row; returns a
/// bit for each that reaches the threshold.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn reaching(
    mesh: &Mesh,
    nodes: &[[f32; 2]],
    span: &PixelSpan,
    threshold: f32,
    heights: &mut [f32],
) -> u64 {
    mesh.heights(nodes, span.x as usize, span.values, heights);
    bits_of(heights, threshold)
}

/// A peak whose region is not known yet.
fn new_peak([x, y]: [usize; 2], value: f32, snr: f32, adjacent: Option<Adjacent>) -> Peak {
    Peak {
        x,
        y,
        offset_px: adjacent.map_or([0.0; 2], |adjacent| parabola_vertex(value, adjacent)),
        values: adjacent.map(|adjacent| (value, adjacent)),
        snr,
        prominence: snr,
        region: 0,
        saturated: false,
    }
}
