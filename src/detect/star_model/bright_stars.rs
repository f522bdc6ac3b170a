//! Fits of a frame's bright stars, each with a free size.
//!
//! Bright peaks that are neither saturated nor close to others are fitted. Hot pixels and cosmic
//! rays are sharper than stars, lamps and comets wider, and none of them need be few.

use super::spot_size::{BrightStars, MAX_STARS, spot_size};
use crate::base::size::Size;
use crate::detect::candidates::{Peak, RawPeak};
use crate::detect::contrast::Contrast;
use crate::detect::fit::{
    BatchStart, FitBuffers, FitConfig, FrameMaps, NoiseModel, SpotEstimate, SpotFit,
};
use crate::detect::psf::PIXEL_VARIANCE_PX2;
use arrayvec::ArrayVec;

/// Peaks below this signal-to-noise ratio say little about the size.
const MIN_SNR: f32 = 12.0;
/// Peaks that are tried, the brightest.
const MAX_PEAKS: usize = 4 * MAX_STARS;
/// Peaks that may disturb others, the brightest.
const MAX_NEIGHBORS: usize = 2000;
/// Peaks closer than this many spot sizes disturb each other,
const ISOLATION_SIGMA: f32 = 6.0;
/// with this added to the spot size, in pixels.
const SIZE_MARGIN_PX: f64 = 0.3;
/// Peaks below this part of a peak do not disturb it.
const FAINT_NEIGHBOR: f32 = 0.1;
/// Largest error of the spot model, as a part of the light in a pixel: a source with a larger one
/// is not a star.
pub(crate) const MAX_MODEL_ERROR: f64 = 0.1;

