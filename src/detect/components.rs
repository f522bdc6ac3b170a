//! Connected regions above the threshold, and the peaks in them.
//!
//! filtered frame, its mean and noise → [`Peak`]s, strongest first, and the [`Region`]s they lie in.
//!
//! 1. Pixels above the threshold, in units of the local noise of the filtered frame.
//! 2. Regions of 8-connected pixels.
//! 3. Local maxima, each with its prominence: its height above the highest saddle towards a higher
//!    maximum of the region.
//! 4. Maxima that noise or the flank of a brighter star can explain are dropped.
//!
//! # Reference
//! Edelsbrunner, Letscher & Zomorodian 2002, doi 10.1007/s00454-002-2885-2, for prominence as persistence.

use super::background::Mesh;
use super::matched_filter::{BLOCK_PX, Filtered};
use super::view::View;

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
const MIN_STREAK_DASHES: usize = 5;
/// The scatter of the dashes across the line, over the spot's width, at most.
const STREAK_BREADTH_SIGMA: f64 = 1.2;
/// The length of a dashed streak over its breadth, as standard deviations.
const STREAK_DASHED: f64 = 8.0;

/// A pixel above the threshold.
#[derive(Debug, Clone, Copy)]
struct Pixel {
    x: u32,
    y: u32,
    /// Filtered value over its local noise.
    snr: f32,
}

/// A local maximum of the filtered frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Peak {
    /// Column.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// Top of the parabola through the filtered values: columns and rows beyond the pixel's centre.
    pub offset_px: [f32; 2],
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
pub(super) struct Region {
    /// Number of pixels.
    pub area_px: usize,
    /// Number of peaks kept.
    pub peaks: usize,
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
pub(super) struct SearchConfig {
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
pub(super) struct Search {
    pixels: Vec<Pixel>,
    /// Index in `pixels` of the first of each row, and the end.
    row_starts: Vec<usize>,
    parents: Vec<u32>,
    /// Rank by height of each of `pixels` within its region, where it was needed.
    ranks: Vec<u32>,
    /// Index of the peak at each of `pixels`; `u32::MAX` where there is none.
    peak_at: Vec<u32>,
    /// Peaks, strongest first.
    pub peaks: Vec<Peak>,
    /// All regions.
    pub regions: Vec<Region>,
}

impl Search {
    /// Finds regions and peaks in `filtered`, whose mean and noise are in `mesh`.
    pub fn run(
        &mut self,
        filtered: &Filtered,
        mesh: &Mesh,
        frame: &View<'_>,
        config: &SearchConfig,
    ) {
        self.collect(filtered, mesh, config);
        self.connect();
        self.measure_regions_and_peaks(&filtered.view(), frame, config);
        self.drop_unfounded_peaks(config);
        self.count_peaks();
        let before = self.peaks.len();
        let regions = &self.regions;
        let mut seen = std::collections::HashSet::new();
        // Strongest first: of a streak's many maxima only the first stays.
        self.peaks
            .retain(|p| !regions[p.region].is_streak(config) || seen.insert(p.region));
        if self.peaks.len() < before {
            self.count_peaks();
        }
        self.join_dashes(config);
    }

    /// Joins the dashes of faint streaks: chains of peaks in a straight line become one region with one peak.
    fn join_dashes(&mut self, config: &SearchConfig) {
        let link_px = STREAK_LINK_SIGMA * config.spot_width_px + STREAK_LINK_PX;
        for chain in chains(&self.peaks, link_px) {
            let mut streak = line_through(&chain, &self.peaks);
            streak.area_px = chain
                .iter()
                .map(|&i| self.regions[self.peaks[i].region].area_px)
                .sum();
            let is_straight =
                streak.minor_px < STREAK_BREADTH_SIGMA * f64::from(config.spot_width_px);
            if chain.len() < MIN_STREAK_DASHES
                || !is_straight
                || streak.major_px < STREAK_DASHED * streak.minor_px
            {
                continue;
            }
            streak.peaks = 1;
            // Peaks come strongest first.
            self.peaks[chain[0]].region = self.regions.len();
            for &other in &chain[1..] {
                self.peaks[other].snr = f32::NAN;
            }
            self.regions.push(streak);
        }
        self.peaks.retain(|p| !p.snr.is_nan());
    }

