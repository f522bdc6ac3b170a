//! Local level and spread on a mesh of cells, robust against stars, and interpolated between the cells.
//!
//! The same code maps the background and noise of the frame and, after filtering, the mean and the
//! noise of the filtered frame. Per cell: a mean and standard deviation clipped at [`CLIP_SIGMA`],
//! started from the median and the lower quantile of a few samples (stars are above, not below).
//! Spreads are smoothed by a median of 3x3 cells; levels are replaced by it only where they stick out
//! (beyond the border they go on as a plane does).
//!
//! A row of cells is measured at a time, from its own rows of pixels alone, so that rows of cells can be
//! shared among threads.

use super::medians::{self, LANES, Lanes};
use crate::detect::pixels::{Rows, View};
use multiversion::multiversion;
use std::ops::Range;

/// Deviations beyond this many standard deviations are not counted: keeps 99.7 % of the noise.
const CLIP_SIGMA: f32 = 3.0;
/// The standard deviation of a Gaussian clipped at ±3σ, over σ.
const CLIPPED_SHRINK: f32 = 0.986_58;
/// The part of a wrong spread that is left by a round of clipping at it, for a Gaussian: d ln s/d ln k of the standard
/// deviation s clipped at ±kσ, at k = 3. So a round is carried on to where many would lead.
const LEFT_BY_ROUND: f32 = 0.11;
/// Rounds of clipping; it settles in one to three.
const MAX_CLIP_ROUNDS: usize = 8;
/// Changes of level and spread below these parts of the spread end the clipping of a filtered frame, whose mean is wanted
/// well below its noise.
const SETTLED_FILTERED: [f32; 2] = [1.2e-2, 1.2e-2];
/// The same for pixels, where a 37th of a wrong level would be left to the next round, and the spread is only a start for
/// that of differences.
const SETTLED_PIXELS: [f32; 2] = [0.1, 0.2];
/// The same for differences, whose mean is 0; of a wrong spread, what is left is of second order.
const SETTLED_DIFFERENCES: [f32; 2] = [1.0, 0.05];
/// Every how many rows of a cell are sampled.
const ROW_STRIDE: usize = 4;
/// Cells with fewer pixels than this are sampled in full.
const SMALL_CELL_PX: usize = 1024;
/// The pixels whose differences are measured are so many columns apart.
const DIFFERENCE_PX: usize = 2;
/// Values summed side by side.
const MOMENT_LANES: usize = 32;
/// Fewer samples than this tell nothing about a cell.
const MIN_CELL_SAMPLES: usize = 12;

/// What a mesh is measured on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MeshConfig {
    /// Wanted side of a cell, in pixels.
    pub cell_px: usize,
    /// Measure the spread on differences between pixels two columns apart, which gradients do not widen.
    pub spread_of_differences: bool,
    /// The least spread that a cell can have.
    pub spread_floor: f32,
    /// Whether level 0 and spread 1 are a fair start, as for a filtered frame.
    pub is_normalised: bool,
}

/// How a frame is divided into cells.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Grid {
    /// Cells across.
    pub columns: usize,
    /// Cells down.
    pub rows: usize,
    width_px: usize,
    height_px: usize,
}

impl Grid {
    /// Cells of about `cell_px` pixels a side in a frame of `width` times `height` pixels.
    pub fn new((width_px, height_px): (usize, usize), cell_px: usize) -> Self {
        let cells = |side: usize| ((side as f32 / cell_px as f32).round() as usize).max(1);
        Self {
            columns: cells(width_px),
            rows: cells(height_px),
            width_px,
            height_px,
        }
    }

    /// The columns of pixels in a column of cells.
    fn columns_of(&self, column: usize) -> Range<usize> {
        column * self.width_px / self.columns..(column + 1) * self.width_px / self.columns
    }

