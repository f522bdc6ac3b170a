//! The normal equations of a weighted least-squares fit, and their solution by Cholesky's method without roots: A = L D Lᵀ.

#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns of matrices read best as indices"
)]

use super::fitter::{MAX_PARAMETERS, MAX_SPOTS};
use crate::detect::psf::{AxisProfile, LANES, Lanes, ProfilePart};
use multiversion::multiversion;

/// Parameters of one spot: x, y, flux, background, size.
pub(crate) const ONE_SPOT: usize = 5;
/// Parameters of two spots, by far the most frequent group.
pub(crate) const TWO_SPOTS: usize = 3 * 2 + 2;

/// One linearised step for up to `N` parameters: normal matrix, right-hand side, chi².
#[derive(Debug, Clone)]
pub(crate) struct Normal<const N: usize> {
    /// Lower triangle; after [`Self::factorise`] that of the factor L below its diagonal of ones.
    pub matrix: [[f64; N]; N],
    /// One over the diagonal D.
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

    /// The factor in place of the lower triangle; the number of rows done before the matrix was
    /// found not to be positive definite, or `count`.
    pub fn factorise(&mut self, count: usize) -> usize {
        // With a count known beforehand the loops need not be loops.
        match N - count {
            0 => self.factorise_first(N),
            1 => self.factorise_first(N - 1),
            _ => self.factorise_first(count),
        }
    }

    #[inline(always)]
    fn factorise_first(&mut self, count: usize) -> usize {
        let matrix = &mut self.matrix;
        for i in 0..count {
            let mut diagonal = matrix[i][i];
            for j in 0..i {
                // The row times D, as it is until its turn to be divided.
                for k in 0..j {
                    matrix[i][j] -= matrix[i][k] * matrix[j][k];
                }
            }
            for j in 0..i {
                let times_d = matrix[i][j];
                matrix[i][j] *= self.inverse[j];
                diagonal -= times_d * matrix[i][j];
            }
            if !(diagonal > 0.0 && diagonal.is_finite()) {
                return i;
            }
            self.inverse[i] = 1.0 / diagonal;
        }
        count
    }

    /// The step of the first `count` parameters, after [`Self::factorise`].
    pub fn solve(&self, count: usize) -> [f64; N] {
        match N - count {
            0 => self.solve_first(N),
            1 => self.solve_first(N - 1),
            _ => self.solve_first(count),
        }
    }

    #[inline(always)]
    fn solve_first(&self, count: usize) -> [f64; N] {
        let mut x = self.forward(self.right, 0, count);
        for i in (0..count).rev() {
            x[i] *= self.inverse[i];
            for k in i + 1..count {
                x[i] -= self.matrix[k][i] * x[k];
            }
        }
        x
    }

    /// The last of the steps of the first `count` parameters, after [`Self::factorise`].
    pub fn solve_last(&self, count: usize) -> f64 {
        self.forward(self.right, 0, count)[count - 1] * self.inverse[count - 1]
    }

    /// The variances of the first `count` parameters, after [`Self::factorise`].
    pub fn variances(&self, count: usize) -> [f64; N] {
        let mut variances = [0.0; N];
        // Column by column: L⁻¹, whose squared columns over D sum to the diagonal of (L D Lᵀ)⁻¹.
        for (column, variance) in variances.iter_mut().enumerate().take(count) {
            let mut unit = [0.0; N];
            unit[column] = 1.0;
            let x = self.forward(unit, column, count);
            for i in column..count {
                *variance += x[i] * x[i] * self.inverse[i];
            }
        }
        variances
    }

    /// L⁻¹ x, for an x that is 0 before `first`.
    #[inline(always)]
    fn forward(&self, mut x: [f64; N], first: usize, count: usize) -> [f64; N] {
        for i in first..count {
            for k in first..i {
                x[i] -= self.matrix[i][k] * x[k];
            }
        }
        x
    }

    /// The factor of the equations of one spot, after [`Self::factorise`], for gradients in units of the noise.
    pub fn factor(&self, pixels: &Pixels<'_>) -> Factor<N> {
        let mut factor = Factor {
            lower: [[0.0; N]; N],
            inverse: [0.0; N],
        };
        for i in 0..N {
            let unit = pixels.unit(i, 1);
            factor.inverse[i] = (self.inverse[i] * unit * unit) as f32;
            for k in 0..i {
                factor.lower[i][k] = (self.matrix[i][k] * pixels.unit(k, 1) / unit) as f32;
            }
        }
        factor
    }
}

