//! The level from which on pixels are saturated, where the data show it.
//!
//! Most cameras write 10 to 14 bits into 16, and programs subtract a bias or scale to floats, so
//! that the stars are cut off below the full scale of the file. Then several of them end at one
//! level, or one has many pixels there, and no star ends a little below it.
//!
//! 1. The highest level: that of a pixel with light beside it, which hot pixels have not.
//! 2. The sources: connected pixels within a fraction of that height, each with its highest pixel.
//! 3. How likely is it by chance that so many end at the same level? Of stars that are not
//!    saturated, fewer end at a higher level than at a lower one; were all levels equally likely,
//!    the binomial distribution would tell. So its tail bounds the rate of false plateaus.
//!
//! Caveats: one star with up to [`TIED_BY_SHAPE`] pixels at the highest level is no evidence. A
//! plateau that another program's flat has spread over more than a few per cent is not found.

use super::image::Frame;
use super::pixels::{Pixels, reduce};
use crate::base::statistics::log10_binomial_tail;
use multiversion::multiversion;
use std::cmp::Ordering;

/// Log10 of the chance at most that a frame without saturated pixels has a plateau.
const MAX_LOG10_CHANCE: f64 = -5.0;
/// The heights of sources are compared down to this fraction below the highest.
const REACH: f32 = 1.0 / 8.0;
/// A plateau that is not exact (noise of full wells, compression) is at most this part of that
/// reach thick.
const MAX_THICKNESS: f32 = 0.25;
/// It is no thicker than so many times the noise of the background, either: light that falls evenly
/// on many pixels, as from windows, has more noise the brighter it is.
const MAX_THICKNESS_SIGMA: f32 = 4.0;
/// A pixel has light beside it where one next to it has this fraction of its height: a star's has
/// more, however sharp it is.
const LIGHT_BESIDE: f32 = 0.1;
/// So many pixels of one source have the same level where it is symmetric and has no noise.
const TIED_BY_SHAPE: usize = 4;
/// Pixels of the sample in which background and levels are measured.
const SAMPLE_PX: usize = 4096;
/// The background less this quantile of the levels, in percent, is its noise.
const NOISE_QUANTILE: usize = 16;
/// Pixels near the highest level that are looked at; in frames with more, the first rows
/// of them.
const MAX_BRIGHT_PX: usize = 1 << 16;
/// The levels are no finer than this fraction of the reach.
const MIN_STEP: f32 = 1.0 / 4096.0;

/// Data may exceed the level that a header states by this factor: where response differs from pixel
/// to pixel, or the level is where the detector ceases to be linear.
const MAX_OVER_STATED: f32 = 2.0;

impl Frame<'_> {
    /// The level at and above which a pixel is saturated, in ADU: that of the file or its format,
    /// or below that the level which the highest pixels share. `None` where neither is known.
    ///
    /// A frame without saturated pixels has a level by chance at most once in 10⁵ times.
    pub fn saturation_level_adu(&self) -> Option<f32> {
        SaturationFinder::default().level_adu(self)
    }

    /// Whether pixels can be saturated at this level, in ADU: not where many are far above it.
    pub(super) fn can_saturate_at(&self, level_adu: f32) -> bool {
        let highest = highest_pair(&self.pixels, self.width);
        level_adu > 0.0 && highest <= MAX_OVER_STATED * level_adu
    }
}

/// Finds saturation levels; holds the buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct SaturationFinder {
    sample: Vec<f32>,
    pixels: Vec<BrightPixel>,
    is_seen: Vec<bool>,
    open: Vec<usize>,
    sources: Vec<BrightRegion>,
}

impl SaturationFinder {
    /// [`Frame::saturation_level_adu`].
    pub fn level_adu(&mut self, frame: &Frame<'_>) -> Option<f32> {
        let stated = frame.saturation_adu;
        let highest = highest_pair(&frame.pixels, frame.width);
        if stated.is_some_and(|stated| highest >= stated) {
            return stated;
        }
        match (stated, self.plateau(frame, highest)) {
            (Some(stated), Some(plateau)) => Some(stated.min(plateau)),
            (stated, plateau) => plateau.or(stated),
        }
    }

