//! Stars out of focus: round discs or rings of one size, however bright they are.

use super::light::Light;
use super::shapes::Shape;
use crate::base::statistics::median_of;

/// Smaller spots are of stars in focus, or blocks of a JPEG file, in pixels across.
const SMALLEST_PX: f64 = 10.0;
/// Largest ratio of the axes of a disc.
const AXIS_RATIO: f64 = 1.4;
/// Fewest discs, and their smallest share of the light that stands out: a lamp may have specks around it.
const MIN_DISCS: usize = 5;
const SHARE: f32 = 0.6;
/// Sizes of more than half of the discs are within this share of their median.
const SPREAD: f64 = 0.3;

/// Diameter of the discs that stars are, in pixels of the frame.
pub(super) fn disc_px(light: &Light) -> Option<f64> {
    let regions = light.spots();
    let all: f32 = regions.iter().map(|shape| flux(shape, light)).sum();
    let mut discs: Vec<(f64, &Shape)> = regions
        .iter()
        .filter_map(|shape| Some((diameter(shape, light)?, shape)))
        .collect();
    let count = discs.len();
    let size = median_of(discs.iter().map(|(size, _)| *size))?;
    discs.retain(|(other, _)| (other - size).abs() < SPREAD * size);
    let in_discs: f32 = discs.iter().map(|(_, shape)| flux(shape, light)).sum();
    let are_alike = discs.len() >= MIN_DISCS && 2 * discs.len() > count;
    let is_enough = are_alike && in_discs > SHARE * all && size > SMALLEST_PX;
    (is_enough && are_brightest(&discs, light)).then_some(size * light.factor as f64)
}

/// Whether most of the brightest pixels are in the discs. What is larger than a cell of the background, as the Moon
/// is, has regions along its edge only.
fn are_brightest(discs: &[(f64, &Shape)], light: &Light) -> bool {
    let values = light.frame.values();
    let [_, highest] = light.frame.range_adu();
    let is_bright = |value: &f32| *value > light.sky + 0.5 * (highest - light.sky);
    let all = values.iter().copied().filter(is_bright).count();
    let pixels = discs.iter().flat_map(|(_, shape)| &shape.pixels);
    let in_discs = pixels.map(|&index| values[index as usize]);
    2 * in_discs.filter(is_bright).count() > all
}

/// Light of a region above the background.
fn flux(shape: &Shape, light: &Light) -> f32 {
    let levels = shape
        .pixels
        .iter()
        .map(|&index| light.above[index as usize]);
    levels.sum()
}

/// Diameter of a round region at half of its height, from its second moments; `None` if it is not round, or is small.
fn diameter(shape: &Shape, light: &Light) -> Option<f64> {
    /// Fewest pixels: less is noise.
    const MIN_PX: f64 = 30.0;
    let above = |index: u32| light.above[index as usize];
    if shape.area() < MIN_PX {
        return None;
    }
    let mut levels: Vec<f32> = shape.pixels.iter().map(|&index| above(index)).collect();
    let high = (levels.len() - 1) * 9 / 10;
    let high = *levels.select_nth_unstable_by(high, f32::total_cmp).1;
    let core = shape.pixels.iter().copied();
    let core = core.filter(|&index| above(index) > 0.5 * high).collect();
    let core = Shape::of(core, 1, light.frame.width);
    // A disc of diameter d has the variance d²/16 along each axis.
    let size =
        (core.length * core.length + core.breadth * core.breadth).sqrt() * (16.0_f64 / 24.0).sqrt();
    (core.length < AXIS_RATIO * core.breadth).then_some(size)
}
