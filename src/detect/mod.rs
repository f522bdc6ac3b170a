//! From a frame to its stars: positions with standard errors, fluxes and flags.
//!
//! [`Frame`] → [`Detections`], brightest first. Positions: (0, 0) is the centre of the first stored pixel.
//!
//! 1. Background and noise on a mesh of cells, robust against stars.
//! 2. A matched filter with the frame's own spot, a pixel-integrated Gaussian. The spot's size is
//!    measured on the bright stars that stand out in single pixels; where there are too few of them,
//!    on those that a filter of a guessed size finds, and the frame is filtered again.
//! 3. The noise of the filtered frame, on a mesh again: so correlated noise (JPEG, demosaicing) is
//!    measured and not assumed. The threshold follows from the wanted number of false detections, and
//!    from the distribution of the pixels where it is not Gaussian: few photons, coarse steps, a
//!    black level that cuts off half of the noise.
//! 4. Connected regions, their peaks, and which of those are stars of their own.
//! 5. A fit of each star, together with those that it touches; or a grey-weighted centroid.
//! 6. Flags for what is no star, or no whole one.
//!
//! Steps 1 to 3 go over the pixels in rows of cells, each by itself, so that threads can share them
//! ([`Workspace::on_threads`]) and the filtered frame need never be whole in memory.
//!
//! Caveats: one spot size for the whole frame; a frame with fewer than three bright stars gets a
//! default one. Stars fainter than about 2 % of a bright neighbour, within some five spot sizes of
//! it, are taken for its halo. Standard errors of stars whose light is not proportional to the
//! grey level (JPEG's gamma) are indicative.
//!
//! # Reference
//! Bertin & Arnouts 1996, doi 10.1051/aas:1996164, for the order of the steps; the README of `sep`
//! for the matched filter.

mod background;
mod background_map;
mod candidates;
mod config;
mod detection;
mod error;
mod filter;
mod filter_model;
mod fit;
mod measure;
mod pixels;
mod psf;
mod star_model;
mod threshold;

pub use background_map::BackgroundMap;
pub use config::{CentroidMethod, DetectConfig};
pub use detection::{Detection, DetectionFlags, Detections};
pub use error::DetectError;
pub use filter_model::FilterModel;

use crate::frame::{Frame, MIN_SIDE_PX};
use background::{CellScratch, Mesh, MeshConfig, Strips};
use candidates::{Candidates, PeakSearch, RawPeak, RawPeaks, SearchConfig, raw_peaks};
use filter::{FilteredBand, Kernel};
use fit::{FitWork, NoiseModel, Scene};
use measure::{KnownSpots, MeasureWorker, Measurement};
use multiversion::multiversion;
use pixels::{BlockMaxima, View};
use star_model::calibrate;
use std::num::NonZeroUsize;
use std::ops::Range;
use threshold::{NoiseWork, PixelNoise, StarFree, Weights, false_alarms, pixel_noise};

/// Refuses frames and options that make no sense.
fn check(frame: &Frame, config: &DetectConfig) -> Result<(), DetectError> {
    let (width, height) = (frame.width, frame.height);
    if width < MIN_SIDE_PX || height < MIN_SIDE_PX {
        return Err(DetectError::FrameTooSmall { width, height });
    }
    if frame.pixels.len() != width * height {
        return Err(DetectError::WrongLength {
            expected: width * height,
            found: frame.pixels.len(),
        });
    }
    let positive = [
        ("false_alarms_per_mpx", config.false_alarms_per_mpx),
        ("threshold_sigma", config.threshold_sigma.unwrap_or(1.0)),
        ("spot_sigma_px", config.spot_sigma_px.unwrap_or(1.0)),
        ("cell_px", config.cell_px as f64),
    ];
    for (name, found) in positive {
        if !(found > 0.0 && found.is_finite()) {
            return Err(DetectError::Config {
                name,
                found,
                expected: "a number above 0",
            });
        }
    }
    Ok(())
}