    /// The rows of pixels in a row of cells.
    pub fn rows_of(&self, row: usize) -> Range<usize> {
        row * self.height_px / self.rows..(row + 1) * self.height_px / self.rows
    }

    /// Every how many rows a cell is sampled.
    pub fn row_stride(&self) -> usize {
        let cell_px = (self.width_px / self.columns) * (self.height_px / self.rows);
        if cell_px >= SMALL_CELL_PX {
            ROW_STRIDE
        } else {
            1
        }
    }
}

/// A level and a spread for each cell of a frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mesh {
    /// The cells.
    pub grid: Grid,
    cell_width_px: f32,
    /// Columns and rows of cells in a pixel.
    columns_per_px: f32,
    rows_per_px: f32,
    /// Row-major, `rows * columns`.
    pub level: Vec<f32>,
    /// Row-major, `rows * columns`.
    pub spread: Vec<f32>,
    /// The least spread that a cell could have.
    pub spread_floor: f32,
    /// Where along a row the straight pieces between nodes begin, and the last one ends.
    edges: Vec<usize>,
    /// How far behind its node each of them begins, in columns.
    offsets: Vec<f32>,
    /// The pieces along each row of nodes.
    pieces: Vec<Piece>,
    /// The level as measured, with a border of one cell in which it goes on as a plane does.
    padded_level: Vec<f32>,
    measured_spread: Vec<f32>,
}

impl Mesh {
    /// Measures `view` cell by cell.
    pub fn measure(&mut self, view: &View<'_>, config: &MeshConfig) {
        self.prepare((view.width, view.height), config);
        let grid = self.grid;
        let mut scratch = CellScratch::default();
        let levels = self.level.chunks_mut(grid.columns);
        let spreads = self.spread.chunks_mut(grid.columns);
        for (row, (level, spread)) in levels.zip(spreads).enumerate() {
            let pixels = view.rows(grid.rows_of(row)).step_by(grid.row_stride());
            scratch.measure_row(&grid, pixels, config, (level, spread));
        }
        self.finish();
    }

    /// Makes room for the cells of a frame of `size` pixels across and down.
    pub fn prepare(&mut self, size: (usize, usize), config: &MeshConfig) {
        let grid = Grid::new(size, config.cell_px);
        self.grid = grid;
        self.cell_width_px = grid.width_px as f32 / grid.columns as f32;
        self.columns_per_px = grid.columns as f32 / grid.width_px as f32;
        self.rows_per_px = grid.rows as f32 / grid.height_px as f32;
        self.spread_floor = config.spread_floor;
        for map in [&mut self.level, &mut self.spread] {
            map.clear();
            map.resize(grid.columns * grid.rows, f32::NAN);
        }
        self.edges.clear();
        self.edges.push(0);
        if grid.columns > 1 {
            for column in 0..grid.columns {
                let before = self.center(column).ceil().max(0.0) as usize;
                self.edges.push(before.min(grid.width_px));
            }
        }
        self.edges.push(grid.width_px);
        self.offsets.clear();
        for (piece, &edge) in self.edges[..self.edges.len() - 1].iter().enumerate() {
            let node = self.center(piece.saturating_sub(1));
            self.offsets.push(edge as f32 - node);
        }
    }

    /// What is to be done once all rows of cells are measured.
    pub fn finish(&mut self) {
        self.fill_gaps();
        self.smooth();
        for spread in &mut self.spread {
            *spread = spread.max(self.spread_floor);
        }
        self.set_pieces();
    }

    /// The column of pixels of the nodes in a column of cells.
    fn center(&self, column: usize) -> f32 {
        (column as f32 + 0.5) * self.cell_width_px - 0.5
    }