/// The factors L and D of normal equations, in single precision.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Factor<const N: usize> {
    /// L below its diagonal.
    lower: [[f32; N]; N],
    /// One over D.
    inverse: [f32; N],
}

impl<const N: usize> Factor<N> {
    /// Part of a pixel's noise that the parameters take up, over the pixel's weight.
    #[inline(always)]
    pub fn leverage(&self, gradient: &[f32; N]) -> f32 {
        let mut x = *gradient;
        let mut leverage = 0.0;
        for i in 0..N {
            for k in 0..i {
                x[i] -= self.lower[i][k] * x[k];
            }
            leverage += x[i] * x[i] * self.inverse[i];
        }
        leverage
    }
}

/// Pixels of a window, and what is added to the light in them, in units of the noise of the background: so single
/// precision does, whatever the units of the frame are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pixels<'a> {
    /// Row after row, each in so many whole groups; NaN is left out.
    pub data: &'a [Lanes],
    /// Groups in a row.
    pub groups: usize,
    /// One over the unit, in ADU⁻¹.
    pub per_noise: f64,
    /// Background above the map.
    pub background: f32,
    /// Variance of a pixel per light, and per squared light.
    pub variance: [f32; 2],
}

impl Pixels<'_> {
    /// All rows of one group of columns.
    #[inline(always)]
    pub fn column_of_groups(&self, group: usize) -> impl Iterator<Item = Lanes> {
        self.data.iter().skip(group).step_by(self.groups).copied()
    }

    /// The variance of a pixel with some light.
    #[inline(always)]
    pub fn variance(&self, light: f32) -> f32 {
        variance_of(light, self.variance)
    }

    /// What a parameter's derivatives are multiplied with: those of light are per noise.
    #[inline(always)]
    pub fn unit(&self, parameter: usize, spots: usize) -> f64 {
        let is_light = if parameter < 3 * spots {
            parameter % 3 == 2
        } else {
            parameter == 3 * spots
        };
        if is_light { self.per_noise } else { 1.0 }
    }
}

/// The variance of a pixel with some light, which has a part for light and one for its square.
#[inline(always)]
pub(crate) fn variance_of(light: f32, [linear, square]: [f32; 2]) -> f32 {
    let positive = if light > 0.0 { light } else { 0.0 };
    1.0 + positive * (linear + square * positive)
}

/// A spot's light along both sides of a window.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SpotLight<'a> {
    /// Light, in units of the noise.
    pub flux: f32,
    /// Where it falls along x and y.
    pub axes: &'a [AxisProfile; 2],
}

/// A spot's light in a group of pixels of a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GroupLight {
    flux: f32,
    across: ProfilePart<Lanes>,
    down: ProfilePart<f32>,
}

impl SpotLight<'_> {
    /// The light in a group of columns of a row.
    #[inline(always)]
    pub fn in_group(&self, group: usize, row: usize) -> GroupLight {
        let [across, down] = self.axes;
        GroupLight {
            flux: self.flux,
            across: across.group(group),
            down: down.pixel(row),
        }
    }
}

/// The light in a pixel, and how the model changes there with the parameters of the first `count` spots, in units of the
/// noise.
#[inline(always)]
pub(crate) fn linearise<const S: usize, const N: usize>(
    spots: &[GroupLight; S],
    count: usize,
    lane: usize,
) -> (f32, [f32; N]) {
    let background = 3 * count;
    let mut light = 0.0;
    let mut gradient = [0.0; N];
    gradient[background] = 1.0;
    for (i, spot) in spots.iter().enumerate().take(count) {
        let [shape, by_x, by_y, by_size] =
            spot_gradient(spot.flux, &spot.across.lane(lane), &spot.down);
        light += spot.flux * shape;
        gradient[3 * i] = by_x;
        gradient[3 * i + 1] = by_y;
        gradient[3 * i + 2] = shape;
        gradient[background + 1] += by_size;
    }
    (light, gradient)
}

/// The light of a spot in a pixel, as part of all; and how the light there changes with x, y and size.
#[inline(always)]
pub(crate) fn spot_gradient(
    flux: f32,
    across: &ProfilePart<f32>,
    down: &ProfilePart<f32>,
) -> [f32; 4] {
    [
        across.value * down.value,
        flux * across.by_center * down.value,
        flux * across.value * down.by_center,
        flux * (across.by_sigma * down.value + across.value * down.by_sigma),
    ]
}