/// Buffers that are reused from frame to frame; the result does not depend on what was in them.
#[derive(Debug, Clone)]
pub struct Workspace {
    background: Mesh,
    raw_peaks: Vec<RawPeak>,
    filtered_mesh: Mesh,
    filtered_maxima: BlockMaxima,
    /// For each row of cells.
    candidates: Vec<Candidates>,
    /// The lowest of the pixels looked at in each row of cells, in ADU.
    lowest: Vec<f32>,
    /// One for each thread.
    workers: Vec<Worker>,
    raw_peak_workers: Vec<RawPeaks>,
    measure_workers: Vec<MeasureWorker>,
    noise: NoiseWork,
    search: PeakSearch,
    fits: FitWork,
    known_spots: KnownSpots,
    sorted: Vec<f32>,
}

/// The buffers of one thread.
#[derive(Debug, Clone, Default)]
struct Worker {
    cells: CellScratch,
    band: FilteredBand,
}

impl Workspace {
    /// Empty buffers, for one thread.
    pub fn new() -> Self {
        let empty = Self {
            background: Mesh::default(),
            raw_peaks: Vec::new(),
            filtered_mesh: Mesh::default(),
            filtered_maxima: BlockMaxima::default(),
            candidates: Vec::new(),
            lowest: Vec::new(),
            workers: Vec::new(),
            raw_peak_workers: Vec::new(),
            measure_workers: Vec::new(),
            noise: NoiseWork::default(),
            search: PeakSearch::default(),
            fits: FitWork::default(),
            known_spots: KnownSpots::default(),
            sorted: Vec::new(),
        };
        empty.on_threads(NonZeroUsize::MIN)
    }

    /// The same, with the passes over the pixels shared among so many threads of the rayon pool that [`detect`] is called in.
    /// The result is the same for any number; one is best where other frames keep the other threads busy.
    #[must_use]
    pub fn on_threads(mut self, threads: NonZeroUsize) -> Self {
        let threads = threads.get();
        self.workers.resize_with(threads, Worker::default);
        self.raw_peak_workers
            .resize_with(threads, RawPeaks::default);
        self.measure_workers
            .resize_with(threads, MeasureWorker::default);
        self
    }
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}

/// The spot must be guessed this well, as a factor; else the frame is filtered again.
const SPOT_GUESS_TOLERANCE: f64 = 1.15;
/// So many stars of one size, found without a filter, settle the spot; fewer may be chance.
const ENOUGH_RAW_STARS: usize = 8;
/// Spots below this size put so much light in one pixel that the brightest pixels are the brightest
/// stars; wider ones are measured on what a filter finds.
const SHARP_SPOT_PX: f64 = 0.75;
/// At most so many times.
const MAX_FILTER_ROUNDS: usize = 3;
/// The standard deviation of rounding to whole steps, over the step: 1/√12.
const ROUNDING_NOISE: f32 = 0.288_675_13;
/// The filtered noise cannot fall below this part of that of independent pixels: a frame that is
/// smooth below its own rounding is not known better than that.
const FILTERED_NOISE_FLOOR: f32 = 0.5;
/// Noise below so many times that of rounding, half a step, is a few isolated pixels.
const COARSE: f64 = 1.75;
/// The distribution of the noise is measured again where it raises the threshold by more than this.
const REPEAT_AT_RAISE: f64 = 0.2;

