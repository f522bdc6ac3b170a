//! What one frame tells.

use super::robust::{Typical, mean_and_sigma};
use crate::frame::Frame;

/// The statistics of one frame taken without light.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameStatistics {
    /// What it is called.
    pub frame: String,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Its exposure, in seconds, where that is known.
    pub exposure_s: Option<f64>,
    /// The mean of its pixels, in ADU.
    pub mean_adu: f64,
    /// Their standard deviation, in ADU.
    pub sigma_adu: f64,
    /// Pixels without a value.
    pub without_value: usize,
    /// Pixels at full scale.
    pub saturated: usize,
    /// Pixels brighter than those around them and far above the noise.
    pub bright: usize,
    /// Those of them that look like stars: their light is on their neighbours along both axes, too.
    pub star_like: usize,
}

impl FrameStatistics {
    /// The statistics of `frame`; the exposure is that of its header unless another is given.
    #[doc(alias = "E_i")]
    #[doc(alias = "sigma_gi")]
    pub fn of(name: &str, frame: &Frame, exposure_s: Option<f64>) -> Self {
        let values = frame.pixels.iter().filter(|p| !p.is_nan());
        let moments = mean_and_sigma(values.clone().map(|&p| f64::from(p)));
        let full_adu = frame.saturation_adu.unwrap_or(f32::INFINITY);
        let spots = Spots::of(frame);
        Self {
            frame: name.to_owned(),
            width: frame.width,
            height: frame.height,
            exposure_s: exposure_s.or(frame.metadata.exposure_s),
            mean_adu: moments.level,
            sigma_adu: moments.spread,
            without_value: frame.pixels.len() - values.clone().count(),
            saturated: values.filter(|p| **p >= full_adu).count(),
            star_like: spots.wide,
            bright: spots.all,
        }
    }
}

/// A pixel so many spreads above the rest is bright.
const BRIGHT_SIGMA: f64 = 8.0;
/// The light of a star on two opposite neighbours of its brightest pixel: at least so many spreads, and this part of that
/// pixel's own. A Gaussian spot of a sigma of half a pixel has a third of it there.
const NEIGHBOURS_SIGMA: f64 = 4.0;
const NEIGHBOURS_PART: f64 = 0.15;

/// Bright pixels of a frame.
struct Spots {
    all: usize,
    wide: usize,
}

impl Spots {
    /// A hot pixel stands alone, and two of them or a bright column stand in one line; a star is wide both ways.
    fn of(frame: &Frame) -> Self {
        let mut spots = Self { all: 0, wide: 0 };
        let floor = f64::from(frame.step_adu) / 2.0;
        let Some(typical) = Typical::of(&frame.pixels, floor) else {
            return spots;
        };
        let spread = typical.spread.max(floor);
        let width = frame.width;
        let above = |i: usize| f64::from(frame.pixels[i]) - typical.level;
        for y in 1..frame.height - 1 {
            for i in y * width + 1..(y + 1) * width - 1 {
                let peak = above(i);
                if peak.is_nan() || peak <= BRIGHT_SIGMA * spread {
                    continue;
                }
                let [left, right, up, down] = [i - 1, i + 1, i - width, i + width].map(above);
                if peak < left.max(up) || peak <= right.max(down) {
                    continue;
                }
                let least = (NEIGHBOURS_SIGMA * spread).max(NEIGHBOURS_PART * peak);
                spots.all += 1;
                spots.wide += usize::from(left + right > least && up + down > least);
            }
        }
        spots
    }
}
