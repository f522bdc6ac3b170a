//! Seams: lines from border to border at which the level jumps, as between pictures put side by side.

use super::light::Light;
use crate::base::statistics::median;

/// Pixels along a seam that are averaged: noise is less, and a seam is straight.
const ALONG_PX: usize = 16;
/// A jump is so many standard deviations of what is between neighbors elsewhere.
const JUMP_SIGMA: f32 = 6.0;
const SIGMA_PER_STEP: f32 = 1.048;
/// A jump is more than so many steps of levels, and than this share of the sky: JPEG files have small ones.
const LEAST_STEPS: f32 = 3.5;
const LEAST_SHARE: f32 = 0.03;
/// A seam jumps along at least this share of its length.
const SHARE: f64 = 0.4;
/// A seam is so far from the border, as a share of the side: nearer ones are of a frame around the picture.
const FROM_BORDER: f64 = 0.1;
/// Seams so near to each other are the two sides of one bar, as a share of the side.
const BAR: f64 = 0.04;
/// Most parts on a side.
const MOST: usize = 12;
/// How uneven parallel seams may stand, as a share of the side.
const UNEVEN: f64 = 0.03;

/// How many pictures stand side by side and one below the other, at least; `None` where it is one.
///
/// One seam may be a wall or the sea. Seams that cross, or several at even distances, are put together.
pub(super) fn parts(light: &Light) -> Option<[usize; 2]> {
    let values = light.frame.values();
    let (width, height) = (light.frame.width, light.frame.height);
    let least = LEAST_STEPS * light.step + LEAST_SHARE * (light.sky - light.lowest.min(0.0));
    let upright = Axis {
        across: width,
        along: height,
        strides: [1, width],
    };
    let level = Axis {
        across: height,
        along: width,
        strides: [width, 1],
    };
    let [upright, level] = [upright, level].map(|axis| axis.seams(&values, least));
    let is_put_together = !upright.is_empty() && !level.is_empty()
        || upright.len().max(level.len()) >= 2 && [&upright, &level].iter().all(|s| are_even(s));
    let is_possible = upright.len().max(level.len()) < MOST;
    (is_put_together && is_possible).then(|| [upright.len() + 1, level.len() + 1])
}

/// The direction across seams, and that along them.
struct Axis {
    across: usize,
    along: usize,
    /// From one pixel to the next, across and along.
    strides: [usize; 2],
}

impl Axis {
    /// Where seams are, as shares of the side.
    fn seams(&self, values: &[f32], least: f32) -> Vec<f64> {
        let blocks = self.along / ALONG_PX;
        if blocks < 4 {
            return Vec::new();
        }
        let means: Vec<f32> = (0..blocks)
            .flat_map(|block| self.means(values, block))
            .collect();
        let row = |block: usize| &means[block * self.across..(block + 1) * self.across];
        let mut steps: Vec<f32> = means
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).abs())
            .collect();
        let usual = SIGMA_PER_STEP * median(&mut steps);
        let least = least.max(JUMP_SIGMA * usual);
        let share = |is: &dyn Fn(&[f32]) -> bool| {
            (0..blocks).filter(|&block| is(row(block))).count() as f64 / blocks as f64
        };
        let first = (FROM_BORDER * self.across as f64) as usize;
        let jumps = |x: &usize| share(&|row| is_jump(row, *x, least)) > SHARE;
        let places: Vec<usize> = (first.max(1)..self.across - first).filter(jumps).collect();
        let sides = |[from, to]: &[usize; 2]| {
            share(&|row| (side(row, *to, 1) - side(row, *from - 1, -1)).abs() > least) > SHARE
        };
        let bar = (BAR * self.across as f64) as usize;
        let seams = joined(&places, bar).into_iter().filter(|ends| sides(ends));
        seams
            .map(|[from, to]| (from + to) as f64 / 2.0 / self.across as f64)
            .collect()
    }

    /// The means of a block of pixels along the seams, across them.
    fn means(&self, values: &[f32], block: usize) -> Vec<f32> {
        let along = block * ALONG_PX..(block + 1) * ALONG_PX;
        let value = |x: usize, y: usize| values[x * self.strides[0] + y * self.strides[1]];
        let mut means = vec![0.0; self.across];
        // Pixels beside each other in memory come one after the other.
        if self.strides[0] == 1 {
            for y in along {
                for (x, mean) in means.iter_mut().enumerate() {
                    *mean += value(x, y);
                }
            }
        } else {
            for (x, mean) in means.iter_mut().enumerate() {
                *mean = along.clone().map(|y| value(x, y)).sum();
            }
        }
        means.iter_mut().for_each(|mean| *mean /= ALONG_PX as f32);
        means
    }
}