/// Finds the stars of `frame`, and whatever else stands out, brightest first.
///
/// `frame`: row-major, `height * width`, ADU. NaN pixels are masked; saturated stars are kept and
/// flagged. A frame without light (one value everywhere) gives an empty list. The same frame gives
/// the same result, whatever `workspace` was used for before.
///
/// # Errors
/// [`DetectError::FrameTooSmall`], [`DetectError::WrongLength`] for frames of impossible size,
/// [`DetectError::Config`] for options without meaning.
///
/// # Example
/// ```
/// use starpipe::detect::{DetectConfig, Workspace, detect};
/// use starpipe::frame::Frame;
///
/// // A noisy sky with one star.
/// let noise = |i: usize| ((i * 7919) % 101) as f32 * 0.1;
/// let mut pixels: Vec<f32> = (0..128 * 96).map(noise).collect();
/// for (dx, dy, light) in [(0, 0, 900.0), (1, 0, 400.0), (0, 1, 400.0), (1, 1, 180.0)] {
///     pixels[(40 + dy) * 128 + 60 + dx] += light;
/// }
/// let frame = Frame::new(128, 96, pixels)?;
/// let found = detect(&frame, &DetectConfig::default(), &mut Workspace::new()).expect("the frame is large enough");
/// assert!((found.sources[0].position.x - 60.3).abs() < 0.3);
/// # Ok::<(), starpipe::frame::FrameError>(())
/// ```
pub fn detect(
    frame: &Frame,
    config: &DetectConfig,
    workspace: &mut Workspace,
) -> Result<Detections, DetectError> {
    let mut found = Detections::default();
    detect_into(frame, config, workspace, &mut found)?;
    Ok(found)
}

/// The same as [`detect`], into `found`: frame after frame of the same kind, nothing is allocated.
///
/// # Errors
/// As [`detect`]; `found` is left as it was.
pub fn detect_into(
    frame: &Frame,
    config: &DetectConfig,
    workspace: &mut Workspace,
    found: &mut Detections,
) -> Result<(), DetectError> {
    check(frame, config)?;
    found.sources.clear();
    let view = View::of_live_pixels(frame);
    if view.width < MIN_SIDE_PX || view.height < MIN_SIDE_PX {
        describe_darkness(frame, config, found);
        return Ok(());
    }
    measure_background(&view, frame.step_adu, config, workspace);
    let stated_adu = config
        .saturation_adu
        .map_or(f32::INFINITY, |adu| adu as f32);
    let saturation_adu = frame
        .saturation_adu
        .unwrap_or(f32::INFINITY)
        .min(stated_adu);
    let calibration = search_with_own_spot(&view, saturation_adu, config, workspace);
    let mut workers = std::mem::take(&mut workspace.measure_workers);
    let mut known_spots = std::mem::take(&mut workspace.known_spots);
    let measurement = Measurement {
        scene: scene_of(&view, saturation_adu, &calibration, workspace),
        noise: calibration.noise,
        method: config.centroid,
        regions: &workspace.search.regions,
        threshold: calibration.threshold,
    };
    let peaks = &workspace.search.peaks;
    measurement.run(peaks, &mut workers, &mut known_spots, &mut found.sources);
    workspace.measure_workers = workers;
    workspace.known_spots = known_spots;
    found.sources.sort_unstable_by(|a, b| {
        let place = |d: &Detection| (d.position.y, d.position.x);
        let ((ay, ax), (by, bx)) = (place(a), place(b));
        let by_place = || ay.total_cmp(&by).then(ax.total_cmp(&bx));
        b.flux_adu.total_cmp(&a.flux_adu).then_with(by_place)
    });
    let sorted = &mut workspace.sorted;
    found.background_adu = middle_of(&workspace.background.level, sorted);
    found.noise_adu = middle_of(&workspace.background.spread, sorted);
    found.spot_sigma_px = calibration.spot_px;
    Ok(())
}

/// Measures background and noise.
fn measure_background(
    view: &View<'_>,
    step_adu: f32,
    config: &DetectConfig,
    workspace: &mut Workspace,
) {
    let mesh_config = MeshConfig {
        cell_px: config.cell_px,
        spread_of_differences: true,
        spread_floor: (ROUNDING_NOISE * step_adu).max(least_noise(view)),
        is_normalised: false,
    };
    let size = (view.width, view.height);
    let Workspace {
        background,
        lowest,
        workers,
        ..
    } = workspace;
    background.prepare(size, &mesh_config);
    let grid = background.grid;
    lowest.resize(grid.rows, 0.0);
    let mut no_maxima = BlockMaxima::default();
    let strips = Strips::of(background, &mut no_maxima, lowest);
    strips.share(workers, &|worker, strip| {
        let rows = view.rows(strip.rows).step_by(grid.row_stride());
        // This also brings the rows from the memory in one go, and not cell by cell.
        *strip.other = (0..rows.height).fold(f32::INFINITY, |m, y| lowest_of(m, rows.row(y)));
        let cells = (strip.level, strip.spread);
        worker.cells.measure_row(&grid, rows, &mesh_config, cells);
    });
    background.finish();
}

