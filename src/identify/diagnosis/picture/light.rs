//! The picture that is looked at: the frame's light, reduced to few pixels.

use super::shapes::{Shape, shapes};
use crate::base::statistics::median;
use crate::frame::Frame;
use crate::identify::diagnosis::above::above_background;
use std::cell::OnceCell;

/// Most pixels that are looked at. Stars, letters and strokes of larger frames are larger, too.
const MAX_PX: usize = 3_000_000;
/// Levels and noise are those of at most so many pixels.
const SAMPLED_PX: usize = 1 << 18;
/// Standard deviation of normal noise over the median step between neighbors.
const SIGMA_PER_STEP: f32 = 1.048;

/// A picture of at most [`MAX_PX`] pixels.
pub(super) struct Light {
    /// The picture.
    pub frame: Frame<'static>,
    /// Its pixels above the background around them.
    pub above: Vec<f32>,
    /// Pixels of the frame for one of the picture, on each axis.
    pub factor: usize,
    /// The lowest level, the median, and full scale; where that is not known, the highest level.
    pub lowest: f32,
    pub sky: f32,
    pub full: f32,
    /// Standard deviation of a pixel, from its difference to its neighbor.
    pub noise: f32,
    /// The step between levels of the frame.
    pub step: f32,
    /// Share of the frame's pixels that are equal to the next one and to the one below: nearly all in what a
    /// program draws, few where a detector has noise.
    pub flat_share: f64,
    spots: OnceCell<Vec<Shape>>,
}

impl Light {
    /// Bytes that it takes at most, beside a frame of so many pixels.
    pub fn bytes(pixels: usize) -> u64 {
        /// The picture, that above the background, masks and regions.
        const BYTES_PER_PX: usize = 24;
        (pixels.min(4 * MAX_PX) * BYTES_PER_PX) as u64
    }

    /// Reduces a frame.
    pub fn of(frame: &Frame) -> Self {
        let factor = (1..).find(|factor| frame.pixels.len() / (factor * factor) <= MAX_PX);
        let factor = factor.unwrap_or(1);
        let mut reduced = frame.binned(factor);
        let sky = median(&mut sample(&reduced));
        let values = reduced.values_mut();
        values
            .iter_mut()
            .filter(|value| !value.is_finite())
            .for_each(|value| *value = sky);
        let [lowest, highest] = reduced.range_adu();
        let full = frame.saturation_level_adu().unwrap_or(highest);
        Self {
            above: above_background(&reduced),
            noise: noise(&reduced).max(0.3 * reduced.step_adu),
            frame: reduced,
            factor,
            lowest,
            sky,
            full: full.max(highest),
            step: frame.step_adu,
            flat_share: flat_share(frame),
            spots: OnceCell::new(),
        }
    }

    /// Regions that are brighter than the background, or darker for a `sign` of -1, by more than a threshold. None
    /// where they are a large part of the picture: that is no thing in it.
    pub fn regions(&self, sign: f32, threshold: f32) -> Vec<Shape> {
        const MOST: f64 = 0.25;
        let are_in = || self.above.iter().map(|value| sign * value > threshold);
        let count = are_in().filter(|&is| is).count();
        if count as f64 > MOST * self.above.len() as f64 {
            return Vec::new();
        }
        shapes(are_in(), self.frame.width)
    }

    /// Regions that are clearly brighter than the noise around them: stars, and whatever else shines.
    pub fn spots(&self) -> &[Shape] {
        /// Standard deviations of the noise, and levels: blocks of JPEG files differ by one or two.
        const NOISE_SIGMA: f32 = 5.0;
        const LEVELS: f32 = 3.5;
        let threshold = (NOISE_SIGMA * self.noise).max(LEVELS * self.step);
        self.spots.get_or_init(|| self.regions(1.0, threshold))
    }

    /// The largest difference from the background, upwards or downwards.
    pub fn contrast(&self, sign: f32) -> f32 {
        self.above
            .iter()
            .fold(0.0, |most, value| most.max(sign * value))
    }

    /// Levels from dark to full scale.
    pub fn range(&self) -> f32 {
        self.full - self.lowest.min(0.0)
    }
}

/// Pixels with a value, evenly from the whole frame.
fn sample(frame: &Frame) -> Vec<f32> {
    // An odd step meets all columns.
    let step = frame.pixels.len().div_ceil(SAMPLED_PX) | 1;
    let places = (0..frame.pixels.len()).step_by(step);
    let values = places.map(|index| frame.pixels.value(index));
    values.filter(|value| value.is_finite()).collect()
}

fn noise(frame: &Frame) -> f32 {
    let step = frame.pixels.len().div_ceil(SAMPLED_PX) | 1;
    let places = (0..frame.pixels.len() - 1).step_by(step);
    let steps =
        places.map(|index| (frame.pixels.value(index + 1) - frame.pixels.value(index)).abs());
    SIGMA_PER_STEP * median(&mut steps.filter(|step| step.is_finite()).collect::<Vec<_>>())
}

/// See [`Light::flat_share`].
fn flat_share(frame: &Frame) -> f64 {
    let inner = (frame.height - 1) * frame.width - 1;
    let step = inner.div_ceil(SAMPLED_PX) | 1;
    let is_flat = |index: &usize| {
        let level = frame.pixels.value(*index);
        level == frame.pixels.value(index + 1) && level == frame.pixels.value(index + frame.width)
    };
    let places = || (0..inner).step_by(step);
    places().filter(is_flat).count() as f64 / places().count().max(1) as f64
}
