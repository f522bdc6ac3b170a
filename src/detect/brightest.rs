//! The brightest stars of a frame, for its pointing.
//!
//! Bright stars stand out in single pixels, so the frame is not filtered, and a rough background will do. They are
//! fitted with round spots of one size; what only the faint ones need (the noise of the filtered frame, the form of
//! the spots, close pairs) is not measured.

use super::candidates::{Peak, RawPeak, RawPeakFinder};
use super::config::DetectConfig;
use super::detection::{Detection, DetectionFlags, Detections};
use super::error::{self, DetectError};
use super::filter::Kernel;
use super::fit::{BatchStart, FitBuffers, FitConfig, FrameMaps, NoiseModel, SpotEstimate, SpotFit};
use super::measure::{Core, StarShape};
use super::pixels::View;
use super::star_model::{BrightPeak, MAX_STARS, noise_of_fits};
use super::workspace::Workspace;
use crate::base::coords::PixelPoint;
use crate::base::size::Size;
use crate::base::statistics::median;
use crate::frame::{Frame, MIN_SIDE_PX};
use arrayvec::ArrayVec;
use std::mem;

/// Fewer stars do not tell a pointing that is sure.
const MIN_STARS: usize = 8;
/// Places along each side of the frame, …
const CELLS: usize = 6;
/// … and the part of the stars that may be in one of them: of stars spread by chance over all of them, more are
/// in one place in less than one frame of a hundred.
const MOST_IN_CELL: f64 = 0.12;
/// Relative error of the spot to begin with: its size is that of all stars, and it is not quite a Gaussian.
const MODEL_ERROR: f64 = 0.05;

/// The brightest stars; holds the buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct BrightestStars {
    /// The peaks that are measured, most significant first.
    peaks: Vec<RawPeak>,
    fits: FitBuffers,
}

/// Finds up to `count` of the brightest stars of `frame`, spread over it, into `found`; none where fewer than
/// eight stand out in single pixels. Pixels are looked at once, and for the background a sixteenth of them again.
///
/// Positions and errors are as of [`detect`](super::detect()), a little less exact; of `found` nothing else is set
/// but background, noise and spot.
///
/// # Errors
/// As [`detect`](super::detect()).
pub fn detect_brightest_into(
    frame: &Frame,
    config: &DetectConfig,
    count: usize,
    workspace: &mut Workspace,
    found: &mut Detections,
) -> Result<(), DetectError> {
    error::check(frame, config)?;
    found.clear();
    workspace.forget_visited_pixels();
    let Workspace {
        background,
        search,
        brightest,
        interrupt,
        ..
    } = workspace;
    let view = View::of_live_pixels(frame).until(interrupt);
    if view.width < MIN_SIDE_PX || view.height < MIN_SIDE_PX {
        return Ok(());
    }
    background.measure_sparsely(&view, frame.step_adu, config.cell_px)?;
    let full_scale_adu = frame.saturation_adu.unwrap_or(f32::INFINITY);
    let stated_adu = config
        .saturation_adu
        .map_or(f32::INFINITY, |adu| adu as f32);
    let saturation_adu = full_scale_adu.min(stated_adu);
    let raw_peaks = &mut search.raw_peaks;
    raw_peaks.find(&view, &background.mesh, saturation_adu)?;
    let mut maps = FrameMaps {
        view,
        background: &background.mesh,
        filtered: None,
        saturation_adu,
        spot_px: 1.0,
        matched_gain: 1.0,
        psf: None,
    };
    let Some(spot_px) = spot_size_px(raw_peaks, &maps) else {
        return Ok(());
    };
    maps.spot_px = config.spot_sigma_px.unwrap_or(spot_px);
    maps.matched_gain = Kernel::for_spot(maps.spot_px).matched_gain();
    brightest.select(raw_peaks, &maps, count);
    brightest.measure(&maps, &mut found.sources);
    found.background_adu = background.median_adu;
    found.noise_adu = background.median_sigma_adu;
    found.spot_sigma_px = maps.spot_px;
    super::keep_brightest(found, config, false);
    Ok(())
}

