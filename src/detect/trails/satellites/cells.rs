//! What is left of a frame without its stars, in square cells.

use super::input::TrailSearch;
use super::radon::{self, RadonLine};
use crate::base::coords::PixelPoint;
use crate::base::statistics::median_and_sigma;
use crate::detect::background::Piece;
use crate::detect::detection::Detection;
use std::ops::RangeInclusive;

/// Most cells of a map: it takes 4 MB, and the sums along its lines twice that.
const MAX_CELLS: usize = 1 << 20;
/// Largest value of a cell, in standard deviations: a few bright ones make no line.
const MAX_SIGMA: f32 = 3.0;
/// Cells around a cell, to each side, by which its level and its noise are measured.
const AROUND: usize = 10;

/// Light in square cells over its noise; 0 where there is a star, no light, or no sky.
pub(super) struct CellMap {
    pub side_px: usize,
    pub columns: usize,
    pub rows: usize,
    /// Row by row.
    pub values: Vec<f32>,
    /// Which of them hold neither stars nor anything else that is known.
    is_free: Vec<bool>,
}

impl CellMap {
    /// The map of a frame. Cells are as large as a star, or larger where the frame is.
    pub fn build(search: &TrailSearch<'_>) -> Self {
        let view = search.view;
        let pixels = (view.width * view.height) as f64;
        let least = (pixels / MAX_CELLS as f64).sqrt().ceil();
        let side_px = least.max((1.5 * search.spot_px).round()).max(1.0) as usize;
        let (columns, rows) = (view.width / side_px, view.height / side_px);
        let mut map = Self {
            side_px,
            columns,
            rows,
            values: vec![0.0; columns * rows],
            is_free: vec![true; columns * rows],
        };
        map.add_light(search);
        map.mask_stars(search);
        map.mask_what_hides_the_sky(search);
        map.level();
        let scatter = map.scatter_of_runs();
        for value in &mut map.values {
            *value /= scatter;
        }
        map
    }

    /// Standard deviation of the sums of neighbours along rows and columns, over that of independent cells:
    /// 1, or more where noise is correlated, as in JPEG files.
    fn scatter_of_runs(&self) -> f32 {
        const RUN: usize = 8;
        const MIN_RUNS: usize = 100;
        let of = |[first, second]: [usize; 2], strides: [usize; 2]| {
            let starts = (0..second).flat_map(|line| {
                (0..first / RUN).map(move |run| line * strides[1] + run * RUN * strides[0])
            });
            let cells = |start: usize| (0..RUN).map(move |step| start + step * strides[0]);
            let free = starts.filter(|&start| cells(start).all(|cell| self.is_free[cell]));
            let sum = |start: usize| cells(start).map(|cell| f64::from(self.values[cell])).sum();
            let mut sums: Vec<f64> = free.map(sum).collect();
            if sums.len() < MIN_RUNS {
                return 1.0;
            }
            median_and_sigma(&mut sums).1 / (RUN as f64).sqrt()
        };
        let along_rows = of([self.columns, self.rows], [1, self.columns]);
        let along_columns = of([self.rows, self.columns], [self.columns, 1]);
        along_rows.max(along_columns).max(1.0) as f32
    }

    /// Adds up the pixels above the background; cells without a part of them are not free.
    fn add_light(&mut self, search: &TrailSearch<'_>) {
        let mut pieces: Vec<Piece> = Vec::new();
        let mut pixels = vec![0.0; search.view.width];
        for y in 0..self.rows * self.side_px {
            search.view.row(y).copy_to(&mut pixels);
            search.mesh.row_pieces(y, &mut pieces);
            for piece in &pieces {
                for (right, pixel) in pixels[piece.start..piece.end].iter_mut().enumerate() {
                    let right = right as f32;
                    let background = piece.background + right * piece.background_slope;
                    let inverse_sigma = piece.inverse_sigma + right * piece.inverse_sigma_slope;
                    *pixel = (*pixel - background) * inverse_sigma;
                }
            }
            let first = y / self.side_px * self.columns;
            let cells = pixels.chunks_exact(self.side_px);
            for (value, cell) in self.values[first..][..self.columns].iter_mut().zip(cells) {
                *value += cell.iter().sum::<f32>();
            }
        }
        for (value, is_free) in self.values.iter_mut().zip(&mut self.is_free) {
            *is_free = value.is_finite();
            // White noise gets a standard deviation of 1.
            *value /= self.side_px as f32;
        }
    }

