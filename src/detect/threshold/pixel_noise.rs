//! How far the noise of the frame's pixels is from Gaussian, and what threshold makes up for it.
//!
//! Photon noise is skewed, noise below a quantisation step and noise cut off at zero are both skewed
//! and heavy-tailed. A filtered value is a sum `Σ W_p x_p` of independent pixels, so the logarithm of
//! its moment-generating function is `Σ K(t W_p)`, with the pixels' own K. Of coarse and cut-off noise it is measured
//! on the frame where nothing stands out; photons have that of the Poisson distribution, with a skewness that is
//! measured there and told apart from that of faint stars. The saddlepoint approximation turns it into a tail:
//! `P(> K'(t)) = Φ̄(w + ln(v/w)/w)`, `w = √(2(tK' − K))`, `v = t √K''`. To leading order this is the
//! Cornish–Fisher correction; unlike it, it stays right for strong skews and far tails.
//!
//! # Reference
//! Lugannani & Rice 1980, doi 10.2307/1426607; Barndorff-Nielsen 1986, doi 10.1093/biomet/73.2.307,
//! for the form used here.

use crate::detect::background::{Mesh, Piece, sum_of};
use crate::detect::filter::normalise;
use crate::detect::pixels::{BLOCK_PX, BlockMaxima, View};
use crate::detect::psf::{AxisProfile, MAX_TAPS, MAX_WINDOW_PX, centered_profile};
use arrayvec::ArrayVec;
use multiversion::multiversion;
use std::ops::Range;

/// Pixels whose values are looked at, about.
const SAMPLES: usize = 20_000;
/// Fewer tell nothing about tails.
const MIN_SAMPLES: f64 = 2000.0;
/// Deviations up to this many standard deviations are counted: what lies beyond is no noise.
const CLIP_SIGMA: f32 = 10.0;
/// Bins per standard deviation.
const BINS_PER_SIGMA: f32 = 8.0;
const BINS: usize = (2.0 * CLIP_SIGMA * BINS_PER_SIGMA) as usize;
/// Rows above and below that must be free of stars as well: their wings.
const WING_ROWS: [usize; 2] = [4, 9];
/// The range of t, and the steps in which K is tabulated over it.
const LEAST_T: f64 = 0.3;
const MAX_T: f64 = 9.0;
/// Halvings of it: to 0.002.
const BISECTIONS: usize = 12;
const STEPS: usize = 48;
/// What clipping at ±3σ, until it settles, does to the mean of a nearly Gaussian sample, per skewness,
/// and to its standard deviation, per excess kurtosis and per squared skewness (Edgeworth's series).
const MEAN_PER_SKEWNESS: f64 = -0.041;
const SIGMA_PER_KURTOSIS: f64 = -0.0425;
const SIGMA_PER_SQUARED_SKEWNESS: f64 = -0.0265;
/// Below this the series is no longer to be trusted.
const LEAST_CLIPPED_SIGMA: f64 = 0.85;
/// A correction below so many of its standard errors is chance.
const SIGNIFICANT: f64 = 1.0;
/// Pixels along the border where half of the filter is cut off, or nearly.
const BORDER_PX: f64 = 1.0;
/// A pixel further off than this many standard deviations is a hot one or a star's, and no photon noise.
const PHOTON_CLIP_SIGMA: f32 = 6.0;
/// Pixels whose third moments are looked at, about: their standard errors are then some 0.01.
const PHOTON_SAMPLES: usize = 75_000;
/// Noise of neighbours that is correlated more than this is no longer that of photons counted; faint stars make 0.02.
const MAX_CORRELATION: f64 = 0.1;
/// The border's threshold is taken to be higher than the interior's by no more than this.
const MAX_BORDER_RAISE: f64 = 2.0;
/// A skewness below this raises no threshold by a hundredth of the noise.
const LEAST_SKEWNESS: f64 = 1e-3;
/// The threshold is raised by no more than this part of it.
const MAX_RAISE: f64 = 1.0;

