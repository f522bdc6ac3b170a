//! Connected-component labelling of the pixels above the threshold: 8-connected regions.
//!
//! Pixels are collected in reading order as runs of adjacent columns; touching runs of consecutive
//! rows are joined by union-find.

use super::disjoint_sets::{self, join, root_of};
use super::region::Region;
use crate::base::interrupt::Interrupted;
use crate::detect::pixels::View;
use std::ops::Range;

/// Runs between two looks for an interrupt: less than a millisecond.
const RUNS_AT_ONCE: usize = 1 << 12;

/// Adjacent pixels of a row.
#[derive(Debug, Clone, Copy)]
struct PixelRun {
    y: u32,
    /// Column of the first.
    start: u32,
    /// Column after the last.
    end: u32,
    /// Index of the first among the pixels.
    pixel: u32,
    /// Index of its region.
    region: u32,
}

impl PixelRun {
    /// Its pixels, as indices.
    fn pixels(&self) -> Range<usize> {
        self.pixel as usize..(self.pixel + (self.end - self.start)) as usize
    }

    /// Calls `visit` with spans of the run and of `above`, in the row before, whose pixels are next to
    /// each other, one by one.
    fn for_each_adjacent(&self, above: &Self, visit: &mut impl FnMut(Adjacent)) {
        let [start, end, above_start, above_end] =
            [self.start, self.end, above.start, above.end].map(i64::from);
        for offset in -1..=1 {
            let from = start.max(above_start - offset);
            let to = end.min(above_end - offset);
            if from < to {
                visit(Adjacent {
                    pixel: self.pixel as usize + (from - start) as usize,
                    before: above.pixel as usize + (from + offset - above_start) as usize,
                    count: (to - from) as usize,
                });
            }
        }
    }
}

/// Two spans of pixels of the regions; the first of one is next to the first of the other, and so on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Adjacent {
    /// Index of the first pixel of the span that is later in reading order.
    pub pixel: usize,
    /// Index of the first pixel of the other.
    pub before: usize,
    /// Pixels in each.
    pub count: usize,
}

/// Goes through the runs in reading order, and finds those that touch each.
#[derive(Default)]
struct TouchingRuns {
    /// The first run that may still touch a run of this row or a later one.
    first: usize,
}

impl TouchingRuns {
    /// Indices of the runs in the row before that of run `index` that touch it.
    fn before(&mut self, runs: &[PixelRun], index: usize) -> impl Iterator<Item = usize> {
        let run = runs[index];
        while runs[self.first].y + 1 < run.y
            || (runs[self.first].y < run.y && runs[self.first].end < run.start)
        {
            self.first += 1;
        }
        (self.first..index).take_while(move |&i| runs[i].y < run.y && runs[i].start <= run.end)
    }
}

/// Placeholder for a region that is not known yet.
const NO_REGION: u32 = u32::MAX;

/// Pixels above the threshold and the regions that they form.
#[derive(Debug, Clone, Default)]
pub(super) struct Labelling {
    /// The filtered value of each pixel over its local noise, in reading order.
    pub heights: Vec<f32>,
    /// In reading order.
    runs: Vec<PixelRun>,
    parents: Vec<u32>,
    /// Where the runs of each region start in `runs_by_region`, and the number of runs.
    region_starts: Vec<u32>,
    /// Indices of the runs, region by region.
    runs_by_region: Vec<u32>,
}

impl Labelling {
    /// Removes all pixels.
    pub fn clear(&mut self) {
        self.heights.clear();
        self.runs.clear();
    }

    /// Adds adjacent pixels of row `y` from column `x` on, to the last run if they continue it, else
    /// as a new one. Returns the indices of the first pixel and of the run.
    pub fn add(&mut self, x: u32, y: u32, heights: &[f32]) -> [u32; 2] {
        let first = self.heights.len() as u32;
        let end = x + heights.len() as u32;
        match self.runs.last_mut() {
            Some(run) if run.y == y && run.end == x => run.end = end,
            _ => self.runs.push(PixelRun {
                y,
                start: x,
                end,
                pixel: first,
                region: NO_REGION,
            }),
        }
        self.heights.extend_from_slice(heights);
        [first, self.runs.len() as u32 - 1]
    }

    /// Joins touching runs into regions, numbered in reading order.
    pub fn connect(&mut self) {
        self.join_touching_runs();
        self.number_regions();
        self.sort_runs_by_region();
    }

    fn join_touching_runs(&mut self) {
        let Self { runs, parents, .. } = self;
        disjoint_sets::reset(parents, runs.len());
        let mut touching = TouchingRuns::default();
        for index in 0..runs.len() {
            for other in touching.before(runs, index) {
                join(parents, index as u32, other as u32);
            }
        }
    }

