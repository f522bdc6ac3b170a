//! Repeated skies: detections without a name that form the pattern of named ones once more, as in a collage,
//! a mirrored picture, or one of which a part was copied.
//!
//! Two named stars and two unnamed detections make a similarity, turned over or not. The other named stars
//! are looked for where it has them. The probability that chance has as many there decides.

use crate::base::coords::PixelPoint;
use crate::identify::{ObservedStar, StarField};
use nalgebra::Complex;
use std::fmt;

/// Number of stars examined, the brightest.
const LOOKED_AT: usize = 60;
/// Each star makes pairs with so many near ones.
const NEIGHBORS: usize = 4;
/// Nearer stars make no pair, as a share of the frame's width: they would tell scale and angle badly.
const MIN_APART: f64 = 0.02;
/// Scales that are looked for.
const SCALES: std::ops::Range<f64> = 0.4..2.5;
/// How far a star may be from where it is expected, in pixels, …
const TOLERANCE_PX: f64 = 1.5;
/// … and beside it, for each pixel of distance from the pair.
const TOLERANCE_PER_PX: f64 = 0.004;
/// How far its magnitude may be off.
const TOLERANCE_MAG: f64 = 0.5;
/// Fewest stars that tell, besides the pair.
const MIN_STARS: usize = 5;
/// log10 of the greatest probability that chance gives as good a pattern.
const LOG10_CHANCE: f64 = -6.0;
/// Detections this near to each other, in pixels, tell how dense they are where they are dense.
const DENSE_PX: f64 = 40.0;

/// The stars of a frame stand in it once more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RepeatedSky {
    /// Bright named stars that are there once more.
    pub stars: usize,
    /// The middle of these, …
    pub middle_px: [f64; 2],
    /// … and that of their copies, x and y.
    pub copy_px: [f64; 2],
    /// Size of the copy over that of the original.
    pub scale: f64,
    /// Whether the copy is turned over.
    pub is_mirrored: bool,
}

impl fmt::Display for RepeatedSky {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([x, y], [u, v]) = (self.middle_px, self.copy_px);
        let how = if self.is_mirrored { ", mirrored," } else { "" };
        write!(
            f,
            "the same stars appear in the picture more than once, as in a collage: {} of the bright stars \
             around ({x:.0}, {y:.0}) appear again{how} around ({u:.0}, {v:.0}); the result is for one part \
             of the picture only",
            self.stars
        )
    }
}

/// Whether many named stars of a field stand in it once more, as detections without a name.
pub fn find(field: &StarField, is_named: impl Fn(&ObservedStar) -> bool) -> Option<RepeatedSky> {
    let bright = field.stars.iter().take(LOOKED_AT);
    let (named, mut unnamed): (Vec<&ObservedStar>, Vec<&ObservedStar>) =
        bright.partition(|star| is_named(star));
    if named.len().min(unnamed.len()) < MIN_STARS + 2 {
        return None;
    }
    unnamed.sort_by(|a, b| a.position.x.total_cmp(&b.position.x));
    let least_px = MIN_APART * field.width_px;
    let [originals, copies] = [&named, &unnamed].map(|stars| pairs(stars, least_px));
    let density = density(&unnamed, field.width_px * field.height_px);
    let hypotheses = (2 * originals.len() * copies.len()) as f64;
    let search = RepeatSearch {
        field,
        named: &named,
        unnamed: &unnamed,
    };
    let mut best: Option<(f64, RepeatedSky)> = None;
    for original in &originals {
        for copy in copies.iter().filter(|copy| copy.is_like(original)) {
            for is_mirrored in [false, true] {
                let map = Map::new(original, copy, is_mirrored);
                let Some((looked_for, repeated)) = search.test(&map) else {
                    continue;
                };
                let others = repeated.stars - 2;
                let log10_chance = libm::log10(hypotheses)
                    + log10_tail(looked_for, others, density * map.tolerance_px2(field));
                if best.is_none_or(|(least, _)| log10_chance < least) {
                    best = Some((log10_chance, repeated));
                }
            }
        }
    }
    best.filter(|(log10_chance, _)| *log10_chance < LOG10_CHANCE)
        .map(|(_, repeated)| repeated)
}

/// The place of a star as a complex number.
fn place(star: &ObservedStar) -> Complex<f64> {
    Complex::new(star.position.x, star.position.y)
}

fn length(along: Complex<f64>) -> f64 {
    libm::hypot(along.re, along.im)
}

/// Two stars.
struct StarPair {
    from: Complex<f64>,
    along: Complex<f64>,
    mag: [f64; 2],
}

impl StarPair {
    /// Whether it can be a copy of the other pair.
    fn is_like(&self, other: &Self) -> bool {
        let step_mag = |pair: &Self| pair.mag[1] - pair.mag[0];
        (step_mag(self) - step_mag(other)).abs() < TOLERANCE_MAG
            && SCALES.contains(&(length(self.along) / length(other.along)))
    }
}