    /// Gives cells without a value the mean of their neighbours that have one, until all have.
    fn fill_gaps(&mut self) {
        if self.level.iter().all(|v| v.is_nan()) {
            self.level.fill(0.0);
            self.spread.fill(0.0);
            return;
        }
        while self.level.iter().any(|v| v.is_nan()) {
            self.padded_level.clone_from(&self.level);
            self.measured_spread.clone_from(&self.spread);
            for i in (0..self.level.len()).filter(|&i| self.padded_level[i].is_nan()) {
                let known = |j: &usize| !self.padded_level[*j].is_nan();
                let [mut count, mut level, mut spread] = [0.0; 3];
                for j in self.neighbours(i).filter(known) {
                    count += 1.0;
                    level += self.padded_level[j];
                    spread += self.measured_spread[j];
                }
                if count > 0.0 {
                    self.level[i] = level / count;
                    self.spread[i] = spread / count;
                }
            }
        }
    }

    /// The indices of the 3x3 cells around cell `index`, itself among them.
    fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let columns = self.grid.columns;
        let (row, column) = (index / columns, index % columns);
        let rows = row.saturating_sub(1)..(row + 2).min(self.grid.rows);
        let span = column.saturating_sub(1)..(column + 2).min(columns);
        rows.flat_map(move |r| span.clone().map(move |c| r * columns + c))
    }

    /// Median of 3x3 for all spreads, and for the levels that stick out from their neighbours.
    fn smooth(&mut self) {
        let Grid { columns, rows, .. } = self.grid;
        self.measured_spread.clone_from(&self.spread);
        self.pad_levels();
        let stride = columns + 2;
        for row in 0..rows {
            let cells = row * columns..(row + 1) * columns;
            if row > 0 && row + 1 < rows && columns > 2 {
                let around = [cells.start - columns, cells.start, cells.start + columns]
                    .map(|start| &self.measured_spread[start..start + columns]);
                medians::of_squares(around, &mut self.spread[cells.start + 1..cells.end - 1]);
                self.smooth_border_spread(cells.start);
                self.smooth_border_spread(cells.end - 1);
            } else {
                cells.clone().for_each(|i| self.smooth_border_spread(i));
            }
            let around =
                [row, row + 1, row + 2].map(|r| &self.padded_level[r * stride..(r + 1) * stride]);
            medians::replace_outliers(around, &self.spread[cells.clone()], &mut self.level[cells]);
        }
    }

    /// Median of the spreads about a cell at the border: of the fewer that there are, the lower of two middle ones.
    fn smooth_border_spread(&mut self, index: usize) {
        let mut around = [f32::INFINITY; 9];
        let mut count = 0;
        for (value, other) in around.iter_mut().zip(self.neighbours(index)) {
            *value = self.measured_spread[other];
            count += 1;
        }
        around.sort_unstable_by(f32::total_cmp);
        self.spread[index] = around[(count - 1) / 2];
    }

    /// Copies the levels into a border of one cell, where they go on as straight as the two before them, so
    /// that a gradient lies about a border cell as about any other.
    fn pad_levels(&mut self) {
        let Grid { columns, rows, .. } = self.grid;
        let stride = columns + 2;
        // Along one side: the cell next to the border, and as far behind it as the wanted one is beyond.
        let mirror = |at: usize, count: usize| {
            let inside = at.clamp(1, count) - 1;
            let behind = (2 * inside + 1).saturating_sub(at).min(count - 1);
            (inside, behind)
        };
        self.padded_level.resize(stride * (rows + 2), 0.0);
        for (i, value) in self.padded_level.iter_mut().enumerate() {
            let (r, r_behind) = mirror(i / stride, rows);
            let (c, c_behind) = mirror(i % stride, columns);
            let level = |r: usize, c: usize| self.level[r * columns + c];
            *value = 2.0 * level(r, c) - level(r_behind, c_behind);
        }
    }

    /// The position of `at` among `count` nodes, of which there are `per_px` in a pixel: lower node and fraction, which is
    /// below 0 or above 1 outside the outermost nodes.
    fn node(at: f32, per_px: f32, count: usize) -> (usize, f32) {
        if count == 1 {
            return (0, 0.0);
        }
        let position = (at + 0.5) * per_px - 0.5;
        let lower = (position.max(0.0) as usize).min(count - 2);
        (lower, position - lower as f32)
    }

    /// Level (extrapolated linearly beyond the outermost nodes) and spread (held there) at column `x`, row `y`.
    pub fn at(&self, x: f32, y: f32) -> (f32, f32) {
        let (row, fy) = Self::node(y, self.rows_per_px, self.grid.rows);
        let (column, fx) = Self::node(x, self.columns_per_px, self.grid.columns);
        let right = (column + 1).min(self.grid.columns - 1);
        let below = (row + 1).min(self.grid.rows - 1);
        let blend = |map: &[f32], fx: f32, fy: f32| {
            let value = |r: usize, c: usize| map[r * self.grid.columns + c];
            let top = value(row, column) + fx * (value(row, right) - value(row, column));
            let bottom = value(below, column) + fx * (value(below, right) - value(below, column));
            top + fy * (bottom - top)
        };
        (
            blend(&self.level, fx, fy),
            blend(&self.spread, fx.clamp(0.0, 1.0), fy.clamp(0.0, 1.0)),
        )
    }

    /// Level and reciprocal spread along row `y`, as straight pieces between nodes.
    ///
    /// Differs from [`Self::at`] in that the reciprocal is interpolated, not the spread: by less than
    /// the error of either.
    pub fn row_pieces(&self, y: usize, pieces: &mut Vec<Piece>) {
        let (row, fy) = Self::node(y as f32, self.rows_per_px, self.grid.rows);
        let below = (row + 1).min(self.grid.rows - 1);
        let held = fy.clamp(0.0, 1.0);
        let in_row = self.offsets.len();
        let of_nodes = |row: usize| &self.pieces[row * in_row..(row + 1) * in_row];
        pieces.clear();
        let pairs = of_nodes(row).iter().zip(of_nodes(below));
        pieces.extend(pairs.map(|(top, bottom)| Piece {
            level: top.level + fy * (bottom.level - top.level),
            level_slope: top.level_slope + fy * (bottom.level_slope - top.level_slope),
            inverse: top.inverse + held * (bottom.inverse - top.inverse),
            inverse_slope: top.inverse_slope + held * (bottom.inverse_slope - top.inverse_slope),
            ..*top
        }));
    }

    /// The pieces along each row of nodes.
    fn set_pieces(&mut self) {
        let columns = self.grid.columns;
        self.pieces.clear();
        for row in 0..self.grid.rows {
            let nodes = row * columns..(row + 1) * columns;
            let (level, spread) = (&self.level[nodes.clone()], &self.spread[nodes]);
            let spans = self.edges.windows(2).zip(&self.offsets);
            for (piece, (edge, offset)) in spans.enumerate() {
                // Beyond the outermost nodes the level goes on, the spread is held.
                let before = piece.saturating_sub(1);
                let after = piece.min(columns - 1);
                let left = before.min(columns.saturating_sub(2));
                let right = (left + 1).min(columns - 1);
                let level_slope = (level[right] - level[left]) * self.columns_per_px;
                let inverse = 1.0 / spread[before];
                let inverse_slope = (1.0 / spread[after] - inverse) * self.columns_per_px;
                self.pieces.push(Piece {
                    start: edge[0],
                    end: edge[1],
                    level: level[before] + offset * level_slope,
                    level_slope,
                    inverse: inverse + offset * inverse_slope,
                    inverse_slope,
                });
            }
        }
    }

    /// What `level + sigmas·spread` is nowhere below in a row of cells.
    pub fn lowest_about_row(&self, row: usize, sigmas: f32) -> f32 {
        let columns = self.grid.columns;
        let nodes = row.saturating_sub(1) * columns..(row + 2).min(self.grid.rows) * columns;
        let (levels, spreads) = (&self.level[nodes.clone()], &self.spread[nodes]);
        let values = levels.iter().zip(spreads).map(|(l, s)| l + sigmas * s);
        let lowest = values.fold(f32::INFINITY, f32::min);
        // Levels are extrapolated at the borders, by at most half a step between cells.
        let (least, most) = levels
            .iter()
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(least, most), &l| {
                (least.min(l), most.max(l))
            });
        lowest - (most - least)
    }

    /// Level and spread at the nodes of row `y`: what is between two columns of cells lies straight between them.
    pub fn across_row<'a>(&'a self, y: usize, nodes: &mut Vec<[f32; 2]>) {
        let (row, fy) = Self::node(y as f32, self.rows_per_px, self.grid.rows);
        let below = (row + 1).min(self.grid.rows - 1);
        let held = fy.clamp(0.0, 1.0);
        let columns = self.grid.columns;
        let pairs = |map: &'a [f32]| {
            let of_row = |row: usize| &map[row * columns..(row + 1) * columns];
            of_row(row).iter().zip(of_row(below))
        };
        let both = pairs(&self.level).zip(pairs(&self.spread));
        nodes.clear();
        nodes.extend(both.map(|((top, bottom), (stop, sbottom))| {
            [top + fy * (bottom - top), stop + held * (sbottom - stop)]
        }));
    }

    /// Level and spread at column `x` of the row whose nodes are given: the same as [`Self::at`].
    pub fn at_column(&self, nodes: &[[f32; 2]], x: f32) -> (f32, f32) {
        let (column, fx) = Self::node(x, self.columns_per_px, nodes.len());
        let (a, b) = (nodes[column], nodes[(column + 1).min(nodes.len() - 1)]);
        (
            a[0] + fx * (b[0] - a[0]),
            a[1] + fx.clamp(0.0, 1.0) * (b[1] - a[1]),
        )
    }
}

