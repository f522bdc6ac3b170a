//! Direction, length and breadth of the trails that a frame's stars are.

use super::largest::{LargeRegion, MAX, largest_regions};
use super::light::Template;
use super::mean::{for_each_trail, measure_template};
use super::profile::{Strip, TrailProfile};
use super::shape::TrailShape;
use super::streak_profile::StreakProfile;
use crate::base::statistics::median;
use crate::detect::candidates::{Peak, Region};
use crate::detect::detection::StarTrails;
use crate::detect::fit::FrameMaps;
use crate::detect::measure::ellipticity_of;
use arrayvec::ArrayVec;

/// Shorter trails are fitted as elongated spots, in pixels.
const SHORTEST_PX: f64 = 15.0;
/// Trails longer than this fraction of the frame's shorter side are not stars.
const LONGEST_FRACTION: f64 = 0.25;
/// Least ratio of length and breadth.
const MIN_ELONGATION: f64 = 3.0;
/// Fewer regions do not tell the shape of all.
const MIN: usize = 5;
/// Least share of the large regions that are trails in one direction.
const MIN_FRACTION: f64 = 0.6;
/// Times that each property is improved with the others.
const ROUNDS: usize = 3;
/// Cosine of twice the greatest angle between trails in one direction: 8 degrees.
const ALIGNED: f64 = 0.96;

/// The shape of the trails of a frame.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::detect) struct Trails {
    pub(super) shape: TrailShape,
    /// The light along them; `None` where it has no ends: even light is taken.
    pub(super) template: Option<Template>,
}

impl Trails {
    /// The trails of a frame of whose large regions most are trails in one direction, side by side. A
    /// satellite's trail that is broken up is one line; other stars are round.
    pub fn measure(maps: &FrameMaps<'_>, peaks: &[Peak], regions: &[Region]) -> Option<Self> {
        let largest = largest_regions(maps, peaks, regions);
        let long: ArrayVec<_, MAX> = largest.iter().filter(|large| is_long(large)).collect();
        let fewest = MIN.max((MIN_FRACTION * largest.len() as f64).ceil() as usize);
        if long.len() < fewest {
            return None;
        }
        let doubled = mean_doubled(long.iter().map(|large| large.region));
        let is_aligned = |large: &&&LargeRegion<'_>| {
            let [cos, sin] = doubled_direction(large.region);
            cos * doubled[0] + sin * doubled[1] > ALIGNED
        };
        let aligned: ArrayVec<&LargeRegion<'_>, MAX> =
            long.iter().filter(is_aligned).copied().collect();
        // Twice the direction's angle is that of the ellipticity.
        let direction = axis_of(doubled);
        let lines = lines(&aligned, direction).min(rows(&aligned));
        if aligned.len() < fewest || lines < MIN.max(aligned.len() / 2) {
            return None;
        }
        let lengths_px = aligned.iter().map(|large| length_px(large.region));
        let mut lengths_px: ArrayVec<f64, MAX> = lengths_px.collect();
        let shape = TrailShape {
            direction,
            length_px: median(&mut lengths_px),
            half_breadth_px: 2.0 * maps.width_px(),
        };
        let longest_px = LONGEST_FRACTION * maps.view.width.min(maps.view.height) as f64;
        let is_possible = |shape: &TrailShape| (SHORTEST_PX..longest_px).contains(&shape.length_px);
        let mut shape = Some(shape)
            .filter(is_possible)
            .map(|shape| refined(maps, &aligned, shape))
            .filter(is_possible)?;
        let mut template = None;
        for _ in 0..ROUNDS {
            let better = measure_template(maps, &aligned, &shape, template.as_ref());
            let Some(better) = better else {
                break;
            };
            shape.length_px = better.length_px;
            template = Some(better);
        }
        Some(Self { shape, template })
    }

    /// As told to others.
    pub fn summary(&self) -> StarTrails {
        let [cos, sin] = self.shape.direction;
        StarTrails {
            // y points down; angles are counted as seen.
            angle_rad: libm::atan2(-sin, cos),
            length_px: self.shape.length_px,
            middle_sigma_px: self
                .template
                .as_ref()
                .map_or(0.5 * self.shape.half_breadth_px, |light| {
                    light.middle_sigma_px
                }),
        }
    }
}

/// The shape among similar ones with which the stars of the regions stand out most.
fn refined(maps: &FrameMaps<'_>, regions: &[&LargeRegion<'_>], shape: TrailShape) -> TrailShape {
    let mut profile = TrailProfile::default();
    // Of logarithms: the brightest star counts no more than others.
    let mut likelihood = |shape: TrailShape| -> f64 {
        let gains = regions.iter().filter_map(|large| {
            let strip = Strip {
                x: large.region.x,
                y: large.region.y,
                shape,
                reach_px: 1.5 * shape.length_px,
            };
            profile.measure(maps, &strip);
            StreakProfile::fit(&profile, &shape, None, 0.0).map(|bar| libm::log(bar.gain))
        });
        gains.sum()
    };
    let mut best_of = |shape: TrailShape, others: &mut dyn Iterator<Item = TrailShape>| {
        let mut best = (likelihood(shape), shape);
        for other in others {
            let with_other = likelihood(other);
            if with_other > best.0 {
                best = (with_other, other);
            }
        }
        best.1
    };
    let stretched = |shape: TrailShape, factor: f64| TrailShape {
        length_px: shape.length_px * factor,
        ..shape
    };
    let mut shape = shape;
    for round in 0..ROUNDS {
        // At first the regions may be pieces, or of several stars.
        let step = if round == 0 { 0.06 } else { 0.01 };
        let mut lengths = (-10..=20).map(|i| stretched(shape, libm::exp(step * f64::from(i))));
        shape = best_of(shape, &mut lengths);
        shape = turned(shape, median_slope(maps, regions, &shape));
        let mut breadths = (2..=12).map(|step| TrailShape {
            half_breadth_px: 0.5 * f64::from(step),
            ..shape
        });
        shape = best_of(shape, &mut breadths);
    }
    shape
}

