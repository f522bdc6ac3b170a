//! Connected regions above the threshold, and the peaks in them.
//!
//! filtered bands, their mean and noise → [`Peak`]s, strongest first, and the [`Region`]s they lie in.
//!
//! 1. Pixels above the threshold, in units of the local noise of the filtered frame, out of the [`Candidates`]
//!    of each band: those above a lower one, for while the bands are made the noise is not yet known everywhere.
//! 2. Regions of 8-connected pixels.
//! 3. Local maxima, each with its prominence: its height above the highest saddle towards a higher
//!    maximum of the region.
//! 4. Maxima that noise or the flank of a brighter star can explain are dropped.
//!
//! # Reference
//! Edelsbrunner, Letscher & Zomorodian 2002, doi 10.1007/s00454-002-2885-2, for prominence as persistence.

use crate::detect::background::Mesh;
use crate::detect::filter::Band;
use crate::detect::pixels::{Reached, View, find_reaching};
use std::ops::Range;

/// A maximum must stand this many noise standard deviations above its saddle to count by itself.
const MIN_PROMINENCE: f32 = 3.0;
/// And this part of its own height: shot noise and imperfect spots scale with it.
const MIN_RELATIVE_PROMINENCE: f32 = 0.03;
/// The same where the core is saturated: its plateau is no spot.
const MIN_SATURATED_PROMINENCE: f32 = 0.3;
/// Height of a real spot's wing four standard deviations out, over its peak, beyond a Gaussian.
/// Moffat profiles with β = 2.5 to 4 have 0.5 to 2 % there.
const WING_HEIGHT: f32 = 0.02;
/// Wings are considered out to this many pixels.
const WING_REACH_PX: usize = 64;

/// A streak has at least so many maxima.
const MIN_STREAK_PEAKS: usize = 4;
/// A streak's longer principal axis over the shorter.
const STREAK_ELONGATION: f64 = 4.0;
/// A streak's longer principal axis over the spot's width.
const STREAK_LENGTH_SIGMA: f32 = 5.0;

/// Dashes of a streak lie within this many spot widths, and some pixels, of each other.
const STREAK_LINK_SIGMA: f32 = 4.0;
/// The pixels.
const STREAK_LINK_PX: f32 = 5.0;
/// So many dashes in a line are no chance.
const MIN_STREAK_DASHES: u32 = 5;
/// The scatter of the dashes across the line, over the spot's width, at most.
const STREAK_BREADTH_SIGMA: f64 = 1.2;
/// The length of a dashed streak over its breadth, as standard deviations.
const STREAK_DASHED: f64 = 8.0;

/// What a row of cells holds that may lie above the threshold.
#[derive(Debug, Clone, Default)]
pub(crate) struct Candidates {
    /// All pixels of the filtered frame from `cut` on, in reading order.
    pixels: Vec<Candidate>,
    /// The local maxima among them, in reading order.
    tops: Vec<Top>,
    /// In units of the background noise.
    cut: f32,
    /// The cut for each block of columns, and the blocks of a row that reach it.
    levels: Vec<f32>,
    blocks: Vec<Reached>,
}

/// A pixel of the filtered frame.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    x: u32,
    y: u32,
    value: f32,
}

/// A local maximum of the filtered frame.
#[derive(Debug, Clone, Copy)]
struct Top {
    /// Its index among the pixels.
    pixel: u32,
    /// The values to the left, to the right, above and below; `None` at the border.
    around: Option<[f32; 4]>,
}