/// Adds the pixels of a window, in which the light is that of `spots`.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn add_pixels<const N: usize>(
    normal: &mut Normal<N>,
    spots: &[SpotLight],
    pixels: &Pixels,
) {
    // With a count known beforehand the loops need not be loops.
    match (N, spots) {
        (ONE_SPOT, &[spot]) => add_up(normal, &[spot], 1, pixels),
        (TWO_SPOTS, &[first, second]) => add_up(normal, &[first, second], 2, pixels),
        (MAX_PARAMETERS, &[first, ..]) => {
            let mut several = [first; MAX_SPOTS];
            for (spot, from) in several.iter_mut().zip(spots) {
                *spot = *from;
            }
            add_up(normal, &several, spots.len().min(MAX_SPOTS), pixels);
        }
        _ => {}
    }
}

/// The same for the first `count` spots.
#[inline(always)]
fn add_up<const S: usize, const N: usize>(
    normal: &mut Normal<N>,
    spots: &[SpotLight<'_>; S],
    count: usize,
    pixels: &Pixels<'_>,
) {
    let parameters = 3 * count + 2;
    let mut matrix = [[[0.0f32; LANES]; N]; N];
    let mut right = [[0.0f32; LANES]; N];
    let [mut chi2, mut valid] = [[0.0f32; LANES]; 2];
    for group in 0..pixels.groups {
        for (row, data) in pixels.column_of_groups(group).enumerate() {
            let lights = spots.map(|spot| spot.in_group(group, row));
            for lane in 0..LANES {
                let (light, gradient) = linearise::<S, N>(&lights, count, lane);
                let is_valid = !data[lane].is_nan();
                let weight = 1.0 / pixels.variance(light);
                let weight = if is_valid { weight } else { 0.0 };
                let residual = data[lane] - light - pixels.background;
                let residual = if is_valid { residual } else { 0.0 };
                valid[lane] += if is_valid { 1.0 } else { 0.0 };
                chi2[lane] += residual * residual * weight;
                for i in 0..parameters {
                    let weighted = gradient[i] * weight;
                    right[i][lane] += weighted * residual;
                    for j in 0..i + 1 {
                        matrix[i][j][lane] += weighted * gradient[j];
                    }
                }
            }
        }
    }
    for i in 0..N {
        let unit = pixels.unit(i, count);
        normal.right[i] += sum_of(right[i]) * unit;
        for j in 0..i + 1 {
            normal.matrix[i][j] += sum_of(matrix[i][j]) * unit * pixels.unit(j, count);
        }
    }
    normal.chi2 += sum_of(chi2);
    normal.pixels += sum_of(valid) as usize;
}

/// The variance of the flux of one spot, in ADU², fitted together with a background of variance
/// `background_error2`; the spot's place is held, on which a symmetric spot's flux does not depend.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn flux_variance(spot: &SpotLight, pixels: &Pixels, background_error2: f64) -> f64 {
    let mut sums = [[0.0f32; LANES]; 3];
    let [across, down] = spot.axes;
    for group in 0..pixels.groups {
        let value = across.group(group).value;
        for (row, data) in pixels.column_of_groups(group).enumerate() {
            let down = down.pixel(row).value;
            for lane in 0..LANES {
                let shape = value[lane] * down;
                let variance = pixels.variance(spot.flux * shape);
                let weight = if data[lane].is_nan() {
                    0.0
                } else {
                    1.0 / variance
                };
                sums[0][lane] += weight;
                sums[1][lane] += weight * shape;
                sums[2][lane] += weight * shape * shape;
            }
        }
    }
    flux_variance_of(sums.map(sum_of), pixels.per_noise, background_error2)
}

/// The same from the sums of weights, and of these times the light, as part of all, and its square.
pub(crate) fn flux_variance_of(
    [ones, shapes, squares]: [f64; 3],
    per_noise: f64,
    background_error2: f64,
) -> f64 {
    let per_noise2 = per_noise * per_noise;
    let own = squares - shapes * shapes / (ones + 1.0 / (per_noise2 * background_error2));
    1.0 / (per_noise2 * own)
}