    /// Numbers the regions, and counts the runs of each in `region_starts`.
    fn number_regions(&mut self) {
        let Self {
            runs,
            parents,
            region_starts,
            ..
        } = self;
        region_starts.clear();
        for index in 0..runs.len() {
            // The root is the first run of its region.
            let root = root_of(parents, index as u32) as usize;
            if root == index {
                runs[index].region = region_starts.len() as u32;
                region_starts.push(0);
            } else {
                runs[index].region = runs[root].region;
            }
            region_starts[runs[index].region as usize] += 1;
        }
    }

    /// Counting sort: counts become ends, and ends become starts as runs are placed from the back.
    fn sort_runs_by_region(&mut self) {
        let starts = &mut self.region_starts;
        let mut end = 0;
        for start in starts.iter_mut() {
            end += *start;
            *start = end;
        }
        self.runs_by_region.resize(self.runs.len(), 0);
        for (index, run) in self.runs.iter().enumerate().rev() {
            let start = &mut starts[run.region as usize];
            *start -= 1;
            self.runs_by_region[*start as usize] = index as u32;
        }
        starts.push(self.runs.len() as u32);
    }

    /// The region of a run.
    pub fn region_of_run(&self, run: u32) -> usize {
        self.runs[run as usize].region as usize
    }

    /// The runs of a region, in reading order.
    fn runs_of_region(&self, region: usize) -> impl Iterator<Item = &PixelRun> {
        let runs = self.region_starts[region] as usize..self.region_starts[region + 1] as usize;
        let runs = &self.runs_by_region[runs];
        runs.iter().map(|&run| &self.runs[run as usize])
    }

    /// Measures each region.
    pub fn measure_regions(&self, regions: &mut Vec<Region>) {
        regions.clear();
        for region in 0..self.region_starts.len() - 1 {
            let pixels = self.runs_of_region(region).flat_map(|run| {
                let heights = &self.heights[run.pixels()];
                (run.start..)
                    .zip(heights)
                    .map(|(x, &height)| (f64::from(x), f64::from(run.y), f64::from(height)))
            });
            regions.push(Region::of_points(pixels));
        }
    }

    /// Calls `visit` with each two adjacent pixels of the regions that are wanted, as spans.
    ///
    /// # Errors
    /// [`Interrupted`] of work on `view`.
    pub fn for_each_adjacent(
        &self,
        view: &View<'_>,
        is_wanted: impl Fn(usize) -> bool,
        mut visit: impl FnMut(Adjacent),
    ) -> Result<(), Interrupted> {
        let mut touching = TouchingRuns::default();
        for (index, run) in self.runs.iter().enumerate() {
            if index % RUNS_AT_ONCE == 0 {
                view.check()?;
            }
            if !is_wanted(run.region as usize) {
                continue;
            }
            visit(Adjacent {
                pixel: run.pixel as usize + 1,
                before: run.pixel as usize,
                count: run.pixels().len() - 1,
            });
            for other in touching.before(&self.runs, index) {
                run.for_each_adjacent(&self.runs[other], &mut visit);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, Luma};
    use imageproc::region_labelling::{Connectivity, connected_components};
    use proptest::prelude::*;

    /// For each pixel of a mask, the number of its region from 1; 0 where it is in none.
    fn labels(mask: &GrayImage) -> Vec<u32> {
        let mut labelling = Labelling::default();
        for (x, y, pixel) in mask.enumerate_pixels() {
            if pixel.0 != [0] {
                labelling.add(x, y, &[9.0]);
            }
        }
        labelling.connect();
        let mut labels = vec![0; mask.len()];
        for region in 0..labelling.region_starts.len() - 1 {
            for run in labelling.runs_of_region(region) {
                let start = (run.y * mask.width() + run.start) as usize;
                labels[start..start + run.pixels().len()].fill(region as u32 + 1);
            }
        }
        labels
    }

    proptest! {
        #[test]
        fn regions_are_those_that_imageproc_labels(
            // imageproc 0.27 panics on a mask of a single pixel.
            width in 2..50_u32,
            density in 0.05..0.95_f64,
            values in prop::collection::vec(0.0..1.0_f64, 100..2000),
        ) {
            let height = values.len() as u32 / width;
            let mask = GrayImage::from_fn(width, height, |x, y| {
                Luma([u8::from(values[(y * width + x) as usize] < density)])
            });
            // Both number the regions by their first pixels in reading order.
            let expected = connected_components(&mask, Connectivity::Eight, Luma([0]));
            prop_assert_eq!(labels(&mask), expected.into_raw());
        }
    }
}
