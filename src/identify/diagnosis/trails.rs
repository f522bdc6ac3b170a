//! Trails: stars elongated in one direction, because the camera or the sky moved.

use super::above::above_background;
use super::cause::Diagnosis;
use crate::base::statistics::median_of;
use crate::detect::{Detection, Detections};
use crate::frame::Frame;
use image::{GrayImage, Luma};
use imageproc::rect::{Rect, Region};
use imageproc::region_labelling::{Connectivity, connected_components};
use std::collections::HashSet;

/// Number of detections examined, the brightest.
const LOOKED_AT: usize = 80;
/// A source's region is above this fraction of its peak, and above this many noise sigmas.
const PEAK_FRACTION: f32 = 0.25;
const NOISE_SIGMA: f32 = 4.0;
/// Largest region of a star, in pixels.
const MAX_PX: usize = 6000;
/// Smallest region with a defined direction, in pixels.
const MIN_PX: usize = 6;
/// Smallest ratio of length to width of a trail, and its smallest length.
const ELONGATION: f64 = 2.0;
const SHORTEST_PX: f64 = 6.0;
/// Fewest trails, …
const MIN: usize = 5;
/// … their smallest fraction of the examined sources, …
const MAX_OF_ALL: f64 = 0.6;
/// … and their smallest alignment: the mean of unit vectors at twice their angles, 1 if all are
/// parallel.
const ALIGNMENT: f64 = 0.9;
/// A region is first sought this far around the source, in pixels.
const FIRST_REACH: u32 = 32;

/// A source's region as a bar with the same second moments.
struct SourceStreak {
    angle_rad: f64,
    length_px: f64,
    breadth_px: f64,
}

impl SourceStreak {
    fn is_trail(&self) -> bool {
        self.length_px > SHORTEST_PX && self.length_px > ELONGATION * self.breadth_px
    }
}

/// Whether most sources are trails in one direction.
pub(super) fn diagnose(frame: &Frame, detections: &Detections) -> Option<Diagnosis> {
    if detections.sources.len() < MIN {
        return None;
    }
    let above = above_background(frame);
    let areas = areas(frame, &above, detections);
    let bars: Vec<SourceStreak> = areas
        .iter()
        .filter_map(|area| streak_profile(area, frame.width))
        .collect();
    let trails: Vec<&SourceStreak> = bars.iter().filter(|bar| bar.is_trail()).collect();
    let count = trails.len();
    if count < MIN || (count as f64) < MAX_OF_ALL * areas.len() as f64 {
        return None;
    }
    // Opposite angles are the same direction, so the angle is doubled.
    let sum = trails.iter().fold([0.0, 0.0], |[x, y], bar| {
        let (sin, cos) = libm::sincos(2.0 * bar.angle_rad);
        [x + cos, y + sin]
    });
    if libm::hypot(sum[0], sum[1]) < ALIGNMENT * count as f64 {
        return None;
    }
    let lengths_px = trails.iter().map(|bar| bar.length_px);
    Some(Diagnosis::Trails {
        trails: count,
        angle_rad: libm::atan2(sum[1], sum[0]) / 2.0,
        length_px: median_of(lengths_px)?,
    })
}

/// The regions of the brightest sources, as pixel indices; a region with several sources counts
/// once.
fn areas(frame: &Frame, above: &[f32], detections: &Detections) -> Vec<Vec<usize>> {
    let noise = detections.noise_adu as f32;
    let mut taken = HashSet::new();
    let mut areas = Vec::new();
    for source in detections.sources.iter().take(LOOKED_AT) {
        let Some(start) = brightest_near(frame, above, source) else {
            continue;
        };
        if taken.contains(&start) {
            continue;
        }
        let threshold = (PEAK_FRACTION * above[start]).max(NOISE_SIGMA * noise);
        let area = connected(frame, above, start, threshold);
        taken.extend(area.iter().copied());
        if area.len() >= MIN_PX {
            areas.push(area);
        }
    }
    areas
}

/// The brightest pixel in the 3 × 3 pixels around a source.
fn brightest_near(frame: &Frame, above: &[f32], source: &Detection) -> Option<usize> {
    let (x, y) = (source.position.x.round(), source.position.y.round());
    let around = |at: f64, count: usize| {
        let last = count as f64 - 1.0;
        (at - 1.0).clamp(0.0, last) as usize..=(at + 1.0).clamp(0.0, last) as usize
    };
    around(y, frame.height)
        .flat_map(|row| around(x, frame.width).map(move |column| row * frame.width + column))
        .filter(|&i| above[i] > 0.0)
        .max_by(|&i, &j| above[i].total_cmp(&above[j]))
}

