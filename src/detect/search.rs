//! The search for sources: filter and threshold that fit the frame's own stars, then the peaks.
//!
//! The filter needs the spot size, and the spot size is measured on stars. Sharp stars stand out in
//! the unfiltered frame; where there are too few of these, the frame is filtered with a guessed
//! size, and again until the size of the stars found settles.

use super::background::{FrameBackground, Mesh, median};
use super::candidates::{
    CandidateLimits, CandidateMemory, FilteredFrame, PeakSearch, RawPeakFinder, SearchConfig,
};
use super::config::DetectConfig;
use super::detection::NoiseTail;
use super::error::DetectError;
use super::filter::Kernel;
use super::fit::{FitBuffers, FrameMaps};
use super::pixels::View;
use super::psf::PIXEL_VARIANCE_PX2;
use super::star_model::{
    DEFAULT_SPOT_PX, SpotSize, StarModel, fit_bright_stars, spot_size, star_model,
};
use super::threshold::{
    Extrema, FilterWeights, FrameNoise, NoiseBuffers, gaussian_threshold, raise_filtered_noise,
};
use crate::base::interrupt::Interrupted;

/// A guessed spot size must be right within this factor; else the frame is filtered again.
const SPOT_GUESS_TOLERANCE: f64 = 1.15;
/// Most times that the frame is filtered.
const MAX_FILTER_ROUNDS: usize = 3;
/// This many stars of one size, found without a filter, settle the spot size; fewer may be chance.
const MIN_RAW_STARS: usize = 8;
/// Smaller spots put so much light in one pixel that the brightest pixels are the brightest stars;
/// wider ones are measured on the filtered frame.
const SHARP_SPOT_PX: f64 = 0.75;

/// Correlated noise raises the threshold at most by this factor: what stands out more is no noise.
const MAX_RAISE: f64 = 2.0;
/// The same for coarse noise, whose standard deviation may be far from that of its tail.
const MAX_RAISE_OF_COARSE: f64 = 20.0;

/// A frame to be searched.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SearchInput<'a> {
    /// The frame.
    pub view: &'a View<'a>,
    /// Its background and noise.
    pub background: &'a FrameBackground,
    /// Level from which on a pixel is saturated, in ADU.
    pub saturation_adu: f32,
    /// Side of the cells in which background and noise are measured, in pixels.
    pub cell_px: usize,
    /// The options.
    pub config: &'a DetectConfig,
    /// For what stands out in it.
    pub memory: CandidateMemory,
}

impl<'a> SearchInput<'a> {
    /// The frame with its maps, for the fits.
    pub fn maps(
        &self,
        filtered: Option<&'a Mesh>,
        spot_px: f64,
        matched_gain: f64,
    ) -> FrameMaps<'a> {
        FrameMaps {
            view: *self.view,
            background: &self.background.mesh,
            filtered,
            saturation_adu: self.saturation_adu,
            spot_px,
            matched_gain,
            psf: None,
        }
    }

    /// The frame with its maps after the search.
    pub fn searched_maps(&self, filtered: &'a FilteredFrame, searched: &Searched) -> FrameMaps<'a> {
        let Searched { stars, pass } = searched;
        self.maps(Some(&filtered.mesh), stars.spot_px, pass.matched_gain)
    }

    /// The size that the options state, else that of the stars.
    fn with_stated_size(&self, model: StarModel) -> StarModel {
        StarModel {
            spot_px: self.config.spot_sigma_px.unwrap_or(model.spot_px),
            ..model
        }
    }
}

/// How a frame was searched; its peaks and regions are in [`FrameSearch`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Searched {
    /// Spot size and noise model of the frame's stars.
    pub stars: StarModel,
    /// Filter and threshold of the last pass.
    pub pass: FilterPass,
}

/// A pass of the filter over the frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FilterPass {
    /// Spot size that it is for, in pixels.
    pub spot_px: f64,
    /// Signal-to-noise ratio of a star whose flux equals the noise of a pixel: √ΣP².
    pub matched_gain: f64,
    /// The threshold, in standard deviations of the filtered noise.
    pub threshold: f64,
    /// The median of it over the frame, in standard deviations of filtered white noise: the light of faint
    /// stars raises the noise of the filtered frame. It is above the frame's local mean, and so are stars.
    pub threshold_level: f64,
    /// Why the threshold holds less well than in independent noise.
    pub noise_tail: Option<NoiseTail>,
}