/// The distribution of the pixels of a frame where no star is, in units of their noise.
#[derive(Debug, Clone)]
pub(crate) struct PixelNoise {
    counts: [f64; BINS],
    count: f64,
    mean: f64,
    /// Standard deviation, in units of the mesh of the unfiltered frame.
    pub sigma: f64,
    skewness: f64,
    excess_kurtosis: f64,
}

/// Buffers for rows of pixels.
#[derive(Debug, Clone, Default)]
pub(crate) struct NoiseWork {
    bins: Vec<u16>,
    standardised: Vec<f32>,
    pieces: Vec<Piece>,
    nodes: Vec<[f32; 2]>,
}

/// K and its first two derivatives.
type Cumulants = [f64; 3];
/// K in equal steps from 0 on.
type Table = [Cumulants; STEPS + 1];

impl PixelNoise {
    /// Takes samples of `view` where the filtered frame stays below `u`; `None` where there is too
    /// little of that.
    pub fn measure(
        view: &View<'_>,
        mesh: &Mesh,
        star_free: &StarFree<'_>,
        work: &mut NoiseWork,
    ) -> Option<Self> {
        let mut histogram = [0u32; BINS + 1];
        let NoiseWork {
            bins,
            pieces,
            nodes,
            ..
        } = work;
        bins.resize(view.width, 0);
        let step = (view.width * view.height / SAMPLES).max(1);
        for y in (step / 2..view.height).step_by(step) {
            mesh.row_pieces(y, pieces);
            let row = view.row(y);
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

    /// K of the standardised pixels, at 0, `step`, 2 `step`, …
    fn tabulate(&self, step: f64) -> Table {
        let mut terms = [[0.0; 3]; BINS];
        for (i, (term, &n)) in terms.iter_mut().zip(&self.counts).enumerate() {
            if n > 0.0 {
                let x = (bin_center(i) - self.mean) / self.sigma;
                *term = [x, n / self.count, (step * x).exp()];
            }
        }
        std::array::from_fn(|_| {
            let [mut zeroth, mut first, mut second] = [0.0; 3];
            for [x, part, factor] in &mut terms {
                zeroth += *part;
                first += *part * *x;
                second += *part * *x * *x;
                *part *= *factor;
            }
            let slope = first / zeroth;
            [zeroth.ln(), slope, second / zeroth - slope * slope]
        })
    }

    /// The threshold that noise filtered with `kernel` exceeds as often as Gaussian noise exceeds `u`;
    /// never below `u`. It is in units of the spread that a mesh measures on the filtered noise, or of
    /// `known_spread` times the filtered noise.
    pub fn threshold(&self, u: f64, kernel: &Weights, known_spread: Option<f64>) -> f64 {
        let step = MAX_T * kernel.largest / STEPS as f64;
        let table = self.tabulate(step);
        // A small sample lacks the tail that the saddlepoint looks at, but has the skewness.
        let quantile = |weights: &[(f64, f64)]| {
            let skewness = sum(weights, 3) * self.skewness;
            let far = exceeded(&table, step, weights, u)?;
            Some(far.max(for_skewness(u, skewness)))
        };
        let (cubes, fourths) = (sum(&kernel.inside, 3), sum(&kernel.inside, 4));
        let (mean, sigma) = match known_spread {
            Some(spread) => (0.0, spread),
            None => clipped(cubes * self.skewness, fourths * self.excess_kurtosis),
        };
        // The mesh has the mean of the interior; the fewer pixels at the border have another.
        let shift = self.mean / self.sigma * (sum(&kernel.at_border, 1) - sum(&kernel.inside, 1));
        let Some(of_frame) = kernel.quantile_of_frame(u, shift, quantile) else {
            return u;
        };
        let raise = (of_frame - mean) / sigma - u;
        // The errors of skewness and kurtosis of a Gaussian sample, by Cornish and Fisher.
        let per_skewness = (u * u - 1.0) / 6.0;
        let per_kurtosis = (u.powi(3) - 3.0 * u) / 24.0 - SIGMA_PER_KURTOSIS * u;
        let of_skewness = per_skewness * cubes * (6.0 / self.count).sqrt();
        let of_kurtosis = per_kurtosis * fourths * (24.0 / self.count).sqrt();
        if raise > SIGNIFICANT * of_skewness.hypot(of_kurtosis) {
            u + raise.min(MAX_RAISE * u)
        } else {
            u
        }
    }
}

/// The threshold that photon noise of pixels with this skewness, filtered with `kernel`, exceeds as often as Gaussian noise
/// exceeds `u`, in units of the spread that a mesh measures on the filtered noise; never below `u`.
///
/// Poisson noise of standard deviation 1 and skewness s has `K(t) = (exp(st) − 1 − st)/s²`.
pub(crate) fn threshold_for_photons(u: f64, skewness: f64, kernel: &Weights) -> f64 {
    if skewness <= LEAST_SKEWNESS {
        return u;
    }
    let step = MAX_T * kernel.largest / STEPS as f64;
    let at = |i: usize| {
        let st = skewness * step * i as f64;
        let above = st.exp_m1();
        [
            (above - st) / (skewness * skewness),
            above / skewness,
            above + 1.0,
        ]
    };
    let table: Table = std::array::from_fn(at);
    let (cubes, fourths) = (sum(&kernel.inside, 3), sum(&kernel.inside, 4));
    let (mean, sigma) = clipped(cubes * skewness, fourths * skewness * skewness);
    let quantile = |weights: &[(f64, f64)]| exceeded(&table, step, weights, u);
    let of_frame = kernel.quantile_of_frame(u, 0.0, quantile);
    of_frame.map_or(u, |of_frame| {
        (((of_frame - mean) / sigma).min(u + MAX_RAISE * u)).max(u)
    })
}

/// The skewness of the pixels' own noise, apart from that of stars too faint to be seen; `None` where too little is free of
/// the stars that are, and where the noise of neighbours goes together: JPEG's, or that of colours interpolated.
///
/// Stars skew the pixels, too, but neighbours together: for noise that is independent from pixel to pixel the cumulant
/// `κ(z, z, z')` of neighbours is 0, for stars it is that of the spot, `ΣP²P'` to `ΣP³` of their own `κ(z, z, z)`.
pub(crate) fn photon_skewness(
    view: &View<'_>,
    mesh: &Mesh,
    star_free: &StarFree<'_>,
    spot_px: f64,
    work: &mut NoiseWork,
) -> Option<f64> {
    let mut sums = [0.0f64; MOMENTS];
    let NoiseWork {
        standardised,
        pieces,
        nodes,
        ..
    } = work;
    standardised.resize(view.width, 0.0);
    let step = (view.width * view.height / PHOTON_SAMPLES).max(1);
    for y in (step / 2..view.height).step_by(step) {
        mesh.row_pieces(y, pieces);
        normalise(view.row(y), pieces, standardised);
        star_free.spans(y, view, nodes, |span| {
            let of_span = moments(&standardised[span]);
            for (sum, part) in sums.iter_mut().zip(of_span) {
                *sum += f64::from(part);
            }
        });
    }
    let [count, ..] = sums;
    if count < MIN_SAMPLES {
        return None;
    }
    let [_, mean, square, cube, product, mixed] = sums.map(|sum| sum / count);
    let variance = square - mean * mean;
    let own = cube - 3.0 * mean * square + 2.0 * mean.powi(3);
    let of_neighbours = mixed - mean * square - 2.0 * mean * product + 2.0 * mean.powi(3);
    let skewness = (own - own_per_mixed(spot_px) * of_neighbours) / variance.powf(1.5);
    let is_independent = product - mean * mean < MAX_CORRELATION * variance;
    (is_independent && skewness.is_finite()).then_some(skewness)
}

/// Number of pairs, and of their first pixels z and second ones z' the sums of z, z², z³, zz', and of z²z' and zz'² half each.
const MOMENTS: usize = 6;

/// The moments of the pairs of neighbours in a row; pixels far off count as background.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn moments(row: &[f32]) -> [f32; MOMENTS] {
    const LANES: usize = 16;
    let mut sums = [[0.0f32; LANES]; MOMENTS];
    let kept = |z: f32| if z.abs() <= PHOTON_CLIP_SIGMA { z } else { 0.0 };
    let pairs = row.len().saturating_sub(1) / LANES * LANES;
    for start in (0..pairs).step_by(LANES) {
        let (Some(first), Some(second)) = (
            row[start..].first_chunk::<LANES>(),
            row[start + 1..].first_chunk::<LANES>(),
        ) else {
            continue;
        };
        for lane in 0..LANES {
            let (a, b) = (kept(first[lane]), kept(second[lane]));
            let (square, product) = (a * a, a * b);
            sums[1][lane] += a;
            sums[2][lane] += square;
            sums[3][lane] += square * a;
            sums[4][lane] += product;
            sums[5][lane] += 0.5 * product * (a + b);
        }
    }
    let mut total = sums.map(sum_of);
    total[0] = pairs as f32;
    total
}

/// `ΣP³ / ΣP²P'` of a spot along a row, each on average over its places within a pixel.
fn own_per_mixed(spot_px: f64) -> f64 {
    const PLACES: usize = 8;
    let radius = ((4.0 * spot_px).ceil() as usize + 1).min(MAX_WINDOW_PX / 2);
    let mut profile = AxisProfile::default();
    let [mut own, mut mixed] = [0.0; 2];
    for place in 0..PLACES {
        let center = radius as f64 + (place as f64 + 0.5) / PLACES as f64 - 0.5;
        profile.fill(center, spot_px, 2 * radius + 1);
        for pair in profile.values()[..2 * radius + 1].windows(2) {
            let [first, second] = [pair[0], pair[1]].map(f64::from);
            own += first.powi(3);
            mixed += 0.5 * first * second * (first + second);
        }
    }
    own / mixed
}

/// Where nothing stands out of the filtered frame.
pub(crate) struct StarFree<'a> {
    /// The maxima of the filtered frame where it may stand out.
    pub maxima: &'a BlockMaxima,
    /// The mesh of the filtered frame.
    pub filtered_mesh: &'a Mesh,
    /// What stands out, in standard deviations of the filtered noise.
    pub limit: f32,
}