/// A straight piece of level and reciprocal spread along a row.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Piece {
    /// First column.
    pub start: usize,
    /// Column after the last.
    pub end: usize,
    /// Level at `start`.
    pub level: f32,
    /// Level per column.
    pub level_slope: f32,
    /// One over the spread at `start`.
    pub inverse: f32,
    /// One over the spread, per column.
    pub inverse_slope: f32,
}

/// What is measured in a cell: its pixels, or the differences of those two columns apart.
#[derive(Debug, Clone, Copy)]
struct Samples<'a> {
    rows: Rows<'a>,
    are_differences: bool,
}

/// Buffers for the cells of one row.
#[derive(Debug, Clone, Default)]
pub(crate) struct CellScratch {
    start: Vec<f32>,
}

impl CellScratch {
    /// Levels and spreads of a row of cells, of whose rows of pixels `rows` are looked at; NaN where a cell has too few values.
    pub fn measure_row(
        &mut self,
        grid: &Grid,
        rows: Rows<'_>,
        config: &MeshConfig,
        (level, spread): (&mut [f32], &mut [f32]),
    ) {
        for first in (0..grid.columns).step_by(LANES) {
            let cells = first..(first + LANES).min(grid.columns);
            let mut starts = [None; LANES];
            if config.is_normalised {
                starts.fill(Some((0.0, 1.0)));
            } else {
                rough_starts(grid, cells.clone(), &rows, &mut starts);
            }
            for (cell, start) in cells.zip(starts) {
                let columns = grid.columns_of(cell);
                let start =
                    start.or_else(|| robust_start(&rows.columns(columns.clone()), &mut self.start));
                (level[cell], spread[cell]) = measure_cell(&rows, columns, start, config);
            }
        }
    }
}

