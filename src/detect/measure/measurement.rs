//! From peaks to detections: groups of touching spots, close pairs, centroids, flags.

use super::estimate::{brightest_within, detection_of};
use super::known_spots::{KnownSpots, PeakSurroundings};
use super::pairs::{PairFitter, may_be_pair};
use super::{centroid, shape};
use crate::base::coords::PixelPoint;
use crate::detect::candidates::{Peak, Region};
use crate::detect::config::CentroidMethod;
use crate::detect::detection::Detection;
use crate::detect::fit::{
    BatchStart, Fit, FitBuffers, FitConfig, FrameMaps, NoiseModel, SpotEstimate, SpotGroup,
    window_radius,
};
use crate::detect::threads::for_each_worker;
use std::mem;

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
    /// How positions are measured.
    pub method: CentroidMethod,
    /// The regions that hold the peaks.
    pub regions: &'a [Region],
    /// Threshold of the search, in units of the local noise.
    pub threshold: f64,
}

impl Measurement<'_> {
    /// Measures all peaks, which come strongest first.
    pub fn run(
        &self,
        peaks: &[Peak],
        buffers: &mut MeasureBuffers,
        detections: &mut Vec<Detection>,
    ) {
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
        for worker in workers.iter_mut() {
            detections.append(&mut worker.detections);
        }
        let Some(MeasureWorker { fits, .. }) = workers.first_mut() else {
            return;
        };
        for i in 0..known.crowded.len() {
            let index = known.crowded[i] as usize;
            let surroundings = known.around(index, peaks, self.touching_px());
            if let Some(spot) = self.measure(&surroundings, None, fits, detections) {
                known.set(index, spot);
            }
        }
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
        let saturated = indices.clone().filter(|&i| peaks[i].saturated);
        let unsaturated = indices.filter(|&i| !peaks[i].saturated);
        for index in saturated {
            self.measure(&surroundings(index), None, fits, detections);
        }
        let mut batch = mem::take(&mut fits.batch);
        let starts = unsaturated.map(|index| BatchStart {
            number: index,
            spot: spots[index],
            spot_px: self.maps.spot_px,
        });
        let config = self.fit_config();
        batch.fit(&self.maps, starts, &config, |index, fit, window| {
            fits.window.copy_from(window);
            self.measure(&surroundings(index), fit, fits, detections);
        });
        fits.batch = batch;
    }

    /// Distance within which a spot matters to another, in pixels.
    fn reach_px(&self) -> f64 {
        /// Spots closer than this many standard deviations beyond the window have light in it.
        const MARGIN_SIGMA: f64 = 3.0;
        window_radius(self.maps.spot_px) as f64 * 1.5 + MARGIN_SIGMA * self.maps.width_px()
    }

    /// Distance within which spots touch, in pixels.
    fn touching_px(&self) -> f64 {
        TOUCHING_SIGMA * self.maps.width_px()
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
        fitted: Option<Fit>,
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
        let pair = if is_single && may_be_pair(&fit, peak, region, self.maps.spot_px) {
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
        if let Some(pair) = pair {
            fit = self.add_companion(pair, surroundings, buffers, out);
        }
        let mut detection = detection_of(&self.maps, &self.noise, &fit, peak, region);
        if is_star {
            shape::flag_size(&self.maps, peak, &fit, &mut detection, buffers);
        }
        detection.flags.blended = fit.spots.len() > 1;
        self.flag_trail(peak, region, &mut detection);
        self.finish(&fit, &mut detection, buffers, out);
        fit.converged.then(|| fit.spots[0])
    }

    /// Fits the spots at a peak: a single saturated one with a size of its own.
    fn fit_spots(
        &self,
        start: &SpotGroup,
        peak: &Peak,
        beyond: &[SpotEstimate],
        buffers: &mut FitBuffers,
    ) -> Fit {
        let mut fit = if peak.saturated && start.len() == 1 {
            let size = (1.5 * self.maps.spot_px, self.noise);
            buffers.fit_free_size(&self.maps, start[0], beyond, size)
        } else {
            buffers.fit_fixed_size(&self.maps, start, beyond, self.noise)
        };
        let FitBuffers { fitter, window, .. } = buffers;
        if fit.spots[0].has_position(fit.spot_px) {
            fitter.set_flux_noise(window, &mut fit, &self.fit_config());
        }
        fit
    }

    /// Adds the companion of a pair, unless that is another peak, which is measured by itself.
    /// Returns the pair with the spot of this peak first.
    fn add_companion(
        &self,
        mut pair: Fit,
        surroundings: &PeakSurroundings<'_>,
        buffers: &mut FitBuffers,
        out: &mut Vec<Detection>,
    ) -> Fit {
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
            self.finish(&second, &mut companion, buffers, out);
        }
        pair
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
        if shape::is_trail(region, peak, self.maps.width_px(), self.threshold) {
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
        fit: &Fit,
        detection: &mut Detection,
        buffers: &mut FitBuffers,
        out: &mut Vec<Detection>,
    ) {
        let is_by_area = detection.flags.saturated && !fit.converged;
        let is_grey = self.method == CentroidMethod::GreyWeighted;
        if is_grey && !detection.flags.trail && !is_by_area {
            centroid::grey_weighted(&self.maps, &self.noise, fit, detection, buffers);
        }
        detection.position.x += self.maps.view.x0 as f64;
        detection.position.y += self.maps.view.y0 as f64;
        out.push(*detection);
    }
}
