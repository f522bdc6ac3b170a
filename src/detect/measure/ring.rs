//! The pixels in a ring around a source. Around a star they are dark; at an edge of a roof, a leaf
//! or the Earth's limb, and on a lit window, a part of them is as bright as the source.

use crate::detect::candidates::Peak;
use crate::detect::fit::FrameMaps;

/// Directions of the pixels of the ring in one quadrant, as cosine and sine: each 22.5 degrees.
const QUADRANT: [[f64; 2]; 4] = [
    [1.0, 0.0],
    [0.923_879_532_511_286_7, 0.382_683_432_365_089_8],
    [
        std::f64::consts::FRAC_1_SQRT_2,
        std::f64::consts::FRAC_1_SQRT_2,
    ],
    [0.382_683_432_365_089_8, 0.923_879_532_511_286_7],
];
/// Radius of the ring, in standard deviations of the spot: a star has 0.2 % of its peak there.
const RADIUS_SIGMAS: f64 = 3.5;
/// Smallest radius, in pixels.
const MIN_RADIUS_PX: f64 = 3.0;
/// Part of the height of the source from which on a pixel is as bright.
const BRIGHT: f32 = 0.7;
/// Pixels below this height are noise, in standard deviations.
const NOISE_SIGMAS: f32 = 2.5;
/// At an edge at least this many of the 16 pixels of the ring are as bright: a corner of a right
/// angle has 4, a line and two neighbours of the same brightness at most 3.
const BRIGHT_PIXELS: usize = 5;

/// Whether a large part of the ring is as bright as the source.
pub(super) fn is_bright(maps: &FrameMaps<'_>, peak: &Peak) -> bool {
    let view = &maps.view;
    let (background, sigma) = maps.background.at(peak.x as f32, peak.y as f32);
    let height = view.at(peak.x, peak.y) - background;
    let bright = background + (BRIGHT * height).max(NOISE_SIGMAS * sigma);
    let radius_px = (RADIUS_SIGMAS * maps.width_px()).max(MIN_RADIUS_PX);
    let (x, y) = (peak.x as f64, peak.y as f64);
    let is_bright = |[along, up]: &[f64; 2]| {
        let (x, y) = (
            (x + radius_px * along).round(),
            (y + radius_px * up).round(),
        );
        let is_inside = x >= 0.0 && y >= 0.0 && x < view.width as f64 && y < view.height as f64;
        is_inside && view.at(x as usize, y as usize) >= bright
    };
    let quadrants = |&[c, s]: &[f64; 2]| [[c, s], [-s, c], [-c, -s], [s, -c]];
    let directions = QUADRANT.iter().flat_map(quadrants);
    directions.filter(is_bright).count() >= BRIGHT_PIXELS
}