impl Candidates {
    /// Gathers the pixels from `cut` on in `rows` of `band`, which has a row more on either side within the frame; and
    /// the `maxima` of the blocks that hold any, row by row.
    pub fn gather(&mut self, band: &Band, rows: Range<usize>, cut: f32, maxima: &mut [f32]) {
        self.pixels.clear();
        self.tops.clear();
        self.cut = cut;
        let blocks_per_row = maxima.len() / rows.len().max(1);
        self.levels.clear();
        self.levels.resize(blocks_per_row, cut);
        for (y, maxima) in rows.zip(maxima.chunks_mut(blocks_per_row)) {
            let Some(row) = band.row(y) else { continue };
            let around = [y.checked_sub(1).and_then(|y| band.row(y)), band.row(y + 1)];
            find_reaching(row, &self.levels, &mut self.blocks);
            for block in &self.blocks {
                let highest = &mut maxima[block.block];
                for x in block.columns() {
                    *highest = highest.max(row[x]);
                    if is_local_maximum(row, around, x) {
                        self.tops.push(Top {
                            pixel: self.pixels.len() as u32,
                            around: next_to(row, around, x),
                        });
                    }
                    self.pixels.push(Candidate {
                        x: x as u32,
                        y: y as u32,
                        value: row[x],
                    });
                }
            }
        }
    }

    /// Whether all pixels from `lowest` on are among them.
    pub fn reach_down_to(&self, lowest: f32) -> bool {
        self.cut <= lowest
    }
}

/// Whether no neighbour in the row or in those above and below is higher; of equal ones the first in reading order counts.
fn is_local_maximum(row: &[f32], [above, below]: [Option<&[f32]>; 2], x: usize) -> bool {
    let value = row[x];
    let columns = x.saturating_sub(1)..(x + 2).min(row.len());
    // All of them are looked at: a branch for each would cost more.
    let are_lower = |values: &[f32]| values.iter().fold(true, |all, v| all & (*v < value));
    let are_no_higher = |values: &[f32]| values.iter().fold(true, |all, v| all & (*v <= value));
    are_lower(&row[columns.start..x])
        & are_no_higher(&row[x..columns.end])
        & above.is_none_or(|row| are_lower(&row[columns.clone()]))
        & below.is_none_or(|row| are_no_higher(&row[columns.clone()]))
}

/// The values to the left, to the right, above and below; `None` at the border.
fn next_to(row: &[f32], [above, below]: [Option<&[f32]>; 2], x: usize) -> Option<[f32; 4]> {
    let inside = x > 0 && x + 1 < row.len();
    inside.then_some([
        row[x.max(1) - 1],
        row[(x + 1).min(row.len() - 1)],
        above?[x],
        below?[x],
    ])
}

/// A pixel above the threshold.
#[derive(Debug, Clone, Copy)]
struct Pixel {
    x: u32,
    y: u32,
    /// Filtered value over its local noise.
    snr: f32,
}

/// Neighbouring pixels of a row.
#[derive(Debug, Clone, Copy)]
struct Run {
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

/// A local maximum of the filtered frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Peak {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// Top of the parabola through the filtered values: columns and rows beyond the pixel's centre.
    pub offset_px: [f32; 2],
    /// The filtered value, and those to the left, to the right, above and below; `None` at the border.
    pub values: Option<(f32, [f32; 4])>,
    /// Filtered value over its local noise.
    pub snr: f32,
    /// Height above the highest saddle towards a higher maximum of its region, in the same unit.
    pub prominence: f32,
    /// Index of its region.
    pub region: usize,
    /// Whether the spot's core reaches full scale.
    pub saturated: bool,
}

/// A connected region above the threshold.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Region {
    /// Number of pixels.
    pub area_px: usize,
    /// Number of peaks kept.
    pub peaks: usize,
    /// Whether one of its peaks stands for a streak.
    stands_for_streak: bool,
    /// Centre, weighted with the filtered values.
    pub x: f64,
    /// Centre, weighted with the filtered values.
    pub y: f64,
    /// Standard deviation along the longer principal axis, in pixels.
    pub major_px: f64,
    /// Standard deviation along the shorter principal axis, in pixels.
    pub minor_px: f64,
}