    /// Masks stars and hot pixels, as far out as their light matters.
    fn mask_stars(&mut self, search: &TrailSearch<'_>) {
        let (x0, y0) = (search.view.x0 as f64, search.view.y0 as f64);
        let stars = search.found.sources.iter();
        let is_masked =
            |star: &&Detection| !star.flags.trail && (!star.flags.extended || star.flags.saturated);
        for star in stars.filter(is_masked) {
            let at = PixelPoint::new(star.position.x - x0, star.position.y - y0);
            let height = (star.peak_adu / search.found.noise_adu.max(f64::MIN_POSITIVE)).max(1.0);
            // The wings of real spots fall off with about the fourth power of the distance.
            let radius_px = search.spot_px * (2.0 * height.sqrt().sqrt()).max(3.0);
            self.mask([at, at], radius_px);
        }
    }

    fn mask_what_hides_the_sky(&mut self, search: &TrailSearch<'_>) {
        let Some(area) = &search.found.sky_area else {
            return;
        };
        for row in 0..self.rows {
            for column in 0..self.columns {
                let [x, y] = [column, row].map(|cell| self.middle_px(cell));
                let place = PixelPoint::new(x + search.view.x0 as f64, y + search.view.y0 as f64);
                if !area.shows(&place) {
                    self.is_free[row * self.columns + column] = false;
                }
            }
        }
    }

    /// Subtracts the level around each cell, and divides by the scatter around it: both are of more than
    /// the cells of a line.
    fn level(&mut self) {
        let free = |value: f32, is_free: bool| if is_free { value } else { 0.0 };
        let (columns, rows) = (self.columns, self.rows);
        let mut sums = vec![[0.0_f64; 3]; (columns + 1) * (rows + 1)];
        for row in 0..rows {
            let mut in_row = [0.0; 3];
            for column in 0..columns {
                let cell = row * columns + column;
                let is_free = self.is_free[cell];
                let value =
                    free(self.values[cell], is_free).clamp(-2.0 * MAX_SIGMA, 2.0 * MAX_SIGMA);
                let value = f64::from(value);
                let terms = [f64::from(u8::from(is_free)), value, value * value];
                let above = sums[row * (columns + 1) + column + 1];
                for part in 0..3 {
                    in_row[part] += terms[part];
                    sums[(row + 1) * (columns + 1) + column + 1][part] = above[part] + in_row[part];
                }
            }
        }
        for row in 0..rows {
            let (top, bottom) = (row.saturating_sub(AROUND), (row + AROUND + 1).min(rows));
            for column in 0..columns {
                let cell = row * columns + column;
                if !self.is_free[cell] {
                    self.values[cell] = 0.0;
                    continue;
                }
                let (left, right) = (
                    column.saturating_sub(AROUND),
                    (column + AROUND + 1).min(columns),
                );
                let at = |row: usize, column: usize| sums[row * (columns + 1) + column];
                let corners = [
                    at(bottom, right),
                    at(top, right),
                    at(bottom, left),
                    at(top, left),
                ];
                let [count, sum, squares] = [0, 1, 2].map(|part| {
                    corners[0][part] - corners[1][part] - corners[2][part] + corners[3][part]
                });
                let mean = sum / count;
                let sigma = (squares / count - mean * mean)
                    .max(0.0)
                    .sqrt()
                    .max(f64::MIN_POSITIVE);
                let value = (f64::from(self.values[cell]) - mean) / sigma;
                self.values[cell] = (value as f32).clamp(-MAX_SIGMA, MAX_SIGMA);
            }
        }
    }

    fn middle_px(&self, cell: usize) -> f64 {
        (cell as f64 + 0.5) * self.side_px as f64 - 0.5
    }

    /// Whether the pixel at a place is part of a cell without a star.
    pub fn is_free_at(&self, x: usize, y: usize) -> bool {
        let (column, row) = (x / self.side_px, y / self.side_px);
        column < self.columns && row < self.rows && self.is_free[row * self.columns + column]
    }

    /// Empties the cells near a line: what is found is not found again.
    pub fn clear(&mut self, ends_px: [PixelPoint; 2], reach_px: f64) {
        self.for_cells_near(ends_px, reach_px, |map, cell| map.values[cell] = 0.0);
    }

    fn mask(&mut self, ends_px: [PixelPoint; 2], reach_px: f64) {
        self.for_cells_near(ends_px, reach_px, |map, cell| map.is_free[cell] = false);
    }