    /// The lowest level of the plateau of `frame`, where two pixels reach `highest_pair`; `None`
    /// where there is none.
    fn plateau(&mut self, frame: &Frame<'_>, highest_pair: f32) -> Option<f32> {
        let Self { sample, pixels, .. } = self;
        fill_sample(frame, sample);
        let count = sample.len();
        if count == 0 {
            return None;
        }
        let (lower, background, _) = sample.select_nth_unstable_by(count / 2, f32::total_cmp);
        let background = *background;
        let at = NOISE_QUANTILE * count / 100;
        let darker = match lower {
            [] => background,
            lower => *lower.select_nth_unstable_by(at, f32::total_cmp).1,
        };
        let noise = background - darker;
        let lowest = |top: f32| top - REACH * (top - background);
        let floor = lowest(highest_pair);
        if floor.partial_cmp(&background) != Some(Ordering::Greater) {
            return None;
        }
        find_pixels_from(frame, floor, pixels);
        pixels.retain(|pixel| has_light_beside(frame, pixel, background));
        let top = pixels.iter().map(|pixel| pixel.value).fold(floor, f32::max);
        pixels.retain(|pixel| pixel.value >= lowest(top));
        sample.extend(pixels.iter().map(|pixel| pixel.value));
        let reach = top - lowest(top);
        let step = smallest_step(sample).max(MIN_STEP * reach);
        if step > reach {
            return None;
        }
        self.find_sources(top);
        let heights = Heights {
            sources: &self.sources,
            top,
            reach,
            step,
        };
        heights.plateau(MAX_THICKNESS_SIGMA * noise)
    }

    /// Finds the connected pixels.
    fn find_sources(&mut self, top: f32) {
        let Self {
            pixels,
            is_seen,
            open,
            sources,
            ..
        } = self;
        is_seen.clear();
        is_seen.resize(pixels.len(), false);
        open.clear();
        sources.clear();
        for first in 0..pixels.len() {
            if std::mem::replace(&mut is_seen[first], true) {
                continue;
            }
            let mut source = BrightRegion::default();
            open.push(first);
            while let Some(index) = open.pop() {
                let pixel = pixels[index];
                let is_top = pixel.value >= top;
                source.peak = source.peak.max(pixel.value);
                source.at_top += usize::from(is_top);
                source.below_top += usize::from(!is_top);
                for neighbor in neighbors(pixels, pixel) {
                    if !std::mem::replace(&mut is_seen[neighbor], true) {
                        open.push(neighbor);
                    }
                }
            }
            sources.push(source);
        }
    }
}