/// The median size of the brightest spots, in pixels; `None` where there are too few.
fn spot_size_px(raw_peaks: &RawPeakFinder, maps: &FrameMaps<'_>) -> Option<f64> {
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
    /// Selects the brightest peaks, but no more in one place than chance explains.
    fn select(&mut self, raw_peaks: &RawPeakFinder, maps: &FrameMaps<'_>, count: usize) {
        let chosen = &mut self.peaks;
        chosen.clear();
        let most = ((MOST_IN_CELL * count as f64).ceil() as usize).max(2);
        let mut in_cell = [0; CELLS * CELLS];
        for peak in &raw_peaks.peaks {
            let cell = &mut in_cell[cell_of(peak, maps.view.size())];
            if *cell < most && is_of_light(peak, maps) && !is_of_halo(peak, chosen, maps) {
                *cell += 1;
                chosen.push(*peak);
            }
            if chosen.len() == count {
                break;
            }
        }
    }

    /// Measures them.
    fn measure(&mut self, maps: &FrameMaps<'_>, sources: &mut Vec<Detection>) {
        let Self { peaks, fits } = self;
        let shape = shape_of(peaks, maps);
        if shape.is_long() {
            return;
        }
        if shape.is_elongated() {
            sources.extend(peaks.iter().filter_map(|peak| of_core(peak, maps)));
            return;
        }
        let of_peak = |(number, peak): (usize, &RawPeak)| BatchStart {
            number,
            spot: peak.start(maps),
            spot_px: maps.spot_px,
        };
        let mut config = FitConfig {
            spot_px: maps.spot_px,
            free_size: false,
            noise: NoiseModel {
                shot_adu: 0.0,
                model_error2: MODEL_ERROR * MODEL_ERROR,
            },
        };
        let unsaturated = peaks.iter().enumerate().filter(|(_, peak)| !peak.saturated);
        let bright = unsaturated.take(MAX_STARS).map(of_peak);
        config.noise = noise_of_fits(maps, bright, &config, fits);
        let starts = peaks.iter().enumerate().map(of_peak);
        let mut batch = mem::take(&mut fits.batch);
        batch.fit(maps, starts, &config, |number, fit, _| {
            let peak = &peaks[number];
            let of_fit = fit.and_then(|fit| of_fit(&fit, peak, maps));
            sources.extend(of_fit.or_else(|| of_core(peak, maps)));
        });
        fits.batch = batch;
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
    /// A spot is wider than the stars from this ratio of the sizes on.
    const WIDE: f64 = 1.6;
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
    let star = detection(maps, &spot, excess.sqrt());
    Some(Detection {
        flags: DetectionFlags {
            extended: peak.size_in(&maps.view) > WIDE * maps.spot_px,
            ..star.flags
        },
        ..star
    })
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
    let star = detection(maps, &spot, 1.0);
    Some(Detection {
        flags: DetectionFlags {
            saturated: peak.saturated,
            ..star.flags
        },
        ..star
    })
}

/// The detection of a spot, with its errors times `excess`, in coordinates of the frame.
fn detection(maps: &FrameMaps<'_>, spot: &SpotEstimate, excess: f64) -> Detection {
    let view = &maps.view;
    Detection {
        position: PixelPoint::new(spot.x + view.x0 as f64, spot.y + view.y0 as f64),
        sigma_x_px: spot.sigma_x * excess,
        sigma_y_px: spot.sigma_y * excess,
        flux_adu: spot.flux,
        peak_adu: 0.0,
        snr: spot.flux / spot.noise_flux,
        flags: DetectionFlags::default(),
    }
}

/// The number of the place that a peak is in.
fn cell_of(peak: &RawPeak, size: Size) -> usize {
    peak.y * CELLS / size.height * CELLS + peak.x * CELLS / size.width
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::DetectConfig;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SIDE: usize = 640;
    const NOISE_ADU: f64 = 8.0;

    /// Noise with these stars: place, and peak in units of the noise. `along` is the covariance of their spots.
    fn frame(stars: &[([f64; 2], f64)], along: f64) -> Frame<'static> {
        const VARIANCE_PX2: f64 = 1.4;
        let mut random = ChaCha8Rng::seed_from_u64(9);
        let mut pixels: Vec<f64> = (0..SIDE * SIDE)
            .map(|_| 100.0 + NOISE_ADU * random.sample::<f64, _>(StandardNormal))
            .collect();
        let determinant = VARIANCE_PX2 * VARIANCE_PX2 - along * along;
        for &([x, y], peak) in stars {
            for row in y as usize - 8..y as usize + 9 {
                for column in x as usize - 8..x as usize + 9 {
                    let (dx, dy) = (column as f64 - x, row as f64 - y);
                    let form = VARIANCE_PX2 * (dx * dx + dy * dy) - 2.0 * along * dx * dy;
                    let light = NOISE_ADU * peak * libm::exp(-0.5 * form / determinant);
                    pixels[row * SIDE + column] += light;
                }
            }
        }
        let pixels = pixels.into_iter().map(|adu| adu as f32).collect();
        Frame::new(SIDE, SIDE, pixels).unwrap()
    }

    /// Places on a grid, each somewhere in its pixel, with peaks from `least` times the noise up.
    fn places(count: usize, least: f64) -> Vec<([f64; 2], f64)> {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let mut place = |i: usize| {
            let [x, y] =
                [i % 10, i / 10].map(|at| 40.0 + 60.0 * at as f64 + random.random::<f64>());
            ([x, y], least * 1.03f64.powi((7 * i % 90) as i32))
        };
        (0..count).map(&mut place).collect()
    }

    fn found(frame: &Frame, count: usize) -> Detections {
        let mut found = Detections::default();
        let (config, mut workspace) = (DetectConfig::default(), Workspace::new());
        detect_brightest_into(frame, &config, count, &mut workspace, &mut found).unwrap();
        found
    }

    /// Offsets from the true places in standard errors, of both axes.
    fn pulls(found: &Detections, stars: &[([f64; 2], f64)]) -> Vec<f64> {
        let of_source = |source: &Detection| {
            let [x, y] = [source.position.x, source.position.y];
            let distance = |star: &&([f64; 2], f64)| libm::hypot(star.0[0] - x, star.0[1] - y);
            let nearest = stars
                .iter()
                .min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let [sx, sy] = nearest.unwrap().0;
            [(x - sx) / source.sigma_x_px, (y - sy) / source.sigma_y_px]
        };
        found.sources.iter().flat_map(of_source).collect()
    }

    #[test]
    fn bright_stars_are_where_they_are_within_their_errors() {
        let stars = places(90, 12.0);
        let found = found(&frame(&stars, 0.0), 100);
        assert_eq!(found.sources.len(), 90);
        let pulls = pulls(&found, &stars);
        let mean_square = pulls.iter().map(|pull| pull * pull).sum::<f64>() / pulls.len() as f64;
        assert!((0.5..1.5).contains(&mean_square), "{mean_square}");
        assert!((found.noise_adu / NOISE_ADU - 1.0).abs() < 0.05);
    }

    #[test]
    fn elongated_stars_are_where_the_middle_of_their_light_is() {
        let stars = places(90, 12.0);
        let found = found(&frame(&stars, 1.1), 100);
        assert!(found.sources.len() > 80, "{}", found.sources.len());
        let off = pulls(&found, &stars)
            .into_iter()
            .map(f64::abs)
            .fold(0.0, f64::max);
        assert!(off < 5.0, "{off}");
    }

    #[test]
    fn the_brightest_of_many_are_taken_and_hot_pixels_are_not() {
        let stars = places(90, 12.0);
        let mut frame = frame(&stars, 0.0);
        let hot = 333 * SIDE + 334;
        frame.pixels.as_f32_mut()[hot] += (500.0 * NOISE_ADU) as f32;
        let found = found(&frame, 20);
        assert_eq!(found.sources.len(), 20);
        let faintest = 12.0 * 1.03f64.powi(60);
        let flux = |peak: f64| peak * NOISE_ADU * 2.0 * std::f64::consts::PI * 1.4;
        for source in &found.sources {
            assert!(source.flux_adu > flux(faintest), "{source:?}");
            assert!(libm::hypot(source.position.x - 334.0, source.position.y - 333.0) > 5.0);
        }
    }

    #[test]
    fn few_stars_are_none_and_one_place_has_not_all() {
        assert!(found(&frame(&places(7, 30.0), 0.0), 100).sources.is_empty());
        // Lamps in a corner.
        let lamps = (0..36).map(|i| {
            (
                [20.0 + 14.0 * (i % 6) as f64, 20.0 + 14.0 * (i / 6) as f64],
                900.0,
            )
        });
        let stars: Vec<_> = lamps.chain(places(90, 12.0).into_iter().skip(30)).collect();
        let found = found(&frame(&stars, 0.0), 60);
        let in_corner = found
            .sources
            .iter()
            .filter(|s| s.position.x < 106.0 && s.position.y < 106.0);
        assert!(in_corner.count() < 10);
        assert!(found.sources.len() > 40);
    }
}