/// What a frame's own stars say about it, and the threshold.
#[derive(Debug, Clone)]
struct Calibration {
    spot_px: f64,
    kernel: Kernel,
    noise: NoiseModel,
    threshold: f64,
}

impl Calibration {
    /// Takes over what the stars tell; a size that is given stands.
    fn adopt(&mut self, model: &calibrate::StarModel, config: &DetectConfig) {
        self.noise = model.noise;
        self.spot_px = config.spot_sigma_px.unwrap_or(model.spot_px);
    }
}

/// Filters and searches, until the filter fits the stars that it finds.
fn search_with_own_spot(
    view: &View<'_>,
    saturation_adu: f32,
    config: &DetectConfig,
    workspace: &mut Workspace,
) -> Calibration {
    let mut calibration = Calibration {
        spot_px: config.spot_sigma_px.unwrap_or(calibrate::DEFAULT_SPOT_PX),
        kernel: Kernel::default(),
        noise: NoiseModel::default(),
        threshold: 0.0,
    };
    if calibrate_unfiltered(view, saturation_adu, config, &mut calibration, workspace) {
        search(view, saturation_adu, config, &mut calibration, workspace);
        return calibration;
    }
    for round in 0..MAX_FILTER_ROUNDS {
        search(view, saturation_adu, config, &mut calibration, workspace);
        let mut fits = std::mem::take(&mut workspace.fits);
        let mut scene = scene_of(view, saturation_adu, &calibration, workspace);
        let stars = calibrate::fit_bright_stars(&scene, &workspace.search.peaks, &mut fits);
        let measured = match config.spot_sigma_px {
            None => calibrate::spot_size(&stars).map(|(size, _)| size),
            Some(_) => None,
        };
        let spot_px = measured.unwrap_or(calibration.spot_px);
        let ratio = (spot_px / calibration.spot_px).max(calibration.spot_px / spot_px);
        let settled = ratio < SPOT_GUESS_TOLERANCE || round + 1 == MAX_FILTER_ROUNDS;
        calibration.spot_px = spot_px;
        if settled {
            scene.spot_px = spot_px;
            let model = calibrate::star_model(&scene, stars, &mut fits);
            calibration.adopt(&model, config);
        }
        workspace.fits = fits;
        if settled {
            break;
        }
    }
    calibration
}

/// Measures spot and noise model on stars that stand out without a filter; whether there are enough
/// of them. If not, the size is still a better start than none.
fn calibrate_unfiltered(
    view: &View<'_>,
    saturation_adu: f32,
    config: &DetectConfig,
    calibration: &mut Calibration,
    workspace: &mut Workspace,
) -> bool {
    let Workspace {
        background,
        raw_peak_workers,
        raw_peaks,
        ..
    } = &mut *workspace;
    raw_peaks::find(
        view,
        background,
        saturation_adu,
        raw_peak_workers,
        raw_peaks,
    );
    let mut fits = std::mem::take(&mut workspace.fits);
    let mut scene = Scene {
        filtered: None,
        ..scene_of(view, saturation_adu, calibration, workspace)
    };
    scene.matched_gain = Kernel::for_spot(calibration.spot_px).matched_gain();
    let stars = calibrate::fit_raw_stars(&scene, &workspace.raw_peaks, &mut fits);
    let measured = calibrate::spot_size(&stars);
    if let (None, Some((size, _))) = (config.spot_sigma_px, measured) {
        calibration.spot_px = size;
        scene.spot_px = size;
    }
    let is_enough =
        measured.is_some_and(|(size, stars)| stars >= ENOUGH_RAW_STARS && size < SHARP_SPOT_PX);
    if is_enough {
        let model = calibrate::star_model(&scene, stars, &mut fits);
        calibration.adopt(&model, config);
    }
    workspace.fits = fits;
    is_enough
}

