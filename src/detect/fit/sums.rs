//! Sums over the pixels of a window: the normal equations, and the variance of a flux.

#![allow(
    clippy::needless_range_loop,
    reason = "rows and columns of matrices read best as indices"
)]

use super::light::{GroupLight, SpotLight, add_light, linearise};
use super::normal::NormalEquations;
use super::parameters::{NoiseModel, ONE_SPOT};
use super::window::Window;
use crate::detect::psf::{GROUP_PX, PixelGroup, each, each_of, plus, times};
use multiversion::multiversion;

/// The pixels of a window, their background and variance. All are in units of the background noise,
/// so that single precision suffices whatever the units of the frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WindowPixels<'a> {
    /// Row by row, each in whole groups; NaN where a pixel is left out.
    pub data: &'a [PixelGroup],
    /// Groups in a row.
    pub groups: usize,
    /// Inverse of the background noise, in ADU⁻¹.
    pub per_noise: f64,
    /// Fitted background above the map.
    pub background: f32,
    /// Coefficients of the variance of a pixel: of the light, and of its square.
    pub variance: [f32; 2],
}

impl<'a> WindowPixels<'a> {
    /// The pixels of a window, with a fitted background in ADU.
    pub fn new(window: &'a Window, background_adu: f64, noise: &NoiseModel) -> Self {
        let per_noise = 1.0 / window.noise_adu;
        Self {
            data: &window.data,
            groups: window.groups(),
            per_noise,
            background: (background_adu * per_noise) as f32,
            variance: [
                (noise.shot_adu * per_noise) as f32,
                noise.model_error2 as f32,
            ],
        }
    }

    /// One group of columns, row by row.
    #[inline(always)]
    pub fn column_of_groups(&self, group: usize) -> impl Iterator<Item = PixelGroup> {
        self.data.iter().skip(group).step_by(self.groups).copied()
    }

    /// The variance of a pixel with this light.
    #[inline(always)]
    pub fn variance(&self, light: f32) -> f32 {
        variance_of(light, self.variance)
    }

    /// Converts the derivative by a parameter to ADU: parameters that are light are divided by the
    /// noise.
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

/// The variance of a pixel with this light: one, plus a term linear in the light, plus one in its
/// square.
#[inline(always)]
pub(crate) fn variance_of(light: f32, [linear, square]: [f32; 2]) -> f32 {
    let positive = if light > 0.0 { light } else { 0.0 };
    1.0 + positive * (linear + square * positive)
}

/// Adds the pixels of a window to the normal equations of `spots`.
pub(crate) fn add_pixels<L: SpotLight, const N: usize>(
    normal: &mut NormalEquations<N>,
    spots: &[L],
    pixels: &WindowPixels,
    buffers: &mut SumBuffers,
) {
    match spots {
        [] => {}
        [spot] => add_single(normal, spot, pixels),
        several => buffers.add_several(normal, several, pixels),
    }
}

/// [`add_pixels`] for one spot.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn add_single<L: SpotLight, const N: usize>(
    normal: &mut NormalEquations<N>,
    spot: &L,
    pixels: &WindowPixels,
) {
    let mut matrix = [[[0.0f32; GROUP_PX]; ONE_SPOT]; ONE_SPOT];
    let mut right = [[0.0f32; GROUP_PX]; ONE_SPOT];
    let [mut chi2, mut valid] = [[0.0f32; GROUP_PX]; 2];
    for group in 0..pixels.groups {
        for (row, data) in pixels.column_of_groups(group).enumerate() {
            let light_of_group = spot.in_group(group, row);
            for lane in 0..GROUP_PX {
                let (light, gradient) = linearise(&light_of_group, lane);
                let is_valid = !data[lane].is_nan();
                let weight = 1.0 / pixels.variance(light);
                let weight = if is_valid { weight } else { 0.0 };
                let residual = data[lane] - light - pixels.background;
                let residual = if is_valid { residual } else { 0.0 };
                valid[lane] += if is_valid { 1.0 } else { 0.0 };
                chi2[lane] += residual * residual * weight;
                for i in 0..ONE_SPOT {
                    let weighted = gradient[i] * weight;
                    right[i][lane] += weighted * residual;
                    for j in 0..i + 1 {
                        matrix[i][j][lane] += weighted * gradient[j];
                    }
                }
            }
        }
    }
    for i in 0..ONE_SPOT.min(N) {
        let unit = pixels.unit(i, 1);
        normal.right[i] += sum_of(right[i]) * unit;
        for j in 0..i + 1 {
            normal.matrix[i][j] += sum_of(matrix[i][j]) * unit * pixels.unit(j, 1);
        }
    }
    normal.chi2 += sum_of(chi2);
    normal.pixels += sum_of(valid) as usize;
}

