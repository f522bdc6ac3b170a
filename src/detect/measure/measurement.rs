//! From peaks to detections: groups of touching spots, close pairs, centroids, flags.

use super::core::Core;
use super::estimate::{brightest_within, detection_of};
use super::known_spots::{KnownSpots, PeakSurroundings};
use super::pairs::{PairFitter, may_be_pair};
use super::ring::Ring;
use super::star_shape::StarShape;
use super::{centroid, shape};
use crate::base::coords::PixelPoint;
use crate::base::interrupt::Interrupted;
use crate::detect::candidates::{Peak, Region};
use crate::detect::config::CentroidMethod;
use crate::detect::detection::Detection;
use crate::detect::fit::{
    BatchStart, FitBuffers, FitConfig, FrameMaps, NoiseModel, SpotEstimate, SpotFit, SpotGroup,
};
use crate::detect::psf::PIXEL_VARIANCE_PX2;
use crate::detect::threads::for_each_worker;

/// Spots closer than this many of their standard deviations touch, and are fitted together.
const TOUCHING_SIGMA: f64 = 4.6;

/// Buffers of the measurement.
#[derive(Debug, Clone, Default)]
pub(crate) struct MeasureBuffers {
    /// One for each thread.
    workers: Vec<MeasureWorker>,
    known: KnownSpots,
}

impl MeasureBuffers {
    /// Shares the isolated peaks among `threads` threads.
    pub fn set_threads(&mut self, threads: usize) {
        self.workers.resize_with(threads, MeasureWorker::default);
    }
}

/// Buffers and results of one thread.
#[derive(Debug, Clone, Default)]
struct MeasureWorker {
    fits: FitBuffers,
    /// Detections of this thread.
    detections: Vec<Detection>,
}

/// Measures the peaks of a frame.
pub(crate) struct Measurement<'a> {
    /// The frame with its background, noise and spot.
    pub maps: FrameMaps<'a>,
    /// Variance of the pixels.
    pub noise: NoiseModel,
    /// The shape of the stars.
    pub shape: StarShape,
    /// The least light beside a pixel of a star, over that in it.
    pub least_beside: f64,
    /// How positions are measured.
    pub method: CentroidMethod,
    /// The regions that hold the peaks.
    pub regions: &'a [Region],
    /// Threshold of the search, in units of the local noise.
    pub threshold: f64,
    /// The ring around a source.
    pub ring: Ring,
}