/// Filters with the calibration's spot, sets the threshold, and finds regions and peaks.
fn search(
    view: &View<'_>,
    saturation_adu: f32,
    config: &DetectConfig,
    calibration: &mut Calibration,
    workspace: &mut Workspace,
) {
    let kernel = Kernel::for_spot(calibration.spot_px);
    let size = (view.width, view.height);
    let least = config
        .threshold_sigma
        .unwrap_or_else(|| gaussian_threshold(config, size, calibration.spot_px, &kernel));
    filter(view, config.cell_px, &kernel, least, workspace);
    calibration.threshold = config
        .threshold_sigma
        .unwrap_or_else(|| raised_for_noise(least, view, calibration.spot_px, &kernel, workspace));
    let threshold = calibration.threshold as f32;
    gather_missed(view, &kernel, threshold, workspace);
    let spot_width_px = (calibration.spot_px.powi(2) + psf::PIXEL_VARIANCE_PX2).sqrt();
    workspace.search.run(
        &workspace.candidates,
        &workspace.filtered_mesh,
        view,
        &SearchConfig {
            threshold,
            spot_width_px: spot_width_px as f32,
            saturation_adu,
            max_peaks: config.max_detections,
        },
    );
    calibration.kernel = kernel;
}

/// Candidates are gathered from this part of the threshold on that their own row of cells would have: that of
/// the mesh, which is smoothed, will hardly be lower.
const CANDIDATE_MARGIN: f32 = 0.85;

/// Filters the frame band by band, measures mean and noise of the filtered frame, and gathers the candidates that may
/// lie above the threshold of `least` standard deviations.
fn filter(view: &View<'_>, cell_px: usize, kernel: &Kernel, least: f64, workspace: &mut Workspace) {
    let mesh_config = MeshConfig {
        cell_px,
        spread_of_differences: false,
        spread_floor: FILTERED_NOISE_FLOOR,
        is_normalised: true,
    };
    let size = (view.width, view.height);
    let Workspace {
        background,
        filtered_mesh,
        filtered_maxima,
        candidates,
        workers,
        ..
    } = workspace;
    filtered_mesh.prepare(size, &mesh_config);
    filtered_maxima.prepare(size);
    let grid = filtered_mesh.grid;
    candidates.resize_with(grid.rows, Candidates::default);
    for worker in workers.iter_mut() {
        worker.band.prepare(view.width, kernel);
    }
    let background = &*background;
    Strips::of(filtered_mesh, filtered_maxima, candidates).share(workers, &|worker, strip| {
        let Worker { cells, band, .. } = worker;
        let rows = strip.rows;
        band.filter(
            view,
            background,
            kernel,
            with_neighbours(&rows, view.height),
        );
        let filtered = band.rows(rows.clone()).step_by(grid.row_stride());
        cells.measure_row(&grid, filtered, &mesh_config, (strip.level, strip.spread));
        let least = least as f32;
        let of_cells = strip.level.iter().zip(strip.spread.iter());
        let thresholds =
            of_cells.map(|(level, spread)| level + least * spread.max(FILTERED_NOISE_FLOOR));
        // A cell without a value is left out: it will have that of its neighbours.
        let lowest = thresholds.fold(f32::INFINITY, f32::min);
        let cut = if lowest.is_finite() {
            lowest
        } else {
            least * FILTERED_NOISE_FLOOR
        };
        let cut = CANDIDATE_MARGIN * cut;
        strip.other.gather(band, rows, cut, strip.maxima);
    });
    filtered_mesh.finish();
}

/// Gathers the candidates again where the threshold turned out lower than what they were gathered from.
fn gather_missed(view: &View<'_>, kernel: &Kernel, threshold: f32, workspace: &mut Workspace) {
    let Workspace {
        background,
        filtered_mesh,
        candidates,
        filtered_maxima,
        workers,
        ..
    } = workspace;
    let Some(Worker { band, .. }) = workers.first_mut() else {
        return;
    };
    for (row, found) in candidates.iter_mut().enumerate() {
        let lowest = filtered_mesh.lowest_about_row(row, threshold);
        if !found.reach_down_to(lowest) {
            let rows = filtered_mesh.grid.rows_of(row);
            band.filter(
                view,
                background,
                kernel,
                with_neighbours(&rows, view.height),
            );
            let maxima = filtered_maxima.rows_mut(rows.clone());
            found.gather(band, rows, lowest, maxima);
        }
    }
}