/// Rows of a [`Block`].
pub(crate) const BLOCK: usize = 4;
/// The same group of pixels in several images, whose products with others are summed together.
pub(crate) type Block = [PixelGroup; BLOCK];

/// Buffers of the sums over several spots.
#[derive(Debug, Clone, Default)]
pub(crate) struct SumBuffers {
    light: Vec<PixelGroup>,
    /// Square roots of the weights of the pixels.
    roots: Vec<PixelGroup>,
    /// Spot by spot, the derivatives with respect to x, y and flux, times these roots.
    spots: Vec<Block>,
    /// The same with respect to background and size, and the residuals.
    common: Vec<Block>,
}

impl SumBuffers {
    /// [`add_pixels`] for several spots: products of the pixels of all derivatives.
    fn add_several<L: SpotLight, const N: usize>(
        &mut self,
        normal: &mut NormalEquations<N>,
        spots: &[L],
        pixels: &WindowPixels,
    ) {
        let count = pixels.data.len();
        let empty = [0.0; GROUP_PX];
        self.light.clear();
        self.light.resize(count, empty);
        self.roots.resize(count, empty);
        self.common.resize(count, [empty; BLOCK]);
        self.spots.resize(spots.len() * count, [empty; BLOCK]);
        for spot in spots {
            add_light(spot, 1.0, pixels.groups, &mut self.light);
        }
        weigh(pixels, &self.light, &mut self.roots, &mut self.common);
        for (spot, block) in spots.iter().zip(self.spots.chunks_exact_mut(count)) {
            fill_block(spot, pixels.groups, &self.roots, block, &mut self.common);
        }
        let blocks = self.spots.chunks_exact(count).chain([&self.common[..]]);
        for (i, block) in blocks.clone().enumerate() {
            for (j, other) in blocks.clone().enumerate().take(i + 1) {
                add_products(
                    normal,
                    [i, j],
                    products_of([block, other]),
                    spots.len(),
                    pixels,
                );
            }
        }
        let data = pixels.data.as_flattened().iter();
        normal.pixels += data.filter(|value| !value.is_nan()).count();
    }
}

/// Sets the square roots of the weights of pixels with this light, and in the common block the
/// derivatives with respect to the background, and the residuals.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn weigh(
    pixels: &WindowPixels,
    light: &[PixelGroup],
    roots: &mut [PixelGroup],
    common: &mut [Block],
) {
    for group in 0..pixels.groups {
        for (row, data) in pixels.column_of_groups(group).enumerate() {
            let at = row * pixels.groups + group;
            let light = light[at];
            let root = each(&light, |light| (1.0 / pixels.variance(light)).sqrt());
            let root = each_of(
                &data,
                &root,
                |value, root| {
                    if value.is_nan() { 0.0 } else { root }
                },
            );
            let residual = each_of(&data, &light, |value, light| {
                let residual = value - light - pixels.background;
                if value.is_nan() { 0.0 } else { residual }
            });
            roots[at] = root;
            common[at] = [
                root,
                [0.0; GROUP_PX],
                times(&residual, &root),
                [0.0; GROUP_PX],
            ];
        }
    }
}

