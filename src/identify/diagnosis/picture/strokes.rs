//! Drawn lines: long strokes of one thickness that make up most of what stands out.

use super::light::Light;
use super::shapes::Shape;

/// Ink is at least this share of the highest contrast, and above so many standard deviations of the noise.
const INK: f32 = 0.3;
const NOISE_SIGMA: f32 = 8.0;
/// A stroke is so much longer than thick, and so long, in pixels.
const SLIM: f64 = 10.0;
const SHORTEST_PX: f64 = 30.0;
const THICKEST_PX: f64 = 12.0;
/// Strokes have this share of all ink.
const SHARE: f64 = 0.6;
/// All strokes together are so much longer than the picture is wide.
const MIN_LENGTH: f64 = 1.0;
/// Largest share of ink in the picture: more is no drawing of lines.
const MOST_INK: f64 = 0.25;
/// Share of equal neighbors from which a dark picture has no noise.
const FLAT: f64 = 0.6;

/// Whether the picture is drawn of lines: dark ones on paper, or bright ones on a ground without noise.
pub(super) fn are_drawn(light: &Light) -> bool {
    let is_paper = light.sky - light.lowest > 0.5 * light.range();
    if is_paper {
        has_strokes(light, -1.0)
    } else {
        light.flat_share > FLAT && has_strokes(light, 1.0)
    }
}

fn has_strokes(light: &Light, sign: f32) -> bool {
    let threshold = (INK * light.contrast(sign)).max(NOISE_SIGMA * light.noise);
    let regions = light.regions(sign, threshold);
    let all: f64 = regions.iter().map(Shape::area).sum();
    if all > MOST_INK * light.above.len() as f64 {
        return false;
    }
    let [width, height] = [light.frame.width, light.frame.height];
    // Bars along the border are of a frame around the picture.
    let is_inside = |shape: &&Shape| is_stroke(shape) && !shape.touches(width, height);
    let strokes: Vec<&Shape> = regions.iter().filter(is_inside).collect();
    let area: f64 = strokes.iter().map(|shape| shape.area()).sum();
    let length: f64 = strokes
        .iter()
        .map(|shape| shape.area() / shape.thickness())
        .sum();
    area > SHARE * all && length > MIN_LENGTH * light.frame.width as f64
}

fn is_stroke(shape: &Shape) -> bool {
    let thickness = shape.thickness();
    let extent = shape.extent();
    thickness < THICKEST_PX && extent > SHORTEST_PX && extent > SLIM * thickness
}
