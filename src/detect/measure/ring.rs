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
/// angle has 4, a line and two neighbors of the same brightness at most 3.
const BRIGHT_PIXELS: usize = 5;

/// The pixels of the ring, as columns and rows from the source.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ring {
    offsets: [[isize; 2]; 16],
}

impl Ring {
    /// The ring around a spot with this standard deviation, pixel included, in pixels.
    pub fn around(width_px: f64) -> Self {
        let radius_px = (RADIUS_SIGMAS * width_px).max(MIN_RADIUS_PX);
        let nearest = |direction: f64| (radius_px * direction + 0.5).floor() as isize;
        let quadrant = |[c, s]: [f64; 2]| [[c, s], [-s, c], [-c, -s], [s, -c]];
        let quadrants = QUADRANT.map(quadrant);
        Self {
            offsets: std::array::from_fn(|i| quadrants[i / 4][i % 4].map(nearest)),
        }
    }

    /// Whether a large part of the ring around `peak` is as bright as the peak.
    pub fn is_bright(&self, maps: &FrameMaps<'_>, peak: &Peak) -> bool {
        let view = &maps.view;
        let (background, sigma) = maps.background.at(peak.x as f32, peak.y as f32);
        let height = view.at(peak.x, peak.y) - background;
        let bright = background + (BRIGHT * height).max(NOISE_SIGMAS * sigma);
        let is_bright = |&&[across, down]: &&[isize; 2]| {
            let x = peak.x.checked_add_signed(across);
            let y = peak.y.checked_add_signed(down);
            let inside = x.zip(y).filter(|&(x, y)| x < view.width && y < view.height);
            inside.is_some_and(|(x, y)| view.at(x, y) >= bright)
        };
        self.offsets.iter().filter(is_bright).count() >= BRIGHT_PIXELS
    }
}