/// Level and spread of a cell; NaN where it has too few values.
fn measure_cell(
    rows: &Rows<'_>,
    columns: Range<usize>,
    start: Option<(f32, f32)>,
    config: &MeshConfig,
) -> (f32, f32) {
    let pixels = Samples {
        rows: rows.columns(columns.clone()),
        are_differences: false,
    };
    let settled = if config.spread_of_differences {
        SETTLED_PIXELS
    } else {
        SETTLED_FILTERED
    };
    let floor = config.spread_floor;
    let measured = start.and_then(|at| clipped_mean_and_spread(&pixels, at, floor, settled));
    let Some((level, spread)) = measured else {
        return (f32::NAN, f32::NAN);
    };
    // The last differences of a cell reach into the next.
    let reach = columns.start..(columns.end + DIFFERENCE_PX).min(rows.width);
    let differences = Samples {
        rows: rows.columns(reach.clone()),
        are_differences: true,
    };
    let count = reach.len().saturating_sub(DIFFERENCE_PX) * rows.height;
    if !config.spread_of_differences || count < MIN_CELL_SAMPLES {
        return (level, spread);
    }
    let root2 = std::f32::consts::SQRT_2;
    let start = (0.0, spread * root2);
    match clipped_mean_and_spread(&differences, start, floor * root2, SETTLED_DIFFERENCES) {
        Some((_, of_differences)) => (level, of_differences / root2),
        None => (level, spread),
    }
}

