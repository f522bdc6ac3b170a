//! The experiment of the paper: spots of the same peak, and the intensity-weighted mean of a fixed
//! window.
//!
//! The mean is over all pixels of the window, without a threshold: `x = Σ i g / Σ g` (eq. 6). Its
//! error has a closed form ([`PeakStudy::expected`]): the bias by sampling and by the edge of the
//! window, and the noise of the pixels.

use super::ErrorPoint;
use crate::base::statistics::{normal_cdf, normal_density};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;
use std::f64::consts::{PI, SQRT_2};

/// The experiment of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PeakStudy {
    /// Value of the brightest pixel of a spot centred on it, as a fraction of full scale.
    pub peak: f64,
    /// Half width of the window, without its central pixel, in pixels.
    pub half_window_px: usize,
    /// Number of stars at each point of the grid.
    pub trials: usize,
}

impl Default for PeakStudy {
    /// Window and trials of the paper. It does not state the peak; its surface corresponds to 0.65
    /// to 0.70.
    fn default() -> Self {
        Self {
            peak: 0.675,
            half_window_px: 7,
            trials: 20,
        }
    }
}

/// Expected error in closed form.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ExpectedError {
    /// RMS distance, in pixels.
    pub rms_px: f64,
    /// Its part without noise: bias by sampling and by the edge of the window, in pixels.
    pub bias_px: f64,
}

impl PeakStudy {
    /// Total light of a spot with this peak, as a fraction of full scale: A of eq. (2).
    pub fn energy(&self, spot_px: f64) -> f64 {
        self.peak / libm::erf(0.5 / (SQRT_2 * spot_px)).powi(2)
    }

    fn window_px(&self) -> usize {
        2 * self.half_window_px + 1
    }

    /// Measures the error at a radius in pixels and a noise as a fraction of full scale.
    pub fn measure(&self, spot_px: f64, noise: f64, random: &mut ChaCha8Rng) -> ErrorPoint {
        let energy = self.energy(spot_px);
        let half = self.half_window_px as f64;
        let mut shares = [(); 2].map(|()| Vec::with_capacity(self.window_px()));
        let trial = |_| {
            let truth = [(); 2].map(|()| random.random::<f64>() - 0.5);
            for (axis, shares) in shares.iter_mut().enumerate() {
                self.fractions(spot_px, truth[axis], shares);
            }
            let [columns, rows] = &shares;
            let (mut sum, mut sum_x, mut sum_y) = (0.0, 0.0, 0.0);
            for (y, row) in rows.iter().enumerate() {
                let mut of_row = 0.0;
                for (x, column) in columns.iter().enumerate() {
                    let random: f64 = StandardNormal.sample(random);
                    let grey = energy * row * column + noise * random;
                    of_row += grey;
                    sum_x += (x as f64 - half) * grey;
                }
                sum += of_row;
                sum_y += (y as f64 - half) * of_row;
            }
            (sum_x / sum - truth[0]).powi(2) + (sum_y / sum - truth[1]).powi(2)
        };
        let squares: Vec<f64> = (0..self.trials).map(trial).collect();
        ErrorPoint::of_squares(self.trials, &squares)
    }

    /// Fractions of the light in the columns or rows of the window, for a spot at `at` from its
    /// centre.
    fn fractions(&self, spot_px: f64, at: f64, into: &mut Vec<f64>) {
        let edge = |pixel: usize| (pixel as f64 - self.half_window_px as f64 - 0.5 - at) / spot_px;
        let mut before = normal_cdf(edge(0));
        into.clear();
        into.extend((0..self.window_px()).map(|pixel| {
            let after = normal_cdf(edge(pixel + 1));
            let share = after - before;
            before = after;
            share
        }));
    }