impl FilterPass {
    /// Flux at which half of the stars are detected where pixels have the noise `noise_adu`, and the threshold is
    /// that level, in ADU.
    pub fn limit_adu(&self, noise_adu: f64) -> f64 {
        self.threshold_level * noise_adu / self.matched_gain
    }
}

/// What bright stars say about a frame.
enum StarEstimate {
    /// Size and noise model are final.
    Settled(StarModel),
    /// A better guess of the spot size, in pixels.
    Guess(f64),
}

/// Whether a guessed spot size is near enough to another one.
fn is_guess_of(guess_px: f64, spot_px: f64) -> bool {
    (spot_px / guess_px).max(guess_px / spot_px) < SPOT_GUESS_TOLERANCE
}

/// Searches frames; holds the peaks found last, and the buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct FrameSearch {
    /// The filtered frame.
    pub filtered: FilteredFrame,
    /// Peaks and regions above the threshold.
    pub found: PeakSearch,
    /// Peaks of the frame without a filter.
    pub raw_peaks: RawPeakFinder,
    /// A buffer.
    pub sorted: Vec<f32>,
    noise: NoiseBuffers,
    extrema: Extrema,
    /// Buffers of fits.
    pub fits: FitBuffers,
}

impl FrameSearch {
    /// Shares the passes over the pixels among `threads` threads.
    pub fn set_threads(&mut self, threads: usize) {
        self.filtered.set_threads(threads);
        self.raw_peaks.set_threads(threads);
    }

    /// Frees the buffers that a crowded frame has filled: to read the next takes memory, too.
    pub fn free_large_buffers(&mut self) {
        /// Candidates whose buffers are kept, 26 MB.
        const MAX_KEPT: usize = 1 << 19;
        if self.filtered.candidate_count() > MAX_KEPT {
            self.filtered.candidates = Vec::new();
            self.found = PeakSearch::default();
        }
    }

    /// Searches the frame with a filter of the size that its own stars have. A first guess that is far from
    /// `near_px`, if given, is not tried.
    ///
    /// # Errors
    /// [`DetectError::Interrupted`], [`DetectError::TooCrowded`].
    pub fn run(
        &mut self,
        input: &SearchInput<'_>,
        near_px: Option<f64>,
    ) -> Result<Searched, DetectError> {
        let mut spot_px = match self.measure_unfiltered(input)? {
            StarEstimate::Settled(stars) => {
                let pass = self.find_peaks(input, stars.spot_px)?;
                return Ok(Searched { stars, pass });
            }
            StarEstimate::Guess(spot_px) => near_px
                .filter(|near_px| !is_guess_of(spot_px, *near_px))
                .unwrap_or(spot_px),
        };
        let mut rounds_left = MAX_FILTER_ROUNDS;
        loop {
            let pass = self.find_peaks(input, spot_px)?;
            rounds_left -= 1;
            match self.measure_filtered(input, spot_px, &pass, rounds_left == 0) {
                StarEstimate::Settled(stars) => return Ok(Searched { stars, pass }),
                StarEstimate::Guess(better_px) => spot_px = better_px,
            }
        }
    }

    /// Measures the stars that stand out without a filter.
    fn measure_unfiltered(&mut self, input: &SearchInput<'_>) -> Result<StarEstimate, Interrupted> {
        let SearchInput { view, config, .. } = *input;
        let Self {
            raw_peaks, fits, ..
        } = self;
        raw_peaks.find(view, &input.background.mesh, input.saturation_adu)?;
        let start_px = config.spot_sigma_px.unwrap_or(DEFAULT_SPOT_PX);
        let matched_gain = Kernel::for_spot(start_px).matched_gain();
        let mut maps = input.maps(None, start_px, matched_gain);
        let stars = fit_bright_stars(&maps, &raw_peaks.peaks, fits);
        let measured = spot_size(&stars);
        if let (None, Some(size)) = (config.spot_sigma_px, measured) {
            maps.spot_px = size.spot_px;
        }
        let is_enough =
            |size: SpotSize| size.stars >= MIN_RAW_STARS && size.spot_px < SHARP_SPOT_PX;
        Ok(if measured.is_some_and(is_enough) {
            let model = star_model(&maps, stars, fits);
            StarEstimate::Settled(input.with_stated_size(model))
        } else {
            StarEstimate::Guess(maps.spot_px)
        })
    }

