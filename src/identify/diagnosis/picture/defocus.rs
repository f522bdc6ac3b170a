//! Stars out of focus: round discs or rings of one size, however bright they are.

use super::light::Light;
use super::shapes::{Shape, shapes};
use crate::base::statistics::median_of;

/// A disc is above so many standard deviations of the noise.
const NOISE_SIGMA: f32 = 5.0;
/// Smaller spots are of stars in focus, in pixels across.
const SMALLEST_PX: f64 = 9.0;
/// Largest ratio of the axes of a disc.
const AXIS_RATIO: f64 = 1.4;
/// Fewest discs, and their smallest share of the area that stands out.
const MIN_DISCS: usize = 5;
const SHARE: f64 = 0.6;
/// Their sizes differ by less than this share: the median difference from the median.
const SPREAD: f64 = 0.2;

/// Diameter of the discs that stars are, in pixels of the frame.
pub(super) fn disc_px(light: &Light) -> Option<f64> {
    let mut mask: Vec<bool> = light
        .above
        .iter()
        .map(|value| *value > NOISE_SIGMA * light.noise)
        .collect();
    let regions = shapes(&mut mask, light.frame.width);
    let all: f64 = regions.iter().map(Shape::area).sum();
    let discs: Vec<(f64, &Shape)> = regions
        .iter()
        .filter_map(|shape| Some((diameter(shape, &light.above, light.frame.width)?, shape)))
        .collect();
    let area: f64 = discs.iter().map(|(_, shape)| shape.area()).sum();
    if discs.len() < MIN_DISCS || area < SHARE * all {
        return None;
    }
    let size = median_of(discs.iter().map(|(size, _)| *size))?;
    let spread = median_of(discs.iter().map(|(other, _)| (other - size).abs()))?;
    (size > SMALLEST_PX && spread < SPREAD * size).then_some(size * light.factor as f64)
}

/// Diameter of a round region at half of its height, from its second moments; `None` if it is not round or small.
fn diameter(shape: &Shape, above: &[f32], width: usize) -> Option<f64> {
    // Noise is left out.
    if shape.area() < 30.0 {
        return None;
    }
    let mut levels: Vec<f32> = shape
        .pixels
        .iter()
        .map(|&index| above[index as usize])
        .collect();
    levels.sort_by(f32::total_cmp);
    let half = 0.5 * levels[(levels.len() - 1) * 9 / 10];
    let core = shape
        .pixels
        .iter()
        .filter(|index| above[**index as usize] > half);
    let core = Shape::of(core.copied().collect(), 1, width);
    // A disc of diameter d has the variance d²/16 along each axis.
    let size =
        (core.length * core.length + core.breadth * core.breadth).sqrt() * (16.0_f64 / 24.0).sqrt();
    (core.length < AXIS_RATIO * core.breadth).then_some(size)
}