/// Sets the block of a spot, and adds its derivative with respect to the size to the common one.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn fill_block<L: SpotLight>(
    spot: &L,
    groups: usize,
    roots: &[PixelGroup],
    block: &mut [Block],
    common: &mut [Block],
) {
    for group in 0..groups {
        for (row, root) in roots.iter().skip(group).step_by(groups).enumerate() {
            let at = row * groups + group;
            let [shape, by_x, by_y, by_size] = spot.in_group(group, row).gradients();
            block[at] = [
                times(&by_x, root),
                times(&by_y, root),
                times(&shape, root),
                [0.0; GROUP_PX],
            ];
            common[at][1] = plus(&common[at][1], &times(&by_size, root));
        }
    }
}

/// Adds the products of two blocks of `spots` spots to the normal equations.
fn add_products<const N: usize>(
    normal: &mut NormalEquations<N>,
    [i, j]: [usize; 2],
    products: [[f64; BLOCK]; BLOCK],
    spots: usize,
    pixels: &WindowPixels,
) {
    const RESIDUAL: usize = 2;
    let parameter = |block: usize, row: usize| {
        let end = if block < spots { 3 } else { RESIDUAL };
        (row < end).then_some(3 * block + row)
    };
    let is_residual = |block: usize, row: usize| block == spots && row == RESIDUAL;
    let unit = |parameter: usize| pixels.unit(parameter, spots);
    for (row, products) in products.iter().enumerate() {
        for (column, product) in products.iter().enumerate() {
            match (parameter(i, row), parameter(j, column)) {
                (Some(a), Some(b)) if a >= b => {
                    normal.matrix[a][b] += product * unit(a) * unit(b);
                }
                (None, Some(b)) if is_residual(i, row) => normal.right[b] += product * unit(b),
                (None, None) if is_residual(i, row) && is_residual(j, column) => {
                    normal.chi2 += product;
                }
                _ => {}
            }
        }
    }
}

/// The sums of the products of each image of a block with each of another.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn products_of(blocks: [&[Block]; 2]) -> [[f64; BLOCK]; BLOCK] {
    let sums = products_in_lanes(blocks, usize::MAX, usize::MAX);
    let mut products = [[0.0; BLOCK]; BLOCK];
    // Loops, as what `map` calls is not compiled for the processor.
    for (products, sums) in products.iter_mut().zip(sums) {
        for (product, sum) in products.iter_mut().zip(sums) {
            *product = sum_of(sum);
        }
    }
    products
}

/// The sums of the products of each image of a block with each of another, over the first `count`
/// groups of each `width`, lane by lane.
///
/// Part of the loop over the blocks.
#[inline(always)]
pub(crate) fn products_in_lanes(
    [first, second]: [&[Block]; 2],
    count: usize,
    width: usize,
) -> [[PixelGroup; BLOCK]; BLOCK] {
    let mut sums = [[[0.0f32; GROUP_PX]; BLOCK]; BLOCK];
    let width = width.max(1);
    for (first, second) in first.chunks(width).zip(second.chunks(width)) {
        for (left, right) in first.iter().zip(second).take(count) {
            // Copied so that the compiler need not assume aliasing.
            let (left, right) = (*left, *right);
            for lane in 0..GROUP_PX {
                for i in 0..BLOCK {
                    for j in 0..BLOCK {
                        sums[i][j][lane] += left[i][lane] * right[j][lane];
                    }
                }
            }
        }
    }
    sums
}

