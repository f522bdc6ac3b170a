//! The brightest stars of a frame: which peaks they are, and a fit of each.

use super::core::Core;
use super::star_shape::StarShape;
use crate::base::coords::PixelPoint;
use crate::base::size::Size;
use crate::base::statistics::median;
use crate::detect::candidates::{Peak, RawPeak, RawPeakFinder};
use crate::detect::detection::{Detection, DetectionFlags};
use crate::detect::filter::Kernel;
use crate::detect::fit::{BatchStart, FitBuffers, FitConfig, FrameMaps, SpotEstimate, SpotFit};
use crate::detect::star_model::{BrightPeak, MAX_STARS, rough_star_model};
use arrayvec::ArrayVec;

/// Fewer stars do not tell a pointing that is sure.
const MIN_STARS: usize = 8;
/// Places along each side of the frame, over the root of the number of stars, the most of these places, …
const CELLS: f64 = 0.6;
const MAX_CELLS: usize = 32;
/// … and the stars that may be in one of them: of stars spread by chance over all of them, more are in one place in
/// less than one frame of a hundred.
const MOST_IN_CELL: u8 = 12;

/// The brightest stars; holds the buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct BrightestStars {
    /// The peaks that are measured, most significant first.
    peaks: Vec<RawPeak>,
    fits: FitBuffers,
}

/// The median size of the brightest spots, in pixels; `None` where there are too few.
pub(crate) fn spot_size_px(raw_peaks: &RawPeakFinder, maps: &FrameMaps<'_>) -> Option<f64> {
    let peaks = raw_peaks.peaks.iter();
    let of_light = peaks.filter(|peak| !peak.saturated && is_of_light(peak, maps));
    let mut sizes_px: ArrayVec<f64, MAX_STARS> = of_light
        .take(MAX_STARS)
        .map(|peak| peak.size_in(&maps.view))
        .collect();
    (sizes_px.len() >= MIN_STARS).then(|| median(&mut sizes_px))
}

fn is_of_light(peak: &RawPeak, maps: &FrameMaps<'_>) -> bool {
    !peak.contrast(maps).is_sharper_than_any_spot()
}

impl BrightestStars {
    /// Selects the brightest peaks, but no more in one place than chance explains; returns whether there are so
    /// many of them.
    pub fn select(&mut self, peaks: &[RawPeak], maps: &FrameMaps<'_>, count: usize) -> bool {
        let chosen = &mut self.peaks;
        chosen.clear();
        let cells = (CELLS * (count as f64).sqrt()).round() as usize;
        let cells = cells.clamp(1, MAX_CELLS);
        let mut in_cell = [0_u8; MAX_CELLS * MAX_CELLS];
        for peak in peaks {
            let cell = &mut in_cell[cell_of(peak, maps.view.size(), cells)];
            if *cell < MOST_IN_CELL && is_of_light(peak, maps) && !is_of_halo(peak, chosen, maps) {
                *cell += 1;
                chosen.push(*peak);
            }
            if chosen.len() == count {
                return true;
            }
        }
        false
    }

    /// Measures them, and the size of their spots where it is not stated.
    pub fn measure(
        &mut self,
        maps: &mut FrameMaps<'_>,
        stated_px: Option<f64>,
        sources: &mut Vec<Detection>,
    ) {
        let Self { peaks, fits } = self;
        let shape = shape_of(peaks, maps);
        if shape.is_long() {
            return;
        }
        if shape.is_elongated() {
            sources.extend(peaks.iter().filter_map(|peak| of_core(peak, maps)));
            return;
        }
        let unsaturated = peaks.iter().filter(|peak| !peak.saturated);
        let stars = rough_star_model(maps, unsaturated.map(|peak| peak.start(maps)), fits);
        maps.spot_px = stated_px.unwrap_or(stars.spot_px);
        maps.matched_gain = Kernel::for_spot(maps.spot_px).matched_gain();
        let maps = &*maps;
        let config = FitConfig {
            spot_px: maps.spot_px,
            free_size: false,
            noise: stars.noise,
        };
        let starts = peaks.iter().enumerate();
        let starts = starts.map(|(number, peak)| BatchStart {
            number,
            spot: peak.start(maps),
            spot_px: maps.spot_px,
        });
        let mut batch = fits.batch.take().unwrap_or_default();
        batch.fit(maps, starts, &config, |number, fit, _| {
            let peak = &peaks[number];
            let of_fit = fit.and_then(|fit| of_fit(&fit, peak, maps));
            sources.extend(of_fit.or_else(|| of_core(peak, maps)));
        });
        fits.batch = Some(batch);
    }
}

