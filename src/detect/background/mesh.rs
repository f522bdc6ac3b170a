//! A map of background and noise, interpolated between the cells of a mesh.
//!
//! The same code maps background and noise of the frame, and mean and noise of the filtered frame.

use super::cells::CellMeasurer;
use super::grid::CellGrid;
use super::mesh_config::MeshConfig;
use super::smoothing::Smoother;
use crate::base::size::Size;
use crate::detect::pixels::View;

/// Background and noise of each cell of a frame, and between the cells' centres (the nodes).
#[derive(Debug, Clone, Default)]
pub(crate) struct Mesh {
    /// The cells.
    pub grid: CellGrid,
    cell_width_px: f32,
    /// Columns of cells in a pixel.
    columns_per_px: f32,
    /// Rows of cells in a pixel.
    rows_per_px: f32,
    /// Row-major, `rows * columns`.
    pub background: Vec<f32>,
    /// Standard deviation of the noise; row-major, `rows * columns`.
    pub sigma: Vec<f32>,
    /// Standard deviation of the noise from slopes, along x and along y, if it were white; row-major. Only of
    /// filtered frames.
    pub slope_sigma: [Vec<f32>; 2],
    /// Least noise that a cell could have.
    pub sigma_floor: f32,
    /// The columns at which the straight pieces of a row begin, and the end of the last one.
    edges: Vec<usize>,
    /// The distance from its node at which each piece begins, in columns.
    offsets: Vec<f32>,
    /// The column from which on each node, but for the last one, is the one before.
    node_starts: Vec<usize>,
    /// The pieces along each row of nodes.
    pieces: Vec<Piece>,
    /// Whether the background bends more than that of a sky anywhere.
    is_bent: bool,
    smoother: Smoother,
}

/// A straight piece of background and reciprocal noise along a row.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Piece {
    /// First column.
    pub start: usize,
    /// Column after the last.
    pub end: usize,
    /// Background at `start`.
    pub background: f32,
    /// Background per column.
    pub background_slope: f32,
    /// 1/σ at `start`.
    pub inverse_sigma: f32,
    /// 1/σ per column.
    pub inverse_sigma_slope: f32,
}

/// Background and noise between two nodes of a row.
#[derive(Debug, Clone, Copy)]
struct NodeLine {
    /// Number of the first node.
    column: f32,
    /// Nodes in a pixel.
    columns_per_px: f32,
    /// Background and noise at the first node.
    from: [f32; 2],
    /// Background and noise at the second node.
    to: [f32; 2],
}

/// A point among the nodes: the node before it, and how far on it is, in nodes.
#[derive(Debug, Clone, Copy)]
struct MeshPosition {
    row: usize,
    column: usize,
    across: f32,
    down: f32,
}

impl MeshPosition {
    /// The nearest place between nodes.
    fn clamped(self) -> Self {
        Self {
            across: self.across.clamp(0.0, 1.0),
            down: self.down.clamp(0.0, 1.0),
            ..self
        }
    }
}

impl NodeLine {
    /// The heights of adjacent pixels, the first in column `x`, above the background, in units of
    /// the noise.
    #[inline(always)]
    fn heights(self, x: usize, values: &[f32], heights: &mut [f32]) {
        let Self { from, to, .. } = self;
        for (i, (height, &value)) in heights.iter_mut().zip(values).enumerate() {
            let x = (x as i32 + i as i32) as f32;
            let position = (x + 0.5) * self.columns_per_px - 0.5;
            let fraction = position - self.column;
            let background = from[0] + fraction * (to[0] - from[0]);
            let sigma = from[1] + fraction.clamp(0.0, 1.0) * (to[1] - from[1]);
            *height = (value - background) / sigma;
        }
    }
}

/// How far the middle one of three backgrounds is off the line through the others, twice.
fn bend([before, here, after]: [f32; 3]) -> f32 {
    (before - 2.0 * here + after).abs()
}

/// Raises noise to at least `floor`.
fn raise(sigma: &mut [f32], floor: f32) {
    for sigma in sigma {
        *sigma = sigma.max(floor);
    }
}