    fn for_cells_near(
        &mut self,
        [begin, end]: [PixelPoint; 2],
        reach_px: f64,
        mut act: impl FnMut(&mut Self, usize),
    ) {
        let side_px = self.side_px as f64;
        // Half of a cell's diagonal.
        let reach_px = reach_px + 0.71 * side_px;
        let cell_of = |px: f64, cells: usize| (px / side_px).clamp(0.0, cells as f64) as usize;
        let (left, right) = (begin.x.min(end.x) - reach_px, begin.x.max(end.x) + reach_px);
        let (top, bottom) = (begin.y.min(end.y) - reach_px, begin.y.max(end.y) + reach_px);
        let length_sq = (end.x - begin.x).powi(2) + (end.y - begin.y).powi(2);
        for row in cell_of(top, self.rows)..(cell_of(bottom, self.rows) + 1).min(self.rows) {
            for column in
                cell_of(left, self.columns)..(cell_of(right, self.columns) + 1).min(self.columns)
            {
                let (x, y) = (
                    self.middle_px(column) - begin.x,
                    self.middle_px(row) - begin.y,
                );
                let (dx, dy) = (end.x - begin.x, end.y - begin.y);
                let along = if length_sq > 0.0 {
                    ((x * dx + y * dy) / length_sq).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                if libm::hypot(x - along * dx, y - along * dy) < reach_px {
                    act(self, row * self.columns + column);
                }
            }
        }
    }

    /// The lines that stand out, strongest first; in a map of noise there are `false_alarms`.
    pub fn significant_lines(&self, false_alarms: f64) -> Vec<RadonLine> {
        radon::significant_lines([self.columns, self.rows], &self.values, false_alarms)
    }

    /// Whether a line still stands out.
    pub fn is_significant(&self, line: &RadonLine, false_alarms: f64) -> bool {
        self.log10_false_alarm(line.in_pixels(self.side_px)) <= libm::log10(false_alarms)
    }

    /// Decimal logarithm of the number of lines in noise that stand out as much as the cells along one
    /// do. Where lines beside it scatter more than noise does, as in front of trees and clouds, it has to
    /// stand out from them.
    pub fn log10_false_alarm(&self, ends_px: [PixelPoint; 2]) -> f64 {
        /// Distances of the lines beside it, in cells.
        const BESIDE: RangeInclusive<i32> = 4..=10;
        /// Scatter that is more than that of few lines of noise.
        const MAX_SCATTER: f64 = 1.5;
        let shifts = BESIDE.flat_map(|away| [-away, away]);
        let mut beside: Vec<f64> = shifts
            .filter_map(|shift| self.snr_of(ends_px, f64::from(shift)))
            .collect();
        // Their mean is low beside a bright line, which raises the level around it.
        let scatter = match beside.is_empty() {
            true => 1.0,
            false => median_and_sigma(&mut beside).1,
        };
        let noise = if scatter > MAX_SCATTER { scatter } else { 1.0 };
        self.log10_lines_of_noise(self.snr_of(ends_px, 0.0).unwrap_or(0.0) / noise)
    }

    /// Decimal logarithm of the number of lines in noise that exceed this signal-to-noise ratio.
    pub fn log10_lines_of_noise(&self, snr: f64) -> f64 {
        radon::log10_tail(snr) + libm::log10(radon::lines_of(self.columns, self.rows) as f64)
    }

    /// Sum of the cells along a line, moved across by so many cells, over its standard deviation in noise;
    /// `None` where most of it is outside of the map.
    fn snr_of(&self, [begin, end]: [PixelPoint; 2], shift: f64) -> Option<f64> {
        let side_px = self.side_px as f64;
        let cell = |px: f64| (px + 0.5) / side_px - 0.5;
        let [x0, y0, x1, y1] = [begin.x, begin.y, end.x, end.y].map(cell);
        let (dx, dy) = (x1 - x0, y1 - y0);
        let across = [-dy, dx].map(|part| shift * part / libm::hypot(dx, dy));
        let steps = dx.abs().max(dy.abs()).round().max(1.0) as usize;
        let value = |step: usize| {
            let part = step as f64 / steps as f64;
            let x = (x0 + part * dx + across[0]).round();
            let y = (y0 + part * dy + across[1]).round();
            let is_inside = x >= 0.0 && y >= 0.0 && x < self.columns as f64 && y < self.rows as f64;
            is_inside.then(|| f64::from(self.values[y as usize * self.columns + x as usize]))
        };
        let values: Vec<f64> = (0..=steps).filter_map(value).collect();
        let sum: f64 = values.iter().sum();
        (2 * values.len() > steps).then(|| sum / (values.len() as f64).sqrt())
    }
}
