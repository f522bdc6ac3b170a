//! Which spots of an image are stars?
//!
//! Image → level and noise of each tile → a filter as wide as a star's image, along x and y, in a few rows at a time →
//! peaks above the noise → the most significant ones, each with its [centroid](crate::centroid).

use crate::block::{Buffers, MAX_TAPS, PEAK_ROWS};
use crate::centroid::{self, Window};
use crate::{Config, Image, Work};
use bytemuck::{Pod, Zeroable};

/// Side of a tile of the image.
pub(crate) const TILE_PX: usize = 64;
/// Pixels along each side of a tile that its level and noise are taken of.
const TILE_SAMPLES: usize = 16;
/// Rounds in which samples that stick out are left out, …
const CLIP_ROUNDS: usize = 4;
/// … those by more than this, in standard deviations.
const CLIP_SIGMA: f32 = 3.0;
/// Least noise, in ADU: that of rounding.
const MIN_NOISE_ADU: f32 = 0.29;

/// A spot of light.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Spot {
    /// Its place.
    pub x_px: f64,
    /// Its place.
    pub y_px: f64,
    /// Standard error of the place, on each axis.
    pub sigma_px: f64,
    /// Its light, in ADU.
    pub flux_adu: f32,
    /// Its light over the noise.
    pub snr: f32,
}

/// Writes the most significant spots to `spots`, the brightest first, and tells how many there are.
pub(crate) fn detect(
    image: &Image,
    config: &Config,
    buffers: &mut Buffers,
    spots: &mut [Spot],
    work: &mut Work,
) -> usize {
    let most = spots.len().min(config.max_stars as usize);
    let mut kept = Brightest {
        spots: &mut spots[..most],
        count: 0,
    };
    measure_tiles(image, buffers.tiles);
    find_peaks(image, config, buffers, &mut kept, work);
    let peaks = kept.count;
    let mut count = 0;
    for peak in 0..peaks {
        let place = [spots[peak].x_px, spots[peak].y_px];
        work.windows += 1;
        let Some(window) = Window::around(image, config, place) else {
            continue;
        };
        let Some(spot) = centroid::measure(&window, config, &mut work.iterations) else {
            continue;
        };
        let is_new = !spots[..count]
            .iter()
            .any(|other| is_near(other, &spot, config.spot_sigma_px));
        if is_new && f64::from(spot.snr) >= config.detection_sigma {
            spots[count] = spot;
            count += 1;
        }
    }
    spots[..count].sort_unstable_by(|a, b| b.flux_adu.total_cmp(&a.flux_adu));
    count
}

fn is_near(a: &Spot, b: &Spot, sigma_px: f64) -> bool {
    libm::hypot(a.x_px - b.x_px, a.y_px - b.y_px) < sigma_px
}

/// The most significant peaks, as a heap with the least one first.
struct Brightest<'a> {
    spots: &'a mut [Spot],
    count: usize,
}

impl Brightest<'_> {
    fn add(&mut self, x: usize, y: usize, snr: f32) {
        let spot = Spot {
            x_px: x as f64,
            y_px: y as f64,
            snr,
            ..Spot::default()
        };
        if self.count < self.spots.len() {
            self.spots[self.count] = spot;
            self.count += 1;
            self.rise(self.count - 1);
        } else if self.count > 0 && snr > self.spots[0].snr {
            self.spots[0] = spot;
            self.sink();
        }
    }

    fn rise(&mut self, mut at: usize) {
        while at > 0 && self.spots[at].snr < self.spots[(at - 1) / 2].snr {
            self.spots.swap(at, (at - 1) / 2);
            at = (at - 1) / 2;
        }
    }

    fn sink(&mut self) {
        let mut at = 0;
        loop {
            let children = [2 * at + 1, 2 * at + 2]
                .into_iter()
                .filter(|child| *child < self.count);
            let least = children.min_by(|a, b| self.spots[*a].snr.total_cmp(&self.spots[*b].snr));
            let Some(least) = least.filter(|child| self.spots[*child].snr < self.spots[at].snr)
            else {
                return;
            };
            self.spots.swap(at, least);
            at = least;
        }
    }
}

/// Measures level and noise of each tile.
fn measure_tiles(image: &Image, tiles: &mut [[f32; 2]]) {
    let columns = image.width().div_ceil(TILE_PX);
    for (number, tile) in tiles.iter_mut().enumerate() {
        let start = [number % columns * TILE_PX, number / columns * TILE_PX];
        let end = [
            (start[0] + TILE_PX).min(image.width()),
            (start[1] + TILE_PX).min(image.height()),
        ];
        *tile = level_and_noise(image, start, end);
    }
}

fn level_and_noise(image: &Image, start: [usize; 2], end: [usize; 2]) -> [f32; 2] {
    let mut samples = [0.0_f32; TILE_SAMPLES * TILE_SAMPLES];
    let side = |axis: usize| end[axis] - start[axis];
    for (number, sample) in samples.iter_mut().enumerate() {
        let (column, row) = (number % TILE_SAMPLES, number / TILE_SAMPLES);
        // Every row of samples begins a pixel farther, so that no pattern of columns is all that is seen.
        let x = start[0] + (column * side(0) / TILE_SAMPLES + row % 4) % side(0);
        *sample = image.at(x, start[1] + row * side(1) / TILE_SAMPLES);
    }
    samples.sort_unstable_by(f32::total_cmp);
    let count = samples.len();
    let mut level = samples[count / 2];
    let mut noise = (level - samples[count * 16 / 100]).max(MIN_NOISE_ADU);
    for _ in 0..CLIP_ROUNDS {
        let inside = |sample: &&f32| (**sample - level).abs() <= CLIP_SIGMA * noise;
        let (mut sum, mut square, mut kept) = (0.0, 0.0, 0.0_f32);
        for sample in samples.iter().filter(inside) {
            let difference = sample - level;
            (sum, square, kept) = (
                sum + difference,
                square + difference * difference,
                kept + 1.0,
            );
        }
        if kept < 2.0 {
            break;
        }
        let mean = sum / kept;
        let variance = (square / kept - mean * mean).max(0.0);
        (level, noise) = (level + mean, libm::sqrtf(variance).max(MIN_NOISE_ADU));
    }
    // A normal distribution that is cut off at three standard deviations is 1.3 % narrower.
    [level, noise * 1.013]
}

