//! A square of pixels around an expected star, with its background and noise.

use crate::base::statistics::median;
use crate::detect::background::rounding_sigma_adu;
use crate::detect::fit::Window;
use crate::detect::pixels::Samples;
use crate::detect::psf::GROUP_PX;
use crate::frame::Frame;
use multiversion::multiversion;

/// Width of the ring in which background and noise are measured, in pixels.
const RING_PX: usize = 2;
/// Parts of the ring whose medians are where clipping starts: a star in the ring spoils one or two.
const PARTS: usize = 5;
/// Values beyond this many standard deviations are clipped, …
const CLIP_SIGMAS: f32 = 3.0;
/// … and the variance of a Gaussian that is cut off there.
const CLIPPED_VARIANCE: f32 = 0.973_3;
/// Rounds of clipping.
const ROUNDS: usize = 2;
/// Precision of the pixels' numbers: no noise is smaller.
const RELATIVE_PRECISION: f32 = 1e-6;

/// A square of pixels of a frame.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Square {
    /// Column and row of its first pixel.
    pub x0: usize,
    pub y0: usize,
    /// Its side, in pixels.
    pub side: usize,
    /// Where its pixels begin in the buffer.
    pub start: usize,
    /// Background, in ADU.
    pub background_adu: f32,
    /// Noise of a pixel, in ADU.
    pub noise_adu: f32,
    /// Pixels of the ring that were not clipped.
    pub ring_pixels: usize,
}

impl Square {
    /// The square around a pixel; `None` where it is not all within the frame.
    pub fn around([x, y]: [f64; 2], half: usize, frame: &Frame) -> Option<Self> {
        let first = |at: f64| nearest(at)?.checked_sub(half);
        let (x0, y0, side) = (first(x)?, first(y)?, 2 * half + 1);
        (x0 + side <= frame.width && y0 + side <= frame.height).then_some(Self {
            x0,
            y0,
            side,
            ..Self::default()
        })
    }

    /// Appends its pixels to `pixels`, and measures background and noise in its ring.
    pub fn read(&mut self, frame: &Frame, pixels: &mut Vec<f32>, ring: &mut Vec<f32>) {
        self.start = pixels.len();
        copy_pixels(frame, self, pixels);
        let own = &pixels[self.start..];
        ring.clear();
        let (across, side) = (RING_PX * self.side, self.side);
        ring.extend_from_slice(&own[..across]);
        for row in own[across..own.len() - across].chunks_exact(side) {
            ring.extend([row[0], row[1], row[side - 2], row[side - 1]]);
        }
        ring.extend_from_slice(&own[own.len() - across..]);
        let [background, sigma, count] = clipped(ring);
        let floor = rounding_sigma_adu(frame.step_adu)
            .max(RELATIVE_PRECISION * background.abs())
            .max(f32::MIN_POSITIVE * 1e6);
        self.background_adu = background;
        self.noise_adu = sigma.max(floor);
        self.ring_pixels = count as usize;
    }

    /// Its pixels in the buffer.
    pub fn pixels<'a>(&self, pixels: &'a [f32]) -> &'a [f32] {
        &pixels[self.start..self.start + self.side * self.side]
    }

    /// Standard error of the background, in ADU.
    pub fn background_error_adu(&self) -> f64 {
        f64::from(self.noise_adu) / (self.ring_pixels.max(1) as f64).sqrt()
    }

    /// Fills `window` with the pixels within `radius` of a place in the frame, above the background
    /// and in units of the noise; pixels at `saturation_adu` and above are left out.
    pub fn cut_out(
        &self,
        pixels: &[f32],
        [x, y]: [f64; 2],
        radius: usize,
        saturation_adu: f32,
        window: &mut Window,
    ) {
        let span = |center: f64, first: usize| {
            let center = nearest(center).unwrap_or(0).saturating_sub(first);
            let from = center.saturating_sub(radius);
            (from, (center + radius + 1).min(self.side).max(from) - from)
        };
        let ((column, width), (row, height)) = (span(x, self.x0), span(y, self.y0));
        (window.x0, window.width) = (self.x0 + column, width);
        (window.y0, window.height) = (self.y0 + row, height);
        window.noise_adu = f64::from(self.noise_adu);
        let groups = window.groups();
        window.data.clear();
        window.data.resize(groups * height, [f32::NAN; GROUP_PX]);
        let per_noise = 1.0 / self.noise_adu;
        let rows = self.pixels(pixels).chunks_exact(self.side).skip(row);
        for (to, from) in window.data.chunks_exact_mut(groups.max(1)).zip(rows) {
            let from = &from[column..column + width];
            for (to, &pixel) in to.as_flattened_mut().iter_mut().zip(from) {
                let above = (pixel - self.background_adu) * per_noise;
                *to = if pixel < saturation_adu {
                    above
                } else {
                    f32::NAN
                };
            }
        }
    }
}

