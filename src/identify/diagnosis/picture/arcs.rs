//! Star trails: arcs about one point, the celestial pole, or parallel lines where the pole is far.

use super::light::Light;
use super::shapes::Shape;
use crate::base::statistics::{log10_binomial_tail, median_of};
use crate::identify::diagnosis::cause::Diagnosis;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Smaller regions tell nothing, in pixels.
const MIN_AREA_PX: f64 = 15.0;
/// A trail is so long, in pixels, and so much longer than broad, …
const SHORTEST_PX: f64 = 9.0;
const ELONGATION: f64 = 2.5;
/// … and its stroke is as thin as a star.
const SLIM: f64 = 3.0;
const THICKEST_PX: f64 = 9.0;
/// Shorter ones than this share of the longest are left out.
const SHORT: f64 = 0.25;
/// Fewest trails, and their smallest share of the regions.
const MIN_TRAILS: usize = 6;
const SHARE: f64 = 0.55;
/// The same of arcs about one point, which nothing else is.
const SHARE_ABOUT_POLE: f64 = 0.2;
/// So many of the longest trails propose poles.
const PROPOSING: usize = 36;
/// How far a trail may be from the direction that it has about a pole, in radians, and for a pixel at its ends.
const TOLERANCE_RAD: f64 = 0.06;
const TOLERANCE_PX: f64 = 1.0;
/// Share of the trails that run about the pole, and log10 of the greatest probability that as many do by chance.
const AGREEING: f64 = 0.4;
const LOG10_CHANCE: f64 = -6.0;
/// All stars turn by one angle: the median difference from it, as a share.
const SPREAD: f64 = 0.2;
/// The mean of unit vectors at twice the angles of trails that are parallel: a pole is no longer told then.
const PARALLEL: f64 = 0.985;

/// Arcs about one point, or parallel trails; `None` where most of what stands out is something else.
pub(super) fn find(light: &Light) -> Option<Diagnosis> {
    let regions = light.spots();
    let telling = || regions.iter().filter(|shape| shape.area() >= MIN_AREA_PX);
    let count = telling().count();
    let mut trails: Vec<&Shape> = telling().filter(|shape| is_trail(shape)).collect();
    let is_share = |share: f64| trails.len() as f64 > share * count as f64;
    if trails.len() < MIN_TRAILS || !is_share(SHARE_ABOUT_POLE) {
        return None;
    }
    let are_most = is_share(SHARE);
    trails.sort_by(|a, b| b.length.total_cmp(&a.length));
    // Blocks of JPEG files are short, and in any direction.
    let least = SHORT * trails[MIN_TRAILS - 1].length;
    trails.retain(|trail| trail.length > least);
    about_a_pole(&trails, light).or_else(|| are_most.then(|| parallel(&trails, light)).flatten())
}

fn is_trail(shape: &Shape) -> bool {
    shape.length > SHORTEST_PX
        && shape.length > ELONGATION * shape.breadth
        && shape.extent() > SLIM * shape.thickness()
        && shape.thickness() < THICKEST_PX
}

fn alignment(trails: &[&Shape]) -> (f64, f64) {
    let sum = trails.iter().fold([0.0, 0.0], |[x, y], trail| {
        let (sin, cos) = libm::sincos(2.0 * trail.angle_rad);
        [x + cos, y + sin]
    });
    let share = libm::hypot(sum[0], sum[1]) / trails.len() as f64;
    (share, libm::atan2(sum[1], sum[0]) / 2.0)
}

fn parallel(trails: &[&Shape], light: &Light) -> Option<Diagnosis> {
    const ALIGNED: f64 = 0.9;
    // Lines from border to border are of the detector, or of a frame around the picture.
    let is_whole = |trail: &&&Shape| !trail.touches(light.frame.width, light.frame.height);
    let whole: Vec<&Shape> = trails.iter().filter(is_whole).copied().collect();
    if whole.len() < MIN_TRAILS {
        return None;
    }
    let (share, angle_rad) = alignment(&whole);
    let length = median_of(whole.iter().map(|trail| trail.length))?;
    (share > ALIGNED).then_some(Diagnosis::Trails {
        trails: trails.len(),
        // y points down; angles are counted as seen.
        angle_rad: -angle_rad,
        length_px: length * light.factor as f64,
    })
}

