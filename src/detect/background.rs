//! Local level and spread on a mesh of cells, robust against stars, and interpolated between the cells.
//!
//! The same code maps the background and noise of the frame and, after filtering, the mean and the
//! noise of the filtered frame. Per cell: a mean and standard deviation clipped at [`CLIP_SIGMA`],
//! started from the median and the lower quantile of a few samples (stars are above, not below).
//! Spreads are smoothed by a median of 3x3 cells; levels are replaced by it only where they stick out
//! (beyond the border they go on as a plane does).

use super::view::View;
use multiversion::multiversion;

/// Deviations beyond this many standard deviations are not counted: keeps 99.7 % of the noise.
const CLIP_SIGMA: f32 = 3.0;
/// The standard deviation of a Gaussian clipped at ±3σ, over σ.
const CLIPPED_SHRINK: f32 = 0.986_58;
/// Rounds of clipping; it settles in three or four.
const MAX_CLIP_ROUNDS: usize = 8;
/// Changes below this part of the spread end the clipping.
const SETTLED: f32 = 4e-3;
/// Samples that start the clipping.
const START_SAMPLES: usize = 41;
/// Every how many rows of a cell are sampled.
const ROW_STRIDE: usize = 4;
/// Fewer samples than this tell nothing about a cell.
const MIN_CELL_SAMPLES: usize = 12;

/// What a mesh is measured on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeshConfig {
    /// Wanted side of a cell, in pixels.
    pub cell_px: usize,
    /// Measure the spread on differences between pixels two columns apart, which gradients do not widen.
    pub spread_of_differences: bool,
    /// The least spread that a cell can have.
    pub spread_floor: f32,
    /// Whether level 0 and spread 1 are a fair start, as for a filtered frame.
    pub is_normalised: bool,
}

/// A level and a spread for each cell of a frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Mesh {
    /// Cells across.
    pub columns: usize,
    /// Cells down.
    pub rows: usize,
    cell_width_px: f32,
    cell_height_px: f32,
    /// Row-major, `rows * columns`.
    pub level: Vec<f32>,
    /// Row-major, `rows * columns`.
    pub spread: Vec<f32>,
    /// The least spread that a cell could have.
    pub spread_floor: f32,
    scratch: Scratch,
}

/// Buffers for one cell and one mesh.
#[derive(Debug, Clone, Default)]
struct Scratch {
    values: Vec<f32>,
    differences: Vec<f32>,
    start: Vec<f32>,
    copy: Vec<f32>,
}

impl Mesh {
    /// Measures `view` cell by cell.
    pub fn measure(&mut self, view: &View<'_>, config: &MeshConfig) {
        let cells = |side: usize| ((side as f32 / config.cell_px as f32).round() as usize).max(1);
        self.columns = cells(view.width);
        self.rows = cells(view.height);
        self.cell_width_px = view.width as f32 / self.columns as f32;
        self.cell_height_px = view.height as f32 / self.rows as f32;
        self.spread_floor = config.spread_floor;
        self.level.clear();
        self.spread.clear();
        for row in 0..self.rows {
            for column in 0..self.columns {
                let cell = self.cell_bounds(view, column, row);
                let (level, spread) = self.scratch.measure_cell(view, cell, config);
                self.level.push(level);
                self.spread.push(spread);
            }
        }
        self.fill_gaps();
        self.smooth();
        for spread in &mut self.spread {
            *spread = spread.max(config.spread_floor);
        }
    }

    /// First and last-but-one column and row of a cell: (x0, x1, y0, y1).
    fn cell_bounds(&self, view: &View<'_>, column: usize, row: usize) -> [usize; 4] {
        [
            column * view.width / self.columns,
            (column + 1) * view.width / self.columns,
            row * view.height / self.rows,
            (row + 1) * view.height / self.rows,
        ]
    }

    /// Gives cells without a value the mean of their neighbours that have one, until all have.
    fn fill_gaps(&mut self) {
        if self.level.iter().all(|v| v.is_nan()) {
            self.level.fill(0.0);
            self.spread.fill(0.0);
            return;
        }
        while self.level.iter().any(|v| v.is_nan()) {
            let known = self.level.clone();
            for i in 0..known.len() {
                if known[i].is_nan() {
                    let valid: Vec<usize> =
                        self.neighbours(i).filter(|&j| !known[j].is_nan()).collect();
                    let count = valid.len() as f32;
                    if !valid.is_empty() {
                        self.level[i] = valid.iter().map(|&j| known[j]).sum::<f32>() / count;
                        self.spread[i] = valid.iter().map(|&j| self.spread[j]).sum::<f32>() / count;
                    }
                }
            }
        }
    }

