//! The light of spots in a window, and its derivatives with respect to the parameters.

use super::parameters::ONE_SPOT;
use crate::detect::psf::{AxisProfile, PixelGroup, ProfilePart, each, plus};
use multiversion::multiversion;

/// The light of a spot in a window.
pub(crate) trait SpotLight: Copy {
    /// In a group of pixels of a row.
    type Group: GroupLight;

    /// Flux, in units of the noise.
    fn flux(&self) -> f32;

    /// The light in a group of pixels of a row.
    fn in_group(&self, group: usize, row: usize) -> Self::Group;

    /// The fraction of the light in each pixel of a group.
    fn fractions(&self, group: usize, row: usize) -> PixelGroup;
}

/// The light of a spot in a group of pixels of a row.
pub(crate) trait GroupLight: Copy {
    /// Flux of the spot, in units of the noise.
    fn flux(&self) -> f32;

    /// The fraction of the spot's light in a pixel, and the derivatives of the light there with
    /// respect to x, y and size.
    fn gradient(&self, lane: usize) -> [f32; 4];

    /// The same in all pixels.
    fn gradients(&self) -> [PixelGroup; 4];
}

/// The light of a Gaussian spot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GaussianLight<'a> {
    /// Flux, in units of the noise.
    pub flux: f32,
    /// Profiles along x and y.
    pub axes: &'a [AxisProfile; 2],
}

/// The same in a group of pixels of a row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GaussianGroup {
    flux: f32,
    across: ProfilePart<PixelGroup>,
    down: ProfilePart<f32>,
}

impl SpotLight for GaussianLight<'_> {
    type Group = GaussianGroup;

    #[inline(always)]
    fn flux(&self) -> f32 {
        self.flux
    }

    #[inline(always)]
    fn in_group(&self, group: usize, row: usize) -> GaussianGroup {
        let [across, down] = self.axes;
        GaussianGroup {
            flux: self.flux,
            across: across.group(group),
            down: down.pixel(row),
        }
    }

    #[inline(always)]
    fn fractions(&self, group: usize, row: usize) -> PixelGroup {
        let [across, down] = self.axes;
        let down = down.pixel(row).value;
        each(&across.group(group).value, |share| share * down)
    }
}

impl GroupLight for GaussianGroup {
    #[inline(always)]
    fn flux(&self) -> f32 {
        self.flux
    }

    #[inline(always)]
    fn gradient(&self, lane: usize) -> [f32; 4] {
        spot_gradient(self.flux, &self.across.lane(lane), &self.down)
    }

    #[inline(always)]
    fn gradients(&self) -> [PixelGroup; 4] {
        let Self { across, down, flux } = self;
        let scaled = |values: &PixelGroup, factor: f32| each(values, |value| value * factor);
        let wider = scaled(&across.by_sigma, flux * down.value);
        let higher = scaled(&across.value, flux * down.by_sigma);
        [
            scaled(&across.value, down.value),
            scaled(&across.by_center, flux * down.value),
            scaled(&across.value, flux * down.by_center),
            plus(&wider, &higher),
        ]
    }
}

/// The fraction of a Gaussian spot's light in a pixel, and the derivatives of the light there with
/// respect to x, y and size.
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

/// The light in a pixel, and the gradient of the model of one spot with respect to its parameters,
/// in units of the noise.
#[inline(always)]
pub(crate) fn linearise<G: GroupLight>(spot: &G, lane: usize) -> (f32, [f32; ONE_SPOT]) {
    let [shape, by_x, by_y, by_size] = spot.gradient(lane);
    (spot.flux() * shape, [by_x, by_y, shape, 1.0, by_size])
}

/// Adds `sign` times the light of a spot to the pixels of a window.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(crate) fn add_light<L: SpotLight>(spot: &L, sign: f32, groups: usize, data: &mut [PixelGroup]) {
    let flux = sign * spot.flux();
    for group in 0..groups {
        for (row, pixels) in data.iter_mut().skip(group).step_by(groups).enumerate() {
            let light = each(&spot.fractions(group, row), |share| flux * share);
            *pixels = plus(pixels, &light);
        }
    }
}