impl Region {
    /// Number, centre and principal axes of points (x, y, weight).
    fn of_points(points: impl Iterator<Item = (f64, f64, f64)>) -> Self {
        let mut sums = [0.0f64; 6];
        let mut origin = None;
        let mut count = 0;
        for (x, y, w) in points {
            let (x0, y0) = *origin.get_or_insert((x, y));
            let (x, y) = (x - x0, y - y0);
            count += 1;
            for (sum, term) in sums.iter_mut().zip([1.0, x, y, x * x, y * y, x * y]) {
                *sum += w * term;
            }
        }
        let [w, x, y, xx, yy, xy] = sums;
        let (x0, y0) = origin.unwrap_or_default();
        let (x, y) = (x / w, y / w);
        let (xx, yy, xy) = (xx / w - x * x, yy / w - y * y, xy / w - x * y);
        let middle = 0.5 * (xx + yy);
        let half_range = (0.5 * (xx - yy)).hypot(xy);
        // A pixel has a width of its own.
        let own = 1.0 / 12.0;
        Self {
            area_px: count,
            peaks: 0,
            stands_for_streak: false,
            x: x + x0,
            y: y + y0,
            major_px: (middle + half_range + own).sqrt(),
            minor_px: (middle - half_range + own).max(own).sqrt(),
        }
    }

    /// Whether the region is one long streak with many maxima, and not a handful of stars in a row.
    fn is_streak(&self, config: &SearchConfig) -> bool {
        self.peaks >= MIN_STREAK_PEAKS
            && self.major_px > STREAK_ELONGATION * self.minor_px
            && self.major_px > f64::from(STREAK_LENGTH_SIGMA * config.spot_width_px)
    }
}

/// What the search needs to know.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SearchConfig {
    /// Threshold in units of the local noise.
    pub threshold: f32,
    /// The spot's standard deviation, pixel included, in pixels.
    pub spot_width_px: f32,
    /// Level from which on a pixel is saturated, in ADU.
    pub saturation_adu: f32,
    /// The most peaks to keep.
    pub max_peaks: usize,
}

/// Buffers of the search, and its result.
#[derive(Debug, Clone, Default)]
pub(crate) struct Search {
    pixels: Vec<Pixel>,
    /// Index in `pixels` of the first of each row, and the end.
    row_starts: Vec<usize>,
    runs: Vec<Run>,
    parents: Vec<u32>,
    /// Where the runs of each region start in `by_region`, and the end.
    region_starts: Vec<u32>,
    /// The runs, region by region.
    by_region: Vec<u32>,
    /// The pixels of one region, and their floods.
    members: Vec<u32>,
    floods: Vec<u32>,
    /// Rank by height of each of `pixels` within its region, where it was needed.
    ranks: Vec<u32>,
    /// The pixel and the run of each peak while they are in reading order.
    peak_pixels: Vec<[u32; 2]>,
    /// The peaks' heights, inverted, and their indices: strongest first.
    by_height: Vec<u64>,
    kept: Vec<Peak>,
    /// The last of the kept peaks in each cell of a grid, and for each the one before it there; and how high they are together.
    last_in_cell: Vec<u32>,
    height_in_cell: Vec<f32>,
    before_in_cell: Vec<u32>,
    by_row: Vec<u32>,
    nodes: Vec<[f32; 2]>,
    /// Peaks, strongest first.
    pub peaks: Vec<Peak>,
    /// All regions.
    pub regions: Vec<Region>,
}

/// No index.
const NONE: u32 = u32::MAX;

impl Search {
    /// Finds regions and peaks in the candidates of all bands of the filtered frame, whose mean and noise are in `mesh`.
    pub fn run(
        &mut self,
        bands: &[Candidates],
        mesh: &Mesh,
        frame: &View<'_>,
        config: &SearchConfig,
    ) {
        self.collect(bands, mesh, frame, config);
        self.connect();
        self.measure_regions();
        self.find_all_prominences();
        self.drop_unfounded_peaks(config);
        self.count_peaks();
        let before = self.peaks.len();
        let regions = &mut self.regions;
        // Strongest first: of a streak's many maxima only the first stays.
        self.peaks.retain(|p| {
            let region = &mut regions[p.region];
            !region.is_streak(config) || !std::mem::replace(&mut region.stands_for_streak, true)
        });
        if self.peaks.len() < before {
            self.count_peaks();
        }
        self.join_dashes(config);
    }