/// Median, and its distance to the lower quantile, of a few pixels of up to [`LANES`] cells, sorted side by side;
/// `None` for those with a pixel without a value.
fn rough_starts(
    grid: &Grid,
    cells: Range<usize>,
    rows: &Rows<'_>,
    starts: &mut [Option<(f32, f32)>; LANES],
) {
    const SAMPLES: usize = medians::SORTED;
    /// The golden ratio: its multiples spread evenly over the columns.
    const STEP: f32 = 0.618_034;
    let mut samples: [Lanes; SAMPLES] = [[0.0; LANES]; SAMPLES];
    let width = grid.width_px / grid.columns;
    for (i, sample) in samples.iter_mut().enumerate() {
        let row = rows.row(i % rows.height);
        let offset = ((i as f32 * STEP).fract() * width as f32) as usize;
        for (value, cell) in sample.iter_mut().zip(cells.clone()) {
            *value = row[grid.columns_of(cell).start + offset];
        }
    }
    let mut checks = [0.0f32; LANES];
    for sample in &samples {
        for lane in 0..LANES {
            checks[lane] += sample[lane];
        }
    }
    medians::sort_lanes(&mut samples);
    for lane in 0..cells.len() {
        let quantile = |q: f32| samples[(q * (SAMPLES - 1) as f32).round() as usize][lane];
        let is_known = !checks[lane].is_nan();
        starts[lane] = is_known.then(|| start_from(quantile));
    }
}

/// Level and spread by quantiles.
fn start_from(quantile: impl Fn(f32) -> f32) -> (f32, f32) {
    let level = quantile(0.5);
    let below = level - quantile(0.159);
    let above = quantile(0.841) - level;
    // Clipped at zero, nothing lies below the median.
    (level, if below > 0.0 { below } else { above })
}

/// Median, and its distance to the lower quantile, of all pixels in `rows`; `None` for too few.
fn robust_start(rows: &Rows<'_>, start: &mut Vec<f32>) -> Option<(f32, f32)> {
    start.clear();
    let values = (0..rows.height).flat_map(|y| rows.row(y));
    start.extend(values.filter(|v| !v.is_nan()));
    if start.len() < MIN_CELL_SAMPLES {
        return None;
    }
    start.sort_unstable_by(f32::total_cmp);
    Some(start_from(|q| {
        start[(q * (start.len() - 1) as f32).round() as usize]
    }))
}