    fn count_peaks(&mut self) {
        for region in &mut self.regions {
            region.peaks = 0;
        }
        for peak in &self.peaks {
            self.regions[peak.region].peaks += 1;
        }
    }

    /// Gathers the pixels above the threshold, row by row.
    fn collect(&mut self, filtered: &Filtered, mesh: &Mesh, config: &SearchConfig) {
        self.pixels.clear();
        self.row_starts.clear();
        let view = filtered.view();
        let lowest = mesh
            .level
            .iter()
            .zip(&mesh.spread)
            .map(|(level, spread)| level + config.threshold * spread)
            .fold(f32::INFINITY, f32::min);
        // Levels are extrapolated at the borders, by at most half a step between cells.
        let slack = mesh.level.iter().copied().fold(f32::NEG_INFINITY, f32::max)
            - mesh.level.iter().copied().fold(f32::INFINITY, f32::min);
        let lowest = lowest - slack;
        for y in 0..view.height {
            self.row_starts.push(self.pixels.len());
            let row = view.row(y);
            for (block, &maximum) in filtered.block_maxima(y).iter().enumerate() {
                if maximum < lowest {
                    continue;
                }
                let start = block * BLOCK_PX;
                let end = (start + BLOCK_PX).min(view.width);
                for x in candidates(&row[start..end], start, lowest) {
                    let value = row[x];
                    let (level, spread) = mesh.at(x as f32, y as f32);
                    let snr = (value - level) / spread;
                    if snr >= config.threshold {
                        self.pixels.push(Pixel {
                            x: x as u32,
                            y: y as u32,
                            snr,
                        });
                    }
                }
            }
        }
        self.row_starts.push(self.pixels.len());
    }