    /// Joins the dashes of faint streaks: chains of peaks in a straight line become one region with one peak.
    fn join_dashes(&mut self, config: &SearchConfig) {
        let link_px = STREAK_LINK_SIGMA * config.spot_width_px + STREAK_LINK_PX;
        self.link_peaks(link_px);
        for chain in self
            .by_row
            .chunk_by(|&a, &b| self.parents[a as usize] == self.parents[b as usize])
        {
            let mut streak = line_through(chain, &self.peaks);
            streak.area_px = chain
                .iter()
                .map(|&i| self.regions[self.peaks[i as usize].region].area_px)
                .sum();
            let is_straight =
                streak.minor_px < STREAK_BREADTH_SIGMA * f64::from(config.spot_width_px);
            if !is_straight || streak.major_px < STREAK_DASHED * streak.minor_px {
                continue;
            }
            streak.peaks = 1;
            // Peaks come strongest first.
            self.peaks[chain[0] as usize].region = self.regions.len();
            for &other in &chain[1..] {
                self.peaks[other as usize].snr = f32::NAN;
            }
            self.regions.push(streak);
        }
        self.peaks.retain(|p| !p.snr.is_nan());
    }

    /// Groups of at least [`MIN_STREAK_DASHES`] peaks, each within `link_px` of another: in `by_row` one group after the
    /// other, indices ascending, and in `parents` the group of each.
    fn link_peaks(&mut self, link_px: f32) {
        let Self {
            peaks,
            by_row,
            parents,
            ..
        } = self;
        by_row.clear();
        by_row.extend(0..peaks.len() as u32);
        by_row.sort_unstable_by_key(|&i| (peaks[i as usize].y, i));
        parents.clear();
        parents.extend(0..peaks.len() as u32);
        for (rank, &index) in by_row.iter().enumerate() {
            let peak = &peaks[index as usize];
            for &other in &by_row[rank + 1..] {
                let dx = peaks[other as usize].x as f32 - peak.x as f32;
                let dy = peaks[other as usize].y as f32 - peak.y as f32;
                if dy > link_px {
                    break;
                }
                if dx * dx + dy * dy <= link_px * link_px {
                    join(parents, index, other);
                }
            }
        }
        let sizes = &mut self.ranks;
        sizes.clear();
        sizes.resize(peaks.len(), 0);
        for index in 0..peaks.len() as u32 {
            let root = root_of(parents, index);
            parents[index as usize] = root;
            sizes[root as usize] += 1;
        }
        by_row.retain(|&i| sizes[parents[i as usize] as usize] >= MIN_STREAK_DASHES);
        by_row.sort_unstable_by_key(|&i| (parents[i as usize], i));
    }

    fn count_peaks(&mut self) {
        for region in &mut self.regions {
            region.peaks = 0;
        }
        for peak in &self.peaks {
            self.regions[peak.region].peaks += 1;
        }
    }

    /// Gathers the pixels above the threshold, in runs, and the maxima among them.
    fn collect(
        &mut self,
        bands: &[Candidates],
        mesh: &Mesh,
        frame: &View<'_>,
        config: &SearchConfig,
    ) {
        self.pixels.clear();
        self.row_starts.clear();
        self.runs.clear();
        self.peaks.clear();
        self.peak_pixels.clear();
        for band in bands {
            let mut tops = band.tops.iter().peekable();
            for (index, candidate) in (0..).zip(&band.pixels) {
                let top = tops.next_if(|top| top.pixel == index);
                let Candidate { x, y, value } = *candidate;
                if self.row_starts.len() <= y as usize {
                    self.row_starts.resize(y as usize + 1, self.pixels.len());
                    mesh.across_row(y as usize, &mut self.nodes);
                }
                let (level, spread) = mesh.at_column(&self.nodes, x as f32);
                let snr = (value - level) / spread;
                if snr >= config.threshold {
                    self.add_pixel(Pixel { x, y, snr });
                    if let Some(top) = top {
                        self.add_peak(
                            value,
                            top,
                            is_saturated(frame, x as usize, y as usize, config),
                        );
                    }
                }
            }
        }
        self.row_starts.resize(frame.height + 1, self.pixels.len());
    }