impl StarFree<'_> {
    /// The columns of row `y` without stars and their wings, as spans of whole blocks.
    fn spans(
        &self,
        y: usize,
        view: &View<'_>,
        nodes: &mut Vec<[f32; 2]>,
        mut each: impl FnMut(Range<usize>),
    ) {
        let rows = [
            y,
            y.saturating_sub(WING_ROWS[0]),
            y.saturating_sub(WING_ROWS[1]),
            (y + WING_ROWS[0]).min(view.height - 1),
            (y + WING_ROWS[1]).min(view.height - 1),
        ]
        .map(|row| self.maxima.row(row));
        self.filtered_mesh.across_row(y, nodes);
        let mut free = 0..0;
        for block in 0..rows[0].len() {
            let start = block * BLOCK_PX;
            let end = (start + BLOCK_PX).min(view.width);
            let middle = (start + end) as f32 * 0.5;
            let (level, spread) = self.filtered_mesh.at_column(nodes, middle);
            let highest = level + self.limit * spread;
            if rows.iter().all(|r| r[block] < highest) {
                free.end = end;
            } else {
                if !free.is_empty() {
                    each(free);
                }
                free = end..end;
            }
        }
        if !free.is_empty() {
            each(free);
        }
    }
}

/// Weights, each with how often it occurs.
type Weighted = ArrayVec<(f64, f64), { MAX_TAPS * MAX_TAPS }>;