impl Mesh {
    /// Measures `view` cell by cell.
    pub fn measure(&mut self, view: &View<'_>, config: &MeshConfig) {
        self.prepare(view.size(), config);
        let grid = self.grid;
        let mut measurer = CellMeasurer::default();
        let mut sampled = Vec::new();
        let backgrounds = self.background.chunks_mut(grid.columns);
        let sigmas = self.sigma.chunks_mut(grid.columns);
        for (row, output) in backgrounds.zip(sigmas).enumerate() {
            let (background, sigma) = output;
            let pixels = view.sampled(grid.rows_of(row), grid.row_stride, &mut sampled);
            measurer.measure_row(&grid, pixels, config, background, sigma);
        }
        self.finish();
    }

    /// Makes room for the cells of a frame of this size.
    pub fn prepare(&mut self, size: Size, config: &MeshConfig) {
        let grid = CellGrid::new(size, config.cell_px, config.row_stride);
        self.grid = grid;
        self.cell_width_px = grid.width_px as f32 / grid.columns as f32;
        self.columns_per_px = grid.columns as f32 / grid.width_px as f32;
        self.rows_per_px = grid.rows as f32 / grid.height_px as f32;
        self.sigma_floor = config.sigma_floor;
        let [along_x, along_y] = &mut self.slope_sigma;
        for map in [&mut self.background, &mut self.sigma, along_x, along_y] {
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
        let nodes = grid.columns.saturating_sub(1).max(1);
        self.node_starts.clear();
        self.node_starts.resize(nodes, grid.width_px);
        for x in (0..grid.width_px).rev() {
            let (column, _) = Self::node(x as f32, self.columns_per_px, grid.columns);
            self.node_starts[column] = x;
        }
        self.offsets.clear();
        for (piece, &edge) in self.edges[..self.edges.len() - 1].iter().enumerate() {
            let node = self.center(piece.saturating_sub(1));
            self.offsets.push(edge as f32 - node);
        }
    }

    /// Completes the mesh once all rows of cells are measured: gaps, outliers, pieces.
    pub fn finish(&mut self) {
        let Self {
            grid,
            background,
            sigma,
            smoother,
            ..
        } = self;
        smoother.fill_gaps(grid, background, sigma);
        smoother.smooth(grid, background, sigma);
        raise(sigma, self.sigma_floor);
        self.set_pieces();
    }

    /// Completes the noise from slopes after [`Self::finish`], where it was measured: gaps, smoothing.
    pub fn finish_slopes(&mut self) {
        for slopes in &mut self.slope_sigma {
            let gaps = slopes.iter_mut().zip(&self.sigma);
            for (slope, sigma) in gaps.filter(|(slope, _)| slope.is_nan()) {
                *slope = *sigma;
            }
            self.smoother.smooth_noise(&self.grid, slopes);
            raise(slopes, self.sigma_floor);
        }
    }

    /// Whether the background has an edge somewhere: a place where it bends by at least a `share` of how
    /// far it lies above the darkest one, and by the noise of a pixel.
    pub fn has_edges(&self, share: f32) -> bool {
        let CellGrid { columns, rows, .. } = self.grid;
        let darkest = self
            .background
            .iter()
            .copied()
            .fold(f32::INFINITY, f32::min);
        let is_edge = |cell: usize, step: usize| {
            let around = self.around(cell, step);
            let bend = bend(around);
            let brightest = around.into_iter().fold(f32::NEG_INFINITY, f32::max);
            bend >= (share * (brightest - darkest)).max(self.sigma[cell])
        };
        let mut inner = (0..rows).flat_map(|y| (0..columns).map(move |x| [x, y]));
        inner.any(|[x, y]| {
            let cell = y * columns + x;
            let across = (1..columns.saturating_sub(1)).contains(&x) && is_edge(cell, 1);
            across || (1..rows.saturating_sub(1)).contains(&y) && is_edge(cell, columns)
        })
    }

    /// How far the background of each cell inside the frame is off the lines through those around it, twice, in
    /// noises of a pixel.
    pub fn bends_over_noise(&self) -> impl Iterator<Item = f32> {
        let CellGrid { columns, rows, .. } = self.grid;
        let inside = |count: usize| 1..count.saturating_sub(1).max(1);
        let cells = inside(rows).flat_map(move |y| inside(columns).map(move |x| y * columns + x));
        cells.map(move |cell| {
            let bends = bend(self.around(cell, 1)) + bend(self.around(cell, columns));
            bends / self.sigma[cell]
        })
    }

    /// The background of a cell between those `step` cells before and after it.
    fn around(&self, cell: usize, step: usize) -> [f32; 3] {
        [cell - step, cell, cell + step].map(|at| self.background[at])
    }

    /// Whether the background bends near a place more than that of a sky.
    pub fn is_bent_at(&self, x: f32, y: f32) -> bool {
        if !self.is_bent {
            return false;
        }
        let CellGrid { columns, rows, .. } = self.grid;
        let at = self.grid.cell_at(
            (x.max(0.0) as usize).min(self.grid.width_px - 1),
            (y.max(0.0) as usize).min(self.grid.height_px - 1),
        );
        let inner = |at: usize, count: usize| at.max(2) - 1..(at + 2).min(count.saturating_sub(1));
        let (row, column) = (at / columns, at % columns);
        let bends = |cell: usize, step: usize| self.bends(cell, step);
        let near = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        near(row, rows).any(|y| inner(column, columns).any(|x| bends(y * columns + x, 1)))
            || inner(row, rows)
                .any(|y| near(column, columns).any(|x| bends(y * columns + x, columns)))
    }

    /// Whether the background bends more than that of a sky, from the cell `step` before a cell to that after.
    fn bends(&self, cell: usize, step: usize) -> bool {
        /// The bend of an edge, in noises of a pixel. The background that bends by less moves stars by less than
        /// a tenth of a standard error.
        const SIGMAS: f32 = 3.0;
        bend(self.around(cell, step)) > SIGMAS * self.sigma[cell]
    }

    /// Whether it does so anywhere: in most frames it does not, and no place needs to be looked at.
    fn bends_anywhere(&self) -> bool {
        let CellGrid { columns, rows, .. } = self.grid;
        let mut cells = (0..rows).flat_map(|y| (0..columns).map(move |x| [x, y]));
        cells.any(|[x, y]| {
            let cell = y * columns + x;
            let is_inner = |at: usize, count: usize| at > 0 && at + 1 < count;
            is_inner(x, columns) && self.bends(cell, 1)
                || is_inner(y, rows) && self.bends(cell, columns)
        })
    }

    /// The column of pixels at the centre of a column of cells.
    fn center(&self, column: usize) -> f32 {
        (column as f32 + 0.5) * self.cell_width_px - 0.5
    }

    /// The position of pixel `at` among `count` nodes, `per_px` of them in a pixel: lower node and
    /// fraction, which is below 0 or above 1 outside the outermost nodes.
    fn node(at: f32, per_px: f32, count: usize) -> (usize, f32) {
        if count == 1 {
            return (0, 0.0);
        }
        let position = (at + 0.5) * per_px - 0.5;
        let lower = (position.max(0.0) as usize).min(count - 2);
        (lower, position - lower as f32)
    }

    /// Background and noise at column `x`, row `y`. Beyond the outermost nodes the background is
    /// extrapolated linearly and the noise is constant.
    #[inline]
    pub fn at(&self, x: f32, y: f32) -> (f32, f32) {
        let place = self.place(x, y);
        (
            self.blend(&self.background, place),
            self.blend(&self.sigma, place.clamped()),
        )
    }

    /// The background of [`Self::at`] alone.
    #[inline]
    pub fn background_at(&self, x: f32, y: f32) -> f32 {
        self.blend(&self.background, self.place(x, y))
    }

    /// The noise from slopes at column `x`, row `y`, along x and along y.
    pub fn slope_sigma_at(&self, x: f32, y: f32) -> [f32; 2] {
        let place = self.place(x, y).clamped();
        self.slope_sigma
            .each_ref()
            .map(|map| self.blend(map, place))
    }

    #[inline]
    fn place(&self, x: f32, y: f32) -> MeshPosition {
        let (row, down) = Self::node(y, self.rows_per_px, self.grid.rows);
        let (column, across) = Self::node(x, self.columns_per_px, self.grid.columns);
        MeshPosition {
            row,
            column,
            across,
            down,
        }
    }

    /// The value of a map at a place.
    #[inline]
    fn blend(&self, map: &[f32], place: MeshPosition) -> f32 {
        let MeshPosition {
            row,
            column,
            across,
            down,
        } = place;
        let CellGrid { columns, rows, .. } = self.grid;
        let right = (column + 1).min(columns - 1);
        let below = (row + 1).min(rows - 1);
        let in_row = |row: usize| {
            let row = &map[row * columns..][..columns];
            row[column] + across * (row[right] - row[column])
        };
        let (top, bottom) = (in_row(row), in_row(below));
        top + down * (bottom - top)
    }

    /// Background and reciprocal noise along row `y`, as straight pieces between nodes.
    ///
    /// Unlike [`Self::at`], this interpolates the reciprocal of the noise: the difference is below
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
            background: top.background + fy * (bottom.background - top.background),
            background_slope: top.background_slope
                + fy * (bottom.background_slope - top.background_slope),
            inverse_sigma: top.inverse_sigma + held * (bottom.inverse_sigma - top.inverse_sigma),
            inverse_sigma_slope: top.inverse_sigma_slope
                + held * (bottom.inverse_sigma_slope - top.inverse_sigma_slope),
            ..*top
        }));
    }

    /// Sets the pieces along each row of nodes: after any change of background or noise.
    pub fn set_pieces(&mut self) {
        self.is_bent = self.bends_anywhere();
        let columns = self.grid.columns;
        self.pieces.clear();
        for row in 0..self.grid.rows {
            let nodes = row * columns..(row + 1) * columns;
            let (background, sigma) = (&self.background[nodes.clone()], &self.sigma[nodes]);
            let spans = self.edges.windows(2).zip(&self.offsets);
            for (piece, (edge, offset)) in spans.enumerate() {
                // Beyond the outermost nodes the background is extrapolated, the noise is constant.
                let before = piece.saturating_sub(1);
                let after = piece.min(columns - 1);
                let left = before.min(columns.saturating_sub(2));
                let right = (left + 1).min(columns - 1);
                let background_slope = (background[right] - background[left]) * self.columns_per_px;
                let inverse_sigma = 1.0 / sigma[before];
                let inverse_sigma_slope =
                    (1.0 / sigma[after] - inverse_sigma) * self.columns_per_px;
                self.pieces.push(Piece {
                    start: edge[0],
                    end: edge[1],
                    background: background[before] + offset * background_slope,
                    background_slope,
                    inverse_sigma: inverse_sigma + offset * inverse_sigma_slope,
                    inverse_sigma_slope,
                });
            }
        }
    }

    /// Lower bounds of `background + sigmas·σ` in the blocks of `block_px` columns of a row of cells.
    pub fn lowest_in_blocks(
        &self,
        row: usize,
        block_px: usize,
        sigmas: f32,
        nodes: &mut Vec<[f32; 2]>,
        lowest: &mut Vec<f32>,
    ) {
        /// What rounding may add or take, relative to the largest term.
        const ROUNDING: f32 = 1e-5;
        let width = self.grid.width_px;
        lowest.clear();
        lowest.resize(width.div_ceil(block_px), f32::INFINITY);
        let of_row = self.grid.rows_of(row);
        let center_y = (row as f32 + 0.5) / self.rows_per_px - 0.5;
        // Along columns the bound is linear on either side of the nodes, along rows between them.
        for y in [of_row.start as f32, center_y, (of_row.end - 1) as f32] {
            self.nodes_at(y, nodes);
            let level = |(background, sigma): (f32, f32)| {
                background + sigmas * sigma - ROUNDING * (background.abs() + sigmas * sigma)
            };
            for (block, lowest) in lowest.iter_mut().enumerate() {
                let (first, last) = (block * block_px, ((block + 1) * block_px).min(width) - 1);
                let ends = [first, last].map(|x| level(self.at_column(nodes, x as f32)));
                *lowest = lowest.min(ends[0]).min(ends[1]);
                let (before, _) = Self::node(first as f32, self.columns_per_px, nodes.len());
                let after_first = nodes.iter().enumerate().skip(before);
                let inside = after_first
                    .skip_while(|(node, _)| self.center(*node) < first as f32)
                    .take_while(|(node, _)| self.center(*node) <= last as f32);
                for (_, &[background, sigma]) in inside {
                    *lowest = lowest.min(level((background, sigma)));
                }
            }
        }
    }

    /// Background and noise of row `y` at the nodes; between these, both are linear.
    pub fn across_row(&self, y: usize, nodes: &mut Vec<[f32; 2]>) {
        self.nodes_at(y as f32, nodes);
    }

    fn nodes_at<'a>(&'a self, y: f32, nodes: &mut Vec<[f32; 2]>) {
        let (row, fy) = Self::node(y, self.rows_per_px, self.grid.rows);
        let below = (row + 1).min(self.grid.rows - 1);
        let held = fy.clamp(0.0, 1.0);
        let columns = self.grid.columns;
        let pairs = |map: &'a [f32]| {
            let of_row = |row: usize| &map[row * columns..(row + 1) * columns];
            of_row(row).iter().zip(of_row(below))
        };
        let both = pairs(&self.background).zip(pairs(&self.sigma));
        nodes.clear();
        nodes.extend(both.map(|((top, bottom), (sigma_top, sigma_bottom))| {
            [
                top + fy * (bottom - top),
                sigma_top + held * (sigma_bottom - sigma_top),
            ]
        }));
    }

    /// The heights of adjacent pixels, the first in column `x`, above the background of the row whose
    /// nodes are given, in units of the noise: those of [`Self::at_column`].
    #[inline(always)]
    pub fn heights(&self, nodes: &[[f32; 2]], x: usize, values: &[f32], heights: &mut [f32]) {
        let (mut first, end) = (x, x + values.len());
        while first < end {
            let (column, _) = Self::node(first as f32, self.columns_per_px, nodes.len());
            let next = self.node_starts.get(column + 1);
            let last = next.map_or(end, |&next| next.min(end));
            let span = first - x..last - x;
            let line = NodeLine {
                column: column as f32,
                columns_per_px: self.columns_per_px,
                from: nodes[column],
                to: nodes[(column + 1).min(nodes.len() - 1)],
            };
            line.heights(first, &values[span.clone()], &mut heights[span]);
            first = last;
        }
    }

    /// Background and noise at column `x` of the row whose nodes are given: the same as
    /// [`Self::at`].
    pub fn at_column(&self, nodes: &[[f32; 2]], x: f32) -> (f32, f32) {
        let (column, fx) = Self::node(x, self.columns_per_px, nodes.len());
        let (a, b) = (nodes[column], nodes[(column + 1).min(nodes.len() - 1)]);
        (
            a[0] + fx * (b[0] - a[0]),
            a[1] + fx.clamp(0.0, 1.0) * (b[1] - a[1]),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    const CONFIG: MeshConfig = MeshConfig::of_pixels(64, 1e-6);

    fn noise_frame(side: usize, sigma: f32, truth: impl Fn(usize, usize) -> f32) -> Vec<f32> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let normal = Normal::new(0.0, sigma).unwrap();
        (0..side * side)
            .map(|i| truth(i % side, i / side) + normal.sample(&mut rng))
            .collect()
    }

    #[test]
    fn a_steep_gradient_changes_neither_background_nor_noise() {
        let pixels = noise_frame(256, 5.0, |x, y| 100.0 + 0.5 * x as f32 - 0.2 * y as f32);
        let mut mesh = Mesh::default();
        mesh.measure(&View::new(&pixels, 256, 256), &CONFIG);
        for (x, y) in [
            (0.0f32, 0.0f32),
            (255.0, 0.0),
            (100.0, 255.0),
            (130.0, 120.0),
        ] {
            let (background, sigma) = mesh.at(x, y);
            let truth = 100.0 + 0.5 * x - 0.2 * y;
            assert!(
                (background - truth).abs() < 1.5,
                "background {background} vs {truth} at {x},{y}"
            );
            assert!((sigma / 5.0 - 1.0).abs() < 0.05, "noise {sigma} at {x},{y}");
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
                &View::new(&square[..width * height].to_vec(), width, height),
                &CONFIG,
            );
            for (x, y) in [0, 320, width - 1]
                .iter()
                .flat_map(|&x| [0, 240, height - 1].map(|y| (x, y)))
            {
                let (background, _) = mesh.at(x as f32, y as f32);
                assert!(
                    (background - truth(x, y)).abs() < 0.25 * NOISE,
                    "gradient {across}, {down}: {background} at ({x}, {y}), expected {}",
                    truth(x, y)
                );
            }
        }
    }

    #[test]
    fn a_cell_full_of_light_takes_the_background_around_it_also_in_a_corner() {
        for (x0, y0) in [(0, 0), (320, 320), (256, 0), (128, 128)] {
            let is_lit = |x: usize, y: usize| x / 64 == x0 / 64 && y / 64 == y0 / 64;
            let truth = |x: usize, y: usize| 100.0 + 0.1 * x as f32 + 0.05 * y as f32;
            let lit = |x, y| truth(x, y) + if is_lit(x, y) { 80.0 } else { 0.0 };
            let pixels = noise_frame(384, 3.0, lit);
            let mut mesh = Mesh::default();
            mesh.measure(&View::new(&pixels, 384, 384), &CONFIG);
            let (x, y) = (x0 + 32, y0 + 32);
            let (background, _) = mesh.at(x as f32, y as f32);
            assert!(
                (background - truth(x, y)).abs() < 15.0,
                "({x}, {y}): {background}"
            );
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
                    let (background, sigma) = mesh.at(x as f32, y as f32);
                    assert!(
                        (piece.background + t * piece.background_slope - background).abs() < 1e-2
                    );
                    let inverse = piece.inverse_sigma + t * piece.inverse_sigma_slope;
                    assert!((inverse * sigma - 1.0).abs() < 1e-2);
                }
            }
        }
    }

    /// A mesh whose background and noise change much from cell to cell.
    fn uneven_mesh(width: usize, height: usize) -> Mesh {
        let pixels = noise_frame(width.max(height), 5.0, |x, y| {
            ((x / 40 * 7 + y / 30 * 5) % 11) as f32 * 60.0 + (x * y % 97) as f32
        });
        let mut mesh = Mesh::default();
        let view = View::new(&pixels, width, height);
        mesh.measure(&view, &MeshConfig::of_pixels(32, 1e-6));
        mesh
    }

    #[test]
    fn heights_are_those_of_each_pixel_by_itself() {
        for (width, height) in [(200, 70), (33, 40), (20, 20)] {
            let mesh = uneven_mesh(width, height);
            let mut nodes = Vec::new();
            for y in [0, 13, height - 1] {
                mesh.across_row(y, &mut nodes);
                for x in [0, 7, width - 9] {
                    let values: Vec<f32> = (x..width.min(x + 64)).map(|x| x as f32 * 1.7).collect();
                    let mut heights = vec![0.0; values.len()];
                    mesh.heights(&nodes, x, &values, &mut heights);
                    for ((x, value), height) in (x..).zip(values).zip(heights) {
                        let (background, sigma) = mesh.at_column(&nodes, x as f32);
                        assert_eq!(height, (value - background) / sigma, "{x}, {y}");
                    }
                }
            }
        }
    }

    #[test]
    fn no_pixel_is_below_the_lowest_of_its_block_which_is_close() {
        for (width, height) in [(200, 170), (33, 40), (20, 20)] {
            let mesh = uneven_mesh(width, height);
            let (mut nodes, mut lowest) = (Vec::new(), Vec::new());
            for row in 0..mesh.grid.rows {
                mesh.lowest_in_blocks(row, 64, 4.0, &mut nodes, &mut lowest);
                assert_eq!(lowest.len(), width.div_ceil(64));
                for (block, lowest) in lowest.iter().enumerate() {
                    let level = |(x, y): (usize, usize)| {
                        let (background, sigma) = mesh.at(x as f32, y as f32);
                        background + 4.0 * sigma
                    };
                    let columns = block * 64..width.min(block * 64 + 64);
                    let pixels = columns.flat_map(|x| mesh.grid.rows_of(row).map(move |y| (x, y)));
                    let expected = pixels.map(level).fold(f32::INFINITY, f32::min);
                    // Nodes lie between pixels, and the mesh is steep.
                    let close = expected - 12.0;
                    assert!((close..=expected).contains(lowest), "{lowest} {expected}");
                }
            }
        }
    }

    #[test]
    fn a_cell_without_values_takes_its_neighbors() {
        let mut pixels = noise_frame(192, 2.0, |_, _| 50.0);
        for y in 64..128 {
            pixels[y * 192 + 64..y * 192 + 128].fill(f32::NAN);
        }
        let mut mesh = Mesh::default();
        mesh.measure(&View::new(&pixels, 192, 192), &CONFIG);
        let (background, sigma) = mesh.at(96.0, 96.0);
        assert!((background - 50.0).abs() < 0.5 && (sigma - 2.0).abs() < 0.2);
    }
}
