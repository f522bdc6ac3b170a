//! Buffers of detection.

use super::background::FrameBackground;
use super::detection::Detections;
use super::measure::{BrightestStars, MeasureBuffers};
use super::pixels::View;
use super::psf::PIXEL_VARIANCE_PX2;
use super::search::FrameSearch;
use super::sky_area::SkyArea;
use super::trails::{Trail, TrailSearch};
use crate::base::interrupt::Interrupt;
use crate::frame::{Frame, MIN_SIDE_PX, MemoryLimit, Pixels, SaturationFinder};
use std::num::NonZeroUsize;

/// How many pixels the stages looked at, in the last detection: of a frame of a million, two million where a
/// stage went over it twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct VisitedPixels {
    /// Background and noise.
    pub background: usize,
    /// Peaks in single pixels.
    pub unfiltered: usize,
    /// The matched filter.
    pub filtered: usize,
}

/// Buffers that are reused from frame to frame. Results do not depend on their contents.
#[derive(Debug, Clone)]
pub struct Workspace {
    pub(super) saturation: SaturationFinder,
    /// Level from which on pixels of the frame searched last are saturated.
    pub(super) saturation_adu: f32,
    pub(crate) background: FrameBackground,
    pub(crate) search: FrameSearch,
    pub(crate) measure: MeasureBuffers,
    pub(super) brightest: BrightestStars,
    pub(super) interrupt: Interrupt,
    pub(super) memory: MemoryLimit,
    threads: NonZeroUsize,
}

impl Workspace {
    /// Empty buffers, for one thread.
    pub fn new() -> Self {
        let empty = Self {
            saturation: SaturationFinder::default(),
            saturation_adu: f32::INFINITY,
            background: FrameBackground::default(),
            search: FrameSearch::default(),
            measure: MeasureBuffers::default(),
            brightest: BrightestStars::default(),
            interrupt: Interrupt::default(),
            memory: MemoryLimit::default(),
            threads: NonZeroUsize::MIN,
        };
        empty.on_threads(NonZeroUsize::MIN)
    }

    /// Shares the passes over the pixels among `threads` threads of the rayon pool in which
    /// [`detect`](super::detect) is called. Results are the same for any number. One is best where
    /// other frames keep the other threads busy.
    #[must_use]
    pub fn on_threads(mut self, threads: NonZeroUsize) -> Self {
        self.threads = threads;
        let threads = threads.get();
        self.background.set_threads(threads);
        self.search.set_threads(threads);
        self.measure.set_threads(threads);
        self
    }

    /// Empty buffers with the same settings.
    pub(crate) fn emptied(&self) -> Self {
        let empty = Self::new().on_threads(self.threads);
        empty
            .with_memory_limit(self.memory)
            .with_interrupt(self.interrupt.clone())
    }

    /// Detection ends with [`DetectError::Interrupted`](super::DetectError::Interrupted) when
    /// `interrupt` is due.
    #[must_use]
    pub fn with_interrupt(self, interrupt: Interrupt) -> Self {
        Self { interrupt, ..self }
    }

    /// A frame and its detection take no more memory than `memory`; without this,
    /// [`MemoryLimit::DEFAULT`].
    #[must_use]
    pub fn with_memory_limit(self, memory: MemoryLimit) -> Self {
        Self { memory, ..self }
    }

    /// [`with_memory_limit`](Self::with_memory_limit), from the next frame on.
    pub(crate) fn set_memory(&mut self, memory: MemoryLimit) {
        self.memory = memory;
    }

    /// The pixels that the stages of the last detection looked at.
    pub fn visited_pixels(&self) -> VisitedPixels {
        VisitedPixels {
            background: self.background.visited_px,
            unfiltered: self.search.raw_peaks.visited_px,
            filtered: self.search.filtered.visited_px,
        }
    }

    /// Counts visited pixels anew.
    pub(super) fn forget_visited_pixels(&mut self) {
        self.background.visited_px = 0;
        self.search.raw_peaks.visited_px = 0;
        self.search.filtered.visited_px = 0;
    }

    /// The part of the frame that shows the sky; `frame` is the one that was searched last.
    pub(crate) fn sky_area(&self, frame: &Frame, found: &Detections) -> Option<SkyArea> {
        /// What hides the sky bends the background by this share of its height at least.
        const MIN_BEND: f32 = 0.1;
        let has_gaps =
            || matches!(&frame.pixels, Pixels::F32(values) if values.iter().any(|v| v.is_nan()));
        if !self.background.mesh.has_edges(MIN_BEND) && !has_gaps() {
            return None;
        }
        let stars = found.sources.iter();
        let stars = stars.filter(|source| source.flags.is_star_like());
        SkyArea::of_picture(frame, stars.map(|star| star.position), self.saturation_adu)
    }

    /// Lines of light that are no stars: satellites, aeroplanes and meteors, the most significant first.
    /// `frame` is the one that was searched last, and `found` what was found in it. A frame whose
    /// stars are trails is not searched.
    pub fn find_trails(&self, frame: &Frame, found: &Detections) -> Vec<Trail> {
        let view = View::of_live_pixels(frame).until(&self.interrupt);
        let is_empty = view.width < MIN_SIDE_PX || view.height < MIN_SIDE_PX;
        if is_empty || found.trails.is_some() {
            return Vec::new();
        }
        let widest_px = found
            .psf
            .map_or(found.spot_sigma_px, |psf| psf.sigma_range_px[1]);
        let search = TrailSearch {
            view: &view,
            mesh: &self.background.mesh,
            found,
            spot_px: (widest_px.powi(2) + PIXEL_VARIANCE_PX2).sqrt(),
        };
        search.run()
    }

    /// Whether the work is to end now.
    pub(crate) fn is_interrupted(&self) -> bool {
        self.interrupt.is_due()
    }

    /// Whether so many bytes fit its memory beside `frame`.
    pub(crate) fn has_room(&self, frame: &Frame<'_>, bytes: u64) -> bool {
        frame.pixels.bytes() + bytes <= self.memory.bytes()
    }

    /// [`with_interrupt`](Self::with_interrupt), from the next frame on.
    pub(crate) fn set_interrupt(&mut self, interrupt: Interrupt) {
        self.interrupt = interrupt;
    }
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}
