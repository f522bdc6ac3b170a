//! Measures stars at expected places.

use super::peak::{MatchedFilter, PADDING, WindowPeak};
use super::spot_model::{SpotModel, smear_variance_px2, without_smear};
use super::square::{Square, nearest};
use crate::base::coords::PixelPoint;
use crate::base::statistics::median;
use crate::detect::fit::{
    BatchStart, FitBuffers, FitConfig, MAX_BATCH_COMPONENTS, NoiseModel, SpotEstimate, SpotFit,
    Window, window_radius,
};
use crate::detect::psf::{GaussianComponent, LocalPsf, PIXEL_VARIANCE_PX2};
use crate::detect::star_model::{BrightStars, MAX_STARS, noise_of, spot_size, weighted_size};
use crate::frame::Frame;
use arrayvec::ArrayVec;

/// Pixels between the window of a fit and the end of a square: the ring of the background.
const RING_PX: usize = 2;
/// Share of a star's variance from which on its smear is not round, and has a spot of its own.
const MIN_SMEAR_FRACTION: f64 = 0.05;
/// Longest part of a path that two Gaussians stand for, in standard deviations of the spot.
const PART_SIGMAS: f64 = 2.0;
/// Most parts of a path.
const MAX_PARTS: usize = 12;
/// Error of the local background over the peak of the star: its halo is not in the ring.
const HALO_ERROR: f64 = 0.01;
/// A local noise is taken where it differs from the others' by more standard errors.
const OWN_NOISE_SIGMAS: f32 = 3.0;
/// A spot is sharper than any star's below this size, relative to the spot's, …
const SHARP: f64 = 0.6;
/// … where the size is so by this many standard errors.
const SHARP_SIGMAS: f64 = 4.0;
/// Spot sizes with which learning begins, in pixels.
const FIRST_SPOTS_PX: [f64; 4] = [0.6, 1.0, 1.7, 2.8];

/// A place where a star is expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpectedStar {
    /// The place.
    pub position: PixelPoint,
    /// It is searched for within this distance, in pixels.
    pub radius_px: f64,
    /// Its path during the exposure, in pixels along x and y.
    pub smear_px: [f64; 2],
}

/// A star that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundStar {
    /// The centroid.
    pub position: PixelPoint,
    /// Standard errors of the centroid in x and y, in pixels.
    pub sigma_px: [f64; 2],
    /// Flux above the background, in ADU.
    pub flux_adu: f64,
    /// Flux over its noise.
    pub snr: f64,
    /// Whether pixels of its core are saturated.
    pub saturated: bool,
}

/// What was seen beside the stars.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Surplus {
    /// Peaks that were not the highest of their window.
    pub peaks: usize,
    /// Area that was searched, in px².
    pub searched_px2: f64,
}

/// Measures stars at expected places. Its buffers are reused: in steady state nothing is allocated.
#[derive(Debug, Clone, Default)]
pub struct WindowDetector {
    pixels: Vec<f32>,
    ring: Vec<f32>,
    squares: Vec<Option<Square>>,
    noises: Vec<f32>,
    filter: MatchedFilter,
    starts: Vec<BatchStart>,
    fits: FitBuffers,
    /// What was seen beside the stars of the last call of [`Self::measure`].
    surplus: Surplus,
}

impl WindowDetector {
    /// Half of the side of the square that is read for a star, in pixels.
    pub fn reach_px(model: &SpotModel, expected: &ExpectedStar) -> usize {
        let core = window_radius(model.smeared_sigma_px(expected.smear_px));
        expected.radius_px.ceil() as usize + core + RING_PX
    }

    /// What was seen beside the stars in the last call of [`Self::measure`]: how dense the sources
    /// are that may be taken for a star.
    pub fn surplus(&self) -> Surplus {
        self.surplus
    }