/// Trails that run about one point. It is near enough to be told where they are not parallel.
fn about_a_pole(trails: &[&Shape], light: &Light) -> Option<Diagnosis> {
    if alignment(trails).0 > PARALLEL {
        return None;
    }
    let proposing = &trails[..trails.len().min(PROPOSING)];
    let mut best: Option<(usize, [f64; 2])> = None;
    for (index, first) in proposing.iter().enumerate() {
        for second in &proposing[index + 1..] {
            let Some(pole) = pole_of([*first, *second].into_iter()) else {
                continue;
            };
            let agreeing = trails
                .iter()
                .filter(|trail| runs_about(trail, pole))
                .count();
            if best.is_none_or(|(most, _)| agreeing > most) {
                best = Some((agreeing, pole));
            }
        }
    }
    let (_, mut pole) = best?;
    for _ in 0..3 {
        pole = pole_of(
            trails
                .iter()
                .copied()
                .filter(|trail| runs_about(trail, pole)),
        )?;
    }
    let agreeing: Vec<&Shape> = trails
        .iter()
        .copied()
        .filter(|trail| runs_about(trail, pole))
        .collect();
    let is_enough = agreeing.len() >= MIN_TRAILS
        && agreeing.len() as f64 >= AGREEING * trails.len() as f64
        && is_near(pole, light)
        && log10_chance(trails, agreeing.len()) < LOG10_CHANCE;
    let turn_rad = is_enough
        .then(|| turn_rad(&agreeing, pole, light))
        .flatten()?;
    Some(Diagnosis::StarTrails {
        trails: agreeing.len(),
        turn_rad,
        center_px: pole.map(|at| (at + 0.5) * light.factor as f64 - 0.5),
    })
}

/// The point that is nearest to the lines across these trails, in units of their lengths.
fn pole_of<'a>(trails: impl Iterator<Item = &'a Shape>) -> Option<[f64; 2]> {
    let (mut xx, mut xy, mut yy, mut x, mut y) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for trail in trails {
        let (sin, cos) = libm::sincos(trail.angle_rad);
        let along = cos * trail.middle[0] + sin * trail.middle[1];
        (xx, xy, yy) = (xx + cos * cos, xy + cos * sin, yy + sin * sin);
        (x, y) = (x + cos * along, y + sin * along);
    }
    let determinant = xx * yy - xy * xy;
    (determinant > 1e-4 * (xx + yy).powi(2)).then(|| {
        [
            (yy * x - xy * y) / determinant,
            (xx * y - xy * x) / determinant,
        ]
    })
}

/// Whether a trail is at a right angle to the line from the pole to its middle.
fn runs_about(trail: &Shape, pole: [f64; 2]) -> bool {
    let [dx, dy] = [trail.middle[0] - pole[0], trail.middle[1] - pole[1]];
    let radial = libm::atan2(dy, dx) + FRAC_PI_2 - trail.angle_rad;
    let off = radial - PI * (radial / PI).round();
    off.abs() < tolerance_rad(trail)
}

/// Whether the pole is near enough to be told from trails in one direction.
fn is_near(pole: [f64; 2], light: &Light) -> bool {
    /// Distance from the middle, in diagonals of the picture.
    const FAR: f64 = 3.0;
    let (width, height) = (light.frame.width as f64, light.frame.height as f64);
    let away = libm::hypot(pole[0] - width / 2.0, pole[1] - height / 2.0);
    away < FAR * libm::hypot(width, height)
}

/// log10 of the probability that of trails in random directions as many run about one of the proposed poles.
fn log10_chance(trails: &[&Shape], agreeing: usize) -> f64 {
    let tolerances = trails.iter().map(|trail| tolerance_rad(trail));
    let chance = tolerances.sum::<f64>() / trails.len() as f64 / FRAC_PI_2;
    let proposals = trails.len().min(PROPOSING).pow(2) as f64 / 2.0;
    libm::log10(proposals) + log10_binomial_tail(trails.len(), agreeing, chance.min(1.0))
}

fn tolerance_rad(trail: &Shape) -> f64 {
    TOLERANCE_RAD + TOLERANCE_PX / trail.length
}

/// How far the sky turned: the angle that most of the longer trails have at the pole. Trails that the border cuts
/// are shorter.
fn turn_rad(trails: &[&Shape], pole: [f64; 2], light: &Light) -> Option<f64> {
    let (width, height) = (light.frame.width, light.frame.height);
    let whole = || trails.iter().filter(|trail| !trail.touches(width, height));
    let longer = whole().count().div_ceil(2).max(3);
    let longer = whole().take(longer);
    let spans: Vec<f64> = longer
        .filter_map(|trail| span_rad(trail, pole, width))
        .collect();
    let turn_rad = median_of(spans.iter().copied())?;
    let spread = median_of(spans.iter().map(|span| (span - turn_rad).abs()))?;
    (turn_rad > 0.0 && spread < SPREAD * turn_rad).then_some(turn_rad)
}

/// The angle of an arc at the pole: the circle without the largest gap between its pixels.
fn span_rad(trail: &Shape, pole: [f64; 2], width: usize) -> Option<f64> {
    let mut angles: Vec<f64> = Vec::with_capacity(trail.pixels.len());
    let mut radius = 0.0;
    for &index in &trail.pixels {
        let index = index as usize;
        let [dx, dy] = [
            (index % width) as f64 - pole[0],
            (index / width) as f64 - pole[1],
        ];
        angles.push(libm::atan2(dy, dx));
        radius += libm::hypot(dx, dy) / trail.area();
    }
    angles.sort_by(f64::total_cmp);
    let around = TAU + angles.first()? - angles.last()?;
    let gaps = angles.windows(2).map(|pair| pair[1] - pair[0]);
    let gap = gaps.fold(around, f64::max);
    // The ends are round.
    Some(TAU - gap - trail.thickness() / radius)
}