/// The weights of a filter.
#[derive(Debug, Clone)]
pub(crate) struct Weights {
    inside: Weighted,
    at_border: Weighted,
    largest: f64,
    /// The part of the frame that counts as its border.
    border_part: f64,
}

impl Weights {
    /// The matched filter for a spot, out to `radius`, on a frame of `width` times `height` pixels.
    pub fn for_spot(spot_px: f64, radius: usize, (width, height): (usize, usize)) -> Self {
        let profile = centered_profile(spot_px, radius);
        let axis = |sides: f64| -> ArrayVec<(f64, f64), MAX_TAPS> {
            let times = |i: usize| if i == 0 { 1.0 } else { sides };
            let with_times = profile.iter().enumerate().map(|(i, &p)| (times(i), p));
            let weights: ArrayVec<(f64, f64), MAX_TAPS> = with_times.collect();
            let norm = sum(&weights, 2).sqrt();
            weights.iter().map(|&(n, w)| (n, w / norm)).collect()
        };
        let (whole, half) = (axis(2.0), axis(1.0));
        let product = |a: &[(f64, f64)], b: &[(f64, f64)]| -> Weighted {
            let row = |&(n, w): &(f64, f64)| b.iter().map(move |&(m, v)| (n * m, w * v));
            a.iter().flat_map(row).collect()
        };
        let inner = |side: usize| 1.0 - 2.0 * BORDER_PX.min(0.5 * side as f64) / side as f64;
        Self {
            largest: half[0].1 * whole[0].1,
            inside: product(&whole, &whole),
            at_border: product(&half, &whole),
            border_part: 1.0 - inner(width) * inner(height),
        }
    }