/// Adds `sign` times the light of a spot to a window's pixels.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn add_light(spot: &SpotLight, sign: f32, groups: usize, data: &mut [Lanes]) {
    let [across, down] = spot.axes;
    for group in 0..groups {
        let value = across.group(group).value;
        for (row, pixels) in data.iter_mut().skip(group).step_by(groups).enumerate() {
            let light = sign * spot.flux * down.pixel(row).value;
            for lane in 0..LANES {
                pixels[lane] += value[lane] * light;
            }
        }
    }
}

/// The sum, by halves: one after the other, each would wait for the one before.
#[inline(always)]
pub(crate) fn sum_of(v: Lanes) -> f64 {
    let four: [f32; 4] = std::array::from_fn(|i| v[i] + v[i + 4]);
    f64::from((four[0] + four[2]) + (four[1] + four[3]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sums for one spot pixel by pixel, in double precision.
    fn plain_sums(spot: &SpotLight<'_>, pixels: &Pixels<'_>) -> Normal<ONE_SPOT> {
        let mut normal = Normal::empty();
        let [across, down] = spot.axes;
        for (i, data) in pixels.data.as_flattened().iter().enumerate() {
            let width = pixels.groups * LANES;
            let (a, d) = (across.pixel(i % width), down.pixel(i / width));
            let [value, by_center, by_sigma] = [a.value, a.by_center, a.by_sigma].map(f64::from);
            let [d_value, d_center, d_sigma] = [d.value, d.by_center, d.by_sigma].map(f64::from);
            let flux = f64::from(spot.flux);
            let light = flux * value * d_value;
            let gradient = [
                flux * by_center * d_value,
                flux * value * d_center,
                value * d_value,
                1.0,
                flux * (by_sigma * d_value + value * d_sigma),
            ];
            let [linear, square] = pixels.variance.map(f64::from);
            let weight = 1.0 / (1.0 + light * (linear + square * light));
            let residual = f64::from(*data) - light - f64::from(pixels.background);
            if data.is_nan() {
                continue;
            }
            normal.chi2 += residual * residual * weight;
            normal.pixels += 1;
            for i in 0..ONE_SPOT {
                let unit = pixels.unit(i, 1);
                normal.right[i] += gradient[i] * residual * weight * unit;
                for j in 0..=i {
                    let units = unit * pixels.unit(j, 1);
                    normal.matrix[i][j] += gradient[i] * gradient[j] * weight * units;
                }
            }
        }
        normal
    }

    #[test]
    fn sums_in_single_precision_are_those_in_double() {
        let (width, height, groups) = (11, 9, 2);
        for flux in [0.0, 30.0, 1e3, 1e6] {
            let mut axes = [AxisProfile::default(), AxisProfile::default()];
            axes[0].fill(5.3, 0.9, width);
            axes[1].fill(4.1, 0.9, height);
            let spot = SpotLight { flux, axes: &axes };
            let noise = |i: usize| ((i * 7919) % 101) as f32 * 0.03 - 1.5;
            let mut data = vec![[f32::NAN; LANES]; groups * height];
            for (i, pixel) in data.as_flattened_mut().iter_mut().enumerate() {
                let (column, row) = (i % (groups * LANES), i / (groups * LANES));
                if column < width && (column, row) != (6, 4) {
                    let light = axes[0].pixel(column).value * axes[1].pixel(row).value * flux;
                    *pixel = noise(i) * (1.0 + 0.01 * light).sqrt() + light;
                }
            }
            let pixels = Pixels {
                data: &data,
                groups,
                per_noise: 0.2,
                background: 0.1,
                variance: [0.01, 1e-6],
            };
            let mut found: Normal<ONE_SPOT> = Normal::empty();
            add_pixels(&mut found, &[spot], &pixels);
            let expected = plain_sums(&spot, &pixels);
            assert_eq!(found.pixels, width * height - 1);
            assert!((found.chi2 / expected.chi2 - 1.0).abs() < 1e-3);
            for i in 0..ONE_SPOT {
                let scale = |j: usize| expected.matrix[j][j].sqrt();
                for j in 0..=i {
                    let off = found.matrix[i][j] - expected.matrix[i][j];
                    assert!(off.abs() <= 2e-6 * scale(i) * scale(j), "{flux}: {i}, {j}");
                }
                // A step that is off by this part of its standard error.
                let off = (found.right[i] - expected.right[i]) / scale(i).max(f64::MIN_POSITIVE);
                assert!(off.abs() < 1e-3, "{flux}: {i}: {off}");
            }
        }
    }
}