    /// The indices of the 3x3 cells around cell `index`, itself among them.
    fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let (row, column, columns) = (index / self.columns, index % self.columns, self.columns);
        let rows = row.saturating_sub(1)..(row + 2).min(self.rows);
        let span = column.saturating_sub(1)..(column + 2).min(self.columns);
        rows.flat_map(move |r| span.clone().map(move |c| r * columns + c))
    }

    /// Median of 3x3 for all spreads, and for the levels that stick out from their neighbours.
    fn smooth(&mut self) {
        let level = self.level.clone();
        let spread = self.spread.clone();
        let mut around = std::mem::take(&mut self.scratch.copy);
        for i in 0..level.len() {
            around.clear();
            around.extend(self.neighbours(i).map(|j| spread[j]));
            self.spread[i] = median(&mut around);
            around.clear();
            self.levels_around(&level, i, &mut around);
            let middle = median(&mut around);
            for value in &mut around {
                *value = (*value - middle).abs();
            }
            // A plane has the same deviations as its own gradient: only what exceeds them sticks out.
            let allowed = 3.0 * 1.4826 * median(&mut around) + 0.5 * self.spread[i];
            if (level[i] - middle).abs() > allowed {
                self.level[i] = middle;
            }
        }
        self.scratch.copy = around;
    }

    /// Adds to `around` the nine levels about cell `index`; those beyond the border go on as straight
    /// as the two before them, so that a gradient lies about a border cell as about any other.
    fn levels_around(&self, level: &[f32], index: usize, around: &mut Vec<f32>) {
        let (row, column) = (index / self.columns, index % self.columns);
        // Along one side: the cell next to the border, and as far behind it as the wanted one is beyond.
        let mirror = |at: isize, count: usize| {
            let inside = at.clamp(0, count as isize - 1);
            let behind = (2 * inside - at).clamp(0, count as isize - 1);
            (inside as usize, behind as usize)
        };
        let steps = (0..9).map(|i| (i / 3 - 1, i % 3 - 1));
        around.extend(steps.map(|(down, across)| {
            let (r, r_behind) = mirror(row as isize + down, self.rows);
            let (c, c_behind) = mirror(column as isize + across, self.columns);
            2.0 * level[r * self.columns + c] - level[r_behind * self.columns + c_behind]
        }));
    }

    /// The position of `at` among `count` nodes `cell_px` apart: lower node and fraction, which is
    /// below 0 or above 1 outside the outermost nodes.
    fn node(at: f32, cell_px: f32, count: usize) -> (usize, f32) {
        if count == 1 {
            return (0, 0.0);
        }
        let position = (at + 0.5) / cell_px - 0.5;
        let lower = (position.max(0.0) as usize).min(count - 2);
        (lower, position - lower as f32)
    }

    /// Level (extrapolated linearly beyond the outermost nodes) and spread (held there) at column `x`, row `y`.
    pub fn at(&self, x: f32, y: f32) -> (f32, f32) {
        let (row, fy) = Self::node(y, self.cell_height_px, self.rows);
        let (column, fx) = Self::node(x, self.cell_width_px, self.columns);
        let right = (column + 1).min(self.columns - 1);
        let below = (row + 1).min(self.rows - 1);
        let blend = |map: &[f32], fx: f32, fy: f32| {
            let value = |r: usize, c: usize| map[r * self.columns + c];
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
    pub fn row_pieces(&self, y: usize, width: usize, pieces: &mut Vec<Piece>) {
        pieces.clear();
        let (row, fy) = Self::node(y as f32, self.cell_height_px, self.rows);
        let below = (row + 1).min(self.rows - 1);
        let held = fy.clamp(0.0, 1.0);
        let node = |column: usize| {
            let (top, bottom) = (row * self.columns + column, below * self.columns + column);
            let level = self.level[top] + fy * (self.level[bottom] - self.level[top]);
            let spread = self.spread[top] + held * (self.spread[bottom] - self.spread[top]);
            (level, 1.0 / spread)
        };
        let center = |column: usize| (column as f32 + 0.5) * self.cell_width_px - 0.5;
        let mut push =
            |start: usize, end: usize, origin: f32, value: (f32, f32), slope: (f32, f32)| {
                if end > start {
                    let offset = start as f32 - origin;
                    pieces.push(Piece {
                        start,
                        end,
                        level: value.0 + offset * slope.0,
                        level_slope: slope.0,
                        inverse: value.1 + offset * slope.1,
                        inverse_slope: slope.1,
                    });
                }
            };
        if self.columns == 1 {
            push(0, width, 0.0, node(0), (0.0, 0.0));
            return;
        }
        let mut left = node(0);
        let mut start = 0;
        for column in 0..self.columns - 1 {
            let right = node(column + 1);
            let slope = (
                (right.0 - left.0) / self.cell_width_px,
                (right.1 - left.1) / self.cell_width_px,
            );
            let (from, to) = (center(column), center(column + 1));
            // Beyond the outermost nodes the level goes on, the spread is held.
            if column == 0 {
                let end = (from.ceil().max(0.0) as usize).min(width);
                push(0, end, from, left, (slope.0, 0.0));
                start = end;
            }
            let end = (to.ceil() as usize).min(width);
            push(start, end, from, left, slope);
            start = start.max(end);
            if column + 2 == self.columns {
                push(start, width, to, right, (slope.0, 0.0));
            }
            left = right;
        }
    }
}

/// A straight piece of level and reciprocal spread along a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
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

impl Scratch {
    /// Level and spread of one cell; NaN where it has too few values.
    fn measure_cell(
        &mut self,
        view: &View<'_>,
        [x0, x1, y0, y1]: [usize; 4],
        config: &MeshConfig,
    ) -> (f32, f32) {
        self.values.clear();
        self.differences.clear();
        // Small cells are sampled in full.
        let stride = if (x1 - x0) * (y1 - y0) >= 1024 {
            ROW_STRIDE
        } else {
            1
        };
        for y in (y0..y1).step_by(stride) {
            let row = &view.row(y)[x0..x1];
            self.values.extend_from_slice(row);
            if config.spread_of_differences && row.len() > 2 {
                self.differences
                    .extend(row[2..].iter().zip(row).map(|(b, a)| b - a));
            }
        }
        let start = if config.is_normalised {
            Some((0.0, 1.0))
        } else {
            robust_start(&self.values, &mut self.start)
        };
        let measured =
            start.and_then(|at| clipped_mean_and_spread(&self.values, at, config.spread_floor));
        let Some((level, spread)) = measured else {
            return (f32::NAN, f32::NAN);
        };
        if self.differences.len() < MIN_CELL_SAMPLES {
            return (level, spread);
        }
        let root2 = std::f32::consts::SQRT_2;
        let floor = config.spread_floor * root2;
        match clipped_mean_and_spread(&self.differences, (0.0, spread * root2), floor) {
            Some((_, of_differences)) => (level, of_differences / root2),
            None => (level, spread),
        }
    }
}

/// Median, and its distance to the lower quantile, of a few of `values`; `None` for too few.
fn robust_start(values: &[f32], start: &mut Vec<f32>) -> Option<(f32, f32)> {
    start.clear();
    // An odd stride does not beat with the rows of the cell.
    let stride = (values.len() / START_SAMPLES).max(1) | 1;
    start.extend(values.iter().step_by(stride).filter(|v| !v.is_nan()));
    if start.len() < MIN_CELL_SAMPLES {
        start.clear();
        start.extend(values.iter().filter(|v| !v.is_nan()));
        if start.len() < MIN_CELL_SAMPLES {
            return None;
        }
    }
    start.sort_unstable_by(f32::total_cmp);
    let quantile = |q: f32| start[(q * (start.len() - 1) as f32).round() as usize];
    let level = quantile(0.5);
    let below = level - quantile(0.159);
    let above = quantile(0.841) - level;
    // Clipped at zero, nothing lies below the median.
    Some((level, if below > 0.0 { below } else { above }))
}

/// Mean and standard deviation of `values` without outliers, from a first guess of both; `None` for
/// too few values. NaN is left out.
fn clipped_mean_and_spread(values: &[f32], start: (f32, f32), floor: f32) -> Option<(f32, f32)> {
    let (mut level, mut spread) = (start.0, start.1.max(floor));
    for round in 0..MAX_CLIP_ROUNDS {
        let [count, sum, squares] = clipped_moments(values, level, CLIP_SIGMA * spread);
        if count < MIN_CELL_SAMPLES as f32 {
            return (round > 0).then_some((level, spread));
        }
        let mean = sum / count;
        let variance = (squares / count - mean * mean).max(0.0);
        let new_spread = variance.sqrt() / CLIPPED_SHRINK;
        let settled =
            (new_spread - spread).abs() <= SETTLED * spread && mean.abs() <= SETTLED * spread;
        level += mean;
        spread = new_spread.max(floor);
        if settled || new_spread <= floor {
            break;
        }
    }
    Some((level, spread))
}

/// Number, sum and sum of squares of `value - center` where it is at most `half_width` in size.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn clipped_moments(values: &[f32], center: f32, half_width: f32) -> [f32; 3] {
    const LANES: usize = 32;
    let mut count = [0.0f32; LANES];
    let mut sum = [0.0f32; LANES];
    let mut squares = [0.0f32; LANES];
    let (chunks, rest) = values.as_chunks::<LANES>();
    let mut add = |lane: usize, value: f32| {
        let deviation = value - center;
        let inside = deviation.abs() <= half_width;
        let kept = if inside { deviation } else { 0.0 };
        count[lane] += if inside { 1.0 } else { 0.0 };
        sum[lane] += kept;
        squares[lane] += kept * kept;
    };
    for chunk in chunks {
        for (lane, &value) in chunk.iter().enumerate() {
            add(lane, value);
        }
    }
    for (lane, &value) in rest.iter().enumerate() {
        add(lane, value);
    }
    [count, sum, squares].map(|lanes| lanes.iter().sum())
}

/// The middle value; the lower of the two for an even number. `values` must not be empty.
fn median(values: &mut [f32]) -> f32 {
    let middle = (values.len() - 1) / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
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
            mesh.row_pieces(y, 200, &mut pieces);
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
