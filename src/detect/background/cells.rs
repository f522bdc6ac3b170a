//! Background and noise of single cells: a clipped mean and standard deviation, started from the
//! median and the lower quantile of a few samples, for stars are above the median and not below.

use super::clipping::{CellSamples, DIFFERENCE_PX, Gaussian, MIN_SAMPLES, Tolerance, clipped};
use super::grid::CellGrid;
use super::medians::{self, CELL_LANES, CellLanes};
use super::mesh_config::{MeshConfig, Sampled};
use crate::detect::pixels::PixelRows;
use std::f32::consts::SQRT_2;
use std::ops::Range;

/// Of the pixels of the filtered frame, whose mean is wanted well below its noise.
const FILTERED_TOLERANCE: Tolerance = Tolerance {
    mean: 1.2e-2,
    sigma: 1.2e-2,
};
/// Of the pixels of the frame: a 37th of an error of the mean is left after the last round, and σ
/// is only a start for that of differences.
const PIXEL_TOLERANCE: Tolerance = Tolerance {
    mean: 0.1,
    sigma: 0.2,
};
/// Of differences, whose mean is 0; what is left of an error of σ is of second order.
const DIFFERENCE_TOLERANCE: Tolerance = Tolerance {
    mean: 1.0,
    sigma: 0.05,
};

/// Measures cells; holds the buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct CellMeasurer {
    sorted: Vec<f32>,
}

impl CellMeasurer {
    /// Measures background and noise of a row of cells, of which `rows` of pixels are sampled; NaN
    /// where a cell has too few values.
    pub fn measure_row(
        &mut self,
        grid: &CellGrid,
        rows: PixelRows<'_>,
        config: &MeshConfig,
        background: &mut [f32],
        sigma: &mut [f32],
    ) {
        for first in (0..grid.columns).step_by(CELL_LANES) {
            let cells = first..(first + CELL_LANES).min(grid.columns);
            let mut starts = [None; CELL_LANES];
            match config.sampled {
                Sampled::Filtered => starts.fill(Some(Gaussian {
                    mean: 0.0,
                    sigma: 1.0,
                })),
                Sampled::Pixels => starts_of_cells(grid, cells.clone(), &rows, &mut starts),
            }
            for (cell, start) in cells.zip(starts) {
                let columns = grid.columns_of(cell);
                let all = || start_of_all(&rows.columns(columns.clone()), &mut self.sorted);
                let start = start.or_else(all);
                let measured = start.and_then(|start| measure_cell(&rows, columns, start, config));
                (background[cell], sigma[cell]) =
                    measured.map_or((f32::NAN, f32::NAN), |cell| (cell.mean, cell.sigma));
            }
        }
    }
}

/// Measures the noise of a row of cells of the filtered frame again, from differences of pixels
/// [`DIFFERENCE_PX`] columns and rows apart: `sigma` of the pixels is a start, `rho` the correlation of white noise
/// that far apart. NaN where a cell has too few values.
///
/// An error of a position is one of the slope of the filtered light, to which clouds and the Milky Way add
/// less than to the light itself.
pub(crate) fn measure_slopes(
    grid: &CellGrid,
    pixels: &SlopePixels<'_>,
    rho: f32,
    sigma: &[f32],
    slope_sigma: [&mut [f32]; 2],
) {
    let white = (1.0 - rho).sqrt();
    for (cell, &sigma) in sigma.iter().enumerate() {
        let columns = grid.columns_of(cell);
        let before = columns.start..columns.end.saturating_sub(DIFFERENCE_PX);
        let after = columns.start + DIFFERENCE_PX..columns.end;
        let measure = |rows, columns| {
            let measured = sigma_of_differences(rows, columns, sigma * white, 0.0);
            measured.map_or(f32::NAN, |sigma| sigma / white)
        };
        slope_sigma[0][cell] = measure([&pixels.rows; 2], [before, after]);
        slope_sigma[1][cell] = measure([&pixels.above, &pixels.below], [columns.clone(), columns]);
    }
}

/// Sampled rows of a row of cells, for differences.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlopePixels<'a> {
    /// The rows.
    pub rows: PixelRows<'a>,
    /// Those before some rows that have two neighbors, one for each.
    pub above: PixelRows<'a>,
    /// Those after these.
    pub below: PixelRows<'a>,
}

