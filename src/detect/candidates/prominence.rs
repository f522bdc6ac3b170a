//! The prominence of peaks: height above the highest saddle towards a higher peak of the region.
//!
//! 1. Each pixel belongs to the top to which the steepest ascent leads.
//! 2. Where pixels of two tops are adjacent there is a saddle.
//! 3. From the highest saddle down, each joins what belongs to two tops. The lower top has its saddle
//!    there.
//!
//! All but the last step goes through the pixels in reading order: to flood them from the top down is
//! the same, and takes many times as long in large regions, which no cache holds.
//!
//! # Reference
//! Edelsbrunner, Letscher & Zomorodian 2002, doi 10.1007/s00454-002-2885-2, for prominence as
//! persistence.

use super::disjoint_sets::{self, root_of};
use super::labelling::{Adjacent, Labelling};
use super::peak::Peak;
use crate::base::interrupt::Interrupted;
use crate::detect::pixels::View;
use multiversion::multiversion;

/// Logarithms to base 2 of the least and the largest number of saddles that are remembered.
const RECENT_BITS: [u32; 2] = [6, 13];
/// Saddles from which on repeated ones are left out.
const MANY_SADDLES: usize = 1 << 20;

/// Where pixels of two tops are adjacent.
#[derive(Debug, Clone, Copy, Default)]
struct Saddle {
    /// Indices of the tops, in ascending order; equal where there is no saddle.
    tops: [u32; 2],
    /// Height, in units of the local noise.
    snr: f32,
}

impl Saddle {
    /// Its place among the recent ones, of which there are 2 to the power of `bits`.
    fn slot(&self, bits: u32) -> usize {
        let [a, b] = self.tops;
        let hash = a.wrapping_mul(0x9e37_79b9) ^ b.wrapping_mul(0x85eb_ca6b);
        (hash >> (u32::BITS - bits)) as usize
    }
}

/// Leaves out all but the highest saddle between each two tops.
fn leave_out_repeated(saddles: &mut Vec<Saddle>) {
    saddles.sort_unstable_by(|a, b| a.tops.cmp(&b.tops).then(b.snr.total_cmp(&a.snr)));
    saddles.dedup_by_key(|saddle| saddle.tops);
}

/// Buffers.
#[derive(Debug, Clone, Default)]
pub(super) struct Prominence {
    /// The top of each pixel, as its index: a pixel without a higher one next to it.
    tops: Vec<u32>,
    /// The height of the highest pixel next to each, or of itself.
    steepest: Vec<f32>,
    /// Saddles found last: two tops are adjacent at many pixels, of which the highest counts.
    recent: Vec<Saddle>,
    saddles: Vec<Saddle>,
}

impl Prominence {
    /// Finds the top of each pixel of the regions that are wanted.
    ///
    /// # Errors
    /// [`Interrupted`] of work on `view`.
    pub fn find_tops(
        &mut self,
        labelling: &Labelling,
        view: &View<'_>,
        is_wanted: impl Fn(usize) -> bool,
    ) -> Result<(), Interrupted> {
        let Self { tops, steepest, .. } = self;
        let heights = &labelling.heights;
        disjoint_sets::reset(tops, heights.len());
        steepest.clone_from(heights);
        labelling.for_each_adjacent(
            view,
            is_wanted,
            |Adjacent {
                 pixel,
                 before,
                 count,
             }| {
                for [of, next_to] in [[pixel, before], [before, pixel]] {
                    let steepest = &mut steepest[of..of + count];
                    let tops = &mut tops[of..of + count];
                    climb(
                        steepest,
                        tops,
                        &heights[next_to..next_to + count],
                        next_to as u32,
                    );
                }
            },
        )?;
        for pixel in 0..heights.len() {
            tops[pixel] = root_of(tops, pixel as u32);
        }
        Ok(())
    }

    /// Finds the saddles between the tops of the regions that are wanted.
    ///
    /// # Errors
    /// [`Interrupted`] of work on `view`.
    pub fn find_saddles(
        &mut self,
        labelling: &Labelling,
        view: &View<'_>,
        is_wanted: impl Fn(usize) -> bool,
    ) -> Result<(), Interrupted> {
        let Self {
            tops,
            recent,
            saddles,
            ..
        } = self;
        saddles.clear();
        recent.clear();
        // No more than there are pixels: most frames have few.
        let [least, most] = RECENT_BITS;
        let bits = labelling.heights.len().max(1).ilog2().clamp(least, most);
        recent.resize(1 << bits, Saddle::default());
        let mut many = MANY_SADDLES;
        labelling.for_each_adjacent(
            view,
            is_wanted,
            |Adjacent {
                 pixel,
                 before,
                 count,
             }| {
                let [tops, of_before] = [pixel, before].map(|first| &tops[first..first + count]);
                for (index, (&a, &b)) in tops.iter().zip(of_before).enumerate() {
                    if a == b {
                        continue;
                    }
                    let [snr, of_before] =
                        [pixel, before].map(|first| labelling.heights[first + index]);
                    let found = Saddle {
                        tops: [a.min(b), a.max(b)],
                        snr: snr.min(of_before),
                    };
                    let last = &mut recent[found.slot(bits)];
                    if last.tops == found.tops {
                        last.snr = last.snr.max(found.snr);
                    } else {
                        saddles.push(std::mem::replace(last, found));
                        if saddles.len() == many {
                            leave_out_repeated(saddles);
                            many = MANY_SADDLES.max(2 * saddles.len());
                        }
                    }
                }
            },
        )?;
        saddles.append(recent);
        saddles.retain(|saddle| saddle.tops[0] != saddle.tops[1]);
        Ok(())
    }