/// The variance of the flux of one spot, in ADU², fitted together with a background of variance
/// `background_error2` in ADU². The position is held: a symmetric spot's flux is independent of it.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn flux_variance<L: SpotLight>(
    spot: &L,
    pixels: &WindowPixels,
    background_error2: f64,
) -> f64 {
    let mut sums = [[0.0f32; GROUP_PX]; 3];
    for group in 0..pixels.groups {
        for (row, data) in pixels.column_of_groups(group).enumerate() {
            let shares = spot.fractions(group, row);
            for lane in 0..GROUP_PX {
                let shape = shares[lane];
                let variance = pixels.variance(spot.flux() * shape);
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

/// [`flux_variance`] from the sums of w, w·s and w·s², where w is the weight of a pixel and s the
/// fraction of the light in it.
pub(crate) fn flux_variance_of(
    [ones, shapes, squares]: [f64; 3],
    per_noise: f64,
    background_error2: f64,
) -> f64 {
    let per_noise2 = per_noise * per_noise;
    let own = squares - shapes * shapes / (ones + 1.0 / (per_noise2 * background_error2));
    1.0 / (per_noise2 * own)
}

/// The sum of a group, pairwise: adding one value after the other would be slower.
#[inline(always)]
pub(crate) fn sum_of(v: PixelGroup) -> f64 {
    let four: [f32; 4] = std::array::from_fn(|i| v[i] + v[i + 4]);
    f64::from((four[0] + four[2]) + (four[1] + four[3]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::fit::light::GaussianLight;
    use crate::detect::psf::AxisProfile;

    /// The normal equations of one spot pixel by pixel, in double precision.
    fn plain_sums(
        spot: &GaussianLight<'_>,
        pixels: &WindowPixels<'_>,
    ) -> NormalEquations<ONE_SPOT> {
        let mut normal = NormalEquations::empty();
        let [across, down] = spot.axes;
        for (i, data) in pixels.data.as_flattened().iter().enumerate() {
            let width = pixels.groups * GROUP_PX;
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
    fn sums_in_single_precision_agree_with_double() {
        let (width, height, groups) = (11, 9, 2);
        for flux in [0.0, 30.0, 1e3, 1e6] {
            let mut axes = [AxisProfile::default(), AxisProfile::default()];
            axes[0].fill(5.3, 0.9, width);
            axes[1].fill(4.1, 0.9, height);
            let spot = GaussianLight { flux, axes: &axes };
            let noise = |i: usize| ((i * 7919) % 101) as f32 * 0.03 - 1.5;
            let mut data = vec![[f32::NAN; GROUP_PX]; groups * height];
            for (i, pixel) in data.as_flattened_mut().iter_mut().enumerate() {
                let (column, row) = (i % (groups * GROUP_PX), i / (groups * GROUP_PX));
                if column < width && (column, row) != (6, 4) {
                    let light = axes[0].pixel(column).value * axes[1].pixel(row).value * flux;
                    *pixel = noise(i) * (1.0 + 0.01 * light).sqrt() + light;
                }
            }
            let pixels = WindowPixels {
                data: &data,
                groups,
                per_noise: 0.2,
                background: 0.1,
                variance: [0.01, 1e-6],
            };
            let mut found: NormalEquations<ONE_SPOT> = NormalEquations::empty();
            add_pixels(&mut found, &[spot], &pixels, &mut SumBuffers::default());
            let expected = plain_sums(&spot, &pixels);
            assert_eq!(found.pixels, width * height - 1);
            assert!((found.chi2 / expected.chi2 - 1.0).abs() < 1e-3);
            for i in 0..ONE_SPOT {
                let scale = |j: usize| expected.matrix[j][j].sqrt();
                for j in 0..=i {
                    let off = found.matrix[i][j] - expected.matrix[i][j];
                    assert!(off.abs() <= 2e-6 * scale(i) * scale(j), "{flux}: {i}, {j}");
                }
                // The error of a step over its standard error.
                let off = (found.right[i] - expected.right[i]) / scale(i).max(f64::MIN_POSITIVE);
                assert!(off.abs() < 1e-3, "{flux}: {i}: {off}");
            }
        }
    }
}