    /// Measures the stars of `frame` at the places `expected`; pixels at `saturation_adu` and above
    /// are left out. Sets `found` to one entry for each place, `None` where nothing stands out from
    /// the noise, what does is sharper than a star, or the square is not all within the frame.
    pub fn measure(
        &mut self,
        frame: &Frame,
        saturation_adu: f32,
        model: &SpotModel,
        expected: &[ExpectedStar],
        found: &mut Vec<Option<FoundStar>>,
    ) {
        found.clear();
        found.resize(expected.len(), None);
        self.read_squares(frame, model, expected);
        self.find_peaks(model, expected);
        let longest = expected
            .iter()
            .map(|star| components_of(model, star.smear_px))
            .max();
        if longest.unwrap_or(0) <= MAX_BATCH_COMPONENTS {
            self.fit_together(model, saturation_adu, expected, found);
        } else {
            self.fit_one_by_one(model, saturation_adu, expected, found);
        }
        for (star, square) in found.iter_mut().zip(&self.squares) {
            if let (Some(star), Some(square)) = (star, square) {
                star.saturated = is_saturated(square, &self.pixels, star, saturation_adu);
            }
        }
    }

    /// Copies the squares, and measures their background and noise.
    fn read_squares(&mut self, frame: &Frame, model: &SpotModel, expected: &[ExpectedStar]) {
        let Self {
            pixels,
            ring,
            squares,
            noises,
            ..
        } = self;
        pixels.clear();
        squares.clear();
        noises.clear();
        for star in expected {
            let place = [star.position.x, star.position.y];
            let half = Self::reach_px(model, star);
            let mut square = Square::around(place, half, frame);
            if let Some(square) = &mut square {
                square.read(frame, pixels, ring);
                noises.push(square.noise_adu);
            }
            squares.push(square);
        }
        pixels.resize(pixels.len() + PADDING, 0.0);
        // The noise of one ring is uncertain by some percents: where chance explains that it
        // differs, all windows have the same.
        if noises.len() < 2 {
            return;
        }
        let typical = median(noises);
        for square in squares.iter_mut().flatten() {
            let error = (2.0 * square.ring_pixels.max(2) as f32).sqrt().recip();
            if (square.noise_adu / typical - 1.0).abs() < OWN_NOISE_SIGMAS * error {
                square.noise_adu = typical;
            }
        }
    }

    /// Sets the initial guesses to the highest peaks.
    fn find_peaks(&mut self, model: &SpotModel, expected: &[ExpectedStar]) {
        self.starts.clear();
        self.surplus = Surplus::default();
        for (number, (star, square)) in expected.iter().zip(&self.squares).enumerate() {
            let Some(square) = square else {
                continue;
            };
            let spot_px = model.smeared_sigma_px(star.smear_px);
            self.filter.set_size(filter_size_px(spot_px));
            let place = [star.position.x, star.position.y];
            let peaks = self
                .filter
                .peaks(square, &self.pixels, place, star.radius_px);
            self.surplus.peaks += peaks.others;
            self.surplus.searched_px2 += std::f64::consts::PI * star.radius_px.powi(2);
            if let Some(peak) = peaks.highest {
                self.starts.push(start_at(number, square, &peak, spot_px));
            }
        }
    }

    /// Fits many spots at the same time.
    fn fit_together(
        &mut self,
        model: &SpotModel,
        saturation_adu: f32,
        expected: &[ExpectedStar],
        found: &mut [Option<FoundStar>],
    ) {
        let Self {
            pixels,
            squares,
            starts,
            fits,
            ..
        } = self;
        let config = FitConfig {
            spot_px: starts.iter().map(|s| s.spot_px).fold(0.0, f64::max),
            free_size: false,
            noise: model.noise(),
        };
        let cut = |start: &BatchStart, window: &mut Window| {
            let star = &expected[start.number];
            set_smear(model, star.smear_px, &mut window.psf);
            cut_out(squares, pixels, start, saturation_adu, window);
        };
        let starts = starts.iter().copied();
        fits.batch
            .get_or_insert_default()
            .fit_cut(cut, starts, &config, |number, fit, _| {
                found[number] = fit.and_then(|fit| star_of(&fit, &expected[number]));
            });
    }

