//! A bright disc: the Moon, the Sun or a lamp, whole, in part, or with its glow.

use super::light::Light;
use super::shapes::{Shape, shapes};
use crate::base::statistics::median;
use crate::frame::Frame;
use std::f64::consts::TAU;

/// The longer side is reduced to about so many pixels.
const SIDE_PX: usize = 512;
/// Edges of a disc are looked for at these shares of its height.
const HEIGHTS: [f32; 4] = [0.25, 0.5, 0.75, 0.95];
/// Smallest share of what is above that height.
const SHARE: f64 = 0.4;
/// Smallest diameter, as a share of the longer side. Stars are smaller, and so are planets.
const SMALLEST: f64 = 0.025;
/// Its limb is within this share of the radius, or pixels, of a circle, …
const OFF_CIRCLE: f64 = 0.06;
const OFF_CIRCLE_PX: f64 = 1.0;
/// … along so many of 72 parts: of a crescent, a half.
const PARTS: usize = 72;
const MIN_PARTS: usize = 30;
/// It is above the sky by this share of full scale.
const CONTRAST: f32 = 0.2;
/// Share of its light that is left a little outside its limb, …
const OUTSIDE: f32 = 0.3;
/// … or at twice its radius, if it is saturated: a glow has no edge.
const GLOW: f32 = 0.6;
/// Level of a saturated disc over full scale.
const SATURATED: f32 = 0.96;

/// A bright disc in a picture.
pub(super) struct Disc {
    /// Its middle and its diameter, in pixels of the frame.
    pub middle_px: [f64; 2],
    pub diameter_px: f64,
}

/// The brightest thing of a picture, if it is a disc.
pub(super) fn find(light: &Light) -> Option<Disc> {
    let factor = light.frame.width.max(light.frame.height).div_ceil(SIDE_PX);
    let small = light.frame.binned(factor);
    let sky = median(&mut small.values().into_owned());
    let [_, highest] = small.range_adu();
    if highest - sky < CONTRAST * light.range() {
        return None;
    }
    HEIGHTS.iter().find_map(|height| {
        let threshold = sky + height * (highest - sky);
        let circle = largest(&small, threshold)?;
        circle.is_disc(&small, sky, light.full).then(|| {
            let pixel = (factor * light.factor) as f64;
            Disc {
                middle_px: circle.middle.map(|at| (at + 0.5) * pixel - 0.5),
                diameter_px: 2.0 * circle.radius * pixel,
            }
        })
    })
}

/// The largest region above a threshold, and the circle around it.
struct Circle {
    region: Shape,
    middle: [f64; 2],
    radius: f64,
}

fn largest(small: &Frame, threshold: f32) -> Option<Circle> {
    let mut mask: Vec<bool> = small
        .pixels
        .values()
        .map(|value| value > threshold)
        .collect();
    let regions = shapes(&mut mask, small.width);
    let all: f64 = regions.iter().map(Shape::area).sum();
    let region = regions
        .into_iter()
        .max_by(|a, b| a.area().total_cmp(&b.area()))?;
    if region.area() < SHARE * all {
        return None;
    }
    let places: Vec<[f64; 2]> = places(&region, small.width).collect();
    let (middle, radius) = enclosing(&places);
    Some(Circle {
        region,
        middle,
        radius,
    })
}

fn places(region: &Shape, width: usize) -> impl Iterator<Item = [f64; 2]> {
    let index = region.pixels.iter().map(|&index| index as usize);
    index.map(move |index| [(index % width) as f64, (index / width) as f64])
}

/// The smallest circle around points.
///
/// # Reference
/// Badoiu & Clarkson 2003, SODA 801: the middle goes to the farthest point, each time by less.
fn enclosing(points: &[[f64; 2]]) -> ([f64; 2], f64) {
    const STEPS: u32 = 200;
    let mut middle = points[0];
    let farthest = |middle: [f64; 2]| {
        let distance = |p: &[f64; 2]| libm::hypot(p[0] - middle[0], p[1] - middle[1]);
        let far = points
            .iter()
            .max_by(|a, b| distance(a).total_cmp(&distance(b)));
        far.map_or((middle, 0.0), |far| (*far, distance(far)))
    };
    for step in 1..=STEPS {
        let (far, _) = farthest(middle);
        let share = 1.0 / f64::from(step + 1);
        middle = [0, 1].map(|axis| middle[axis] + share * (far[axis] - middle[axis]));
    }
    (middle, farthest(middle).1 + 0.5)
}

impl Circle {
    fn is_disc(&self, small: &Frame, sky: f32, full: f32) -> bool {
        let smallest = SMALLEST * small.width.max(small.height) as f64;
        if 2.0 * self.radius < smallest || self.limb_parts(small.width) < MIN_PARTS {
            return false;
        }
        let inside = self.inside(small) - sky;
        let is_saturated = inside + sky >= SATURATED * full && sky < 0.8 * full;
        let left = |radius| {
            self.outside(small, radius)
                .map(|level| (level - sky) / inside)
        };
        let has_limb = left(1.15 + 1.5 / self.radius).is_some_and(|left| left < OUTSIDE);
        has_limb || is_saturated && left(2.0).is_some_and(|left| left < GLOW)
    }

    /// In how many of [`PARTS`] directions the region ends at the circle.
    fn limb_parts(&self, width: usize) -> usize {
        let mut reach = [0.0_f64; PARTS];
        for [x, y] in places(&self.region, width) {
            let [dx, dy] = [x - self.middle[0], y - self.middle[1]];
            let part = self.part(libm::atan2(dy, dx));
            reach[part] = reach[part].max(libm::hypot(dx, dy) + 0.5);
        }
        let off = (OFF_CIRCLE * self.radius).max(OFF_CIRCLE_PX);
        reach
            .iter()
            .filter(|&&reach| reach > self.radius - off)
            .count()
    }

    fn part(&self, angle_rad: f64) -> usize {
        let turns = angle_rad / TAU;
        let part = (turns - turns.floor()) * PARTS as f64;
        (part as usize).min(PARTS - 1)
    }

    /// Median level of the region.
    fn inside(&self, small: &Frame) -> f32 {
        let levels = self
            .region
            .pixels
            .iter()
            .map(|&index| small.pixels.value(index as usize));
        median(&mut levels.collect::<Vec<_>>())
    }

    /// Median level around the circle, at this share of its radius; `None` outside the picture.
    fn outside(&self, small: &Frame, radius: f64) -> Option<f32> {
        let mut levels: Vec<f32> = (0..PARTS)
            .filter_map(|part| {
                let (sin, cos) = libm::sincos(TAU * part as f64 / PARTS as f64);
                let x = (self.middle[0] + radius * self.radius * cos).round();
                let y = (self.middle[1] + radius * self.radius * sin).round();
                let is_inside =
                    x >= 0.0 && y >= 0.0 && x < small.width as f64 && y < small.height as f64;
                is_inside.then(|| small.at(x as usize, y as usize))
            })
            .collect();
        (levels.len() > PARTS / 8).then(|| median(&mut levels))
    }
}