/// Whether the level jumps between a pixel and the one before it, and hardly elsewhere around: texture and the blocks
/// of JPEG files have many jumps.
fn is_jump(row: &[f32], x: usize, least: f32) -> bool {
    /// Places on either side.
    const AROUND: usize = 20;
    /// So many others may be as high: a bar between pictures has two sides.
    const OTHERS: usize = 3;
    let height = |x: usize| (row[x] - row[x - 1]).abs();
    let jump = height(x);
    if jump <= least {
        return false;
    }
    let around = x.saturating_sub(AROUND).max(1)..(x + AROUND).min(row.len());
    around.filter(|&other| height(other) > 0.5 * jump).count() <= OTHERS
}

/// The level on one side of a seam: the median of several blocks of a JPEG file.
fn side(row: &[f32], at: usize, direction: isize) -> f32 {
    const PX: isize = 28;
    let places = (0..PX).filter_map(|step| at.checked_add_signed(direction * step));
    let levels = places.filter_map(|place| row.get(place).copied());
    median(&mut levels.collect::<Vec<_>>())
}

/// Jumps that are near to each other as one seam, from its first to its last.
fn joined(places: &[usize], bar: usize) -> Vec<[usize; 2]> {
    let mut joined: Vec<[usize; 2]> = Vec::new();
    for &place in places {
        match joined.last_mut() {
            Some([_, last]) if place - *last <= bar => *last = place,
            _ => joined.push([place, place]),
        }
    }
    joined
}

fn are_even(seams: &[f64]) -> bool {
    let parts = seams.len() as f64 + 1.0;
    let expected = (1..).map(|number| f64::from(number) / parts);
    seams
        .iter()
        .zip(expected)
        .all(|(seam, even)| (seam - even).abs() < UNEVEN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Frame;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn found(level: impl Fn(usize, usize) -> f64) -> Option<[usize; 2]> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let pixel = |index: usize| {
            let noise = random.random_range(-3.0..3.0);
            (level(index % 480, index / 480) + noise).round() as f32
        };
        let frame = Frame::new(480, 320, (0..480 * 320).map(pixel).collect()).unwrap();
        parts(&Light::of(&frame.with_levels(1.0, Some(255.0))))
    }

    #[test]
    fn pictures_side_by_side_are_counted() {
        let quarters = |x: usize, y: usize| {
            20.0 + 8.0 * f64::from(u8::from(x >= 200) + 2 * u8::from(y >= 170))
        };
        assert_eq!(found(quarters), Some([2, 2]));
        // A bar divides them.
        let barred = |x: usize, y: usize| {
            if x.abs_diff(200) < 4 {
                200.0
            } else {
                quarters(x, y)
            }
        };
        assert_eq!(found(barred), Some([2, 2]));
        let strip = |x: usize, _: usize| 20.0 + 10.0 * ((x / 160) % 2) as f64;
        assert_eq!(found(strip), Some([3, 1]));
    }

    #[test]
    fn a_roof_a_frame_and_a_grid_are_no_seams() {
        assert_eq!(found(|_, y| if y > 150 { 60.0 } else { 20.0 }), None);
        let border = |x: usize, y: usize| !(20..460).contains(&x) || !(15..305).contains(&y);
        assert_eq!(found(|x, y| if border(x, y) { 0.0 } else { 30.0 }), None);
        assert_eq!(
            found(|x, y| if x % 80 == 0 || y % 80 == 0 {
                90.0
            } else {
                20.0
            }),
            None
        );
        assert_eq!(found(|x, y| 20.0 + 0.1 * (x + y) as f64), None);
    }
}