/// Weights of the filter along one axis, normalised so that it keeps the noise of the pixels.
fn taps(sigma_px: f64) -> ([f32; MAX_TAPS], usize) {
    let half = (libm::ceil(2.0 * sigma_px) as usize).clamp(1, MAX_TAPS / 2);
    let mut taps = [0.0; MAX_TAPS];
    let mut square = 0.0;
    for (place, tap) in taps.iter_mut().enumerate().take(2 * half + 1) {
        let offset = (place as f64 - half as f64) / sigma_px;
        let weight = libm::exp(-0.5 * offset * offset);
        square += weight * weight;
        *tap = weight as f32;
    }
    let norm = (1.0 / libm::sqrt(square)) as f32;
    taps.iter_mut().for_each(|tap| *tap *= norm);
    (taps, half)
}

fn find_peaks(
    image: &Image,
    config: &Config,
    buffers: &mut Buffers,
    kept: &mut Brightest,
    work: &mut Work,
) {
    let (width, height) = (image.width(), image.height());
    let (taps, half) = taps(config.spot_sigma_px);
    let threshold = config.detection_sigma as f32;
    let (line, rest) = buffers.rows.split_at_mut(width);
    let (filtered, peaks) = rest.split_at_mut(MAX_TAPS * width);
    for y in 0..height {
        image.read_row(y, line);
        work.pixels += width as u64;
        normalise(line, y, buffers.tiles, [width, height]);
        let slot = y % MAX_TAPS * width;
        filter_row(line, &taps[..=2 * half], &mut filtered[slot..slot + width]);
        if y >= 2 * half {
            let row = y - half;
            let slot = row % PEAK_ROWS * width;
            add_rows(
                filtered,
                row - half,
                &taps[..=2 * half],
                &mut peaks[slot..slot + width],
            );
            if row >= half + 2 {
                peaks_of_row(peaks, row - 1, [half, width], threshold, kept, work);
            }
        }
    }
}

/// Turns the levels of a row into significances: the background's level is 0, and its noise 1.
fn normalise(line: &mut [f32], y: usize, tiles: &[[f32; 2]], [width, height]: [usize; 2]) {
    let columns = width.div_ceil(TILE_PX);
    let rows = height.div_ceil(TILE_PX);
    let (upper, down) = between(y, rows);
    let lower = (upper + 1).min(rows - 1);
    let at = |column: usize| {
        let [above, below] = [
            tiles[upper * columns + column],
            tiles[lower * columns + column],
        ];
        [0, 1].map(|part: usize| above[part] + down * (below[part] - above[part]))
    };
    for (x, level) in line.iter_mut().enumerate() {
        let (left, along) = between(x, columns);
        let [a, b] = [at(left), at((left + 1).min(columns - 1))];
        let [background, noise] = [0, 1].map(|part: usize| a[part] + along * (b[part] - a[part]));
        *level = (*level - background) / noise;
    }
}

/// The tile whose centre is before a pixel, and how far the pixel is on the way to the next one.
fn between(pixel: usize, tiles: usize) -> (usize, f32) {
    let half = TILE_PX / 2;
    let from_first = pixel.saturating_sub(half);
    let tile = (from_first / TILE_PX).min(tiles - 1);
    let along = (from_first - tile * TILE_PX) as f32 / TILE_PX as f32;
    (tile, along.min(1.0))
}

fn filter_row(line: &[f32], taps: &[f32], filtered: &mut [f32]) {
    let half = taps.len() / 2;
    let middle = half..line.len().saturating_sub(half);
    filtered.fill(0.0);
    for (tap, weight) in taps.iter().enumerate() {
        let shifted = &line[tap..];
        for (sum, level) in filtered[middle.clone()].iter_mut().zip(shifted) {
            *sum += weight * level;
        }
    }
}

fn add_rows(filtered: &[f32], first: usize, taps: &[f32], sums: &mut [f32]) {
    let width = sums.len();
    sums.fill(0.0);
    for (tap, weight) in taps.iter().enumerate() {
        let slot = (first + tap) % MAX_TAPS * width;
        for (sum, level) in sums.iter_mut().zip(&filtered[slot..slot + width]) {
            *sum += weight * level;
        }
    }
}

/// Keeps the pixels of a row that are above the threshold and brighter than all eight around.
fn peaks_of_row(
    peaks: &[f32],
    y: usize,
    [half, width]: [usize; 2],
    threshold: f32,
    kept: &mut Brightest,
    work: &mut Work,
) {
    let row = |y: usize| &peaks[y % PEAK_ROWS * width..][..width];
    let (above, own, below) = (row(y - 1), row(y), row(y + 1));
    for x in half + 1..width.saturating_sub(half + 1) {
        let level = own[x];
        if level < threshold {
            continue;
        }
        // Of equal neighbours the first counts.
        let is_peak = above[x - 1..=x + 1].iter().all(|other| level > *other)
            && level > own[x - 1]
            && level >= own[x + 1]
            && below[x - 1..=x + 1].iter().all(|other| level >= *other);
        if is_peak {
            work.peaks += 1;
            kept.add(x, y, level);
        }
    }
}