    /// The same for a Gaussian that is sampled in the middle of each pixel instead of integrated.
    #[doc(alias = "SPSF")]
    fn sampled_fractions(&self, spot_px: f64, at: f64, into: &mut Vec<f64>) {
        let offset = |pixel: usize| pixel as f64 - self.half_window_px as f64 - at;
        let density = |pixel: usize| normal_density(offset(pixel) / spot_px) / spot_px;
        into.clear();
        into.extend((0..self.window_px()).map(density));
    }

    /// The pixels of a spot of this radius in the middle of the window, as fractions of full scale,
    /// row by row: eqs. (1) and (2).
    pub fn pixels(&self, spot_px: f64) -> Vec<f64> {
        let mut shares = Vec::with_capacity(self.window_px());
        self.fractions(spot_px, 0.0, &mut shares);
        let energy = self.energy(spot_px);
        let mut pixels = Vec::with_capacity(shares.len().pow(2));
        for row in &shares {
            pixels.extend(shares.iter().map(|column| energy * row * column));
        }
        pixels
    }

    /// The error in closed form, see [`SpotInWindow::expected`].
    pub fn expected(&self, spot_px: f64, noise: f64) -> ExpectedError {
        self.spot(spot_px).expected(noise)
    }

    /// A spot of this radius in pixels in the window, for any noise.
    pub fn spot(&self, spot_px: f64) -> SpotInWindow {
        self.spot_of(spot_px, Self::fractions)
    }

    /// The same light in a spot whose Gaussian is sampled in the middle of each pixel instead of
    /// integrated.
    ///
    /// # Reference
    /// Wang et al. 2019, section 2: SPSF, where [`Self::spot`] is IPSF.
    pub fn sampled_spot(&self, spot_px: f64) -> SpotInWindow {
        self.spot_of(spot_px, Self::sampled_fractions)
    }

    fn spot_of(&self, spot_px: f64, shares: Shares) -> SpotInWindow {
        let place = |i: usize| (i as f64 + 0.5) / PLACES as f64 - 0.5;
        let sums = |i| self.sums(spot_px, place(i), shares);
        SpotInWindow {
            energy: self.energy(spot_px),
            half_window_px: self.half_window_px,
            axis: (0..PLACES).map(sums).collect(),
        }
    }

    fn sums(&self, spot_px: f64, truth: f64, shares_of: Shares) -> AxisSums {
        let mut shares = Vec::new();
        shares_of(self, spot_px, truth, &mut shares);
        let sum: f64 = shares.iter().sum();
        let places = shares
            .iter()
            .enumerate()
            .map(|(i, share)| (i as f64 - self.half_window_px as f64) * share);
        AxisSums {
            truth,
            sum,
            mean: places.sum::<f64>() / sum,
        }
    }
}

/// The fractions of the light in the columns or rows of the window.
type Shares = fn(&PeakStudy, f64, f64, &mut Vec<f64>);

/// Positions along either axis over which the mean is taken.
const PLACES: usize = 24;

/// The quantities of a spot for the closed form, independent of the noise.
#[derive(Debug, Clone)]
pub struct SpotInWindow {
    energy: f64,
    half_window_px: usize,
    /// At [`PLACES`] positions within a pixel.
    axis: Vec<AxisSums>,
}

impl SpotInWindow {
    /// The error in closed form, averaged over positions in the pixel; exact up to the fourth power
    /// of noise over light in the window.
    ///
    /// With a window of n² pixels, light G in it, its mean position x̄, noise σ, and `a = Σ (i −
    /// x̄) ν / G`, `e = Σ ν / G` of the noise ν: `x − x₀ = x̄ − x₀ + a / (1 + e)`, expanded in the
    /// variances of a and e and their covariance.
    pub fn expected(&self, noise: f64) -> ExpectedError {
        let half = self.half_window_px as f64;
        let n = 2.0 * half + 1.0;
        // Σ i² over the window's columns.
        let squares = half * (half + 1.0) * n / 3.0;
        let (mut of_bias, mut of_all) = (0.0, 0.0);
        for along in &self.axis {
            for across in &self.axis {
                let light = self.energy * along.sum * across.sum;
                let relative2 = (noise / light).powi(2);
                let var_a = relative2 * n * (squares + n * along.mean.powi(2));
                let var_e = relative2 * n * n;
                let covariance = -relative2 * n * n * along.mean;
                let bias = along.mean - along.truth;
                of_bias += bias * bias;
                of_all += bias * bias - 2.0 * bias * covariance
                    + var_a
                    + 3.0 * (var_a * var_e + 2.0 * covariance * covariance);
            }
        }
        // Both axes contribute the same.
        let root = |sum: f64| (2.0 * sum / (PLACES * PLACES) as f64).sqrt();
        ExpectedError {
            rms_px: root(of_all),
            bias_px: root(of_bias),
        }
    }
}

