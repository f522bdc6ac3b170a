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

/// A pixel above the threshold.
#[derive(Debug, Clone, Copy)]
pub(super) struct BrightPixel {
    pub x: u32,
    pub y: u32,
    /// Filtered value over its local noise.
    pub snr: f32,
}

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

    /// The index of its pixel in a column.
    fn pixel_in(&self, column: i64) -> usize {
        self.pixel as usize + (column - i64::from(self.start)) as usize
    }

    /// Calls `visit` with each pixel of the run and those of `above`, in the row before, that are
    /// next to it.
    fn for_each_adjacent(&self, above: &Self, visit: &mut impl FnMut(usize, usize)) {
        for offset in -1..=1 {
            let from = i64::from(self.start).max(i64::from(above.start) - offset);
            let to = i64::from(self.end).min(i64::from(above.end) - offset);
            for column in from..to {
                visit(self.pixel_in(column), above.pixel_in(column + offset));
            }
        }
    }
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
    /// In reading order.
    pub pixels: Vec<BrightPixel>,
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
        self.pixels.clear();
        self.runs.clear();
    }

    /// Adds a pixel to the run of the pixel before it if the two are adjacent, else to a new run.
    /// Returns the indices of the pixel and its run.
    pub fn add(&mut self, pixel: BrightPixel) -> [u32; 2] {
        let BrightPixel { x, y, .. } = pixel;
        let index = self.pixels.len() as u32;
        match self.runs.last_mut() {
            Some(run) if run.y == y && run.end == x => run.end = x + 1,
            _ => self.runs.push(PixelRun {
                y,
                start: x,
                end: x + 1,
                pixel: index,
                region: NO_REGION,
            }),
        }
        self.pixels.push(pixel);
        [index, self.runs.len() as u32 - 1]
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

    /// Indices of the pixels of a region, in reading order.
    pub fn pixels_of_region(&self, region: usize) -> impl Iterator<Item = usize> + '_ {
        let runs = self.region_starts[region] as usize..self.region_starts[region + 1] as usize;
        let runs = &self.runs_by_region[runs];
        runs.iter()
            .flat_map(|&run| self.runs[run as usize].pixels())
    }

    /// Measures each region.
    pub fn measure_regions(&self, regions: &mut Vec<Region>) {
        regions.clear();
        for region in 0..self.region_starts.len() - 1 {
            let pixels = self.pixels_of_region(region).map(|i| self.pixels[i]);
            regions.push(Region::of_points(
                pixels.map(|p| (f64::from(p.x), f64::from(p.y), f64::from(p.snr))),
            ));
        }
    }

    /// Calls `visit` with each two adjacent pixels of the regions that are wanted, the later in
    /// reading order first.
    ///
    /// # Errors
    /// [`Interrupted`] of work on `view`.
    pub fn for_each_adjacent(
        &self,
        view: &View<'_>,
        is_wanted: impl Fn(usize) -> bool,
        mut visit: impl FnMut(usize, usize),
    ) -> Result<(), Interrupted> {
        let mut touching = TouchingRuns::default();
        for (index, run) in self.runs.iter().enumerate() {
            if index % RUNS_AT_ONCE == 0 {
                view.check()?;
            }
            if !is_wanted(run.region as usize) {
                continue;
            }
            for pixel in run.pixels().skip(1) {
                visit(pixel, pixel - 1);
            }
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
                labelling.add(BrightPixel { x, y, snr: 9.0 });
            }
        }
        labelling.connect();
        let mut labels = vec![0; mask.len()];
        for region in 0..labelling.region_starts.len() - 1 {
            for index in labelling.pixels_of_region(region) {
                let BrightPixel { x, y, .. } = labelling.pixels[index];
                labels[(y * mask.width() + x) as usize] = region as u32 + 1;
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
