//! Where is a star, and how bright is it?
//!
//! The centroid under a window of the star's width, moved until it stays: near the Cramér-Rao bound for faint and
//! bright stars.
//!
//! # Reference
//! Bertin & Arnouts 1996, A&AS 117, 393, and the manual of SExtractor, "Windowed positional parameters".

use crate::{Config, Image, Spot};

/// Half a window's side is at most this.
const MAX_HALF: usize = 16;
/// … and this many standard deviations of the star's image.
const HALF_SIGMAS: f64 = 4.0;
/// Pixels around the largest window.
const MAX_RING: usize = 8 * MAX_HALF;
/// Steps to the centroid.
pub(crate) const MAX_STEPS: usize = 12;
/// A shorter step ends the way.
const STEP_PX: f64 = 1e-4;
/// A centroid that is farther from the peak is of something else, in standard deviations of the star's image.
const MAX_WAY_SIGMAS: f64 = 2.0;
/// A pixel that holds more of the light than a star's image can, by this factor, is no star.
const SHARP: f64 = 1.5;
/// Error of the centroid of a saturated star, in standard deviations of the star's image.
const SATURATED_SIGMAS: f64 = 0.2;

/// The pixels around a star.
pub(crate) struct Window<'a> {
    image: &'a Image<'a>,
    middle: [usize; 2],
    half: usize,
    level_adu: f64,
    noise_adu: f64,
}

impl<'a> Window<'a> {
    /// The window around a place; `None` where it is not whole.
    pub(crate) fn around(image: &'a Image<'a>, config: &Config, place: [f64; 2]) -> Option<Self> {
        let half = (libm::ceil(HALF_SIGMAS * config.spot_sigma_px) as usize).clamp(3, MAX_HALF);
        let sides = [image.width(), image.height()];
        let rounded = place.map(|at| libm::floor(at + 0.5));
        for axis in 0..2 {
            let last = sides[axis] as f64 - 1.0 - half as f64;
            if !(rounded[axis] >= half as f64 && rounded[axis] <= last) {
                return None;
            }
        }
        let middle = rounded.map(|at| at as usize);
        let [level_adu, noise_adu] = ring(image, middle, half);
        Some(Self {
            image,
            middle,
            half,
            level_adu,
            noise_adu,
        })
    }

    /// Light of a pixel above the background, in ADU.
    fn light(&self, x: usize, y: usize) -> f64 {
        f64::from(self.image.at(x, y)) - self.level_adu
    }

    fn pixels(&self) -> impl Iterator<Item = [usize; 2]> {
        let [x, y] = self.middle;
        let half = self.half;
        (y - half..=y + half)
            .flat_map(move |row| (x - half..=x + half).map(move |column| [column, row]))
    }
}

/// The brightest pixel within a distance of a place, after a sum over 3 × 3 pixels; `None` where the image has none there.
pub(crate) fn peak(image: &Image, [x, y]: [f64; 2], radius_px: f64) -> Option<[f64; 2]> {
    let inner = |at: f64, side: usize| {
        let first = libm::ceil(at - radius_px).max(1.0);
        let last = libm::floor(at + radius_px).min(side as f64 - 2.0);
        (first <= last).then_some(first as usize..=last as usize)
    };
    let (columns, rows) = inner(x, image.width()).zip(inner(y, image.height()))?;
    let mut best = None;
    for row in rows {
        for column in columns.clone() {
            if libm::hypot(column as f64 - x, row as f64 - y) > radius_px {
                continue;
            }
            let mut sum = 0.0;
            for around in row - 1..=row + 1 {
                sum += image.at(column - 1, around)
                    + image.at(column, around)
                    + image.at(column + 1, around);
            }
            if best.is_none_or(|(most, _)| sum > most) {
                best = Some((sum, [column as f64, row as f64]));
            }
        }
    }
    best.map(|(_, pixel)| pixel)
}