/// The shape of the stars: a round spot may settle anywhere along elongated ones.
fn shape_of(peaks: &[RawPeak], maps: &FrameMaps<'_>) -> StarShape {
    /// More stars do not tell more.
    const ENOUGH: usize = 40;
    let of_own_region = peaks.iter().take(ENOUGH).enumerate();
    let peaks: ArrayVec<Peak, ENOUGH> = of_own_region.map(|(i, peak)| peak.as_peak(i)).collect();
    StarShape::measure(maps, &peaks)
}

/// The star of a fit; `None` where its place is not that of the peak, or not known.
fn of_fit(fit: &SpotFit, peak: &RawPeak, maps: &FrameMaps<'_>) -> Option<Detection> {
    /// Chi² above what is expected is chance below this many of its standard deviations.
    const CHANCE_SIGMAS: f64 = 3.0;
    let spot = fit.spots[0];
    if peak.saturated || !spot.has_position(maps.spot_px) || spot.flux <= 0.0 {
        return None;
    }
    // What the model does not explain, as light of a neighbor, moves the star, too.
    let freedom = fit.degrees_of_freedom.max(1.0);
    let by_chance = 1.0 + CHANCE_SIGMAS * (2.0 / freedom).sqrt();
    let excess = fit.chi2 / freedom;
    let excess = if excess > by_chance { excess } else { 1.0 };
    Some(detection(maps, peak, &spot, excess.sqrt()))
}

/// The star of the light above half of the height, as where it is saturated.
fn of_core(peak: &RawPeak, maps: &FrameMaps<'_>) -> Option<Detection> {
    let core = Core::at(maps, &peak.as_peak(0))?;
    let spot = SpotEstimate {
        x: core.x,
        y: core.y,
        sigma_x: core.sigma_px,
        sigma_y: core.sigma_px,
        flux: peak.flux_adu * core.area_px.max(9.0) / 9.0,
        noise_flux: peak.flux_adu / f64::from(peak.snr),
        ..SpotEstimate::default()
    };
    Some(detection(maps, peak, &spot, 1.0))
}

/// The detection of a spot at `peak`, with its errors times `excess`, in coordinates of the frame.
fn detection(maps: &FrameMaps<'_>, peak: &RawPeak, spot: &SpotEstimate, excess: f64) -> Detection {
    /// A spot is wider than the stars from this ratio of the sizes on.
    const WIDE: f64 = 1.6;
    let view = &maps.view;
    Detection {
        position: PixelPoint::new(spot.x + view.x0 as f64, spot.y + view.y0 as f64),
        sigma_x_px: spot.sigma_x * excess,
        sigma_y_px: spot.sigma_y * excess,
        flux_adu: spot.flux,
        peak_adu: 0.0,
        snr: spot.flux / spot.noise_flux,
        flags: DetectionFlags {
            saturated: peak.saturated,
            extended: !peak.saturated && peak.size_in(view) > WIDE * maps.spot_px,
            ..DetectionFlags::default()
        },
    }
}

/// The number of the place that a peak is in, of so many along each side.
fn cell_of(peak: &RawPeak, size: Size, cells: usize) -> usize {
    peak.y * cells / size.height * cells + peak.x * cells / size.width
}

/// Whether a peak is of the light around one of the brighter ones.
fn is_of_halo(peak: &RawPeak, brighter: &[RawPeak], maps: &FrameMaps<'_>) -> bool {
    /// How far the halo of a star reaches, in standard deviations of its spot, …
    const REACH_SIGMAS: f64 = 5.0;
    /// … and what is in it, over the star.
    const HALO: f64 = 0.1;
    let reach_px = REACH_SIGMAS * maps.width_px();
    brighter.iter().any(|star| {
        let (dx, dy) = (star.x as f64 - peak.x as f64, star.y as f64 - peak.y as f64);
        let is_faint = peak.flux_adu < HALO * star.flux_adu || (star.saturated && peak.saturated);
        is_faint && dx * dx + dy * dy < reach_px * reach_px
    })
}