/// Each star with the nearest ones that are not too near.
fn pairs(stars: &[&ObservedStar], least_px: f64) -> Vec<StarPair> {
    let mut pairs = Vec::new();
    for star in stars {
        let pair = |other: &&ObservedStar| StarPair {
            from: place(star),
            along: place(other) - place(star),
            mag: [star.mag, other.mag],
        };
        let mut near: Vec<StarPair> = stars.iter().map(pair).collect();
        near.retain(|pair| length(pair.along) > least_px);
        near.sort_by(|a, b| length(a.along).total_cmp(&length(b.along)));
        pairs.extend(near.into_iter().take(NEIGHBORS));
    }
    pairs
}

/// A similarity of the picture's plane that takes one pair to another.
struct Map {
    factor: Complex<f64>,
    from: Complex<f64>,
    to: Complex<f64>,
    is_mirrored: bool,
    /// By how much the copies are fainter.
    fainter_mag: f64,
}

impl Map {
    fn new(original: &StarPair, copy: &StarPair, is_mirrored: bool) -> Self {
        let along = turned_over(original.along, is_mirrored);
        Self {
            factor: copy.along / along,
            from: original.from,
            to: copy.from,
            is_mirrored,
            fainter_mag: 0.5 * (copy.mag[0] - original.mag[0] + copy.mag[1] - original.mag[1]),
        }
    }

    fn apply(&self, place: Complex<f64>) -> Complex<f64> {
        self.to + self.factor * turned_over(place - self.from, self.is_mirrored)
    }

    fn tolerance_px(&self, mapped: Complex<f64>) -> f64 {
        TOLERANCE_PX + TOLERANCE_PER_PX * length(mapped - self.to)
    }

    /// The largest area in which a star may be.
    fn tolerance_px2(&self, field: &StarField) -> f64 {
        let diagonal_px = libm::hypot(field.width_px, field.height_px);
        let tolerance_px = TOLERANCE_PX + TOLERANCE_PER_PX * diagonal_px / 2.0;
        std::f64::consts::PI * tolerance_px * tolerance_px
    }
}

fn turned_over(along: Complex<f64>, is_mirrored: bool) -> Complex<f64> {
    if is_mirrored { along.conj() } else { along }
}

struct RepeatSearch<'a> {
    field: &'a StarField,
    named: &'a [&'a ObservedStar],
    /// From left to right.
    unnamed: &'a [&'a ObservedStar],
}

impl RepeatSearch<'_> {
    /// How many stars besides the pair a similarity takes to places in the frame, and what is there of
    /// them; `None` where it is too little.
    fn test(&self, map: &Map) -> Option<(usize, RepeatedSky)> {
        let (mut inside, mut stars) = (0_usize, 0_usize);
        let (mut middle, mut copy) = (Complex::default(), Complex::default());
        for star in self.named {
            let mapped = map.apply(place(star));
            if !self.is_inside(mapped) {
                continue;
            }
            inside += 1;
            if self.has_copy(star, mapped, map) {
                stars += 1;
                middle += place(star);
                copy += mapped;
            }
        }
        // The pair itself is there by its choice.
        let is_enough = stars >= MIN_STARS + 2;
        is_enough.then(|| {
            let mean = |sum: Complex<f64>| [sum.re, sum.im].map(|sum| sum / stars as f64);
            let repeated = RepeatedSky {
                stars,
                middle_px: mean(middle),
                copy_px: mean(copy),
                scale: length(map.factor),
                is_mirrored: map.is_mirrored,
            };
            (inside - 2, repeated)
        })
    }

    fn is_inside(&self, place: Complex<f64>) -> bool {
        (0.0..self.field.width_px).contains(&place.re)
            && (0.0..self.field.height_px).contains(&place.im)
    }

    fn has_copy(&self, star: &ObservedStar, mapped: Complex<f64>, map: &Map) -> bool {
        let tolerance_px = map.tolerance_px(mapped);
        let at = PixelPoint::new(mapped.re, mapped.im);
        let left = |other: &&ObservedStar| other.position.x < at.x - tolerance_px;
        let first = self.unnamed.partition_point(left);
        let near = self.unnamed[first..].iter();
        near.take_while(|other| other.position.x <= at.x + tolerance_px)
            .any(|other| {
                let fainter_mag = other.mag - star.mag - map.fainter_mag;
                other.position.distance_to(&at) < tolerance_px && fainter_mag.abs() < TOLERANCE_MAG
            })
    }
}

/// Detections in a square pixel: all over the frame, or where they are dense, whichever is more.
fn density(unnamed: &[&ObservedStar], area_px2: f64) -> f64 {
    let count = unnamed.len() as f64;
    let near = unnamed.iter().map(|star| {
        let is_near =
            |other: &&&ObservedStar| star.position.distance_to(&other.position) < DENSE_PX;
        unnamed.iter().filter(is_near).count() - 1
    });
    let others = near.sum::<usize>() as f64 / count;
    let dense = others / (std::f64::consts::PI * DENSE_PX * DENSE_PX);
    dense.max(count / area_px2)
}