    /// Fits spots with long paths.
    fn fit_one_by_one(
        &mut self,
        model: &SpotModel,
        saturation_adu: f32,
        expected: &[ExpectedStar],
        found: &mut [Option<FoundStar>],
    ) {
        let Self {
            pixels,
            squares,
            starts,
            fits,
            ..
        } = self;
        let FitBuffers { fitter, window, .. } = fits;
        for start in starts.iter() {
            let star = &expected[start.number];
            cut_out(squares, pixels, start, saturation_adu, window);
            set_smear(model, star.smear_px, &mut window.psf);
            let config = FitConfig {
                spot_px: window.psf.spot_px,
                free_size: false,
                noise: model.noise(),
            };
            let mut fit = fitter.fit(window, &[start.spot], &config);
            fitter.set_flux_noise(window, &mut fit, &config);
            if fit.converged {
                found[start.number] = star_of(&fit, star);
            }
        }
    }

    /// Measures spot size and noise model on the stars at these positions, brightest first, with
    /// their paths during the exposure. The stars should stand alone. `None` where too few can be
    /// measured.
    pub fn learn(
        &mut self,
        frame: &Frame,
        saturation_adu: f32,
        stars: &[(PixelPoint, [f64; 2])],
    ) -> Option<SpotModel> {
        let stars = &stars[..stars.len().min(MAX_STARS)];
        let smears = stars.iter().map(|(_, smear_px)| *smear_px);
        let variance_px2 =
            smears.clone().map(smear_variance_px2).sum::<f64>() / stars.len().max(1) as f64;
        // The filter that stars stand out from most is that of their size.
        let mut best = (0.0, None);
        for spot_px in FIRST_SPOTS_PX {
            let model = model_of(spot_px);
            let total = self.expect(frame, &model, stars);
            if total > best.0 {
                best = (total, Some(model));
            }
        }
        let first = best.1?;
        self.expect(frame, &first, stars);
        let spot_px = self.round_size_px(&first, saturation_adu)?;
        let mut model = SpotModel {
            spot_sigma_px: without_smear(spot_px, variance_px2),
            ..first
        };
        self.expect(frame, &model_of(spot_px), stars);
        let mut windows: ArrayVec<(Window, SpotEstimate), MAX_STARS> = ArrayVec::new();
        for start in &self.starts {
            let mut window = Window::default();
            cut_out(
                &self.squares,
                &self.pixels,
                start,
                saturation_adu,
                &mut window,
            );
            let smear_px = stars[start.number].1;
            set_smear(&model, smear_px, &mut window.psf);
            windows.push((window, start.spot));
        }
        let noise = noise_of(&mut windows, model.spot_sigma_px, &mut self.fits);
        (model.shot_adu, model.model_error2) = (noise.shot_adu, noise.model_error2);
        Some(model)
    }

    /// Finds the peaks of stars at known positions; returns the sum of their signal-to-noise ratios.
    fn expect(
        &mut self,
        frame: &Frame,
        model: &SpotModel,
        stars: &[(PixelPoint, [f64; 2])],
    ) -> f64 {
        /// Known positions are exact to a fraction of a pixel.
        const RADIUS_PX: f64 = 1.5;
        let star = |&(position, _): &(PixelPoint, [f64; 2])| ExpectedStar {
            position,
            radius_px: RADIUS_PX,
            smear_px: [0.0; 2],
        };
        let expected: ArrayVec<ExpectedStar, MAX_STARS> = stars.iter().map(star).collect();
        self.read_squares(frame, model, &expected);
        self.find_peaks(model, &expected);
        let snr = |start: &BatchStart| start.spot.flux / start.spot.noise_flux;
        self.starts.iter().map(snr).sum()
    }