    /// Measures the stars among the peaks of a pass with a filter for `spot_px`; the last pass
    /// settles.
    fn measure_filtered(
        &mut self,
        input: &SearchInput<'_>,
        spot_px: f64,
        pass: &FilterPass,
        is_last: bool,
    ) -> StarEstimate {
        let Self {
            filtered,
            found,
            fits,
            ..
        } = self;
        let mut maps = input.maps(Some(&filtered.mesh), spot_px, pass.matched_gain);
        let stars = fit_bright_stars(&maps, &found.peaks, fits);
        let measured = match input.config.spot_sigma_px {
            None => spot_size(&stars).map(|size| size.spot_px),
            Some(_) => None,
        };
        let measured_px = measured.unwrap_or(spot_px);
        if is_guess_of(spot_px, measured_px) || is_last {
            maps.spot_px = measured_px;
            let model = star_model(&maps, stars, fits);
            StarEstimate::Settled(input.with_stated_size(model))
        } else {
            StarEstimate::Guess(measured_px)
        }
    }

    /// Filters the frame for spots of `spot_px`, sets the threshold, and finds regions and peaks.
    fn find_peaks(
        &mut self,
        input: &SearchInput<'_>,
        spot_px: f64,
    ) -> Result<FilterPass, DetectError> {
        let SearchInput {
            view,
            background,
            cell_px,
            saturation_adu,
            config,
            memory,
        } = *input;
        let Self {
            filtered,
            found,
            sorted,
            noise,
            extrema,
            ..
        } = self;
        let kernel = Kernel::for_spot(spot_px);
        let size = view.size();
        let mesh = &background.mesh;
        let gaussian = config
            .threshold_sigma
            .unwrap_or_else(|| gaussian_threshold(config, size, cell_px, spot_px, &kernel));
        let above = |threshold| CandidateLimits {
            threshold,
            most: memory.most_candidates(),
        };
        filtered.filter(view, mesh, &kernel, cell_px, &above(gaussian))?;
        let filter = FilterWeights::for_spot(spot_px, kernel.radius(), size);
        raise_filtered_noise(&background.cut_off, &mut filtered.mesh, gaussian, &filter);
        let measured = || -> Result<_, DetectError> {
            let frame_noise = FrameNoise {
                view,
                background,
                filtered_mesh: &filtered.mesh,
                filtered_maxima: &filtered.maxima,
            };
            let threshold = frame_noise.raised_threshold(gaussian, spot_px, &filter, noise);
            let noise_tail = frame_noise.tail(noise);
            let most = match noise_tail {
                // The negative of noise that is cut off has no tail.
                None | Some(NoiseTail::CutOff) => return Ok((threshold, noise_tail)),
                Some(NoiseTail::Correlated) => MAX_RAISE * threshold,
                Some(NoiseTail::Coarse) => MAX_RAISE_OF_COARSE * threshold,
            };
            extrema.prepare(size, mesh);
            filtered.for_sampled_rows(view, mesh, &kernel, |rows, y, filtered_mesh| {
                extrema.add_row(rows, y, filtered_mesh);
            })?;
            let raised = extrema.raised(threshold, config.false_alarms_per_mpx, most);
            Ok((raised, noise_tail.filter(|_| raised > threshold)))
        };
        let stated = config.threshold_sigma.map(|stated| Ok((stated, None)));
        let (threshold, noise_tail) = stated.unwrap_or_else(measured)?;
        filtered.gather_missed(view, mesh, &kernel, &above(threshold))?;
        let spot_width_px = (spot_px.powi(2) + PIXEL_VARIANCE_PX2).sqrt();
        let search_config = SearchConfig {
            threshold: threshold as f32,
            spot_width_px: spot_width_px as f32,
            saturation_adu,
            max_peaks: config.max_detections,
            max_pixels: memory.most_bright_pixels(filtered.candidate_count()),
        };
        view.check()?;
        found.run(&filtered.candidates, &filtered.mesh, view, &search_config)?;
        let sigma = median(&filtered.mesh.sigma, sorted);
        Ok(FilterPass {
            spot_px,
            matched_gain: kernel.matched_gain(),
            threshold,
            threshold_level: threshold * sigma,
            noise_tail,
        })
    }
}