    /// What the filtered noise of the frame, interior and border, exceeds as often as Gaussian noise exceeds `u`, by the
    /// quantiles for either weights; `shift` is what the mean at the border is off.
    fn quantile_of_frame(
        &self,
        u: f64,
        shift: f64,
        quantile: impl Fn(&[(f64, f64)]) -> Option<f64>,
    ) -> Option<f64> {
        let (inside, at_border) = (quantile(&self.inside)?, quantile(&self.at_border)?);
        let further = (at_border + shift - inside).min(MAX_BORDER_RAISE);
        Some(inside + (self.border_part * (u * further).exp_m1()).ln_1p() / u)
    }
}

/// Σ n wᵏ.
fn sum(weights: &[(f64, f64)], power: i32) -> f64 {
    weights.iter().map(|(n, w)| n * w.powi(power)).sum()
}

/// Mean and standard deviation that are left of a unit normal sample with some skewness and kurtosis
/// when it is clipped.
fn clipped(skewness: f64, excess_kurtosis: f64) -> (f64, f64) {
    let change =
        SIGMA_PER_KURTOSIS * excess_kurtosis + SIGMA_PER_SQUARED_SKEWNESS * skewness.powi(2);
    (
        MEAN_PER_SKEWNESS * skewness,
        (1.0 + change).max(LEAST_CLIPPED_SIGMA),
    )
}

/// Cornish and Fisher's quantile for a skewness.
fn for_skewness(u: f64, skewness: f64) -> f64 {
    u + (u * u - 1.0) / 6.0 * skewness - (2.0 * u.powi(3) - 5.0 * u) / 36.0 * skewness.powi(2)
}

/// What a sum of standardised pixels with these weights exceeds as often as a Gaussian exceeds `u`;
/// `None` where the tail ends before.
fn exceeded(table: &[Cumulants], step: f64, weights: &[(f64, f64)], u: f64) -> Option<f64> {
    let filtered = |t: f64| -> Cumulants {
        let mut sum = [0.0; 3];
        for &(times, weight) in weights {
            let k = interpolated(table, t * weight / step, step);
            sum[0] += times * k[0];
            sum[1] += times * weight * k[1];
            sum[2] += times * weight * weight * k[2];
        }
        sum
    };
    // The Gaussian quantile of the tail beyond K'(t).
    let quantile = |t: f64| {
        let [k, slope, curvature] = filtered(t);
        let w = (2.0 * (t * slope - k)).max(1e-9).sqrt();
        w + (t * curvature.max(1e-9).sqrt() / w).ln() / w
    };
    let (mut low, mut high) = (LEAST_T, MAX_T);
    if quantile(high) < u {
        return None;
    }
    // Coarse noise has no quantile to speak of at small t: halvings do not look there.
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if quantile(middle) < u {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(filtered(high)[1])
}

/// The bin of each pixel of a piece of a row; [`BINS`] for NaN and outliers.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn bins_of(row: &[f32], piece: &Piece, bins: &mut [u16]) {
    let piece = *piece;
    for (i, (bin, &pixel)) in bins.iter_mut().zip(row).enumerate() {
        let t = i as i32 as f32;
        let value = (pixel - (piece.level + t * piece.level_slope))
            * (piece.inverse + t * piece.inverse_slope);
        let place = (value + CLIP_SIGMA) * BINS_PER_SIGMA;
        let inside = place >= 0.0 && place < BINS as f32;
        *bin = if inside { place } else { BINS as f32 } as i32 as u16;
    }
}