    /// The pixels of row `y` with columns in `from..=to`, as a range of indices.
    fn in_row(&self, y: usize, from: u32, to: u32) -> std::ops::Range<usize> {
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

    /// Joins neighbouring pixels into regions.
    fn connect(&mut self) {
        let mut parents = std::mem::take(&mut self.parents);
        parents.clear();
        parents.extend(0..self.pixels.len() as u32);
        for index in 0..self.pixels.len() {
            let Pixel { x, y, .. } = self.pixels[index];
            if index > 0 && self.pixels[index - 1].y == y && self.pixels[index - 1].x + 1 == x {
                join(&mut parents, index as u32, index as u32 - 1);
            }
            if y > 0 {
                for other in self.in_row(y as usize - 1, x.saturating_sub(1), x + 1) {
                    join(&mut parents, index as u32, other as u32);
                }
            }
        }
        self.parents = parents;
    }

    /// Measures each region and finds its maxima.
    fn measure_regions_and_peaks(
        &mut self,
        view: &View<'_>,
        frame: &View<'_>,
        config: &SearchConfig,
    ) {
        self.regions.clear();
        self.peaks.clear();
        self.ranks.resize(self.pixels.len(), 0);
        self.peak_at.clear();
        self.peak_at.resize(self.pixels.len(), u32::MAX);
        let mut parents = std::mem::take(&mut self.parents);
        // The root is the first pixel of its region: regions are numbered in reading order.
        let mut region_of = vec![0; parents.len()];
        let mut ends: Vec<usize> = Vec::new();
        for index in 0..parents.len() {
            let root = root_of(&mut parents, index as u32) as usize;
            if root == index {
                region_of[index] = ends.len();
                ends.push(0);
            } else {
                region_of[index] = region_of[root];
            }
            ends[region_of[index]] += 1;
        }
        self.parents = parents;
        // Pixels sorted by region, by counting: where each region's next pixel goes, its end at last.
        let mut start = 0;
        for end in &mut ends {
            start += std::mem::replace(end, start);
        }
        let mut sorted = vec![0; region_of.len()];
        for (index, &region) in region_of.iter().enumerate() {
            sorted[ends[region]] = index;
            ends[region] += 1;
        }
        let mut rest = sorted.as_mut_slice();
        let mut start = 0;
        for (region, &end) in ends.iter().enumerate() {
            let (members, others) = rest.split_at_mut(end - start);
            (rest, start) = (others, end);
            self.regions.push(self.measure(members));
            let first = self.peaks.len();
            for &index in members.iter() {
                let Pixel { x, y, snr } = self.pixels[index];
                let (x, y) = (x as usize, y as usize);
                if is_local_maximum(view, x, y) {
                    self.peak_at[index] = self.peaks.len() as u32;
                    self.peaks.push(Peak {
                        x,
                        y,
                        offset_px: parabola_top(view, x, y),
                        snr,
                        prominence: snr,
                        region,
                        saturated: is_saturated(frame, x, y, config),
                    });
                }
            }
            if self.peaks.len() - first > 1 {
                self.find_prominences(members);
            }
        }
    }

    /// Area, centre and principal axes of a region.
    fn measure(&self, members: &[usize]) -> Region {
        let pixels = members.iter().map(|&index| &self.pixels[index]);
        Region::of_points(pixels.map(|p| (f64::from(p.x), f64::from(p.y), f64::from(p.snr))))
    }

    /// Sets the prominences of a region's peaks: floods the region from the top down; where
    /// two floods meet, the lower peak has its saddle.
    fn find_prominences(&mut self, members: &mut [usize]) {
        members.sort_unstable_by(|&a, &b| {
            self.pixels[b]
                .snr
                .total_cmp(&self.pixels[a].snr)
                .then(a.cmp(&b))
        });
        let mut ranks = std::mem::take(&mut self.ranks);
        let mut peaks = std::mem::take(&mut self.peaks);
        for (r, &index) in members.iter().enumerate() {
            ranks[index] = r as u32;
        }
        // Roots are the highest pixel of a flood, since `join` keeps the lower number: the rank.
        let mut floods: Vec<u32> = (0..members.len() as u32).collect();
        for (r, &index) in members.iter().enumerate() {
            let snr = self.pixels[index].snr;
            let higher = self.neighbours(index).map(|other| ranks[other]);
            for other in higher.filter(|&other| (other as usize) < r) {
                let (a, b) = (root_of(&mut floods, r as u32), root_of(&mut floods, other));
                if a != b {
                    let lower = members[a.max(b) as usize];
                    if let Some(peak) = peaks.get_mut(self.peak_at[lower] as usize) {
                        peak.prominence = self.pixels[lower].snr - snr;
                    }
                    join(&mut floods, a, b);
                }
            }
        }
        self.peaks = peaks;
        self.ranks = ranks;
    }

    /// Keeps the peaks that neither noise on a flank nor the wing of a brighter star explains.
    fn drop_unfounded_peaks(&mut self, config: &SearchConfig) {
        self.peaks
            .sort_by(|a, b| b.snr.total_cmp(&a.snr).then((a.y, a.x).cmp(&(b.y, b.x))));
        let mut kept: Vec<Peak> = Vec::new();
        let cell = |p: &Peak| (p.x / WING_REACH_PX, p.y / WING_REACH_PX);
        let cells = self.peaks.iter().map(cell);
        let (across, down) = cells.fold((1, 1), |(w, h), (x, y)| (w.max(x + 1), h.max(y + 1)));
        let mut grid: Vec<Vec<usize>> = vec![Vec::new(); across * down];
        for peak in &self.peaks {
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
            let span = cx.saturating_sub(1)..(cx + 2).min(across);
            let brighter = (cy.saturating_sub(1)..(cy + 2).min(down))
                .flat_map(|gy| &grid[gy * across + span.start..gy * across + span.end])
                .flatten();
            let wings: f32 = brighter
                .map(|&other| wing_of(&kept[other], peak, config))
                .sum();
            if peak.snr < config.threshold + wings {
                continue;
            }
            // Only bright stars have wings that can matter.
            if peak.snr * WING_HEIGHT > 0.1 {
                grid[cy * across + cx].push(kept.len());
            }
            kept.push(*peak);
            if kept.len() >= config.max_peaks {
                break;
            }
        }
        self.peaks = kept;
    }
}

/// Columns of the values that reach `lowest`; the first value is in column `start`.
fn candidates(values: &[f32], start: usize, lowest: f32) -> impl Iterator<Item = usize> + '_ {
    /// Values compared together: most hold none.
    const GROUP: usize = 16;
    let groups = values.chunks(GROUP).enumerate();
    groups
        .filter(move |(_, group)| group.iter().fold(false, |any, &v| any | (v >= lowest)))
        .flat_map(move |(g, group)| {
            let columns = (start + g * GROUP..).zip(group);
            columns.filter_map(move |(x, &v)| (v >= lowest).then_some(x))
        })
}

/// Groups of at least two peaks, each within `link_px` of another; indices ascending.
fn chains(peaks: &[Peak], link_px: f32) -> Vec<Vec<usize>> {
    let mut by_row: Vec<u32> = (0..peaks.len() as u32).collect();
    by_row.sort_unstable_by_key(|&i| peaks[i as usize].y);
    let mut parents: Vec<u32> = (0..peaks.len() as u32).collect();
    for (rank, &index) in by_row.iter().enumerate() {
        let peak = &peaks[index as usize];
        for &other in &by_row[rank + 1..] {
            let dx = peaks[other as usize].x as f32 - peak.x as f32;
            let dy = peaks[other as usize].y as f32 - peak.y as f32;
            if dy > link_px {
                break;
            }
            if dx * dx + dy * dy <= link_px * link_px {
                join(&mut parents, index, other);
            }
        }
    }
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); peaks.len()];
    for index in 0..peaks.len() {
        let root = root_of(&mut parents, index as u32) as usize;
        groups[root].push(index);
    }
    groups.retain(|group| group.len() > 1);
    groups
}