/// The rows, and one on either side within the frame.
fn with_neighbours(rows: &Range<usize>, height: usize) -> Range<usize> {
    rows.start.saturating_sub(1)..(rows.end + 1).min(height)
}

/// The threshold `u` for Gaussian noise, raised for the noise that the frame has, whose tail is longer.
fn raised_for_noise(
    u: f64,
    view: &View<'_>,
    spot_px: f64,
    kernel: &Kernel,
    workspace: &mut Workspace,
) -> f64 {
    let weights = Weights::for_spot(spot_px, kernel.radius(), (view.width, view.height));
    let background = &workspace.background;
    let level = middle_of(&background.level, &mut workspace.sorted);
    let spread = middle_of(&background.spread, &mut workspace.sorted);
    let is_coarse = spread < COARSE * f64::from(background.spread_floor);
    let lowest = workspace.lowest.iter().copied().fold(f32::INFINITY, lesser);
    if is_coarse || is_cut_off(view, lowest, level, spread) {
        return raised_for_steps(u, view, &weights, is_coarse, workspace);
    }
    // The tail itself is mostly that of stars too faint to be detected: a threshold raised for these would lose a third of the
    // stars that can be. The skewness can be told apart from theirs.
    let star_free = StarFree {
        maxima: &workspace.filtered_maxima,
        filtered_mesh: &workspace.filtered_mesh,
        limit: u as f32,
    };
    let work = &mut workspace.noise;
    let skewness = pixel_noise::photon_skewness(view, background, &star_free, spot_px, work);
    skewness.map_or(u, |s| pixel_noise::threshold_for_photons(u, s, &weights))
}

/// The threshold `u` raised for noise that is coarse or cut off, whose whole distribution is that of the pixels.
fn raised_for_steps(
    u: f64,
    view: &View<'_>,
    weights: &Weights,
    is_coarse: bool,
    workspace: &mut Workspace,
) -> f64 {
    let Workspace {
        background,
        filtered_mesh,
        filtered_maxima,
        noise,
        sorted,
        ..
    } = workspace;
    let floor = f64::from(FILTERED_NOISE_FLOOR);
    let is_at_floor = middle_of(&filtered_mesh.spread, sorted) <= floor * 1.001;
    let mut raised = |free_of_stars: f64| {
        let star_free = StarFree {
            maxima: filtered_maxima,
            filtered_mesh,
            limit: free_of_stars as f32,
        };
        let noise = PixelNoise::measure(view, background, &star_free, noise);
        noise.map_or(u, |n| {
            let known_spread = is_at_floor.then_some(floor / n.sigma);
            n.threshold(u, weights, known_spread)
        })
    };
    // Noise of about a quantisation step is a few isolated pixels: they stand out, and are the noise.
    let free_of_stars = if is_coarse { 2.0 * u } else { u };
    let first = raised(free_of_stars);
    if first > free_of_stars + REPEAT_AT_RAISE {
        // What lay between the two was noise, and was left out.
        raised(first)
    } else {
        first
    }
}

/// Whether the lowest value of the frame cuts into its noise: many pixels have just that value.
fn is_cut_off(view: &View<'_>, lowest: f32, level: f64, spread: f64) -> bool {
    const EVERY: usize = 16;
    const SIGMAS: f32 = 2.5;
    if level - f64::from(lowest) >= f64::from(SIGMAS) * spread {
        return false;
    }
    let rows = (0..view.height).step_by(EVERY).map(|y| view.row(y));
    let count = |row: &[f32]| row.iter().map(|&v| u32::from(v == lowest)).sum::<u32>();
    let at_lowest: usize = rows.map(|row| count(row) as usize).sum();
    let total = view.width * view.height.div_ceil(EVERY);
    at_lowest * LEAST_CUT_OFF > total
}