    /// Adds a pixel, to the run of the one before it if it is next to that.
    fn add_pixel(&mut self, pixel: Pixel) {
        let Pixel { x, y, .. } = pixel;
        match self.runs.last_mut() {
            Some(run) if run.y == y && run.end == x => run.end = x + 1,
            _ => self.runs.push(Run {
                y,
                start: x,
                end: x + 1,
                pixel: self.pixels.len() as u32,
                region: NONE,
            }),
        }
        self.pixels.push(pixel);
    }

    /// Adds the last pixel as a peak; its region is not known yet.
    fn add_peak(&mut self, value: f32, top: &Top, saturated: bool) {
        let Some(&Pixel { x, y, snr }) = self.pixels.last() else {
            return;
        };
        let last = |count: usize| count as u32 - 1;
        self.peak_pixels
            .push([last(self.pixels.len()), last(self.runs.len())]);
        self.peaks.push(Peak {
            x: x as usize,
            y: y as usize,
            offset_px: top
                .around
                .map_or([0.0; 2], |around| parabola_top(value, around)),
            values: top.around.map(|around| (value, around)),
            snr,
            prominence: snr,
            region: 0,
            saturated,
        });
    }

    /// The pixels of row `y` with columns in `from..=to`, as a range of indices.
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

    /// The neighbours of pixel `index` that lie above the threshold.
    fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> + '_ {
        let Pixel { x, y, .. } = self.pixels[index];
        let rows = (y as usize).saturating_sub(1)..=y as usize + 1;
        rows.flat_map(move |row| self.in_row(row, x.saturating_sub(1), x + 1))
            .filter(move |&other| other != index)
    }

    /// Joins touching runs into regions, which are numbered in reading order; sorts the runs by region.
    fn connect(&mut self) {
        let Self { runs, parents, .. } = self;
        parents.clear();
        parents.extend(0..runs.len() as u32);
        // The first run that may still touch one of this row or a later one.
        let mut above = 0;
        for index in 0..runs.len() {
            let run = runs[index];
            while runs[above].y + 1 < run.y
                || (runs[above].y < run.y && runs[above].end < run.start)
            {
                above += 1;
            }
            let touching =
                (above..index).take_while(|&i| runs[i].y < run.y && runs[i].start <= run.end);
            for other in touching {
                join(parents, index as u32, other as u32);
            }
        }
        let starts = &mut self.region_starts;
        starts.clear();
        for index in 0..runs.len() {
            // The root is the first run of its region.
            let root = root_of(parents, index as u32) as usize;
            if root == index {
                runs[index].region = starts.len() as u32;
                starts.push(0);
            } else {
                runs[index].region = runs[root].region;
            }
            starts[runs[index].region as usize] += 1;
        }
        // From counts to ends, which become starts as the runs are put in place from behind.
        let mut end = 0;
        for start in starts.iter_mut() {
            end += *start;
            *start = end;
        }
        self.by_region.resize(runs.len(), 0);
        for (index, run) in runs.iter().enumerate().rev() {
            let start = &mut starts[run.region as usize];
            *start -= 1;
            self.by_region[*start as usize] = index as u32;
        }
        starts.push(runs.len() as u32);
    }

    /// Measures each region, and tells the peaks which they lie in.
    fn measure_regions(&mut self) {
        let Self {
            runs,
            pixels,
            regions,
            ..
        } = self;
        regions.clear();
        for span in self.region_starts.windows(2) {
            let of_region = &self.by_region[span[0] as usize..span[1] as usize];
            let pixels = of_region
                .iter()
                .flat_map(|&run| pixels_of(&runs[run as usize], pixels));
            regions.push(Region::of_points(
                pixels.map(|p| (f64::from(p.x), f64::from(p.y), f64::from(p.snr))),
            ));
        }
        for (peak, [_, run]) in self.peaks.iter_mut().zip(&self.peak_pixels) {
            peak.region = runs[*run as usize].region as usize;
            regions[peak.region].peaks += 1;
        }
    }

    /// Sets the prominences where a region has several peaks.
    fn find_all_prominences(&mut self) {
        self.ranks
            .resize(self.pixels.len().max(self.ranks.len()), 0);
        let mut members = std::mem::take(&mut self.members);
        for region in 0..self.regions.len() {
            if self.regions[region].peaks < 2 {
                continue;
            }
            members.clear();
            let runs = self.region_starts[region] as usize..self.region_starts[region + 1] as usize;
            for &run in &self.by_region[runs] {
                let run = &self.runs[run as usize];
                members.extend(run.pixel..run.pixel + (run.end - run.start));
            }
            self.find_prominences(&mut members);
        }
        self.members = members;
    }

    /// Sets the prominences of a region's peaks: floods the region from the top down; where
    /// two floods meet, the lower peak has its saddle.
    fn find_prominences(&mut self, members: &mut [u32]) {
        members.sort_unstable_by(|&a, &b| {
            let height = |index: u32| self.pixels[index as usize].snr;
            height(b).total_cmp(&height(a)).then(a.cmp(&b))
        });
        let mut ranks = std::mem::take(&mut self.ranks);
        let mut floods = std::mem::take(&mut self.floods);
        let mut peaks = std::mem::take(&mut self.peaks);
        for (r, &index) in members.iter().enumerate() {
            ranks[index as usize] = r as u32;
        }
        // Roots are the highest pixel of a flood, since `join` keeps the lower number: the rank.
        floods.clear();
        floods.extend(0..members.len() as u32);
        for (r, &index) in members.iter().enumerate() {
            let snr = self.pixels[index as usize].snr;
            for other in self.neighbours(index as usize) {
                let other = ranks[other];
                if other as usize >= r {
                    continue;
                }
                let (a, b) = (root_of(&mut floods, r as u32), root_of(&mut floods, other));
                if a != b {
                    let lower = members[a.max(b) as usize];
                    let peak = self
                        .peak_pixels
                        .binary_search_by_key(&lower, |&[pixel, _]| pixel);
                    if let Ok(peak) = peak {
                        peaks[peak].prominence = self.pixels[lower as usize].snr - snr;
                    }
                    join(&mut floods, a, b);
                }
            }
        }
        self.peaks = peaks;
        self.floods = floods;
        self.ranks = ranks;
    }

    /// Keeps the peaks that neither noise on a flank nor the wing of a brighter star explains.
    fn drop_unfounded_peaks(&mut self, config: &SearchConfig) {
        // Of equal ones the first in reading order, in which they are, comes first.
        let keys = (0u64..).zip(&self.peaks);
        self.by_height.clear();
        self.by_height
            .extend(keys.map(|(index, p)| u64::from(!p.snr.to_bits()) << 32 | index));
        self.by_height.sort_unstable();
        let cell = |p: &Peak| (p.x / WING_REACH_PX, p.y / WING_REACH_PX);
        let cells = self.peaks.iter().map(cell);
        let (across, down) = cells.fold((1, 1), |(w, h), (x, y)| (w.max(x + 1), h.max(y + 1)));
        self.kept.clear();
        self.before_in_cell.clear();
        self.last_in_cell.clear();
        self.last_in_cell.resize(across * down, NONE);
        self.height_in_cell.clear();
        self.height_in_cell.resize(across * down, 0.0);
        for &key in &self.by_height {
            let peak = &self.peaks[key as u32 as usize];
            let relative = if peak.saturated {
                MIN_SATURATED_PROMINENCE
            } else {
                MIN_RELATIVE_PROMINENCE
            };
            if peak.prominence < peak.snr
                && peak.prominence < MIN_PROMINENCE.max(relative * peak.snr)
            {
                continue;
            }
            let (cx, cy) = cell(peak);
            let near = (cy.saturating_sub(1)..(cy + 2).min(down)).flat_map(|gy| {
                let columns = cx.saturating_sub(1)..(cx + 2).min(across);
                columns.map(move |gx| gy * across + gx)
            });
            // Most stand out of all wings, wherever these come from.
            let heights: f32 = near.clone().map(|cell| self.height_in_cell[cell]).sum();
            if peak.snr < config.threshold + WING_HEIGHT * heights {
                let mut wings = 0.0;
                for cell in near {
                    let mut other = self.last_in_cell[cell];
                    while let Some(brighter) = self.kept.get(other as usize) {
                        wings += wing_of(brighter, peak, config);
                        other = self.before_in_cell[other as usize];
                    }
                }
                if peak.snr < config.threshold + wings {
                    continue;
                }
            }
            // Only bright stars have wings that can matter.
            let mut before = NONE;
            if peak.snr * WING_HEIGHT > 0.1 {
                let own = cy * across + cx;
                before = std::mem::replace(&mut self.last_in_cell[own], self.kept.len() as u32);
                self.height_in_cell[own] += height_of(peak);
            }
            self.before_in_cell.push(before);
            self.kept.push(*peak);
            if self.kept.len() >= config.max_peaks {
                break;
            }
        }
        std::mem::swap(&mut self.peaks, &mut self.kept);
    }
}