/// log10 of a bound of the probability that of `tried` independent trials `hits` or more succeed, each with
/// this probability.
///
/// # Reference
/// Chernoff 1952, Ann. Math. Stat. 23, 493: (e n p / k)^k e^(−n p) for k above n p.
fn log10_tail(tried: usize, hits: usize, probability: f64) -> f64 {
    let expected = tried as f64 * probability;
    let hits = hits as f64;
    if hits <= expected {
        return 0.0;
    }
    let ln = hits * (1.0 + libm::log(expected / hits)) - expected;
    ln * std::f64::consts::LOG10_E
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ephemeris::places::StarPlaces;
    use crate::identify::{Photometry, SourceIndex};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const SIDE_PX: f64 = 400.0;

    /// Stars of one sky, from 0 to [`SIDE_PX`]: x, y, magnitude.
    fn sky(rng: &mut ChaCha8Rng, count: usize) -> Vec<[f64; 3]> {
        let star = |_| {
            let mag = 6.0 + 1.5 * libm::log10(rng.random_range(1e-3..1.0));
            [
                rng.random_range(0.0..SIDE_PX),
                rng.random_range(0.0..SIDE_PX),
                mag,
            ]
        };
        (0..count).map(star).collect()
    }

    /// What is found in a frame of twice the side with these stars, measured with errors, of which the first
    /// `named` have a name.
    fn found(rng: &mut ChaCha8Rng, stars: &[[f64; 3]], named: usize) -> Option<RepeatedSky> {
        let mut measured: Vec<ObservedStar> = stars
            .iter()
            .enumerate()
            .map(|(index, [x, y, mag])| ObservedStar {
                source: SourceIndex::new(index),
                position: PixelPoint::new(
                    x + rng.random_range(-0.3..0.3),
                    y + rng.random_range(-0.3..0.3),
                ),
                sigma_px: 0.2,
                mag: mag + rng.random_range(-0.1..0.1),
                is_saturated: false,
            })
            .collect();
        measured.sort_by(|a, b| a.mag.total_cmp(&b.mag));
        let field = StarField {
            width_px: 2.0 * SIDE_PX,
            height_px: 2.0 * SIDE_PX,
            photometry: Photometry::Instrumental,
            places: StarPlaces::default(),
            spot_sigma_px: None,
            sky_area: None,
            stars: measured,
        };
        find(&field, |star| star.source.get() < named)
    }

    fn with_copies(sky: &[[f64; 3]], copies: &[&dyn Fn([f64; 3]) -> [f64; 3]]) -> Vec<[f64; 3]> {
        let mut all = sky.to_vec();
        for copy in copies {
            all.extend(sky.iter().map(|star| copy(*star)));
        }
        all
    }

    #[test]
    fn a_collage_is_told() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..20 {
            let sky = sky(&mut rng, 40);
            let stars = with_copies(
                &sky,
                &[
                    &|[x, y, mag]| [x + SIDE_PX, y, mag],
                    &|[x, y, mag]| [x, y + SIDE_PX, mag],
                    &|[x, y, mag]| [x + SIDE_PX, y + SIDE_PX, mag],
                ],
            );
            let repeated = found(&mut rng, &stars, sky.len()).unwrap();
            assert!(!repeated.is_mirrored && repeated.stars >= 8, "{repeated:?}");
        }
    }

    #[test]
    fn mirrored_turned_and_smaller_copies_are_told() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for _ in 0..20 {
            let sky = sky(&mut rng, 30);
            let mirrored = with_copies(&sky, &[&|[x, y, mag]| [2.0 * SIDE_PX - x, y, mag]]);
            assert!(found(&mut rng, &mirrored, sky.len()).unwrap().is_mirrored);
            let turned = with_copies(
                &sky,
                &[&|[x, y, mag]| [2.0 * SIDE_PX - x, 2.0 * SIDE_PX - y, mag]],
            );
            assert!(!found(&mut rng, &turned, sky.len()).unwrap().is_mirrored);
            let smaller = with_copies(
                &sky,
                &[&|[x, y, mag]| [SIDE_PX + 0.7 * x, 0.7 * y, mag + 0.8]],
            );
            let scale = found(&mut rng, &smaller, sky.len()).unwrap().scale;
            assert!((scale - 0.7).abs() < 0.02, "{scale}");
        }
    }

    #[test]
    fn a_sky_that_stands_once_is_not_told() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for trial in 0..200 {
            let mut stars = sky(&mut rng, 60);
            for star in &mut stars {
                star[0] *= 2.0;
                star[1] *= 2.0;
            }
            // False stars, all over the frame or in a lump, as lights of a town.
            let lump = if trial % 2 == 0 { 2.0 } else { 0.25 };
            let lights = sky(&mut rng, 60);
            stars.extend(
                lights
                    .iter()
                    .map(|[x, y, mag]| [x * lump, y * lump, mag - 0.5]),
            );
            assert_eq!(found(&mut rng, &stars, 60), None, "{trial}");
        }
    }
}