    /// The mode of the sizes of the stars, fitted as round spots, in pixels.
    fn round_size_px(&mut self, first: &SpotModel, saturation_adu: f32) -> Option<f64> {
        let Self {
            pixels,
            squares,
            starts,
            fits,
            ..
        } = self;
        let noise_adu = squares.iter().flatten().map(|square| square.noise_adu);
        let config = FitConfig {
            spot_px: first.spot_sigma_px,
            free_size: true,
            // Too little noise, and a fit follows the brightest pixel wherever it is.
            noise: NoiseModel {
                shot_adu: f64::from(noise_adu.fold(0.0, f32::max)),
                model_error2: 0.0,
            },
        };
        let mut sizes = BrightStars::new();
        let cut = |start: &BatchStart, window: &mut Window| {
            window.psf.components.clear();
            cut_out(squares, pixels, start, saturation_adu, window);
        };
        let starts = starts.iter().copied();
        fits.batch
            .get_or_insert_default()
            .fit_cut(cut, starts, &config, |_, fit, _| {
                sizes.extend(fit);
            });
        let mode = spot_size(&sizes)?;
        let is_near = |fit: &&SpotFit| libm::log(fit.spot_px / mode.spot_px).abs() < 0.25;
        weighted_size(sizes.iter().filter(is_near)).or(Some(mode.spot_px))
    }
}

fn model_of(spot_sigma_px: f64) -> SpotModel {
    SpotModel {
        spot_sigma_px,
        shot_adu: 0.0,
        model_error2: 0.0,
    }
}

/// The size that the filter is made for: few sizes, so that it is made rarely.
fn filter_size_px(spot_px: f64) -> f64 {
    const STEP_PX: f64 = 0.25;
    (spot_px / STEP_PX).round().max(1.0) * STEP_PX
}

/// Number of Gaussians along the path of a star; 0 where its spot is round.
fn components_of(model: &SpotModel, smear_px: [f64; 2]) -> usize {
    let width2 = model.spot_sigma_px.powi(2) + PIXEL_VARIANCE_PX2;
    if 2.0 * smear_variance_px2(smear_px) <= MIN_SMEAR_FRACTION * width2 {
        return 0;
    }
    let length_px = libm::hypot(smear_px[0], smear_px[1]);
    let parts = (length_px / (PART_SIGMAS * model.spot_sigma_px)).ceil() as usize;
    2 * parts.clamp(1, MAX_PARTS)
}

/// The spot of a star that moves: Gaussians along its path, by Gauss-Legendre quadrature with two
/// points in each part of the path.
fn set_smear(model: &SpotModel, smear_px: [f64; 2], psf: &mut LocalPsf) {
    psf.spot_px = model.spot_sigma_px;
    psf.components.clear();
    let components = components_of(model, smear_px);
    for part in 0..components / 2 {
        for point in [-1.0, 1.0] {
            let within = 0.5 + 0.5 * point / 3f64.sqrt();
            let along = 2.0 * (part as f64 + within) / components as f64 - 0.5;
            psf.components.push(GaussianComponent {
                offset_px: smear_px.map(|path_px| along * path_px),
                sigma_px: model.spot_sigma_px,
                share: 1.0 / components as f64,
            });
        }
    }
}

/// The initial guess at a peak.
fn start_at(number: usize, square: &Square, peak: &WindowPeak, spot_px: f64) -> BatchStart {
    let noise_adu = f64::from(square.noise_adu);
    let flux = f64::from(peak.flux) * noise_adu;
    BatchStart {
        number,
        spot: SpotEstimate {
            x: square.x0 as f64 + peak.at[0],
            y: square.y0 as f64 + peak.at[1],
            flux,
            noise_flux: flux / f64::from(peak.snr),
            ..SpotEstimate::default()
        },
        spot_px,
    }
}

/// Cuts the window of a fit out of the square of its star.
fn cut_out(
    squares: &[Option<Square>],
    pixels: &[f32],
    start: &BatchStart,
    saturation_adu: f32,
    window: &mut Window,
) {
    let BatchStart {
        number,
        spot,
        spot_px,
    } = start;
    let Some(square) = squares[*number] else {
        return;
    };
    let (place, radius) = ([spot.x, spot.y], window_radius(*spot_px));
    square.cut_out(pixels, place, radius, saturation_adu, window);
    window.background_noise = square.background_error_adu();
    let width2 = spot_px.powi(2) + PIXEL_VARIANCE_PX2;
    let peak = spot.flux / (std::f64::consts::TAU * width2);
    window.background_error = libm::hypot(window.background_noise, HALO_ERROR * peak);
}