/// Background and noise of a cell; `None` where it has too few values.
fn measure_cell(
    rows: &PixelRows<'_>,
    columns: Range<usize>,
    start: Gaussian,
    config: &MeshConfig,
) -> Option<Gaussian> {
    let pixels = CellSamples {
        rows: rows.columns(columns.clone()),
        less: None,
    };
    let floor = config.sigma_floor;
    match config.sampled {
        Sampled::Filtered => clipped(&pixels, start, floor, FILTERED_TOLERANCE),
        Sampled::Pixels => {
            let cell = clipped(&pixels, start, floor, PIXEL_TOLERANCE)?;
            // The last differences of a cell reach into the next.
            let later =
                columns.start + DIFFERENCE_PX..(columns.end + DIFFERENCE_PX).min(rows.width);
            let sigma = sigma_of_differences([rows, rows], [columns, later], cell.sigma, floor);
            Some(Gaussian {
                sigma: sigma.unwrap_or(cell.sigma),
                ..cell
            })
        }
    }
}

/// The noise of a pixel from the differences between two sets of pixels, which gradients do not widen, if
/// they were independent; `None` for too few.
fn sigma_of_differences(
    rows: [&PixelRows<'_>; 2],
    columns: [Range<usize>; 2],
    start: f32,
    floor: f32,
) -> Option<f32> {
    let width = columns[0].len().min(columns[1].len());
    if width * rows[0].height < MIN_SAMPLES {
        return None;
    }
    let [first, second] =
        [0, 1].map(|i| rows[i].columns(columns[i].start..columns[i].start + width));
    let differences = CellSamples {
        rows: second,
        less: Some(first),
    };
    let start = Gaussian {
        mean: 0.0,
        sigma: start * SQRT_2,
    };
    let measured = clipped(&differences, start, floor * SQRT_2, DIFFERENCE_TOLERANCE);
    measured.map(|differences| differences.sigma / SQRT_2)
}

/// First estimates from a few pixels of up to [`CELL_LANES`] cells, sorted side by side; `None` for
/// cells with a NaN among them.
fn starts_of_cells(
    grid: &CellGrid,
    cells: Range<usize>,
    rows: &PixelRows<'_>,
    starts: &mut [Option<Gaussian>; CELL_LANES],
) {
    const SAMPLES: usize = medians::SORTED;
    /// The golden ratio: its multiples spread evenly over the columns.
    const STEP: f32 = 0.618_034;
    let mut samples: [CellLanes; SAMPLES] = [[0.0; CELL_LANES]; SAMPLES];
    let width = grid.width_px / grid.columns;
    for (i, sample) in samples.iter_mut().enumerate() {
        let row = rows.row(i % rows.height);
        let offset = ((i as f32 * STEP).fract() * width as f32) as usize;
        for (value, cell) in sample.iter_mut().zip(cells.clone()) {
            *value = row[grid.columns_of(cell).start + offset];
        }
    }
    // NaN if any sample is.
    let mut sums = [0.0f32; CELL_LANES];
    for sample in &samples {
        for lane in 0..CELL_LANES {
            sums[lane] += sample[lane];
        }
    }
    medians::sort_lanes(&mut samples);
    for lane in 0..cells.len() {
        let quantile = |q: f32| samples[(q * (SAMPLES - 1) as f32).round() as usize][lane];
        let is_known = !sums[lane].is_nan();
        starts[lane] = is_known.then(|| by_quantiles(quantile));
    }
}

/// A first estimate from all pixels in `rows`; `None` for too few.
fn start_of_all(rows: &PixelRows<'_>, sorted: &mut Vec<f32>) -> Option<Gaussian> {
    sorted.clear();
    let values = (0..rows.height).flat_map(|y| rows.row(y));
    sorted.extend(values.filter(|v| !v.is_nan()));
    if sorted.len() < MIN_SAMPLES {
        return None;
    }
    sorted.sort_unstable_by(f32::total_cmp);
    let last = (sorted.len() - 1) as f32;
    Some(by_quantiles(|q| sorted[(q * last).round() as usize]))
}

/// The median, and its distance to the quantile of −1σ.
fn by_quantiles(quantile: impl Fn(f32) -> f32) -> Gaussian {
    let median = quantile(0.5);
    let below = median - quantile(0.159);
    let above = quantile(0.841) - median;
    Gaussian {
        mean: median,
        // Noise that is clipped at zero may have nothing below its median.
        sigma: if below > 0.0 { below } else { above },
    }
}