/// The pixel nearest to a place; `None` before the first one.
pub(super) fn nearest(at_px: f64) -> Option<usize> {
    // A cast cuts off, and needs no call.
    (at_px >= -0.5).then_some((at_px + 0.5) as usize)
}

/// Appends the pixels of `square` to `pixels`: the one place that reads the frame.
fn copy_pixels(frame: &Frame, square: &Square, pixels: &mut Vec<f32>) {
    for y in square.y0..square.y0 + square.side {
        let first = y * frame.width + square.x0;
        let row = Samples::from(&frame.pixels).span(first..first + square.side);
        let start = pixels.len();
        pixels.resize(start + square.side, 0.0);
        row.copy_to(&mut pixels[start..]);
    }
}

/// Mean, standard deviation and number of the values, without those far off and NaN.
fn clipped(values: &[f32]) -> [f32; 3] {
    let (mut means, mut variances) = ([0.0f32; PARTS], [0.0f32; PARTS]);
    let mut parts = 0;
    for part in values.chunks(values.len().div_ceil(PARTS).max(2)) {
        let first = part.first().copied().unwrap_or_default();
        let [count, sum, squares] = part.iter().fold([0.0f32; 3], |[n, s, q], value| {
            let off = value - first;
            [n + 1.0, s + off, q + off * off]
        });
        // A part with a pixel without a value does not count.
        if count >= 2.0 && squares.is_finite() {
            let mean = sum / count;
            means[parts] = first + mean;
            variances[parts] = (squares - sum * mean) / (count - 1.0);
            parts += 1;
        }
    }
    if parts == 0 {
        return [0.0; 3];
    }
    let mut mean = median(&mut means[..parts]);
    let mut variance = median(&mut variances[..parts]).max(0.0);
    let mut used = 0.0;
    for _ in 0..ROUNDS {
        let reach = CLIP_SIGMAS * variance.sqrt();
        let [count, sum, squares] = moments(values, mean, reach);
        if count < 2.0 {
            break;
        }
        let shift = sum / count;
        variance = (squares - sum * shift).max(0.0) / (count - 1.0) / CLIPPED_VARIANCE;
        mean += shift;
        used = count;
    }
    [mean, variance.sqrt(), used]
}

/// Number, sum and sum of squares of the differences to `center` that are within `reach`.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn moments(values: &[f32], center: f32, reach: f32) -> [f32; 3] {
    const LANES: usize = 16;
    let mut sums = [[0.0f32; LANES]; 3];
    let mut add = |lane: usize, value: f32| {
        let off = value - center;
        let is_used = off.abs() <= reach;
        sums[0][lane] += if is_used { 1.0 } else { 0.0 };
        sums[1][lane] += if is_used { off } else { 0.0 };
        sums[2][lane] += if is_used { off * off } else { 0.0 };
    };
    let (chunks, rest) = values.as_chunks::<LANES>();
    for chunk in chunks {
        for (lane, &value) in chunk.iter().enumerate() {
            add(lane, value);
        }
    }
    for (lane, &value) in rest.iter().enumerate() {
        add(lane, value);
    }
    sums.map(|lanes| lanes.iter().sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;

    #[test]
    fn a_ring_with_a_star_in_it_has_the_background_and_noise_of_the_sky() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let (mut mean, mut variance) = (0.0, 0.0);
        const TRIALS: usize = 2000;
        for _ in 0..TRIALS {
            let mut ring: Vec<f32> = (0..104)
                .map(|_| 200.0 + 4.0 * rng.sample::<f32, _>(StandardNormal))
                .collect();
            for (i, value) in ring[30..36].iter_mut().enumerate() {
                *value += 50.0 * (i + 1) as f32;
            }
            ring[7] = f32::NAN;
            let [center, sigma, count] = clipped(&ring);
            assert!(count <= 97.0);
            mean += f64::from(center) / TRIALS as f64;
            variance += f64::from(sigma * sigma) / TRIALS as f64;
        }
        // Ten standard errors of the mean, and 3 % of the noise.
        assert!((mean - 200.0).abs() < 0.1, "{mean}");
        assert!((variance.sqrt() / 4.0 - 1.0).abs() < 0.03, "{variance}");
    }

    #[test]
    fn squares_beyond_the_border_are_none() {
        let frame = Frame::new(40, 30, vec![0.0; 1200]).unwrap();
        assert!(Square::around([5.4, 20.0], 6, &frame).is_none());
        assert!(Square::around([33.0, 24.0], 6, &frame).is_none());
        let square = Square::around([6.0, 23.4], 6, &frame).unwrap();
        assert_eq!((square.x0, square.y0, square.side), (0, 17, 13));
    }
}
