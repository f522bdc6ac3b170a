//! What stands before the sky: foliage, roofs, wires, reflections.

use super::canvas::ClutterCanvas;
use super::chance::{log_uniform, normal, place};
use crate::base::coords::PixelPoint;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Branches with leaves that grow from the borders until they hide a part of the frame.
pub(super) fn foliage(canvas: &mut ClutterCanvas, random: &mut ChaCha8Rng) {
    /// Branches after which growth ends.
    const MAX_BRANCHES: usize = 80;
    let wanted = random.random_range(0.08..0.45);
    // Dark against the sky, or lit by lamps.
    let tone = if random.random_bool(0.5) {
        -log_uniform(random, 3.0, 30.0)
    } else {
        log_uniform(random, 5.0, 150.0)
    };
    let leaf_px = log_uniform(random, 3.0, 14.0);
    for _ in 0..MAX_BRANCHES {
        if canvas.covered() >= wanted {
            break;
        }
        branch(canvas, leaf_px, tone, random);
    }
}

fn branch(canvas: &mut ClutterCanvas, leaf_px: f64, tone: f64, random: &mut ChaCha8Rng) {
    const STEP_PX: f64 = 6.0;
    const LEAVES_A_STEP: usize = 3;
    let (width, height) = (canvas.width as f64, canvas.height as f64);
    // From a border, towards somewhere on the frame.
    let mut at = match random.random_range(0..4) {
        0 => PixelPoint::new(0.0, random.random_range(0.0..height)),
        1 => PixelPoint::new(width, random.random_range(0.0..height)),
        2 => PixelPoint::new(random.random_range(0.0..width), 0.0),
        _ => PixelPoint::new(random.random_range(0.0..width), height),
    };
    let aim = place(canvas, random);
    let mut heading = libm::atan2(aim.y - at.y, aim.x - at.x);
    let steps = random.random_range(15..70);
    let root_px = log_uniform(random, 1.5, 8.0);
    for step in 0..steps {
        let width_px = root_px * (1.0 - 0.8 * f64::from(step) / f64::from(steps));
        heading += 0.15 * normal(random);
        let (sin, cos) = libm::sincos(heading);
        let next = PixelPoint::new(at.x + STEP_PX * cos, at.y + STEP_PX * sin);
        canvas.line(&at, &next, width_px, 0.6 * tone);
        for _ in 0..LEAVES_A_STEP {
            let leaf = PixelPoint::new(
                next.x + 2.0 * leaf_px * normal(random),
                next.y + 2.0 * leaf_px * normal(random),
            );
            let long = leaf_px * random.random_range(0.5..1.3);
            let axes_px = [long, long * random.random_range(0.3..0.6)];
            let light = tone * random.random_range(0.3..1.4);
            canvas.ellipse(&leaf, axes_px, random.random_range(0.0..TAU), light);
        }
        at = next;
    }
}

/// Roofs along a side of the frame, walls with windows, masts and wires.
pub(super) fn roofs(canvas: &mut ClutterCanvas, random: &mut ChaCha8Rng) {
    let (width, height) = (canvas.width as f64, canvas.height as f64);
    let tone = if random.random_bool(0.5) {
        -log_uniform(random, 3.0, 30.0)
    } else {
        log_uniform(random, 3.0, 200.0)
    };
    let texture = random.random_range(0.0..0.3);
    let mean_row = height * random.random_range(0.55..0.9);
    let mut left = 0.0;
    while left < width {
        let house_px = random.random_range(0.08..0.3) * width;
        let top = mean_row + 0.06 * height * normal(random);
        let slope = random.random_range(0.0..0.8);
        let middle = left + house_px / 2.0;
        let brick = random.random_range(2.0..9.0);
        let (right, light) = (left + house_px, tone * random.random_range(0.5..1.2));
        canvas.below(
            [left, right],
            |x| top + slope * (x - middle).abs(),
            |point| {
                let course = ((point.x / brick) as i64 + (point.y / brick) as i64) % 2;
                light * (1.0 + texture * course as f64)
            },
        );
        windows(canvas, [left, right], top + slope * house_px / 2.0, random);
        mast(canvas, &PixelPoint::new(middle, top), tone, random);
        left = right;
    }
    wires(canvas, tone, random);
}

/// Some lit windows on a wall between two columns, below a row.
fn windows(canvas: &mut ClutterCanvas, [left, right]: [f64; 2], top: f64, random: &mut ChaCha8Rng) {
    let side = log_uniform(random, 3.0, 18.0);
    let lit = random.random_range(0.05..0.5);
    let mut y = top + side;
    while y + side < canvas.height as f64 {
        let mut x = left + side;
        while x + side < right {
            if random.random_bool(lit) {
                let high = PixelPoint::new(x + side, y + 1.3 * side);
                let light = log_uniform(random, 20.0, 2000.0);
                canvas.rectangle(&PixelPoint::new(x, y), &high, light);
            }
            x += 2.2 * side;
        }
        y += 3.0 * side;
    }
}

fn mast(canvas: &mut ClutterCanvas, foot: &PixelPoint, tone: f64, random: &mut ChaCha8Rng) {
    let length = random.random_range(10.0..90.0);
    let top = PixelPoint::new(foot.x, foot.y - length);
    canvas.line(foot, &top, random.random_range(0.7..3.0), tone);
    for _ in 0..random.random_range(0..5) {
        let y = top.y + random.random_range(0.0..0.4) * length;
        let half = random.random_range(3.0..14.0);
        let ends = [-half, half].map(|dx| PixelPoint::new(top.x + dx, y));
        canvas.line(&ends[0], &ends[1], 1.0, tone);
    }
}

/// Wires across the frame that sag a little.
fn wires(canvas: &mut ClutterCanvas, tone: f64, random: &mut ChaCha8Rng) {
    const PARTS: usize = 24;
    let (width, height) = (canvas.width as f64, canvas.height as f64);
    for _ in 0..random.random_range(0..5) {
        let ends = [0, 1].map(|_| random.random_range(0.0..0.8) * height);
        let sag = random.random_range(0.0..0.1) * height;
        let thick = random.random_range(0.6..2.5);
        let at = |part: usize| {
            let share = part as f64 / PARTS as f64;
            let straight = ends[0] + share * (ends[1] - ends[0]);
            PixelPoint::new(share * width, straight + 4.0 * sag * share * (1.0 - share))
        };
        for part in 0..PARTS {
            canvas.line(&at(part), &at(part + 1), thick, tone);
        }
    }
}

/// Ghosts of lamps in the lens along a line through the centre, and specks of light.
pub(super) fn ghosts(canvas: &mut ClutterCanvas, random: &mut ChaCha8Rng) {
    let centre = PixelPoint::new(canvas.width as f64 / 2.0, canvas.height as f64 / 2.0);
    let lamp = place(canvas, random);
    for _ in 0..random.random_range(2..12) {
        let share = random.random_range(-1.2..1.2);
        let at = PixelPoint::new(
            centre.x + share * (lamp.x - centre.x),
            centre.y + share * (lamp.y - centre.y),
        );
        let radius_px = log_uniform(random, 2.0, 80.0);
        let soft_px = random.random_range(1.0..3.0);
        let rim = random.random_range(0.0..1.5);
        let light = log_uniform(random, 1.0, 40.0);
        canvas.disc_of_light(&at, radius_px, soft_px, rim, light);
    }
    let sigma_px = log_uniform(random, 0.6, 1.8);
    for _ in 0..random.random_range(5..80) {
        let at = place(canvas, random);
        canvas.spot(&at, sigma_px, log_uniform(random, 5.0, 500.0));
    }
}
