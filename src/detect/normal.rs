//! The normal equations of a weighted least-squares fit, and their solution by Cholesky's method.

#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns of matrices read best as indices"
)]

use super::psf::AxisProfile;
use multiversion::multiversion;

/// Pixels of a row treated together.
const LANES: usize = 8;
/// Parameters of one spot: x, y, flux, background, size.
pub(super) const ONE_SPOT: usize = 5;
/// The same with the size held.
const PLACED_SPOT: usize = ONE_SPOT - 1;
/// Entries of the lower triangle for one spot.
const TRIANGLE: usize = ONE_SPOT * (ONE_SPOT + 1) / 2;

/// One linearised step for up to `N` parameters: normal matrix, right-hand side, chi².
#[derive(Debug, Clone)]
pub(super) struct Normal<const N: usize> {
    /// Lower triangle; after [`Self::factorise`] the Cholesky factor.
    pub matrix: [[f64; N]; N],
    /// One over the factor's diagonal.
    pub inverse: [f64; N],
    /// Gradient of chi², halved and negative.
    pub right: [f64; N],
    /// Sum of squared residuals over their variance.
    pub chi2: f64,
    /// Number of pixels.
    pub pixels: usize,
}

impl<const N: usize> Normal<N> {
    /// Without any pixel.
    pub fn empty() -> Self {
        Self {
            matrix: [[0.0; N]; N],
            inverse: [0.0; N],
            right: [0.0; N],
            chi2: 0.0,
            pixels: 0,
        }
    }

    /// Adds one pixel; only the lower triangle is kept.
    #[inline(always)]
    pub fn add(&mut self, gradient: &[f64], residual: f64, weight: f64) {
        for (i, &g) in gradient.iter().enumerate() {
            let weighted = g * weight;
            self.right[i] += weighted * residual;
            for (entry, &h) in self.matrix[i][..=i].iter_mut().zip(gradient) {
                *entry += weighted * h;
            }
        }
        self.chi2 += residual * residual * weight;
        self.pixels += 1;
    }

    /// Adds the pixels of a window, row-major and of some width, in which there is one spot, whose light along x and y is
    /// in `axes`; without its size where that `is_held`.
    pub fn add_one_spot(
        &mut self,
        spot: &OneSpot,
        axes: [&AxisProfile; 2],
        (data, width): (&[f64], usize),
        is_held: bool,
    ) {
        if width == 0 {
            return;
        }
        let mut sums = Normal::empty();
        if is_held {
            sum_placed_spot(spot, axes, data, width, &mut sums);
        } else {
            sum_one_spot(spot, axes, data, width, &mut sums);
        }
        for (i, row) in sums.matrix.iter().enumerate() {
            self.matrix[i][..ONE_SPOT].copy_from_slice(row);
        }
        self.right[..ONE_SPOT].copy_from_slice(&sums.right);
        self.chi2 += sums.chi2;
        self.pixels += sums.pixels;
    }

    /// Cholesky factor in place of the lower triangle; the number of rows done before the matrix was
    /// found not to be positive definite, or `count`.
    pub fn factorise(&mut self, count: usize) -> usize {
        // With a count known beforehand the loops need not be loops.
        if count == ONE_SPOT {
            self.factorise_first(ONE_SPOT)
        } else if count == PLACED_SPOT {
            self.factorise_first(PLACED_SPOT)
        } else {
            self.factorise_first(count)
        }
    }

    #[inline(always)]
    fn factorise_first(&mut self, count: usize) -> usize {
        let matrix = &mut self.matrix;
        for i in 0..count {
            for j in 0..=i {
                let mut rest = matrix[i][j];
                for k in 0..j {
                    rest -= matrix[i][k] * matrix[j][k];
                }
                if i == j {
                    if !(rest > 0.0 && rest.is_finite()) {
                        return i;
                    }
                    matrix[i][i] = rest.sqrt();
                    self.inverse[i] = 1.0 / matrix[i][i];
                } else {
                    matrix[i][j] = rest * self.inverse[j];
                }
            }
        }
        count
    }

    /// The step of the first `count` parameters, after [`Self::factorise`].
    pub fn solve(&self, count: usize) -> [f64; N] {
        let l = &self.matrix;
        let mut x = self.right;
        for i in 0..count {
            for k in 0..i {
                x[i] -= l[i][k] * x[k];
            }
            x[i] *= self.inverse[i];
        }
        for i in (0..count).rev() {
            for k in i + 1..count {
                x[i] -= l[k][i] * x[k];
            }
            x[i] *= self.inverse[i];
        }
        x
    }

