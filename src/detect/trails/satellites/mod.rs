//! Satellites, aeroplanes and meteors: lines in a frame whose stars are known.
//!
//! `Frame`, its background and its `Detections` → [`Trail`]s, the most significant first.
//!
//! 1. `cells`: what is left of the frame after background, stars and what hides the sky, in cells of
//!    about a star's spot, over its noise.
//! 2. `radon`: the sums of the cells along all straight lines (a fast Radon transform), in pieces of 16
//!    cells and more. The number of sums is known, and so is the chance that the largest of noise is as
//!    large.
//! 3. `band`: the pixels along a line: a Gaussian ridge is fitted to them, and the ends are where the
//!    ridge has half of its height.
//! 4. What is no trail is left out: what is narrower than a star or broader than three, along a row or a
//!    column, dark on one side only, and the spikes of saturated stars.
//!
//! The Hough transform counts the pixels above a threshold along lines of whole degrees; sums of the
//! pixels themselves show fainter lines, and cost no more.
//!
//! Caveats: trails along a row or a column to within a pixel are taken for noise of the detector; curved
//! trails are found in pieces, or not at all. A trail through the centre of a saturated star that is near
//! the trail's middle or one of its ends is taken for a spike. Trails shorter than 16 cells are detections
//! with the flag `trail` only. Of two that are closer than some 10 cells side by side, one may be lost.
//! Frames whose stars are trails are not searched.
//!
//! # Reference
//! Nir, Zackay & Ofek 2018, AJ 156, 229, section 2 (streaks by the fast Radon transform); Götz &
//! Druckmüller 1996, Pattern Recognition 29, 711 (the transform).

mod band;
mod cells;
mod input;
mod radon;

pub(in crate::detect) use input::TrailSearch;

use crate::base::coords::PixelPoint;
use crate::detect::pixels::View;
use band::{Ridge, TrailBand};
use cells::CellMap;
use std::ops::RangeInclusive;

/// Accepted number of false trails in a frame of noise: one in 1000 frames.
const FALSE_TRAILS_PER_FRAME: f64 = 1e-3;

/// Lowest mean height of a third of a line over that of all of it, where it does not fade from one place
/// to its end, as spikes do: these have 0.87 or less.
const EVEN: f64 = 0.9;
/// Most rounds of search: each finds what brighter trails have hidden.
const MAX_ROUNDS: usize = 4;
/// Most lines that are followed pixel by pixel: the time for a frame is bounded.
const MAX_FOLLOWED: usize = 32;

/// A line of light: a satellite, an aeroplane, a meteor.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Trail {
    /// The end with the smaller x.
    pub begin: PixelPoint,
    /// The other end.
    pub end: PixelPoint,
    /// Standard deviation across, of a Gaussian, in pixels.
    pub width_sigma_px: f64,
    /// Standard error of the line's place across it, in pixels.
    pub across_sigma_px: f64,
    /// Mean flux for each pixel of length, above the background, in ADU.
    pub flux_per_px_adu: f64,
    /// The same over its standard error.
    pub snr: f64,
    /// Decimal logarithm of the expected number of such lines in a frame of noise.
    pub log10_false_alarm: f64,
}

impl Trail {
    /// Distance of the ends, in pixels.
    pub fn length_px(&self) -> f64 {
        self.begin.distance_to(&self.end)
    }

    /// Flux of all of it, in ADU.
    pub fn flux_adu(&self) -> f64 {
        self.flux_per_px_adu * self.length_px()
    }
}

