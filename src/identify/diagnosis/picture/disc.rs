//! A bright disc: the Moon, the Sun or a lamp, whole, in part, or with its glow.

use super::light::Light;
use super::shapes::{Shape, shapes};
use crate::base::statistics::median;
use crate::frame::Frame;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;

/// The longer side is reduced to about so many pixels.
const SIDE_PX: usize = 512;
/// Edges of a disc are looked for at these shares of its height.
const HEIGHTS: [f32; 4] = [0.25, 0.5, 0.75, 0.9];
/// Smallest share of what is above that height.
const SHARE: f64 = 0.4;
/// Smallest diameter, as a share of the longer side. Stars are smaller, and so are planets.
const SMALLEST: f64 = 0.025;
/// Its limb is within this share of the radius, or pixels, of a circle, …
const OFF_CIRCLE: f64 = 0.06;
const OFF_CIRCLE_PX: f64 = 1.0;
/// … along so many of 72 parts: of a crescent, a half.
const PARTS: usize = 72;
const MIN_PARTS: usize = 28;
/// … and of a whole disc, most.
const MOST_PARTS: usize = 48;
/// It is above the sky by this share of full scale.
const CONTRAST: f32 = 0.2;
/// Share of its light that is left a little outside its limb, …
const OUTSIDE: f32 = 0.15;
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
        let region = largest(&small, sky + height * (highest - sky))?;
        let limb = Circle::of_limb(&region, small.width);
        let middling = Circle::middling(&region, small.width);
        limb.into_iter().chain([middling]).find_map(|circle| {
            circle.is_disc(&small, [sky, light.full]).then(|| {
                let pixel = (factor * light.factor) as f64;
                Disc {
                    middle_px: circle.middle.map(|at| (at + 0.5) * pixel - 0.5),
                    diameter_px: 2.0 * circle.radius * pixel,
                }
            })
        })
    })
}

/// A region, and a circle that may be its limb.
struct Circle<'a> {
    region: &'a Shape,
    middle: [f64; 2],
    radius: f64,
    /// In how many directions the region ends at the circle, and how many are needed.
    limb_parts: usize,
    least_parts: usize,
}

/// The largest region above a threshold, unless it has only a small part of what is above it.
fn largest(small: &Frame, threshold: f32) -> Option<Shape> {
    let is_above = small.pixels.values().map(|value| value > threshold);
    let regions = shapes(is_above, small.width);
    let all: f64 = regions.iter().map(Shape::area).sum();
    let largest = regions
        .into_iter()
        .max_by(|a, b| a.area().total_cmp(&b.area()))?;
    (largest.area() >= SHARE * all).then_some(largest)
}

fn places(region: &Shape, width: usize) -> impl Iterator<Item = [f64; 2]> {
    let index = region.pixels.iter().map(|&index| index as usize);
    index.map(move |index| [(index % width) as f64, (index / width) as f64])
}

/// First and last pixel of a region in each row.
fn ends(region: &Shape, width: usize) -> Vec<[f64; 2]> {
    let rows = region.top as usize..=region.bottom as usize;
    let mut ends: Vec<[f64; 2]> = rows.clone().map(|_| [f64::MAX, f64::MIN]).collect();
    for [x, y] in places(region, width) {
        let [first, last] = &mut ends[(y - region.top) as usize];
        (*first, *last) = (first.min(x), last.max(x));
    }
    let side = |end: usize| {
        ends.iter()
            .zip(rows.clone())
            .map(move |(ends, y)| [ends[end], y as f64])
    };
    side(0).chain(side(1)).collect()
}

/// The circle through three of the points at the edge of a region on which most of them lie.
fn most_common_circle(edge: &[[f64; 2]], extent: f64) -> Option<([f64; 2], f64)> {
    /// So many points are tried.
    const TRIED: usize = 24;
    /// Largest radius over the extent of the region: a straight edge is on larger ones.
    const LARGEST: f64 = 0.65;
    let points: Vec<[f64; 2]> = edge
        .iter()
        .step_by(edge.len().div_ceil(TRIED))
        .copied()
        .collect();
    let mut best: Option<(usize, ([f64; 2], f64))> = None;
    for (i, &a) in points.iter().enumerate() {
        for (j, &b) in points.iter().enumerate().skip(i + 1) {
            for &c in &points[j + 1..] {
                let Some((middle, radius)) = circle_through(a, b, c) else {
                    continue;
                };
                if radius > LARGEST * extent {
                    continue;
                }
                let off = (OFF_CIRCLE * radius).max(OFF_CIRCLE_PX);
                let distance = |p: &&[f64; 2]| libm::hypot(p[0] - middle[0], p[1] - middle[1]);
                let is_on = |p: &&[f64; 2]| (distance(p) - radius).abs() < off;
                let count = points.iter().filter(is_on).count();
                if best.is_none_or(|(most, _)| count > most) {
                    best = Some((count, (middle, radius)));
                }
            }
        }
    }
    let (_, circle) = best?;
    (0..3).try_fold(circle, |circle, _| refined(edge, circle))
}