impl Measurement<'_> {
    /// Measures all peaks, which come strongest first.
    ///
    /// # Errors
    /// [`Interrupted`].
    pub fn run(
        &self,
        peaks: &[Peak],
        buffers: &mut MeasureBuffers,
        detections: &mut Vec<Detection>,
    ) -> Result<(), Interrupted> {
        let MeasureBuffers { workers, known } = buffers;
        known.begin(peaks, &self.maps, self.reach_px());
        let threads = workers.len();
        // Isolated peaks do not depend on each other: threads share them.
        let KnownSpots {
            spots, isolated, ..
        } = &*known;
        for_each_worker(workers, &|worker, thread| {
            let of_thread = isolated.iter().skip(thread).step_by(threads);
            let indices = of_thread.map(|&index| index as usize);
            self.measure_isolated(peaks, indices, spots, worker);
        });
        self.maps.view.check()?;
        for worker in workers.iter_mut() {
            detections.append(&mut worker.detections);
        }
        let Some(MeasureWorker { fits, .. }) = workers.first_mut() else {
            return Ok(());
        };
        for i in 0..known.crowded.len() {
            self.maps.view.check()?;
            let index = known.crowded[i] as usize;
            let surroundings = known.around(index, peaks, self.touching_px());
            if let Some(spot) = self.measure(&surroundings, None, fits, detections) {
                known.set(index, spot);
            }
        }
        Ok(())
    }

    /// Measures peaks without others within reach.
    fn measure_isolated(
        &self,
        peaks: &[Peak],
        indices: impl Iterator<Item = usize> + Clone,
        spots: &[SpotEstimate],
        MeasureWorker { fits, detections }: &mut MeasureWorker,
    ) {
        detections.clear();
        let surroundings = |index: usize| PeakSurroundings {
            peaks,
            index,
            near: &[],
            start: SpotGroup::from_iter([spots[index]]),
            beyond: &[],
        };
        // Only Gaussian spots are fitted in batches.
        let is_single = |i: &usize| peaks[*i].saturated || self.maps.psf.is_some();
        let indices = indices.take_while(|_| !self.maps.view.is_interrupted());
        let singly = indices.clone().filter(is_single);
        let in_batches = indices.filter(|i| !is_single(i));
        for index in singly {
            self.measure(&surroundings(index), None, fits, detections);
        }
        let mut batch = fits.batch.take().unwrap_or_default();
        let starts = in_batches.map(|index| BatchStart {
            number: index,
            spot: spots[index],
            spot_px: self.maps.spot_px,
        });
        let config = self.fit_config();
        batch.fit(&self.maps, starts, &config, |index, fit, window| {
            fits.window.copy_from(window);
            let unfitted = || fits.fitter.unfitted(window, spots[index], &config);
            let fit = fit.unwrap_or_else(unfitted);
            self.measure(&surroundings(index), Some(fit), fits, detections);
        });
        fits.batch = Some(batch);
    }

    /// Distance within which a spot matters to another, in pixels.
    fn reach_px(&self) -> f64 {
        /// Spots closer than this many standard deviations beyond the window have light in it.
        const MARGIN_SIGMA: f64 = 3.0;
        self.maps.window_radius(self.maps.spot_px) as f64 * 1.5
            + MARGIN_SIGMA * self.maps.width_px()
    }

    /// Distance within which spots touch, in pixels.
    fn touching_px(&self) -> f64 {
        TOUCHING_SIGMA * self.maps.width_px()
    }

    /// Whether stars are elongated, and fitted with round spots.
    fn is_misfitted(&self) -> bool {
        self.shape.is_elongated() && self.maps.psf.is_none()
    }

    fn fit_config(&self) -> FitConfig {
        FitConfig {
            spot_px: self.maps.spot_px,
            free_size: false,
            noise: self.noise,
        }
    }

    /// Measures one peak: adds one detection, or two for a close pair. Returns its spot if the fit
    /// converged.
    ///
    /// Where the peak was `fitted`, the window of the fit is in `buffers`.
    fn measure(
        &self,
        surroundings: &PeakSurroundings<'_>,
        fitted: Option<SpotFit>,
        buffers: &mut FitBuffers,
        out: &mut Vec<Detection>,
    ) -> Option<SpotEstimate> {
        let PeakSurroundings { start, beyond, .. } = surroundings;
        let peak = surroundings.peak();
        let region = &self.regions[peak.region];
        let mut fit = match fitted {
            Some(fit) => fit,
            None => self.fit_spots(start, peak, beyond, buffers),
        };
        fit.converged &= fit.spots[0].has_position(fit.spot_px);
        let is_single = fit.converged && start.len() == 1;
        let may_be_pair =
            is_single && !self.is_misfitted() && may_be_pair(&fit, peak, region, self.maps.spot_px);
        let pair = if may_be_pair {
            let pair_fitter = PairFitter {
                maps: &self.maps,
                noise: self.noise,
                beyond,
            };
            pair_fitter.fit(&fit, buffers)
        } else {
            None
        };
        let is_star = pair.is_none() && is_single && !peak.saturated;
        if pair.is_none() && is_single && peak.saturated {
            self.move_to_core(&mut fit, peak);
        }
        if let Some(pair) = pair {
            fit = self.add_companion(pair, surroundings, buffers, out);
        }
        let mut detection = detection_of(&self.maps, &self.noise, &fit, peak, region);
        let may_be_edge = fit.spots.len() == 1 && !peak.saturated;
        detection.flags.extended = may_be_edge && self.ring.is_bright(&self.maps, peak);
        if is_star {
            shape::flag_size(&self.maps, &self.shape, peak, &fit, &mut detection, buffers);
        }
        detection.flags.hot_pixel |= self.is_too_sharp(peak);
        detection.flags.blended = fit.spots.len() > 1;
        self.flag_trail(peak, region, &mut detection);
        if self.is_misfitted() && fit.spots.len() == 1 {
            self.center_elongated(&fit, peak, &mut detection, buffers);
        }
        self.finish(&fit, &mut detection, buffers, out);
        fit.converged.then(|| fit.spots[0])
    }

    /// Fits the spots at a peak: a single saturated one with a size of its own, as of its light
    /// only the wings are left.
    fn fit_spots(
        &self,
        start: &SpotGroup,
        peak: &Peak,
        beyond: &[SpotEstimate],
        buffers: &mut FitBuffers,
    ) -> SpotFit {
        let mut fit = if peak.saturated && start.len() == 1 {
            let size_px = 1.5 * self.maps.spot_px;
            buffers.fit_free_size(&self.maps, start[0], beyond, size_px, self.noise)
        } else {
            buffers.fit_fixed_size(&self.maps, start, beyond, self.noise)
        };
        if peak.saturated {
            self.judge_saturated(&mut fit);
        } else if fit.spots[0].has_position(fit.spot_px) {
            let FitBuffers { fitter, window, .. } = buffers;
            fitter.set_flux_noise(window, &mut fit, &self.fit_config());
        }
        fit
    }

    /// Raises the errors of a saturated star to what its residuals tell: the form of the wings is
    /// not measured on the other stars. Nothing is left of a fit to what is too sharp for a star:
    /// what was fitted are a few dark pixels around the core, and the flux is a guess.
    fn judge_saturated(&self, fit: &mut SpotFit) {
        /// Smallest size of a star over that of the others: optics and focus change over the frame.
        const MIN_RELATIVE_SIZE: f64 = 0.6;
        fit.converged &= fit.spot_px >= MIN_RELATIVE_SIZE * self.maps.spot_px;
        let excess = fit.chi2 / fit.degrees_of_freedom.max(1.0);
        let factor = excess.max(1.0).sqrt();
        for spot in &mut fit.spots {
            for sigma in [&mut spot.sigma_x, &mut spot.sigma_y, &mut spot.sigma_flux] {
                *sigma *= factor;
            }
            // The flux is extrapolated: noise is the least of its error.
            spot.noise_flux = spot.sigma_flux;
        }
    }

    /// Takes the centre of light for a long star, or an elongated one where the fit is elsewhere: a
    /// round spot may settle anywhere along it. Where they agree the fit is the more exact.
    fn center_elongated(
        &self,
        fit: &SpotFit,
        peak: &Peak,
        detection: &mut Detection,
        buffers: &mut FitBuffers,
    ) {
        /// Fainter stars have no core: noise breaks it up.
        const MIN_SNR: f32 = 15.0;
        /// Distance of the two that is significant, in standard errors.
        const SIGNIFICANT_SIGMA: f64 = 3.0;
        if detection.flags.trail {
            return;
        }
        let mut centred = *detection;
        if let Some(core) = Core::at(&self.maps, peak).filter(|_| peak.snr >= MIN_SNR) {
            centred.position = PixelPoint::new(core.x, core.y);
            (centred.sigma_x_px, centred.sigma_y_px) = (core.sigma_px, core.sigma_px);
        } else {
            centroid::grey_weighted(&self.maps, &self.noise, fit, &mut centred, buffers);
            // The window cuts off its ends at whole pixels.
            for sigma in [&mut centred.sigma_x_px, &mut centred.sigma_y_px] {
                *sigma = libm::hypot(*sigma, PIXEL_VARIANCE_PX2.sqrt());
            }
        }
        let error_px = |d: &Detection| d.sigma_x_px.max(d.sigma_y_px);
        let distance_px = centred.position.distance_to(&detection.position);
        let fit_error_px = error_px(detection);
        let is_off =
            distance_px > SIGNIFICANT_SIGMA * libm::hypot(fit_error_px, error_px(&centred));
        if is_off || self.shape.is_long() || !fit_error_px.is_finite() {
            *detection = centred;
        }
    }

    /// Moves a saturated star from the centre of its wings, which are all that was fitted, to its
    /// core where the two disagree: its spot is lopsided (coma), and of the stars that are not
    /// saturated hardly more than the core stands out.
    fn move_to_core(&self, fit: &mut SpotFit, peak: &Peak) {
        /// Distance of the two that is significant, in standard errors.
        const SIGNIFICANT_SIGMA: f64 = 3.0;
        /// The core of a star whose charge ran along a column is longer than this, over its
        /// breadth; its wings are right.
        const MAX_ELONGATION: f64 = 2.0;
        let Some(core) = Core::at(&self.maps, peak) else {
            return;
        };
        // Of a star that is hardly saturated the wings are nearly all.
        let is_wide = core.spot_px() > self.maps.width_px();
        let [major_px, minor_px] = StarShape::default().axes_px(core.covariance);
        let is_compact = major_px < MAX_ELONGATION * minor_px;
        let spot = &mut fit.spots[0];
        let distance_px = libm::hypot(core.x - spot.x, core.y - spot.y);
        let error_px = libm::hypot(core.sigma_px, spot.sigma_x.max(spot.sigma_y));
        let is_off = distance_px > SIGNIFICANT_SIGMA * error_px;
        if is_wide && is_compact && is_off {
            (spot.x, spot.y) = (core.x, core.y);
            // The centre depends on the level by about the distance of the two.
            let uncertain_px = distance_px * PIXEL_VARIANCE_PX2.sqrt();
            // Not that of noise, for which errors are raised where it is correlated.
            let sigma_px = libm::hypot(core.sigma_px, uncertain_px);
            let correlation = self.maps.position_correlation_at(spot.x, spot.y);
            [spot.sigma_x, spot.sigma_y] = correlation.map(|correlation| sigma_px / correlation);
        }
    }

    /// Adds the companion of a pair, unless that is another peak, which is measured by itself.
    /// Returns the pair with the spot of this peak first.
    fn add_companion(
        &self,
        mut pair: SpotFit,
        surroundings: &PeakSurroundings<'_>,
        buffers: &mut FitBuffers,
        out: &mut Vec<Detection>,
    ) -> SpotFit {
        let peak = surroundings.peak();
        let is_others = |spot| surroundings.has_other_at(spot, self.touching_px());
        if is_others(pair.spots[0]) {
            pair.spots.swap(0, 1);
        }
        let mut second = pair.clone();
        second.spots.swap(0, 1);
        let spot = second.spots[0];
        if !is_others(spot) {
            let region = &self.regions[peak.region];
            let companion_peak = self.peak_at(spot, peak);
            let mut companion =
                detection_of(&self.maps, &self.noise, &second, &companion_peak, region);
            companion.flags.blended = true;
            companion.flags.hot_pixel = self.is_too_sharp(&companion_peak);
            self.finish(&second, &mut companion, buffers, out);
        }
        pair
    }

    /// Whether the brightest pixel at a peak is sharper than the optics. Charge that ran along a
    /// column from a saturated star is sharp in one direction.
    fn is_too_sharp(&self, peak: &Peak) -> bool {
        shape::is_too_sharp(&self.maps, &self.noise, peak, self.least_beside)
    }

    /// The peak of a spot that the filter merged into `peak`.
    fn peak_at(&self, spot: SpotEstimate, peak: &Peak) -> Peak {
        let view = &self.maps.view;
        let pixel = |at: f64, side: usize| (at.round().max(0.0) as usize).min(side - 1);
        let own = Peak {
            x: pixel(spot.x, view.width),
            y: pixel(spot.y, view.height),
            offset_px: [0.0; 2],
            ..*peak
        };
        let saturated = brightest_within(1, &own, view) >= f64::from(self.maps.saturation_adu);
        Peak { saturated, ..own }
    }

    /// Flags a trail. Its position is the centre of its region, with its length as standard error.
    fn flag_trail(&self, peak: &Peak, region: &Region, detection: &mut Detection) {
        if shape::is_trail(&self.maps, &self.shape, region, peak, self.threshold) {
            detection.flags.trail = true;
            detection.position = PixelPoint::new(region.x, region.y);
            detection.sigma_x_px = region.major_px;
            detection.sigma_y_px = region.major_px;
        }
    }

    /// Takes the grey-weighted centroid if configured, and adds the detection in coordinates of the
    /// frame.
    fn finish(
        &self,
        fit: &SpotFit,
        detection: &mut Detection,
        buffers: &mut FitBuffers,
        out: &mut Vec<Detection>,
    ) {
        let is_by_area = detection.flags.saturated && !fit.converged;
        let is_grey = self.method == CentroidMethod::GreyWeighted;
        let is_centered = self.is_misfitted() && !detection.flags.blended;
        if is_grey && !is_centered && !detection.flags.trail && !is_by_area {
            centroid::grey_weighted(&self.maps, &self.noise, fit, detection, buffers);
        }
        detection.position.x += self.maps.view.x0 as f64;
        detection.position.y += self.maps.view.y0 as f64;
        out.push(*detection);
    }
}
