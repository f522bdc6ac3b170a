//! The filtered frame: its noise, and the candidates in it.
//!
//! The frame is filtered band by band. While a band is in the cache, its noise is measured and its
//! candidates are gathered, so the filtered frame is never in memory as a whole.

use super::candidate_pixels::Candidates;
use super::memory::check_count;
use crate::base::interrupt::Interrupted;
use crate::detect::DetectError;
use crate::detect::background::{CellMeasurer, CellRows, Mesh, MeshConfig, measure_slopes};
use crate::detect::filter::{FilteredBand, Kernel};
use crate::detect::pixels::{BLOCK_PX, BlockMaxima, View};
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Least noise of the filtered frame, as a part of that of independent pixels: a frame that is
/// smooth below its own rounding is not known better.
const SIGMA_FLOOR: f32 = 0.5;
/// Candidates are gathered from this part of the threshold of their own row of cells on: the final
/// threshold, from the smoothed mesh, is hardly lower.
const CANDIDATE_MARGIN: f32 = 0.85;
/// Of larger frames, at least this many pixels are sampled.
const SAMPLED_PX: usize = 2_000_000;

/// What is kept of a filtered frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct FilteredFrame {
    /// Mean and standard deviation of the filtered frame, in units of the frame's noise.
    pub mesh: Mesh,
    /// The maxima of the blocks that hold candidates.
    pub maxima: BlockMaxima,
    /// The candidates of each row of cells.
    pub candidates: Vec<Candidates>,
    /// Pixels that were filtered since this was set to 0.
    pub visited_px: usize,
    /// One for each thread.
    workers: Vec<FilterWorker>,
}

/// Which pixels are gathered.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CandidateLimits {
    /// Those that may be above this many standard deviations.
    pub threshold: f64,
    /// How many a frame may have.
    pub most: usize,
}

/// The buffers of one thread.
#[derive(Debug, Clone, Default)]
struct FilterWorker {
    cells: CellMeasurer,
    band: FilteredBand,
    /// The cut for each block of columns.
    cuts: Vec<f32>,
    nodes: Vec<[f32; 2]>,
}

impl FilteredFrame {
    /// The number of candidates.
    pub fn candidate_count(&self) -> usize {
        self.candidates.iter().map(Candidates::len).sum()
    }

    /// Shares the rows of cells among `threads` threads.
    pub fn set_threads(&mut self, threads: usize) {
        self.workers.resize_with(threads, FilterWorker::default);
    }

    /// Filters the frame, measures mean and noise in cells of about `cell_px` pixels a side, and
    /// gathers the pixels that may be above the threshold.
    ///
    /// # Errors
    /// [`DetectError::Interrupted`], [`DetectError::TooCrowded`].
    pub fn filter(
        &mut self,
        view: &View<'_>,
        background: &Mesh,
        kernel: &Kernel,
        cell_px: usize,
        gathered: &CandidateLimits,
    ) -> Result<(), DetectError> {
        let Self {
            mesh,
            maxima,
            candidates,
            visited_px,
            workers,
        } = self;
        *visited_px += view.width * view.height;
        let config = MeshConfig::of_filtered(cell_px, SIGMA_FLOOR);
        mesh.prepare(view.size(), &config);
        maxima.prepare(view.size());
        let grid = mesh.grid;
        candidates.resize_with(grid.rows, Candidates::default);
        for worker in workers.iter_mut() {
            worker.band.prepare(view.width, kernel);
        }
        let total = AtomicUsize::new(0);
        CellRows::new(mesh, maxima, candidates).distribute(workers, &|worker, row| {
            if view.is_interrupted() {
                return;
            }
            let FilterWorker {
                cells, band, cuts, ..
            } = worker;
            let rows = row.rows;
            let filtered = with_neighbors(&rows, view.height);
            band.filter(view, background, kernel, filtered);
            let sampled = band.sampled(rows.clone(), grid.row_stride);
            cells.measure_row(&grid, sampled, &config, row.background, row.sigma);
            let slopes = band.slope_pixels(&rows, grid.row_stride, view.height);
            measure_slopes(&grid, &slopes, kernel.slope_rho, row.sigma, row.slope_sigma);
            let cut = candidate_cut(row.background, row.sigma, gathered.threshold as f32);
            let most = gathered.most.saturating_sub(total.load(Ordering::Relaxed));
            cuts.clear();
            cuts.resize(view.width.div_ceil(BLOCK_PX), cut);
            row.output.gather(band, rows, cuts, most, Some(row.maxima));
            total.fetch_add(row.output.len(), Ordering::Relaxed);
        });
        view.check()?;
        check_count(total.into_inner(), gathered.most)?;
        mesh.finish();
        mesh.finish_slopes();
        Ok(())
    }

    /// Gathers candidates again in the rows of cells where the threshold is lower than the cut so
    /// far.
    ///
    /// # Errors
    /// [`DetectError::Interrupted`], [`DetectError::TooCrowded`].
    pub fn gather_missed(
        &mut self,
        view: &View<'_>,
        background: &Mesh,
        kernel: &Kernel,
        gathered: &CandidateLimits,
    ) -> Result<(), DetectError> {
        let mut total = self.candidate_count();
        let Some(worker) = self.workers.first_mut() else {
            return Ok(());
        };
        let FilterWorker {
            band, cuts, nodes, ..
        } = worker;
        let threshold = gathered.threshold as f32;
        for (row, candidates) in self.candidates.iter_mut().enumerate() {
            self.mesh
                .lowest_in_blocks(row, BLOCK_PX, threshold, nodes, cuts);
            if !candidates.reach_down_to(cuts) {
                view.check()?;
                let rows = self.mesh.grid.rows_of(row);
                self.visited_px += rows.len() * view.width;
                let filtered = with_neighbors(&rows, view.height);
                band.filter(view, background, kernel, filtered);
                total -= candidates.len();
                let most = gathered.most.saturating_sub(total);
                candidates.gather(band, rows, cuts, most, None);
                total += candidates.len();
                check_count(total, gathered.most)?;
            }
        }
        Ok(())
    }