/// Level and noise of the pixels on the border of a window.
fn ring(image: &Image, [x, y]: [usize; 2], half: usize) -> [f64; 2] {
    let mut levels = [0.0_f32; MAX_RING];
    let mut count = 0;
    let mut add = |level: f32| {
        levels[count] = level;
        count += 1;
    };
    for offset in 0..2 * half {
        add(image.at(x - half + offset, y - half));
        add(image.at(x + half, y - half + offset));
        add(image.at(x + half - offset, y + half));
        add(image.at(x - half, y + half - offset));
    }
    let levels = &mut levels[..count];
    levels.sort_unstable_by(f32::total_cmp);
    let median = levels[count / 2];
    // Values of whole numbers make a median of whole numbers: the mean of those near to it is finer.
    let spread = (median - levels[count * 16 / 100]).max(0.3);
    let near = levels
        .iter()
        .filter(|level| (**level - median).abs() <= 2.0 * spread);
    let (sum, square, number) = near.fold((0.0, 0.0, 0.0), |(sum, square, number), level| {
        let difference = f64::from(level - median);
        (
            sum + difference,
            square + difference * difference,
            number + 1.0,
        )
    });
    let mean = sum / number;
    // A normal distribution that is cut off at two standard deviations is 12 % narrower.
    let noise = 1.137 * libm::sqrt((square / number - mean * mean).max(0.0));
    [f64::from(median) + mean, noise.max(0.29)]
}

/// Sums over a window.
struct Sums {
    light: f64,
    moment: [f64; 2],
    square: [f64; 2],
    weight_squared: f64,
    noise: f64,
    brightest: f64,
}

fn sums(window: &Window, config: &Config, [x, y]: [f64; 2]) -> Sums {
    let mut sums = Sums {
        light: 0.0,
        moment: [0.0; 2],
        square: [0.0; 2],
        weight_squared: 0.0,
        noise: 0.0,
        brightest: 0.0,
    };
    let gain = config.sensor.gain_e_per_adu;
    let scale = -0.5 / (config.spot_sigma_px * config.spot_sigma_px);
    for [column, row] in window.pixels() {
        let offset = [column as f64 - x, row as f64 - y];
        let weight = libm::exp(scale * (offset[0] * offset[0] + offset[1] * offset[1]));
        let light = window.light(column, row);
        let variance = window.noise_adu * window.noise_adu + light.max(0.0) / gain;
        sums.light += weight * light;
        sums.weight_squared += weight * weight;
        sums.noise += weight * weight * variance;
        for (axis, offset) in offset.iter().enumerate() {
            let lever = weight * offset;
            sums.moment[axis] += lever * light;
            sums.square[axis] += lever * lever * variance;
        }
        sums.brightest = sums.brightest.max(light);
    }
    sums
}

/// Measures the star in the middle of a window; `None` where there is none.
pub(crate) fn measure(window: &Window, config: &Config, iterations: &mut u64) -> Option<Spot> {
    let start = window.middle.map(|at| at as f64);
    let mut place = start;
    for _ in 0..MAX_STEPS {
        *iterations += 1;
        let sums = sums(window, config, place);
        if sums.light <= 0.0 {
            return None;
        }
        let step = sums.moment.map(|moment| 2.0 * moment / sums.light);
        place = [place[0] + step[0], place[1] + step[1]];
        let way_px = libm::hypot(place[0] - start[0], place[1] - start[1]);
        if way_px > MAX_WAY_SIGMAS * config.spot_sigma_px + 0.7 {
            return None;
        }
        if libm::hypot(step[0], step[1]) < STEP_PX {
            break;
        }
    }
    let sums = sums(window, config, place);
    let area = core::f64::consts::TAU * config.spot_sigma_px * config.spot_sigma_px;
    let flux_adu = sums.light * area / sums.weight_squared;
    if sums.light <= 0.0 || is_sharp(&sums, flux_adu, config.spot_sigma_px) {
        return None;
    }
    let errors = sums
        .square
        .map(|square| 2.0 * libm::sqrt(square) / sums.light);
    let mut sigma_px = libm::sqrt(0.5 * (errors[0] * errors[0] + errors[1] * errors[1]));
    if sums.brightest + window.level_adu >= config.sensor.saturation_adu {
        sigma_px = libm::hypot(sigma_px, SATURATED_SIGMAS * config.spot_sigma_px);
    }
    Some(Spot {
        x_px: place[0],
        y_px: place[1],
        sigma_px,
        flux_adu: flux_adu as f32,
        snr: (sums.light / libm::sqrt(sums.noise)) as f32,
    })
}

/// Whether one pixel holds more of the light than that in the middle of a star can.
fn is_sharp(sums: &Sums, flux_adu: f64, sigma_px: f64) -> bool {
    let inside = libm::erf(0.5 / (core::f64::consts::SQRT_2 * sigma_px));
    sums.brightest > SHARP * inside * inside * flux_adu
}
