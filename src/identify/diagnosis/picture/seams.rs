//! Seams: lines from border to border at which the level jumps, as between pictures put side by side.

use super::light::Light;
use crate::base::statistics::median;

/// Pixels along a seam that are averaged: noise is less, and a seam is straight.
const ALONG_PX: usize = 16;
/// A jump is so many standard deviations of what is between neighbors elsewhere.
const JUMP_SIGMA: f32 = 6.0;
/// A seam jumps along at least this share of its length.
const SHARE: f64 = 0.6;
/// A seam is so far from the border, as a share of the side: nearer ones are of a frame around the picture.
const FROM_BORDER: f64 = 0.1;
/// Seams so near to each other are the two sides of one bar, as a share of the side.
const BAR: f64 = 0.04;
/// Most parts on a side.
const MOST: usize = 12;
/// How uneven parallel seams may stand, as a share of the side.
const UNEVEN: f64 = 0.03;

/// How many pictures stand side by side and one below the other; `None` where it is one.
///
/// One seam may be a wall or the sea. Seams that cross, or several at even distances, are put together.
pub(super) fn parts(light: &Light) -> Option<[usize; 2]> {
    let (width, height) = (light.frame.width, light.frame.height);
    let at = |x: usize, y: usize| light.frame.at(x, y);
    let upright = seams([width, height], &at);
    let level = seams([height, width], &|y, x| at(x, y));
    let is_put_together = !upright.is_empty() && !level.is_empty()
        || upright.len().max(level.len()) >= 2 && [&upright, &level].iter().all(|s| are_even(s));
    let is_possible = upright.len().max(level.len()) < MOST;
    (is_put_together && is_possible).then(|| [upright.len() + 1, level.len() + 1])
}

/// Where seams cross the first of two axes, as shares of it.
fn seams([across, along]: [usize; 2], at: &dyn Fn(usize, usize) -> f32) -> Vec<f64> {
    let blocks = along / ALONG_PX;
    if blocks < 4 {
        return Vec::new();
    }
    let mut steps = vec![0.0_f32; blocks * (across - 1)];
    for (block, steps) in steps.chunks_mut(across - 1).enumerate() {
        let rows = block * ALONG_PX..(block + 1) * ALONG_PX;
        for (x, step) in steps.iter_mut().enumerate() {
            let sum: f32 = rows.clone().map(|y| at(x + 1, y) - at(x, y)).sum();
            *step = (sum / ALONG_PX as f32).abs();
        }
    }
    let usual = 1.48 * median(&mut steps.clone());
    let least = (JUMP_SIGMA * usual).max(f32::MIN_POSITIVE);
    let jumps = |x: usize| {
        let count = (0..blocks)
            .filter(|block| steps[block * (across - 1) + x] > least)
            .count();
        count as f64 / blocks as f64
    };
    let first = (FROM_BORDER * across as f64) as usize;
    let found = (first..across - 1 - first).filter(|&x| jumps(x) > SHARE);
    joined(found.map(|x| (x as f64 + 1.0) / across as f64))
}

/// Seams that are near to each other as one.
fn joined(places: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut joined: Vec<[f64; 2]> = Vec::new();
    for place in places {
        match joined.last_mut() {
            Some([_, last]) if place - *last < BAR => *last = place,
            _ => joined.push([place, place]),
        }
    }
    joined
        .iter()
        .map(|[first, last]| (first + last) / 2.0)
        .collect()
}

fn are_even(seams: &[f64]) -> bool {
    let parts = seams.len() as f64 + 1.0;
    let expected = (1..).map(|number| f64::from(number) / parts);
    seams
        .iter()
        .zip(expected)
        .all(|(seam, even)| (seam - even).abs() < UNEVEN)
}
