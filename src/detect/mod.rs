//! From a frame to its sources: positions with standard errors, fluxes and flags.
//!
//! [`Frame`] → [`Detections`], brightest first. Positions: (0, 0) is the centre of the first stored
//! pixel.
//!
//! 1. `background`: background and noise on a mesh of cells, robust against stars.
//! 2. `filter`: a matched filter with the frame's own spot, a pixel-integrated Gaussian. The spot
//!    size and the noise model are measured on bright stars (`star_model`).
//! 3. `threshold`: the noise of the filtered frame is measured on a mesh again, so correlated noise
//!    (JPEG, demosaicing) is measured and not assumed. The threshold follows from the wanted number
//!    of false detections, and from the distribution of the pixels where it is not Gaussian: few
//!    photons, coarse steps, a black level that cuts off half of the noise.
//! 4. `candidates`: connected regions above the threshold, their peaks, and which of those are
//!    sources of their own.
//! 5. `psf::measured`: where the stars are not round Gaussians of one size (motion, defocus, aberrations),
//!    an effective PSF is measured on the bright ones, and tabulated (`field_tables`).
//!    Where the stars are long trails, `trails::stars` measures these instead of steps 6 and 7.
//! 6. `fit`, `measure`: a fit of each source, together with those that it touches, or a
//!    grey-weighted centroid; flags for non-stellar and truncated sources.
//! 7. `wings`: light of the stars beyond the spots that are fitted, which is added to the fluxes.
//!
//! `trails::satellites` searches what is left for satellites, aeroplanes and meteors
//! ([`Workspace::find_trails`]).
//!
//! `search` runs steps 2 to 4, up to three times, until the filter fits the stars that it finds.
//! Steps 1 to 3 process the pixels in rows of cells, each by itself, so that threads can share them
//! ([`Workspace::on_threads`]) and the filtered frame is never in memory as a whole.
//!
//! Caveats: the filter has one round spot for the whole frame; a frame with fewer than three bright
//! stars gets a default one. The form of undersampled spots (σ below 0.65 px) is not measured unless
//! they are elongated. Stars fainter than about 2 % of a bright neighbor, within some five spot sizes of
//! it, are counted as its halo. Standard errors of stars whose light is not proportional to the
//! grey level (JPEG's gamma) are indicative.
//!
//! # Reference
//! Bertin & Arnouts 1996, doi 10.1051/aas:1996164, for the order of the steps; the README of `sep`
//! for the matched filter.

mod background;
mod background_map;
mod brightest;
mod candidates;
mod config;
mod contrast;
mod detection;
mod error;
mod filter;
mod filter_model;
mod fineness;
mod fit;
mod flux_limits;
mod measure;
mod pixels;
mod psf;
mod search;
mod sky_area;
mod star_model;
mod threads;
mod threshold;
mod trails;
#[doc(hidden)]
pub mod windows;
mod wings;
mod workspace;

pub use background_map::BackgroundMap;
pub use brightest::detect_brightest_into;
pub(crate) use brightest::{look_for_brightest, measure_brightest_into};
pub use config::{CentroidMethod, DetectConfig};
pub use detection::{
    Detection, DetectionFlags, Detections, MeasuredPsf, NoiseTail, StarTrails, Wings,
};
pub use error::DetectError;
pub(crate) use filter_model::FilterModel;
pub use sky_area::Circle;
pub use sky_area::SkyArea;
pub use trails::Trail;
pub use workspace::{VisitedPixels, Workspace};

use crate::frame::{Frame, MIN_SIDE_PX};
use background::{FrameBackground, Mesh};
use candidates::{CandidateMemory, PeakSearch};
use contrast::least_beside;
use fineness::CellSize;
pub(crate) use fineness::least_cell_px;
use measure::{MeasureBuffers, Measurement, Ring, StarShape, sharpest_px};
use pixels::View;
use psf::FieldTables;
pub(crate) use psf::PIXEL_VARIANCE_PX2;
use psf::measured::measure_psf;
use search::{FrameSearch, SearchInput, Searched};
use trails::{Trails, measure_trailed};
use wings::measure_wings;