impl TrailSearch<'_> {
    /// The trails, most significant first.
    pub fn run(&self) -> Vec<Trail> {
        let mut cells = CellMap::build(self);
        let mut trails: Vec<Trail> = Vec::new();
        let mut followed = 0;
        for _ in 0..MAX_ROUNDS {
            let before = trails.len();
            for line in cells.significant_lines(FALSE_TRAILS_PER_FRAME) {
                if followed == MAX_FOLLOWED || self.view.is_interrupted() {
                    break;
                }
                // A brighter one may have been all of it.
                if !cells.is_significant(&line, FALSE_TRAILS_PER_FRAME) {
                    continue;
                }
                followed += 1;
                let ridge = TrailBand::new(self, &cells, line.in_pixels(cells.side_px)).ridge();
                let is_new = |ridge: &Ridge| !trails.iter().any(|trail| self.is_part(ridge, trail));
                let ridge = ridge.filter(is_new);
                let trail = ridge.and_then(|ridge| self.trail(&cells, &ridge));
                match trail {
                    Some(trail) => {
                        let reach_px = 3.0 * trail.width_sigma_px + cells.side_px as f64;
                        cells.clear(trail_in_view(&trail, self.view), reach_px);
                        trails.push(trail);
                    }
                    None => cells.clear(line.in_pixels(cells.side_px), 2.0 * cells.side_px as f64),
                }
            }
            if trails.len() == before {
                break;
            }
        }
        trails.sort_by(|a, b| a.log10_false_alarm.total_cmp(&b.log10_false_alarm));
        trails
    }

    /// The ridge as a trail, if it is one.
    fn trail(&self, cells: &CellMap, ridge: &Ridge) -> Option<Trail> {
        /// Least and greatest width, in that of a star: what is in the detector is narrower, and clouds and
        /// branches are broader.
        const WIDTHS: RangeInclusive<f64> = 0.7..=3.0;
        /// The faintest lines that the cells show have 10; edges of what hides the sky less.
        const MIN_SNR: f64 = 7.0;
        /// Least difference of the ends in columns and in rows: the noise of the detector is along them.
        const MIN_SLANT_PX: f64 = 1.0;
        /// Least length, in standard deviations across.
        const MIN_LENGTH: f64 = 20.0;
        /// Least part of the height that a third of the length has, and that the line has above its
        /// brighter side.
        const MIN_EVENNESS: f64 = 0.25;
        /// With this height over its error a line is no noise, of whatever kind.
        const BRIGHT_SNR: f64 = 50.0;
        const MIN_CONTRAST: f64 = 0.5;
        let by_cells = cells.log10_false_alarm(ridge.ends_px);
        // Where a trail is saturated its cells are those of stars, which do not count.
        let is_bright = ridge.snr >= BRIGHT_SNR && ridge.evenness >= EVEN;
        let log10_false_alarm = match is_bright {
            true => by_cells.min(cells.log10_lines_of_noise(ridge.snr)),
            false => by_cells,
        };
        let [one, other] = ridge.ends_px;
        let length_px = one.distance_to(&other);
        let slant_px = (one.x - other.x).abs().min((one.y - other.y).abs());
        let is_trail = log10_false_alarm <= libm::log10(FALSE_TRAILS_PER_FRAME)
            && WIDTHS.contains(&(ridge.width_sigma_px / self.spot_px))
            && ridge.snr >= MIN_SNR
            && slant_px >= MIN_SLANT_PX
            && length_px >= MIN_LENGTH * ridge.width_sigma_px
            && length_px >= (radon::MIN_CELLS / 2 * cells.side_px) as f64
            && ridge.evenness >= MIN_EVENNESS
            && ridge.contrast >= MIN_CONTRAST
            && !self.is_spike(ridge);
        // As of the stars.
        let wings = self.found.wings.map_or(0.0, |wings| wings.share);
        let [mut begin, mut end] = ridge.ends_px.map(|point| {
            PixelPoint::new(point.x + self.view.x0 as f64, point.y + self.view.y0 as f64)
        });
        if (end.x, end.y) < (begin.x, begin.y) {
            std::mem::swap(&mut begin, &mut end);
        }
        let area = self.found.sky_area.as_ref();
        let is_edge = area.is_some_and(|area| area.ends_along([begin, end]));
        (is_trail && !is_edge).then_some(Trail {
            begin,
            end,
            width_sigma_px: ridge.width_sigma_px,
            across_sigma_px: ridge.across_sigma_px,
            flux_per_px_adu: ridge.flux_per_px_adu * (1.0 + wings),
            snr: ridge.snr,
            log10_false_alarm,
        })
    }

    /// Whether the ridge is along a trail that was found.
    fn is_part(&self, ridge: &Ridge, trail: &Trail) -> bool {
        let [begin, end] = trail_in_view(trail, self.view);
        let length_px = begin.distance_to(&end);
        let reach_px = 3.0 * (ridge.width_sigma_px + trail.width_sigma_px);
        ridge.ends_px.iter().all(|point| {
            let (x, y) = (point.x - begin.x, point.y - begin.y);
            ((x * (end.y - begin.y) - y * (end.x - begin.x)) / length_px).abs() < reach_px
        })
    }

    /// Whether the ridge is a spike of a saturated star: it fades, and the star is at its middle or at one of
    /// its ends.
    fn is_spike(&self, ridge: &Ridge) -> bool {
        /// How near, in lengths of the ridge.
        const NEAR: f64 = 0.2;
        /// Least height of the star over that of its spike. A saturated trail is as high as the star.
        const FADED: f64 = 3.0;
        if ridge.evenness >= EVEN {
            return false;
        }
        let [begin, end] = ridge.ends_px;
        let length_px = begin.distance_to(&end);
        let (tx, ty) = ((end.x - begin.x) / length_px, (end.y - begin.y) / length_px);
        let reach_px = 3.0 * (ridge.width_sigma_px + self.spot_px);
        let stars = self.found.sources.iter().filter(|source| {
            source.flags.saturated
                && source.flags.is_star_like()
                && source.peak_adu > FADED * ridge.height_adu
        });
        stars.map(|star| star.position).any(|star| {
            let (x, y) = (
                star.x - self.view.x0 as f64 - begin.x,
                star.y - self.view.y0 as f64 - begin.y,
            );
            let along = (x * tx + y * ty) / length_px;
            let is_on_line = (y * tx - x * ty).abs() < reach_px;
            is_on_line
                && [0.0, 0.5, 1.0]
                    .iter()
                    .any(|place| (along - place).abs() < NEAR)
        })
    }
}

/// The ends of a trail in the coordinates of the view.
fn trail_in_view(trail: &Trail, view: &View<'_>) -> [PixelPoint; 2] {
    let (x0, y0) = (view.x0 as f64, view.y0 as f64);
    [trail.begin, trail.end].map(|end| PixelPoint::new(end.x - x0, end.y - y0))
}

#[cfg(test)]
mod tests;