    /// The last of the steps of the first `count` parameters, after [`Self::factorise`].
    pub fn solve_last(&self, count: usize) -> f64 {
        let mut x = self.right;
        for i in 0..count {
            for k in 0..i {
                x[i] -= self.matrix[i][k] * x[k];
            }
            x[i] *= self.inverse[i];
        }
        x[count - 1] * self.inverse[count - 1]
    }

    /// The variances of the first `count` parameters, after [`Self::factorise`].
    pub fn variances(&self, count: usize) -> [f64; N] {
        let l = &self.matrix;
        let mut variances = [0.0; N];
        // Column by column: L⁻¹, whose squared columns sum to the diagonal of (L Lᵀ)⁻¹.
        for (column, variance) in variances.iter_mut().enumerate().take(count) {
            let mut x = [0.0; N];
            for i in column..count {
                let mut rest = if i == column { 1.0 } else { 0.0 };
                for k in column..i {
                    rest -= l[i][k] * x[k];
                }
                x[i] = rest * self.inverse[i];
                *variance += x[i] * x[i];
            }
        }
        variances
    }

    /// Part of a pixel's noise that the first `count` parameters take up, after [`Self::factorise`].
    pub fn leverage(&self, gradient: &[f64], weight: f64, count: usize) -> f64 {
        let mut x = [0.0; N];
        let mut leverage = 0.0;
        for i in 0..count {
            let mut rest = gradient[i];
            for k in 0..i {
                rest -= self.matrix[i][k] * x[k];
            }
            x[i] = rest * self.inverse[i];
            leverage += x[i] * x[i] * weight;
        }
        leverage
    }
}

/// A spot and what surrounds it, where the equations are linearised.
#[derive(Debug, Clone, Copy)]
pub(super) struct OneSpot {
    /// Light, in ADU.
    pub flux: f64,
    /// Background above the map, in ADU.
    pub background: f64,
    /// Variance of a pixel without light, per ADU of light, and per squared ADU of light.
    pub variance: [f64; 3],
}

/// The sums over `data`, row-major, `width` columns, for a spot whose light along x and y is in
/// `axes`: the same as adding pixel by pixel.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn sum_one_spot(
    spot: &OneSpot,
    axes: [&AxisProfile; 2],
    data: &[f64],
    width: usize,
    out: &mut Normal<ONE_SPOT>,
) {
    sum_parameters::<ONE_SPOT>(spot, axes, data, width, out);
}

/// The same without the size.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn sum_placed_spot(
    spot: &OneSpot,
    axes: [&AxisProfile; 2],
    data: &[f64],
    width: usize,
    out: &mut Normal<ONE_SPOT>,
) {
    sum_parameters::<PLACED_SPOT>(spot, axes, data, width, out);
}

