//! Connected-component labelling of the pixels above the threshold: 8-connected regions.
//!
//! Pixels are collected in reading order as runs of adjacent columns; touching runs of consecutive
//! rows are joined by union-find.

use super::disjoint_sets::{self, join, root_of};
use super::region::Region;
use std::ops::Range;

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
}

/// Placeholder for a region that is not known yet.
const NO_REGION: u32 = u32::MAX;

/// Pixels above the threshold and the regions that they form.
#[derive(Debug, Clone, Default)]
pub(super) struct Labelling {
    /// In reading order.
    pub pixels: Vec<BrightPixel>,
    /// Index of the first pixel of each row, and the number of pixels.
    row_starts: Vec<usize>,
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
        self.row_starts.clear();
        self.runs.clear();
    }

    /// Goes on to row `y`; whether that row is new.
    pub fn begin_row(&mut self, y: usize) -> bool {
        let is_new = self.row_starts.len() <= y;
        if is_new {
            self.row_starts.resize(y + 1, self.pixels.len());
        }
        is_new
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

    /// Ends the frame of `height` rows, and joins touching runs into regions, numbered in reading
    /// order.
    pub fn connect(&mut self, height: usize) {
        self.row_starts.resize(height + 1, self.pixels.len());
        self.join_touching_runs();
        self.number_regions();
        self.sort_runs_by_region();
    }

    fn join_touching_runs(&mut self) {
        let Self { runs, parents, .. } = self;
        disjoint_sets::reset(parents, runs.len());
        // The first run that may still touch a run of this row or a later one.
        let mut first = 0;
        for index in 0..runs.len() {
            let run = runs[index];
            while runs[first].y + 1 < run.y
                || (runs[first].y < run.y && runs[first].end < run.start)
            {
                first += 1;
            }
            let touching =
                (first..index).take_while(|&i| runs[i].y < run.y && runs[i].start <= run.end);
            for other in touching {
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

    /// The neighbours of pixel `index` that lie above the threshold.
    pub fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> + '_ {
        let BrightPixel { x, y, .. } = self.pixels[index];
        let rows = (y as usize).saturating_sub(1)..=y as usize + 1;
        rows.flat_map(move |row| self.in_row(row, x.saturating_sub(1), x + 1))
            .filter(move |&other| other != index)
    }

    /// Indices of the pixels of row `y` with columns in `from..=to`.
    fn in_row(&self, y: usize, from: u32, to: u32) -> Range<usize> {
        let (Some(&start), Some(&end)) = (self.row_starts.get(y), self.row_starts.get(y + 1))
        else {
            return 0..0;
        };
        let row = &self.pixels[start..end];
        let low = row.partition_point(|p| p.x < from);
        let high = low + row[low..].iter().take_while(|p| p.x <= to).count();
        start + low..start + high
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
            labelling.begin_row(y as usize);
            if pixel.0 != [0] {
                labelling.add(BrightPixel { x, y, snr: 9.0 });
            }
        }
        labelling.connect(mask.height() as usize);
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