/// The star of a fit that converged; `None` if it is not a star, or not where it is expected.
fn star_of(fit: &SpotFit, expected: &ExpectedStar) -> Option<FoundStar> {
    let spot = fit.spots.first()?;
    let position = PixelPoint::new(spot.x, spot.y);
    let is_sharp = fit.size_excess_px < -SHARP_SIGMAS * fit.size_error_px
        && fit.spot_px + fit.size_excess_px < SHARP * fit.spot_px;
    let is_there = position.distance_to(&expected.position) <= expected.radius_px + 1.0;
    let is_star = spot.has_position(fit.spot_px) && spot.flux > 0.0 && spot.noise_flux > 0.0;
    (is_star && is_there && !is_sharp).then(|| FoundStar {
        position,
        sigma_px: [spot.sigma_x, spot.sigma_y],
        flux_adu: spot.flux,
        snr: spot.flux / spot.noise_flux,
        saturated: false,
    })
}

/// Whether a pixel next to the centre of a star is saturated.
fn is_saturated(square: &Square, pixels: &[f32], star: &FoundStar, saturation_adu: f32) -> bool {
    let at = |center: f64, first: usize| nearest(center).unwrap_or(0).saturating_sub(first);
    let (x, y) = (
        at(star.position.x, square.x0),
        at(star.position.y, square.y0),
    );
    let columns = x.saturating_sub(1)..(x + 2).min(square.side);
    let rows = square.pixels(pixels).chunks_exact(square.side);
    let rows = rows.skip(y.saturating_sub(1)).take(3);
    rows.flat_map(|row| &row[columns.clone()])
        .any(|&pixel| pixel >= saturation_adu)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::psf::AxisProfile;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SIDE: usize = 320;
    const LEVEL: f32 = 300.0;
    const NOISE: f32 = 6.0;
    /// Electrons per ADU.
    const GAIN: f64 = 0.5;

    /// A frame of stars on a grid with random fractions of pixels, and their true positions.
    fn frame(spot_px: f64, smear_px: [f64; 2], seed: u64) -> (Frame<'static>, Vec<PixelPoint>) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut light = vec![0.0f64; SIDE * SIDE];
        let mut stars = Vec::new();
        for i in 0..36usize {
            let place = |at: usize| 25.0 + 53.0 * at as f64;
            let x = place(i % 6) + rng.random_range(-0.5..0.5);
            let y = place(i / 6) + rng.random_range(-0.5..0.5);
            let flux = 1000.0 * 1.08f64.powi(i as i32);
            stars.push((flux, PixelPoint::new(x, y)));
            const STEPS: usize = 40;
            for step in 0..STEPS {
                let along = (step as f64 + 0.5) / STEPS as f64 - 0.5;
                let (mut across, mut down) = (AxisProfile::default(), AxisProfile::default());
                let [x0, y0] = [x, y].map(|at| at.round() as usize - 16);
                across.fill(x - x0 as f64 + along * smear_px[0], spot_px, 33);
                down.fill(y - y0 as f64 + along * smear_px[1], spot_px, 33);
                for row in 0..33 {
                    for column in 0..33 {
                        light[(y0 + row) * SIDE + x0 + column] += flux / STEPS as f64
                            * f64::from(across.pixel(column).value * down.pixel(row).value);
                    }
                }
            }
        }
        let pixel = |light: f64| {
            let noise = (f64::from(NOISE).powi(2) + light / GAIN).sqrt();
            let noise = noise * rng.sample::<f64, _>(StandardNormal);
            (f64::from(LEVEL) + light + noise) as f32
        };
        let pixels = light.into_iter().map(pixel).collect();
        stars.sort_by(|a, b| b.0.total_cmp(&a.0));
        let frame = Frame::new(SIDE, SIDE, pixels).unwrap();
        (frame, stars.into_iter().map(|star| star.1).collect())
    }

    fn known(stars: &[PixelPoint], smear_px: [f64; 2]) -> Vec<(PixelPoint, [f64; 2])> {
        stars.iter().map(|star| (*star, smear_px)).collect()
    }

    /// Measures frames with the model of the first one; returns the sums of squared pulls and their
    /// number.
    fn pulls(spot_px: f64, smear_px: [f64; 2]) -> (f64, f64) {
        let mut detector = WindowDetector::default();
        let mut found = Vec::new();
        let (first, stars) = frame(spot_px, smear_px, 1);
        let model = detector.learn(&first, f32::INFINITY, &known(&stars, smear_px));
        let model = model.unwrap();
        assert!(
            (model.spot_sigma_px / spot_px - 1.0).abs() < 0.1,
            "{model:?}"
        );
        let (mut squares, mut count) = (0.0, 0.0);
        for seed in 2..12 {
            let (frame, stars) = frame(spot_px, smear_px, seed);
            let off = |star: &PixelPoint| ExpectedStar {
                position: PixelPoint::new(star.x + 1.3, star.y - 0.9),
                radius_px: 3.0,
                smear_px,
            };
            let expected: Vec<_> = stars.iter().map(off).collect();
            detector.measure(&frame, f32::INFINITY, &model, &expected, &mut found);
            for (found, truth) in found.iter().zip(&stars) {
                let Some(star) = found else { continue };
                squares += ((star.position.x - truth.x) / star.sigma_px[0]).powi(2);
                squares += ((star.position.y - truth.y) / star.sigma_px[1]).powi(2);
                count += 2.0;
            }
        }
        (squares, count)
    }

    #[test]
    fn standard_errors_are_those_of_the_centroids() {
        for (spot_px, smear_px) in [(0.8, [0.0; 2]), (1.3, [0.0; 2]), (0.9, [4.0, -2.5])] {
            let (squares, count) = pulls(spot_px, smear_px);
            // Nearly all stars are found, and the standard error of the mean square is 5 %.
            assert!(count > 690.0, "{count}");
            let mean = squares / count;
            assert!(
                (0.8..1.25).contains(&mean),
                "{spot_px} {smear_px:?}: {mean}"
            );
        }
    }

    #[test]
    fn nothing_is_found_where_there_is_no_star() {
        let (frame, stars) = frame(0.9, [0.0; 2], 3);
        let between = |star: &PixelPoint| ExpectedStar {
            position: PixelPoint::new(star.x + 20.0, star.y + 20.0),
            radius_px: 4.0,
            smear_px: [0.0; 2],
        };
        let expected: Vec<_> = stars.iter().map(between).collect();
        let mut found = Vec::new();
        let mut detector = WindowDetector::default();
        detector.measure(&frame, f32::INFINITY, &model_of(0.9), &expected, &mut found);
        assert!(found.iter().all(Option::is_none), "{found:?}");
        assert!(detector.surplus().searched_px2 > 1000.0);
    }

    #[test]
    fn saturated_stars_are_flagged() {
        let (mut frame, stars) = frame(0.9, [0.0; 2], 3);
        frame
            .values_mut()
            .iter_mut()
            .for_each(|p| *p = p.min(1500.0));
        let at = |star: &PixelPoint| ExpectedStar {
            position: *star,
            radius_px: 2.0,
            smear_px: [0.0; 2],
        };
        let expected: Vec<_> = stars.iter().map(at).collect();
        let mut found = Vec::new();
        let mut detector = WindowDetector::default();
        detector.measure(&frame, 1500.0, &model_of(0.9), &expected, &mut found);
        let saturated = found.iter().map(|f| f.is_some_and(|f| f.saturated));
        let flags: Vec<bool> = saturated.collect();
        assert!(flags[0] && !flags[35], "{flags:?}");
    }
}