/// The sums for the first `P` parameters of one spot.
#[inline(always)]
fn sum_parameters<const P: usize>(
    spot: &OneSpot,
    axes: [&AxisProfile; 2],
    data: &[f64],
    width: usize,
    out: &mut Normal<ONE_SPOT>,
) {
    let mut matrix = [[0.0f64; LANES]; TRIANGLE];
    let mut right = [[0.0f64; LANES]; ONE_SPOT];
    let mut chi2 = [0.0f64; LANES];
    let mut pixels = [0.0f64; LANES];
    let [across, down] = axes;
    let [constant, linear, square] = spot.variance;
    let profile = |values: &[f64], start: usize| -> [f64; LANES] {
        values[start..]
            .first_chunk()
            .copied()
            .unwrap_or([0.0; LANES])
    };
    for start in (0..width).step_by(LANES) {
        let value = profile(&across.value, start);
        let by_center = profile(&across.by_center, start);
        let by_sigma = profile(&across.by_sigma, start);
        let columns = (width - start).min(LANES);
        let gap = std::array::from_fn(|lane| if lane < columns { 0.0 } else { f64::NAN });
        for row in 0..data.len() / width {
            let pixel = pixels_of(&data[row * width + start..], columns, &gap);
            let (d, d_center, d_sigma) = (down.value[row], down.by_center[row], down.by_sigma[row]);
            let mut gradient = [[1.0f64; LANES]; ONE_SPOT];
            let mut weight = [0.0f64; LANES];
            let mut residual = [0.0f64; LANES];
            for lane in 0..LANES {
                let shape = value[lane] * d;
                let light = spot.flux * shape;
                gradient[0][lane] = spot.flux * by_center[lane] * d;
                gradient[1][lane] = spot.flux * value[lane] * d_center;
                gradient[2][lane] = shape;
                gradient[4][lane] = spot.flux * (by_sigma[lane] * d + value[lane] * d_sigma);
                let positive = if light > 0.0 { light } else { 0.0 };
                let variance = constant + positive * (linear + square * positive);
                let is_valid = !pixel[lane].is_nan();
                let difference = pixel[lane] - light - spot.background;
                weight[lane] = if is_valid { 1.0 / variance } else { 0.0 };
                residual[lane] = if is_valid { difference } else { 0.0 };
                pixels[lane] += if is_valid { 1.0 } else { 0.0 };
                chi2[lane] += residual[lane] * residual[lane] * weight[lane];
            }
            let mut entry = 0;
            for i in 0..P {
                let mut weighted = [0.0f64; LANES];
                for lane in 0..LANES {
                    weighted[lane] = gradient[i][lane] * weight[lane];
                    right[i][lane] += weighted[lane] * residual[lane];
                }
                for j in 0..=i {
                    for lane in 0..LANES {
                        matrix[entry][lane] += weighted[lane] * gradient[j][lane];
                    }
                    entry += 1;
                }
            }
        }
    }
    let mut entry = 0;
    for i in 0..P {
        out.right[i] += sum_of(right[i]);
        for j in 0..=i {
            out.matrix[i][j] += sum_of(matrix[entry]);
            entry += 1;
        }
    }
    out.chi2 += sum_of(chi2);
    out.pixels += sum_of(pixels) as usize;
}

/// The variance of the flux of one spot, fitted together with a background of variance
/// `background_error2`; the spot's place is held, on which a symmetric spot's flux does not depend.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(super) fn flux_variance(
    spot: &OneSpot,
    axes: [&AxisProfile; 2],
    data: &[f64],
    width: usize,
    background_error2: f64,
) -> f64 {
    let mut sums = [[0.0f64; LANES]; 3];
    let [across, down] = axes;
    let [constant, linear, square] = spot.variance;
    for start in (0..width).step_by(LANES) {
        let value = across.value[start..].first_chunk::<LANES>();
        let value = value.copied().unwrap_or([0.0; LANES]);
        let columns = (width - start).min(LANES);
        let gap = std::array::from_fn(|lane| if lane < columns { 0.0 } else { f64::NAN });
        for row in 0..data.len() / width {
            let pixel = pixels_of(&data[row * width + start..], columns, &gap);
            for lane in 0..LANES {
                let shape = value[lane] * down.value[row];
                let light = spot.flux * shape;
                let positive = if light > 0.0 { light } else { 0.0 };
                let variance = constant + positive * (linear + square * positive);
                let is_valid = !pixel[lane].is_nan();
                let weight = if is_valid { 1.0 / variance } else { 0.0 };
                sums[0][lane] += weight;
                sums[1][lane] += weight * shape;
                sums[2][lane] += weight * shape * shape;
            }
        }
    }
    let [ones, shapes, squares] = sums.map(sum_of);
    1.0 / (squares - shapes * shapes / (ones + 1.0 / background_error2))
}

/// The first `columns` of `data`, and NaN beyond: `gap` is NaN there, else 0.
#[inline(always)]
fn pixels_of(data: &[f64], columns: usize, gap: &[f64; LANES]) -> [f64; LANES] {
    if let Some(pixels) = data.first_chunk::<LANES>() {
        return std::array::from_fn(|lane| pixels[lane] + gap[lane]);
    }
    let mut pixels = [f64::NAN; LANES];
    for (pixel, &value) in pixels.iter_mut().zip(&data[..columns]) {
        *pixel = value;
    }
    pixels
}

/// The sum, by halves: one after the other, each would wait for the one before.
#[inline(always)]
fn sum_of(v: [f64; LANES]) -> f64 {
    let four: [f64; 4] = std::array::from_fn(|i| v[i] + v[i + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}