/// The pixels of a run.
fn pixels_of<'a>(run: &Run, pixels: &'a [Pixel]) -> &'a [Pixel] {
    &pixels[run.pixel as usize..][..(run.end - run.start) as usize]
}

/// Centre and principal axes of some peaks, all with the same weight.
fn line_through(chain: &[u32], peaks: &[Peak]) -> Region {
    let members = chain.iter().map(|&i| &peaks[i as usize]);
    Region::of_points(members.map(|p| (p.x as f64, p.y as f64, 1.0)))
}

/// How high the wing of `bright` may stand at `peak`, in units of the noise.
fn wing_of(bright: &Peak, peak: &Peak, config: &SearchConfig) -> f32 {
    let dx = bright.x as f32 - peak.x as f32;
    let dy = bright.y as f32 - peak.y as f32;
    let distance = (dx * dx + dy * dy).sqrt() / (4.0 * config.spot_width_px);
    WING_HEIGHT * height_of(bright) / (1.0 + distance.powi(3))
}

/// How high a peak may be, in units of the noise, whose saturated core tells less.
fn height_of(peak: &Peak) -> f32 {
    peak.snr * if peak.saturated { 3.0 } else { 1.0 }
}

/// Where the parabolas through a maximum and the values next to it have their tops, from its centre, in pixels.
fn parabola_top(value: f32, [left, right, above, below]: [f32; 4]) -> [f32; 2] {
    /// Half a pixel, less what could round to the next.
    const FARTHEST_PX: f32 = 0.49;
    let top = |before: f32, after: f32| {
        let curvature = 2.0 * value - before - after;
        let offset = 0.5 * (after - before) / curvature;
        if curvature > 0.0 {
            offset.clamp(-FARTHEST_PX, FARTHEST_PX)
        } else {
            0.0
        }
    };
    [top(left, right), top(above, below)]
}

/// Whether a pixel within one pixel of (x, y) is saturated.
fn is_saturated(frame: &View<'_>, x: usize, y: usize, config: &SearchConfig) -> bool {
    let columns = x.saturating_sub(1)..(x + 2).min(frame.width);
    (y.saturating_sub(1)..(y + 2).min(frame.height)).any(|r| {
        frame.row(r)[columns.clone()]
            .iter()
            .any(|&p| p >= config.saturation_adu)
    })
}

/// The representative of the set that `index` is in.
fn root_of(parents: &mut [u32], mut index: u32) -> u32 {
    while parents[index as usize] != index {
        let grandparent = parents[parents[index as usize] as usize];
        parents[index as usize] = grandparent;
        index = grandparent;
    }
    index
}

/// Joins two sets; the lower number represents both.
fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root_of(parents, a), root_of(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}