/// The 8-connected pixels above `threshold` around `start`, as indices. A region of more than
/// [`MAX_PX`] may be incomplete.
fn connected(frame: &Frame, above: &[f32], start: usize, threshold: f32) -> Vec<usize> {
    let (x, y) = ((start % frame.width) as i32, (start / frame.width) as i32);
    let whole = Rect::at(0, 0).of_size(frame.width as u32, frame.height as u32);
    let around = |reach: u32| {
        let corner = Rect::at(x - reach as i32, y - reach as i32);
        corner.of_size(2 * reach + 1, 2 * reach + 1)
    };
    let mut reach = FIRST_REACH;
    loop {
        let window = around(reach)
            .intersect(whole)
            .expect("a pixel of the frame");
        let (left, top) = (window.left() as u32, window.top() as u32);
        let index = |x: u32, y: u32| (top + y) as usize * frame.width + (left + x) as usize;
        let mask = GrayImage::from_fn(window.width(), window.height(), |x, y| {
            Luma([u8::from(above[index(x, y)] > threshold)])
        });
        let labels = connected_components(&mask, Connectivity::Eight, Luma([0]));
        let label = labels.get_pixel(x as u32 - left, y as u32 - top);
        let region = labels.enumerate_pixels().filter(|(_, _, l)| *l == label);
        let region: Vec<usize> = region.map(|(x, y, _)| index(x, y)).collect();
        let inside = around(reach - 1);
        let is_inside =
            |&i: &usize| inside.contains((i % frame.width) as i32, (i / frame.width) as i32);
        if region.len() > MAX_PX || region.iter().all(is_inside) {
            return region;
        }
        reach *= 4;
    }
}

/// The bar with the second moments of the region; `None` if it is too large for a star.
fn streak_profile(area: &[usize], width: usize) -> Option<SourceStreak> {
    if area.len() > MAX_PX {
        return None;
    }
    let count = area.len() as f64;
    let place = |i: &usize| [(i % width) as f64, (i / width) as f64];
    let sum = area
        .iter()
        .map(place)
        .fold([0.0, 0.0], |[x, y], p| [x + p[0], y + p[1]]);
    let mean = [sum[0] / count, sum[1] / count];
    // A pixel has a variance of its own.
    let (mut xx, mut yy, mut xy) = (count / 12.0, count / 12.0, 0.0);
    for [x, y] in area.iter().map(place) {
        let (dx, dy) = (x - mean[0], y - mean[1]);
        (xx, yy, xy) = (xx + dx * dx, yy + dy * dy, xy + dx * dy);
    }
    let (middle, half) = ((xx + yy) / 2.0, libm::hypot((xx - yy) / 2.0, xy));
    // A bar of length l has the variance l²/12 along it.
    let extent = |moment: f64| (12.0 * moment.max(0.0) / count).sqrt();
    Some(SourceStreak {
        // y points down; angles are counted as seen.
        angle_rad: -libm::atan2(2.0 * xy, xx - yy) / 2.0,
        length_px: extent(middle + half),
        breadth_px: extent(middle - half),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_bar_has_its_length_breadth_and_direction() {
        let width = 100;
        let area: Vec<usize> = (0..20)
            .flat_map(|x| [(50, x), (51, x)])
            .map(|(y, x)| y * width + x)
            .collect();
        let flat = streak_profile(&area, width).unwrap();
        assert!((flat.length_px - 20.0).abs() < 1e-9 && (flat.breadth_px - 2.0).abs() < 1e-9);
        assert!(flat.angle_rad.abs() < 1e-12 && flat.is_trail());
        let rising: Vec<usize> = (0..20).map(|i| (60 - i) * width + i).collect();
        let rising = streak_profile(&rising, width).unwrap();
        assert!((rising.angle_rad - std::f64::consts::FRAC_PI_4).abs() < 1e-9);
        let square: Vec<usize> = (0..25).map(|i| (i / 5) * width + i % 5).collect();
        assert!(!streak_profile(&square, width).unwrap().is_trail());
    }

    proptest! {
        #[test]
        fn an_area_is_the_region_that_imageproc_labels(
            width in 16..40_usize,
            pixels in prop::collection::vec(prop::bool::weighted(0.4), 640..1200),
        ) {
            let height = pixels.len() / width;
            let above: Vec<f32> = pixels.iter().map(|&p| f32::from(u8::from(p))).collect();
            let frame = Frame::new(width, height, above[..width * height].to_vec()).unwrap();
            let mask = GrayImage::from_fn(width as u32, height as u32, |x, y| {
                Luma([u8::from(pixels[y as usize * width + x as usize])])
            });
            let labels = connected_components(&mask, Connectivity::Eight, Luma([0])).into_raw();
            for start in (0..width * height).filter(|&i| pixels[i]) {
                let mut area = connected(&frame, &above, start, 0.5);
                area.sort_unstable();
                let expected: Vec<usize> =
                    (0..labels.len()).filter(|&i| labels[i] == labels[start]).collect();
                prop_assert_eq!(area, expected);
            }
        }
    }
}