/// The highest level that two pixels next to each other reach, which single hot pixels do not
/// raise.
fn highest_pair(pixels: &Pixels<'_>, width: usize) -> f32 {
    match pixels {
        Pixels::U8(values) => f32::from(highest_pair_of_bytes(values, width)),
        Pixels::U16(values) => f32::from(highest_pair_of_words(values, width)),
        Pixels::F32(values) => highest_pair_of_floats(values, width),
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn highest_pair_of_bytes(values: &[u8], width: usize) -> u8 {
    fold_pairs(values, width, u8::MIN)
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn highest_pair_of_words(values: &[u16], width: usize) -> u16 {
    fold_pairs(values, width, u16::MIN)
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn highest_pair_of_floats(values: &[f32], width: usize) -> f32 {
    fold_pairs(values, width, f32::NEG_INFINITY)
}

/// The highest of the lower values of pairs in a row or in a column.
#[inline(always)]
fn fold_pairs<T: Copy + PartialOrd>(values: &[T], width: usize, lowest: T) -> T {
    const LANES: usize = 64;
    let higher = |a: T, b: T| if b > a { b } else { a };
    // Neither is lower where one is NaN.
    let lower = |a: T, b: T| match (a < b, b <= a) {
        (true, _) => a,
        (_, true) => b,
        _ => lowest,
    };
    let rows = values.chunks_exact(width);
    let mut lanes = [lowest; LANES];
    for (row, below) in rows.clone().zip(rows.skip(1)) {
        let beside = &row[1..];
        let (row_chunks, row_rest) = row[..width - 1].as_chunks::<LANES>();
        let (beside_chunks, beside_rest) = beside.as_chunks::<LANES>();
        let (below_chunks, _) = below.as_chunks::<LANES>();
        let chunks = row_chunks.iter().zip(beside_chunks).zip(below_chunks);
        for ((row, beside), below) in chunks {
            for (lane, highest) in lanes.iter_mut().enumerate() {
                *highest = higher(*highest, lower(row[lane], beside[lane]));
                *highest = higher(*highest, lower(row[lane], below[lane]));
            }
        }
        let below_rest = &below[row_chunks.len() * LANES..];
        for ((&value, &beside), &below) in row_rest.iter().zip(beside_rest).zip(below_rest) {
            lanes[0] = higher(lanes[0], lower(value, beside));
            lanes[0] = higher(lanes[0], lower(value, below));
        }
    }
    lanes.into_iter().fold(lowest, higher)
}

/// A pixel near the highest level.
#[derive(Debug, Clone, Copy)]
struct BrightPixel {
    x: usize,
    y: usize,
    value: f32,
}

/// Connected bright pixels.
#[derive(Debug, Clone, Copy)]
struct BrightRegion {
    /// The highest level.
    peak: f32,
    /// Pixels at the frame's highest level.
    at_top: usize,
    /// Pixels below it.
    below_top: usize,
}

impl Default for BrightRegion {
    fn default() -> Self {
        Self {
            peak: f32::NEG_INFINITY,
            at_top: 0,
            below_top: 0,
        }
    }
}

/// How high the sources near a frame's highest level are.
struct Heights<'a> {
    sources: &'a [BrightRegion],
    /// The highest level.
    top: f32,
    /// How far below it the sources reach.
    reach: f32,
    /// Difference between levels.
    step: f32,
}

impl Heights<'_> {
    /// The lowest level of the plateau, where there is one. One that is not exact is at most
    /// `max_thickness` thick.
    fn plateau(&self, max_thickness: f32) -> Option<f32> {
        if self.log10_chance_of_ties() <= MAX_LOG10_CHANCE {
            return Some(self.top);
        }
        let doublings = std::iter::successors(Some(self.step), |thickness| Some(2.0 * thickness));
        let max_thickness = max_thickness.min(MAX_THICKNESS * self.reach);
        let thicknesses = doublings.take_while(|t| *t <= max_thickness);
        let chances = thicknesses.map(|t| (self.log10_chance_within(t), t));
        let (chance, thickness) = chances.min_by(|a, b| a.0.total_cmp(&b.0))?;
        // Sources end near the highest of their pixels, which noise spreads as far down.
        (chance <= MAX_LOG10_CHANCE).then_some(self.top - 2.0 * thickness)
    }

    /// The chance that so many sources, and so many pixels of one, are exactly at the top.
    fn log10_chance_of_ties(&self) -> f64 {
        let (mut tied, mut others) = (0, 0);
        for source in self.sources {
            let more = source.at_top.saturating_sub(TIED_BY_SHAPE);
            tied += usize::from(source.at_top > 0) + more;
            others += match (source.at_top, more) {
                (0, _) => 1,
                (_, 0) => 0,
                _ => source.below_top,
            };
        }
        self.log10_chance(tied, others, 0.0)
    }

    /// The chance that so many sources end at most `thickness` below the top.
    fn log10_chance_within(&self, thickness: f32) -> f64 {
        let is_within = |source: &&BrightRegion| source.peak >= self.top - thickness;
        let within = self.sources.iter().filter(is_within).count();
        self.log10_chance(within, self.sources.len() - within, thickness)
    }

    /// Log10 of the chance that of samples of levels within the reach so many are within
    /// `thickness` of the highest, which is one of them.
    fn log10_chance(&self, within: usize, others: usize, thickness: f32) -> f64 {
        let further = within.saturating_sub(1);
        let chance = (thickness + self.step) / (self.reach + self.step);
        log10_binomial_tail(further + others, further, f64::from(chance))
    }
}

/// The indices of the pixels within one pixel of this.
fn neighbors(pixels: &[BrightPixel], pixel: BrightPixel) -> impl Iterator<Item = usize> {
    let (left, right) = (pixel.x.saturating_sub(1), pixel.x + 1);
    (pixel.y.saturating_sub(1)..=pixel.y + 1).flat_map(move |y| {
        let from = pixels.partition_point(|p| (p.y, p.x) < (y, left));
        let in_row = pixels[from..].iter();
        let count = in_row.take_while(|p| p.y == y && p.x <= right).count();
        from..from + count
    })
}

/// Fills `sample` with values from all over the frame.
fn fill_sample(frame: &Frame<'_>, sample: &mut Vec<f32>) {
    let pixels = frame.pixels.len();
    // Odd, so that no column is left out in frames of even widths.
    let stride = (pixels / SAMPLE_PX) | 1;
    let values = (0..pixels).step_by(stride).map(|i| frame.pixels.value(i));
    sample.clear();
    sample.extend(values.filter(|value| !value.is_nan()));
}

/// The smallest difference between different values; 0 where there is none.
fn smallest_step(values: &mut [f32]) -> f32 {
    values.sort_unstable_by(f32::total_cmp);
    let differences = values.windows(2).map(|pair| pair[1] - pair[0]);
    let smallest = differences
        .filter(|d| *d > 0.0)
        .fold(f32::INFINITY, f32::min);
    if smallest.is_finite() { smallest } else { 0.0 }
}

/// Finds the pixels from a level on, in reading order, the first [`MAX_BRIGHT_PX`].
fn find_pixels_from(frame: &Frame<'_>, level: f32, found: &mut Vec<BrightPixel>) {
    match &frame.pixels {
        Pixels::U8(values) => find_in_bytes(values, frame.width, level, found),
        Pixels::U16(values) => find_in_words(values, frame.width, level, found),
        Pixels::F32(values) => find_in_floats(values, frame.width, level, found),
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn find_in_bytes(values: &[u8], width: usize, level: f32, found: &mut Vec<BrightPixel>) {
    find_from(values, u8::MIN, width, level, found);
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn find_in_words(values: &[u16], width: usize, level: f32, found: &mut Vec<BrightPixel>) {
    find_from(values, u16::MIN, width, level, found);
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn find_in_floats(values: &[f32], width: usize, level: f32, found: &mut Vec<BrightPixel>) {
    find_from(values, f32::NEG_INFINITY, width, level, found);
}

/// Finds the values from a level on in rows of `width`.
#[inline(always)]
fn find_from<T: Copy + PartialOrd + Into<f32>>(
    values: &[T],
    lowest: T,
    width: usize,
    level: f32,
    found: &mut Vec<BrightPixel>,
) {
    const BLOCK_PX: usize = 64;
    found.clear();
    for (y, row) in values.chunks_exact(width).enumerate() {
        // Most rows have none.
        if highest_in(row, lowest).into() < level {
            continue;
        }
        for (block, values) in row.chunks(BLOCK_PX).enumerate() {
            let is_bright = |value: T| value.into() >= level;
            // Without early exit: this is a vector comparison, and most blocks have none, too.
            if values.iter().fold(false, |any, &v| any | is_bright(v)) {
                let pixels = (block * BLOCK_PX..)
                    .zip(values)
                    .map(|(x, &value)| BrightPixel {
                        x,
                        y,
                        value: value.into(),
                    });
                found.extend(pixels.filter(|pixel| pixel.value >= level));
            }
        }
        if found.len() >= MAX_BRIGHT_PX {
            return;
        }
    }
}

/// The highest of `lowest` and the values of a row; NaN is left out.
#[inline(always)]
fn highest_in<T: Copy + PartialOrd>(row: &[T], lowest: T) -> T {
    reduce(row, lowest, |a, b| if b > a { b } else { a })
}

/// Whether a pixel next to this one has light, too.
fn has_light_beside(frame: &Frame<'_>, pixel: &BrightPixel, background: f32) -> bool {
    let level = background + LIGHT_BESIDE * (pixel.value - background);
    let rows = pixel.y.saturating_sub(1)..(pixel.y + 2).min(frame.height);
    let columns = pixel.x.saturating_sub(1)..(pixel.x + 2).min(frame.width);
    rows.flat_map(|y| columns.clone().map(move |x| (x, y)))
        .any(|(x, y)| (x, y) != (pixel.x, pixel.y) && frame.at(x, y) >= level)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::size::Size;

    const SIZE: Size = Size::new(320, 240);

    /// Numbers from 0 to 1 that look random.
    fn random(i: u64) -> f32 {
        let mut z = i.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    }

    /// Roughly normal, of standard deviation 1.
    fn noise(i: u64) -> f32 {
        (0..12).map(|k| random(12 * i + k)).sum::<f32>() - 6.0
    }

    /// Light of `stars` with these peaks over a sky of 100, with shot noise of 0.1 for each level.
    fn sky(peaks: &[f32], seed: u64) -> Vec<f32> {
        let Size { width, height } = SIZE;
        let places: Vec<_> = (0..peaks.len() as u64)
            .map(|k| {
                let at =
                    |k: u64, side: usize| 10.0 + random(seed * 1000 + k) * (side as f32 - 20.0);
                (at(2 * k, width), at(2 * k + 1, height))
            })
            .collect();
        (0..width * height)
            .map(|i| {
                let (x, y) = ((i % width) as f32, (i / width) as f32);
                let light = |((cx, cy), peak): (&(f32, f32), &f32)| {
                    let square = (x - cx).powi(2) + (y - cy).powi(2);
                    if square < 200.0 {
                        peak * (-square / 2.0).exp()
                    } else {
                        0.0
                    }
                };
                let level = 100.0 + places.iter().zip(peaks).map(light).sum::<f32>();
                level + noise(seed * 1_000_000 + i as u64) * (4.0 + 0.1 * level).sqrt()
            })
            .collect()
    }

    /// Peaks of stars: each half as bright as the one before, and many faint ones.
    fn peaks(brightest: f32) -> Vec<f32> {
        (0..40)
            .map(|k| brightest / (1.0 + 0.35 * k as f32).powi(2))
            .collect()
    }

    fn words(levels: &[f32], most: f32) -> Frame<'static> {
        let words: Vec<u16> = levels.iter().map(|l| l.round().min(most) as u16).collect();
        Frame::from_samples(SIZE.width, SIZE.height, words).unwrap()
    }

    #[test]
    fn the_level_at_which_stars_are_cut_off_is_found_whatever_it_is() {
        for (seed, full) in [(1, 1023.0), (2, 4095.0), (3, 3800.0), (4, 16_383.0)] {
            let levels = sky(&peaks(20.0 * full), seed);
            let frame = words(&levels, full);
            assert_eq!(frame.saturation_level_adu(), Some(full), "{full}");
            let scaled: Vec<f32> = frame.values().iter().map(|l| (l - 60.0) / full).collect();
            let floats = Frame::new(SIZE.width, SIZE.height, scaled).unwrap();
            let found = floats.saturation_level_adu();
            assert_eq!(found, Some((full - 60.0) / full), "floats of {full}");
            let wide: Vec<i32> = frame.values().iter().map(|l| *l as i32 * 5).collect();
            let wide = Frame::from_integers(SIZE.width, SIZE.height, &wide, i32::MAX).unwrap();
            assert_eq!(wide.saturation_level_adu(), Some(5.0 * full));
        }
    }

    #[test]
    fn a_plateau_with_noise_is_found_and_lies_above_the_level() {
        let levels = sky(&peaks(80_000.0), 5);
        let with_noise = levels.iter().enumerate();
        let well = |(i, level): (usize, &f32)| level.min(3900.0) + 3.0 * noise(i as u64);
        let levels: Vec<f32> = with_noise.map(well).collect();
        let level = words(&levels, 65_535.0).saturation_level_adu().unwrap();
        assert!((3800.0..3900.0).contains(&level), "{level}");
    }

    #[test]
    fn a_single_column_of_charge_is_enough() {
        let mut levels = sky(&peaks(900.0), 6);
        for y in 40..70 {
            levels[y * SIZE.width + 100] = 5000.0;
        }
        assert_eq!(words(&levels, 4095.0).saturation_level_adu(), Some(4095.0));
    }

    #[test]
    fn frames_without_saturated_stars_have_the_level_of_their_format() {
        for seed in 10..60 {
            let brightest = 200.0 + 60.0 * seed as f32;
            let frame = words(&sky(&peaks(brightest), seed), 65_535.0);
            assert_eq!(frame.saturation_level_adu(), Some(65_535.0), "{seed}");
            let dim = words(&sky(&peaks(20.0), seed), 65_535.0);
            assert_eq!(dim.saturation_level_adu(), Some(65_535.0), "{seed}");
        }
    }

    #[test]
    fn few_grey_levels_hot_pixels_and_noise_are_no_plateau() {
        let bytes = |level: &dyn Fn(usize) -> f32| {
            let bytes: Vec<u8> = (0..SIZE.pixels()).map(|i| level(i) as u8).collect();
            Frame::from_samples(SIZE.width, SIZE.height, bytes).unwrap()
        };
        let levels = sky(&peaks(300.0), 61);
        let few = bytes(&|i| (levels[i] - 90.0).clamp(0.0, 300.0) / 10.0);
        assert_eq!(few.saturation_level_adu(), Some(255.0));
        let grain = bytes(&|i| (20.0 + 3.0 * noise(i as u64)).max(0.0));
        assert_eq!(grain.saturation_level_adu(), Some(255.0));
        let mut levels = sky(&peaks(900.0), 62);
        for k in 0..200 {
            levels[(k * 379 + 41) % (SIZE.pixels())] = 4095.0;
        }
        let hot = words(&levels, 4095.0).saturation_level_adu();
        assert_eq!(hot, Some(65_535.0));
    }

    #[test]
    fn a_hot_pixel_above_the_plateau_does_not_hide_it() {
        let mut levels = sky(&peaks(80_000.0), 63);
        levels
            .iter_mut()
            .for_each(|level| *level = level.min(4095.0));
        levels[5000] = 65_535.0;
        assert_eq!(
            words(&levels, 65_535.0).saturation_level_adu(),
            Some(4095.0)
        );
    }

    #[test]
    fn pairs_count_in_rows_and_columns_and_without_nan() {
        let (width, height) = (150, 4);
        let mut values = vec![1.0_f32; width * height];
        (values[7], values[9]) = (9.0, 8.0);
        let highest = |values: &[f32]| highest_pair(&values.into(), width);
        assert_eq!(highest(&values), 1.0);
        (values[145], values[146]) = (5.0, 4.0);
        assert_eq!(highest(&values), 4.0);
        (values[10 + width], values[10 + 2 * width]) = (7.0, 6.0);
        assert_eq!(highest(&values), 6.0);
        (values[8], values[8 + width]) = (f32::NAN, f32::NAN);
        assert_eq!(highest(&values), 6.0);
    }
}