    /// Filters rows of cells spread over the frame again, and calls `each` with every row in them
    /// that has two neighbors, with these and its number.
    ///
    /// # Errors
    /// [`Interrupted`].
    pub fn for_sampled_rows(
        &mut self,
        view: &View<'_>,
        background: &Mesh,
        kernel: &Kernel,
        mut each: impl FnMut([&[f32]; 3], usize, &Mesh),
    ) -> Result<(), Interrupted> {
        let Self {
            mesh,
            visited_px,
            workers,
            ..
        } = self;
        let Some(FilterWorker { band, .. }) = workers.first_mut() else {
            return Ok(());
        };
        let stride = (view.width * view.height / SAMPLED_PX).max(1);
        for row in (0..mesh.grid.rows).step_by(stride) {
            view.check()?;
            let rows = mesh.grid.rows_of(row);
            *visited_px += rows.len() * view.width;
            band.filter(view, background, kernel, with_neighbors(&rows, view.height));
            for y in rows.start.max(1)..rows.end.min(view.height.saturating_sub(1)) {
                if let (Some(above), Some(here), Some(below)) =
                    (band.row(y - 1), band.row(y), band.row(y + 1))
                {
                    each([above, here, below], y, mesh);
                }
            }
        }
        Ok(())
    }
}

/// The value from which on pixels of a row of cells are candidates.
fn candidate_cut(background: &[f32], sigma: &[f32], threshold: f32) -> f32 {
    let cells = background.iter().zip(sigma);
    let thresholds = cells.map(|(mean, sigma)| mean + threshold * sigma.max(SIGMA_FLOOR));
    // A cell without a value (NaN) is ignored: it will get that of its neighbors.
    let lowest = thresholds.fold(f32::INFINITY, f32::min);
    let lowest = if lowest.is_finite() {
        lowest
    } else {
        threshold * SIGMA_FLOOR
    };
    CANDIDATE_MARGIN * lowest
}

/// The rows, and one on either side within the frame.
fn with_neighbors(rows: &Range<usize>, height: usize) -> Range<usize> {
    rows.start.saturating_sub(1)..(rows.end + 1).min(height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::pixels::Samples;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SIDE: usize = 256;
    const NOISE: f32 = 5.0;

    fn white_noise() -> Vec<f32> {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let noise = (0..SIDE * SIDE).map(|_| NOISE * random.sample::<f32, _>(StandardNormal));
        noise.collect()
    }

    /// Noise of the filtered light, and of its slopes along x and y, in the middle of a frame.
    fn noises_of(pixels: &[f32]) -> (f32, [f32; 2]) {
        let view = View::new(Samples::F32(pixels), SIDE, SIDE);
        let mut background = Mesh::default();
        background.measure(&view, &MeshConfig::of_pixels(64, 1e-6));
        let limits = CandidateLimits {
            threshold: 5.0,
            most: 100_000,
        };
        let mut filtered = FilteredFrame::default();
        filtered.set_threads(1);
        let kernel = Kernel::for_spot(1.2);
        let done = filtered.filter(&view, &background, &kernel, 64, &limits);
        done.unwrap();
        let middle = SIDE as f32 / 2.0;
        let (_, sigma) = filtered.mesh.at(middle, middle);
        (sigma, filtered.mesh.slope_sigma_at(middle, middle))
    }

    #[test]
    fn clouds_widen_the_light_and_not_its_slopes() {
        let pixels = white_noise();
        let (sigma, slopes) = noises_of(&pixels);
        for noise in [sigma, slopes[0], slopes[1]] {
            assert!((noise - 1.0).abs() < 0.05, "{noise}");
        }
        let wave =
            |i: usize| 15.0 * ((i % SIDE) as f32 / 6.0).sin() * ((i / SIDE) as f32 / 6.0).sin();
        let cloudy: Vec<f32> = pixels
            .iter()
            .enumerate()
            .map(|(i, v)| v + wave(i))
            .collect();
        let (sigma, slopes) = noises_of(&cloudy);
        assert!(sigma > 3.0, "{sigma}");
        assert!(
            slopes.iter().all(|slope| *slope < 0.5 * sigma),
            "{slopes:?} {sigma}"
        );
    }

    #[test]
    fn noise_that_all_pixels_of_a_row_share_is_an_error_along_y() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let rows: Vec<f32> = (0..SIDE)
            .map(|_| NOISE * random.sample::<f32, _>(StandardNormal))
            .collect();
        let pixels = white_noise();
        let banded: Vec<f32> = pixels
            .iter()
            .enumerate()
            .map(|(i, v)| v + rows[i / SIDE])
            .collect();
        let (_, [along_x, along_y]) = noises_of(&banded);
        assert!((along_x - 1.0).abs() < 0.1, "{along_x}");
        assert!(along_y > 1.5, "{along_y}");
    }
}