/// Finds the stars of `frame`, and other sources, brightest first.
///
/// `frame`: row-major, `height * width`, ADU. NaN pixels are masked; saturated stars are kept and
/// flagged. A frame without light (one value everywhere) gives an empty list. Results do not depend
/// on what `workspace` was used for before.
///
/// # Errors
/// [`DetectError::FrameTooSmall`], [`DetectError::WrongLength`] for frames of impossible size,
/// [`DetectError::Config`] for options out of range, [`DetectError::Interrupted`] where the workspace
/// has an interrupt ([`Workspace::with_interrupt`]), [`DetectError::TooCrowded`] where more stands out
/// than its memory holds ([`Workspace::with_memory_limit`]).
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
/// let config = DetectConfig::default();
/// let found = detect(&frame, &config, &mut Workspace::new()).expect("the frame is large enough");
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

/// The same as [`detect`], into `found`: for further frames of the same kind, nothing is allocated.
///
/// # Errors
/// As [`detect`].
pub fn detect_into(
    frame: &Frame,
    config: &DetectConfig,
    workspace: &mut Workspace,
    found: &mut Detections,
) -> Result<(), DetectError> {
    let done = run(frame, config, workspace, found);
    workspace.search.free_large_buffers();
    done
}

/// The stages, in order.
fn run(
    frame: &Frame,
    config: &DetectConfig,
    workspace: &mut Workspace,
    found: &mut Detections,
) -> Result<(), DetectError> {
    error::check(frame, config)?;
    found.clear();
    workspace.forget_visited_pixels();
    let Workspace {
        saturation,
        saturation_adu,
        background,
        search,
        measure,
        interrupt,
        memory,
        ..
    } = workspace;
    let view = View::of_live_pixels(frame).until(interrupt);
    if view.width < MIN_SIDE_PX || view.height < MIN_SIDE_PX {
        set_empty_frame(frame, config, found);
        return Ok(());
    }
    *saturation_adu = config.saturation_adu(frame, saturation);
    let memory = CandidateMemory::beside(frame, *memory);
    let mut cells = CellSize::new(config.cell_px);
    let saturation_adu = *saturation_adu;
    let searched = loop {
        background.measure(&view, frame.step_adu, cells.px)?;
        let input = SearchInput {
            view: &view,
            background,
            cell_px: cells.px,
            saturation_adu,
            config,
            memory,
        };
        let searched = search.run(&input, cells.filter_px())?;
        if let Some(settled) = cells.settle(background, search, searched) {
            break settled;
        }
    };
    let input = SearchInput {
        view: &view,
        background,
        cell_px: cells.px,
        saturation_adu,
        config,
        memory,
    };
    set_levels(found, background, &searched);
    let meshes = [&background.mesh, &search.filtered.mesh];
    let pass = &searched.pass;
    let typical_adu = pass.limit_adu(background.median_sigma_adu);
    found.flux_limits.set(
        &view,
        meshes,
        pass.threshold,
        pass.matched_gain,
        typical_adu,
    );
    if !measure_trails(&input, search, &searched, found)? {
        measure_spots(&input, search, searched, measure, found)?;
    }
    keep_brightest(found, config, search.found.is_full());
    if found.trails.is_none() {
        add_wings(&view, &background.mesh, found);
    }
    Ok(())
}

/// Background, noise and threshold, over the frame.
fn set_levels(found: &mut Detections, background: &FrameBackground, searched: &Searched) {
    found.background_adu = background.median_adu;
    found.noise_adu = background.median_sigma_adu;
    found.threshold_sigma = searched.pass.threshold_level;
    found.noise_tail = searched.pass.noise_tail;
    found.spot_sigma_px = searched.stars.spot_px;
}

