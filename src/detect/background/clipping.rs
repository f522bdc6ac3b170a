//! Mean and standard deviation of samples with outliers, by clipping at three standard deviations.

use crate::detect::pixels::{PixelRows, pairwise_sum};
use multiversion::multiversion;

/// Samples further off than this many standard deviations are not counted: 99.7 % of Gaussian noise
/// is.
const CLIP_SIGMA: f32 = 3.0;
/// The standard deviation of a Gaussian clipped at ±3σ, over σ.
const CLIPPED_SHRINK: f32 = 0.986_58;
/// The part of an error of σ that is left after a round of clipping: d ln s/d ln k at k = 3, with s
/// the standard deviation of a Gaussian clipped at ±kσ. Each round extrapolates to where many would
/// lead.
const ERROR_LEFT_BY_ROUND: f32 = 0.11;
/// Most rounds of clipping; one to three are usual.
const MAX_ROUNDS: usize = 8;
/// Fewer samples than this have no mean.
pub(crate) const MIN_SAMPLES: usize = 12;
/// Distance of the two pixels of a difference.
pub(crate) const DIFFERENCE_PX: usize = 2;
/// Samples summed side by side.
const LANES: usize = 32;
/// How many of them are in a vector.
const PART: usize = 8;

/// Mean and standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gaussian {
    /// The mean.
    pub mean: f32,
    /// The standard deviation.
    pub sigma: f32,
}

/// Changes, in units of σ, below which clipping has converged.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tolerance {
    /// Of the mean.
    pub mean: f32,
    /// Of the standard deviation.
    pub sigma: f32,
}

/// Samples of a cell: its pixels, or what they are above others.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CellSamples<'a> {
    /// The pixels.
    pub rows: PixelRows<'a>,
    /// As many pixels that are taken from these.
    pub less: Option<PixelRows<'a>>,
}

/// Mean and standard deviation without outliers, from a first estimate; `None` for too few samples.
/// NaN is left out. The standard deviation is at least `floor`.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn clipped(
    samples: &CellSamples,
    start: Gaussian,
    floor: f32,
    tolerance: Tolerance,
) -> Option<Gaussian> {
    let (mut center, mut sigma) = (start.mean, start.sigma.max(floor));
    for round in 0..MAX_ROUNDS {
        let [count, sum, squares] = clipped_moments(samples, center, CLIP_SIGMA * sigma);
        if count < MIN_SAMPLES as f32 {
            return (round > 0).then_some(Gaussian {
                mean: center,
                sigma,
            });
        }
        let mean = sum / count;
        let variance = (squares / count - mean * mean).max(0.0);
        let clipped = variance.sqrt() / CLIPPED_SHRINK;
        let new_sigma = (sigma + (clipped - sigma) / (1.0 - ERROR_LEFT_BY_ROUND)).max(0.0);
        let is_settled = (new_sigma - sigma).abs() <= tolerance.sigma * sigma
            && mean.abs() <= tolerance.mean * sigma;
        center += mean;
        sigma = new_sigma.max(floor);
        if is_settled || new_sigma <= floor {
            break;
        }
    }
    Some(Gaussian {
        mean: center,
        sigma,
    })
}

/// Number, sum and sum of squares of `sample - center` where it is at most `half_width` in size.
#[inline(always)]
fn clipped_moments(samples: &CellSamples<'_>, center: f32, half_width: f32) -> [f32; 3] {
    let clip = Clip { center, half_width };
    let mut sums = ClippedSums::default();
    let CellSamples { rows, less } = *samples;
    for y in 0..rows.height {
        let (chunks, rest) = rows.row(y).as_chunks::<LANES>();
        if let Some(less) = less {
            let (other_chunks, other_rest) = less.row(y).as_chunks::<LANES>();
            for (chunk, other) in chunks.iter().zip(other_chunks) {
                sums.add(chunk, other, clip);
            }
            if !rest.is_empty() {
                sums.add(&padded(rest), &padded(other_rest), clip);
            }
        } else {
            for chunk in chunks {
                sums.add(chunk, &[0.0; LANES], clip);
            }
            if !rest.is_empty() {
                sums.add(&padded(rest), &[0.0; LANES], clip);
            }
        }
    }
    sums.total()
}

/// Which samples count.
#[derive(Clone, Copy)]
struct Clip {
    center: f32,
    half_width: f32,
}

/// A vector of samples.
type Part = [f32; PART];

/// Sums side by side, in registers: no lane is ever picked out by its number, and all parts share one count.
#[derive(Clone, Copy, Default)]
struct ClippedSums {
    count: [u32; PART],
    sum: [Part; LANES / PART],
    squares: [Part; LANES / PART],
}

impl ClippedSums {
    /// Adds samples less others.
    #[allow(
        clippy::needless_range_loop,
        reason = "lanes of several arrays read best as indices"
    )]
    #[inline(always)]
    fn add(&mut self, samples: &[f32; LANES], less: &[f32; LANES], clip: Clip) {
        let (samples, less) = (samples.as_chunks::<PART>().0, less.as_chunks::<PART>().0);
        for part in 0..LANES / PART {
            let (samples, less) = (samples[part], less[part]);
            let mut kept = [0.0; PART];
            let mut inside = [0u32; PART];
            for lane in 0..PART {
                let deviation = samples[lane] - less[lane] - clip.center;
                let is_inside = deviation.abs() <= clip.half_width;
                kept[lane] = if is_inside { deviation } else { 0.0 };
                inside[lane] = u32::from(is_inside);
            }
            for lane in 0..PART {
                self.count[lane] += inside[lane];
            }
            for lane in 0..PART {
                self.sum[part][lane] += kept[lane];
            }
            for lane in 0..PART {
                self.squares[part][lane] += kept[lane] * kept[lane];
            }
        }
    }

    #[inline(always)]
    fn total(self) -> [f32; 3] {
        let mut total = 0;
        for count in self.count {
            total += count;
        }
        let [mut sum, mut squares] = [[0.0; LANES]; 2];
        sum.copy_from_slice(self.sum.as_flattened());
        squares.copy_from_slice(self.squares.as_flattened());
        [total as f32, pairwise_sum(sum), pairwise_sum(squares)]
    }
}

/// The last samples of a row; NaN, which does not count, after them.
#[inline(always)]
fn padded(rest: &[f32]) -> [f32; LANES] {
    let mut lanes = [f32::NAN; LANES];
    lanes[..rest.len()].copy_from_slice(rest);
    lanes
}