/// A peak of the frame or of the filtered frame.
pub(crate) trait BrightPeak {
    /// Column and row.
    fn place(&self) -> [usize; 2];
    /// Signal-to-noise ratio.
    fn snr(&self) -> f32;
    /// Whether it is saturated.
    fn is_saturated(&self) -> bool;
    /// Its brightest pixel, and the light beside that.
    fn contrast(&self, maps: &FrameMaps<'_>) -> Contrast;
    /// Size of the spot by the peak's curvature, in pixels.
    fn size_px(&self, maps: &FrameMaps<'_>) -> f64;
    /// The spot size that decides which neighbors disturb it, given its own, in pixels.
    fn isolation_px(&self, maps: &FrameMaps<'_>, size_px: f64) -> f64;
    /// Where a fit starts.
    fn start(&self, maps: &FrameMaps<'_>) -> SpotEstimate;
}

impl BrightPeak for Peak {
    fn place(&self) -> [usize; 2] {
        [self.x, self.y]
    }

    fn snr(&self) -> f32 {
        self.snr
    }

    fn is_saturated(&self) -> bool {
        self.saturated
    }

    fn contrast(&self, maps: &FrameMaps<'_>) -> Contrast {
        Contrast::near(&maps.view, maps.background, self.x, self.y)
    }

    /// A Gaussian of variance S² = σ² + σ_filter² + 2/12 falls to exp(−1/2S²) at the next pixel.
    fn size_px(&self, maps: &FrameMaps<'_>) -> f64 {
        let filter_px = maps.spot_px;
        let Some((value, around)) = self.values else {
            return filter_px;
        };
        let log = |value: f32| libm::log(f64::from(value.max(1e-3)));
        let drop = log(value) - 0.25 * around.into_iter().map(log).sum::<f64>();
        let variance = 0.5 / drop.max(1e-3) - filter_px * filter_px - 2.0 * PIXEL_VARIANCE_PX2;
        variance.max(0.0).sqrt().clamp(0.35, 6.0)
    }

    fn isolation_px(&self, maps: &FrameMaps<'_>, _: f64) -> f64 {
        maps.spot_px
    }

    fn start(&self, maps: &FrameMaps<'_>) -> SpotEstimate {
        maps.initial_guess(self)
    }
}

impl BrightPeak for RawPeak {
    fn place(&self) -> [usize; 2] {
        [self.x, self.y]
    }

    fn snr(&self) -> f32 {
        self.snr
    }

    fn is_saturated(&self) -> bool {
        self.saturated
    }

    fn contrast(&self, maps: &FrameMaps<'_>) -> Contrast {
        Contrast::measure(&maps.view, maps.background, self.x, self.y)
    }

    fn size_px(&self, maps: &FrameMaps<'_>) -> f64 {
        self.size_in(&maps.view)
    }

    fn isolation_px(&self, _: &FrameMaps<'_>, size_px: f64) -> f64 {
        size_px
    }

    fn start(&self, _: &FrameMaps<'_>) -> SpotEstimate {
        SpotEstimate {
            x: self.x as f64,
            y: self.y as f64,
            flux: self.flux_adu,
            ..SpotEstimate::default()
        }
    }
}

/// Fits the brightest of `peaks`, brightest first.
///
/// Where these crowd in a few places, as windows and lamps do, the brightest of many places are
/// fitted as well, and the sharper ones of the two are the stars.
pub(crate) fn fit_bright_stars<P: BrightPeak>(
    maps: &FrameMaps<'_>,
    peaks: &[P],
    buffers: &mut FitBuffers,
) -> BrightStars {
    let bright = &peaks[..peaks.partition_point(|peak| peak.snr() >= MIN_SNR)];
    let brightest = fit_peaks(maps, bright.iter(), peaks, buffers);
    let Some(spread) = spread(bright, maps.view.size()) else {
        return brightest;
    };
    let spread = fit_peaks(maps, spread.into_iter(), peaks, buffers);
    let is_sharper = match (spot_size(&spread), spot_size(&brightest)) {
        (Some(a), Some(b)) => a.spot_px < b.spot_px && 2 * a.stars >= b.stars,
        (of_spread, _) => of_spread.is_some(),
    };
    if is_sharper { spread } else { brightest }
}

/// Fits the first of `bright` that are alone among all `peaks`.
fn fit_peaks<'a, P: BrightPeak + 'a>(
    maps: &FrameMaps<'_>,
    bright: impl Iterator<Item = &'a P>,
    peaks: &[P],
    buffers: &mut FitBuffers,
) -> BrightStars {
    let of_light = bright
        .filter(|peak| !peak.is_saturated() && !peak.contrast(maps).is_sharper_than_any_spot());
    let mut alone = isolated_peaks(maps, of_light.take(MAX_PEAKS), peaks);
    let mut stars = BrightStars::new();
    loop {
        let wanted = stars.remaining_capacity();
        let tried = alone.by_ref().take(wanted);
        let tried: Starts = tried
            .map(|(peak, size_px)| (peak.start(maps), size_px))
            .collect();
        if tried.is_empty() {
            return stars;
        }
        let fits = fit_stars(maps, &tried, buffers);
        stars.extend(fits.into_iter().flatten());
    }
}

/// Where fits start, each with the size of the spot in pixels.
type Starts = ArrayVec<(SpotEstimate, f64), MAX_STARS>;

/// Those of `bright` that no other of all `peaks` disturbs, with their sizes by the peaks' curvature in
/// pixels.
pub(crate) fn isolated_peaks<'a, P: BrightPeak + 'a>(
    maps: &FrameMaps<'_>,
    bright: impl Iterator<Item = &'a P>,
    peaks: &[P],
) -> impl Iterator<Item = (&'a P, f64)> {
    let neighbors = &peaks[..peaks.len().min(MAX_NEIGHBORS)];
    bright
        .map(|peak| (peak, peak.size_px(maps)))
        .filter(|(peak, size_px)| {
            let isolation_px = peak.isolation_px(maps, *size_px) as f32;
            let reach_px = ISOLATION_SIGMA * (isolation_px + SIZE_MARGIN_PX as f32);
            let mut others = neighbors.iter().filter(|o| is_rival(o.snr(), peak.snr()));
            !others.any(|other| is_near(peak.place(), other.place(), reach_px))
        })
}

/// The peaks, those first that are the brightest of their place; `None` where the brightest peaks
/// of the frame are not crowded.
fn spread<P: BrightPeak>(peaks: &[P], size: Size) -> Option<Vec<&P>> {
    /// Places along each side.
    const CELLS: usize = 6;
    /// The brightest stars of a frame are in 20 of the 36 places on average, with a standard
    /// deviation of 2.
    const CROWDED_CELLS: usize = 12;
    let cell_of = |peak: &P| {
        let [x, y] = peak.place();
        y * CELLS / size.height * CELLS + x * CELLS / size.width
    };
    let mut in_cell = [0usize; CELLS * CELLS];
    for peak in peaks.iter().take(MAX_STARS) {
        in_cell[cell_of(peak)] += 1;
    }
    let occupied = in_cell.iter().filter(|count| **count > 0).count();
    if peaks.len() <= MAX_STARS || occupied >= CROWDED_CELLS {
        return None;
    }
    in_cell.fill(0);
    let ranks = peaks.iter().map(|peak| {
        let count = &mut in_cell[cell_of(peak)];
        *count += 1;
        *count
    });
    let mut ranked: Vec<(usize, &P)> = ranks.zip(peaks).collect();
    ranked.sort_by_key(|(rank, _)| *rank);
    Some(ranked.into_iter().map(|(_, peak)| peak).collect())
}

/// Whether a peak is bright enough to disturb another.
fn is_rival(other_snr: f32, snr: f32) -> bool {
    other_snr >= FAINT_NEIGHBOR * snr
}

/// Whether two places are within `reach_px` of each other, but not the same.
fn is_near(a: [usize; 2], b: [usize; 2], reach_px: f32) -> bool {
    let dx = b[0] as f32 - a[0] as f32;
    let dy = b[1] as f32 - a[1] as f32;
    (dx != 0.0 || dy != 0.0) && dx * dx + dy * dy <= reach_px * reach_px
}

/// Fits stars with free sizes; `None` where one is none, or not alone.
fn fit_stars(
    maps: &FrameMaps<'_>,
    starts: &Starts,
    buffers: &mut FitBuffers,
) -> ArrayVec<Option<SpotFit>, MAX_STARS> {
    let mut fits: ArrayVec<Option<SpotFit>, MAX_STARS> = starts.iter().map(|_| None).collect();
    let config = FitConfig {
        spot_px: starts
            .iter()
            .map(|(_, size_px)| *size_px)
            .fold(0.0, f64::max),
        free_size: true,
        noise: NoiseModel::default(),
    };
    let batch_starts = starts
        .iter()
        .enumerate()
        .map(|(number, (spot, size_px))| BatchStart {
            number,
            spot: *spot,
            spot_px: *size_px,
        });
    let mut batch = buffers.batch.take().unwrap_or_default();
    batch.fit(maps, batch_starts, &config, |number, fit, window| {
        let (spot, size_px) = starts[number];
        let fit = match fit {
            // A window that is too small for the star is widened.
            Some(fit) if maps.window_radius(fit.spot_px) > maps.window_radius(size_px) => {
                let fit = buffers.fit_free_size(maps, spot, &[], size_px, config.noise);
                fit.converged.then_some(fit)
            }
            fit => {
                buffers.window.copy_from(window);
                fit
            }
        };
        fits[number] = fit.filter(|fit| fit.spots[0].flux > 0.0 && is_alone(fit, buffers));
    });
    buffers.batch = Some(batch);
    fits
}

/// Whether the fit's window, which is still in `buffers`, holds no light of another star: no pixel
/// with next to no light of the star is above what its error and noise explain.
fn is_alone(fit: &SpotFit, buffers: &mut FitBuffers) -> bool {
    /// Noise of a pixel, in standard deviations.
    const NOISE_SIGMA: f64 = 5.0;
    let mut pixels = buffers.fitter.compare(&buffers.window, fit);
    let peak = pixels
        .clone()
        .fold(0.0f64, |peak, (_, light)| peak.max(light));
    let faint = MAX_MODEL_ERROR * peak;
    let most = faint + NOISE_SIGMA;
    !pixels.any(|(above, light)| light < faint && above - light > most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::{DetectConfig, Workspace, detect};
    use crate::frame::Frame;

    fn peak((x, y): (usize, usize)) -> Peak {
        Peak {
            x,
            y,
            offset_px: [0.0; 2],
            values: None,
            snr: 20.0,
            prominence: 20.0,
            region: 0,
            saturated: false,
        }
    }

    #[test]
    fn many_saturated_stars_hide_the_size_of_no_others() {
        const SIDE: usize = 600;
        const SPOT_PX: f64 = 0.7;
        const FULL_ADU: f64 = 1000.0;
        let mut pixels: Vec<f64> = (0..SIDE * SIDE)
            .map(|i| 100.0 + (i * 7919 % 101) as f64 * 0.1)
            .collect();
        for star in 0..324 {
            let [x, y] = [star % 18, star / 18].map(|at| 40.3 + 30.0 * at as f64 + 0.3);
            let peak_adu = if star % 2 == 0 { 5000.0 } else { 500.0 };
            for row in y as usize - 5..y as usize + 6 {
                for column in x as usize - 5..x as usize + 6 {
                    let r2 = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                    let pixel = &mut pixels[row * SIDE + column];
                    *pixel += peak_adu * libm::exp(-0.5 * r2 / (SPOT_PX * SPOT_PX));
                }
            }
        }
        let pixels = pixels.into_iter().map(|adu| adu.min(FULL_ADU) as f32);
        let frame = Frame::new(SIDE, SIDE, pixels.collect()).unwrap();
        let config = DetectConfig {
            saturation_adu: Some(FULL_ADU),
            ..DetectConfig::default()
        };
        let found = detect(&frame, &config, &mut Workspace::new()).unwrap();
        // Pixels are sampled here, not integrated.
        let drawn_px = (SPOT_PX * SPOT_PX - PIXEL_VARIANCE_PX2).sqrt();
        assert!(
            (found.spot_sigma_px / drawn_px - 1.0).abs() < 0.05,
            "{}",
            found.spot_sigma_px
        );
    }

    #[test]
    fn lamps_in_one_place_do_not_hide_stars_elsewhere() {
        let lamps = (0..200).map(|i| (i % 20, 100 + i / 20));
        let stars = (0..30).map(|i| (300 + 20 * i, 37 * i % 600));
        let peaks: Vec<_> = lamps.chain(stars).map(peak).collect();
        let tried = spread(&peaks, Size::new(900, 600)).unwrap();
        let stars = tried.iter().take(MAX_STARS).filter(|peak| peak.x >= 300);
        assert!(stars.count() > 15);
        let stars = (0..200).map(|i| (i * 377 % 900, i * 239 % 600));
        let peaks: Vec<_> = stars.map(peak).collect();
        assert!(spread(&peaks, Size::new(900, 600)).is_none());
    }
}