fn bin_center(i: usize) -> f64 {
    (i as f64 + 0.5) / f64::from(BINS_PER_SIGMA) - f64::from(CLIP_SIGMA)
}

/// K at `at` steps of `step`, by cubics through values and slopes.
fn interpolated(table: &[Cumulants], at: f64, step: f64) -> Cumulants {
    let lower = (at as usize).min(table.len() - 2);
    let f = at - lower as f64;
    let (a, b) = (table[lower], table[lower + 1]);
    let (rest, square, rest_square) = (1.0 - f, f * f, (1.0 - f).powi(2));
    let cubic = |i: usize| {
        rest_square * (1.0 + 2.0 * f) * a[i]
            + square * (3.0 - 2.0 * f) * b[i]
            + step * (f * rest_square * a[i + 1] - square * rest * b[i + 1])
    };
    [cubic(0), cubic(1), a[2] + f * (b[2] - a[2])]
}

#[cfg(test)]
mod tests {
    use super::*;
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
        let kernel = Weights::for_spot(1.0, 3, (100, 100));
        assert!(gaussian.threshold(4.5, &kernel, Some(1.0)) - 4.5 < 0.03);

        // Sixteen exponential pixels of equal weight make a Gamma of shape 16: Q(16, x) = 3.4e-6,
        // that of a Gaussian beyond 4.5, at x = 40.74.
        let exponential = noise_of(|rng| Distribution::<f64>::sample(&Exp1, rng) - 1.0);
        let step = MAX_T * 0.25 / STEPS as f64;
        let at = exceeded(&exponential.tabulate(step), step, &[(16.0, 0.25)], 4.5).expect("a tail");
        assert!((at - (40.74 - 16.0) / 4.0).abs() < 0.1, "{at}");
    }
    #[test]
    fn photons_have_the_tail_of_the_poisson_distribution() {
        // 16 pixels of 25 photons each: 400 together, and P(> 497.7) is that of a Gaussian beyond 4.5.
        let kernel = Weights {
            inside: [(16.0, 0.25)].into_iter().collect(),
            at_border: [(16.0, 0.25)].into_iter().collect(),
            largest: 0.25,
            border_part: 0.0,
        };
        let skewness = 1.0 / 25f64.sqrt();
        let (mean, sigma) = clipped(skewness / 4.0, (skewness / 4.0).powi(2));
        let at = threshold_for_photons(4.5, skewness, &kernel) * sigma + mean;
        let tail = poisson_tail(400.0, 400.0 + 20.0 * at);
        let wanted = 3.398e-6;
        assert!((tail / wanted - 1.0).abs() < 0.1, "{at}: {tail}");
        assert_eq!(threshold_for_photons(4.5, 0.0, &kernel), 4.5);
    }

    /// The chance of more than `beyond` photons, the steps smoothed to half a photon.
    fn poisson_tail(mean: f64, beyond: f64) -> f64 {
        let log_chance = |n: f64| n * mean.ln() - mean - libm::lgamma(n + 1.0);
        let first = (beyond + 0.5).floor();
        let whole: f64 = (1..400)
            .map(|i| log_chance(first + f64::from(i)).exp())
            .sum();
        whole + (first + 0.5 - beyond) * log_chance(first).exp()
    }

    #[test]
    fn stars_skew_neighbours_as_their_own_pixels() {
        // A spot of one pixel has no neighbours; a wide one has equal ones.
        assert!(own_per_mixed(0.2) > 5.0);
        assert!((own_per_mixed(4.0) - 1.0).abs() < 0.05);
        let row: Vec<f32> = (0..33).map(|i| if i == 8 { 2.0 } else { 1.0 }).collect();
        assert_eq!(moments(&row), [32.0, 33.0, 35.0, 39.0, 34.0, 36.0]);
    }
}