/// Mean and standard deviation of samples without outliers, from a first guess of both; `None` for
/// too few values. NaN is left out. The spread is not below `floor`; both are done with where they change by less than
/// `settled` of it.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn clipped_mean_and_spread(
    samples: &Samples,
    start: (f32, f32),
    floor: f32,
    [settled_level, settled_spread]: [f32; 2],
) -> Option<(f32, f32)> {
    let (mut level, mut spread) = (start.0, start.1.max(floor));
    for round in 0..MAX_CLIP_ROUNDS {
        let [count, sum, squares] = clipped_moments(samples, level, CLIP_SIGMA * spread);
        if count < MIN_CELL_SAMPLES as f32 {
            return (round > 0).then_some((level, spread));
        }
        let mean = sum / count;
        let variance = (squares / count - mean * mean).max(0.0);
        let clipped = variance.sqrt() / CLIPPED_SHRINK;
        let new_spread = (spread + (clipped - spread) / (1.0 - LEFT_BY_ROUND)).max(0.0);
        let is_settled = (new_spread - spread).abs() <= settled_spread * spread
            && mean.abs() <= settled_level * spread;
        level += mean;
        spread = new_spread.max(floor);
        if is_settled || new_spread <= floor {
            break;
        }
    }
    Some((level, spread))
}