/// Sums of a spot along one axis of the window.
#[derive(Debug, Clone, Copy)]
struct AxisSums {
    truth: f64,
    sum: f64,
    mean: f64,
}

/// Bias of the centroid of a pixel-integrated Gaussian at `at_px` from the centre of a pixel, in an
/// infinite window.
///
/// By Poisson summation: `Σ_k (−1)^k / (π k) exp(−2 π² σ² k²) sin(2 π k x)`. From σ = 0.3 px on the
/// first term dominates.
#[doc(alias = "S-curve")]
pub fn sampling_bias_px(spot_px: f64, at_px: f64) -> f64 {
    /// Number of terms; later ones are negligible for σ of 0.1 px or more.
    const TERMS: i32 = 12;
    let term = |k: i32| {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        let k = f64::from(k);
        let decay = libm::exp(-2.0 * (PI * spot_px * k).powi(2));
        sign / (PI * k) * decay * libm::sin(2.0 * PI * k * at_px)
    };
    (1..=TERMS).map(term).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// The error without noise of a spot that ends at this distance from the star: the circular
    /// support C of eq. (1), whose radius the paper does not state. A pixel is in it or not, as its
    /// centre is. Beyond the corners of the window it is that of [`PeakStudy::expected`].
    fn bias_with_support_px(study: &PeakStudy, spot_px: f64, support_px: f64) -> f64 {
        let half = study.half_window_px as f64;
        let (mut columns, mut rows) = (Vec::new(), Vec::new());
        let place = |i: usize| (i as f64 + 0.5) / PLACES as f64 - 0.5;
        let mut squares = 0.0;
        for (at_x, at_y) in (0..PLACES).flat_map(|y| (0..PLACES).map(move |x| (place(x), place(y))))
        {
            study.fractions(spot_px, at_x, &mut columns);
            study.fractions(spot_px, at_y, &mut rows);
            let (mut sum, mut sum_x, mut sum_y) = (0.0, 0.0, 0.0);
            for (y, row) in rows.iter().enumerate() {
                let y = y as f64 - half;
                for (x, column) in columns.iter().enumerate() {
                    let x = x as f64 - half;
                    if libm::hypot(x - at_x, y - at_y) <= support_px {
                        sum += row * column;
                        sum_x += x * row * column;
                        sum_y += y * row * column;
                    }
                }
            }
            squares += (sum_x / sum - at_x).powi(2) + (sum_y / sum - at_y).powi(2);
        }
        (squares / (PLACES * PLACES) as f64).sqrt()
    }

    #[test]
    fn a_centred_spot_has_its_peak_in_the_middle() {
        let study = PeakStudy::default();
        for spot_px in [0.4, 1.0, 2.4] {
            let mut shares = Vec::new();
            study.fractions(spot_px, 0.0, &mut shares);
            let peak = study.energy(spot_px) * shares[7] * shares[7];
            assert!((peak - 0.675).abs() < 1e-12, "{spot_px}: {peak}");
        }
    }

    #[test]
    fn the_bias_in_a_wide_window_is_that_of_the_series() {
        let study = PeakStudy {
            half_window_px: 20,
            ..PeakStudy::default()
        };
        for spot_px in [0.1, 0.25, 0.4, 0.7] {
            for at in [-0.5, -0.37, -0.1, 0.0, 0.2, 0.25, 0.44] {
                let found = study.sums(spot_px, at, PeakStudy::fractions).mean - at;
                let series = sampling_bias_px(spot_px, at);
                assert!(
                    (found - series).abs() < 1e-12,
                    "{spot_px} {at}: {found} {series}"
                );
            }
        }
    }

    #[test]
    fn sampling_costs_narrow_spots_most_and_wide_ones_nothing() {
        let study = PeakStudy::default();
        let ratio = |spot_px: f64, noise: f64| {
            let [sampled, integrated] = [study.sampled_spot(spot_px), study.spot(spot_px)]
                .map(|spot| spot.expected(noise).rms_px);
            sampled / integrated
        };
        // By the series 4πσ² exp(−2π²σ²) sin 2πx of the sampled Gaussian's mean, of first order, over
        // that of `sampling_bias_px`: 4π²σ².
        let first_order = (2.0 * PI * 0.6).powi(2);
        assert!((ratio(0.6, 1e-9) / first_order - 1.0).abs() < 0.01);
        assert!(ratio(0.4, 2e-4) > 3.0);
        assert!((ratio(1.0, 1e-3) - 1.0).abs() < 0.1);
        assert!((ratio(2.0, 1e-3) - 1.0).abs() < 0.03);
    }

    #[test]
    fn errors_scatter_about_the_closed_form_as_chance_has_it() {
        let study = PeakStudy {
            trials: 4000,
            ..PeakStudy::default()
        };
        // Dominated by sampling, by noise, or by the edge of the window.
        for (number, (spot_px, noise)) in [
            (0.4, 1e-6),
            (0.4, 2e-3),
            (1.0, 1e-3),
            (2.4, 2e-4),
            (2.4, 2e-3),
        ]
        .into_iter()
        .enumerate()
        {
            let mut random = ChaCha8Rng::seed_from_u64(number as u64);
            let found = study.measure(spot_px, noise, &mut random);
            let expected = study.expected(spot_px, noise).rms_px;
            let off = (found.rms_px - expected) / found.rms_sigma_px;
            assert!(off.abs() < 4.0, "{spot_px} {noise}: {found:?} {expected}");
        }
    }

    #[test]
    fn a_support_beyond_the_window_changes_nothing_and_a_narrow_one_cuts_pixels_off() {
        let study = PeakStudy::default();
        for spot_px in [0.4, 1.0, 2.0, 2.4] {
            let whole = study.expected(spot_px, 0.0).bias_px;
            let bias = |support_px: f64| bias_with_support_px(&study, spot_px, support_px);
            println!(
                "| {spot_px} | {whole:.4} | {:.4} | {:.4} | {:.4} | {:.4} |",
                bias(7.0),
                bias(3.0 * spot_px),
                bias(4.0 * spot_px),
                bias(5.0 * spot_px),
            );
            assert!((bias(20.0) - whole).abs() < 1e-9, "{spot_px}");
        }
        // A wide spot that ends round the star has no edge of the window on one side.
        assert!(bias_with_support_px(&study, 2.4, 7.0) < study.expected(2.4, 0.0).bias_px);
        assert!(bias_with_support_px(&study, 1.0, 3.0) > study.expected(1.0, 0.0).bias_px);
    }

    #[test]
    fn without_noise_only_the_bias_is_left() {
        let study = PeakStudy::default();
        let expected = study.expected(0.4, 1e-12);
        assert!((expected.rms_px / expected.bias_px - 1.0).abs() < 1e-9);
        // Root mean square of the first sine, of two axes: √2 / (√2 π) exp(−2 π² σ²).
        let first = (-2.0 * (PI * 0.4).powi(2)).exp() / PI;
        assert!((expected.bias_px / first - 1.0).abs() < 1e-3);
    }
}
