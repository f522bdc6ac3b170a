//! Background and noise of the frame, with the buffers to measure them.

use super::cell_rows::CellRows;
use super::cells::CellMeasurer;
use super::cut_off::CutOff;
use super::mesh::Mesh;
use super::mesh_config::MeshConfig;
use crate::base::interrupt::Interrupted;
use crate::base::statistics;
use crate::detect::pixels::{BlockMaxima, View, largest_magnitude_in_row, lower, lowest_in_row};

/// Noise below this multiple of that of rounding, about half a step, is coarse: a few isolated
/// pixels.
const COARSE: f32 = 1.75;
/// The standard deviation of rounding to whole steps, over the step: 1/√12.
const ROUNDING_SIGMA: f32 = 0.288_675_13;
/// The precision of single-precision pixels, relative to the largest.
const RELATIVE_PRECISION: f32 = 1e-6;

/// Background and noise of a frame, in ADU.
#[derive(Debug, Clone, Default)]
pub(crate) struct FrameBackground {
    /// Background and standard deviation of the noise of a pixel, in ADU.
    pub mesh: Mesh,
    /// Median of the background over the mesh, in ADU.
    pub median_adu: f64,
    /// Median of the noise over the mesh, in ADU.
    pub median_sigma_adu: f64,
    /// Whether the noise is coarse: about half a step or less.
    pub is_coarse: bool,
    /// Where the noise is cut off at the lowest value.
    pub cut_off: CutOff,
    /// Pixels that were sampled since this was set to 0.
    pub visited_px: usize,
    /// The lowest sampled pixel of each row of cells, in ADU.
    lowest_adu: Vec<f32>,
    /// One for each thread.
    workers: Vec<BackgroundWorker>,
    sorted: Vec<f32>,
    row: Vec<f32>,
}

/// The buffers of one thread.
#[derive(Debug, Clone, Default)]
struct BackgroundWorker {
    measurer: CellMeasurer,
    sampled: Vec<f32>,
}

impl FrameBackground {
    /// Shares the rows of cells among `threads` threads.
    pub fn set_threads(&mut self, threads: usize) {
        self.workers.resize_with(threads, BackgroundWorker::default);
    }

    /// Measures background and noise in cells of about `cell_px` pixels a side.
    ///
    /// # Errors
    /// [`Interrupted`].
    pub fn measure(
        &mut self,
        view: &View<'_>,
        step_adu: f32,
        cell_px: usize,
    ) -> Result<(), Interrupted> {
        let config = MeshConfig::of_pixels(cell_px, sigma_floor(view, step_adu, &mut self.row));
        self.measure_with(view, &config)
    }

    /// The same from a quarter of the pixels.
    ///
    /// # Errors
    /// [`Interrupted`].
    pub fn measure_sparsely(
        &mut self,
        view: &View<'_>,
        step_adu: f32,
        cell_px: usize,
    ) -> Result<(), Interrupted> {
        let config = MeshConfig::of_pixels(cell_px, sigma_floor(view, step_adu, &mut self.row));
        self.measure_with(view, &config.sparse())
    }

    fn measure_with(&mut self, view: &View<'_>, config: &MeshConfig) -> Result<(), Interrupted> {
        self.mesh.prepare(view.size(), config);
        let grid = self.mesh.grid;
        self.visited_px += view.height.div_ceil(grid.row_stride) * view.width;
        self.lowest_adu.resize(grid.rows, 0.0);
        let mut no_maxima = BlockMaxima::default();
        let cell_rows = CellRows::new(&mut self.mesh, &mut no_maxima, &mut self.lowest_adu);
        cell_rows.distribute(&mut self.workers, &|worker, cells| {
            if view.is_interrupted() {
                return;
            }
            let BackgroundWorker { measurer, sampled } = worker;
            let rows = view.sampled(cells.rows, grid.row_stride, sampled);
            // This also brings the rows from memory in one go, and not cell by cell.
            let minimum = |m, y| lowest_in_row(m, rows.row(y));
            *cells.output = (0..rows.height).fold(f32::INFINITY, minimum);
            measurer.measure_row(&grid, rows, config, cells.background, cells.sigma);
        });
        view.check()?;
        let coarse_adu = COARSE * self.mesh.sigma_floor;
        let lowest_adu = self.lowest_adu();
        self.cut_off
            .find(view, &mut self.mesh, lowest_adu, coarse_adu);
        self.mesh.finish();
        let beneath_adu = median(&self.mesh.sigma, &mut self.sorted);
        self.is_coarse = beneath_adu < f64::from(coarse_adu);
        self.cut_off.apply(&mut self.mesh);
        self.median_adu = median(&self.mesh.background, &mut self.sorted);
        self.median_sigma_adu = median(&self.mesh.sigma, &mut self.sorted);
        Ok(())
    }

    /// The lowest sampled pixel, in ADU.
    pub fn lowest_adu(&self) -> f32 {
        self.lowest_adu.iter().copied().fold(f32::INFINITY, lower)
    }
}

/// The noise of rounding to steps of `step_adu`, in ADU.
pub(crate) fn rounding_sigma_adu(step_adu: f32) -> f32 {
    ROUNDING_SIGMA * step_adu
}

/// A noise that is certainly below that of the frame, in ADU: that of rounding, or the precision of
/// the pixels' numbers.
pub(crate) fn sigma_floor(view: &View<'_>, step_adu: f32, row: &mut Vec<f32>) -> f32 {
    const SAMPLED_ROWS: usize = 16;
    let rows = (0..view.height).step_by((view.height / SAMPLED_ROWS).max(1));
    let largest = rows.fold(0.0, |m, y| {
        largest_magnitude_in_row(m, view.row(y).as_floats(row))
    });
    let precision = (largest * RELATIVE_PRECISION).max(f32::MIN_POSITIVE * 1e6);
    rounding_sigma_adu(step_adu).max(precision)
}

/// The median, of two middle values the upper; 0 without values. `sorted` is a buffer.
pub(crate) fn median(values: &[f32], sorted: &mut Vec<f32>) -> f64 {
    sorted.clear();
    sorted.extend_from_slice(values);
    statistics::median(sorted).into()
}
