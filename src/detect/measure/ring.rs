//! The pixels in a ring around a source. Around a star they are dark; at an edge of a roof, a leaf
//! or the Earth's limb, and on a lit window, a part of them is as bright as the source.

use crate::detect::candidates::Peak;
use crate::detect::fit::FrameMaps;

/// Pixels of the ring.
const PIXELS: usize = 16;
/// Radius of the ring, in standard deviations of the spot: a star has 0.2 % of its peak there.
const RADIUS_SIGMAS: f64 = 3.5;
/// Smallest radius, in pixels.
const MIN_RADIUS_PX: f64 = 3.0;
/// Part of the height of the source from which on a pixel is as bright.
const BRIGHT: f32 = 0.7;
/// Pixels below this height are noise, in standard deviations.
const NOISE_SIGMAS: f32 = 2.5;
/// Pixels of the ring that are as bright at an edge: a corner of a right angle has 4, a line and two
/// neighbours of the same brightness at most 3.
const BRIGHT_PIXELS: usize = 5;

/// Whether a large part of the ring is as bright as the source.
pub(super) fn is_bright(maps: &FrameMaps<'_>, peak: &Peak) -> bool {
    let view = &maps.view;
    let (background, sigma) = maps.background.at(peak.x as f32, peak.y as f32);
    let height = view.at(peak.x, peak.y) - background;
    let bright = background + (BRIGHT * height).max(NOISE_SIGMAS * sigma);
    let radius_px = (RADIUS_SIGMAS * maps.width_px()).max(MIN_RADIUS_PX);
    let is_bright = |index: &usize| {
        let angle = std::f64::consts::TAU * *index as f64 / PIXELS as f64;
        let (sin, cos) = libm::sincos(angle);
        let x = (peak.x as f64 + radius_px * cos).round();
        let y = (peak.y as f64 + radius_px * sin).round();
        let is_inside = x >= 0.0 && y >= 0.0 && x < view.width as f64 && y < view.height as f64;
        is_inside && view.at(x as usize, y as usize) >= bright
    };
    (0..PIXELS).filter(is_bright).count() >= BRIGHT_PIXELS
}