/// Number, sum and sum of squares of `value - center` where it is at most `half_width` in size.
#[inline(always)]
fn clipped_moments(samples: &Samples<'_>, center: f32, half_width: f32) -> [f32; 3] {
    let [mut count, mut sum, mut squares] = [[0.0f32; MOMENT_LANES]; 3];
    let mut add = |lane: usize, value: f32| {
        let deviation = value - center;
        let inside = deviation.abs() <= half_width;
        let kept = if inside { deviation } else { 0.0 };
        count[lane] += if inside { 1.0 } else { 0.0 };
        sum[lane] += kept;
        squares[lane] += kept * kept;
    };
    let Samples {
        rows,
        are_differences,
    } = *samples;
    for y in 0..rows.height {
        let row = rows.row(y);
        if are_differences {
            let (first, second) = (&row[..row.len() - DIFFERENCE_PX], &row[DIFFERENCE_PX..]);
            let (chunks, rest) = first.as_chunks::<MOMENT_LANES>();
            let (later_chunks, later_rest) = second.as_chunks::<MOMENT_LANES>();
            for (chunk, later) in chunks.iter().zip(later_chunks) {
                for lane in 0..MOMENT_LANES {
                    add(lane, later[lane] - chunk[lane]);
                }
            }
            for (lane, (value, later)) in rest.iter().zip(later_rest).enumerate() {
                add(lane, later - value);
            }
        } else {
            let (chunks, rest) = row.as_chunks::<MOMENT_LANES>();
            for chunk in chunks {
                for (lane, value) in chunk.iter().enumerate() {
                    add(lane, *value);
                }
            }
            for (lane, value) in rest.iter().enumerate() {
                add(lane, *value);
            }
        }
    }
    [count, sum, squares].map(medians::sum_of)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    const CONFIG: MeshConfig = MeshConfig {
        cell_px: 64,
        spread_of_differences: true,
        spread_floor: 1e-6,
        is_normalised: false,
    };

    fn noise_frame(side: usize, sigma: f32, level: impl Fn(usize, usize) -> f32) -> Vec<f32> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let normal = Normal::new(0.0, sigma).unwrap();
        (0..side * side)
            .map(|i| level(i % side, i / side) + normal.sample(&mut rng))
            .collect()
    }

    #[test]
    fn a_steep_gradient_changes_neither_level_nor_spread() {
        let pixels = noise_frame(256, 5.0, |x, y| 100.0 + 0.5 * x as f32 - 0.2 * y as f32);
        let mut mesh = Mesh::default();
        mesh.measure(&View::new(&pixels, 256, 256), &CONFIG);
        for (x, y) in [
            (0.0f32, 0.0f32),
            (255.0, 0.0),
            (100.0, 255.0),
            (130.0, 120.0),
        ] {
            let (level, spread) = mesh.at(x, y);
            let truth = 100.0 + 0.5 * x - 0.2 * y;
            assert!(
                (level - truth).abs() < 1.5,
                "level {level} vs {truth} at {x},{y}"
            );
            assert!(
                (spread / 5.0 - 1.0).abs() < 0.05,
                "spread {spread} at {x},{y}"
            );
        }
    }

    #[test]
    fn a_steep_gradient_is_followed_up_to_the_corners() {
        const NOISE: f32 = 2.9;
        let (width, height) = (640, 480);
        for (across, down) in [
            (0.3, 0.0),
            (-0.3, 0.0),
            (0.0, 0.3),
            (0.2, -0.2),
            (-0.2, -0.2),
        ] {
            let truth = |x: usize, y: usize| 1000.0 + across * x as f32 + down * y as f32;
            let square = noise_frame(width, NOISE, truth);
            let mut mesh = Mesh::default();
            mesh.measure(
                &View::new(&square[..width * height], width, height),
                &CONFIG,
            );
            for (x, y) in [0, 320, width - 1]
                .iter()
                .flat_map(|&x| [0, 240, height - 1].map(|y| (x, y)))
            {
                let (level, _) = mesh.at(x as f32, y as f32);
                assert!(
                    (level - truth(x, y)).abs() < 0.25 * NOISE,
                    "gradient {across}, {down}: {level} at ({x}, {y}), expected {}",
                    truth(x, y)
                );
            }
        }
    }

    #[test]
    fn a_cell_full_of_light_takes_the_level_around_it_also_in_a_corner() {
        for (x0, y0) in [(0, 0), (320, 320), (256, 0), (128, 128)] {
            let is_lit = |x: usize, y: usize| x / 64 == x0 / 64 && y / 64 == y0 / 64;
            let truth = |x: usize, y: usize| 100.0 + 0.1 * x as f32 + 0.05 * y as f32;
            let lit = |x, y| truth(x, y) + if is_lit(x, y) { 80.0 } else { 0.0 };
            let pixels = noise_frame(384, 3.0, lit);
            let mut mesh = Mesh::default();
            mesh.measure(&View::new(&pixels, 384, 384), &CONFIG);
            let (x, y) = (x0 + 32, y0 + 32);
            let (level, _) = mesh.at(x as f32, y as f32);
            assert!((level - truth(x, y)).abs() < 15.0, "({x}, {y}): {level}");
        }
    }

    #[test]
    fn row_pieces_agree_with_the_mesh_at_every_pixel() {
        let pixels = noise_frame(200, 5.0, |x, y| 100.0 + (x * y) as f32 * 0.01);
        let mut mesh = Mesh::default();
        mesh.measure(&View::new(&pixels, 200, 200), &CONFIG);
        let mut pieces = Vec::new();
        for y in [0, 63, 199] {
            mesh.row_pieces(y, &mut pieces);
            assert_eq!(pieces.last().unwrap().end, 200);
            for piece in &pieces {
                for x in piece.start..piece.end {
                    let t = (x - piece.start) as f32;
                    let (level, spread) = mesh.at(x as f32, y as f32);
                    assert!((piece.level + t * piece.level_slope - level).abs() < 1e-2);
                    let inverse = piece.inverse + t * piece.inverse_slope;
                    assert!((inverse * spread - 1.0).abs() < 1e-2);
                }
            }
        }
    }

    #[test]
    fn a_cell_without_values_takes_its_neighbours() {
        let mut pixels = noise_frame(192, 2.0, |_, _| 50.0);
        for y in 64..128 {
            pixels[y * 192 + 64..y * 192 + 128].fill(f32::NAN);
        }
        let mut mesh = Mesh::default();
        mesh.measure(&View::new(&pixels, 192, 192), &CONFIG);
        let (level, spread) = mesh.at(96.0, 96.0);
        assert!((level - 50.0).abs() < 0.5 && (spread - 2.0).abs() < 0.2);
    }
}