/// Centre and principal axes of some peaks, all with the same weight.
fn line_through(chain: &[usize], peaks: &[Peak]) -> Region {
    let weighted = chain
        .iter()
        .map(|&i| (peaks[i].x as f64, peaks[i].y as f64, 1.0));
    Region::of_points(weighted)
}

/// How high the wing of `bright` may stand at `peak`, in units of the noise.
fn wing_of(bright: &Peak, peak: &Peak, config: &SearchConfig) -> f32 {
    let dx = bright.x as f32 - peak.x as f32;
    let dy = bright.y as f32 - peak.y as f32;
    let distance = (dx * dx + dy * dy).sqrt() / (4.0 * config.spot_width_px);
    let height = bright.snr * if bright.saturated { 3.0 } else { 1.0 };
    WING_HEIGHT * height / (1.0 + distance.powi(3))
}

/// Whether no neighbour is higher; of equal ones the first in reading order counts.
fn is_local_maximum(view: &View<'_>, x: usize, y: usize) -> bool {
    let value = view.at(x, y);
    let columns = x.saturating_sub(1)..(x + 2).min(view.width);
    (y.saturating_sub(1)..(y + 2).min(view.height)).all(|r| {
        let row = &view.row(r)[columns.clone()];
        row.iter()
            .zip(columns.clone())
            .all(|(&other, c)| other < value || (other == value && (r, c) >= (y, x)))
    })
}

/// Where the parabolas through a maximum and its neighbours have their tops, from its centre, in pixels.
fn parabola_top(view: &View<'_>, x: usize, y: usize) -> [f32; 2] {
    /// Half a pixel, less what could round to the next.
    const FARTHEST_PX: f32 = 0.49;
    if x == 0 || y == 0 || x + 1 >= view.width || y + 1 >= view.height {
        return [0.0; 2];
    }
    let top = |before: f32, after: f32| {
        let curvature = 2.0 * view.at(x, y) - before - after;
        let offset = 0.5 * (after - before) / curvature;
        if curvature > 0.0 {
            offset.clamp(-FARTHEST_PX, FARTHEST_PX)
        } else {
            0.0
        }
    };
    [
        top(view.at(x - 1, y), view.at(x + 1, y)),
        top(view.at(x, y - 1), view.at(x, y + 1)),
    ]
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