    /// Sets the prominences of the peaks; `peak_pixels` holds the pixel of each, in ascending order,
    /// and its run.
    ///
    /// A peak next to a higher pixel has none: the noise, in units of which heights are, changes from
    /// pixel to pixel.
    pub fn set(&mut self, heights: &[f32], peak_pixels: &[[u32; 2]], peaks: &mut [Peak]) {
        let Self { tops, saddles, .. } = self;
        for (peak, &[pixel, _]) in peaks.iter_mut().zip(peak_pixels) {
            if tops[pixel as usize] != pixel {
                peak.prominence = 0.0;
            }
        }
        saddles.sort_unstable_by(|a, b| b.snr.total_cmp(&a.snr));
        for saddle in saddles {
            let [a, b] = saddle.tops.map(|top| root_of(tops, top) as usize);
            if a == b {
                continue;
            }
            let [low, high] = by_height(heights, [a, b]);
            let peak = peak_pixels.binary_search_by_key(&low, |&[pixel, _]| pixel as usize);
            if let Ok(peak) = peak {
                peaks[peak].prominence = heights[low] - saddle.snr;
            }
            tops[low] = high as u32;
        }
    }
}

/// Moves the top of pixels to the pixel next to each if that is higher than the steepest so far, of
/// equal ones to the first in reading order; `first` is the index of the first of those next to them.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn climb(steepest: &mut [f32], tops: &mut [u32], next_to: &[f32], first: u32) {
    for (index, ((steepest, top), &height)) in
        (first..).zip(steepest.iter_mut().zip(tops).zip(next_to))
    {
        let is_higher = (height > *steepest) | ((height == *steepest) & (index < *top));
        *steepest = if is_higher { height } else { *steepest };
        *top = if is_higher { index } else { *top };
    }
}

/// The lower of two pixels, and the higher.
fn by_height(heights: &[f32], [a, b]: [usize; 2]) -> [usize; 2] {
    if is_higher(heights, a, b) {
        [b, a]
    } else {
        [a, b]
    }
}

/// Whether pixel `a` is higher than `b`; of equal ones the first in reading order is.
fn is_higher(heights: &[f32], a: usize, b: usize) -> bool {
    let [of_a, of_b] = [a, b].map(|index| heights[index]);
    of_a > of_b || (of_a == of_b && a < b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const THRESHOLD: u8 = 3;

    /// A pixel above the threshold.
    #[derive(Debug)]
    struct BrightPixel {
        x: u32,
        y: u32,
        snr: f32,
    }

    /// The pixels of a frame above the threshold.
    fn labelling(width: usize, values: &[u8]) -> (Labelling, Vec<BrightPixel>) {
        let mut labelling = Labelling::default();
        let mut pixels = Vec::new();
        for (index, &value) in values.iter().enumerate() {
            if value >= THRESHOLD {
                let (x, y) = ((index % width) as u32, (index / width) as u32);
                let snr = f32::from(value);
                labelling.add(x, y, &[snr]);
                pixels.push(BrightPixel { x, y, snr });
            }
        }
        labelling.connect();
        (labelling, pixels)
    }

    fn are_adjacent(a: &BrightPixel, b: &BrightPixel) -> bool {
        a.x.abs_diff(b.x) <= 1 && a.y.abs_diff(b.y) <= 1
    }

    /// Indices of the pixels that are reached from one through none below `level`.
    fn flooded(pixels: &[BrightPixel], pixel: usize, level: f32) -> Vec<usize> {
        let mut reached = vec![pixel];
        let mut next = 0;
        while let Some(&from) = reached.get(next) {
            next += 1;
            for (index, pixel) in pixels.iter().enumerate() {
                let is_new = pixel.snr >= level && !reached.contains(&index);
                if is_new && are_adjacent(pixel, &pixels[from]) {
                    reached.push(index);
                }
            }
        }
        reached
    }

    /// The prominence of a pixel: down to where its flood reaches a higher one, or its height.
    fn expected(pixels: &[BrightPixel], pixel: usize) -> f32 {
        let height = pixels[pixel].snr;
        let mut levels = (THRESHOLD..=height as u8).rev().map(f32::from);
        let reaches_higher = |level: &f32| {
            let reached = flooded(pixels, pixel, *level);
            let heights: Vec<f32> = pixels.iter().map(|pixel| pixel.snr).collect();
            reached
                .iter()
                .any(|&index| is_higher(&heights, index, pixel))
        };
        levels
            .find(reaches_higher)
            .map_or(height, |level| height - level)
    }

    fn peak(pixel: &BrightPixel) -> Peak {
        Peak {
            x: pixel.x as usize,
            y: pixel.y as usize,
            offset_px: [0.0; 2],
            values: None,
            snr: pixel.snr,
            prominence: pixel.snr,
            region: 0,
            saturated: false,
        }
    }

    proptest! {
        #[test]
        fn prominences_are_those_of_a_flood(
            width in 3..14_usize,
            values in prop::collection::vec(0..9_u8, 20..150),
        ) {
            let (labelling, pixels) = labelling(width, &values);
            let peak_pixels: Vec<[u32; 2]> = (0..pixels.len() as u32).map(|pixel| [pixel, 0]).collect();
            let mut peaks: Vec<Peak> = pixels.iter().map(peak).collect();

            let frame = vec![0.0; values.len()];
            let view = View::new(&frame, width, values.len() / width);
            let mut prominence = Prominence::default();
            prominence.find_tops(&labelling, &view, |_| true).unwrap();
            prominence.find_saddles(&labelling, &view, |_| true).unwrap();
            prominence.set(&labelling.heights, &peak_pixels, &mut peaks);

            for (pixel, peak) in peaks.iter().enumerate() {
                prop_assert_eq!(peak.prominence, expected(&pixels, pixel), "{:?}", pixels[pixel]);
            }
        }
    }
}