/// Measures the stars if they are long trails; else returns false.
fn measure_trails(
    input: &SearchInput<'_>,
    search: &FrameSearch,
    searched: &Searched,
    found: &mut Detections,
) -> Result<bool, DetectError> {
    let PeakSearch { peaks, regions, .. } = &search.found;
    let maps = input.searched_maps(&search.filtered, searched);
    let Some(trails) = Trails::measure(&maps, peaks, regions) else {
        return Ok(false);
    };
    measure_trailed(&maps, &trails, peaks, &mut found.sources)?;
    found.trails = Some(trails.summary());
    Ok(true)
}

/// Measures stars that are spots: with a round Gaussian, or the effective PSF of the frame.
fn measure_spots(
    input: &SearchInput<'_>,
    search: &mut FrameSearch,
    searched: Searched,
    buffers: &mut MeasureBuffers,
    found: &mut Detections,
) -> Result<(), DetectError> {
    let Searched { mut stars, pass } = searched;
    let FrameSearch {
        filtered,
        found: PeakSearch { peaks, regions, .. },
        fits,
        ..
    } = search;
    let mut maps = input.searched_maps(filtered, &searched);
    let shape = StarShape::measure(&maps, peaks);
    shape.merge_peaks(peaks, regions);
    input.view.check()?;
    let psf = if stars.is_non_gaussian {
        measure_psf(&maps, peaks, &mut stars, fits)
    } else {
        None
    };
    let size = input.view.size();
    let tables = psf
        .as_ref()
        .map(|psf| FieldTables::new(psf, size, peaks.len()));
    maps.psf = tables.as_ref();
    let measurement = Measurement {
        maps,
        shape,
        least_beside: least_beside(sharpest_px(&maps, &shape)),
        noise: stars.noise,
        method: input.config.centroid,
        regions,
        threshold: pass.threshold,
        ring: Ring::around(maps.width_px()),
    };
    measurement.run(peaks, buffers, &mut found.sources)?;
    found.spot_sigma_px = stars.spot_px;
    found.psf = psf.map(|psf| psf.summary(size));
    Ok(())
}

/// Sorts the sources, and leaves out the faintest beyond the most that are wanted; `is_truncated` where
/// peaks were left out before.
fn keep_brightest(found: &mut Detections, config: &DetectConfig, is_truncated: bool) {
    found.sources.sort_unstable_by(Detection::by_brightness);
    // The second star of a pair may be one too many.
    found.is_truncated = is_truncated || found.sources.len() > config.max_detections;
    found.sources.truncate(config.max_detections);
}

/// Measures the light of the stars beyond their fitted spots, and adds it to the fluxes.
fn add_wings(view: &View<'_>, background: &Mesh, found: &mut Detections) {
    let widest = found
        .psf
        .map_or(found.spot_sigma_px, |psf| psf.sigma_range_px[1]);
    let width_px = (widest.powi(2) + PIXEL_VARIANCE_PX2).sqrt();
    let scale = measure_wings(view, background, &found.sources, width_px);
    (found.wings, found.flux_scale_sigma) = (scale.wings, scale.sigma);
    if let Some(wings) = found.wings {
        for source in found.sources.iter_mut() {
            source.flux_adu *= 1.0 + wings.share;
        }
    }
}

/// The result for a frame without light.
fn set_empty_frame(frame: &Frame, config: &DetectConfig, found: &mut Detections) {
    let level = frame.pixels.values().find(|p| !p.is_nan());
    found.background_adu = f64::from(level.unwrap_or(0.0));
    found.noise_adu = f64::from(background::rounding_sigma_adu(frame.step_adu));
    found.spot_sigma_px = config.spot_sigma_px.unwrap_or(star_model::DEFAULT_SPOT_PX);
    found.threshold_sigma = config.threshold_sigma.unwrap_or(0.0);
}