/// A shape turned by an angle in radians.
fn turned(shape: TrailShape, angle: f64) -> TrailShape {
    let [cos, sin] = shape.direction;
    let (s, c) = libm::sincos(angle);
    TrailShape {
        direction: [cos * c - sin * s, sin * c + cos * s],
        ..shape
    }
}

/// By what angle the trails in the regions are turned from the shape, in radians: the median of the
/// slopes of their light.
fn median_slope(maps: &FrameMaps<'_>, regions: &[&LargeRegion<'_>], shape: &TrailShape) -> f64 {
    let mut slopes: ArrayVec<f64, MAX> = ArrayVec::new();
    for_each_trail(maps, regions, shape, None, |profile, _| {
        slopes.push(profile.slope(0.5 * shape.length_px));
    });
    let slope = median(&mut slopes);
    if slope.is_finite() { slope } else { 0.0 }
}

/// Number of rows of regions, each of which goes on where the one before it ends: the pieces of one trail.
/// Trails of satellites may have several directions.
fn rows(regions: &[&LargeRegion<'_>]) -> usize {
    let mut row: ArrayVec<usize, MAX> = (0..regions.len()).collect();
    for (i, first) in regions.iter().enumerate() {
        for (j, second) in regions.iter().enumerate().skip(i + 1) {
            if row[i] != row[j] && goes_on(first.region, second.region) {
                let [kept, joined] = [row[i], row[j]];
                row.iter_mut()
                    .filter(|row| **row == joined)
                    .for_each(|row| *row = kept);
            }
        }
    }
    row.sort_unstable();
    row.windows(2).filter(|pair| pair[0] != pair[1]).count() + 1
}

/// Whether each of two regions lies on the line of the other, and not far from it.
fn goes_on(first: &Region, second: &Region) -> bool {
    /// Largest distance of the middles, in lengths.
    const FAR: f64 = 4.0;
    /// Error of a region's direction, in radians.
    const SLOPE: f64 = 0.03;
    let [dx, dy] = [second.x - first.x, second.y - first.y];
    let distance_px = libm::hypot(dx, dy);
    let apart_px = 3.0 * first.minor_px.max(second.minor_px) + SLOPE * distance_px;
    let is_on_line = |region: &Region| {
        let [cos, sin] = axis_of(doubled_direction(region));
        (dy * cos - dx * sin).abs() < apart_px
    };
    distance_px < FAR * length_px(first).max(length_px(second))
        && is_on_line(first)
        && is_on_line(second)
}

/// The direction of half the angle.
fn axis_of(doubled: [f64; 2]) -> [f64; 2] {
    let half_angle = 0.5 * libm::atan2(doubled[1], doubled[0]);
    [libm::cos(half_angle), libm::sin(half_angle)]
}

/// Number of lines in one direction on which the regions are.
fn lines(regions: &[&LargeRegion<'_>], [cos, sin]: [f64; 2]) -> usize {
    let across = regions
        .iter()
        .map(|large| large.region.y * cos - large.region.x * sin);
    let mut across: ArrayVec<f64, MAX> = across.collect();
    across.sort_unstable_by(f64::total_cmp);
    let breadths_px = regions.iter().map(|large| large.region.minor_px);
    let mut breadths_px: ArrayVec<f64, MAX> = breadths_px.collect();
    let apart_px = 3.0 * median(&mut breadths_px);
    let gaps = across
        .windows(2)
        .filter(|pair| pair[1] - pair[0] > apart_px);
    gaps.count() + 1
}

fn is_long(large: &LargeRegion<'_>) -> bool {
    let region = large.region;
    region.major_px > MIN_ELONGATION * region.minor_px
}

/// Length of a bar with these moments, in pixels.
fn length_px(region: &Region) -> f64 {
    let along2 = region.major_px.powi(2) - region.minor_px.powi(2);
    (12.0 * along2.max(0.0)).sqrt()
}

/// The direction of the longer axis, as cosine and sine of twice its angle.
fn doubled_direction(region: &Region) -> [f64; 2] {
    unit(ellipticity_of(region.covariance))
}

fn unit([x, y]: [f64; 2]) -> [f64; 2] {
    let length = libm::hypot(x, y).max(f64::MIN_POSITIVE);
    [x / length, y / length]
}

/// The mean direction, as cosine and sine of twice its angle.
fn mean_doubled<'a>(regions: impl Iterator<Item = &'a Region>) -> [f64; 2] {
    let directions = regions.map(doubled_direction);
    unit(directions.fold([0.0, 0.0], |[x, y], [cos, sin]| [x + cos, y + sin]))
}
