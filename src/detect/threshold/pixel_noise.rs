//! The distribution of noise that is coarse or cut off, measured on the pixels of a frame.
//!
//! Noise below a quantisation step, and noise that is cut off at zero, are skewed and heavy-tailed.
//! Their cumulants K are those of the pixels' histogram.

use super::filter_weights::{FilterWeights, sum_of_powers};
use super::saddlepoint::{
    CumulantTable, MAX_RAISE, SIGMA_PER_KURTOSIS, after_clipping, quantile_for_skewness,
    saddlepoint_quantile,
};
use super::star_free::{MIN_SAMPLES, NoiseBuffers, StarFree};
use crate::detect::background::{Mesh, Piece};
use crate::detect::pixels::View;
use multiversion::multiversion;

/// Number of pixels that are sampled, about.
const SAMPLES: usize = 20_000;
/// Pixels within this many standard deviations are counted; what is further off is no noise.
const CLIP_SIGMA: f32 = 10.0;
/// Bins per standard deviation.
const BINS_PER_SIGMA: f32 = 8.0;
/// Number of bins.
const BINS: usize = (2.0 * CLIP_SIGMA * BINS_PER_SIGMA) as usize;

/// The distribution of the pixels of a frame without its stars, in units of their noise.
#[derive(Debug, Clone)]
pub(crate) struct PixelNoise {
    /// Pixels in each bin.
    counts: [f64; BINS],
    /// Pixels in all bins.
    count: f64,
    mean: f64,
    /// Standard deviation, in units of the noise that the frame's mesh has.
    pub sigma: f64,
    skewness: f64,
    excess_kurtosis: f64,
}

impl PixelNoise {
    /// Measures a sample of the rows of `view` where it is free of stars; `None` for too few
    /// pixels.
    pub fn measure(
        view: &View<'_>,
        mesh: &Mesh,
        star_free: &StarFree<'_>,
        buffers: &mut NoiseBuffers,
    ) -> Option<Self> {
        let mut histogram = [0u32; BINS + 1];
        let NoiseBuffers {
            bins,
            row,
            pieces,
            nodes,
            ..
        } = buffers;
        bins.resize(view.width, 0);
        let step = (view.width * view.height / SAMPLES).max(1);
        for y in (step / 2..view.height).step_by(step) {
            mesh.row_pieces(y, pieces);
            let row = view.row(y).as_floats(row);
            for piece in pieces.iter() {
                let span = piece.start..piece.end;
                bins_of(&row[span.clone()], piece, &mut bins[span]);
            }
            star_free.spans(y, view, nodes, |span| {
                for &bin in &bins[span] {
                    histogram[usize::from(bin)] += 1;
                }
            });
        }
        Self::of_histogram(&histogram[..BINS])
    }

    /// The distribution with the given number of pixels in each bin; `None` for too few.
    fn of_histogram(histogram: &[u32]) -> Option<Self> {
        let mut counts = [0.0; BINS];
        for (count, &n) in counts.iter_mut().zip(histogram) {
            *count = f64::from(n);
        }
        let moment = |power: i32, center: f64| -> f64 {
            let terms = counts.iter().enumerate();
            terms
                .map(|(i, n)| n * (bin_center(i) - center).powi(power))
                .sum()
        };
        let count = moment(0, 0.0);
        if count < MIN_SAMPLES {
            return None;
        }
        let mean = moment(1, 0.0) / count;
        let sigma = (moment(2, mean) / count).sqrt();
        let skewness = moment(3, mean) / (count * sigma.powi(3));
        let excess_kurtosis = moment(4, mean) / (count * sigma.powi(4)) - 3.0;
        (sigma > 0.0).then_some(Self {
            counts,
            count,
            mean,
            sigma,
            skewness,
            excess_kurtosis,
        })
    }

    /// K of the standardised pixels in steps of `step`.
    fn tabulate(&self, step: f64) -> CumulantTable {
        let mut terms = [[0.0; 3]; BINS];
        for (i, (term, &n)) in terms.iter_mut().zip(&self.counts).enumerate() {
            if n > 0.0 {
                let x = (bin_center(i) - self.mean) / self.sigma;
                *term = [x, n / self.count, libm::exp(step * x)];
            }
        }
        CumulantTable::new(step, |_| {
            let [mut zeroth, mut first, mut second] = [0.0; 3];
            for [x, part, factor] in &mut terms {
                zeroth += *part;
                first += *part * *x;
                second += *part * *x * *x;
                *part *= *factor;
            }
            let slope = first / zeroth;
            [libm::log(zeroth), slope, second / zeroth - slope * slope]
        })
    }