/// The lesser of two values, that which is none left out.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// The lowest of a row and a value, NaN left out.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn lowest_of(value: f32, row: &[f32]) -> f32 {
    fold_row(value, row, lesser)
}

/// Folds a row into `start` in any order: one value after the other, each would wait for the one before.
#[inline(always)]
fn fold_row(start: f32, row: &[f32], fold: impl Fn(f32, f32) -> f32) -> f32 {
    const LANES: usize = 32;
    let (chunks, rest) = row.as_chunks::<LANES>();
    let mut lanes = [start; LANES];
    for chunk in chunks {
        for (lane, &value) in lanes.iter_mut().zip(chunk) {
            *lane = fold(*lane, value);
        }
    }
    lanes.iter().chain(rest).copied().fold(start, fold)
}

/// One pixel in so many at the lowest value is a sign that the noise is cut off there.
const LEAST_CUT_OFF: usize = 50;

/// The threshold in Gaussian noise that is measured on the frame itself, in standard deviations.
fn gaussian_threshold(
    config: &DetectConfig,
    size: (usize, usize),
    spot_px: f64,
    kernel: &Kernel,
) -> f64 {
    let u = false_alarms::threshold_for_rate(config.false_alarms_per_mpx, kernel.rho, kernel.rho);
    false_alarms::for_estimated_noise(u, noise_degrees(size, config, spot_px))
}

/// The degrees of freedom of the local noise estimate: the independent samples in a cell (a value of
/// the filtered frame has relatives in 2πs² pixels), and a gain of 5 from the median of 3x3 cells.
fn noise_degrees((width, height): (usize, usize), config: &DetectConfig, spot_px: f64) -> f64 {
    const SMOOTHING_GAIN: f64 = 5.0;
    const EFFICIENCY: f64 = 0.8;
    let cell = (width.min(config.cell_px) * height.min(config.cell_px)) as f64;
    let cells = ((width * height) as f64 / cell).max(1.0);
    let relatives = std::f64::consts::TAU * (spot_px.powi(2) + psf::PIXEL_VARIANCE_PX2);
    (EFFICIENCY * cell / relatives.max(1.0) * SMOOTHING_GAIN.min(cells)).max(3.0)
}

fn scene_of<'a>(
    view: &View<'a>,
    saturation_adu: f32,
    calibration: &Calibration,
    workspace: &'a Workspace,
) -> Scene<'a> {
    Scene {
        view: *view,
        background: &workspace.background,
        filtered: Some(&workspace.filtered_mesh),
        saturation_adu,
        spot_px: calibration.spot_px,
        matched_gain: calibration.kernel.matched_gain(),
    }
}

/// The result for a frame without light.
fn describe_darkness(frame: &Frame, config: &DetectConfig, found: &mut Detections) {
    let level = frame.pixels.iter().copied().find(|p| !p.is_nan());
    found.background_adu = f64::from(level.unwrap_or(0.0));
    found.noise_adu = f64::from(ROUNDING_NOISE * frame.step_adu);
    found.spot_sigma_px = config.spot_sigma_px.unwrap_or(calibrate::DEFAULT_SPOT_PX);
}

/// A noise that is certainly below that of the frame: some of the precision of its numbers.
fn least_noise(view: &View<'_>) -> f32 {
    let rows = (0..view.height).step_by((view.height / 16).max(1));
    let larger = |m: f32, p: f32| if p.abs() > m { p.abs() } else { m };
    let largest = rows.fold(0.0, |m, y| fold_row(m, view.row(y), larger));
    (largest * 1e-6).max(f32::MIN_POSITIVE * 1e6)
}

/// The median; `sorted` is a buffer.
fn middle_of(values: &[f32], sorted: &mut Vec<f32>) -> f64 {
    sorted.clear();
    sorted.extend_from_slice(values);
    let middle = sorted.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    f64::from(*sorted.select_nth_unstable_by(middle, f32::total_cmp).1)
}