/// The circle of least squares through the points that are near to one.
///
/// # Reference
/// Kåsa 1976, IEEE Trans. Instrum. Meas. 25, 8: linear in the middle and in the difference of the squares of radius
/// and distance.
fn refined(points: &[[f64; 2]], (middle, radius): ([f64; 2], f64)) -> Option<([f64; 2], f64)> {
    let off = (OFF_CIRCLE * radius).max(OFF_CIRCLE_PX);
    let mut matrix = Matrix3::zeros();
    let mut vector = Vector3::zeros();
    for point in points {
        let [x, y] = [point[0] - middle[0], point[1] - middle[1]];
        if (libm::hypot(x, y) - radius).abs() < off {
            let terms = Vector3::new(x, y, 1.0);
            matrix += terms * terms.transpose();
            vector += terms * (x * x + y * y);
        }
    }
    let [twice_x, twice_y, rest] = matrix.cholesky()?.solve(&vector).into();
    let (x, y) = (twice_x / 2.0, twice_y / 2.0);
    let squared = rest + x * x + y * y;
    (squared > 0.0).then(|| ([middle[0] + x, middle[1] + y], squared.sqrt()))
}

fn circle_through(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Option<([f64; 2], f64)> {
    let ([bx, by], [cx, cy]) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let twice_area = bx * cy - by * cx;
    let (b_squared, c_squared) = (bx * bx + by * by, cx * cx + cy * cy);
    let x = (cy * b_squared - by * c_squared) / (2.0 * twice_area);
    let y = (bx * c_squared - cx * b_squared) / (2.0 * twice_area);
    let radius = libm::hypot(x, y);
    radius.is_finite().then_some(([a[0] + x, a[1] + y], radius))
}

impl<'a> Circle<'a> {
    /// The circle on which most of a region's edge lies: of a crescent, the limb.
    fn of_limb(region: &'a Shape, width: usize) -> Option<Self> {
        let (middle, radius) = most_common_circle(&ends(region, width), region.extent())?;
        let off = (OFF_CIRCLE * radius).max(OFF_CIRCLE_PX);
        let reaches = reaches(region, middle, width);
        let is_inside = reaches.iter().all(|reach| *reach < radius + 2.0 * off);
        let limb = |reach: &&f64| (**reach - radius).abs() < off;
        is_inside.then(|| Self {
            region,
            middle,
            radius,
            limb_parts: reaches.iter().filter(limb).count(),
            least_parts: MIN_PARTS,
        })
    }

    /// The circle that most directions agree about: spikes of a lamp go beyond it.
    fn middling(region: &'a Shape, width: usize) -> Self {
        let middle = region.middle;
        let reaches = reaches(region, middle, width);
        let radius = median(&mut reaches.clone());
        let off = (2.0 * OFF_CIRCLE * radius).max(OFF_CIRCLE_PX);
        let limb = |reach: &&f64| (**reach - radius).abs() < off;
        Self {
            region,
            middle,
            radius,
            limb_parts: reaches.iter().filter(limb).count(),
            least_parts: MOST_PARTS,
        }
    }

    fn is_disc(&self, small: &Frame, [sky, full]: [f32; 2]) -> bool {
        let smallest = SMALLEST * small.width.max(small.height) as f64;
        if 2.0 * self.radius < smallest || self.limb_parts < self.least_parts {
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

/// How far a region reaches from a point in each of [`PARTS`] directions.
fn reaches(region: &Shape, middle: [f64; 2], width: usize) -> Vec<f64> {
    let mut reaches = vec![0.0_f64; PARTS];
    for [x, y] in places(region, width) {
        let [dx, dy] = [x - middle[0], y - middle[1]];
        let turns = libm::atan2(dy, dx) / TAU;
        let part = ((turns - turns.floor()) * PARTS as f64) as usize;
        let reach = &mut reaches[part.min(PARTS - 1)];
        *reach = reach.max(libm::hypot(dx, dy) + 0.5);
    }
    reaches
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The disc in a picture of 400 × 300 pixels of these levels.
    fn found(level: impl Fn(f64, f64) -> f64) -> Option<Disc> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let pixel = |index: usize| {
            let level = level((index % 400) as f64, (index / 400) as f64);
            (level + random.random_range(-2.0..2.0))
                .clamp(0.0, 255.0)
                .round() as f32
        };
        let frame = Frame::new(400, 300, (0..400 * 300).map(pixel).collect()).unwrap();
        find(&Light::of(&frame.with_levels(1.0, Some(255.0))))
    }

    #[test]
    fn a_phase_of_the_moon_has_the_limb_of_the_whole() {
        // The terminator is half an ellipse: from a thin crescent to the full Moon.
        for terminator in [0.6, 0.0, -0.5, -1.0] {
            let is_lit = |x: f64, y: f64| {
                let [u, v] = [(x - 180.0) / 60.0, (y - 140.0) / 60.0];
                u * u + v * v < 1.0 && u > terminator * (1.0 - v * v).sqrt()
            };
            let disc = found(|x, y| if is_lit(x, y) { 150.0 } else { 10.0 });
            let Disc {
                middle_px: [x, y],
                diameter_px,
            } = disc.expect("a disc");
            let off = libm::hypot(x - 180.0, y - 140.0);
            assert!(
                off < 4.0 && (diameter_px - 120.0).abs() < 8.0,
                "{terminator}: {off} {diameter_px}"
            );
        }
    }

    #[test]
    fn what_has_no_limb_is_no_disc() {
        let blob = |sigma: f64| {
            move |x: f64, y: f64| {
                let squared = (x - 200.0).powi(2) + (y - 150.0).powi(2);
                10.0 + 150.0 * (-squared / (2.0 * sigma * sigma)).exp()
            }
        };
        assert!(found(blob(2.0)).is_none() && found(blob(30.0)).is_none());
        let window = |x: f64, y: f64| (x - 200.0).abs() < 30.0 && (y - 150.0).abs() < 20.0;
        assert!(found(|x, y| if window(x, y) { 200.0 } else { 10.0 }).is_none());
        assert!(found(|_, _| 20.0).is_none());
    }
}