    /// The threshold that the filtered noise exceeds as often as Gaussian noise exceeds `u`; at
    /// least `u`. It is in units of the noise that a mesh measures in the filtered frame, or of
    /// `known_sigma` times the filtered noise.
    pub fn threshold(&self, u: f64, filter: &FilterWeights, known_sigma: Option<f64>) -> f64 {
        let table = self.tabulate(CumulantTable::step_for(filter));
        // A small sample lacks the tail that the saddlepoint depends on, but has the skewness.
        let quantile = |weights: &[(f64, f64)]| {
            let skewness = sum_of_powers(weights, 3) * self.skewness;
            let far = saddlepoint_quantile(&table, weights, u)?;
            Some(far.max(quantile_for_skewness(u, skewness)))
        };
        let cubes = sum_of_powers(&filter.inside, 3);
        let fourths = sum_of_powers(&filter.inside, 4);
        let (mean, sigma) = match known_sigma {
            Some(sigma) => (0.0, sigma),
            None => after_clipping(cubes * self.skewness, fourths * self.excess_kurtosis),
        };
        // The mesh has the mean of the interior; that of the border differs.
        let sums = [&filter.at_border, &filter.inside].map(|weights| sum_of_powers(weights, 1));
        let shift = self.mean / self.sigma * (sums[0] - sums[1]);
        let Some(of_frame) = filter.quantile_of_frame(u, shift, quantile) else {
            return u;
        };
        let raise = (of_frame - mean) / sigma - u;
        if raise > self.error_of_raise(u, cubes, fourths) {
            u + raise.min(MAX_RAISE * u)
        } else {
            u
        }
    }

    /// The standard error of a raised threshold, from those of skewness and kurtosis of a Gaussian
    /// sample; `cubes` and `fourths` are the filter's sums of powers.
    fn error_of_raise(&self, u: f64, cubes: f64, fourths: f64) -> f64 {
        // By Cornish and Fisher's expansion.
        let per_skewness = (u * u - 1.0) / 6.0;
        let per_kurtosis = (u.powi(3) - 3.0 * u) / 24.0 - SIGMA_PER_KURTOSIS * u;
        let of_skewness = per_skewness * cubes * (6.0 / self.count).sqrt();
        let of_kurtosis = per_kurtosis * fourths * (24.0 / self.count).sqrt();
        libm::hypot(of_skewness, of_kurtosis)
    }
}

/// Sets the bin of each pixel of a piece of a row; [`BINS`] for NaN and outliers.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn bins_of(row: &[f32], piece: &Piece, bins: &mut [u16]) {
    let piece = *piece;
    for (i, (bin, &pixel)) in bins.iter_mut().zip(row).enumerate() {
        let t = i as i32 as f32;
        let value = (pixel - (piece.background + t * piece.background_slope))
            * (piece.inverse_sigma + t * piece.inverse_sigma_slope);
        let position = (value + CLIP_SIGMA) * BINS_PER_SIGMA;
        let inside = position >= 0.0 && position < BINS as f32;
        *bin = if inside { position } else { BINS as f32 } as i32 as u16;
    }
}

/// The value at the centre of a bin.
fn bin_center(i: usize) -> f64 {
    (i as f64 + 0.5) / f64::from(BINS_PER_SIGMA) - f64::from(CLIP_SIGMA)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::size::Size;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Exp1, StandardNormal};

    fn noise_of(draw: impl Fn(&mut rand_chacha::ChaCha8Rng) -> f64) -> PixelNoise {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut histogram = vec![0u32; BINS];
        for _ in 0..400_000 {
            let bin = (draw(&mut rng) + f64::from(CLIP_SIGMA)) * f64::from(BINS_PER_SIGMA);
            if let Some(count) = histogram.get_mut(bin as usize) {
                *count += 1;
            }
        }
        PixelNoise::of_histogram(&histogram).expect("enough samples")
    }

    #[test]
    fn gaussian_noise_raises_nothing_and_exponential_noise_has_the_gamma_tail() {
        let gaussian = noise_of(|rng| StandardNormal.sample(rng));
        let filter = FilterWeights::for_spot(1.0, 3, Size::new(100, 100));
        assert!(gaussian.threshold(4.5, &filter, Some(1.0)) - 4.5 < 0.03);

        // Sixteen exponential pixels of equal weight make a Gamma of shape 16: Q(16, x) = 3.4e-6,
        // that of a Gaussian beyond 4.5, at x = 40.74.
        let exponential = noise_of(|rng| Distribution::<f64>::sample(&Exp1, rng) - 1.0);
        let table = exponential.tabulate(9.0 * 0.25 / 48.0);
        let at = saddlepoint_quantile(&table, &[(16.0, 0.25)], 4.5).expect("a tail");
        assert!((at - (40.74 - 16.0) / 4.0).abs() < 0.1, "{at}");
    }
}
